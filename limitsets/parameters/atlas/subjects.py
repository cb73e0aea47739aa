"""What a plan varies: axes, and a scene by its quantities or any registered map by the fields of its parameters."""

from __future__ import annotations

import hashlib
import importlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from limitsets.base import AnswerError, LimitsetsError, MapError, SceneError
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.quantities import base_unit, find, replaced, unit_read
from limitsets.feeder.scene.units import Quantity, convert, parse
from limitsets.systems.cells import Domain
from limitsets.systems.graph.agreement import require_agreement
from limitsets.systems.maps.written import modules_of

# ----------------------------------------------------------------
# The values of one quantity in a plan, the same floats on every machine.


_BARE = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")
_MOST = 10_000_000
ALLOWED = 'NAME=LO:HI:COUNT, like throw.speed=120:180:1000 or "throw.speed=120 deg/s:180 deg/s:1000"'


@dataclass(frozen=True, eq=False)
class Axis:
    """Values of one quantity.

    Attributes
    ----------
    name : str
        The quantity of a scene, or the field of a map's parameters.
    values : ndarray, shape (n,)
        Its values [`unit`], in ascending order.
    unit : str
        Their unit; empty for a field of a map.

    Raises
    ------
    LimitsetsError
        No values, values that are not finite, or not in ascending order.

    Examples
    --------
    >>> Axis("arm.surface_height", [-1.0, -0.5, 0.2], "in").values.size
    3
    """

    name: str
    values: npt.NDArray[np.float64]
    unit: str = ""

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=np.float64)
        good = values.ndim == 1 and 0 < values.size <= _MOST and np.isfinite(values).all()
        if not good or (np.diff(values) <= 0).any():
            raise LimitsetsError(
                f"the values of {self.name}", f"{values.size} numbers", "finite numbers in ascending order",
                f"give from 1 to {_MOST} of them",
            )  # fmt: skip
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    @property
    def record(self) -> dict[str, Any]:
        """What a store keeps of it, to recognise it again."""
        ends = {"first": float(self.values[0]), "last": float(self.values[-1]), "count": self.values.size}
        digest = hashlib.sha256(self.values.astype("<f8").tobytes()).hexdigest()
        return {"name": self.name, "unit": self.unit, **ends, "sha256": digest}


def axis_of(text: object, unit_of: Callable[[str, str | None], str]) -> Axis:
    """Read an axis.

    Parameters
    ----------
    text : str or Axis
        ``"NAME=LO:HI:COUNT"``; the two ends with units, or bare in the unit in which people read the quantity.
    unit_of : callable
        The unit of a quantity, from its name and the text of an end with a unit, or None.

    Returns
    -------
    Axis
        Value k is the float nearest to LO + k (HI - LO)/(COUNT - 1), computed in fractions.

    Raises
    ------
    LimitsetsError
        Text of another form, or no such quantity.

    Examples
    --------
    >>> axis_of("r=2.8:4:5", lambda name, text: "").values.tolist()
    [2.8, 3.1, 3.4, 3.7, 4.0]
    """
    if isinstance(text, Axis):
        unit_of(text.name, f"1 {text.unit}" if text.unit else None)
        return text
    name, sign, rest = (part.strip() for part in str(text).partition("="))
    parts = [part.strip(" '\"") for part in rest.split(":")]
    if not sign or len(parts) != 3:
        raise LimitsetsError("the axis", text, ALLOWED, "correct it")
    ends, units = zip(*(_taken_apart(part, text) for part in parts[:2]), strict=True)
    if (units[0] is None) != (units[1] is None) or len(set(units)) > 1:
        raise LimitsetsError("the axis", text, ALLOWED, "give both ends in one unit, or both without")
    unit = unit_of(name, None if units[0] is None else parts[0])
    count = int(parts[2]) if re.fullmatch("[0-9]{1,9}", parts[2]) else 0
    lo, hi = ends
    if not ((2 <= count <= _MOST and lo < hi) or (count == 1 and lo == hi)):
        remedy = f"LO has to be below HI, and COUNT from 2 to {_MOST} (1 where LO is HI)"
        raise LimitsetsError("the axis", text, ALLOWED, remedy)
    exact = (lo + (hi - lo) * k / max(count - 1, 1) for k in range(count))
    return Axis(name, np.array([float(each) for each in exact]), unit)


def _taken_apart(word: str, text: object) -> tuple[Fraction, str | None]:
    number, _, unit = word.partition(" ")
    if not _BARE.fullmatch(number):
        raise LimitsetsError(
            "the axis", text, ALLOWED, f"{word!r} is no number, or lacks the blank before its unit"
        )
    return Fraction(number), unit.strip() or None


# ----------------------------------------------------------------
# What a plan varies: a scene by its quantities, or any registered map by the fields of its parameters.


Array: TypeAlias = npt.NDArray[np.float64]


