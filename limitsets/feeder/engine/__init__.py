"""The same throw in an independent rigid-body engine (pymunk, on Chipmunk2D), for comparison with the throw map.

The engine uses no formula of the map: its inputs are shape, mass, gravity and the rotation at release, its output is
the place of rest of the body.  `Crowd` throws several parts at once, which push each other and fall into a cavity.

This room is the only one that imports pymunk, an optional dependency: ``pip install 'limitsets[engine]'``.
"""

from limitsets.feeder.engine.crowd import Crowd
from limitsets.feeder.engine.depression import off_seat, seat_of
from limitsets.feeder.engine.member import Recording, Rest
from limitsets.feeder.engine.throwing import Comparison, EngineThrow, compare, throw

__all__ = [
    "Comparison",
    "Crowd",
    "EngineThrow",
    "Recording",
    "Rest",
    "compare",
    "off_seat",
    "seat_of",
    "throw",
]
