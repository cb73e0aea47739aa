"""The same throw in an independent rigid-body engine (pymunk, on Chipmunk2D), for comparison with the throw map.

The engine uses no formula of the map: its inputs are shape, mass, gravity and the rotation at release, its output is
the place of rest of the body.  This room is the only one that imports pymunk, an optional dependency:
``pip install 'limitsets[engine]'``.
"""

from limitsets.engine.comparing import Comparison, compare
from limitsets.engine.throwing import EngineThrow, throw

__all__ = ["Comparison", "EngineThrow", "compare", "throw"]
