"""The random quantities of a throw, their laws, and the map of a scene with them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.errors import SceneError
from limitsets.robust.noise.laws import Gaussian, Law, Strata, Uniform, certain, regrouped, transformed

if TYPE_CHECKING:
    from limitsets.scene import Scene

LAWS: dict[str, Any] = {"gaussian": Gaussian, "bounded": Uniform}
"""Words for laws: a deviation is the standard deviation of the one, the bound of the other."""


@dataclass(frozen=True)
class Scattering:
    """What differs at every throw, independently of all other throws.

    Parameters
    ----------
    speed : Law or None
        Relative deviation of the throw's angular speed.
    tilt : Law or None
        Deviation of the table's tilt [rad]; the scene has to give gravity.tilt.
    landing : Law or None
        Deviation of the landing place [length].

    Examples
    --------
    >>> from limitsets.robust import Gaussian, Scattering
    >>> Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02)).given()
    ('speed', 'landing')
    """

    speed: Law | None = None
    tilt: Law | None = None
    landing: Law | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            law = getattr(self, field.name)
            if law is not None and not isinstance(law, Law):
                allowed = "a law: Gaussian, Uniform, Given or Samples"
                raise SceneError(f"the noise of {field.name}", law, allowed, "wrap it in one of them")

    def given(self) -> tuple[str, ...]:
        """Names of the quantities that scatter."""
        return tuple(field.name for field in fields(self) if getattr(self, field.name) is not None)

    def scaled(self, factor: float, of: str | None = None) -> Scattering:
        """Return the scattering with deviations `factor` times as large, of one quantity or of all."""
        names = self.given() if of is None else (of,)
        return replace(self, **{name: getattr(self, name).scaled(factor) for name in names})

    def words(self) -> dict[str, str]:
        """Say the laws in words, by quantity."""
        return {name: repr(getattr(self, name)) for name in self.given()}


def scattering_of(scene: Scene) -> Scattering:
    """Read the scattering that a scene gives by `[world] scatter`, its law by `[effects] spread`.

    Raises
    ------
    SceneError
        For a scene without the one or the other.
    """
    scatter, how = scene.world.scatter, scene.effects.spread
    if scatter is None or how is None:
        key, value = ("world.scatter", scatter) if scatter is None else ("effects.spread", how)
        raise SceneError(
            "the noise of the throws",
            value,
            'scatter in [world] with spread = "gaussian" or "bounded" in [effects]',
            "add both to the scene, or pass scatter=Scattering(...)",
            key=key,
            file=scene.file,
        )
    speed, landing, law = scatter.speed, scatter.landing, LAWS[how]
    whole = 1.0 if speed is None or speed.relative else scene.value("throw.speed")
    return Scattering(
        speed=None if speed is None else law(speed.value / whole),
        landing=None if landing is None else law(landing.value),
    )


def kappa_strata(scattering: Scattering, scene: Scene, count: int) -> Strata:
    """Strata of the factor on kappa = gravity / speed^2 that speed and tilt make up together."""
    parts: list[Strata] = []
    # Cut finely first: joined strata keep their mean and variance, not more.
    fine = count if None in (scattering.speed, scattering.tilt) else 4 * count
    if scattering.speed is not None:
        deviation = scattering.speed.strata(fine)
        if deviation.lo <= -1.0:
            remedy = "lower the noise: the arm would turn backwards"
            raise SceneError("the least deviation of the speed", deviation.lo, "above -1", remedy)
        parts.append(transformed(deviation, lambda delta: -2.0 * np.log1p(delta)))
    if scattering.tilt is not None:
        parts.append(_tilted(scattering.tilt.strata(fine), scene))
    if not parts:
        return certain(1.0)
    whole = parts[0] if len(parts) == 1 else regrouped(_sum(*parts), count)
    return transformed(whole, np.exp)


def _tilted(deviation: Strata, scene: Scene) -> Strata:
    tilt = scene.value("gravity.tilt")
    if not (tilt + deviation.lo > 0.0 and tilt + deviation.hi <= 0.5 * math.pi):
        allowed = "tilts above 0 and up to 90 deg"
        found = (tilt + deviation.lo, tilt + deviation.hi)
        raise SceneError("the range of the tilt [rad]", found, allowed, "lower its noise")
    return transformed(deviation, lambda tau: np.log(np.sin(tilt + tau) / math.sin(tilt)))


def _sum(one: Strata, two: Strata) -> Strata:
    """Strata of the sum of two independent deviations."""
    return Strata(
        np.outer(one.weight, two.weight).ravel(),
        np.add.outer(one.mean, two.mean).ravel(),
        np.sqrt(np.add.outer(one.sd**2, two.sd**2)).ravel(),
        one.lo + two.lo,
        one.hi + two.hi,
        one.cut + two.cut,
    )


def still_map(scene: Scene) -> Any:
    """Return the scene's map without its scatter: the minimal one where no other effect is on."""
    if scene.effects.spread is None:
        return scene.map
    from limitsets.thrower.effects.spread import Spread
    from limitsets.thrower.motion import without

    return without(scene.map, Spread)


def thrown(params: Any) -> Callable[[float], Any]:
    """Return the throw map as a function of the factor on kappa."""

    def at(factor: float) -> Any:
        bare = getattr(params, "bare", params)
        moved = bare._replace(kappa=bare.kappa * factor)
        return params._replace(bare=moved) if bare is not params else moved

    return at
