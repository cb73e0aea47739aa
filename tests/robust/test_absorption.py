"""Absorption, escape and arrivals, against closed forms."""

from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import GridError
from limitsets.feeder.scattering import Samples
from limitsets.parameters.noise.absorbing import absorption, classes, feeding, random_starts, with_border
from limitsets.parameters.noise.ulam import transfer


class Still(NamedTuple):
    """x stays; noise makes it walk."""

    shift: float


def _still(params, x, side):
    return x + params.shift, side, 0


def _still_on(params, x, side, branch):
    return x + params.shift, side, 1.0


ls.register(Still, image=_still, image_on=_still_on)


class TwoCells(NamedTuple):
    """[0, 1) is stretched by `left` from 0, [1, 2) by `right` downwards from 2 + `over`; beyond 2 it leaves."""

    left: float
    right: float
    over: float


def _two(params, x, side):
    after = params.left * x if x < 1.0 else 2.0 + params.over - params.right * (2.0 - x)
    return after, side, 0 if x < 1.0 else 1


def _two_on(params, x, side, branch):
    if branch == 0:
        return params.left * x, side, params.left
    return 2.0 + params.over - params.right * (2.0 - x), side, params.right


ls.register(TwoCells, image=_two, image_on=_two_on, branches=("left", "right"))


def walk(n, up):
    """Chain of n + 1 unit cells; a step up with probability `up`, down otherwise."""
    cover = ls.grid([(0.0, n + 1.0)], cells=n + 1)
    return transfer(Still(0.0), cover, landing=Samples([-1.0, 1.0], [1.0 - up, up]))


def ends(n):
    cells = np.arange(n + 1)
    return cells == n, cells == 0


