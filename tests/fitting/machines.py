"""Machines of known truth, thrown by the formulas of physics written out in numpy (`tests.proofs.forge.Plain`)."""

import numpy as np

from limitsets.parameters.fitting import Throws
from tests.proofs.forge import Plain, scene

ALONG, ABOVE = "part.mass.center.along", "part.mass.center.above"
HEIGHT, RADIUS, KAPPA = "arm.surface_height", "part.mass.radius_of_gyration", "throw.kappa"
ARM = 28.0


def described(truth: dict[str, float]) -> dict:
    """The scene of a machine."""
    tree = scene("designed")
    mass = tree["part"]["mass"]
    mass["center"] |= {"along": f"{truth[ALONG]!r} in", "above": f"{truth[ABOVE]!r} in"}
    mass["radius_of_gyration"] = f"{truth[RADIUS]!r} in"
    tree["arm"]["surface_height"] = f"{truth[HEIGHT]!r} in"
    tree["throw"]["kappa"] = f"{truth[KAPPA]!r} in"
    return tree


def machine(draw: np.random.Generator) -> dict[str, float]:
    """A machine near paper-designed: what somebody built who aimed at it."""
    return {
        KAPPA: 25.38 * (1.0 + 0.03 * draw.standard_normal()),
        ALONG: 4.2256 + 0.1 * draw.standard_normal(),
        ABOVE: 0.7082 + 0.05 * draw.standard_normal(),
        HEIGHT: -0.2 + 0.05 * draw.standard_normal(),
        RADIUS: 1.25 + 0.05 * draw.standard_normal(),
    }


def thrown(plain: Plain, x, side, kappa):
    """Where throws end, and on which side."""
    after, flips = np.empty(x.size), np.zeros(x.size, dtype=int)
    for i in range(3):
        own = side == i
        flips[own] = plain.decision(i, x[own], kappa[own]) > 0
        jog, flip = (f(i, x[own], kappa[own]) for f in (plain.jog, plain.flip))
        after[own] = np.where(flips[own] == 1, flip, jog)
    return after, (side + flips) % 3


def film(
    draw,
    truth,
    n=50,
    *,
    error=0.02,
    speed=0.002,
    landing=0.01,
    flipped=0.0,
    known=True,
    corner=False,
    at=None,
) -> Throws:
    """Film single throws from places all over the arm, or from one; a share of the sides after is recorded wrong.

    With `corner` the film shows where the left corner lies, by the true part, not the centre of mass.
    """
    plain = Plain(described(truth))
    side = draw.integers(0, 3, n)
    x = draw.uniform(plain.a[side] + 2.0, ARM - 1.0)
    if at is not None:
        x, side = np.full(n, at[0]), np.full(n, at[1])
    kappa = truth[KAPPA] / (1.0 + speed * draw.standard_normal(n)) ** 2
    after, ends = thrown(plain, x, side, kappa)
    after = after + landing * draw.standard_normal(n)
    if corner:
        x, after = x - plain.a[side], after - plain.a[ends]
    wrong = draw.random(n) < flipped
    return Throws(
        x + error * draw.standard_normal(n),
        side,
        after + error * draw.standard_normal(n),
        np.where(wrong, (ends + draw.integers(1, 3, n)) % 3, ends),
        np.full(n, error if known else np.nan),
        np.zeros(n, dtype=bool),
        np.arange(2, n + 2),
        corner=corner,
    )


def run_film(draw, truth, n=50, *, error=0.02, landing=0.01, twice=False) -> Throws:
    """Film one part throw after throw; a rest is read once for both rows, or twice."""
    plain = Plain(described(truth))
    x, side, rows, starts = 12.0, 2, [], []
    for _ in range(n):
        after, end = thrown(plain, np.array([x]), np.array([side]), np.array([truth[KAPPA]]))
        starts.append((x, side))
        rows.append((float(after[0]) + landing * draw.standard_normal(), int(end[0])))
        x, side = rows[-1]
    before, after = np.array([x for x, _ in starts]), np.array([x for x, _ in rows])
    read_after = after + error * draw.standard_normal(n)
    read_before = before + error * draw.standard_normal(n)
    if not twice:
        read_before[1:] = read_after[:-1]
    follows = np.ones(n, dtype=bool)
    follows[0] = False
    on, to = (np.array([side for _, side in each]) for each in (starts, rows))
    return Throws(read_before, on, read_after, to, np.full(n, np.nan), follows, np.arange(2, n + 2))


def farthest(draw, truth, *, speed=0.0, landing=0.0) -> np.ndarray:
    """Where parts lie farthest out on each side once they have settled; scatter is one bound or the other."""
    plain, n = Plain(described(truth)), 1000
    side = draw.integers(0, 3, n)
    x, out = draw.uniform(plain.a[side] + 2.0, ARM - 1.0), np.zeros(3)
    for count in range(200):
        share = 1.0 + speed * draw.choice([-1.0, 1.0], n)
        x, side = thrown(plain, x, side, truth[KAPPA] / share**2)
        x = x + landing * draw.choice([-1.0, 1.0], n)
        if count >= 100:
            np.maximum.at(out, side, x)
    return out
