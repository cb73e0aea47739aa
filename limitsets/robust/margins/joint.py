"""The joint margin: the factor on a whole vector of tolerances, up to which goals are proved.

Every quantity is fixed but unknown, except the landing place, which differs at every throw.  The worst corners, each
a single scene, bracket the factor from above, the proof of the whole box from below.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from fractions import Fraction

from limitsets.goals import Goal
from limitsets.proofs.query import Outcome, Query
from limitsets.robust.margins.brackets import Bracket, Ray, Tell
from limitsets.robust.margins.halving import a_little_beyond, halved
from limitsets.robust.margins.margin_result import Margin
from limitsets.robust.margins.sensitivity import Sensitivity, sensitivity_of
from limitsets.robust.margins.subdivision import Subdivision
from limitsets.robust.margins.vector import Tolerance
from limitsets.scene import Scene

# Seconds after which the proof of the box ends with what it has.
SECONDS = 150.0

# Parts of the bracket's lower end that are proved in turn.
STAGES = tuple(Fraction(n, 32) for n in (1, 2, 4, 8, 16, 24, 32))

# Corners whose factor is bracketed, the worst first; factors between which it is sought.
CORNERS, SMALL, LEAST, MOST = 4, Fraction(1, 16), Fraction(1, 10**6), Fraction(10**6)


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
    query = Query.of(scene, goals)
    texts = dict(scene.text.get("tolerance", {}) if tolerance is None else tolerance)
    vector, share = Tolerance.of(query.scene, texts), Fraction(repr(width))
    sensitivity = sensitivity_of(query, vector)
    at_corners = _at_corners(query, vector, sensitivity, share / 8)
    bad, reason, target = at_corners.refuted, at_corners.reason, at_corners.proved
    target = rounded(target if bad is None else min(target, bad * (1 - share * Fraction(9, 10))))
    tell(0.05)
    proved, pieces, noise = Fraction(0), list[Outcome](), dict[str, str]()
    end = time.perf_counter() + seconds
    for stage in STAGES if target > 0 else ():
        # the smaller box first: what is proved of it stands, whatever becomes of the larger one
        cutting = Subdivision(query, vector, rounded(target * stage), sensitivity)
        left = end - time.perf_counter()
        part, why = cutting.run(left if stage == STAGES[-1] else left / 2, tell)
        part, missing = cutting.joined(part)
        reason = missing or why or reason
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
        query.scene,
        dict(texts),
        vector.texts(proved) if proved else {},
        noise if proved else {},
        tuple(pieces),
        at_corners.against,
    )


def _at_corners(query: Query, tolerance: Tolerance, sensitivity: Sensitivity, width: Fraction) -> Bracket:
    """Bracket the factor at the worst corners, as single scenes."""
    count, found, proved = len(tolerance.scales), Bracket(), list[Fraction]()
    for signs in (sensitivity.corners() or [(1,) * count, (-1,) * count])[:CORNERS]:
        own = _at_one(Ray(query, tolerance, signs), width, found.refuted)
        proved.append(own.proved)
        if own.refuted is not None and (found.refuted is None or own.refuted < found.refuted):
            found.refuted, found.against = own.refuted, own.against
        found.reason = found.reason or own.reason
    found.proved = min(proved)
    return found


def _at_one(ray: Ray, width: Fraction, known: Fraction | None) -> Bracket:
    """Bracket the factor at one corner, where it is below one that is known."""
    factor, found = known or SMALL, ray.found
    while ray.proves(factor):
        if known is not None or factor > MOST:
            return found
        factor *= 2
    _, top = halved(found.proved, factor, ray.proves, width, LEAST, rounded)
    beyond = (rounded(each) for each in a_little_beyond(top, Fraction(1, 400), 10))
    bad = next((each for each in beyond if ray.refutes(each)), None)
    if bad is not None:
        # what is not proved need not fail: it may hold for fewer starts than all
        halved(top, bad, lambda middle: not ray.refutes(middle), width, rounded=rounded)
    return found


def rounded(value: Fraction) -> Fraction:
    """Five digits: a factor that people can read, and whose multiples are short decimals."""
    return Fraction(f"{float(value):.5g}")
