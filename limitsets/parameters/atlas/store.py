"""The store of a plan: a Zarr group (format 3) that xarray opens, written in whole chunks by one process.

A chunk counts as done when the checksum of its data stands in the array `chunk_checksum`.  The checksum is written
after the data, in a file of its own that is replaced whole, and it is compared with the data when a store is continued:
a chunk that was cut off, by whatever (a killed driver, a full disk, power), is computed once more.  What stands beside
the data is compared when a store is opened: coordinates and attributes with the plan, and what an array says of itself
(shape, dimensions, unit, codes) with a checksum among its attributes.  A store that differs there is refused.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from limitsets.base import LimitsetsError, replaced
from limitsets.base.campaign import imported
from limitsets.parameters.atlas.plan import Plan, all_are, codes_of, differences, digest_of
from limitsets.parameters.atlas.subjects import SceneSubject

if TYPE_CHECKING:
    import zarr

    from limitsets.parameters.atlas.plan import Variable
    from limitsets.parameters.atlas.work import Answer


CHECKSUM = "chunk_checksum"
SEAL = "metadata_checksum"
_REMEDY = "name another store, or remove this one"
_MOST_SHOWN = 3


class Store:
    """The results of a plan.

    Parameters
    ----------
    plan : Plan
        Whose results.
    path : Path or None
        A folder, made if there is none; None keeps the results in memory.

    Raises
    ------
    LimitsetsError
        The folder holds something else, or the results of another plan: with what differs.
    """

    def __init__(self, plan: Plan, path: Path | None) -> None:
        self.plan, self.path = plan, path
        library = imported("zarr")
        if path is None:
            self.group: zarr.Group = library.create_group(library.storage.MemoryStore(), zarr_format=3)
            self._begin()
        elif path.is_dir() and any(path.iterdir()):
            self.group = self._opened(library)
        else:
            with self._written(), replaced(path.parent) as draft:
                if path.is_dir():
                    path.rmdir()  # it is empty
                self.group = library.create_group(str(draft / path.name), zarr_format=3)
                self._begin()
            self.group = self._opened(library)
        self.arrays: dict[str, Any] = dict(self.group.arrays())
        axes = {axis.name: self.arrays.pop(axis.name) for axis in plan.axes if axis.name in self.arrays}
        self.marks = self.arrays.pop(CHECKSUM)
        self._require_whole(axes)
        self.done = {number for number in range(math.prod(plan.chunks)) if self._is_done(number)}

    def _begin(self) -> None:
        """Write what a store holds before its first chunk."""
        plan = self.plan
        self.group.attrs.update(_attributes(plan))
        for axis in plan.axes:
            array = self._made(
                axis.name,
                axis.values.shape,
                axis.values.shape,
                dtype=axis.values.dtype,
                fill=0.0,
                dims=(axis.name,),
                attributes=_unit(axis.unit),
            )
            array[...] = axis.values
        self._made(
            CHECKSUM,
            plan.chunks,
            (1,) * len(plan.axes),
            dtype=np.dtype("uint32"),
            fill=0,
            dims=tuple(f"chunk of {axis.name}" for axis in plan.axes),
            attributes={"long_name": "CRC-32 of the chunk's data; 0 where the chunk is not done"},
        )

    def _made(
        self,
        name: str,
        shape: tuple[int, ...],
        chunks: tuple[int, ...],
        dtype: np.dtype[Any],
        fill: float,
        dims: tuple[str, ...],
        attributes: dict[str, Any],
    ) -> Any:
        """Make an array, sealed."""
        sealed = attributes | {
            SEAL: _seal(name, shape, chunks, dtype=dtype, fill=fill, dims=dims, attributes=attributes)
        }
        return self.group.create_array(
            name, shape=shape, chunks=chunks, dtype=dtype, fill_value=fill, dimension_names=dims,
            attributes=sealed,
        )  # fmt: skip

    def _require_whole(self, axes: Mapping[str, Any]) -> None:
        """Refuse a store in which something beside the data is not as it was written."""
        wrong = [
            f"the axis {axis.name}"
            for axis in self.plan.axes
            if axis.name not in axes or not _holds(axes[axis.name], axis.values, _unit(axis.unit))
        ]
        sealed = (*self.arrays.items(), (CHECKSUM, self.marks))
        wrong += [f"what {name} says of itself" for name, array in sealed if not _is_sealed(array)]
        if dict(self.group.attrs) != _attributes(self.plan):
            wrong.append("its attributes")
        if wrong:
            raise _damaged(self.path, ", ".join(wrong))

    def _opened(self, library: Any) -> zarr.Group:
        """Open a store of this very plan."""
        with self._refusing_others():
            group = library.open_group(str(self.path), mode="r+", zarr_format=3, use_consolidated=False)
            theirs, digest = (dict(group.attrs)[name] for name in ("plan", "plan_hash"))
        if digest_of(theirs) != digest:
            raise _damaged(self.path, "its plan")
        wrong = list(differences(self.plan.record, theirs))
        wrong = [each for each in wrong if not each[0].endswith(".sha256")] or wrong
        if wrong:
            shown = "; ".join(_difference(*each) for each in wrong[:_MOST_SHOWN])
            more = f" and {len(wrong) - _MOST_SHOWN} more" if len(wrong) > _MOST_SHOWN else ""
            raise LimitsetsError(
                f"the store {self.path}",
                "that of another plan",
                "one of the same plan",
                f"{shown}{more}; {_REMEDY}",
            )
        assert self.path is not None
        for left in self.path.rglob("*.partial"):  # by a driver that was killed while it wrote
            left.unlink(missing_ok=True)
        for (
            begun
        ) in self.path.iterdir():  # or while it made an array: zarr warns of a folder without its zarr.json
            if begun.is_dir() and not any(begun.iterdir()):
                begun.rmdir()
        with self._refusing_others():
            dict(group.arrays())[CHECKSUM]
        return group  # type: ignore[no-any-return]  # zarr is imported where it is used

    def _is_done(self, number: int) -> bool:
        """Whether the data of a chunk are those that were written."""
        region, arrays = self.plan.region(number), {}
        try:
            mark = int(self.marks[self.plan.place(number)])
            if mark == 0:
                return False
            for name, array in self.arrays.items():
                values = np.asarray(array[region])
                if not all_are(values, array.fill_value):
                    arrays[name] = values
        except (OSError, ValueError, RuntimeError):  # what codecs make of bytes that were cut off
            return False
        return checksum(arrays) == mark

    def write(self, answer: Answer) -> None:
        """Write the answers of a chunk, and then that it is done."""
        region, arrays = self.plan.region(answer.number), {}
        with self._written():
            for name, (variable, values) in answer.arrays.items():
                self._array(name, variable)[region] = values
                if not variable.is_empty(values):
                    arrays[name] = values
            self.marks[self.plan.place(answer.number)] = checksum(arrays)
        self.done.add(answer.number)

    def _array(self, name: str, variable: Variable) -> Any:
        """Return the array of a variable, made when its first chunk comes."""
        shape = (*self.plan.shape, *(n for _, n in variable.dims))
        if name not in self.arrays:
            chunks = (*self.plan.chunk, *(max(n, 1) for _, n in variable.dims))
            dims = (*(axis.name for axis in self.plan.axes), *(dim for dim, _ in variable.dims))
            self.arrays[name] = self._made(
                name,
                shape,
                chunks,
                dtype=np.dtype(variable.dtype),
                fill=variable.empty,
                dims=dims,
                attributes=_described(variable, self.plan.subject.unit),
            )
        if self.arrays[name].shape != shape:
            raise LimitsetsError(
                f"the variable {name}", shape, f"{self.arrays[name].shape}, as at other points",
                "let the task return arrays of one shape",
            )  # fmt: skip
        self._name_codes(name, variable.codes)
        return self.arrays[name]

    def _name_codes(self, name: str, codes: Mapping[str, int]) -> None:
        """Add the names of codes that were not met before; in order, so that the last chunk written is not seen."""
        array = self.arrays[name]
        attributes = array.attrs
        known = codes_of(attributes)
        if codes.items() <= known.items():
            return
        both = known | dict(codes)
        if len(set(both.values())) < len(both):
            raise LimitsetsError(
                f"the codes of {name}", both, "another code for each name", "give them other codes"
            )
        told = {key: value for key, value in attributes.items() if key != SEAL} | _flags(both)
        attributes.update(told | {SEAL: _seal_of(array, told)})

    @contextmanager
    def _refusing_others(self) -> Iterator[None]:
        """Refuse a folder that is no store."""
        try:
            yield
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise LimitsetsError(
                "the store", str(self.path), "a new folder, or a store that limitsets atlas began",
                f"it is none, or damaged ({type(error).__name__}): {_REMEDY}",
            ) from None  # fmt: skip

    @contextmanager
    def _written(self) -> Iterator[None]:
        """Explain a failed write."""
        try:
            yield
        except OSError as error:
            raise LimitsetsError(
                "the store", str(self.path), "a place that can be written",
                f"it could not be: {error.strerror or error}; what is done is kept, the same call does the rest",
            ) from error  # fmt: skip


def _damaged(path: Path | None, what: str) -> LimitsetsError:
    """Name the part of a store that has changed since it was written."""
    return LimitsetsError(
        f"the store {path}", "damaged", "a store as it was written", f"{what} changed since; {_REMEDY}"
    )


def checksum(arrays: Mapping[str, npt.NDArray[Any]]) -> int:
    """Return a checksum of arrays by name, never 0."""
    total = 0
    for name in sorted(arrays):
        values = arrays[name]
        total = zlib.crc32(name.encode(), total)
        total = zlib.crc32(
            np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<")).tobytes(), total
        )
    return total or 1


def _seal(
    name: str,
    shape: tuple[int, ...],
    chunks: tuple[int, ...],
    dtype: np.dtype[Any],
    fill: float,
    dims: tuple[str, ...],
    attributes: Mapping[str, Any],
) -> int:
    """Return a checksum of what an array says of itself."""
    said = [name, shape, chunks, dtype.str.lstrip("<>|="), f"{float(fill)}", dims, dict(attributes)]
    return zlib.crc32(json.dumps(said, sort_keys=True).encode())


def _seal_of(array: Any, attributes: Mapping[str, Any]) -> int:
    """Return the checksum of what an array in a store says of itself, with these attributes."""
    return _seal(
        array.path.rpartition("/")[2],
        array.shape,
        array.chunks,
        dtype=array.dtype,
        fill=array.fill_value,
        dims=tuple(array.metadata.dimension_names or ()),
        attributes=attributes,
    )


def _is_sealed(array: Any) -> bool:
    """Whether an array says of itself what was written."""
    attributes = dict(array.attrs)
    try:
        return bool(attributes.pop(SEAL, None) == _seal_of(array, attributes))
    except (TypeError, ValueError):  # what no array of ours says
        return False


def _holds(array: Any, values: npt.NDArray[Any], attributes: dict[str, Any]) -> bool:
    """Whether an array holds these coordinates, with these attributes."""
    try:
        coordinates = np.asarray(array[...])
    except (OSError, ValueError, RuntimeError):  # what codecs make of bytes that were damaged
        return False
    said = {key: value for key, value in dict(array.attrs).items() if key != SEAL}
    return _is_sealed(array) and said == attributes and coordinates.tobytes() == values.tobytes()


def _unit(unit: str) -> dict[str, Any]:
    return {"units": unit} if unit else {}


def _difference(name: str, here: Any, there: Any) -> str:
    """Say what differs between two plans."""
    if name.startswith("sources."):
        return f"the code of {name.removeprefix('sources.')} is not the code that began it"
    return f"{name} is {_short(there)} there, {_short(here)} here"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _described(variable: Variable, length: str) -> dict[str, Any]:
    """Return the attributes of a variable; codes as the CF conventions have them."""
    about = {"long_name": variable.about} if variable.about else {}
    unit = _unit(length if variable.unit == "length" else variable.unit)
    return about | unit | (_flags(variable.codes) if variable.codes else {})


def _flags(codes: Mapping[str, int]) -> dict[str, Any]:
    ordered = sorted(codes.items(), key=lambda each: each[1])
    return {
        "flag_values": [code for _, code in ordered],
        "flag_meanings": " ".join(name for name, _ in ordered),
    }


def _attributes(plan: Plan) -> dict[str, Any]:
    """Return the attributes of a store."""
    attributes: dict[str, Any] = {
        "title": f"atlas of {plan.subject.title}",
        "plan_hash": digest_of(plan.record),
        "plan": plan.record,
    }
    if isinstance(plan.subject, SceneSubject):
        from limitsets.feeder.scene import dump

        attributes |= {"scene": dump(plan.subject.scene), "unit_of_length": plan.subject.unit}
    return attributes | {"versions": dict(plan.code["versions"])}
