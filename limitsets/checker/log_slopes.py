"""What a throw of a noisy chain adds to the Lyapunov exponent: the logarithm of its slope, between functions on cells.

docs/certificates.md, "Long-run averages".  A throw from x whose speed deviates by delta has the slope T_x, as a jog and
as a flip.  With f(x, delta) = ln |T_x| it counts g(x), the mean of f over delta.  Uniform laws are symmetric: the mean
of f - f(x, 0) is at most the law's reach times half of what f_delta varies.  Along a cell f(x, 0) is from its chord at
most a quarter of the cell's width times what f_x varies.
"""

import math

import numpy as np
from flint import arb

from .balls import Arb, Array, exact
from .landings import Noisy, upper
from .means import Mesh
from .noisy_throw import Hit, guess_angles, kappa_at, land, slopes_over
from .scene import Side


def log_slopes(noisy: Noisy, mesh: Mesh, kept: Array) -> tuple[Array, Array]:
    """Bound g on the cells that are kept, from below and from above, by what is affine between nodes.

    Infinite where a slope may be 0, or a throw is not enclosed.
    """
    below, above = np.full(len(mesh.place), math.inf), np.full(len(mesh.place), -math.inf)
    most = exact(noisy.speed.reach)
    deviations = (-most).union(most)
    kappa = kappa_at(noisy.kappa, deviations)
    for number, side in enumerate(noisy.sides):
        first = int(mesh.first[number])
        cells = first + np.flatnonzero(kept[first : mesh.first[number + 1]])
        nodes = np.union1d(cells, cells + 1)
        slow, plain, fast = (
            hits_of(side, mesh.place, nodes, kappa_at(noisy.kappa, each)) for each in (-most, arb(0), most)
        )
        logs = {
            node: abs(slopes_over(side, hit.before.union(hit.after), noisy.kappa, arb(1)).x).log()
            for node, hit in plain.items()
        }
        for cell in cells.tolist():
            off = arb("nan")
            if cell in slow and cell + 1 in fast:
                phi = slow[cell].before.union(fast[cell + 1].after)
                over = slopes_over(side, phi, kappa, 1 + deviations)
                if over.x > 0 or over.x < 0:
                    h = arb(float(mesh.place[cell + 1])) - arb(float(mesh.place[cell]))
                    off = h * varies(over.xx / over.x) / 4 + most * varies(over.xd / over.x) / 2
            for node in (cell, cell + 1):
                middle = logs.get(node, arb("nan"))
                above[node] = max(above[node], upper(middle + off))
                below[node] = min(below[node], -upper(off - middle))
    return below, above


def varies(ball: Arb) -> Arb:
    """Return the width of what a ball holds."""
    return ball.upper() - ball.lower()


def hits_of(side: Side, place: Array, nodes: Array, kappa: Arb) -> dict[int, Hit]:
    """Enclose the throws at one speed from nodes beyond the joint, as far as that is possible."""
    x = place[nodes]
    guess = guess_angles(side, x, np.full(len(x), float(kappa.mid())))
    hits = dict[int, Hit]()
    for node, at, angle in zip(nodes.tolist(), x.tolist(), guess.tolist(), strict=True):
        hit = land(side, arb(at), kappa, angle) if arb(at) > side.a else None
        if hit is not None:
            hits[node] = hit
    return hits
