"""The brackets of a noisy chain, found anew.

docs/certificates.md, "Probabilities", number 22.  The checker makes the steps itself, and its own brackets have to lie
within those claimed.
"""

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
from flint import arb

from .averages import INFLATE, OUTERMOST, Mesh, Rows, Spread, mean_rows
from .balls import Array
from .chain import Chain
from .chances import ANY, LEFT, Chances
from .links import ABSORBED, HARD, LIVE, chain_of
from .texts import plain, rounded

MOST_MEAN = 5_000  # steps in which a mean is bounded
# A mean is bounded from above once no state's bound grows by more than this share of a throw.
GROWTH = 0.5


def mesh_of(edges: list[Array]) -> Mesh:
    """Put the nodes of all sides together, with one far out at either end."""
    whole = [np.concatenate([[-OUTERMOST], each, [OUTERMOST]]) for each in edges]
    return Mesh(np.concatenate(whole), np.concatenate([[0], np.cumsum([len(each) for each in whole])]))


def kinds_of(c: Chances, mesh: Mesh) -> tuple[Array, dict[str, Array]]:
    """Find what each cell is, exactly, and by name the nodes of the cells that absorb, or may do so in part."""
    kinds = np.full(len(mesh.place), -1)
    absorbed: dict[str, set[int]] = {name: set() for name in (LEFT, *c.absorbing)}
    for i, side in enumerate(c.scene.sides):
        own = [(name, place) for name, some in c.absorbing.items() for place in some if place[0] == i]
        for cell in range(int(mesh.first[i]), int(mesh.first[i + 1]) - 1):
            lo, hi = float(mesh.place[cell]), float(mesh.place[cell + 1])
            a, b = Fraction(lo), Fraction(hi)
            met = {name for name, (_, begin, end) in own if a < end and begin < b}
            inside = any(begin <= a and b <= end for _, (_, begin, end) in own)
            if bool(arb(hi) <= side.a) or a >= c.scene.arm[0]:
                kinds[cell], met = ABSORBED, {LEFT}
            elif not (bool(arb(lo) > side.a) and b <= c.scene.arm[0]):
                kinds[cell], met = HARD, met | {LEFT}
            else:
                kinds[cell] = ABSORBED if inside else HARD if met else LIVE
            for name in met:
                absorbed[name] |= {cell, cell + 1}
    return kinds, {name: np.array(sorted(nodes), dtype=np.int64) for name, nodes in absorbed.items()}


def start_row(c: Chances, mesh: Mesh) -> Rows:
    """Build the row that makes the mean over the starts, which are equally likely per length."""
    side, lo, hi = (np.array(column) for column in zip(*c.starts, strict=True))
    length = hi - lo
    weight = (length / length.sum()).astype(float)
    row = np.zeros(len(side), dtype=np.int64)
    spread = Spread(row, weight, side.astype(np.int64), lo.astype(float), hi.astype(float))
    return mean_rows(1, mesh, spread, 0.0)


def mean_above(row: Rows, values: Array) -> float:
    """Bound the mean over the starts from above."""
    return float(row.times(values)[0]) + row.off * float(np.abs(values).max())


def check_within(chain: Chain, row: Rows, name: str, said: Array) -> tuple[str, Array]:
    """Check the brackets of one name; "" or the reason, and the brackets found."""
    value = {each: float(name in (ANY, each)) for each in chain.absorbed}
    fixed = [chain.fixed({each: sign * v for each, v in value.items()}) for sign in (-1.0, 1.0)]
    bound = [chain.first(each) for each in fixed]
    found = np.empty(said.shape)
    for n in range(len(said)):
        if n:
            bound = [chain.above(values, each) for values, each in zip(bound, fixed, strict=True)]
        found[n] = -mean_above(row, bound[0]), mean_above(row, bound[1])
    # to have ended is for ever: a lower bound holds later on, an upper one earlier
    found[:, 0] = np.maximum(np.maximum.accumulate(found[:, 0]), 0.0)
    found[:, 1] = np.minimum(np.minimum.accumulate(found[::-1, 1])[::-1], 1.0)
    wrong = np.flatnonzero(~((said[:, 0] <= found[:, 0]) & (found[:, 1] <= said[:, 1])))
    if not len(wrong):
        return "", found
    n = int(wrong[0])
    lo, hi = rounded(float(found[n, 0]), up=False), rounded(float(found[n, 1]), up=True)
    claimed = f"[{float(said[n, 0])!r}, {float(said[n, 1])!r}]"
    return f"P({plain(name)} within {n} throws): {claimed} is claimed, [{lo}, {hi}] is proved", found


def check_quantiles(c: Chances, found: dict[str, Array]) -> str:
    """Check the quantiles by the brackets found; "" or the reason."""
    for name, share, lo, hi in c.quantiles:
        low, high = found[name].T
        none_before = lo == 0 or (lo <= len(high) and Fraction(float(high[lo - 1])) < share)
        there = hi < len(low) and Fraction(float(low[hi])) >= share
        if not (none_before and there):
            return f"the quantile of {float(share):.6g}, {lo} to {hi} throws, is not proved"
    return ""


def check_mean(chain: Chain, row: Rows, said: tuple[float, float]) -> str:
    """Check the bounds of the mean number of throws; "" or the reason.

    From below it is at least the mean of the lesser of T and n.  From above: with V >= 0 and 1 + K V <= U <= V + c on
    the cells from which throws are made, V / (1 - c) is a bound.
    """
    none = chain.fixed(dict.fromkeys(chain.absorbed, 0.0))
    below, low = chain.first(none), 0.0
    for _ in range(MOST_MEAN):
        if low >= said[0]:
            break
        before, below = below, chain.above(below, none, -1.0)
        low = max(low, -mean_above(row, below))
        if not float((before - below).max()) > 1e-9:
            break
    if low < said[0]:
        return f"the mean is at least {said[0]!r}: only {rounded(low, up=False)} is proved"
    if said[1] == math.inf:
        return ""
    made = np.unique(np.concatenate([chain.live, chain.live + 1, chain.hard.at, chain.hard.at + 1]))
    above, best = chain.first(none), math.inf
    for _ in range(MOST_MEAN):
        after = chain.above(above, none, 1.0)
        growth = float((after - above)[made].max())
        if growth < GROWTH and bool((above >= 0.0).all()):
            best = min(best, mean_above(row, above) / (1.0 - growth) * INFLATE)
        if best <= said[1] or growth <= 1e-9 or not float(after.max()) < 1e6:
            break
        above = after
    return "" if best <= said[1] else f"the mean is at most {said[1]!r}: only {best!r} is proved"


def check_chances(c: Chances, progress: Callable[[int, int], None] | None) -> tuple[str, int]:
    """Check everything that is claimed; "" or the reason, and the number of cells."""
    mesh = mesh_of(c.edges)
    kinds, absorbed = kinds_of(c, mesh)
    work, done = len(mesh.place) + len(c.within) * len(mesh.place), 0

    def told(more: int) -> None:
        nonlocal done
        done = min(done + more, work - 1)
        if progress is not None:
            progress(done, work)

    chain, row = chain_of(c.noisy, mesh, kinds, absorbed, told), start_row(c, mesh)
    found: dict[str, Array] = {}
    bad = ""
    for name, said in c.within.items():
        bad, found[name] = check_within(chain, row, name, said)
        told(len(mesh.place))
        if bad:
            break
    bad = bad or check_quantiles(c, found)
    if not bad and c.mean is not None:
        bad = check_mean(chain, row, c.mean)
    if progress is not None:
        progress(work, work)
    return bad, sum(len(e) - 1 for e in c.edges)
