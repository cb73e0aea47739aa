"""Periodic orbits that refute a goal: those that never do what is asked.

With noise they are orbits of throws all of which are as the scene says, which is one of the sequences allowed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from limitsets.proofs.asked.search import State
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.orbits import PERIODS, ProvedCycle, proved_cycles
from limitsets.proofs.parameters import parameter_box
from limitsets.scene import Scene

__all__ = ["cycle_that"]


def cycle_that(
    found: Attraction, scene: Scene, refutes: Callable[[ProvedCycle], bool], longest: int = PERIODS[0]
) -> tuple[State, ...]:
    """Find a periodic orbit in the attracting cells that refutes a goal, and prove it; empty if none is found.

    Parameters
    ----------
    found : Attraction
        Cells and images.
    scene : Scene
        The scene.
    refutes : callable
        From a proved orbit to whether it is such a one.
    longest : int
        Largest period searched.

    Returns
    -------
    tuple of State
        The orbit, its first point again at the end.
    """
    if found.cover.box.effects:
        return ()
    box = parameter_box(scene, tree=found.cover.box.scene)
    quiet = replace(found, cover=replace(found.cover, box=box))
    scattered = found.cover.box.landing > 0.0
    kappa, landing = box.middle_kappa, 0.0 if scattered else None
    for cycle in proved_cycles(quiet, longest).cycles:
        if refutes(cycle):
            points = zip(cycle.lo.tolist(), cycle.hi.tolist(), cycle.side.tolist(), strict=True)
            states = [State(lo, hi, side, kappa, landing) for lo, hi, side in points]
            first = states[0]
            return (*states, State(first.lo, first.hi, first.side, None))
    return ()
