"""A scene of a drawn plate: its part, and an arm and a throw of its size to start from."""

from __future__ import annotations

import math
from typing import Any

from limitsets.base import AnswerError
from limitsets.feeder.drawing.plate import Drawing
from limitsets.feeder.geometry import Hole
from limitsets.feeder.scene import Scene, load
from limitsets.feeder.scene.quantities import STANDARD_GRAVITY
from limitsets.feeder.scene.reading import load_to_analyse
from limitsets.feeder.scene.units import convert, density_dimension, parse, written

# kg/m^3, of what plates are made of: common values, to a few percent.
MATERIALS = {
    "steel": 7850,
    "stainless steel": 7900,
    "aluminium": 2700,
    "brass": 8500,
    "copper": 8960,
    "titanium": 4500,
    "POM": 1410,
    "PMMA": 1190,
    "PC": 1200,
    "ABS": 1050,
    "PE": 950,
    "plywood": 680,
}

# Where nothing is said: it cancels from centre and radius of gyration of a plate without point masses.
ANY_DENSITY = "1 kg/m^2"

# The feeder whose proportions a first scene has, and the tilt of its table.
LIKE, TILT = "paper-designed", "30 deg"


def tables_of(
    drawing: Drawing,
    *,
    material: str | None = None,
    density: str | None = None,
    thickness: str | None = None,
) -> dict[str, Any]:
    """Give the tables of a scene with a drawn plate as its part.

    Arm and throw are those of a built-in feeder, enlarged to the plate's size; there is no goal yet.

    Parameters
    ----------
    drawing : Drawing
        From `read_drawing`.
    material, density : str, optional
        A name of `MATERIALS`, or a mass per volume or per area.
    thickness : str, optional
        Of the plate; by default what the drawing states.

    Returns
    -------
    dict
        Tables for `limitsets.feeder.scene.new_scene`.

    Raises
    ------
    AnswerError
        An unknown material, or material and density.
    SceneError
        A plate that cannot be thrown, or a density that says nothing.
    """
    unit = drawing.unit
    part: dict[str, Any] = {"vertices": _pairs(drawing.outline.tolist(), unit)}
    if drawing.holes:
        part["holes"] = [_table_of(hole, unit) for hole in drawing.holes]
    part["mass"] = _mass(drawing, material, density, thickness)
    tables = {"part": part, **_feeder(drawing), "goal": None, "tolerance": None}
    _, more = load_to_analyse({key: table for key, table in tables.items() if table is not None})
    return tables | ({"effects": dict.fromkeys(more, True)} if more else {})


def _table_of(hole: Hole, unit: str) -> dict[str, Any]:
    if hole.centre is None:
        return {"vertices": _pairs(hole.vertices, unit)}
    x, y = (written(each, unit) for each in hole.centre)
    return {"center": {"x": x, "y": y}, "diameter": written(hole.diameter, unit)}


def _pairs(vertices: Any, unit: str) -> list[list[str]]:
    return [[written(x, unit), written(y, unit)] for x, y in vertices]


def _mass(
    drawing: Drawing, material: str | None, density: str | None, thickness: str | None
) -> dict[str, str]:
    if material is not None:
        if density is not None:
            remedy = "leave one of the two out"
            raise AnswerError(
                "the plate", f"of {material}, and of {density}", "a material or a density", remedy
            )
        if material not in MATERIALS:
            remedy = "name one of them, or give a density"
            raise AnswerError("the material", material, ", ".join(MATERIALS), remedy)
        density = f"{MATERIALS[material]} kg/m^3"
    if thickness is None and drawing.thickness is not None:
        thickness = written(drawing.thickness, drawing.unit)
    if density is None:
        return {"plate_density": ANY_DENSITY}
    per_area = density_dimension(density) == "mass per area"
    return {"plate_density": density} | (
        {} if per_area or thickness is None else {"plate_thickness": thickness}
    )


def _feeder(drawing: Drawing) -> dict[str, Any]:
    """Give an arm and a throw for a part of this size, to two digits."""
    like: Scene = load(LIKE)
    size = max(drawing.extent) / float(like.sides.length.max())
    unit = drawing.unit

    def rounded(value: float) -> float:
        return float(f"{value:.2g}")

    gravity = convert(parse(STANDARD_GRAVITY, "acceleration"), f"{unit}/s^2") * math.sin(math.radians(30.0))
    speed = math.degrees(math.sqrt(gravity / (like.kappa * size)))
    return {
        "arm": {
            "surface_height": written(rounded(like.surface_height * size), unit),
            "length": written(rounded(like.arm_length * size), unit),
        },
        "throw": {"speed": written(rounded(speed), "deg/s")},
        "gravity": {"tilt": TILT},
    }
