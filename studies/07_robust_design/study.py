"""The study of robust design: how large the proved joint margin of a feeder in the paper's triangle can be.

Run it as ``python studies/07_robust_design/study.py [--evaluations N] [--seconds S] [--out FOLDER]``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from itertools import permutations, product
from pathlib import Path
from typing import Any

import numpy as np

import limitsets as ls

HERE = Path(__file__).resolve().parent

# So many times the margin of the scene before was wanted.
WANTED = 5.0
SIDES = (5.75, 3.6, 6.75)
TOLERANCE = {
    **{f"part.sides[{k}]": "1 %" for k in range(3)},
    **dict.fromkeys(("throw.speed", "part.mass.radius_of_gyration"), "1 %"),
    **dict.fromkeys(
        ("part.mass.center.along", "part.mass.center.above", "arm.surface_height", "landing.x"), "0.01 in"
    ),
}


def room(lengths: Any, along: Any, above: Any) -> Any:
    """Give how far inside its sides' feet a centre of mass stands, for arrays of triangles: below 0 the part tips over.

    Plane geometry of its own, for a check of the package by other means: side 2 from the origin along x.
    """
    l0, l1, l2 = lengths
    x = (l0**2 + l2**2 - l1**2) / (2.0 * l2)
    y = np.sqrt(np.maximum(l0**2 - x**2, 0.0))
    corners = [(x, y), (0.0 * x, 0.0 * x), (l2, 0.0 * x)]
    least = np.minimum(np.minimum(l0 + l1 - l2, l0 + l2 - l1), l1 + l2 - l0)
    for begin, end in ((0, 1), (2, 0), (1, 2)):
        (px, py), (qx, qy) = corners[begin], corners[end]
        length = np.hypot(qx - px, qy - py)
        ex, ey = (qx - px) / length, (qy - py) / length
        foot = (along - px) * ex + (above - py) * ey
        least = np.minimum(least, np.minimum(foot, length - foot))
        least = np.minimum(least, ex * (above - py) - ey * (along - px))
    return least


def largest_at_rest(sides: Sequence[float], along: float, above: float) -> float:
    """Give the largest s for which the part rests on every side at all corners: sides 1 %, places 0.01 in, times s."""
    signs = np.array(list(product((-1.0, 1.0), repeat=5))).T
    good, bad = 0.0, 20.0
    for _ in range(30):
        s = 0.5 * (good + bad)
        lengths = [length * (1.0 + 0.01 * s * sign) for length, sign in zip(sides, signs[:3], strict=True)]
        if (room(lengths, along + 0.01 * s * signs[3], above + 0.01 * s * signs[4]) > 0.0).all():
            good = s
        else:
            bad = s
    return good


def bound_of_rest() -> tuple[float, dict[str, float]]:
    """Give the largest s of any centre of mass, and that of each order of the sides."""
    from scipy.optimize import differential_evolution

    found = {}
    for order in permutations(SIDES):
        best = differential_evolution(
            lambda v, order=order: -largest_at_rest(order, *v), [(0.3, 6.5), (0.05, 4.0)], seed=1, tol=1e-6
        )
        found[", ".join(f"{length:g}" for length in order)] = round(float(-best.fun), 3)
    return max(found.values()), found


def main(evaluations: int = 1200, seconds: float = 240.0, out: Path = HERE) -> dict[str, Any]:
    """Answer the study's question, and draw the figure."""
    bound, orders = bound_of_rest()
    found = ls.robust_design("paper-designed", tolerance=TOLERANCE, evaluations=evaluations, prove=seconds)
    before = found.before_sampled
    wanted = None if before is None else WANTED * before.margin
    ls.plot.robust_design(found, wanted=wanted, bound=bound).savefig(out / "front.png", dpi=110)
    answer = found.to_json()
    kept = ("x", "values", "before", "ratio", "lead", "throws", "before_throws", "evaluations", "timings")
    short = {word: answer[word] for word in kept}
    for word in ("margins", "before_margins"):
        short[word] = [{key: one[key] for key in ("proved", "refuted", "reason")} for one in answer[word]]
    for word in ("sampled", "before_sampled"):
        short[word] = answer[word]
    short["bound_of_rest"] = {"largest": bound, "by_order": orders}
    short["front"] = [
        [one["margin"], one["throws"]["mean"], one["throws"]["quantile_95"]] for one in answer["front"]
    ]
    return short


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--evaluations", type=int, default=1200)
    parser.add_argument("--seconds", type=float, default=240.0)
    parser.add_argument("--out", type=Path, default=HERE)
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    print(json.dumps(main(chosen.evaluations, chosen.seconds, chosen.out), indent=1))
