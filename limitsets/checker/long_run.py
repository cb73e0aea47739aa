"""The claim `long-run`: averages of a noisy chain over ever more throws, from every start in some places.

docs/certificates.md, "Long-run averages".  Noise is bounded.  N are cells from which no throw leads to others, K V(x)
the mean of V after a throw from x, g(x) the mean of what a throw from x counts.  The file has a function u, affine
between neighbouring nodes, and c, and checked is at every node of N, on the cells at both sides,

    g + K u - u <= c,

by the same step as for probabilities (`steps`), which bounds K u from above by what is affine on each cell too.  Then
along an orbit X_0, X_1, .. what is counted up to the n-th throw is at most n c + u(X_0) - u(X_n) and a sum of
differences of a martingale, each bounded: divided by n these tend to 0 almost surely (strong law of large numbers for
martingales).  So from every start in N, almost surely, the upper limit of the average is at most c; and so is the mean
of g over every stationary law on N (integrate).  For the lower end -g is counted, with a function of its own.

Flips lead from each side to the next, around the part: those from the last side to side 0, counted once for each side,
are all flips up to a constant.  A flip from the last side counts where it lands: K(u + count) on that side.  For the
Lyapunov exponent g is the mean of ln |dx'/dx| (`log_slopes`).
"""

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from .balls import Array, Pair, about, prove
from .brackets import Place, Setting, chain_on, places_in_words, read_setting, require_edges
from .file import Arrays, hex_float, read_side, require, rounded, rows, section_alone, table
from .laws import Law
from .log_slopes import log_slopes
from .means import Mesh
from .steps import Chain

FLIPS, EXPONENT, SIDE = "flips", "lyapunov", "side"
OF_WHAT: dict[str | int, str] = {
    FLIPS: "flips per throw",
    EXPONENT: "ln |dx'/dx|, whose average is the Lyapunov exponent",
}
END_SIGNS = (-1.0, 1.0)  # of the lower end, and of the upper
Gain = Callable[[Array], tuple[Array, Array]]


class Counted(NamedTuple):
    """What is averaged, flips, the exponent or throws from a side; between which numbers; functions u of both ends."""

    of: str | int
    bounds: Pair
    functions: tuple[Array, Array]


class LongRun(NamedTuple):
    """What is claimed: read, and not yet believed."""

    setting: Setting
    edges: list[Array]
    counted: list[Counted]

    @property
    def work(self) -> int:
        """How many nodes are thrown from, and looked at, in all."""
        return sum(len(each) for each in self.edges)

    @property
    def raw(self) -> dict[str, Any]:
        """The scene as the file has it."""
        return self.setting.scene.raw


def read_long_run(header: dict[str, Any], entries: dict[str, memoryview]) -> LongRun:
    """Read a file; raises BadFileError."""
    nothing = "a file of long-run averages has no boxes, no other noise and no tolerance"
    keys = "scene laws starts absorbing strata averages"
    section = section_alone(header, "long-run", "long-run averages", keys, nothing)
    setting = read_setting(section)
    sides = len(setting.scene.sides)
    arrays = Arrays(header["arrays"], entries)
    edges = [arrays.read(f"edges.{i}", "<f8") for i in range(sides)]
    require_edges(edges, setting)
    counted = []
    for k, one in enumerate(rows(section["averages"], "averages", 1, 100)):
        known = table(one, "an average", "of lower upper")
        of = known["of"]
        if of not in (FLIPS, EXPONENT):
            of = read_side(table(of, "of", SIDE)[SIDE], sides)
        lo, hi = (hex_float(known[key], f"average {k}: {key}") for key in ("lower", "upper"))
        require(lo <= hi, f"average {k}: the ends do not ascend")
        pair = arrays.read(f"{k}.lower", "<f8"), arrays.read(f"{k}.upper", "<f8")
        alike = all(len(u) == sum(len(each) + 2 for each in edges) for u in pair)
        require(alike, "a function has not one number for each node")
        counted.append(Counted(of, (lo, hi), pair))
    arrays.require_no_others()
    return LongRun(setting, edges, counted)


def long_run_in_words(c: LongRun) -> list[str]:
    """Put the claim in words, from the numbers that were checked."""
    starts = places_in_words(c.setting.starts, c.setting.scene.unit)
    lines = [
        "long-run: averages over n throws, as n grows, from every start below almost surely; and of every",
        "    stationary law on cells that no throw leaves",
        "    all deviations are independent of each other",
        f"    starts, in cells that no throw leaves: {starts}",
    ]
    for one in c.counted:
        what = OF_WHAT.get(one.of, f"share of throws from side {one.of}")
        lo, hi = one.bounds
        if one.of != EXPONENT:  # averages of what is 0 or 1 at each throw
            lo, hi = max(lo, 0.0), min(hi, 1.0)
        lines.append(f"    {what}: between {rounded(lo, up=False)} and {rounded(hi, up=True)}")
    return lines


# ----------------------------------------------------------------
# The cells that no throw leaves.


