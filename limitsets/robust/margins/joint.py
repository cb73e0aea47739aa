"""The joint margin: the factor on a whole vector of tolerances, up to which goals are proved.

Every quantity is fixed but unknown, but for the landing place, which differs at every throw.  The worst corners bracket
the factor from above, the proof of the whole box from below.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from fractions import Fraction

from limitsets.goals import Goal
from limitsets.robust.margins.asking import Asked
from limitsets.robust.margins.corners import at_corners, rounded
from limitsets.robust.margins.cutting import Cutting, Tell
from limitsets.robust.margins.effect import Effects, effects_of
from limitsets.robust.margins.finding import Margin, asked_of
from limitsets.robust.margins.vector import Tolerance
from limitsets.scene import Scene

__all__ = ["joint_margin"]

# Seconds after which the proof of the box ends with what it has.
SECONDS = 150.0

# Parts of the bracket's lower end that are proved in turn.
STAGES = tuple(Fraction(n, 32) for n in (1, 2, 4, 8, 16, 24, 32))


def joint_margin(
    scene: Scene,
    goals: tuple[Goal, ...],
    tolerance: Mapping[str, str] | None = None,
    *,
    width: float = 0.01,
    seconds: float = SECONDS,
    tell: Tell = lambda _: None,
) -> Margin:
    """Bracket the factor on a tolerance up to which goals hold.

    Parameters
    ----------
    scene : Scene
        The scene.
    goals : tuple of Goal
        What has to hold, all of it.
    tolerance : mapping of str to str, optional
        Deviations by quantity, ``{"throw.speed": "1 %", "landing.x": "0.01 in"}``; default the scene's.  landing.x is
        noise at every throw, all else fixed but unknown.
    width : float
        How close the two ends have to be, as a share of the upper one.
    seconds : float
        Time for the proof of the box; what is proved by then counts.
    tell : callable
        Called with the share that is done.

    Returns
    -------
    Margin
        Its `quantity` is "joint", `proved` and `refuted` are factors.
    """
    begin = time.perf_counter()
    question = asked_of(scene, goals)
    texts = dict(scene.text.get("tolerance", {}) if tolerance is None else tolerance)
    vector = Tolerance.of(question.scene, texts)
    share = Fraction(repr(width))
    effects = effects_of(question, vector.measures, _sizes(vector)) if vector.measures else Effects.none(0)
    good, bad, against, reason = at_corners(question, vector, effects, share / 8)
    target = rounded(min(good, bad * (1 - share * Fraction(9, 10))) if bad is not None else good)
    tell(0.05)
    proved, pieces, noise = Fraction(0), list[Asked](), dict[str, str]()
    end = time.perf_counter() + seconds
    for stage in STAGES if target > 0 else ():
        # the smaller box first: what is proved of it stands, whatever becomes of the larger one
        cutting = Cutting(question, vector, rounded(target * stage), effects)
        left = end - time.perf_counter()
        part, why = cutting.run(left if stage == STAGES[-1] else left / 2, tell)
        reason = why or reason
        if part * cutting.factor <= proved:
            break
        proved, noise = part * cutting.factor, cutting.noise
        pieces = cutting.within(part)
        if part < 1:
            break
    closed = bad is not None and bad - proved <= share * bad
    reason = reason or "no orbit is found that violates it nearer to what is proved"
    return Margin(
        "joint",
        "tolerance",
        goals,
        float(proved),
        None if bad is None else float(bad),
        "",
        None,
        "" if closed else reason,
        closed,
        time.perf_counter() - begin,
        question.scene,
        dict(texts),
        vector.texts(proved) if proved else {},
        noise if proved else {},
        tuple(pieces),
        against,
    )


def _sizes(vector: Tolerance) -> dict[str, Fraction]:
    return {one.quantity: size for one, size in zip(vector.measures, vector.sizes, strict=True)}
