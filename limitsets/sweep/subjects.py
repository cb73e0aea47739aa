"""What a plan varies: a scene by its quantities, or any registered map by the fields of its parameters."""

from __future__ import annotations

import hashlib
import importlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from limitsets.cells import Domain
from limitsets.errors import AnswerError, MapError, SceneError
from limitsets.graph.agreement import require_agreement
from limitsets.scene import Scene
from limitsets.scene.quantities import base_unit, find, unit_read
from limitsets.scene.units import Quantity, convert, parse

if TYPE_CHECKING:
    from limitsets.sweep.axes import Axis

Array: TypeAlias = npt.NDArray[np.float64]

# What people read these in, where the scene gives no unit for them.


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
        from limitsets.scene.arrays import throw_stack

        return Points(*throw_stack(self.scene, values))

    def at(self, values: Mapping[str, float]) -> Scene | None:
        """Return the scene at one point; None where there is none."""
        try:
            return self.scene.with_values(values)
        except SceneError:
            return None

    def require(self, axes: Mapping[str, Array], *, block: bool) -> None:
        """Refuse axes of which no scene can be made."""
        one = {name: values[:1] for name, values in axes.items()}
        if block:
            self.points(one)
        else:
            from limitsets.scene.quantities import replaced

            replaced(self.scene.text, self.scene.unit, self.scene.file, dict.fromkeys(one, 1.0))


@dataclass(frozen=True, eq=False)
class MapSubject:
    """A registered map some fields of whose parameters vary."""

    params: Any
    domain: Domain | None

    @property
    def record(self) -> dict[str, Any]:
        """What a store keeps of it."""
        cls, domain = type(self.params), self.domain
        found: dict[str, Any] = {
            "map": f"{cls.__module__}:{cls.__qualname__}",
            "parameters": _plain(self.params),
        }
        if domain is not None:
            found["domain"] = {"lo": domain.lo.tolist(), "hi": domain.hi.tolist()}
        return found

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
        return source_of(type(self.params).__module__)

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
        from limitsets.scene.arrays import repeated

        count = next(iter(values.values())).size
        stack = repeated(self.params, count)
        for name, each in values.items():
            stack = _with(stack, _path(name), np.ascontiguousarray(each, dtype=np.float64), name)
        domain = self._domain
        ends = [domain.lo, domain.hi]
        if domain.dimension == 1:
            ends = [corner[:, 0] for corner in ends]
        lo, hi = (np.repeat(corner[None], count, axis=0) for corner in ends)
        anchor = domain.anchor
        anchors = None if anchor is None else np.repeat(anchor[None], count, axis=0)
        return Points(stack, lo, hi, anchors, np.ones(count, dtype=np.bool_))

    def at(self, values: Mapping[str, float]) -> Any:
        """Return the map at one point."""
        found = self.params
        for name, value in values.items():
            found = _with(found, _path(name), float(value), name)
        return found

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
        found = params.copy()
        found[..., head] = value
        return found
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
