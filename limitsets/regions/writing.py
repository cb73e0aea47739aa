"""The certificate of a plane: for each cell of parameters all that a recheck needs, and nothing that it has to trust.

The file is laid out as every certificate (docs/certificates.md).  The cells of the arm stand one after another, those
of all cells of parameters together; borders that several cells of parameters share stand once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.proofs.certificate import pack, tidy
from limitsets.proofs.goals import rechecked
from limitsets.regions.axes import CellAxis
from limitsets.regions.record import Record
from limitsets.scene import Scene
from limitsets.scene.units import spelled_plainly

STARTS = ("every", "almost-every", "from", "cells")
"""The codes of the array `starts`, in order."""

Arrays = dict[str, NDArray[Any]]
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
    if scene.goal is not None and not rechecked(scene.goal):
        raise AnswerError(
            "the certificate",
            f"of the goal {scene.goal.kind}",
            "goals that the checker knows",
            "nothing rechecks others; the records hold what is proved",
        )
    model = {"flight": scene.flight, "flip": scene.flip}
    borders = [[axis.text(k) for k in range(len(axis.borders))] for axis in axes]
    section = {
        "scene": tidy({word: each for word, each in scene.text.items() if word not in ("effects", "model")})
        | {"model": model},
        "axes": [
            {"quantity": axis.quantity, "borders": texts} for axis, texts in zip(axes, borders, strict=True)
        ],
    }
    try:
        producer = {"limitsets": version("limitsets")}
    except PackageNotFoundError:  # sources that are not installed
        producer = {}
    header = {
        "map": model,
        "noise": None,
        "tolerance": None,
        "boxes": [],
        "claims": spelled_plainly([{"claim": "region", "section": section}]),
        "producer": producer,
    }
    held = (
        arrays
        | _of_records(records, scene.sides.a.size)
        | _of_blocks(records, scene.sides.a.size)
        | _of_chains(records)
    )
    held = {name: np.ascontiguousarray(value) for name, value in held.items()}
    pack(path, header, held, scene.unit, {"region": "proved"} if recheck else None, workers)
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
    names = ("jog", "flip", "rank", "component", "phi")
    rows = {name: np.concatenate([part[name] for part in parts]) for name in names} if parts else {}
    empty = {
        **{name: np.zeros((0, 2), np.int32) for name in ("jog", "flip")},
        "rank": np.zeros(0, np.int32),
        "component": np.zeros(0, np.int32),
        "phi": np.zeros((0, 2), np.float32),
    }
    held = empty | rows
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
    found = [(k, record.chain) for k, record in enumerate(records) if record.chain is not None]
    word = [
        [k, side, branch]
        for k, chain in found
        for side, branch in zip(chain.side.tolist(), chain.branches.tolist(), strict=True)
    ]
    ends = [
        [lo, hi] for _, chain in found for lo, hi in zip(chain.lo.tolist(), chain.hi.tolist(), strict=True)
    ]
    return {
        "chain": np.array(word, dtype=np.int32).reshape(-1, 3),
        "chain.ends": np.array(ends, dtype=np.float64).reshape(-1, 2),
    }
