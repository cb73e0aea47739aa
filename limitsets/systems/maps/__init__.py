"""Discrete-time maps on (x, side): their contract, orbits, critical points, and textbook maps with answers on paper.

The throw map (`limitsets.thrower`) is one such map; a user's own map becomes another by `register`.
"""

from limitsets.systems.maps.codes import (
    FLIP,
    INWARD,
    JOG,
    OUTSIDE,
    OUTSIDE_MODEL,
    OUTWARD,
    ROLL,
    UNDECIDED,
    UNDEFINED,
)
from limitsets.systems.maps.contract import MapKind, coerce, has_slope, kind_of, register
from limitsets.systems.maps.critical import CriticalPoint, critical_points
from limitsets.systems.maps.drivers import (
    Images,
    Orbit,
    advance,
    images,
    images_on,
    orbit,
)
from limitsets.systems.maps.growth import Lyapunov, lyapunov
from limitsets.systems.maps.pieces import Piece, TurningPoint, along, monotone_pieces, turning_points
from limitsets.systems.maps.textbook.circle import Circle as Circle
from limitsets.systems.maps.textbook.cubic import Cubic as Cubic
from limitsets.systems.maps.textbook.doubling import Doubling as Doubling
from limitsets.systems.maps.textbook.henon import Henon as Henon
from limitsets.systems.maps.textbook.leslie import Leslie as Leslie
from limitsets.systems.maps.textbook.logistic import Logistic as Logistic
from limitsets.systems.maps.textbook.rotation import Rotation as Rotation
from limitsets.systems.maps.textbook.shared import domain_of

# One line for each textbook map; `as` makes the name public.

__all__ = [
    "FLIP",
    "INWARD",
    "JOG",
    "OUTSIDE",
    "OUTSIDE_MODEL",
    "OUTWARD",
    "ROLL",
    "UNDECIDED",
    "UNDEFINED",
    "CriticalPoint",
    "Images",
    "Lyapunov",
    "MapKind",
    "Orbit",
    "Piece",
    "TurningPoint",
    "advance",
    "along",
    "coerce",
    "critical_points",
    "domain_of",
    "has_slope",
    "images",
    "images_on",
    "kind_of",
    "lyapunov",
    "monotone_pieces",
    "orbit",
    "register",
    "turning_points",
]
