"""Drawings as plates: one outline, holes in it, and how far their chords are from what is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from limitsets.base import AnswerError, LimitsetsError, arguments_checked
from limitsets.base.arrays import Array
from limitsets.feeder.drawing.curves import SAMPLES, Sheet, require
from limitsets.feeder.drawing.dxf import read_dxf
from limitsets.feeder.drawing.loops import Loop, flush, joined_loops, place, require_one_plate, rounded
from limitsets.feeder.drawing.svg import read_svg
from limitsets.feeder.geometry import Hole, mass_of
from limitsets.feeder.scene.units import UNITS, convert, exact_factor, parse

# Bytes that are read: a drawing of one part has some thousands.
LARGEST = 50_000_000

# In parts of the extent: the error of chords where none is given.
_ERROR = 1e-3

# Likewise the least one: chords that are nearer would make corners flatter than those that count.
_LEAST_ERROR = 1e-6

# In any unit, what a quantity of a scene may be at most.
_LARGEST_LENGTH = 1e12

# In parts of the extent, how far from the origin a drawing may be: farther, floats lack the digits for decimals.
_FARTHEST = 1e5


@dataclass(frozen=True, eq=False)
class Drawing:
    """A plate as it is drawn, where it is drawn.

    Attributes
    ----------
    unit : str
        The unit of length of all numbers.
    outline : ndarray, shape (n, 2)
        A simple polygon, counterclockwise, the lowest vertex, of several the left one, first.
    holes : tuple of Hole
        The largest one first.
    thickness : float or None
        Of the plate, where all lines of the outline in a DXF file state the same.
    chord_error : float
        No chord is farther than this from the curve for which it stands; 0 where no curve was.
    left_out : tuple of str
        What was not read: how many of which kind, like ``"3 TEXT"``.
    """

    unit: str
    outline: Array
    holes: tuple[Hole, ...]
    thickness: float | None
    chord_error: float
    left_out: tuple[str, ...]

    @property
    def extent(self) -> tuple[float, float]:
        """Width and height of the outline."""
        width, height = np.ptp(self.outline, axis=0).tolist()
        return width, height

    @property
    def area(self) -> float:
        """Area of the plate, its holes taken away."""
        return float(mass_of(self.outline.tolist(), 1.0, holes=self.holes).mass)


@arguments_checked
def read_drawing(
    file: str | Path,
    *,
    unit: str | None = None,
    scale: str | None = None,
    error: str | None = None,
    layers: Sequence[str] = (),
) -> Drawing:
    """Read the outline of a part and its holes from a DXF or SVG file.

    Coordinates stay where the file has them, but for SVG, whose y points down: its points are mirrored, so that the
    part looks as on the screen.  Every vertex of a chord lies on the drawn curve.  Ends of lines that are no farther
    from each other than 1e-6 of the drawing's larger extent belong together, and a line that is drawn twice counts
    once.  Vertices that are beside a side of the convex hull by rounding are set on it or inside: a part rests on the
    sides of its hull, and rounding makes none.

    Parameters
    ----------
    file : str or Path
        A file whose name ends in .dxf or .svg.
    unit : str, optional
        The unit of length of the result; by default that of the drawing.  A drawing that states none has this one.
    scale : str, optional
        What 1 is in the drawing, like ``"0.1 mm"``, whatever it states.
    error : str, optional
        How far chords may be from a curve, like ``"0.01 mm"``; by default 1/1000 of the drawing's larger extent.
    layers : sequence of str
        Layers of a DXF file, or groups of an SVG by their id or by the name that Inkscape gives them; all without.

    Returns
    -------
    Drawing

    Raises
    ------
    AnswerError
        No file that can be read, no unit, a layer that is not there, lines that are not one outline with holes in it,
        or a package that is not installed.

    Examples
    --------
    >>> import tempfile
    >>> text = '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="30mm" viewBox="0 0 40 30">'
    >>> text += '<path d="M0 30 L40 30 L0 0 Z"/> <circle cx="10" cy="20" r="4"/> </svg>'
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "plate.svg"
    ...     _ = file.write_text(text)
    ...     plate = read_drawing(file, unit="cm")
    >>> plate.unit, plate.outline.tolist()
    ('cm', [[0.0, -3.0], [4.0, -3.0], [0.0, 0.0]])
    >>> plate.holes[0].centre, plate.holes[0].diameter
    ((1.0, -2.0), 0.8)
    """
    try:
        units = UNITS["length"]
        require(unit in (None, *units), "the unit of the drawing", unit, ", ".join(units), "name one of them")
        with np.errstate(
            all="ignore"
        ):  # numbers of broken files overflow, and are refused where all are known
            return _plate(_sheet(Path(file), layers), unit, scale, error)
    except LimitsetsError as wrong:
        raise AnswerError(wrong.thing, wrong.value, wrong.allowed, wrong.remedy, file=str(file)) from None


def _sheet(path: Path, layers: Sequence[str]) -> Sheet:
    """Read the lines of a file, of which its suffix says what it is."""
    thing, readers = "the drawing", {".dxf": read_dxf, ".svg": read_svg}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise AnswerError(thing, path.name, "a file that ends in .dxf or .svg", "save it as one of them")
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
    except OSError as reason:
        raise AnswerError(thing, reason.strerror, "a file that can be read", "look at its name") from None
    require(0 < size <= LARGEST, thing, f"{size} bytes long", f"1 to {LARGEST} bytes", "save one part alone")
    return reader(path, layers)


def _plate(sheet: Sheet, unit: str | None, scale: str | None, error: str | None) -> Drawing:
    """Make a plate of the lines of a file."""
    own, size = sheet.unit or unit, sheet.size
    if scale is not None:
        own = parse(scale, "length").unit
        size = np.full(2, _length("the scale", scale, own))
    if own is None:
        raise AnswerError(
            "the unit of the drawing", "not stated", ", ".join(UNITS["length"]), "give --unit mm, say"
        )
    unit = unit or own
    factors = size * float(exact_factor(own, unit))
    curves = [curve.mapped(np.diag(factors), np.zeros(2), factors.max()) for curve in sheet.curves]
    left_out = tuple(f"{count} {kind}" for kind, count in sorted(sheet.left_out.items()) if count)
    value = f"without lines; left out: {', '.join(left_out) or 'nothing'}"
    require(
        curves, "the drawing", value, "lines, arcs and curves of an outline", "draw it, or name its layers"
    )
    points = np.concatenate([curve.at(SAMPLES) for curve in curves])
    extent = float(np.ptp(points, axis=0).max())
    farthest = points[np.abs(points).max(axis=1).argmax()]
    value, allowed = f"one that reaches {place(farthest, unit)}", f"one within {_FARTHEST:g} times its extent"
    near = np.abs(farthest).max() <= min(_FARTHEST * extent, _LARGEST_LENGTH)
    require(near, "the drawing", value, allowed, "move it to its origin")
    chord, least = _ERROR * extent, _LEAST_ERROR * extent
    if error is not None:
        chord = _length("the error of chords", error, unit)
    allowed = f"from {least:.3g} {unit}, a millionth of the drawing's extent"
    require(chord >= least, "the error of chords", error, allowed, "give a larger --error")
    loops = joined_loops(curves, extent, chord, unit)
    loops[0] = replace(loops[0], points=flush(loops[0].points, extent), circle=None)
    require_one_plate(loops, extent, unit)
    bound = max(loop.bound for loop in loops if not loop.circle)
    holes = tuple(_hole(loop, extent) for loop in loops[1:])
    return Drawing(unit, loops[0].points, holes, loops[0].thickness, bound, left_out)


def _hole(loop: Loop, extent: float) -> Hole:
    if loop.circle is None:
        return Hole(vertices=[(x, y) for x, y in rounded(loop.points, extent).tolist()])
    x, y, diameter = rounded(np.append(*loop.circle), extent).tolist()
    return Hole((x, y), diameter)


def _length(thing: str, text: str, unit: str) -> float:
    """Read a length above 0 in a unit."""
    length = convert(parse(text, "length"), unit)
    require(length > 0.0, thing, text, "a length above 0", "correct it")
    return length
