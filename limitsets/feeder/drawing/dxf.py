"""DXF: the entities of the model space, with those of blocks, as lines in the plane.

ezdxf reads the file.  Its own paths turn arcs into Bezier curves and its transformations of blocks refit ellipses, so
that neither is used: the vectors of each entity are taken from it, and all maps of the blocks around it act on them.
"""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

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

# Numbers of $INSUNITS; 0 says that there is none.
_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 13: "um"}

_UNHEARD = logging.NullHandler()

_READ = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "AcDb2dPolyline", "AcDb3dPolyline", "SPLINE")


def read_dxf(path: Path, layers: Sequence[str]) -> Sheet:
    """Read the lines of a DXF file.

    Parameters
    ----------
    path : Path
        The file.
    layers : sequence of str
        The names of those to read, whatever their capitals; all without.

    Returns
    -------
    Sheet

    Raises
    ------
    AnswerError
        No DXF, a layer that it does not have, a line that leaves the plane, or more lines than anyone draws.
    """
    ezdxf = package("ezdxf")
    # it tells of each flaw of a file, to stderr where nobody listens; what cannot be read is refused in one line
    logging.getLogger("ezdxf").addHandler(_UNHEARD)
    try:
        return _sheet(ezdxf.readfile(path), b"$INSUNITS" in path.read_bytes(), layers)
    except (ezdxf.DXFError, *BROKEN) as error:
        raise broken("DXF", error) from None


def _sheet(document: Any, states_unit: bool, layers: Sequence[str]) -> Sheet:
    """Read the lines of a document of ezdxf, which gives metres to a file that states nothing."""
    off = {layer.dxf.name.lower() for layer in document.layers if layer.is_off() or layer.is_frozen()}
    known = {layer.dxf.name.lower(): layer.dxf.name for layer in document.layers}
    wanted = {name.lower() for name in layers}
    curves: list[Curve] = []
    left_out: Counter[str] = Counter()
    require_few(_unfolded(document.modelspace(), {}))
    for count, (entity, layer, matrix) in enumerate(_entities(document.modelspace(), np.eye(4), "")):
        require_few(count + len(curves))
        known.setdefault(layer.lower(), layer)
        kind = entity.get_mode() if entity.dxftype() == "POLYLINE" else entity.dxftype()
        if layer.lower() in off:
            left_out["on layers that are off"] += 1
        elif wanted and layer.lower() not in wanted:
            continue
        elif entity.dxf.get("invisible", 0):
            left_out["invisible"] += 1
        elif kind in _READ:
            curves += [_in_plane(entity, layer, matrix, *piece) for piece in _pieces(entity, kind)]
        elif kind != "INSERT" or entity.block() is None:
            left_out[kind] += 1
    require_known([name for name in layers if name.lower() not in known], known.values())
    on_paper = [entity for sheet in document.layouts if not sheet.is_modelspace for entity in sheet]
    left_out["in paper space"] += sum(entity.dxftype() != "VIEWPORT" for entity in on_paper)
    code = document.header.get("$INSUNITS", 0) if states_unit else 0
    return Sheet(curves, left_out, _UNITS.get(code), np.ones(2))


def _unfolded(layout: Any, known: dict[str, int], depth: int = 0) -> int:
    """Count the entities that `_entities` walks, each block once, before it walks them one by one."""
    require_few(0, depth)
    count = 0
    for entity in layout:
        count += 1
        if entity.dxftype() == "INSERT" and (block := entity.block()) is not None:
            if block.name not in known:
                known[block.name] = _unfolded(block, known, depth + 1)
            count += max(entity.mcount, 1) * known[block.name]
    return count


def _entities(layout: Any, matrix: Array, outer: str, depth: int = 0) -> Iterator[tuple[Any, str, Array]]:
    """Walk entities, those of blocks after their INSERT, each with its layer and the map of the blocks around it."""
    require_few(0, depth)
    for entity in layout:
        # what is drawn on layer 0 of a block lies where the block is laid
        layer = outer if outer and entity.dxf.layer == "0" else entity.dxf.layer
        yield entity, layer, matrix
        if entity.dxftype() == "INSERT" and entity.block() is not None:
            require_few(entity.mcount)
            for laid in entity.multi_insert() if entity.mcount > 1 else [entity]:
                inner = np.array(list(laid.matrix44().rows())) @ matrix
                yield from _entities(entity.block(), inner, layer, depth + 1)


