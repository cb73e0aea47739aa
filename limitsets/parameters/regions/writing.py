"""The certificate of a plane of parameters: its axes, and for each cell all that a recheck needs, nothing to trust.

The file is laid out as every certificate (docs/certificates.md).  The cells of the arm stand one after another, those
of all cells of parameters together; borders that several cells of parameters share stand once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Arrays
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.quantities import NOISE_ONLY, find
from limitsets.feeder.scene.units import parse
from limitsets.parameters.regions.record import Record
from limitsets.proofs.prover.certificate import in_certificate, pack
from limitsets.proofs.prover.proof import require_checkable
from limitsets.proofs.prover.tolerances import DIGITS, decimal

# ----------------------------------------------------------------
# The two quantities of a plane of parameters, and the borders of its cells: exact decimals, shared by
# neighbours.


@dataclass(frozen=True)
class CellAxis:
    """A quantity and the borders of the cells along it.

    Attributes
    ----------
    quantity : str
        Its name.
    unit : str
        The unit of the borders.
    borders : tuple of Fraction, length n + 1
        Ascending, each a decimal of at most 25 places.
    """

    quantity: str
    unit: str
    borders: tuple[Fraction, ...]

    @classmethod
    def of(cls, quantity: str, borders: Sequence[str]) -> CellAxis:
        """Read the borders: decimals with one unit, ascending.

        Raises
        ------
        AnswerError
            Fewer than two, several units, or borders that do not ascend.
        """
        place = find(quantity)
        if quantity == NOISE_ONLY:
            raise AnswerError("the axis", quantity, "a quantity that a scene gives", "choose another one")
        read = [parse(text, place.dimension) for text in borders]
        values = tuple(Fraction(each.number) for each in read)
        units = {each.unit for each in read}
        ascending = all(a < b for a, b in pairwise(values))
        if len(values) < 2 or len(units) != 1 or not ascending:
            raise AnswerError(
                f"the borders of {quantity}",
                list(borders)[:3],
                "two at least, in one unit, ascending",
                'give texts like "150 deg/s"',
            )
        return cls(quantity, units.pop(), values)

    def refined(self, depth: int) -> CellAxis:
        """Halve every cell so many times."""
        borders = self.borders
        for _ in range(depth):
            middles = [(a + b) / 2 for a, b in pairwise(borders)]
            borders = tuple(sorted([*borders, *middles]))
        return CellAxis(self.quantity, self.unit, borders)

    def text(self, number: int) -> str:
        """Write one border, exactly."""
        return f"{_short_decimal(self.borders[number])} {self.unit}"


def evenly(quantity: str, first: str, last: str, cells: int) -> CellAxis:
    """Cut a range of a quantity into cells of equal width, to the 12th place behind the comma.

    Examples
    --------
    >>> speed = evenly("throw.speed", "150 deg/s", "166 deg/s", 64)
    >>> speed.text(0), speed.text(1)
    ('150 deg/s', '150.25 deg/s')
    """
    ends = CellAxis.of(quantity, [first, last])
    low, high = ends.borders
    scale = 10**12
    borders = [Fraction(round((low + (high - low) * k / cells) * scale), scale) for k in range(1, cells)]
    return CellAxis.of(quantity, [f"{_short_decimal(value)} {ends.unit}" for value in (low, *borders, high)])


def _short_decimal(value: Fraction) -> str:
    """Write a decimal exactly; one that is none, or too long for a certificate, is refused."""
    if (value * 10**DIGITS).denominator != 1:
        raise AnswerError(
            "a border", float(value), f"a decimal of at most {DIGITS} places", "halve the cells fewer times"
        )
    return decimal(value)


def placed(scene: Scene, axes: Sequence[CellAxis]) -> Scene:
    """Write the scene in the quantities of the axes, each at its first border, so that a cell can stand in its place.

    Raises
    ------
    AnswerError
        One quantity twice, effects that no certificate can hold, or noise.
    """
    if len({axis.quantity for axis in axes}) < len(axes):
        raise AnswerError(
            "the axes", [axis.quantity for axis in axes], "two quantities", "choose another one"
        )
    if scene.effects.on():
        raise AnswerError(
            "the scene's effects", list(scene.effects.on()), "none", "regions are proved of the minimal model"
        )
    return scene.with_values({axis.quantity: axis.text(0) for axis in axes})


# ----------------------------------------------------------------
# The certificate of a plane: for each cell of parameters all that a recheck needs, and nothing that it has to
# trust.


STARTS = ("every", "almost-every", "from", "cells")
"""The codes of the array `starts`, in order."""

LAST = np.nextafter(np.float32(2.0 * math.pi), np.float32(0.0))  # within a full turn


def write(
    path: str | Path,
    scene: Scene,
    axes: Sequence[CellAxis],
    arrays: Arrays,
    records: Sequence[Record],
    *,
    recheck: bool,
    workers: int | None,
) -> Path:
    """Write it, replacing an older file whole; `arrays` are those of the plane."""
    require_checkable((), (scene.goal,), "the records hold what is proved")
    borders = [[axis.text(k) for k in range(len(axis.borders))] for axis in axes]
    section = {
        "scene": in_certificate(scene.text, "effects"),
        "axes": [
            {"quantity": axis.quantity, "borders": texts} for axis, texts in zip(axes, borders, strict=True)
        ],
    }
    claims = [{"claim": "region", "section": section}]
    held = (
        arrays
        | _of_records(records, scene.sides.a.size)
        | _of_blocks(records, scene.sides.a.size)
        | _of_chains(records)
    )
    held = {name: np.ascontiguousarray(value) for name, value in held.items()}
    pack(path, {"flight": scene.flight, "flip": scene.flip}, claims, held, recheck=recheck, workers=workers)
    return Path(path)


def _of_records(records: Sequence[Record], sides: int) -> Arrays:
    """Write starts, counts and cells of the arm."""
    n = len(records)
    grid, starts = np.full(n, -1, np.int32), np.full(n, STARTS.index("cells"), np.int8)
    since, joint = np.zeros((n, sides)), np.zeros((n, 3 * sides))
    near, counts = np.zeros(n, np.int8), np.zeros((n, 3), np.int32)
    edges: Arrays = {}
    known: dict[bytes, int] = {}
    parts: list[Arrays] = []
    for k, record in enumerate(records):
        if not record.blocks:
            continue
        own = [record.arrays[f"edges.{side}"] for side in range(sides)]
        key = b"".join(each.tobytes() for each in own)
        grid[k] = known.setdefault(key, len(known))
        edges |= {f"edges.{grid[k]}.{side}": each for side, each in enumerate(own)}
        kind = record.starts if isinstance(record.starts, str) else "from"
        starts[k] = STARTS.index(kind)
        if kind == "from":
            since[k] = [record.starts["from"][str(side)] for side in range(sides)]
        section = record.section
        near[k] = bool(section["near"])
        if near[k]:
            joint[k] = np.ravel(section["joint"])
        counts[k] = section["thinning"], section.get("throws", 0), section.get("jogs", 0)
        parts.append(_compact(record))
    empty: Arrays = {
        **{name: np.zeros((0, 2), np.int32) for name in ("jog", "flip")},
        **{name: np.zeros(0, np.int32) for name in ("rank", "component")},
        "phi": np.zeros((0, 2), np.float32),
    }
    held = {name: np.concatenate([none, *(part[name] for part in parts)]) for name, none in empty.items()}
    for name in ("jog", "flip", "rank", "component"):  # two bytes are enough for most
        held[name] = held[name].astype(np.int16 if held[name].max(initial=0) < 2**15 else np.int32)
    return {
        "grid": grid, "starts": starts, "from": since, "near": near, "joint": joint, "counts": counts,
        **edges, **held,
    }  # fmt: skip


def _compact(record: Record) -> Arrays:
    """Write brackets of the impact angle in fewer digits, outward."""
    lo, hi = record.arrays["phi"][:, 0].astype(np.float32), record.arrays["phi"][:, 1].astype(np.float32)
    lo, hi = np.nextafter(lo, np.float32(0.0)), np.nextafter(hi, np.float32(np.inf))
    return {**record.arrays, "phi": np.stack([lo, np.minimum(hi, LAST)], axis=1)}


def _of_blocks(records: Sequence[Record], sides: int) -> Arrays:
    """Say of each block: cell, number, whether the flip order is proved, and per side bands and jogs per visit."""
    rows = []
    for k, record in enumerate(records):
        for number, block in enumerate(record.blocks):
            row = [k, number, int(bool(block.flip_order))]
            for side in range(sides):
                row += [block.bands.get(side, 0), *block.jogs.get(side, (-1, -1))]
            rows.append(row)
    return {"blocks": np.array(rows, dtype=np.int32).reshape(-1, 3 + 3 * sides)}


def _of_chains(records: Sequence[Record]) -> Arrays:
    """Write the orbits that refute: intervals, with cell, side and branch of each."""
    chains = [(k, record.chain) for k, record in enumerate(records) if record.chain is not None]
    word = [
        [k, side, branch]
        for k, chain in chains
        for side, branch in zip(chain.side.tolist(), chain.branches.tolist(), strict=True)
    ]
    ends = [
        [lo, hi] for _, chain in chains for lo, hi in zip(chain.lo.tolist(), chain.hi.tolist(), strict=True)
    ]
    return {
        "chain": np.array(word, dtype=np.int32).reshape(-1, 3),
        "chain.ends": np.array(ends, dtype=np.float64).reshape(-1, 2),
    }
