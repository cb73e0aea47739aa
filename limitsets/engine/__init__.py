"""The same throw in a rigid-body engine kept by others (pymunk, on Chipmunk2D), to compare the throw map with.

Nothing of the map is used: shape, mass, gravity and the rotation at release go into the engine, and where the part
comes to rest is read off its body.  This room is the only one that imports pymunk, an extra of its own:
``pip install 'limitsets[engine]'``.
"""

from limitsets.engine.comparing import Comparison, compare
from limitsets.engine.throwing import Landing, throw

__all__ = ["Comparison", "Landing", "compare", "throw"]
