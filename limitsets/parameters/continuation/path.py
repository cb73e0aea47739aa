"""A curve in parameter space: for each t in [0, 1] the map, and the domain it is looked at on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from limitsets.base import AnswerError
from limitsets.feeder.scene import Scene, in_unit_of, unit_of
from limitsets.feeder.scene.quantities import in_units
from limitsets.systems.cells import Domain, as_domain
from limitsets.systems.maps import coerce, domain_of, has_slope, kind_of
from limitsets.systems.maps.contract import compiled_kind_of, require_dimension
from limitsets.systems.sets.end_points import IntervalMap

Values: TypeAlias = Mapping[str, Any]
Curve: TypeAlias = Mapping[str, tuple[Any, Any]] | Callable[[float], Any]

# Samples per side in which changes of branch are looked for; pairs between two samples are found all the same.
SAMPLES = 512


# Of a value: ends of a bracket that are so near are told as one number.
AGREE = 2e-9

# Kinds of ends of pieces that another piece follows.
KINDS = ("critical", "turning", "jump")
# Kinds of ends beyond which a map leaves.
LEAVING = ("exit", "domain")


class Border(NamedTuple):
    """A place where two monotone pieces of a side meet, or one ends with the domain."""

    side: int
    kind: str
    below: int
    above: int
    x_below: float
    x_above: float

    def like(self, other: Border) -> bool:
        """Whether both are of one kind."""
        return self[:4] == other[:4]


@dataclass(frozen=True, eq=False)
class Place:
    """One point of the path.

    Attributes
    ----------
    t : float
        Where on the path.
    values : dict of str to float
        The values that the path sets.
    shown : dict of str to (float, str)
        Likewise, as people read them, each with what follows it: a scene's in the units of its text.
    params : NamedTuple
        The map.
    domain : Domain
        Its domain.
    """

    t: float
    values: dict[str, float]
    shown: dict[str, tuple[float, str]]
    params: Any
    domain: Domain

    @property
    def extent(self) -> float:
        """Extent of the largest side: what distances are compared with."""
        return float(np.max(self.domain.hi - self.domain.lo))

    @property
    def on_line(self) -> bool:
        """Whether sets are found as intervals: a map of one dimension with slopes."""
        return kind_of(self.params).dimension == 1 and has_slope(self.params)

    @cached_property
    def forward(self) -> IntervalMap:
        """Images of intervals, and the monotone pieces."""
        return IntervalMap(self.params, self.domain, SAMPLES)

    @property
    def is_cut(self) -> bool:
        """Whether the monotone pieces are there already."""
        return "forward" in vars(self)

    @cached_property
    def borders(self) -> list[Border]:
        """Where two monotone pieces meet, and where one ends at an exit or with the domain (branch -1 beyond)."""
        edges: list[Border] = []
        for side, pieces in self.forward.pieces.items():
            edges += [
                Border(side, lower.top.kind, lower.branch, upper.branch, lower.top.x, upper.bottom.x)
                for lower, upper in pairwise(pieces)
                if lower.top.kind in KINDS
            ]
            for branch, bottom, top in pieces:
                if top.kind in LEAVING:
                    edges.append(Border(side, top.kind, branch, -1, top.x, top.x))
                if bottom.kind in LEAVING:
                    edges.append(Border(side, bottom.kind, -1, branch, bottom.x, bottom.x))
        return edges


def between(lo: Place, hi: Place) -> str:
    """Say where on the path a bracket is: one value where its ends agree to nine digits, else both, rounded outward."""
    parts = []
    for name, (one, unit) in lo.shown.items():
        other = hi.shown[name][0]
        width = abs(other - one)
        if width <= AGREE * max(abs(one), abs(other)):
            parts.append(f"{name} = {one:.10g}{unit}")
            continue
        digits = 1 - math.floor(math.log10(width))
        step = 10.0**-digits
        ways = (math.floor, math.ceil) if one < other else (math.ceil, math.floor)
        ends = (way(each / step) * step for way, each in zip(ways, (one, other), strict=True))
        parts.append(f"{name} = {' to '.join(f'{each:.{max(digits, 0)}f}' for each in ends)}{unit}")
    return ", ".join(parts)


class Path(NamedTuple):
    """A curve: what it is a curve of, and the place at each t.

    Attributes
    ----------
    name : str
        Of the scene, or of the class of the map.
    unit : str or None
        The scene's unit of length.
    at : callable
        ``at(t)``: the place.
    """

    name: str
    unit: str | None
    at: Callable[[float], Place]


def _wrong(path: Any) -> AnswerError:
    allowed = '{"throw.speed": (first, last)}, or a function of t in [0, 1] that gives the values'
    return AnswerError("the path", path, allowed, "pass one of these")


def _curve(path: Curve, read: Callable[[Any], dict[str, Any]]) -> Callable[[float], Any]:
    """Give the function of a path: of a straight one the values between its ends, each end read as values are."""
    if callable(path):
        return path
    pairs = isinstance(path, Mapping) and path.values()
    if not pairs or not all(isinstance(pair, tuple | list) and len(pair) == 2 for pair in pairs):
        raise _wrong(path)
    first, last = (read({name: pair[k] for name, pair in path.items()}) for k in (0, 1))
    return lambda t: {name: (1.0 - t) * first[name] + t * last[name] for name in first}


def _of_scene(scene: Scene, path: Curve) -> Path:
    def read(values: Any) -> dict[str, float]:
        if not isinstance(values, Mapping):
            raise _wrong(values)
        return {name: in_units(scene.unit, name, value) for name, value in values.items()}

    curve = _curve(path, read)

    def at(t: float) -> Place:
        values = read(curve(t))
        there = scene.with_values(values)
        shown = {
            name: (in_unit_of(scene, name, value), f" {unit_of(scene, name)}")
            for name, value in values.items()
        }
        return Place(t, values, shown, there.map, there.domain)

    return Path(scene.name, scene.unit, at)


def _of_map(params: Any, path: Curve, domain: Any) -> Path:
    compiled_kind_of(params, "continuation")
    box = as_domain(domain_of(params) if domain is None else domain)
    require_dimension(params, "domain", box.dimension)
    box.require_ends("the domain of continuation")
    curve = _curve(path, dict)

    def at(t: float) -> Place:
        given = curve(t)
        if isinstance(given, type(params)):
            there = given
        elif isinstance(given, Mapping) and set(given) <= set(params._fields):
            there = params._replace(**given)
        else:
            raise AnswerError(
                "a point of the path",
                given,
                f"values of {', '.join(params._fields)}",
                "name parameters of the map",
            )
        there = coerce(there)
        kept = given if isinstance(given, Mapping) else there._asdict()
        values = {name: float(value) for name, value in kept.items() if np.ndim(value) == 0}
        return Place(t, values, {name: (value, "") for name, value in values.items()}, there, box)

    return Path(kind_of(params).name, None, at)


def read_path(subject: Any, path: Curve, domain: Any) -> Path:
    """Read a path of a scene, or of a map; AnswerError for what is none."""
    if isinstance(subject, Scene) and domain is not None:
        raise AnswerError("the domain", domain, "None: a scene has its own", "leave it out")
    unchecked = _of_scene(subject, path) if isinstance(subject, Scene) else _of_map(subject, path, domain)
    names = set(unchecked.at(0.0).values)

    def at(t: float) -> Place:
        place = unchecked.at(t)
        if set(place.values) != names:
            raise AnswerError(
                "the values of the path",
                sorted(place.values),
                ", ".join(sorted(names)),
                "give the same for all t",
            )
        return place

    return unchecked._replace(at=lru_cache(maxsize=65_536)(at))  # a place remembers what was found there