class Points(NamedTuple):
    """Stacked parameters and domains of n points, and which of them can be."""

    params: Any
    lo: Array
    hi: Array
    anchor: Array | None
    possible: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SceneSubject:
    """A scene whose quantities vary."""

    scene: Scene

    @property
    def record(self) -> dict[str, Any]:
        """What a store keeps of it."""
        return {"scene": self.scene.as_dict()}

    @property
    def title(self) -> str:
        """Its name."""
        return self.scene.name

    @property
    def sides(self) -> int:
        """How many sides there are."""
        return len(self.scene.sides)

    @property
    def unit(self) -> str:
        """Unit of lengths."""
        return self.scene.unit

    @property
    def sources(self) -> dict[str, str]:
        """Digests of code outside the package that it depends on."""
        return {}

    def unit_of(self, name: str, text: str | None) -> str:
        """Return the unit of an axis: as written, as in the scene, or as people read such quantities."""
        place = find(name, file=self.scene.file)
        if text is not None:
            return parse(text, place.dimension, key=name).unit
        return unit_read(self.scene.text, self.scene.unit, name)

    def in_base(self, axis: Axis) -> Array:
        """Return an axis' values in the scene's units: what the scene reads in the decimals of each."""
        target = base_unit(find(axis.name).dimension, self.scene.unit)
        return np.array([convert(Quantity(repr(each), axis.unit), target) for each in axis.values.tolist()])

    def points(self, values: Mapping[str, Array]) -> Points:
        """Return the throw maps at many points."""
        from limitsets.feeder.scene import throw_stack

        return Points(*throw_stack(self.scene, values))

    def at(self, values: Mapping[str, float]) -> Scene | None:
        """Return the scene at one point; None where there is none."""
        try:
            return self.scene.with_values(values)
        except SceneError:
            return None

    def require(self, axes: Mapping[str, Array], *, block: bool) -> None:
        """Refuse axes of which no scene can be made."""
        if block:
            self.points({name: values[:1] for name, values in axes.items()})
        else:
            replaced(self.scene.text, self.scene.unit, self.scene.file, dict.fromkeys(axes, 1.0))


@dataclass(frozen=True, eq=False)
class MapSubject:
    """A registered map some fields of whose parameters vary."""

    params: Any
    domain: Domain | None

    @property
    def record(self) -> dict[str, Any]:
        """What a store keeps of it."""
        cls, domain = type(self.params), self.domain
        return {
            "map": f"{cls.__module__}:{cls.__qualname__}",
            "parameters": _plain(self.params),
            **({} if domain is None else {"domain": {"lo": domain.lo.tolist(), "hi": domain.hi.tolist()}}),
        }

    @property
    def title(self) -> str:
        """Its name."""
        return type(self.params).__name__

    @property
    def sides(self) -> int:
        """How many sides there are."""
        return self._domain.sides

    @property
    def _domain(self) -> Domain:
        if self.domain is None:
            raise AnswerError("the domain", None, "a box of x per side", "pass domain=[(lo, hi), ...]")
        return self.domain

    @property
    def unit(self) -> str:
        """Unit of x: none."""
        return ""

    @property
    def sources(self) -> dict[str, str]:
        """Digests of code outside the package that it depends on."""
        return {
            file: digest
            for module in modules_of(type(self.params))
            for file, digest in source_of(module).items()
        }

    def unit_of(self, name: str, text: str | None) -> str:
        """Refuse what is no number among the parameters; there are no units."""
        if text is not None:
            raise MapError(
                f"the unit of {name}", text, "numbers without a unit", "the parameters of a map have none"
            )
        _with(self.params, _path(name), 0.0, name)
        return ""

    def in_base(self, axis: Axis) -> Array:
        """Return an axis' values."""
        return axis.values

    def points(self, values: Mapping[str, Array]) -> Points:
        """Return the maps at many points, on one domain."""
        from limitsets.feeder.scene import repeated

        count = next(iter(values.values())).size
        stack = repeated(self.params, count)
        for name, each in values.items():
            stack = _with(stack, _path(name), np.ascontiguousarray(each, dtype=np.float64), name)
        domain = self._domain
        lo, hi = (
            np.repeat((corner[:, 0] if domain.dimension == 1 else corner)[None], count, axis=0)
            for corner in (domain.lo, domain.hi)
        )
        anchors = None if domain.anchor is None else np.repeat(domain.anchor[None], count, axis=0)
        return Points(stack, lo, hi, anchors, np.ones(count, dtype=np.bool_))

    def at(self, values: Mapping[str, float]) -> Any:
        """Return the map at one point."""
        params = self.params
        for name, value in values.items():
            params = _with(params, _path(name), float(value), name)
        return params

    def require(self, axes: Mapping[str, Array], *, block: bool) -> None:
        """Refuse what a block task cannot do without."""
        if block:
            self.points({name: values[:1] for name, values in axes.items()})
            require_agreement(self.params, self._domain, boxes=False)


Subject: TypeAlias = SceneSubject | MapSubject


def _plain(params: Any) -> Any:
    if isinstance(params, tuple) and hasattr(params, "_fields"):
        return {name: _plain(value) for name, value in zip(params._fields, params, strict=True)}
    return params.tolist() if isinstance(params, np.ndarray) else params


def _path(name: str) -> list[str | int]:
    words = re.findall(r"[^.\[\]]+|\[[0-9]+\]", name)
    return [int(word[1:-1]) if word.startswith("[") else word for word in words]


def _with(params: Any, path: list[str | int], value: Any, name: str) -> Any:
    """Return parameters with another value at a place; `value` is a number, or an array for a stack."""
    head, *rest = path or [""]
    if head in getattr(params, "_fields", ()):
        return params._replace(**{str(head): _with(getattr(params, str(head)), rest, value, name)})
    if isinstance(params, np.ndarray) and isinstance(head, int) and not rest and head < params.shape[-1]:
        changed = params.copy()
        changed[..., head] = value
        return changed
    if not path and isinstance(params, float | int | np.ndarray) and np.ndim(params) == np.ndim(value):
        return value
    allowed = "a number of the map's parameters: field, field[i] or field.field"
    raise MapError("the parameter", name, allowed, "correct it")


def source_of(module: str) -> dict[str, str]:
    """Return the digest of a module's file, by its name; nothing for those of the package, which has a version."""
    file = getattr(importlib.import_module(module), "__file__", None)
    if module.split(".")[0] == "limitsets" or file is None:
        return {}
    return {module: hashlib.sha256(Path(file).read_bytes()).hexdigest()}
