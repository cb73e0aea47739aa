"""SVG: its shapes as lines in the plane, with y upwards as on the screen.

svgelements reads the data of paths and the text of transformations.  The tree is walked here: its own walk takes an
inch for 2.54001 cm, draws what stands in masks and symbols, and follows clones of clones without an end.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from limitsets.base.arrays import Array
from limitsets.feeder.drawing.curves import (
    BROKEN,
    Curve,
    Sheet,
    broken,
    package,
    require,
    require_few,
    require_known,
)

_SVG = "{http://www.w3.org/2000/svg}"
_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
_LINK = "{http://www.w3.org/1999/xlink}href"

# Of lengths with a physical size: which unit of ours the page then has, and how many px, 1/96 in, one of it is.
_PHYSICAL = {
    "mm": ("mm", 96 / 25.4),
    "cm": ("cm", 96 / 2.54),
    "in": ("in", 96.0),
    "pt": ("in", 96 / 72),
    "pc": ("in", 96 / 6),
    "Q": ("mm", 96 / 101.6),
}

_LENGTH = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-z%]*)\s*")

# What says something of a drawing and draws nothing where it stands.
_SILENT = ("defs", "desc", "metadata", "script", "style", "title")
_GROUPS = ("a", "g", "switch")
_SHAPES = ("circle", "ellipse", "line", "path", "polygon", "polyline", "rect")


def read_svg(path: Path, layers: Sequence[str]) -> Sheet:
    """Read the lines of an SVG file.

    Parameters
    ----------
    path : Path
        The file.
    layers : sequence of str
        Groups to read, by id or by the name that Inkscape gives a layer; all without.

    Returns
    -------
    Sheet

    Raises
    ------
    AnswerError
        No SVG, entities of XML, a group that it does not have, a length in a unit without a size, or more lines than
        anyone draws.
    """
    elements = package("svgelements")
    data = path.read_bytes()
    # in encodings of two and four bytes zeros stand between the letters
    entities = b"<!ENTITY" in data.replace(b"\0", b"")
    require(not entities, "this SVG", "one with <!ENTITY", "XML without entities", "save it as plain SVG")
    try:
        root = ET.fromstring(data)
        if root.tag not in ("svg", f"{_SVG}svg"):
            raise ValueError(f"its first element is {root.tag!r}")
        walk = _Walk(elements, root, layers)
        require_few(walk.unfolded(root, {}))
        walk.element(root, np.diag([1.0, -1.0, 1.0]), "", not layers, 0)
        require_known([name for name in layers if name not in walk.names], walk.names)
        return Sheet(walk.curves, walk.left_out, *_stated(root.attrib))
    except (ET.ParseError, *BROKEN) as error:
        raise broken("SVG", error) from None


def _stated(page: Mapping[str, str]) -> tuple[str | None, Array]:
    """Give the unit that width or height of the page state, and what one user unit is in it along x and y."""
    sides = {name: _LENGTH.fullmatch(page.get(name, "")) for name in ("width", "height")}
    given = {name: side[2] for name, side in sides.items() if side and side[2] in _PHYSICAL}
    unit = next((_PHYSICAL[each][0] for each in given.values()), None)
    pixels = _PHYSICAL[unit][1] if unit else 1.0
    box = [float(number) for number in re.split(r"[\s,]+", page.get("viewBox", "")) if number]
    if unit is None or len(box) != 4 or min(box[2:]) <= 0.0:
        return unit, np.full(2, 1.0 / pixels)
    whole = {"width": box[2], "height": box[3]}
    scales = np.array([_user_units(page, name) / whole[name] / pixels for name in given])
    fit = page.get("preserveAspectRatio", "")
    kept = scales.max() if "slice" in fit else scales.min()
    return unit, np.broadcast_to(scales if "none" in fit else kept, 2)


class _Walk:
    """Walks the tree of an SVG and keeps what it draws."""

    def __init__(self, elements: Any, root: ET.Element, layers: Sequence[str]) -> None:
        self.elements, self.root, self.wanted, self.count = elements, root, set(layers), 0
        self.by_id = {f"#{each.get('id')}": each for each in root.iter() if each is not root}
        self.curves: list[Curve] = []
        self.left_out: Counter[str] = Counter()
        self.names: set[str] = set()

    def element(self, element: ET.Element, matrix: Array, layer: str, chosen: bool, depth: int) -> None:
        """Read an element with all in it: on which layer it is, and whether that is one of those to read.

        `matrix` maps what stands around it to the plane; columns are vectors.
        """
        self.count += 1
        require_few(self.count + len(self.curves), depth)
        tag, words = _words(element)
        m = self.elements.Matrix(words.get("transform", ""))
        matrix = matrix @ np.array([[m.a, m.c, m.e], [m.b, m.d, m.f], [0.0, 0.0, 1.0]], float)
        if "{" in tag or tag in _SILENT:
            self.left_out["style sheet"] += tag == "style"  # it may hide shapes
            return
        if _hidden(words):
            self.left_out["hidden"] += 1
        elif tag in _GROUPS or element is self.root:
            names = {words[key] for key in ("id", _LABEL) if key in words}
            self.names |= names
            for inner in element:
                self.element(
                    inner, matrix, words.get(_LABEL, layer), chosen or bool(names & self.wanted), depth + 1
                )
        elif tag == "use" and (cloned := self.by_id.get(_link(words))) is not None:
            shift = np.eye(3)
            shift[:2, 2] = _user_units(words, "x"), _user_units(words, "y")
            self.element(cloned, matrix @ shift, layer, chosen, depth + 1)
        elif chosen:
            self._shape(tag, words, matrix, layer)

    def unfolded(self, element: ET.Element, known: dict[ET.Element, int], depth: int = 0) -> int:
        """Count the elements that `element` reads, each that is cloned once, before it reads them one by one."""
        require_few(0, depth)
        if element not in known:
            tag, words = _words(element)
            inner: Iterable[ET.Element] = ()
            if not ("{" in tag or tag in _SILENT or _hidden(words)):
                if tag in _GROUPS or element is self.root:
                    inner = element
                elif tag == "use" and (cloned := self.by_id.get(_link(words))) is not None:
                    inner = (cloned,)
            known[element] = 1 + sum(self.unfolded(each, known, depth + 1) for each in inner)
        return known[element]

    def _shape(self, tag: str, words: Mapping[str, str], matrix: Array, layer: str) -> None:
        """Keep the lines of a shape, and count what is no shape, or cut off by another one."""
        if tag not in _SHAPES:
            self.left_out[tag] += 1
            return
        if words.get("clip-path", words.get("mask", "none")) != "none":
            self.left_out["clip-path or mask"] += 1
        round_one = tag in ("circle", "ellipse")
        drawn = _round(words, layer) if round_one else self._path(_data(tag, words), layer)
        self.curves += [curve.mapped(matrix[:2, :2], matrix[:2, 2]) for curve in drawn]

    def _path(self, data: str, layer: str) -> Iterator[Curve]:
        """Give the lines of a path."""
        # a point after the last digit is a number in SVG, and the end of the data to svgelements
        for segment in self.elements.Path(re.sub(r"(\d)\.(?!\d)", r"\1", data)).segments():
            kind = type(segment).__name__
            if kind == "Arc" and segment.sweep:
                yield _arc(segment, layer)
            elif kind in ("QuadraticBezier", "CubicBezier"):
                ends = np.ones(len(segment))
                control = np.array([tuple(point) for point in segment])
                yield Curve(control, layer, knots=np.concatenate([0.0 * ends, ends]), weights=ends)
            elif kind != "Move" and segment.start is not None:
                yield Curve(np.array([tuple(segment.start), tuple(segment.end)]), layer)


def _words(element: ET.Element) -> tuple[str, dict[str, str]]:
    """Give the tag of an element and its attributes, with those in its style."""
    pairs = [each.partition(":") for each in element.get("style", "").split(";")]
    words = element.attrib | {name.strip(): value.strip() for name, _, value in pairs}
    return element.tag.removeprefix(_SVG), words


def _hidden(words: Mapping[str, str]) -> bool:
    return words.get("display") == "none" or words.get("visibility") in ("hidden", "collapse")


def _link(words: Mapping[str, str]) -> str:
    return words.get("href", words.get(_LINK, ""))


def _round(words: Mapping[str, str], layer: str) -> Iterator[Curve]:
    """Give a circle or an ellipse."""
    across, up = (_user_units(words, "r" if "r" in words else name) for name in ("rx", "ry"))
    start = [_user_units(words, "cx") + across, _user_units(words, "cy")]
    yield Curve(np.array([start, [across, 0.0], [0.0, up]]), layer, sweep=math.tau)


def _data(tag: str, words: Mapping[str, str]) -> str:
    """Write a shape with straight sides, or rounded corners, as the data of a path."""
    if tag == "path":
        return words.get("d", "")
    if tag == "line":
        return "M{!r} {!r}L{!r} {!r}".format(*(_user_units(words, name) for name in ("x1", "y1", "x2", "y2")))
    if tag != "rect":
        points = words.get("points", "").strip()
        return f"M{points}{'Z' if tag == 'polygon' else ''}" if points else ""
    x, y, width, height = (_user_units(words, name) for name in ("x", "y", "width", "height"))
    if width <= 0.0 or height <= 0.0:
        return ""
    # of the two radii of a corner one stands for the other
    rx = min(_user_units(words, "rx" if "rx" in words else "ry"), width / 2)
    ry = min(_user_units(words, "ry" if "ry" in words else "rx"), height / 2)
    right, low, turn = x + width, y + height, f"A{rx!r} {ry!r} 0 0 1"
    return (
        f"M{x + rx!r} {y!r}H{right - rx!r}{turn} {right!r} {y + ry!r}V{low - ry!r}{turn} {right - rx!r} {low!r}"
        f"H{x + rx!r}{turn} {x!r} {low - ry!r}V{y + ry!r}{turn} {x + rx!r} {y!r}Z"
    )


def _arc(segment: Any, layer: str) -> Curve:
    """Take an arc of svgelements over: centre, ends of two axes, start, end and a rounded angle."""
    names = ("center", "prx", "pry", "start", "end")
    centre, one, other, start, end = (np.array(tuple(getattr(segment, name))) for name in names)
    axes = np.array([one - centre, other - centre])
    (x, y), (u, v) = np.linalg.solve(axes.T, np.array([start - centre, end - centre]).T).T
    # an angle that was read off its cosine has half of the digits: the nearest one that leads to the end
    more = math.atan2(v, u) - math.atan2(y, x) - segment.sweep
    sweep = segment.sweep + (more + math.pi) % math.tau - math.pi
    return Curve(np.array([start, start - centre, x * axes[1] - y * axes[0]]), layer, sweep=sweep)


def _user_units(words: Mapping[str, str], name: str) -> float:
    """Read a length in user units; 0 where it is not given."""
    match = _LENGTH.fullmatch(words.get(name, "0"))
    if match is None or match[2] not in ("", "px", *_PHYSICAL):
        raise ValueError(f"{name} is {words[name][:40]!r}, no length with a size of its own")
    return float(match[1]) * (_PHYSICAL[match[2]][1] if match[2] in _PHYSICAL else 1.0)
