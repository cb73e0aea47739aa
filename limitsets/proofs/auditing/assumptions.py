"""The table of assumptions: the deciding number of each, its limit, and the fact of the world that it needs.

A further assumption needs a column in `feeder/thrower/assumed_box.py` and a row here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from limitsets.base.arrays import Array
from limitsets.feeder.thrower.assumed_box import Assumed, corner_bounds

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene
    from limitsets.proofs.prover.parameters import ParameterBox


# A shift of the landing by the stroke or by scatter counts from this share of the arm's length.
NOTABLE = 1e-3


@dataclass(frozen=True)
class Terms:
    """What a scene's facts make of an assumption.

    Attributes
    ----------
    limit : float, ndarray of shape (sides,), or None
        What the value may be, on all sides or on each; None where a fact is missing.
    scale, offset : float
        The value is scale times the column plus offset; both are not negative.
    missing : str
        The fact that is missing, empty if none.
    matters : callable
        From the worst value to the value of the missing fact at which the assumption breaks; None where none breaks it.
    """

    limit: float | Array | None
    scale: float = 1.0
    offset: float = 0.0
    missing: str = ""
    matters: Callable[[float], float | None] = field(default=lambda worst: worst)


@dataclass(frozen=True)
class Assumption:
    """A row of the table.

    Attributes
    ----------
    effect : str
        The effect that lifts it, or "release" and "arm", which no effect does.
    what : str
        Name of the assumption among those that the effect lifts.
    name : str
        The assumption in three or four words.
    words : str
        The assumption, in the words of someone who builds a feeder.
    value : str
        What is measured.
    column : Assumed
        What decides.
    terms : callable
        From the scene and its box of parameters to `Terms`; without a box, as floats have it.
    dimension : str
        Of what is measured: "length", "angle" or "".
    below : bool
        Whether it holds below the limit, or above it.
    """

    effect: str
    what: str
    name: str
    words: str
    value: str
    column: Assumed
    terms: Callable[[Scene, ParameterBox | None], Terms]
    dimension: str = ""
    below: bool = True


def _positive(scene: Scene, _: ParameterBox | None) -> Terms:
    return Terms(0.0)


def _corner(scene: Scene, box: ParameterBox | None) -> Terms:
    corners = scene.sides.corner
    if box is None:
        return Terms(corners)
    known = [corner_bounds(*box.bare, side, float(corner)) for side, corner in enumerate(corners)]
    return Terms(np.array([below for below, _ in known]))


def _friction(scene: Scene, _: ParameterBox | None) -> Terms:
    friction = scene.world.friction
    return Terms(None, missing="friction") if friction is None else Terms(friction)


def _bounce(scene: Scene, _: ParameterBox | None) -> Terms:
    """Compare the height of the bounce, e^2 times that of the fall, with the threshold."""
    e, threshold = scene.world.restitution, scene.world.bounce_threshold
    if e == 0.0:
        return Terms(math.inf, scale=0.0)
    if e is None and threshold is None:
        return Terms(None, missing="restitution", matters=lambda fall: None)
    if e is None:
        height = threshold or 0.0

        def restitution(fall: float) -> float | None:
            return math.sqrt(height / fall) if height < fall else None

        return Terms(None, missing="restitution", matters=restitution)
    if threshold is None:
        return Terms(None, scale=e * e, missing="bounce_threshold")
    return Terms(threshold, scale=e * e)


def _drive(scene: Scene, _: ParameterBox | None) -> Terms:
    """To first order in the stroke the landing moves by (kappa/2) sin(stroke) phi^2."""
    notable, stroke = NOTABLE * scene.arm_length, scene.world.stroke
    if stroke is None:

        def least(shift: float) -> float | None:
            return math.asin(notable / shift) if notable < shift else None

        return Terms(None, missing="stroke", matters=least)
    return Terms(notable, scale=math.sin(stroke))


def _spread(scene: Scene, _: ParameterBox | None) -> Terms:
    notable, scatter = NOTABLE * scene.arm_length, scene.world.scatter
    if scatter is None:
        return Terms(None, missing="scatter", matters=lambda shift: notable / shift if shift > 0 else None)
    share, landing = scatter.speed, scatter.landing
    speed = None if scene.gravity is None else math.sqrt(scene.gravity / scene.kappa)
    if share is not None and not share.relative and speed is None:
        return Terms(None, missing="gravity", matters=lambda shift: None)
    return Terms(
        notable,
        scale=0.0 if share is None else share.of(speed or 1.0) / (speed or 1.0),
        offset=0.0 if landing is None else landing.value,
    )


ASSUMPTIONS = (
    Assumption(
        "release",
        "tipping",
        "throw does not tip it",
        words="the throw itself does not tip the part over an end of its side",
        value="room between the throw's impulse and the side's end",
        column=Assumed.UNDER,
        terms=_positive,
        dimension="length",
        below=False,
    ),
    Assumption(
        "release",
        "friction",
        "no sliding in the throw",
        words="the part does not slide on the arm while it is thrown",
        value="friction the throw needs",
        column=Assumed.RELEASE_FRICTION,
        terms=_friction,
    ),
    Assumption(
        "landing",
        "angle",
        "left corner lands first",
        words="the left corner lands first",
        value="turned in the air",
        column=Assumed.ANGLE,
        terms=_corner,
        dimension="angle",
    ),
    Assumption(
        "slip",
        "press",
        "landing presses",
        words="the corner that lands is pressed onto the arm, and need not be held back",
        value="impulse at the landing, in that of the throw",
        column=Assumed.PRESS,
        terms=_positive,
        below=False,
    ),
    Assumption(
        "slip",
        "friction",
        "landing does not slide",
        words="the corner that lands sticks",
        value="friction the landing needs",
        column=Assumed.STICK_FRICTION,
        terms=_friction,
    ),
    Assumption(
        "bounce",
        "height",
        "no bounce",
        words="the corner that lands does not bounce",
        value="height of the bounce",
        column=Assumed.DROP,
        terms=_bounce,
        dimension="length",
    ),
    Assumption(
        "pivot",
        "press",
        "corner stays down",
        words="the corner stays on the arm by itself while the part turns about it",
        value="least force of the arm on the corner, in weights of the part",
        column=Assumed.FORCE,
        terms=_positive,
        below=False,
    ),
    Assumption(
        "pivot",
        "friction",
        "corner does not slide",
        words="the corner does not slide while the part turns about it",
        value="friction the turning needs",
        column=Assumed.HOLD_FRICTION,
        terms=_friction,
    ),
    Assumption(
        "roll",
        "energy",
        "lies still, no roll",
        words="the part lies still once a side has come down",
        value="energy left, in that needed to roll on or back",
        column=Assumed.ROLL,
        terms=lambda *_: Terms(1.0),
    ),
    Assumption(
        "drive",
        "stroke",
        "throw needs no stroke",
        words="the arm has its speed at once, without a stroke",
        value="shift of the landing by the stroke",
        column=Assumed.STROKE,
        terms=_drive,
        dimension="length",
    ),
    Assumption(
        "spread",
        "scatter",
        "throws all alike",
        words="every throw and landing is like the other",
        value="shift of the landing by scatter",
        column=Assumed.SPEED,
        terms=_spread,
        dimension="length",
    ),
    Assumption(
        "arm",
        "reach",
        "rests on the arm",
        words="the part comes to rest on the arm",
        value="room to the arm's end or the joint",
        column=Assumed.ON_ARM,
        terms=_positive,
        dimension="length",
        below=False,
    ),
)
"""In the order in which a throw meets them."""
