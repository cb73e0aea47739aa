"""What a scene says beside part, arm and throw: facts about the world, effects switched on, deviations."""

from __future__ import annotations

from dataclasses import dataclass, fields

__all__ = ["Deviation", "Effects", "Scatter", "World"]


@dataclass(frozen=True)
class Deviation:
    """A symmetric deviation of a quantity.

    Parameters
    ----------
    value : float
        Half its width: a fraction where `relative`, else in the quantity's own unit in the scene.
    relative : bool
        Whether it is a fraction of the quantity's value.
    """

    value: float
    relative: bool

    def of(self, nominal: float) -> float:
        """Give half the width around a nominal value.

        Examples
        --------
        >>> Deviation(0.01, relative=True).of(-50.0)
        0.5
        """
        return abs(nominal) * self.value if self.relative else self.value


@dataclass(frozen=True)
class Scatter:
    """Noise at every throw.

    Parameters
    ----------
    speed : Deviation or None
        Of the throw's angular speed [fraction or rad/s].
    landing : Deviation or None
        Of where the part lands [scene's length unit].
    """

    speed: Deviation | None = None
    landing: Deviation | None = None


@dataclass(frozen=True)
class World:
    """Facts, known whether or not an effect is simulated; None where not known.

    Parameters
    ----------
    friction : float or None
        Coefficient of friction.
    restitution : float or None
        Coefficient of restitution of the normal impulse, 0 to 1.
    bounce_threshold : float or None
        Height of the bounce below which the impact is plastic [scene's length unit].
    stroke : float or None
        Angle over which the arm accelerates [rad].
    scatter : Scatter or None
        Noise at every throw.
    """

    friction: float | None = None
    restitution: float | None = None
    bounce_threshold: float | None = None
    stroke: float | None = None
    scatter: Scatter | None = None


@dataclass(frozen=True)
class Effects:
    """What is simulated beyond the minimal model.

    Parameters
    ----------
    landing, roll, pivot, slip, bounce, drive, contact : bool
        Whether the effect is simulated.
    spread : str or None
        ``"bounded"`` or ``"gaussian"`` noise at every throw.
    auto : bool
        Let the analysis switch on what the scene calls for.
    """

    landing: bool = False
    roll: bool = False
    pivot: bool = False
    slip: bool = False
    bounce: bool = False
    drive: bool = False
    contact: bool = False
    spread: str | None = None
    auto: bool = False

    def on(self) -> tuple[str, ...]:
        """Give the names of the effects switched on.

        Examples
        --------
        >>> Effects(roll=True, auto=True).on()
        ('roll',)
        """
        return tuple(
            field.name for field in fields(self) if field.name != "auto" and getattr(self, field.name)
        )
