"""Regions of one to three parameters of a map: where the boxes of parameters lie, and the shares that they prove.

docs/certificates.md, "Certificates of any map": `plane`.
"""

import itertools
import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from .file import is_whole, plain, require, rows, table
from .program import named, rational

MOST_PARAMETER_BORDERS = 100_000  # along an axis
MOST_SMALLEST_BOXES = 10_000_000  # between the borders of all axes
RegionPlace = list[tuple[int, int]]  # along each axis the numbers of the borders between which a box lies


class ParameterAxis(NamedTuple):
    """One of the parameters, and the borders of the smallest boxes: as written, and exact."""

    name: str
    texts: list[str]
    values: list[Fraction]


def read_axes(raw: object, names: list[str]) -> list[ParameterAxis]:
    """Read the axes of a region."""
    axes = []
    for one in rows(table(raw, "plane", "axes")["axes"], "plane: axes", 1, 3):
        known = table(one, "plane: an axis", "parameter borders")
        name = known["parameter"]
        require(isinstance(name, str) and name in names, "plane: an axis is no parameter of the map")
        where = f"plane: the borders of {plain(name)}"
        texts = rows(known["borders"], where, 2, MOST_PARAMETER_BORDERS)
        values = [rational(text, where) for text in texts]
        require(all(a < b for a, b in itertools.pairwise(values)), f"{where} do not ascend")
        axes.append(ParameterAxis(name, texts, values))
    require(len({axis.name for axis in axes}) == len(axes), "plane: an axis stands twice")
    smallest = math.prod(len(axis.texts) - 1 for axis in axes)
    require(smallest <= MOST_SMALLEST_BOXES, "plane: there are more than 10^7 smallest boxes")
    return axes


def read_region_boxes(
    axes: list[ParameterAxis], raw: list[object], parameters: list[dict[str, tuple[str, str]]]
) -> list[RegionPlace]:
    """Read where boxes lie: each has the values of its borders, none lies over another, and other parameters agree."""
    over = np.zeros([len(axis.texts) - 1 for axis in axes], dtype=bool)
    places = []
    for k, (one, values) in enumerate(zip(raw, parameters, strict=True)):
        where, place = f"box {k}: at", list[tuple[int, int]]()
        for axis, pair in zip(axes, rows(one, where, len(axes), len(axes)), strict=True):
            low, high = rows(pair, where, 2, 2)
            sound = is_whole(low, 0, len(axis.texts) - 2) and is_whole(high, 1, len(axis.texts) - 1)
            require(sound and low < high, f"{where} does not name two borders that ascend")
            alike = values[axis.name] == (axis.texts[low], axis.texts[high])
            require(alike, f"{where} names other borders than the range of {plain(axis.name)}")
            place.append((low, high))
        own = over[tuple(slice(low, high) for low, high in place)]
        require(not own.any(), f"{where} lies over another box")
        own[...] = True
        fixed = {name: ends for name, ends in values.items() if all(name != axis.name for axis in axes)}
        first = {name: parameters[0][name] for name in fixed}
        require(fixed == first, f"box {k}: it differs from the first in a parameter that is no axis")
        places.append(place)
    return places


def volume(axes: list[ParameterAxis], place: RegionPlace) -> Fraction:
    """Return the share of the region in which a box lies, exactly."""
    pairs = zip(axes, place, strict=True)
    return math.prod(
        ((a.values[high] - a.values[low]) / (a.values[-1] - a.values[0]) for a, (low, high) in pairs),
        start=Fraction(1),
    )


def region_in_words(
    axes: list[ParameterAxis], places: list[RegionPlace], words: list[dict[str, str]]
) -> tuple[list[str], dict[str, Any]]:
    """Say on which share of a region each claim is proved, rounded down, with the exact shares.

    `words` has by box what became of each claim; what fails or is not claimed is open.
    """
    whole = ", ".join(f"{named(axis.name)} in [{axis.texts[0]}, {axis.texts[-1]}]" for axis in axes)
    shares: dict[str, Fraction] = {}
    for place, said in zip(places, words, strict=True):
        for name, word in said.items():
            if word in ("proved", "refuted"):
                shares[name] = shares.get(name, Fraction(0)) + volume(axes, place)
    # who claims or refutes something of a box leaves nothing open there
    decided = sum(
        (volume(axes, place) for place, said in zip(places, words, strict=True) if said), Fraction(0)
    )
    lines = [
        f"region: {whole}, in {len(places)} boxes of parameters; open on {percent(1 - decided, up=True)} of it"
    ]
    kinds = {name: "refuted" if name == "refuted" else "proved" for name in shares}
    lines += [
        f"    {'the goal' if name == 'refuted' else name}: {kinds[name]} on {percent(share)} of the region"
        for name, share in shares.items()
    ]
    exact = {name: str(share) for name, share in shares.items()}
    plain_axes = [{"parameter": axis.name, "borders": axis.texts} for axis in axes]
    return lines, {"axes": plain_axes, "shares": exact, "open": str(1 - decided)}


def percent(share: Fraction, *, up: bool = False) -> str:
    """Write a share in percent, rounded down or up to two decimals."""
    hundredths = math.ceil(share * 10_000) if up else math.floor(share * 10_000)
    return f"{hundredths // 100}.{hundredths % 100:02d} %"