@pytest.mark.parametrize("up", [0.5, 0.45, 0.7])
def test_gamblers_ruin(up):
    n = 20
    i = np.arange(n + 1)
    top, bottom = ends(n)
    chain = walk(n, up)
    found = absorption(chain, top, other=bottom)
    q = (1.0 - up) / up
    exact = i / n if up == 0.5 else (1 - q**i) / (1 - q**n)
    np.testing.assert_allclose(found.probability["goal"], exact, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(found.probability["other"], 1 - exact, rtol=1e-9, atol=1e-12)
    assert found.residual < 1e-11
    both = absorption(chain, top | bottom)
    lasts = i * (n - i) if up == 0.5 else (i - n * exact) / (1.0 - 2.0 * up)
    np.testing.assert_allclose(both.mean, lasts, rtol=1e-9, atol=1e-9)


def test_mean_of_those_that_arrive():
    """The symmetric walk from i, of those that come to n before 0: (n^2 - i^2) / 3 steps."""
    n = 20
    top, bottom = ends(n)
    i = np.arange(1, n + 1)
    found = absorption(walk(n, 0.5), top, other=bottom)
    np.testing.assert_allclose(found.mean[1:], (n**2 - i**2) / 3.0, rtol=1e-9, atol=1e-9)
    assert np.isnan(found.mean[0])


def test_walk_off_both_ends():
    """Without absorbing cells the walk leaves [0, n + 1]: a ruin on n + 2 steps, nothing stays."""
    n = 9
    chain = walk(n, 0.5)
    found = absorption(chain, np.zeros(n + 1, dtype=bool))
    np.testing.assert_allclose(found.probability["outside"], 1.0, rtol=0, atol=1e-11)
    assert found.classes == ()
    # The quasi-stationary distribution is a half sine, the rate of escape 1 - cos(pi / (n + 2)); of period 2.
    part = classes(transfer(Still(0.0), chain.grid, landing=Samples([-1.0, 0.0, 1.0])))
    assert part == ()  # leaves faster than 2 % a step
    slow = walk(60, 0.5)
    (part,) = classes(slow)
    sine = np.sin(np.pi * np.arange(1, 62) / 62)
    np.testing.assert_allclose(part.weight, sine / sine.sum(), rtol=0, atol=1e-9)
    assert part.escape == pytest.approx(1.0 - np.cos(np.pi / 62), rel=1e-7)
    assert not part.closed
    assert part.leads_to["outside"] == pytest.approx(part.escape, rel=1e-12)


def test_two_cells_closed():
    """P = [[1 - a, a], [b, 1 - b]] rests at (b, a) / (a + b)."""
    chain = transfer(TwoCells(1.6, 1.25, 0.0), ls.grid([(0.0, 2.0)], cells=2))
    a, b = 1 - 1 / 1.6, 1 - 1 / 1.25
    np.testing.assert_allclose(chain.matrix.toarray(), [[1 - a, a], [b, 1 - b]], rtol=0, atol=1e-14)
    (found,) = classes(chain)
    np.testing.assert_allclose(found.weight, [b / (a + b), a / (a + b)], rtol=0, atol=1e-12)
    assert found.branches["right"] == pytest.approx(a / (a + b), abs=1e-12)
    there = absorption(chain, np.array([False, True]))
    np.testing.assert_allclose(there.mean, [1 / a, 0.0], rtol=1e-12)


def test_two_cells_that_are_left():
    """Q = [[1 - a, a], [b, 1 - b - c]]: leading eigenvalue and left vector of a matrix of two rows."""
    left, right, over = 1.6, 1.25, 0.01
    chain = transfer(TwoCells(left, right, over), ls.grid([(0.0, 2.0)], cells=2))
    a, c = 1 - 1 / left, over / right
    b = (1.0 - (2.0 + over - right)) / right
    kept = 1 - b - c
    trace, determinant = 1 - a + kept, (1 - a) * kept - a * b
    rate = 0.5 * (trace + np.sqrt(trace**2 - 4 * determinant))
    weight = np.array([b, rate - (1 - a)])
    (found,) = classes(chain)
    assert 1.0 - found.escape == pytest.approx(rate, abs=1e-12)
    np.testing.assert_allclose(found.weight, weight / weight.sum(), rtol=0, atol=1e-10)
    gone = absorption(chain, np.zeros(2, dtype=bool))
    np.testing.assert_allclose(gone.probability["outside"], 1.0, rtol=0, atol=1e-12)


def test_two_closed_classes_are_kept_apart():
    """Steps of 1 between cells 3 and 7 only; 0 to 2 and 8 to 10 stay where they are."""
    n = 10
    free = walk(n, 0.5)
    stuck = np.isin(np.arange(n + 1), (3, 4, 5, 6, 7))
    matrix = free.matrix.toarray()
    matrix[~stuck] = np.eye(n + 1)[~stuck]
    from dataclasses import replace

    from scipy.sparse import csr_array

    chain = replace(free, throw=csr_array(matrix), landing=None, sinks=np.zeros((n + 1, 2)))
    parts = classes(chain)
    assert [part.cells.mask.nonzero()[0].tolist() for part in parts if part.closed] == [
        [0],
        [1],
        [2],
        [8],
        [9],
        [10],
    ]
    found = absorption(chain, np.zeros(n + 1, dtype=bool))
    # from 3 .. 7 a ruin between 2 and 8
    share = (np.arange(3, 8) - 2) / 6.0
    np.testing.assert_allclose(found.probability["class 3"][3:8], share, rtol=1e-10)
    np.testing.assert_allclose(found.probability["class 2"][3:8], 1 - share, rtol=1e-10)


def test_distribution_of_arrivals():
    """Up or stay with p: the n-th success of a row of trials, a negative binomial law."""
    from scipy import stats

    n, p = 5, 0.3
    cover = ls.grid([(0.0, n + 1.0)], cells=n + 1)
    chain = transfer(Still(0.0), cover, landing=Samples([0.0, 1.0], [1 - p, p]))
    goal = np.arange(n + 1) == n
    found = feeding(chain, absorption(chain, goal), np.eye(n + 1)[0])
    law = stats.nbinom(n, p, loc=n)
    k = np.arange(found.arrived.size)
    np.testing.assert_allclose(found.arrived, law.pmf(k), rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.survivors, law.sf(k), rtol=0, atol=1e-9)
    assert found.mean == pytest.approx(n / p, rel=1e-10)
    assert found.quantile(0.95) == law.ppf(0.95)
    assert law.ppf(0.95) - 1 < found.crossing(0.95) <= law.ppf(0.95)
    assert found.share == pytest.approx(1.0, abs=1e-12)


def test_starts_that_never_arrive():
    n = 6
    chain = walk(n, 0.5)
    top, bottom = ends(n)
    found = feeding(chain, absorption(chain, bottom | top), np.eye(n + 1)[3])
    assert found.share == pytest.approx(1.0)
    lost = feeding(chain, absorption(chain, top), np.eye(n + 1)[3])  # cell 0 leads off the end
    assert lost.share == pytest.approx(4.0 / 7.0, rel=1e-10)
    assert lost.quantile(0.95) is None
    assert np.isnan(lost.crossing(0.95))
    assert lost.ends["outside"] == pytest.approx(3.0 / 7.0, rel=1e-10)


def test_random_starts():
    cover = with_border(ls.grid([(0.0, 1.0)], cells=4), 0.6)
    assert cover.n_cells == 5
    np.testing.assert_allclose(random_starts(cover, np.array([0.1]), 0.6), [0.3, 0.5, 0.2, 0, 0], atol=1e-12)
    assert with_border(cover, 0.6).n_cells == 5
    with pytest.raises(GridError, match="range of the starts"):
        random_starts(cover, np.array([0.7]), 0.6)
