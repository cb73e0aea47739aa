"""The certificate of brackets: laws, starts, places that absorb, nodes; the checker makes the steps itself.

The checker bounds a throw in its own way, which needs somewhat finer cells for the same width: the certificate cuts
each cell, and claims what was found, widened by an allowance.  The file is laid out as
every certificate (docs/certificates.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.proofs.certificate import pack, tidy
from limitsets.robust.brackets.chain import EXITS, Place
from limitsets.robust.brackets.nodes import Nodes
from limitsets.robust.noise.laws import Uniform
from limitsets.robust.noise.scattering import Scattering
from limitsets.scene import Scene
from limitsets.scene.units import spelled_plainly

# Strata of the speed for the checker: between their ends it takes landing places to be linear.
STRATA = 32
QUANTILES = ("50 %", "95 %", "99 %")


def write(
    path: str | Path,
    scene: Scene,
    scatter: Scattering,
    places: tuple[Sequence[Place], Mapping[str, Sequence[Place]]],
    nodes: Nodes,
    within: Mapping[str, NDArray[np.float64]],
    mean: tuple[float, float],
    *,
    allowance: float,
    finer: int,
    recheck: bool,
) -> Path:
    """Write it, replacing an older file whole; `places` are the starts, and by name those that absorb."""
    starts, absorbing = places
    section: dict[str, Any] = {
        "scene": tidy({word: each for word, each in scene.text.items() if word not in _LEFT_OUT})
        | {"model": {"flight": scene.flight, "flip": scene.flip}},
        "laws": _laws(scatter, scene.unit),
        "starts": _places(starts, scene.unit),
        "absorbing": {name: _places(each, scene.unit) for name, each in absorbing.items()},
        "strata": STRATA,
        "names": [name for name in within if name != EXITS],
        "quantiles": [],
        "mean": None,
    }
    claimed = {name: _widened(within[name], allowance) for name in section["names"]}
    for name, pair in claimed.items():
        for share in QUANTILES:
            ends = _quantile(pair, float(share.split()[0]) / 100.0)
            if ends is not None:
                section["quantiles"].append([name, share, *ends])
    low, high = mean
    if low > 0.0 or math.isfinite(high):
        section["mean"] = [
            max(low * (1.0 - allowance), 0.0).hex(),
            (high * (1.0 + allowance)).hex() if math.isfinite(high) else None,
        ]
    arrays = {f"within.{k}": np.ascontiguousarray(pair.T) for k, pair in enumerate(claimed.values())}
    for side in range(len(scene.sides)):
        # the outermost nodes lie far beyond everything
        arrays[f"edges.{side}"] = _cut(nodes.place[nodes.of_side(side)][1:-1], finer)
    try:
        producer = {"limitsets": version("limitsets")}
    except PackageNotFoundError:  # sources that are not installed
        producer = {}
    header = {
        "map": section["scene"]["model"],
        "noise": None,
        "tolerance": None,
        "boxes": [],
        "claims": spelled_plainly([{"claim": "probabilities", "section": section}]),
        "producer": producer,
    }
    pack(path, header, arrays, scene.unit, {"probabilities": "proved"} if recheck else None)
    return Path(path)


_LEFT_OUT = ("effects", "model", "cavity", "feedback", "tray")


def _laws(scatter: Scattering, unit: str) -> dict[str, dict[str, str]]:
    """Write the laws; only even ones, with scatter of the landing place, are rechecked."""
    speed, landing = scatter.speed, scatter.landing
    if not isinstance(landing, Uniform) or not isinstance(speed, Uniform | None):
        allowed = "a uniform law of the landing place, and of the speed a uniform one or none"
        remedy = "the checker knows no others: the brackets are proved, and not rechecked"
        raise AnswerError("the laws of the certificate", scatter.words(), allowed, remedy)
    laws = {"landing.x": {"uniform": f"{_plain(landing.bound)} {unit}"}}
    if speed is not None and speed.bound > 0.0:
        laws["throw.speed"] = {"uniform": f"{_plain(speed.bound, 2)} %"}
    return laws


def _plain(number: float, places: int = 0) -> str:
    """Write the decimals that a float prints with, moved by some places."""
    from decimal import Decimal

    return f"{Decimal(repr(float(number))).scaleb(places):f}"


def _places(places: Sequence[Place], unit: str) -> list[list[Any]]:
    return [
        [side, f"{_plain(lo)} {unit}", f"{_plain(hi)} {unit}" if math.isfinite(hi) else None]
        for side, lo, hi in places
    ]


def _cut(places: NDArray[np.float64], finer: int) -> NDArray[np.float64]:
    """Cut the cells, but not those where functions jump."""
    width = np.diff(places)
    wide = np.flatnonzero(width > 1e-3 * np.median(width))
    more = [places[wide] + width[wide] * (k / finer) for k in range(1, finer)]
    return np.unique(np.concatenate([places, *more]))


def _widened(pair: NDArray[np.float64], allowance: float) -> NDArray[np.float64]:
    return np.stack([np.maximum(pair[0] - allowance, 0.0), np.minimum(pair[1] + allowance, 1.0)])


def _quantile(pair: NDArray[np.float64], share: float) -> tuple[int, int] | None:
    """Bound the throws within which so many end, by brackets that are claimed; None beyond the throws counted."""
    first, last = np.flatnonzero(pair[1] >= share), np.flatnonzero(pair[0] >= share)
    return (int(first[0]), int(last[0])) if last.size else None
