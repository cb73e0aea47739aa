"""Scenes: a part, an arm, a throw and a goal, in words and units.

A scene is a TOML file; its quantities are text with units.  Reading goes in four steps, one file each: `reading` (bytes
to a structure), `validation` and `schema` (the words), `build` (units, shape, contradictions), and the frozen `Scene`
that later rooms read.  Every refusal is one `limitsets.errors.SceneError` with file, key, value, what is allowed and
what to do.  Lengths stay in the scene's own unit, that of the arm's length.
"""

from limitsets.feeder.scene.arrays import ThrowStack, repeated, throw_stack
from limitsets.feeder.scene.checking import doubts, examined
from limitsets.feeder.scene.facts import NOT_TIPPING, TIPPING, Deviation, Effects, Scatter, World
from limitsets.feeder.scene.laid import LaidLike, laid_goal, laid_goals, read_laid
from limitsets.feeder.scene.left_out import WITHOUT_SCATTER, Model
from limitsets.feeder.scene.numbers import Numbers
from limitsets.feeder.scene.quantities import NAMES, deviation
from limitsets.feeder.scene.reading import Sketch, dump, load, load_to_analyse, scenes, sketch
from limitsets.feeder.scene.scene import Scene, in_unit_of, in_units_of, require_rests, unit_of
from limitsets.feeder.scene.starting import new_scene
from limitsets.feeder.scene.surroundings import (
    BeyondSensor,
    Cavity,
    Sensor,
    SideSensor,
    Tray,
    exact_text,
    heights_over_sides,
)

__all__ = [
    "NAMES",
    "NOT_TIPPING",
    "TIPPING",
    "WITHOUT_SCATTER",
    "BeyondSensor",
    "Cavity",
    "Deviation",
    "Effects",
    "LaidLike",
    "Model",
    "Numbers",
    "Scatter",
    "Scene",
    "Sensor",
    "SideSensor",
    "Sketch",
    "ThrowStack",
    "Tray",
    "World",
    "deviation",
    "doubts",
    "dump",
    "exact_text",
    "examined",
    "heights_over_sides",
    "in_unit_of",
    "in_units_of",
    "laid_goal",
    "laid_goals",
    "load",
    "load_to_analyse",
    "new_scene",
    "read_laid",
    "repeated",
    "require_rests",
    "scenes",
    "sketch",
    "throw_stack",
    "unit_of",
]
