"""The box of map parameters given by a scene's decimals, tolerances and noise, and the effects that it can hold.

From the text of the scene, in exact rational spans (`numbers.py`), through the same formulas of `geometry` that floats
go through; only the last step rounds to doubles, outward.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Mask
from limitsets.feeder.geometry import cross, side_ends
from limitsets.feeder.geometry.polygon import Vector, above_side
from limitsets.feeder.scene import Numbers, Scene
from limitsets.feeder.scene.numbers import corners_of
from limitsets.feeder.scene.quantities import base_unit, find, text_at, texts
from limitsets.feeder.scene.units import exact_factor, parse, share_of_pi
from limitsets.feeder.thrower import Throw
from limitsets.feeder.thrower.effects import EFFECTS
from limitsets.feeder.thrower.effects.spread import Spread
from limitsets.feeder.thrower.motion import FullThrow, Outline, without
from limitsets.proofs.prover.numbers import (
    Jet,
    RationalInterval,
    about,
    angle,
    middle,
    pi,
    root,
    sine,
    square_root,
)
from limitsets.proofs.prover.tolerances import NARROWER, whole

# ----------------------------------------------------------------
# Effects in proofs: the maps that can be enclosed, and the effects that count as noise.
#
# Landing and roll make another map, which has an `image_box` of its own.  A bounded spread is noise: the minimal map,
# or that with the other effects, thrown with anything in its bounds at every throw.


REMEDY = "leave the others out of [effects] for a proof; orbits and limit sets by samples have them"

# The scatter of the world and the noise of a proof, by their names.
NOISE = {"speed": "throw.speed", "landing": "landing.x"}


def simulated(scene: Scene) -> FullThrow | None:
    """Return the scene's map with the effects that are more than noise; None where there are none.

    Raises
    ------
    AnswerError
        An effect of which nothing can be proved.
    """
    for effect in scene.effects.on():
        if not EFFECTS[effect].enclosed:
            known = [name for name, each in EFFECTS.items() if each.enclosed and name != "spread"]
            allowed = f"{', '.join(known)} and bounded spread"
            raise AnswerError("the effects of a proof", effect, allowed, REMEDY)
    if scene.effects.spread not in (None, "bounded"):
        raise AnswerError(
            "the effect spread",
            scene.effects.spread,
            '"bounded": normal deviations have no bound, so that nothing holds for every sequence of throws',
            'write spread = "bounded", with bounds in [world] scatter',
        )
    throw = without(scene.map, Spread)
    return throw if isinstance(throw, FullThrow) else None


def scattered(scene: Scene) -> dict[str, str]:
    """Return the scene's bounded spread as noise, by quantity."""
    if scene.effects.spread != "bounded":
        return {}
    table = scene.text["world"]["scatter"]
    return {name: table[word] for word, name in NOISE.items() if word in table}


def joined(noise: Mapping[str, str], scatter: Mapping[str, str]) -> dict[str, str]:
    """Join the noise asked for with what the scene scatters.

    Raises
    ------
    AnswerError
        The two give one quantity different deviations.
    """
    for name in noise.keys() & scatter.keys():
        if noise[name] != scatter[name]:
            allowed = f"{scatter[name]}, as the scene scatters it"
            raise AnswerError(f"the noise of {name}", noise[name], allowed, "leave one of them out")
    return {**scatter, **noise}


# ----------------------------------------------------------------
# The box of map parameters given by a scene's decimals, tolerances and noise.


VARYING = ("throw.speed", "gravity.tilt", "landing.x")
"""What may differ from throw to throw; a part's geometry does not."""


@dataclass(frozen=True, eq=False)
class ParameterBox:
    """A box of parameters of the throw map, and the scenes and the noise that it encloses.

    Attributes
    ----------
    lo, hi : Throw or FullThrow
        Its corners, as kernels take them; with effects where they are more than noise.
    scene : dict
        The scene as written; a quantity with a tolerance is a pair of texts.
    noise : dict of str to str
        Quantities that differ at every throw, and by how much.
    landing : float
        A part lands within this of where the throw would put it; in the scene's unit, 0 without such noise.
    """

    lo: Throw | FullThrow
    hi: Throw | FullThrow
    scene: dict[str, Any]
    noise: dict[str, str]
    landing: float = 0.0

    @property
    def bare(self) -> tuple[Throw, Throw]:
        """The corners of the minimal model's parameters."""
        lo, hi = (each.bare if isinstance(each, FullThrow) else each for each in (self.lo, self.hi))
        return lo, hi

    @property
    def effects(self) -> bool:
        """Whether more than the minimal model is thrown."""
        return isinstance(self.lo, FullThrow)

    @property
    def rests(self) -> Mask:
        """On which sides the part rests; on the others it tips over, for all parameters."""
        return (self.lo.a > 0) & (self.hi.a < self.lo.length)

    @property
    def concave(self) -> bool:
        """Whether heights are concave: what goes one way then depends continuously on its start and on kappa."""
        lo, hi = self.bare
        return bool((lo.kappa > np.hypot(hi.a, hi.d) * (1.0 + 1e-12)).all())

    @property
    def middle_kappa(self) -> float:
        """Kappa of a throw without noise, to rounding."""
        return 0.5 * (self.lo.kappa + self.hi.kappa)

    @property
    def kappa_varies(self) -> bool:
        """Whether kappa is another one at every throw."""
        return "throw.speed" in self.noise or "gravity.tilt" in self.noise

    def at_kappa(self, kappa: float) -> Throw | FullThrow:
        """Return one map of the box, thrown with a kappa."""
        bare = self.bare[0]._replace(kappa=kappa)
        return self.lo._replace(bare=bare) if isinstance(self.lo, FullThrow) else bare


