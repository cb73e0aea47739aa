"""Discrete-time maps on (x, side): the contract, the drivers, and textbook maps with answers on paper.

The throw map (`limitsets.thrower`) is one such map; a user's own map becomes another by `register`.
"""

from limitsets.maps.codes import (
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
from limitsets.maps.contract import MapKind, coerce, has_slope, kind_of, register
from limitsets.maps.critical import CriticalPoint, critical_points
from limitsets.maps.drivers import Images, Orbit, advance, images, images_on, orbit
from limitsets.maps.forced import along
from limitsets.maps.lyapunov import Lyapunov, lyapunov
from limitsets.maps.pieces import Piece, TurningPoint, monotone_pieces, turning_points

# One line for each textbook map; `as` makes the name public.
from limitsets.maps.textbook.circle import Circle as Circle
from limitsets.maps.textbook.cubic import Cubic as Cubic
from limitsets.maps.textbook.domains import domain_of
from limitsets.maps.textbook.doubling import Doubling as Doubling
from limitsets.maps.textbook.henon import Henon as Henon
from limitsets.maps.textbook.leslie import Leslie as Leslie
from limitsets.maps.textbook.logistic import Logistic as Logistic
from limitsets.maps.textbook.rotation import Rotation as Rotation

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
