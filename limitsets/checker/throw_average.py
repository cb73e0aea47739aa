"""Averages of the throw: what the inequalities of `orbit_average` need of its cells.

docs/certificates.md, "Averages".  In terms of the angle p of the impact, with R(p) the start that lands at p and D(p)
how far a jog goes, a throw is F = R + D(p), less a shift on a flip.  With ' for d/dp

    dF/dR = 1 + D'/R',    d2F/dR2 = (D'' R' - D' R'')/R'^3,    R'(p) > 0 proved.

The angle rises with R, so on a cell it lies between those at its ends.  Of a cell on which jog and flip are possible
the excess of energy, which decides, is proved to rise or fall with p.
"""

import functools
import math
from collections.abc import Iterator
from fractions import Fraction

import numpy as np
from flint import arb

from .balls import ONE, ZERO, Arb, Array, Rising, about, prove, sine_cosine
from .file import Cells
from .model import (
    FULL_TURN,
    at_angle,
    barrier,
    excess,
    flight,
    guess_root,
    landing_bend,
    landing_slope,
    ratios,
    rise_of_jog,
)
from .observable import Average, Observed, OnCell, observed
from .orbit_average import Enclosed, Step, check_line, enclosed, step_of
from .program import Program
from .scene import Scene, Side

AROUND = arb(2) ** -40  # the relative width of balls in which an angle is looked for


def check_throw_average(scene: Scene, c: Cells, average: Average) -> None:
    """Check the bounds of all components that have them, for one scene without noise."""
    functions = observed(average, functools.partial(Program, dimension=1, values={}, wide=[]), [])
    require_on_arm(scene, c, average.components())
    check_line(c, c.edges, average, lambda own: enclosed_throws(scene, c, functions, own))


def require_on_arm(scene: Scene, c: Cells, components: list[int]) -> None:
    """Require that the cells of components end before the arm does."""
    for i, edges in enumerate(c.edges):
        own = np.flatnonzero(np.isin(c.component[c.start[i] : c.start[i + 1]], components))
        on_arm = scene.end is None or not len(own) or Fraction(float(edges[own[-1] + 1])) <= scene.end
        prove(
            on_arm, f"side {i}: the cells reach beyond the end of the arm, where parts fall into the cavity"
        )


def enclosed_throws(scene: Scene, c: Cells, functions: list[Observed], own: Array) -> Iterator[Step]:
    """Enclose what the inequalities need of the cells of a component, by side and branch."""
    for side, edges in enumerate(c.edges):
        throws = ThrowsOfSide(scene, side)
        for branch, targets in enumerate((c.jog, c.flip)):
            possible = (c.branch == branch) | (c.branch == 2)
            cells = np.flatnonzero(own & possible & (c.side == side))
            if not len(cells):
                continue
            both, to = c.branch[cells] == 2, (side + branch) % len(c.edges)
            listed, ways = list[Enclosed](), list[int]()
            for cell, undecided in zip(cells.tolist(), both.tolist(), strict=True):
                k = cell - int(c.start[side])
                ends = float(edges[k]), float(edges[k + 1])
                with about(c.name(cell)):
                    ways.append(throws.way(branch, ends) if undecided else 0)
                    listed.append(throws.cell(branch, ends, functions))
            target = np.where(both[:, None], targets[cells] - c.start[to], -1)
            yield step_of(cells, to, listed, target, both, np.array(ways))


