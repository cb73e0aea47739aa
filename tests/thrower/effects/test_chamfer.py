"""A part with a side on which it cannot rest, a chamfer: it tips on to the next side, and never rests there.

The float kernel against the integrated rigid body of `simulation.py`, which knows nothing of sides that tip but that
nothing holds a part beside its foot, and against the energies of one throw by hand.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from limitsets.maps.drivers import images
from limitsets.thrower.full import with_effects
from tests.thrower.effects.simulation import Body
from tests.thrower.effects.throws import Case, agree

BOTH = ("landing", "roll")


def chamfered(rng: np.random.Generator) -> Body:
    """A convex part that tips over on one of its sides, or on two, by a clear distance."""
    while True:
        n = int(rng.integers(3, 7))
        angles = np.sort(rng.uniform(0.0, 2 * np.pi, n))
        corners = 2.0 * np.stack([np.cos(angles), rng.uniform(0.4, 1.0) * np.sin(angles)], 1)
        corners -= rng.dirichlet(np.full(n, 2.0)) @ corners
        body = Body(corners, rng.uniform(0.5, 0.9) * float(np.hypot(*corners.T).mean()))
        facts = body.numbers()
        a, d, right = facts["a"], facts["d"], facts["length"] - facts["a"]
        clear = (np.abs(a) > 0.05).all() and (np.abs(right) > 0.05).all() and (d > 0.15).all()
        if clear and ((a < 0) | (right < 0)).any():
            return body


def chamfered_cases(count: int, seed: int) -> list[Case]:
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        body = chamfered(rng)
        facts = body.numbers()
        rests = np.flatnonzero((facts["a"] > 0) & (facts["a"] < facts["length"]))
        side = int(rng.choice(rests))
        kappa = float(np.hypot(facts["a"], facts["d"]).max() * np.exp(rng.uniform(0.1, 2.0)))
        x = float(facts["a"][side] + kappa * 10 ** rng.uniform(-1.5, 0.2))
        world = SimpleNamespace(friction=0.7, restitution=0.4, bounce_threshold=0.01)
        found.append(Case(body, kappa, float(rng.uniform(-1.0, 0.5)), x, side, world))
    return found
