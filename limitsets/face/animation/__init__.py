"""Films: throws of a scene, feeding, feedback, orbits that refute, and recordings of the rigid-body engine.

A film is data first (`film.py`): poses of the parts and the arm, frame by frame, with captions, from the formulas of
the map and its own angles and places.  Writers (`writers.py`) draw it.  A kind of film is a file with
a function, and a line in the table of `animating.py`; so is a kind of file.
"""

from limitsets.face.animation.animating import animate, film_of, require_file
from limitsets.face.animation.film import Film

__all__ = ["Film", "animate", "film_of", "require_file"]
