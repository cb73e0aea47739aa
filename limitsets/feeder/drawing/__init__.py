"""Parts from drawings: the outline and the holes of a plate in a DXF or SVG file.

A file is read to lines in the plane (`dxf`, `svg`, `curves`), these are joined to loops, whose vertices become decimals
that say exactly which of them the convex hull has (`loops`).  `plate` does all of it.  The packages that read and
compare (ezdxf, svgelements, shapely) are the extra `drawing`, and imported where they are used.
"""

from limitsets.feeder.drawing.plate import Drawing, read_drawing
from limitsets.feeder.drawing.scene_tables import tables_of

__all__ = ["Drawing", "read_drawing", "tables_of"]