class _Spans(Numbers):
    """Spans of the quantities of one scene, in its unit of length, with the noise of its throws.

    Parameters
    ----------
    unit : str
        The scene's unit of length.
    tree : mapping
        Its text, quantities with a tolerance as pairs of texts.
    noise : mapping of str to str, optional
        What differs at every throw.
    instead : mapping of str to RationalInterval or Jet, optional
        Numbers that replace quantities.
    """

    def __init__(
        self,
        unit: str,
        tree: Mapping[str, Any],
        noise: Mapping[str, str] | None = None,
        instead: Mapping[str, RationalInterval | Jet] | None = None,
    ) -> None:
        super().__init__(tree, root, sine, pi())
        self.unit, self.noise, self.instead = unit, noise or {}, instead or {}

    def number(self, name: str) -> Any:
        """Return a quantity, as throws have it."""
        span = self.span(name)
        if name == "throw.kappa":
            share, more = self.deviation("throw.speed")
            if more.hi > 0:
                raise AnswerError(
                    "the noise", self.noise, "percent, for a scene given by kappa", "give it in percent"
                )
            speed = RationalInterval(1 - share.hi, 1 + share.hi)
            return span * self.share_of_gravity() / (speed * speed)
        if name == "gravity.acceleration":
            span = span * self.share_of_gravity()
        elif name in VARYING:
            share, more = self.deviation(name)
            span = RationalInterval((span * (1 - share) - more).lo, (span * (1 + share) + more).hi)
        return self._possible(name, span)

    def _possible(self, name: str, span: Any) -> Any:
        """Refuse a speed or a gravity that may be 0, and a tilt that may lie level or overhang."""
        if name == "gravity.tilt":
            most = (pi() / 2).lo if name in self.noise else (pi() / 2).hi
            if not (span.lo > 0 and span.hi <= most):
                shown = self.tree["gravity"]["tilt"]
                text = f"{shown} +- {self.noise[name]}" if name in self.noise else shown
                raise AnswerError(name, text, "from 0 to 90 degrees", NARROWER)
        elif name in ("throw.speed", "gravity.acceleration") and not span.lo > 0:
            raise AnswerError("the speed or gravity", self.tree["throw"], "above 0 throughout", NARROWER)
        return span

    def span(self, name: str) -> Any:
        """Return a quantity, or the span between the two texts of a tolerance, or what stands in for it."""
        if name in self.instead:
            return self.instead[name]
        spelled = text_at(self.tree, name)
        pair = spelled if isinstance(spelled, list) else [spelled, spelled]
        lo, hi = (self.constant(text, find(name).dimension) for text in pair)
        return RationalInterval(lo.lo, hi.hi)

    def constant(self, text: str, dimension: str, key: str = "") -> RationalInterval:
        """Return a text of a dimension."""
        quantity = parse(text, dimension)
        number = Fraction(quantity.number)
        share = share_of_pi(quantity.unit)
        if share is not None:
            return pi() * RationalInterval.of(share * number)
        return RationalInterval.of(number * exact_factor(quantity.unit, base_unit(dimension, self.unit)))

    def polygon(self, outline: Sequence[Vector]) -> Sequence[Vector]:
        """Return the corners of the convex hull, throughout a tolerance the same; else the part is refused."""
        hull = super().polygon(outline)
        if self.instead or not any(
            isinstance(text, list) for pair in self.tree["part"]["vertices"] for text in pair
        ):
            return hull
        count, corners = len(hull), self.corners
        for k, point in enumerate(hull):
            if _least_cross(hull[k - 1], point, hull[(k + 1) % count]) <= 0:
                raise _other_hull(f"perhaps without the corner at vertex {corners[k]}")
        for vertex in sorted(set(range(len(outline))) - set(corners)):
            if any(_least_cross(hull[k - 1], hull[k], outline[vertex]) < 0 for k in range(count)):
                raise _other_hull(f"perhaps with a corner at vertex {vertex}")
        return hull

    def deviation(self, name: str) -> tuple[RationalInterval, RationalInterval]:
        """Return the noise of a quantity as a share of it, and in its own dimension; one of the two is 0."""
        text = self.noise.get(name)
        if text is None:
            return RationalInterval.of(0), RationalInterval.of(0)
        if text.rstrip().endswith("%"):
            return RationalInterval.of(Fraction(parse(text, "share").number) / 100), RationalInterval.of(0)
        return RationalInterval.of(0), self.constant(text, find(name).dimension)

    def share_of_gravity(self) -> RationalInterval:
        """Return the factor by which the noise of the tilt changes g: sin(tilt +- dev) / sin(tilt).

        Both ends are farthest from 1 at the smallest tilt: (1 +- p) cot((1 +- p) t) against cot(t), and cot(t) alone.
        """
        if "gravity.tilt" not in self.noise:
            return RationalInterval.of(1)
        if "tilt" not in self.tree.get("gravity", {}):
            raise AnswerError(
                "the noise of gravity.tilt",
                self.noise["gravity.tilt"],
                "noise of a quantity that the scene gives",
                "give the scene [gravity] tilt, or leave this noise out",
            )
        self.number("gravity.tilt")
        share, more = self.deviation("gravity.tilt")
        spelled = text_at(self.tree, "gravity.tilt")
        least = self.constant(spelled[0] if isinstance(spelled, list) else spelled, "angle")
        flat, steep = sine(least * (1 - share) - more), sine(least * (1 + share) + more)
        return RationalInterval((flat / sine(least)).lo, (steep / sine(least)).hi)

    def body(self) -> tuple[list[tuple[Any, ...]], Any]:
        """Return (a, d, length) of every side, and the radius of gyration."""
        corner = RationalInterval.of(0, 4)  # of no use to a proof about the minimal map
        return [side[:3] for side in self.sides(lambda _y, _x: corner)], self.shape.radius_of_gyration

    def narrow_body(self) -> tuple[list[tuple[Any, ...]], RationalInterval]:
        """As `body`, but narrower where several of its numbers are known to a tolerance only."""
        plain, radius = self.body()
        # a pair of texts is a quantity with a tolerance, or a single value of a search
        names = [n for n, t in texts(self.tree["part"], "part") if isinstance(t, list) and t[0] != t[1]]
        if not names:
            return plain, radius
        box = [self.span(name) for name in names]
        middles = [middle(span) for span in box]
        unit = [[RationalInterval.of(int(j == k)) for j in range(len(names))] for k in range(len(names))]
        rising = [Jet(span, tuple(row)) for span, row in zip(box, unit, strict=True)]
        centre, steep = (
            _Spans(self.unit, self.tree, instead=dict(zip(names, values, strict=True))).body()
            for values in (middles, rising)
        )
        offsets = [span - mid for span, mid in zip(box, middles, strict=True)]
        sides = [
            tuple(about(mid, rise, offsets, known) for mid, rise, known in zip(*rows, strict=True))
            for rows in zip(centre[0], steep[0], plain, strict=True)
        ]
        return sides, about(centre[1], steep[1], offsets, radius)

    def seen_from_sides(
        self,
    ) -> tuple[list[RationalInterval], list[list[RationalInterval]], list[list[RationalInterval]]]:
        """Return the exterior angles, and where the vertices are: p and q of `thrower.motion.Outline`."""
        vertices, sides = self.shape.vertices, self.sides(angle)
        ends = [side_ends(len(vertices), side) for side in range(len(vertices))]
        p, q = [], []
        for (left, right), side in zip(ends, sides, strict=True):
            at = [above_side(vertices[left], vertices[right], vertices[k], square_root) for k, _ in ends]
            p.append([along - side[0] for along, _, _ in at])
            q.append([above - side[1] for _, above, _ in at])
        return [side[4] for side in sides], p, q


