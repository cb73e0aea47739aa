"""Tables that trackers write: where marked points of the part, or one marker on it, are in each frame of a film."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from limitsets.base import DataError, shown
from limitsets.base.arrays import Array, Ints
from limitsets.feeder.scene.units import UNITS

Points = NDArray[np.complex128]
"""Places in a plane: x + iy."""

CENTRE = "com"

Row = tuple[int, list[str]]

_HEAD = "columns frame (or time [s]), id, x, y, angle [deg] or [rad], or the three head rows of DeepLabCut"
_POINT = re.compile(r"P\d+|com")
_TITLE = re.compile(r"\s*([\w .-]*?)\s*(?:\[\s*([^\]]*?)\s*\])?\s*")
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?")
# A longer film is a mistake: numbers of frames that are times in microseconds, or the like.
_MOST_FRAMES = 5_000_000


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
    name = str(file).encode("utf-8", "backslashreplace").decode()  # what no terminal can print
    try:
        text = Path(file).read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        remedy = f"it could not be opened: {reason}"
        raise DataError("the file", name, "a CSV file in UTF-8", remedy, file=name) from None
    # read line by line: the number of a line is what an editor shows, and no tracker breaks a cell in two
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if not line.lstrip().startswith("#")]
    lines = [(k, line) for k, line in lines if line.strip(" \t,;")]
    if not lines:
        raise DataError("the file", "empty", _HEAD, "give the table of a tracker", file=name)
    separator = next((each for each in ";\t," if each in lines[0][1]), ",")
    cells = csv.reader((line for _, line in lines), delimiter=separator)
    rows = [(k, row) for (k, _), row in zip(lines, cells, strict=True)]
    table = _Table(name, rows, separator == ";", likelihood)
    return table.of_deeplabcut() if rows[0][1][0].strip().lower() == "scorer" else table.long()


@dataclass(frozen=True)
class _Table:
    """The rows of a file, with the numbers of their lines, and how its cells are read."""

    file: str
    rows: list[Row]
    commas: bool
    likelihood: float

    def number(self, row: Row, column: int, head: str) -> float:
        """Read a cell; one that is empty or nan, or that is not there, holds no number."""
        text = row[1][column].strip() if column < len(row[1]) else ""
        if text.lower() in ("", "nan"):
            return math.nan
        plain = text.replace(",", ".") if self.commas else text
        if not _NUMBER.fullmatch(plain):
            key = f"row {row[0]}, column {head}"
            remedy = "correct it, or leave the cell empty where nothing was seen"
            raise DataError("the number", shown(text), "a decimal number", remedy, key=key, file=self.file)
        return float(plain)

    def frame(self, row: Row, column: int) -> int:
        value = self.number(row, column, "frame")
        if not value.is_integer():
            key = f"row {row[0]}, column frame"
            allowed = "a whole number in every row"
            raise DataError("the frame", value, allowed, "number the frames", key=key, file=self.file)
        return int(value)

    def of_deeplabcut(self) -> Tracks:
        """Read what DeepLabCut writes: a row for each frame, and three columns for each point."""
        words = [row[1][0].strip().lower() for row in self.rows[:3]]
        if words != ["scorer", "bodyparts", "coords"]:
            allowed, remedy = "scorer, bodyparts, coords", "export the film of one part, not of several"
            raise DataError("the head rows", ", ".join(words), allowed, remedy, key="row 1", file=self.file)
        parts, kinds = ([cell.strip() for cell in row[1]] for row in self.rows[1:3])
        columns = {pair: k for k, pair in enumerate(zip(parts, kinds, strict=False)) if k}
        names = [part for part in dict.fromkeys(parts[1:]) if _POINT.fullmatch(part)]
        if not names:
            raise _no_point(parts[1:], self.file, f"row {self.rows[1][0]}")
        for pair in ((part, kind) for part in names for kind in ("x", "y")):
            if pair not in columns:
                missing, key = " ".join(pair), f"row {self.rows[2][0]}"
                allowed = "x, y and likelihood of each point"
                raise DataError("the column", f"{missing} missing", allowed, "add it", key=key, file=self.file)
        seen: dict[tuple[int, str], tuple[complex, float]] = {}
        for row in self.rows[3:]:
            frame = self.frame(row, 0)
            for part in names:
                x, y = (self.number(row, columns[part, kind], f"{part} {kind}") for kind in "xy")
                sure = columns.get((part, "likelihood"))
                unsure = sure is not None and self.number(row, sure, f"{part} likelihood") < self.likelihood
                self.add(seen, row, (frame, part), (math.nan if unsure else complex(x, y), math.nan))
        unread = tuple(part for part in dict.fromkeys(parts[1:]) if part not in names)
        return self.gathered(seen, tuple(names), "px", unread)

    def long(self) -> Tracks:
        """Read a table with a row for each point, or for the marker, and frame."""
        heads = [match.groups() if (match := _TITLE.fullmatch(cell)) else (cell, None) for cell in self.rows[0][1]]
        place = {name.lower(): k for k, (name, _) in enumerate(heads)}
        units = {name.lower(): unit for name, unit in heads}
        key = f"row {self.rows[0][0]}"
        for name in ("time" if "time" in place and "frame" not in place else "frame", "id", "x", "y"):
            if name not in place:
                raise DataError("the column", f"{name} missing", _HEAD, "add it", key=key, file=self.file)
        unit = units["x"] or "px"
        if units["y"] != units["x"] or unit not in ("px", *UNITS["length"]):
            allowed = f"px or one of {', '.join(UNITS['length'])}, the same for both"
            given, remedy = f"{units['x']} of x, {units['y']} of y", 'write "x [mm]", "y [mm]"'
            raise DataError("the unit", given, allowed, remedy, key=key, file=self.file)
        body = self.rows[1:]
        ids = [row[1][place["id"]].strip() if place["id"] < len(row[1]) else "" for row in body]
        names = [each for each in dict.fromkeys(ids) if _POINT.fullmatch(each)]
        turn = 0.0
        if not names:
            if len(set(ids)) != 1 or "angle" not in place:
                raise _no_point(ids, self.file, "column id")
            names = ids[:1]
            turn = {"deg": math.pi / 180.0, "rad": 1.0}.get(units["angle"] or "", 0.0)
            if not turn:
                raise DataError(
                    "the unit", units["angle"], "deg or rad", 'write "angle [deg]"', key=key, file=self.file
                )
        frames = self.frames(body, place)
        seen: dict[tuple[int, str], tuple[complex, float]] = {}
        for row, frame, name in zip(body, frames, ids, strict=True):
            if name in names:
                x, y = self.number(row, place["x"], "x"), self.number(row, place["y"], "y")
                angle = turn * self.number(row, place["angle"], "angle") if turn else math.nan
                unsure = "likelihood" in place and (
                    self.number(row, place["likelihood"], "likelihood") < self.likelihood
                )
                self.add(seen, row, (frame, name), (math.nan if unsure else complex(x, y), angle))
        known = ("frame", "time", "id", "x", "y", "likelihood", *(["angle"] if turn else []))
        others = [name for name in place if name not in known]
        unread = (*others, *(each for each in dict.fromkeys(ids) if each not in names))
        return self.gathered(seen, tuple(names), unit, unread, marker=turn > 0.0)

    def frames(self, body: list[Row], place: dict[str, int]) -> list[int]:
        """Number the frames of rows; of times, the frame is how many of the usual steps have passed."""
        if "frame" in place:
            return [self.frame(row, place["frame"]) for row in body]
        times = np.array([self.number(row, place["time"], "time") for row in body])
        if not np.isfinite(times).all():
            row = body[int(np.argmin(np.isfinite(times)))][0]
            key = f"row {row}, column time"
            raise DataError("the time", "empty", "a number in every row", "add it", key=key, file=self.file)
        steps = np.diff(np.unique(times))
        step = float(np.median(steps)) if steps.size else 1.0
        numbers: list[int] = np.rint((times - times.min()) / step).astype(np.int64).tolist()
        return numbers

    def add(
        self,
        seen: dict[tuple[int, str], tuple[complex, float]],
        row: Row,
        which: tuple[int, str],
        what: tuple[complex, float],
    ) -> None:
        if which in seen:
            key, twice = f"row {row[0]}", f"{which[1]} twice in frame {which[0]}"
            raise DataError("the point", twice, "each once in a frame", "leave one out", key=key, file=self.file)
        seen[which] = what

    def gathered(
        self,
        seen: dict[tuple[int, str], tuple[complex, float]],
        names: tuple[str, ...],
        unit: str,
        unread: Sequence[str],
        *,
        marker: bool = False,
    ) -> Tracks:
        numbers = np.unique(np.array([frame for frame, _ in seen], dtype=np.int64))
        if not numbers.size or numbers[-1] - numbers[0] > _MOST_FRAMES:
            span = f"{numbers[0]} to {numbers[-1]}" if numbers.size else "none"
            allowed = f"numbers of frames within {_MOST_FRAMES}"
            raise DataError("the frames", span, allowed, "number the frames from 0", file=self.file)
        line = {int(frame): k for k, frame in enumerate(numbers)}
        at = np.full((numbers.size, len(names)), complex(math.nan, math.nan))
        angle = np.full(numbers.size, math.nan)
        for (frame, name), (spot, turned) in seen.items():
            at[line[frame], names.index(name)] = spot
            angle[line[frame]] = turned
        return Tracks(self.file, numbers, names, at, angle if marker else None, unit, tuple(unread))


def _no_point(names: Sequence[str], file: str, key: str) -> DataError:
    given = shown(", ".join(dict.fromkeys(names)) or "none")
    allowed = f"points of the part, P0, P1, ... as the scene counts its vertices, {CENTRE}, or one marker with angle"
    return DataError("the names of points", given, allowed, "rename them in the table", key=key, file=file)
