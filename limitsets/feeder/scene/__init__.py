"""Scenes: a part, an arm, a throw and a goal, in words and units.

A scene is a TOML file; its quantities are text with units.  Reading goes in four steps, one file each: `reading` (bytes
to a structure), `validation` and `schema` (the words), `build` (units, shape, contradictions), and the frozen `Scene`
that later rooms read.  Every refusal is one `limitsets.errors.SceneError` with file, key, value, what is allowed and
what to do.  Lengths stay in the scene's own unit, that of the arm's length.
"""

from limitsets.feeder.scene.facts import Deviation, Effects, Scatter, World
from limitsets.feeder.scene.quantities import NAMES, deviation
from limitsets.feeder.scene.reading import dump, load, load_to_analyse, scenes
from limitsets.feeder.scene.scene import Scene
from limitsets.feeder.scene.surroundings import Cavity, Tray

__all__ = [
    "NAMES",
    "Cavity",
    "Deviation",
    "Effects",
    "Scatter",
    "Scene",
    "Tray",
    "World",
    "deviation",
    "dump",
    "load",
    "load_to_analyse",
    "scenes",
]
