"""Routh's law of impact with friction, by integration of its differential equations: an oracle for the kernels.

Written apart from them, in rates and masses and without a formula for where a path turns.  The normal impulse is the
time; friction pulls mu as hard against the sliding, by Coulomb's law:

    d(rates)/dJ = gain @ (friction, 1),        friction = -mu sign(v_t),        v = lever @ rates.

`routh` starts again where v_t comes to 0, in the one of three modes (held, off to the right, off to the left) that
agrees with itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

# Longer than any path: what does not end by an event on the way is no path.
ENDLESS = 1e12


def routh(
    gain: np.ndarray, lever: np.ndarray, rates: np.ndarray, mu: float, until: float | None = None
) -> tuple[np.ndarray, float]:
    """Rates after the normal impulse `until`, or when the approach ends, and the normal impulse."""
    spent, rates = 0.0, np.array(rates, dtype=float)
    if until == 0.0 or (until is None and (lever @ rates)[1] >= 0.0):
        return rates, spent
    way = float(np.sign((lever @ rates)[0]))
    for _ in range(3):
        drag = -mu * way if way != 0.0 else _held(gain, lever, mu)
        if drag is None:
            # of the two ways to slide off, the one in which it does slide that way
            (way,) = (w for w in (1.0, -1.0) if w * (lever @ gain @ (-mu * w, 1.0))[0] > 0.0)
            drag = -mu * way
        left = ENDLESS if until is None else until - spent
        rates, pushed, stopped = _leg(gain @ (drag, 1.0), lever, rates, way, left, until is None)
        spent += pushed
        if not stopped:
            assert spent < ENDLESS
            return rates, spent
        way = 0.0
    raise AssertionError("a path turns once")


def _held(gain: np.ndarray, lever: np.ndarray, mu: float) -> float | None:
    """Friction per normal impulse that keeps a contact at rest along the arm; None where there is not so much."""
    alone, pulled = (lever @ gain @ (drag, 1.0) for drag in (0.0, 1.0))
    drag = alone[0] / (alone[0] - pulled[0]) if alone[0] != 0.0 else 0.0
    return float(drag) if abs(drag) <= mu else None


def _leg(
    slope: np.ndarray, lever: np.ndarray, rates: np.ndarray, way: float, left: float, approaches: bool
) -> tuple[np.ndarray, float, bool]:
    """Rates at the end of one leg, its normal impulse, and whether it ended because the sliding stopped."""

    def sliding(_: float, now: np.ndarray) -> float:
        return float(way * (lever @ now)[0])

    def approach(_: float, now: np.ndarray) -> float:
        return float(-(lever @ now)[1])

    events: list[Any] = []
    if way != 0.0:
        events.append(sliding)
    if approaches:
        events.append(approach)
    for event in events:
        event.terminal, event.direction = True, -1.0
    run = solve_ivp(
        lambda _, __: slope,
        (0.0, left),
        rates,
        method="DOP853",
        rtol=1e-13,
        atol=1e-15,
        events=events or None,
    )
    stopped = way != 0.0 and len(run.t_events[0]) > 0
    return run.y[:, -1], float(run.t[-1]), stopped
