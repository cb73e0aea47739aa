"""A flight in the engine, exact for every step size, until a vertex meets the arm."""

from __future__ import annotations

from limitsets.engine.stage import Stage

# Between steps of this size [rad] a vertex must not touch and rise again.
FLIGHT_STEP = 2.0**-7
# Shorter flights than this [rad] are lost in the rounding of heights.
SHORTEST = 1e-9


def fly(stage: Stage, patience: float) -> float:
    """Fly until the part's lowest point is on the arm; the time, 0 where it never leaves the arm."""
    from scipy.optimize import brentq

    before, length = stage.state(), FLIGHT_STEP
    stage.drift(length)
    while stage.gap() <= 0.0:  # a short flight: first find a moment in the air
        length *= 0.5
        if length < SHORTEST:
            return 0.0
        stage.restore(before)
        stage.drift(length)
    flown = length
    before = stage.state()
    stage.drift(FLIGHT_STEP)
    while stage.gap() > 0.0:
        flown += FLIGHT_STEP
        if flown > patience:
            return flown
        before = stage.state()
        stage.drift(FLIGHT_STEP)

    def gap_after(time: float) -> float:
        stage.restore(before)
        stage.drift(time)  # the engine takes a step of 0 as none
        return stage.gap()

    time = float(brentq(gap_after, 0.0, FLIGHT_STEP, xtol=1e-14))
    gap_after(time)
    return flown + time
