"""Design of the second part: its mass, for the shape of sizes.toml, and the speed that both parts share.

Run it as ``python studies/12_assembly/design.py [--search]``: it prints the design that `paper-quadrilateral` has.  The
start was found by --search, differential evolution over mass and speed for the largest share of starts that are fed
rightly by the map, with no landing on another side beyond 20 in (minutes); `limitsets.design` moves its critical points
to round places.
"""

from __future__ import annotations

import argparse
import math
from typing import Any

import numpy as np

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.cell.feeding.falling import arm_end_of
from limitsets.cell.feeding.trials import run_trials
from limitsets.feeder.scattering import Scattering
from limitsets.systems.maps import images

KAPPA = 22.5
START = (3.98, 0.23, 1.75)  # centre of mass along and above side 1, radius of gyration [in]
TARGETS = [None, 19.2, 16.4, None]  # first critical points of sides 1 and 2 [in]
VARY = ["part.mass.center.along", "part.mass.center.above", "part.mass.radius_of_gyration"]
BOUNDS = [(3.6, 4.03), (0.05, 1.2), (0.4, 2.4), (20.0, 26.0)]


def part_of(name: str, kappa: float, mass: tuple[float, ...] | None = None, *, landing: bool = True) -> Any:
    """Give a part with this throw and mass."""
    tree = ls.load(name).as_dict()
    tree["throw"] = {"kappa": f"{kappa!r} in"}
    if mass is not None:
        along, above, radius = mass
        tree["part"]["mass"] = {
            "center": {"side": 1, "along": f"{along!r} in", "above": f"{above!r} in"},
            "radius_of_gyration": f"{radius!r} in",
        }
    if not landing:
        del tree["effects"]
    return ls.load(tree)


def farthest(scene: Any, side: int, count: int = 200) -> tuple[float, float]:
    """Give the farthest landings, from anywhere before the arm's end, on another side and on this one."""
    wrong = right = -math.inf
    for begin, a in enumerate(scene.sides.a.tolist()):
        found = images(
            scene.map,
            np.linspace(a + 0.02 * (scene.cavity.position - a), scene.cavity.position, count),
            begin,
        )
        inside = found.code >= 0
        wrong = max(wrong, found.x[inside & (found.side != side)].max(initial=-math.inf))
        right = max(right, found.x[inside & (found.side == side)].max(initial=-math.inf))
    return float(wrong), float(right)


def lacking(unknowns: Any, trials: int = 300) -> float:
    """Rate a design: less is better, and below 0 no landing beyond 20 in is on another side."""
    along, above, radius, kappa = (float(value) for value in unknowns)
    try:
        parts = (
            part_of("paper-quadrilateral", kappa, (along, above, radius)),
            part_of("paper-triangle", kappa),
        )
    except LimitsetsError:
        return 9.0
    short = 0.0
    for part in parts:
        wrong, right = farthest(part, part.goal.side)
        short += max(0.0, wrong - 19.85) + max(0.0, 20.3 - right)
    if short > 0.5:
        return 1.0 + short
    made = run_trials(arm_end_of(parts[0]), Scattering(), trials)
    return short - made.counts["right"] / trials


def main(*, search: bool = False) -> dict[str, Any]:
    """Design the part; with what it is like."""
    mass, kappa = START, KAPPA
    if search:
        from scipy.optimize import differential_evolution

        found = differential_evolution(
            lacking, BOUNDS, seed=1, maxiter=40, popsize=14, tol=1e-7, polish=False
        )
        *best, kappa = found.x.tolist()
        return {"found": dict(zip((*VARY, "throw.kappa"), (*best, kappa), strict=True)), "rating": found.fun}
    begin = part_of("paper-quadrilateral", kappa, mass, landing=False)
    made = ls.design(begin, critical_points=TARGETS, vary=VARY)
    values = {name: value[1] for name, value in made.quantities().items()}
    part = part_of("paper-quadrilateral", kappa, tuple(values.values()))
    wrong, right = farthest(part, 1)
    fed = run_trials(arm_end_of(part), Scattering(), 20_000)
    return {
        "values": values,
        "critical points": made.jacobian.x.tolist(),
        "farthest landing on another side": wrong,
        "on side 1": right,
        "triangle, the same": farthest(part_of("paper-triangle", kappa), 2),
        "fates": fed.counts,
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--search", action="store_true")
    for name, value in main(search=parser.parse_args().search).items():
        print(f"{name}: {value}")