def body_of(scene: Scene, tolerance: Mapping[str, str]) -> list[tuple[RationalInterval, ...]]:
    """Enclose (a, d, length) of every side of a scene's part, throughout a tolerance.

    Raises
    ------
    AnswerError
        A quantity that the scene does not give, or a tolerance in which the part may be none.
    """
    tree = whole(scene, tolerance).tree()
    _require_corners(scene, tree)
    try:
        return _Spans(scene.unit, tree).narrow_body()[0]
    except (ZeroDivisionError, ValueError):
        raise _no_part() from None


def _least_cross(start: Vector, end: Vector, point: Vector) -> Fraction:
    """Give the least cross product of vertices in their spans: affine in each coordinate, it is that of a corner."""
    box = [sorted({span.lo, span.hi}) for vertex in (start, end, point) for span in vertex]
    least: Fraction = min(cross(at[:2], at[2:4], at[4:]) for at in product(*box))
    return least


def _require_corners(scene: Scene, tree: Mapping[str, Any]) -> None:
    """Refuse values in the middle of which the hull has other corners: sides would bear other numbers."""
    corners, own = corners_of(tree["part"]), corners_of(scene.text["part"])
    if tuple(corners) != tuple(own):
        raise _other_hull(f"one with the corners {', '.join(map(str, corners))} of its hull")


