"""Throws that were filmed, read from a CSV file: places with units in the header, sides, whose row follows whose."""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from limitsets.base import DataError, SceneError, shown
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.units import UNITS, convert, parse

PLACES = ("x_before", "x_after")
CORNERS = ("corner_before", "corner_after")
SIDES = ("side_before", "side_after")
OPTIONAL = ("error", "run")
WITH_UNIT = (*PLACES, *CORNERS, "error")
COLUMNS = (*PLACES, *CORNERS, *SIDES, *OPTIONAL)
BEFORE = (PLACES[0], CORNERS[0])
# A measured place may lie off the arm by this share of its length.
SLACK = 0.05
# With fewer throws nothing is left to judge the fit by.
LEAST_ROWS = 8

_HEADER = (
    "x_before [mm], side_before, x_after [mm], side_after, and, if known, error [mm], run; corner_before, "
    "corner_after for x_before, x_after where the left corner was read"
)
_HEAD = re.compile(r"\s*([A-Za-z_]+)\s*(?:\[\s*([^\]]*?)\s*\])?\s*")


@dataclass(frozen=True, eq=False)
class Throws:
    """Throws of one part, n of them.

    Attributes
    ----------
    x_before, x_after : ndarray, shape (n,)
        Measured places before and after [length, in the scene's unit]: x of what `corner` says.
    side_before, side_after : ndarray of int, shape (n,)
        The sides as they were recorded.
    error : ndarray, shape (n,)
        Standard deviation of one measured place [length]; nan where none is given.
    follows : ndarray of bool, shape (n,)
        Whether the throw is the next of the same run: it begins where the row before ended.
    row : ndarray of int, shape (n,)
        Line of the file, the header being line 1.
    file : str
        For messages; empty for throws that are in no file.
    corner : bool
        Whether places are those of the left corner of the side that the part rests on, not of the centre of mass.
    unit : str
        In which places are written in the file; empty for throws that are in no file.
    """

    x_before: Array
    side_before: Ints
    x_after: Array
    side_after: Ints
    error: Array
    follows: Mask
    row: Ints
    file: str = ""
    corner: bool = False
    unit: str = ""

    def __len__(self) -> int:
        return self.row.size

    @property
    def shared(self) -> Mask:
        """Whether the place before is the very reading of the row before, not one of its own."""
        same = np.zeros(len(self), dtype=bool)
        same[1:] = (self.x_before[1:] == self.x_after[:-1]) & (self.side_before[1:] == self.side_after[:-1])
        return same & self.follows

    @property
    def read_twice(self) -> Array:
        """Differences of two readings of one place: a row that follows another with a reading of its own [length]."""
        again = np.flatnonzero(self.follows & ~self.shared)
        again = again[self.side_before[again] == self.side_after[again - 1]]
        return np.asarray(self.x_before[again] - self.x_after[again - 1])


def read_throws(file: str | Path, scene: Scene) -> Throws:
    r"""Read the throws of a part from a CSV file.

    Parameters
    ----------
    file : str or Path
        Columns `x_before`, `side_before`, `x_after`, `side_after`, and, if known, `error` (the standard deviation of
        one measured place) and `run` (rows of one run that follow each other are consecutive throws).  Places and the
        error have their unit in the header: ``x_before [mm]``.  Where a film shows corners, not the centre of mass,
        `corner_before` and `corner_after` stand for x: the place of the left corner of the side that the part rests on.
    scene : Scene
        The part that was thrown: it has the sides, and its unit is that of the answer.

    Returns
    -------
    Throws

    Raises
    ------
    DataError
        The first thing wrong: the file, a column, a unit, or a cell, with its row and column.

    Examples
    --------
    >>> import tempfile
    >>> import limitsets as ls
    >>> text = "x_before [in],side_before,x_after [in],side_after\n" + "8,2,8.26,2\n" * 8
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "throws.csv"
    ...     _ = path.write_text(text)
    ...     throws = read_throws(path, ls.load("paper-designed"))
    >>> len(throws), float(throws.x_after[0])
    (8, 8.26)
    """
    return throws_in(file, scene)


def throws_in(file: str | Path, scene: Scene, *, anywhere: bool = False) -> Throws:
    """Read throws; `anywhere` takes places off the arm and sides that the part does not have, too."""
    name = str(file).encode("utf-8", "backslashreplace").decode()  # what no terminal can print
    rows = _rows(Path(file), name)
    if not rows:
        raise DataError("the file", "empty", _HEADER, "write a header and a row for each throw", file=name)
    heads = _heads(rows[0][1], name)
    values: dict[str, list[float | str]] = {column: [] for column in heads}
    lines = []
    for line, cells in rows[1:]:
        if not any(cell.strip() for cell in cells):
            continue
        if len(cells) != len(heads):
            raise DataError(
                "the number of cells",
                len(cells),
                f"{len(heads)}, one for each column",
                "correct the row; decimals have a point",
                key=f"row {line}",
                file=name,
            )
        lines.append(line)
        for (column, (head, unit)), cell in zip(heads.items(), cells, strict=True):
            key = f"row {line}, column {head}"
            values[column].append(_cell(cell, column, unit, key, scene, name))
            if not anywhere:
                _require_possible(
                    values[column][-1], f"{cell.strip()} {unit}".strip(), column, key, scene, name
                )
    if len(lines) < LEAST_ROWS:
        raise DataError("the number of throws", len(lines), f"{LEAST_ROWS} at least", "film more", file=name)
    run = np.array(values.get("run", lines), dtype=object)
    follows = np.zeros(len(lines), dtype=bool)
    follows[1:] = (run[1:] == run[:-1]) & (run[1:] != "")
    corner = CORNERS[0] in values
    before, after = (np.array(values[each], dtype=np.float64) for each in (CORNERS if corner else PLACES))
    start, end = (np.array(values[each], dtype=np.int64) for each in SIDES)
    units = {unit for column, (_, unit) in heads.items() if column in (*PLACES, *CORNERS)}
    return Throws(
        x_before=before,
        side_before=start,
        x_after=after,
        side_after=end,
        error=np.array(values.get("error", [np.nan] * len(lines)), dtype=np.float64),
        follows=follows,
        row=np.array(lines),
        file=name,
        corner=corner,
        unit=units.pop() if len(units) == 1 else "",
    )


