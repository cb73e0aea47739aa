"""The machines that a film leaves possible: fitted values, how far each may be off, how these go together, the scatter.

The size of a quantity's uncertainty is its own 95 % interval; correlations are those of the likelihood at its maximum.
All quantities together lie in an ellipsoid with 95 %.  The errors follow Student's law with `spare` degrees of freedom,
so that the half axis of the ellipsoid's box along each of p quantities is sqrt(p F) / t times the size, with the 95 %
points of F(p, spare) and of t(spare) (Hotelling's T^2: Anderson, An Introduction to Multivariate Statistical Analysis,
2003, section 5.2).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import ROUND_CEILING, Context, Decimal
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import DataError, SceneError
from limitsets.base.arrays import Array
from limitsets.feeder.scattering import Gaussian, Scattering
from limitsets.feeder.scene import Scene, in_unit_of, in_units_of, unit_of
from limitsets.parameters.margins.deviations import deviation_scale

LEVEL = 0.95
SIGMAS = 3.0
"""Throws scatter without a bound: so many standard deviations are taken for a bound (1 throw in 370 is outside)."""

# A larger share of a value is no tolerance: what is fitted is then not known at all.
MOST = 0.99
# Draws of one machine until the part and the throw can be.
TRIES = 1000


def rounded_up(value: float) -> str:
    """Write a size with three digits, not less than it is.

    Examples
    --------
    >>> rounded_up(0.12341)
    '0.124'
    """
    return f"{Context(prec=3, rounding=ROUND_CEILING).create_decimal(Decimal(repr(value))):f}"


def with_uncertainty(
    given: Scene, values: Mapping[str, float], halves: Mapping[str, float], scatter: Mapping[str, float]
) -> Scene:
    """Return a scene with values, deviations as [tolerance], and scatter in [world], in the scene's own units.

    Parameters
    ----------
    given : Scene
        The scene.
    values, halves : mapping of str to float
        Values, and deviations to either side, by quantity, in the scene's units; infinite for no tolerance.
    scatter : mapping of str to float
        Standard deviations at every throw: of throw.speed as a share, of landing.x [length].
    """
    scene = in_units_of(given.with_values(values), given, [*values])
    tree, tolerance = scene.as_dict(), {}
    for quantity, half_width in halves.items():
        name = "throw.speed" if quantity == "throw.kappa" else quantity
        share = deviation_scale(scene, name).relative
        # the speed goes as the inverse square root of kappa
        per = (0.5 if quantity == "throw.kappa" else 1.0) / values[quantity] if share else 1.0
        half = per * half_width
        if half < (MOST if share else math.inf):
            size, unit = (
                (100.0 * half, "%") if share else (in_unit_of(given, name, half), unit_of(given, name))
            )
            tolerance[name] = f"{rounded_up(size)} {unit}"
    kept = {name: text for name, text in tree.get("tolerance", {}).items() if name not in tolerance}
    tree["tolerance"] = kept | tolerance
    length, rate = scatter.get("landing.x", math.inf), scatter.get("throw.speed", math.inf)
    texts = {}
    if math.isfinite(length):
        size, unit = in_unit_of(given, "landing.x", length), unit_of(given, "landing.x")
        texts["landing"] = f"{rounded_up(size)} {unit}"
    if rate < MOST:
        texts["speed"] = f"{rounded_up(100.0 * rate)} %"
    tree["world"] = {**tree.get("world", {}), "scatter": texts}
    return Scene.of(tree, given.file)


@dataclass(frozen=True, eq=False)
class Machines:
    """The machines that a film leaves possible.

    Attributes
    ----------
    values, halves : dict of str to float
        The most likely value of each quantity, and how far its 95 % interval reaches from there [units of a scene].
    together : tuple of str
        Quantities that are uncertain together; each other one lies anywhere in its interval, the middle of which is its
        value.
    correlation : ndarray, shape (p, p)
        Of these quantities.
    spare : int
        Degrees of freedom with which the scatter was estimated.
    scatter : dict of str to (float, float)
        Standard deviation at every throw, the most likely one and the end of its interval: of throw.speed as a share,
        of landing.x [length].
    unit : str
        Of lengths.
    part : dict
        The part that was filmed, as its scene gives it.
    """

    values: dict[str, float]
    halves: dict[str, float]
    together: tuple[str, ...]
    correlation: Array
    spare: int
    scatter: dict[str, tuple[float, float]]
    unit: str
    part: dict[str, Any]

    @classmethod
    def of(cls, record: Mapping[str, Any], file: str | None = None) -> Machines:
        """Take them from what a fit says: `limitsets.fitting.Fit.to_json`, or fit.json.

        Raises
        ------
        DataError
            No record of a fit, or a fit that leaves a quantity open.
        """
        try:
            linked = record["correlation"]
            together, matrix = tuple(linked["names"]), np.array(linked["matrix"], dtype=np.float64)
            quantities = {
                name: each
                for name, each in record["quantities"].items()
                if name not in record["undetermined"]
            }
            ends = {name: (each["lo"], each["value"], each["hi"]) for name, each in quantities.items()}
            scatter = {name: (each["value"], each["hi"]) for name, each in record["scatter"].items()}
            spare, unit, part = linked["spare"], record["unit"], record["scene"]["part"]
            wanting = [
                name
                for name, three in ends.items()
                if None in three or (name in together and not quantities[name]["bounded"])
            ]
        except (AttributeError, KeyError, TypeError, ValueError):
            raise DataError(
                "the fit",
                "not one",
                "the fit.json that limitsets fit writes with -o",
                "name that file",
                file=file,
            ) from None
        wanting += [f"scatter of {name}" for name, each in scatter.items() if None in each]
        if wanting:
            raise DataError(
                "the fit", f"no 95 % interval of {', '.join(wanting)}", "both ends of every quantity",
                "film more throws: limitsets fit says which", file=file,
            )  # fmt: skip
        values, halves = {}, {}
        for name, (lo, value, hi) in ends.items():
            values[name] = value if name in together else 0.5 * (lo + hi)
            halves[name] = max(values[name] - lo, hi - values[name])
        return cls(
            values=values, halves=halves, together=together, correlation=matrix, spare=spare, scatter=scatter,
            unit=unit, part=part,
        )  # fmt: skip

    @classmethod
    def read(cls, path: str | Path) -> Machines:
        """Read fit.json, as `limitsets fit -o DIR` writes it.

        Raises
        ------
        DataError
            No such file, or not a fit's.
        """
        try:
            record = json.loads(Path(path).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or "not JSON"
            raise DataError(
                "the fit",
                reason,
                "the fit.json that limitsets fit writes with -o",
                "name that file",
                file=str(path),
            ) from None
        return cls.of(record, str(path))

    @cached_property
    def _student(self) -> float:
        """The 95 % point of Student's law: by so much an interval is longer than the scale of its errors."""
        from scipy.stats import t as student

        return float(student.ppf(0.5 + 0.5 * LEVEL, self.spare))

    def stretch(self, count: int) -> float:
        """Say how much farther than the interval of each alone the 95 % region of so many quantities reaches.

        Examples
        --------
        >>> none = {}
        >>> machines = Machines(none, none, (), np.eye(0), spare=10**6, scatter=none, unit="mm", part=none)
        >>> round(machines.stretch(2), 4)  # the root of chi-square's 5.9915, over 1.96
        1.2489
        """
        from scipy.stats import f as f_law

        return math.sqrt(count * float(f_law.ppf(LEVEL, count, self.spare))) / self._student

    @property
    def box(self) -> dict[str, float]:
        """Half axes of the box of the 95 % ellipsoid, and half the interval of each other quantity [scene's units]."""
        return {
            name: half * (self.stretch(len(self.together)) if name in self.together else 1.0)
            for name, half in self.halves.items()
        }

    @property
    def noise(self) -> dict[str, str]:
        """Three standard deviations of the scatter, at most, as proofs take what differs at every throw."""
        texts = {"throw.speed": (100.0, "%"), "landing.x": (1.0, self.unit)}
        sizes = {name: SIGMAS * texts[name][0] * most for name, (_, most) in self.scatter.items()}
        return {name: f"{rounded_up(size)} {texts[name][1]}" for name, size in sizes.items() if size > 0.0}

    @property
    def scattering(self) -> Scattering:
        """The scatter of trials: normal, as likely as the film makes it; at its end where none is most likely."""
        speed, landing = (
            likely or most for likely, most in (self.scatter[n] for n in ("throw.speed", "landing.x"))
        )
        return Scattering(
            speed=Gaussian(speed) if speed > 0.0 else None,
            landing=Gaussian(landing) if landing > 0.0 else None,
        )

    def sentence(self, proved: float, refuted: float | None) -> str:
        """Say of how much of the box the goal is proved, given a joint margin of it with its noise."""
        noise = f"{SIGMAS:g} standard deviations of its scatter at every throw"
        of = f"the box of the film's {100 * LEVEL:g} % ellipsoid, with {noise}"
        if proved >= 1.0:
            return f"The goal is proved for every machine in {of}: it holds up to {proved:.4g} times these."
        fails = "" if refuted is None else f"; from {refuted:.4g} of them on one machine fails"
        if proved == 0.0:
            return f"The goal is proved for no part of {of}{fails}."
        return f"The goal is proved for {proved:.4g} of the axes of {of}, which count as much{fails}."

    def on(self, scene: Scene) -> Scene:
        """Return a scene of this part as the most likely machine: the box as [tolerance], the scatter in [world].

        Raises
        ------
        DataError
            The scene is of another part, or in another unit.
        """
        same = _outline(self.part) == _outline(scene.text["part"])
        if scene.unit != self.unit or not same:
            raise DataError(
                "the fit", f"in {self.unit}, of {'the same' if same else 'another'} part",
                f"in {scene.unit}, of the part of {scene.name}", "fit this scene to the film: limitsets fit",
            )  # fmt: skip
        likely = {name: value or most for name, (value, most) in self.scatter.items()}
        return with_uncertainty(scene, self.values, self.box, likely)

    def drawn(self, scene: Scene, count: int, seed: int = 0) -> Iterator[Scene]:
        """Draw machines: Student's law of those uncertain together, the others uniform in their intervals.

        Parameters
        ----------
        scene : Scene
            Of `on`.
        count : int
            How many.
        seed : int
            Of the random numbers.
        """
        random = np.random.Generator(np.random.Philox(seed))
        root = np.linalg.cholesky(self.correlation)
        for _ in range(count):
            for _ in range(TRIES):
                spread = root @ random.standard_normal(len(self.together)) / self._student
                spread *= math.sqrt(self.spare / random.chisquare(self.spare))
                off = dict(zip(self.together, spread.tolist(), strict=True))
                shares = {name: off.get(name, random.uniform(-1.0, 1.0)) for name in self.values}
                try:
                    yield scene.with_values({n: self.values[n] + self.halves[n] * shares[n] for n in shares})
                    break
                except SceneError:  # no such part
                    continue
            else:
                raise DataError(
                    "the fit", f"none of {TRIES} machines drawn from it can be", "mostly machines that can be",
                    "film more throws", file=scene.file,
                )  # fmt: skip

    def ellipse(self, x: str, y: str, points: int = 181) -> Array:
        """Give the outline of the 95 % region of two quantities, shape (points, 2) [scene's units]."""
        at = [self.together.index(name) for name in (x, y)]
        angle = np.linspace(0.0, 2.0 * math.pi, points)
        circle = np.stack([np.cos(angle), np.sin(angle)])
        about = np.linalg.cholesky(self.correlation[np.ix_(at, at)]) @ circle * self.stretch(2)
        middle, size = (np.array([each[name] for name in (x, y)]) for each in (self.values, self.halves))
        return np.asarray(middle + size * about.T)


def _outline(part: Mapping[str, Any]) -> list[Any]:
    """Give what a fit leaves of a part as it is."""
    return [part.get(name) for name in ("sides", "vertices", "holes")]