def _other_hull(how: str) -> AnswerError:
    allowed = "one with the same convex hull, throughout the tolerance"
    return AnswerError("the part", how, allowed, NARROWER)


def _no_part() -> AnswerError:
    """Refuse a length that may be nothing, sides that do not meet, a flat corner."""
    return AnswerError("the part", "of no convex shape", "one, throughout the tolerance", NARROWER)


def _require_rest(
    sides: Sequence[tuple[Any, ...]],
    rests: Sequence[bool],
    kappa: RationalInterval,
    radius: RationalInterval,
) -> None:
    """Refuse parameters if some of them fit no part, or a part that tips over where the scene's part rests."""
    for side, ((a, d, length), stays) in enumerate(zip(sides, rests, strict=True)):
        good = a.lo > 0 and a.hi < length.lo if stays else a.hi <= 0 or a.lo >= length.hi
        if not (good and d.lo > 0):
            does = "rests" if stays else "tips over the same end"
            raise AnswerError(
                f"side {side}", float(a), f"a side on which the part {does}, throughout", NARROWER
            )
    if not (kappa.lo > 0 and radius.lo > 0):
        raise AnswerError("kappa or the radius of gyration", float(kappa), "above 0 throughout", NARROWER)


def _columns(spans: Sequence[Any]) -> Any:
    """Doubles around spans, or rows of them: the lower ends, the upper ends."""
    pairs = np.array(
        [[each.outward() for each in row] if isinstance(row, list) else row.outward() for row in spans]
    )
    return np.moveaxis(pairs, -1, 0)


def parameter_box(
    scene: Scene, *, tree: Mapping[str, Any] | None = None, noise: Mapping[str, str] | None = None
) -> ParameterBox:
    """Enclose the parameters of a scene's map.

    Parameters
    ----------
    scene : Scene
        The scene.
    tree : mapping, optional
        Its text with some quantities replaced by pairs of texts; default as written.
    noise : mapping of str to str, optional
        ``{"throw.speed": "0.3 %"}``: differs at every throw; of `VARYING`.

    Returns
    -------
    ParameterBox
        Doubles around the exact numbers.

    Raises
    ------
    AnswerError
        Noise of anything else or of what the scene does not give, or parameters some of which cannot be.

    Examples
    --------
    >>> import limitsets as ls
    >>> box = parameter_box(ls.load("paper-designed"))
    >>> box.lo.kappa < box.hi.kappa  # 25.3778518 is no double
    True
    """
    text: Any = copy.deepcopy(dict(scene.text if tree is None else tree))
    _require_corners(scene, text)
    reader = _Spans(scene.unit, text, noise)
    for name in noise or {}:
        if name not in VARYING:
            raise AnswerError(
                "the noise", name, ", ".join(VARYING), "what is fixed but unknown is a tolerance"
            )
    kappa = reader.kappa
    scatter = reader.deviation("landing.x")[1]
    landing = scatter.outward()[1] if scatter.hi > 0 else 0.0
    try:
        sides, radius = reader.narrow_body()
        full = simulated(scene)
        angles, p, q = reader.seen_from_sides() if full is not None else ([], [], [])
    except (ZeroDivisionError, ValueError):
        raise _no_part() from None
    _require_rest(sides, scene.sides.rests.tolist(), kappa, radius)
    scalars = [kappa, reader.number("arm.surface_height"), reader.number("arm.length"), radius]
    ends = [span.outward() for span in scalars]
    columns = [np.array([side[k].outward() for side in sides]) for k in range(3)]
    corner = _columns(angles) if angles else np.full((2, len(sides)), np.nan)
    model: Any = Throw
    flight, flip = scene.bare_map.flight, scene.bare_map.flip
    lo, hi = (
        model(
            flight,
            flip,
            *(pair[end] for pair in ends),
            *(np.ascontiguousarray(c[:, end]) for c in columns),
            np.ascontiguousarray(corner[end]),
        )
        for end in (0, 1)
    )
    if full is not None:
        lo, hi = (
            full._replace(bare=bare, outline=Outline(_columns(p)[end].copy(), _columns(q)[end].copy()))
            for end, bare in ((0, lo), (1, hi))
        )
    return ParameterBox(lo, hi, text, dict(noise or {}), landing)