class ThrowsOfSide:
    """Throws from one side; brackets of the angle are found once for each border of cells."""

    def __init__(self, scene: Scene, side: int):
        self.s, self.side, self.kappa = scene.sides[side], side, scene.k_lo.union(scene.k_hi)
        self.near = 1.0  # an angle to begin with, that of the last throw
        prove(self.s.concave, f"side {side}: kappa > ell is not proved, so that there may be several impacts")
        self.at_border = functools.lru_cache(maxsize=4)(lambda x: self.angle(arb(x)))

    def angle(self, x: Arb) -> Arb:
        """Enclose the angle of the impact of a start, by a step of Newton's method in balls.

        f is 0 at 0, positive beyond since x > a, and concave: it has one positive root.
        """
        s, kappa = self.s, self.kappa
        if not s.exact:
            return 2 * (x - s.a) / (kappa - s.small_d)
        x0, k = float(x), float(kappa.mid())
        self.near = guess_root(s.floats, s.exact, x0, k, self.near)
        if math.isnan(self.near):  # begin where f is below 0
            a, d, _, _ = s.floats
            right = (x0 + math.sqrt(max(0.0, x0 * x0 + 2.0 * k * (d + math.hypot(a, d))))) / k
            self.near = guess_root(s.floats, s.exact, x0, k, right)
        p = arb(self.near)
        around = p + arb(0, 1) * p * AROUND
        sin, cos = around.sin_cos()
        root = p - flight(x, kappa, at_angle(s, p)) / (x - s.a * cos + s.d * sin - kappa * around)
        prove(
            bool(x > s.a and root > 0 and around.contains_interior(root)),
            f"the impact is not bracketed at x = {x0!r}",
        )
        return root

    def angles(self, ends: tuple[float, float]) -> Arb:
        """Enclose the angles over a cell."""
        return self.at_border(ends[0]).union(self.at_border(ends[1]))

    def slopes(self, phi: Arb) -> tuple[Arb, Arb]:
        """Enclose dF/dR and d2F/dR2 over angles."""
        s = self.s
        if not s.exact:
            return ONE - 2 * s.h / (self.kappa - s.small_d), ZERO
        prove_within_a_turn(phi)
        (sin, cos), r = sine_cosine(phi), ratios(phi)
        steep = landing_slope(s, r, self.kappa)
        prove(bool(steep > 0), "that the angle rises with the start is not proved")
        rise = rise_of_jog(s, sin, cos)
        bend = s.a * cos - s.d * sin  # of D
        return ONE + rise / steep, (bend - rise * landing_bend(s, r, cos) / steep) / (steep * steep)

    def cell(self, branch: int, ends: tuple[float, float], functions: list[Observed]) -> Enclosed:
        """Enclose what the inequalities need of a cell."""
        x, middle = arb(ends[0]).union(arb(ends[1])), (arb(ends[0]) + arb(ends[1])) / 2
        in_middle, (slope, second) = self.slopes(self.angle(middle))[0], self.slopes(self.angles(ends))
        slope = slope.intersection(in_middle + second * (x - middle))  # the mean value theorem
        images = [self.image(end, branch) for end in (ends if slope > 0 else ends[::-1])]
        at = OnCell(
            self.side, branch, ends, x, middle=middle, bend=second / slope, slope=lambda: abs(in_middle)
        )
        return enclosed(slope, second, images, functions, at)

    def image(self, x: float, branch: int) -> Arb:
        """Throw a border of cells."""
        jog = arb(x) + at_angle(self.s, self.at_border(x)).D
        return jog - self.s.shift if branch else jog

    def way(self, branch: int, ends: tuple[float, float]) -> int:
        """Return on which side of its change an undecided cell takes a branch; there is one change at most."""
        slope = excess_slope(self.s, arb(ends[0]).union(arb(ends[1])), self.angles(ends), self.kappa)
        prove(slope > 0 or slope < 0, "that it holds one change of branch at most is not proved")
        return branch if slope > 0 else 1 - branch


def prove_within_a_turn(phi: Arb) -> None:
    """Prove that angles are such as `ratios` takes."""
    prove(bool(phi > 0 and phi < FULL_TURN), "that the part lands within a turn is not proved")


def excess_slope(s: Side, x: Arb, phi: Arb, kappa: Arb) -> Arb:
    """Enclose the derivative of the excess of energy: by the angle in the exact model, else by the start.

    The exact model with the criterion of energy alone flips wherever X < 0: such a cell is refused.
    """
    if not s.exact:
        spin = Rising(s.rho2 - s.a * x + 2 * s.a * s.a + s.d * s.d + s.d * s.h, [-s.a])
        return excess(s, spin, Rising(ZERO, [-2 * s.a])).by[0]
    prove_within_a_turn(phi)
    p = Rising(phi, [ONE])
    sin, cos = p.sin_cos()
    H, X = sin * s.a + cos * s.d, cos * s.a - sin * s.d
    prove(s.signed or bool(X.x > 0), "that the centre of mass is left of the vertex is not proved")
    start = Rising(x, [landing_slope(s, ratios(phi), kappa)])  # R(p)
    spin = X * (start - p * kappa) + H * s.hd + s.rho2
    rising = excess(s, spin, barrier(s.ell, X, H, s.signed) * kappa)
    prove(rising.x.is_finite(), "that the excess of energy is bounded is not proved")
    return rising.by[0]
