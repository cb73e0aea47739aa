"""Tables that trackers write: where points of the part, or one marker on it, are in each frame of a film."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from limitsets.base import DataError, shown
from limitsets.base.arrays import Array, Ints
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.units import UNITS, convert, exact_factor, parse
from limitsets.parameters.fitting.throws import length_of

Points = NDArray[np.complex128]
"""Places in a plane: x + iy."""
Pair = tuple[float, float]
Place = tuple[float | str, float | str]

CENTRE = "com"

_HEAD = "columns frame (or time [s]), id, x, y, angle [deg] or [rad], or the three head rows of DeepLabCut"
_NAMES = (
    f"vertices of the part, P0, P1, ..., as the scene counts them, {CENTRE}, or one marker with its angle"
)
_POINT = re.compile(r"P\d+|com")
_TITLE = re.compile(r"\s*([\w .-]*?)\s*(?:\[\s*([^\]]*?)\s*\])?\s*")
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?")
_LARGEST = 1e12
# A longer film is a mistake: numbers of frames that are times in microseconds, or the like.
_MOST_FRAMES = 5_000_000
# Corners nearer to a line than this share of their extent fix no plane: clicks on a picture are no better.
_ON_A_LINE = 1e-3


@dataclass(frozen=True, eq=False)
class Tracks:
    """What a tracker saw, in n frames, of k points or of one marker.

    Attributes
    ----------
    file : str
        The table.
    frames : ndarray of int, shape (n,)
        Numbers of the frames, ascending.
    names : tuple of str
        Of the points, "P0" or "com"; of a marker its id.
    at : ndarray of complex, shape (n, k)
        x + iy as the table has them; nan where a point was not seen, or not surely enough.
    angle : ndarray or None, shape (n,)
        Of a marker, from x towards y [rad].
    unit : str
        Of x and y; "px" for pixels.
    unread : tuple of str
        Columns and points that the table has besides.
    """

    file: str
    frames: Ints
    names: tuple[str, ...]
    at: Points
    angle: Array | None
    unit: str
    unread: tuple[str, ...]


@dataclass(frozen=True)
class _Layout:
    """Where a table has what: the first row after the head, the column of each number of each point, that of its id.

    `turn` is the unit of angles in rad, 0 for points.
    """

    first: int
    columns: dict[str, dict[str, int]]
    unread: tuple[str, ...]
    id_at: int | None = None
    unit: str = "px"
    turn: float = 0.0


def refuse(
    wrong: bool, thing: str, value: object, allowed: str, remedy: str, *, file: str, key: str | None = None
) -> None:
    """Raise the error of a film if something is wrong with it."""
    if wrong:
        raise DataError(thing, value, allowed, remedy, key=key, file=file)


def read_tracks(file: str | Path, *, likelihood: float = 0.9) -> Tracks:
    r"""Read the table of a tracker.

    Parameters
    ----------
    file : str or Path
        The CSV file of DeepLabCut, or a table with a row for each point and frame.  Commas, semicolons or tabs separate
        columns; with semicolons decimals may have a comma.  Lines that begin with # are skipped.
    likelihood : float
        Points below it count as not seen.

    Returns
    -------
    Tracks

    Raises
    ------
    DataError
        The first thing wrong: the file, a column, a unit, or a cell, with its row and column.

    Examples
    --------
    >>> import tempfile
    >>> text = "frame;id;x;y\n0;P0;100,5;200\n0;P1;150;200\n1;P0;100,6;200\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "tracks.csv"
    ...     _ = path.write_text(text)
    ...     tracks = read_tracks(path)
    >>> tracks.names, tracks.at[0].tolist(), tracks.unit
    (('P0', 'P1'), [(100.5+200j), (150+200j)], 'px')
    """
    table = _Table.of(Path(file), str(file).encode("utf-8", "backslashreplace").decode())
    layout = (_deeplabcut if table.cells[0][0].lower() == "scorer" else _long)(table.cells, table.file)
    seen: dict[tuple[float, str], tuple[complex, float]] = {}
    for k in range(layout.first, len(table.cells)):
        for frame, point, spot, angle in table.readings(k, layout, likelihood):
            refuse(
                (frame, point) in seen,
                "the point",
                f"{point} twice in frame {frame:g}",
                "each once in a frame",
                "leave one out",
                key=f"row {table.rows[k]}",
                file=table.file,
            )
            seen[frame, point] = spot, angle
    times, which = np.unique([frame for frame, _ in seen], return_inverse=True)
    # of times, the number of a frame is how many of the usual steps have passed
    if seen and "time" in next(iter(layout.columns.values())):
        times = np.rint((times - times[0]) / (np.median(np.diff(times)) if times.size > 1 else 1.0))
    refuse(
        not seen or np.ptp(times) > _MOST_FRAMES or (np.diff(times) == 0).any(),
        "the frames",
        f"{times[0]:g} to {times[-1]:g}" if seen else "none",
        f"numbers of frames within {_MOST_FRAMES}, or times with one step",
        "number the frames from 0",
        file=table.file,
    )
    names = tuple(layout.columns)
    at, angles = np.full((times.size, len(names)), complex(math.nan, math.nan)), np.full(times.size, math.nan)
    for ((_, point), (spot, turned)), k in zip(seen.items(), which.tolist(), strict=True):
        at[k, names.index(point)], angles[k] = spot, turned
    return Tracks(
        table.file,
        times.astype(np.int64),
        names,
        at=at,
        angle=angles if layout.turn else None,
        unit=layout.unit,
        unread=layout.unread,
    )


@dataclass(frozen=True)
class _Table:
    """The cells of a table with the numbers of their rows in the file."""

    file: str
    rows: list[int]
    cells: list[list[str]]
    separator: str

    @classmethod
    def of(cls, path: Path, name: str) -> _Table:
        """Read a file; `name` is what a terminal can print of its name."""
        try:
            # line by line: the number of a line is what an editor shows, and no tracker breaks a cell in two
            numbered = list(enumerate(path.read_text(encoding="utf-8-sig").splitlines(), 1))
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            allowed, remedy = "a CSV file in UTF-8", f"it could not be opened: {reason}"
            raise DataError("the file", name, allowed, remedy, file=name) from None
        lines = [
            (k, line) for k, line in numbered if line.strip(" \t,;") and not line.lstrip().startswith("#")
        ]
        refuse(not lines, "the file", "empty", _HEAD, "give the table of a tracker", file=name)
        separator = next((each for each in ";\t," if each in lines[0][1]), ",")
        split = csv.reader((line for _, line in lines), delimiter=separator)
        return cls(name, [k for k, _ in lines], [[cell.strip() for cell in row] for row in split], separator)

    def number(self, k: int, column: int, head: str) -> float:
        """Read a cell; one that is empty or nan, or that is not there, holds no number."""
        text = self.cells[k][column] if column < len(self.cells[k]) else ""
        plain = text.replace(",", ".") if self.separator == ";" else text
        if plain.lower() in ("", "nan"):
            return math.nan
        refuse(
            not _NUMBER.fullmatch(plain) or abs(float(plain)) > _LARGEST,
            "the number",
            shown(text),
            f"a decimal number up to {_LARGEST:g}",
            "correct it; leave cells of what was not seen empty",
            key=f"row {self.rows[k]}, column {head}",
            file=self.file,
        )
        return float(plain)

    def readings(
        self, k: int, layout: _Layout, likelihood: float
    ) -> Iterator[tuple[float, str, complex, float]]:
        """Yield the points that a row holds: frame, name, x + iy and angle [rad]; nan of what was not seen surely."""
        width, row = len(self.cells[0]), self.cells[k]
        refuse(
            any(row[width:]),
            "the number of cells",
            len(row),
            f"{width}, one for each column",
            "correct the row; decimals have a comma only where semicolons separate columns",
            key=f"row {self.rows[k]}",
            file=self.file,
        )
        points = list(layout.columns)
        if layout.id_at is not None:
            points = [name for name in row[layout.id_at : layout.id_at + 1] if name in layout.columns]
        for point in points:
            columns = layout.columns[point]
            value = {kind: self.number(k, column, f"{kind} of {point}") for kind, column in columns.items()}
            frame = value["time"] if "time" in value else value["frame"]
            refuse(
                not math.isfinite(frame) or not ("time" in value or frame.is_integer()),
                "the frame",
                frame,
                "a whole number, or a time, in every row",
                "number the frames",
                key=f"row {self.rows[k]}, column frame",
                file=self.file,
            )
            unsure = "likelihood" in value and not value["likelihood"] >= likelihood
            spot = math.nan if unsure else complex(value["x"], value["y"])
            yield frame, point, spot, layout.turn * value.get("angle", math.nan)


def _deeplabcut(cells: list[list[str]], name: str) -> _Layout:
    """Read the head of DeepLabCut: a row for each frame, three columns for each point."""
    words = [row[0].lower() for row in cells[:3]]
    refuse(
        words != ["scorer", "bodyparts", "coords"],
        "the head rows",
        ", ".join(words),
        "scorer, bodyparts, coords",
        "export the film of one part, not of several",
        file=name,
    )
    columns: dict[str, dict[str, int]] = {}
    for k, (part, kind) in enumerate(zip(cells[1], cells[2], strict=False)):
        if k:
            columns.setdefault(part, {"frame": 0})[kind] = k
    known = {part: own for part, own in columns.items() if _POINT.fullmatch(part)}
    refuse(
        not known,
        "the names of points",
        shown(", ".join(columns) or "none"),
        _NAMES,
        "rename them in the table",
        file=name,
    )
    for part, kind in ((part, kind) for part in known for kind in "xy" if kind not in known[part]):
        allowed = "x, y and likelihood of each point"
        raise DataError("the column", f"{part} {kind} missing", allowed, "add it", file=name)
    return _Layout(3, known, tuple(part for part in columns if part not in known))


def _long(cells: list[list[str]], name: str) -> _Layout:
    """Read the head of a table with a row for each point, or for the marker, and frame."""
    heads = [match.groups() if (match := _TITLE.fullmatch(cell)) else (cell, None) for cell in cells[0]]
    place, units = (
        {each.lower(): k for k, (each, _) in enumerate(heads)},
        {each.lower(): u for each, u in heads},
    )
    twice = ", ".join(each for each in place if [head.lower() for head, _ in heads].count(each) > 1)
    refuse(bool(twice), "the column", twice, "each column once", "leave one out", key="the head", file=name)
    clock = "time" if "time" in place and "frame" not in place else "frame"
    for each in (clock, "id", "x", "y"):
        refuse(each not in place, "the column", f"{each} missing", _HEAD, "add it", key="the head", file=name)
    unit = units["x"] or "px"
    refuse(
        units["y"] != units["x"] or unit not in ("px", *UNITS["length"]),
        "the unit",
        f"{units['x']} of x, {units['y']} of y",
        f"px or one of {', '.join(UNITS['length'])}",
        'the same for both: write "x [mm]", "y [mm]"',
        key="the head",
        file=name,
    )
    ids = list(dict.fromkeys(row[place["id"]] for row in cells[1:] if place["id"] < len(row)))
    names, turn = [each for each in ids if _POINT.fullmatch(each)], 0.0
    if not names:
        names, turn = ids, _turn_of_marker(ids, units, name)
    kinds = (clock, "x", "y", "likelihood", *(["angle"] if turn else []))
    own = {kind: place[kind] for kind in kinds if kind in place}
    others = [each for each in place if each not in (*kinds, "id")]
    unread = (*others, *(each for each in ids if each not in names))
    return _Layout(1, dict.fromkeys(names, own), unread, place["id"], unit, turn)


def _turn_of_marker(ids: list[str], units: dict[str, str | None], name: str) -> float:
    """Give the unit of a marker's angle in rad; refuse a table of several, or of one without an angle."""
    refuse(
        len(ids) != 1 or "angle" not in units,
        "the names of points",
        shown(", ".join(ids) or "none"),
        _NAMES,
        "rename them in column id",
        file=name,
    )
    turn = {"deg": math.pi / 180.0, "rad": 1.0}.get(units["angle"] or "", 0.0)
    remedy = 'write "angle [deg]"'
    refuse(not turn, "the unit", units["angle"], "deg or rad", remedy, key="the head", file=name)
    return turn