def _rows(path: Path, name: str) -> list[tuple[int, list[str]]]:
    """Return the cells of each row, with the line it ends on."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.reader(stream, strict=True)
            return [(reader.line_num, cells) for cells in reader]
    except UnicodeDecodeError as error:
        raise DataError(
            "the text", f"undecodable at byte {error.start}", "UTF-8", "save the file as UTF-8", file=name
        ) from None
    except csv.Error as error:
        raise DataError(
            "the text", f"{error}", "rows of cells, separated by commas", "correct it", file=name
        ) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise DataError(
            "the file", name, "a CSV file that can be read", f"it could not be opened: {reason}", file=name
        ) from None


def _heads(cells: Sequence[str], name: str) -> dict[str, tuple[str, str]]:
    """Read the header: column, its text, its unit."""
    heads: dict[str, tuple[str, str]] = {}
    for cell in cells:
        match = _HEAD.fullmatch(cell)
        column, unit = (match[1].lower(), match[2]) if match else (cell, None)
        key = f"row 1, column {shown(cell)}"
        if column not in COLUMNS:
            near = difflib.get_close_matches(column, COLUMNS, n=1)
            remedy = "name it so, or leave it out; commas separate columns"
            if near:
                remedy = f"did you mean '{near[0]}{' [mm]' if near[0] in WITH_UNIT else ''}'?"
            raise DataError("the column", shown(cell), _HEADER, remedy, key="row 1", file=name)
        if column in heads:
            raise DataError("the column", column, "each column once", "leave one out", key=key, file=name)
        if column in WITH_UNIT:
            if unit is None or unit not in UNITS["length"]:
                allowed, remedy = f"one of {', '.join(UNITS['length'])}", f'write it like "{column} [mm]"'
                raise DataError("the unit", unit, allowed, remedy, key=key, file=name)
        elif unit is not None:
            raise DataError("the unit", unit, "none in this column", "leave it out", key=key, file=name)
        heads[column] = (cell.strip(), unit or "")
    corners = [column for column in CORNERS if column in heads]
    if corners and any(column in heads for column in PLACES):
        allowed = "two places of one kind: x_before and x_after, or corner_before and corner_after"
        raise DataError(
            "the columns", ", ".join(heads), allowed, "leave the others out", key="row 1", file=name
        )
    for column in (*(CORNERS if corners else PLACES), *SIDES):
        if column not in heads:
            raise DataError("the column", f"{column} missing", _HEADER, "add it", key="row 1", file=name)
    return heads


def _cell(cell: str, column: str, unit: str, key: str, scene: Scene, name: str) -> float | str:
    text = cell.strip()
    if column == "run":
        return text
    if not text:
        raise DataError(
            "the cell",
            "empty",
            "a value in every row",
            "measure it, or leave the row out",
            key=key,
            file=name,
        )
    if column in SIDES:
        if not (text.isascii() and text.isdigit()):
            raise _not_a_side(text, key, scene, name)
        return float(text)
    try:
        value = convert(parse(f"{text} {unit}", "length"), scene.unit)
    except SceneError:
        raise DataError(
            "the number",
            shown(text),
            "a decimal number, its unit in the header",
            "correct it",
            key=key,
            file=name,
        ) from None
    if column == "error" and value <= 0:
        raise DataError("the error", shown(text), "above 0", "give a standard deviation", key=key, file=name)
    return value


def _not_a_side(text: str, key: str, scene: Scene, name: str) -> DataError:
    allowed = f"a side of this part, 0 to {len(scene.sides) - 1}"
    return DataError("the side", shown(text), allowed, "count the sides in flip order", key=key, file=name)


def _require_possible(value: float | str, text: str, column: str, key: str, scene: Scene, name: str) -> None:
    """Refuse a side that the part does not have, and a place off the arm."""
    if column in SIDES and float(value) >= len(scene.sides):
        raise _not_a_side(text, key, scene, name)
    # places are measured: with errors, and a corner may lie at the joint itself
    least = -SLACK * scene.arm_length if column in CORNERS else 0.0
    if column in (*PLACES, *CORNERS) and not least < float(value) <= (1.0 + SLACK) * scene.arm_length:
        allowed = f"above 0 and up to the arm's length, {scene.arm_length:g} {scene.unit}"
        remedy = "correct it" if column in BEFORE else "correct it, or leave out a throw off the arm"
        raise DataError("the place", text, allowed, remedy, key=key, file=name)


def length_of(value: float | str, scene: Scene, thing: str) -> float:
    """Read a length above 0: text with a unit, or a number in the scene's unit."""
    size = convert(parse(value, "length", key=thing), scene.unit) if isinstance(value, str) else float(value)
    if not 0 < size < np.inf:
        raise DataError(thing, value, "above 0", "give a standard deviation, like '0.5 mm'")
    return size