def kept_cells(chain: Chain, law: Law) -> Array:
    """Mark the most cells, by their left nodes, from which no throw leads to others: `law` is of the landing."""
    mesh, goal, live = chain.mesh, chain.goal, chain.cells.at
    kept, alone = np.zeros(len(mesh.place), dtype=bool), np.ones(len(mesh.place), dtype=bool)
    alone[np.concatenate([chain.hard.at, chain.hard.at + 1])] = False
    kept[live] = alone[live] & alone[live + 1]
    reach, met = float(np.nextafter(float(law.reach), np.inf)), []
    for span in (chain.cells.one, chain.cells.two):
        side = np.searchsorted(goal.first, span.first, side="right") - 1
        lands = mesh.within(side, goal.place[span.first] - reach, goal.place[span.last + 1] + reach)
        met.append(span if law.certain else lands)
    while True:
        outside = np.concatenate([[0], np.cumsum(~kept)])
        stays = np.ones(len(live), dtype=bool)
        for ranges in met:
            stays &= outside[ranges.last + 1] == outside[ranges.first]
        left = live[~stays & kept[live]]
        if not len(left):
            return kept
        kept[left] = False


def check_starts_stay(starts: list[Place], mesh: Mesh, kept: Array) -> None:
    """Check that cells that throws do not leave hold all starts."""
    for side, lo, hi in starts:
        nodes = mesh.place[mesh.first[side] + 1 : mesh.first[side + 1] - 1]
        within = Fraction(float(nodes[0])) <= lo and hi <= Fraction(float(nodes[-1]))
        prove(within, f"side {side}: starts lie beyond the nodes")
        for cell in range(int(mesh.first[side]), int(mesh.first[side + 1]) - 1):
            a, b = Fraction(float(mesh.place[cell])), Fraction(float(mesh.place[cell + 1]))
            where = f"side {side}, x in [{float(a)!r}, {float(b)!r}]: "
            prove(
                bool(kept[cell]) or not (a < hi and lo < b), f"{where}that no throw leads out is not proved"
            )


# ----------------------------------------------------------------
# The inequality.


def nodes_of(kept: Array) -> Array:
    """Return the nodes of some cells."""
    return np.unique(np.concatenate([np.flatnonzero(kept), np.flatnonzero(kept) + 1]))


def most_gain(
    chain: Chain, kept: Array, of: str | int, sign: float, logs: tuple[Array, Array] | None = None
) -> Gain:
    """Give a function that bounds sign g + K u at the nodes of the cells that are kept; and lists these nodes.

    `logs`: the bounds of g for the exponent.
    """
    mesh = chain.mesh
    sides = len(mesh.first) - 1
    own = np.searchsorted(mesh.first, np.arange(len(mesh.place)), side="right") - 1
    nodes = nodes_of(kept)
    free = np.full(len(mesh.place), -np.inf)
    own_count = np.zeros(len(mesh.place))
    if of == EXPONENT and logs is not None:
        own_count = sign * logs[sign > 0]
    elif of != FLIPS:
        own_count = sign * (own == of)

    def gain(u: Array) -> tuple[Array, Array]:
        above = chain.above(u, free)
        if of == FLIPS:
            flipped = chain.above(u + sign * sides * (own == 0), free)
            return nodes, np.where(own == sides - 1, flipped, above)[nodes]
        return nodes, above[nodes] + own_count[nodes]

    return gain


def check_end(sign: float, u: Array, end: float, gain: Gain, size: float = 4.0) -> None:
    """Check that u proves an end of an average, the lower with -1: `size` is of what is counted."""
    prove(bool(np.isfinite(u).all()), "a function is not finite")
    nodes, gained = gain(u)
    prove(bool(np.isfinite(gained).all()), "a function is too large")
    excess = float((gained - u[nodes]).max()) + 2.0**-48 * (float(np.abs(u).max()) + size)
    only = f"only {rounded(sign * excess, up=sign > 0)} is proved"
    prove(excess <= sign * end, f"the {'upper' if sign > 0 else 'lower'} end is {end!r}: {only}")


def check_long_run(c: LongRun, advance: Callable[[int], None]) -> None:
    """Check everything that is claimed."""
    chain, _ = chain_on(c.setting, c.edges, advance)
    prove(
        chain.beyond == 0.0 and bool(c.setting.noisy.landing.beyond == 0),
        "noise without a bound may lead out",
    )
    kept = kept_cells(chain, c.setting.noisy.landing)
    check_starts_stay(c.setting.starts, chain.mesh, kept)
    logs, size = None, 4.0
    if any(each.of == EXPONENT for each in c.counted):
        logs = log_slopes(c.setting.noisy, chain.mesh, kept)
        size += max(float(np.abs(each[nodes_of(kept)]).max(initial=0.0)) for each in logs)
    for k, one in enumerate(c.counted):
        with about(f"average {k}"):
            for sign, u, end in zip(END_SIGNS, one.functions, one.bounds, strict=True):
                check_end(sign, u, end, most_gain(chain, kept, one.of, sign, logs), size)