# ----------------------------------------------------------------
# How the camera sees the plane of motion: from numbers of the table to places from the joint.


View = Callable[[Points], Points]


def view_of(
    tracks: Tracks,
    scene: Scene,
    *,
    origin: Pair | None,
    along: Pair | None,
    length: float | str | None,
    corners: Sequence[tuple[Pair, Place]] | None,
    y_up: bool,
    mirrored: bool,
) -> View:
    """Give the function from x + iy of the table to x + iy of the plane, x along the arm from the joint, y up.

    Raises
    ------
    DataError
        A scale that is missing or given twice, points that are one, corners on a line.
    """
    file, pixels = tracks.file, tracks.unit == "px"
    scales = [("a unit", not pixels), ("corners", corners is not None), ("a length", length is not None)]
    given = [word for word, there in scales if there]
    refuse(
        len(given) > 1 or (corners is not None and mirrored),
        "the scale",
        " and ".join(given + ["mirrored"] * mirrored),
        "one of unit, corners, length",
        "leave one out",
        file=file,
    )
    refuse(
        not given or (length is not None and (origin is None or along is None)),
        "the scale of x and y in pixels",
        "missing",
        "origin (the joint), along (a point of the arm's line) and length (between these two)",
        "give all three, or corners; or x and y with a unit of length in the head",
        file=file,
    )
    factor = 1.0 if pixels else float(exact_factor(tracks.unit, scene.unit))
    flat = _homography(corners, scene, file) if corners else lambda z: factor * (z if y_up else z.conj())
    # the joint is 0 in tables of lengths and in places of corners
    start = 0j if origin is None else flat(np.array([complex(*origin)]))[0]
    end = start + 1.0 if along is None else flat(np.array([complex(*along)]))[0]
    refuse(
        start == end,
        "along",
        "the origin itself",
        "a point of the arm's line away from the joint",
        "name another point",
        file=file,
    )
    size = (
        1.0
        if length is None
        else length_of(length, scene, "the length from origin to along") / abs(end - start)
    )
    turn = size * abs(end - start) / (end - start)
    return lambda z: np.asarray(((flat(z) - start) * turn).conj() if mirrored else (flat(z) - start) * turn)


