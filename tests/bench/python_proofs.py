"""Rigorous images of cells as one would write them with somebody else's intervals in Python: Arb balls, or codac.

Run as a process of its own for codac, whose import leaves the processor rounding upward:
``python python_proofs.py codac CELLS`` prints seconds per cell.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

# paper-designed, side 2, to the digits of the scene; enough for timing.
KAPPA, H, A, D, RHO2 = 25.3778518, -0.2, 4.2255778, 0.708249, 1.5625


def image(
    number: Any, hull: Any, sin: Any, cos: Any, sqrt: Any, lo: float, hi: float, first: float, last: float
) -> Any:
    """Enclose one jog of [lo, hi]: bracket of the impact verified at both ends, decision, image of the ends."""

    def height(x: float, phi: float) -> Any:
        p = number(phi)
        return number(x) * p - A * sin(p) + D * (1 - cos(p)) - KAPPA / 2 * p * p

    ends = []
    for x, phi in ((lo, first), (hi, last)):
        low, high = phi * (1 - 2.0**-34), phi * (1 + 2.0**-34)
        ends.append((low, high, height(x, low), height(x, high)))
    phi, x = hull(ends[0][0], ends[1][1]), hull(lo, hi)
    s, c = sin(phi), cos(phi)
    right, above = A * c - D * s, A * s + D * c
    inertia = RHO2 + A * A + D * D
    omega = (RHO2 + right * (x - KAPPA * phi) + above * (H + D)) / inertia
    kinetic = inertia * omega * omega / 2
    margin = kinetic - KAPPA * (sqrt(number(A * A + D * D)) - above)
    images = []
    for x_end, end in ((lo, ends[0]), (hi, ends[1])):
        p = hull(end[0], end[1])
        images.append(number(x_end) - H * p + A * (1 - cos(p)) - D * (p - sin(p)))
    return margin, images, ends


def cells(count: int) -> list[tuple[float, float, float, float]]:
    """Cells of the limit set that jog, with the impact angles at their ends (Newton, in floats)."""
    edges = np.linspace(9.0, 19.0, count + 1)
    phi = 2 * (edges - A) / (KAPPA - D)
    for _ in range(12):
        f = edges * phi - A * np.sin(phi) + D * (1 - np.cos(phi)) - KAPPA / 2 * phi**2
        phi -= f / (edges - A * np.cos(phi) + D * np.sin(phi) - KAPPA * phi)
    return list(
        zip(edges[:-1].tolist(), edges[1:].tolist(), phi[:-1].tolist(), phi[1:].tolist(), strict=True)
    )


def with_arb(work: list[tuple[float, float, float, float]]) -> None:
    """All images with python-flint."""
    import flint

    arb = flint.arb

    def hull(a: float, b: float) -> Any:
        return arb((a + b) / 2, (b - a) / 2 * (1 + 2.0**-40))

    for cell in work:
        image(arb, hull, arb.sin, arb.cos, arb.sqrt, *cell)


def with_codac(work: list[tuple[float, float, float, float]]) -> None:
    """All images with codac."""
    import codac

    interval = codac.Interval
    for cell in work:
        image(interval, interval, codac.sin, codac.cos, codac.sqrt, *cell)


if __name__ == "__main__":
    job = cells(int(sys.argv[2]))
    run = {"codac": with_codac, "arb": with_arb}[sys.argv[1]]
    run(job[:10])
    begin = time.perf_counter()
    run(job)
    print((time.perf_counter() - begin) / len(job))