# Vectors in space like those of `Curve`, sweep, knots and weights.
_Piece = tuple[Sequence[Any], float, Any, Any]


def _pieces(entity: Any, kind: str) -> Iterator[_Piece]:
    """Give the lines of an entity."""
    dxf, to_world = entity.dxf, entity.ocs().to_wcs
    if kind == "LINE":
        yield [dxf.start, dxf.end], 0.0, (), ()
    elif kind in ("ARC", "CIRCLE"):
        first, last = (dxf.start_angle, dxf.end_angle) if kind == "ARC" else (0.0, 360.0)
        x, y = (
            abs(dxf.radius) * math.cos(math.radians(first)),
            abs(dxf.radius) * math.sin(math.radians(first)),
        )
        axes = [to_world((x, y, 0)), to_world((-y, x, 0))]
        yield [to_world(dxf.center) + axes[0], *axes], math.radians((last - first) % 360.0 or 360.0), (), ()
    elif kind == "ELLIPSE":
        x, y, major, minor = (
            math.cos(dxf.start_param),
            math.sin(dxf.start_param),
            dxf.major_axis,
            entity.minor_axis,
        )
        axes = [major * x + minor * y, minor * x - major * y]
        yield [dxf.center + axes[0], *axes], (dxf.end_param - dxf.start_param) % math.tau or math.tau, (), ()
    elif kind == "SPLINE":
        # from points to pass through alone, ezdxf makes the spline that CAD programs make
        spline = entity.construction_tool()
        yield spline.control_points, 0.0, spline.knots(), spline.weights() or np.ones(spline.count)
    else:
        # bit 16 marks the control points of a polyline that was made a spline, beside the vertices on it
        vertices = (
            [(np.array(corner[:2]), corner[-1]) for corner in entity]
            if kind == "LWPOLYLINE"
            else [
                (np.array(vertex.dxf.location.xyz), vertex.dxf.get("bulge", 0.0))
                for vertex in entity.vertices
                if not vertex.dxf.flags & 16
            ]
        )
        following = vertices[1:] + vertices[: entity.is_closed]
        for (start, bulge), (end, _) in zip(vertices, following, strict=False):
            yield (
                _bulged(to_world, start, end, bulge)
                if bulge
                else ([to_world(start), to_world(end)], 0.0, (), ())
            )


def _bulged(to_world: Any, start: Array, end: Array, bulge: float) -> _Piece:
    """Give the arc of a polyline: the bulge is the tangent of a quarter of its angle."""
    across = np.array([start[1] - end[1], end[0] - start[0]])
    radius = (start - end)[:2] / 2.0 - across * (1.0 - bulge * bulge) / (4.0 * bulge)
    axes = [to_world((*radius, 0.0)), to_world((-radius[1], radius[0], 0.0))]
    return [to_world(start), *axes], 4.0 * math.atan(bulge), (), ()


def _in_plane(
    entity: Any, layer: str, matrix: Array, vectors: Any, sweep: float, knots: Any, weights: Any
) -> Curve:
    """Map a line by the blocks around it and look at it from above; what is tilted is refused."""
    moved = np.array([tuple(each) for each in vectors]) @ matrix[:3, :3]
    moved[: 1 if sweep else None] += matrix[3, :3]
    along = moved[1:] - (0.0 if sweep else moved[0])
    # a flat part leaves its plane by the rounding of a file of six digits at most
    require(
        np.abs(along[:, 2]).max() <= 1e-6 * np.abs(along).max(),
        f"the {entity.dxftype()} at ({', '.join(f'{x:.6g}' for x in moved[0])}) on layer {layer!r}",
        "tilted", "a line in a plane z = const", "draw the part flat",
    )  # fmt: skip
    upright = entity.ocs().to_wcs((0, 0, entity.dxf.thickness if entity.dxf.hasattr("thickness") else 0.0))
    thickness = abs(float(np.array(upright.xyz) @ matrix[:3, 2]))
    return Curve(moved[:, :2], layer, thickness, sweep, np.array(knots, float), np.array(weights, float))