def pair_of(place: Place, scene: Scene) -> complex:
    """Read two lengths: texts with a unit, or numbers in the scene's unit."""
    x, y = (convert(parse(v, "length"), scene.unit) if isinstance(v, str) else float(v) for v in place)
    return complex(x, y)


def _homography(corners: Sequence[tuple[Pair, Place]], scene: Scene, file: str) -> View:
    """Find the projective map that takes pixels to places: the null vector of two equations for each corner."""
    refuse(len(corners) != 4, "the number of corners", len(corners), "four", "give four", file=file)
    pixels = np.array([complex(*pixel) for pixel, _ in corners])
    places = np.array([pair_of(place, scene) for _, place in corners])
    for each in (pixels, places):
        areas = [abs(((b - a).conjugate() * (c - a)).imag) for a, b, c in combinations(each, 3)]
        refuse(
            min(areas) <= _ON_A_LINE * abs(each[:, None] - each).max() ** 2,
            "the corners",
            "three on a line",
            "four corners",
            "name others",
            file=file,
        )
    # numbers of the size of 1, or squares of pixels drown the rest
    middle, shrunk = pixels.mean(), 1.0 / abs(pixels - pixels.mean()).max()
    p = (pixels - middle) * shrunk
    head = np.stack([p.real, p.imag, np.ones(4)], axis=1)
    none = np.zeros_like(head)
    rows = [[head, none, -places.real[:, None] * head], [none, head, -places.imag[:, None] * head]]
    matrix = np.linalg.svd(np.block(rows))[2][-1].reshape(3, 3)

    def flat(points: Points) -> Points:
        q = (points - middle) * shrunk  # nan over a number would warn
        x, y, w = (row[0] * q.real + row[1] * q.imag + row[2] for row in matrix)
        return np.asarray(x / w + 1j * (y / w))

    return flat
