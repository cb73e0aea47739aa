"""The transfer operator with noise, and absorption."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.sparse import csr_array

import limitsets as ls
from limitsets.base.errors import AnswerError, GridError
from limitsets.feeder.scattering import (
    Gaussian,
    Samples,
    Scattering,
    Uniform,
    kappa_strata,
    still_map,
    thrown,
)
from limitsets.parameters.noise import absorbing
from limitsets.parameters.noise.absorbing import absorption, classes, feeding, random_starts, with_border
from limitsets.parameters.noise.cell_images import BoxcarOperator, Boxcars, laid
from limitsets.parameters.noise.ulam import transfer
from limitsets.systems.sets import invariant_measures
from tests.maps_of_tests import Baker, Tent

# ----------------------------------------------------------------
# The transfer operator where it is known on paper, or from a kernel integrated by other means.


LINE = [(0.0, 1.0)]


def kernel_of(map_, law, n):
    """P of x -> map(x) + noise on [0, 1], by 16 points per cell and the distribution function of the law."""
    edges = np.linspace(0.0, 1.0, n + 1)
    x = (np.arange(16 * n) + 0.5) / (16 * n)
    cdf = law.cdf(edges[None, :] - map_(x)[:, None])
    return np.diff(cdf, axis=1).reshape(n, 16, n).mean(axis=1)


def stationary(matrix):
    """Leading eigenvalue and left vector, by squaring the matrix: P^(2^k) keeps nothing else."""
    power = matrix / np.abs(matrix).sum(axis=1).max()
    for _ in range(16):
        power = power @ power
        power /= power.max()
    vector = power.sum(axis=0) / power.sum()
    return float((vector @ matrix).sum()), vector


def test_rows_and_ways_out_add_up_to_one():
    scene = ls.load("paper-designed")
    noise = Scattering(speed=Gaussian(0.01), landing=Gaussian(0.1))
    for grading in ("uniform", "graded"):
        cover = ls.grid(scene.domain, cells=300, grading=grading)
        laws = {"parameter": kappa_strata(noise, scene, 8), "landing": noise.landing}
        chain = transfer(thrown(still_map(scene)), cover, **laws, strata=8)
        total = chain.matrix.sum(axis=1) + chain.sinks.sum(axis=1)
        np.testing.assert_allclose(total, 1.0, rtol=0, atol=1e-13)
        assert chain.sinks.min() >= 0.0
        assert chain.sinks[:, 0].max() > 0.1  # near a_i landings scatter inward


def test_boxcars_and_the_matrix_written_out_are_the_same():
    rng = np.random.default_rng(1)
    edges = (np.sort(rng.uniform(0.0, 3.0, 40)), np.linspace(-1.0, 4.0, 23))
    sheets = []
    for target in (0, 1):
        lo = rng.uniform(-1.5, 4.5, 50)
        boxes = Boxcars(10 * target, target, 0, lo, lo + rng.exponential(0.5, 50), rng.uniform(0, 1, 50))
        sheets.append(laid(boxes, edges[target])[0])
    stage = BoxcarOperator(60, edges, tuple(sheets))
    dense = stage.matrix().toarray()
    v, u = rng.uniform(size=dense.shape[1]), rng.uniform(size=60)
    np.testing.assert_allclose(stage.apply(v), dense @ v, rtol=0, atol=1e-12)
    np.testing.assert_allclose(stage.adjoint(u), dense.T @ u, rtol=0, atol=1e-12)
    # against an integral of one boxcar by hand
    overlap = np.clip(np.minimum(boxes.hi[3], edges[1][1:]) - np.maximum(boxes.lo[3], edges[1][:-1]), 0, None)
    by_hand = boxes.weight[3] * overlap / (boxes.hi[3] - boxes.lo[3])
    only = BoxcarOperator(60, edges, (sheets[1],)).matrix().toarray()[13, 39:]
    np.testing.assert_allclose(only, by_hand, rtol=0, atol=1e-14)


def test_doubling_map_with_noise_stays_uniform():
    """On the circle noise would leave the density uniform; on the interval Q loses what jumps the ends."""
    chain = transfer(ls.maps.Doubling(), ls.grid(LINE, cells=256), landing=Uniform(0.05))
    even = np.full(256, 1.0 / 256)
    after = chain.adjoint(even)
    middle = slice(15, 241)  # further than 0.05 and a cell from both ends
    np.testing.assert_allclose(after[middle], 1.0 / 256, rtol=1e-12)
    # the mean loss: from even x' in [0, 1], E max(0, e - x') = e^2 / (4 b), twice: b / 4 at each end
    assert float(chain.sinks[:, 0].mean()) == pytest.approx(2 * 0.05 / 4, rel=1e-3)


def test_baker_map_is_uniform_in_two_dimensions():
    chain = transfer(Baker(), ls.grid([(0.0, 1.0), (0.0, 1.0)], cells=16))
    (found,) = classes(chain)
    np.testing.assert_allclose(found.density, 1.0, rtol=0, atol=1e-11)
    assert found.escape == 0.0
    rate, weight = stationary(chain.matrix.toarray())
    assert rate == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(weight, 1.0 / 256, rtol=0, atol=1e-14)


DESIGNED = ls.load("paper-designed")
STILL = [(params, LINE) for params in (ls.maps.Logistic(3.7), ls.maps.Doubling(), Tent(1.8))]


@pytest.mark.parametrize(("params", "domain"), [*STILL, (DESIGNED.map, DESIGNED.domain)])
def test_no_noise_agrees_with_invariant_measures(params, domain):
    cover = ls.grid(domain, cells=512)
    (measure,) = invariant_measures(ls.transitions(params, cover))
    (found,) = [part for part in classes(transfer(params, cover)) if part.closed]
    np.testing.assert_allclose(found.weight, measure.weight, rtol=0, atol=1e-9)
    assert found.residual < 1e-12


@pytest.mark.parametrize(
    ("params", "map_"),
    [
        (ls.maps.Logistic(3.6), lambda x: 3.6 * x * (1.0 - x)),
        (Tent(1.6), lambda x: 1.6 * np.minimum(x, 1.0 - x)),
    ],
    ids=["logistic", "tent"],
)
@pytest.mark.parametrize(
    ("law", "exact"),
    [(Gaussian(0.02), stats.norm(scale=0.02)), (Uniform(0.05), stats.uniform(-0.05, 0.1))],
    ids=["gaussian", "uniform"],
)
def test_additive_noise_against_the_exact_kernel(params, map_, law, exact):
    n = 400
    rate, weight = stationary(kernel_of(map_, exact, n))
    parts = classes(transfer(params, ls.grid(LINE, cells=n), landing=law, strata=32))
    found = max(parts, key=lambda part: part.weight @ (weight > weight.mean()))
    assert 1.0 - found.escape == pytest.approx(rate, abs=2e-5)
    assert np.abs(found.weight - weight).sum() < 4e-3


def test_errors_fall_with_cells():
    """Against the exact kernel on 800 cells, compared on 50 bins."""
    _, fine = stationary(kernel_of(lambda x: 3.6 * x * (1.0 - x), stats.norm(scale=0.02), 800))
    truth = fine.reshape(50, -1).sum(axis=1)
    errors = []
    for n in (100, 200, 400):
        found = classes(transfer(ls.maps.Logistic(3.6), ls.grid(LINE, cells=n), landing=Gaussian(0.02)))[0]
        errors.append(np.abs(found.weight.reshape(50, -1).sum(axis=1) - truth).sum())
    assert errors[1] < 0.5 * errors[0]
    assert errors[2] < 0.5 * errors[1]
    assert errors[2] < 5e-3


def test_a_parameter_that_scatters():
    """x -> r x (1 - x) with r even in [3.5, 3.7]: the transition density integrated over r on 64 nodes."""
    n, nodes = 300, 64
    r = 3.5 + 0.2 * (np.arange(nodes) + 0.5) / nodes
    x = (np.arange(100 * n) + 0.5) / (100 * n)
    exact = np.zeros((n, n))
    for value in r:
        cell = np.minimum((value * x * (1.0 - x) * n).astype(int), n - 1)
        exact += np.bincount(np.repeat(np.arange(n), 100) * n + cell, minlength=n * n).reshape(n, n)
    exact /= exact.sum(axis=1, keepdims=True)
    _, weight = stationary(exact)

    def centred(deviation):
        return ls.maps.Logistic(3.6 + deviation)

    parts = classes(transfer(centred, ls.grid(LINE, cells=n), parameter=Uniform(0.1)))
    (found,) = [part for part in parts if part.closed]
    assert np.abs(found.weight - weight).sum() < 0.02


def test_two_values_of_a_parameter_are_two_maps():
    cover = ls.grid(LINE, cells=64)
    both = transfer(lambda r: ls.maps.Logistic(r), cover, parameter=Samples([3.0, 4.0], [1, 3]))
    one, two = (transfer(ls.maps.Logistic(r), cover).matrix.toarray() for r in (3.0, 4.0))
    np.testing.assert_allclose(both.matrix.toarray(), 0.25 * one + 0.75 * two, rtol=0, atol=1e-13)


def test_what_lands_beyond_may_be_brought_back():
    """Doubling with x' shifted by -0.25 always: [0, 1/2) lands in [-1/4, 3/4), what is below 0 leaves."""
    chain = transfer(ls.maps.Doubling(), ls.grid(LINE, cells=8), landing=Samples([-0.25]))
    np.testing.assert_allclose(chain.sinks[:, 0], [1, 0, 0, 0, 1, 0, 0, 0], rtol=0, atol=1e-9)
    # and a throw that lands beyond the arm's end before it is shifted back stays
    scene = ls.load("paper-designed").with_values({"arm.length": 23.0})
    cover = ls.grid(scene.domain, cells=200, grading="uniform")
    off = transfer(scene.map, cover).sinks[:, 1].sum()
    back = transfer(scene.map, cover, landing=Samples([-0.6])).sinks[:, 1].sum()
    assert off > 1.0
    assert back == 0.0  # landings end at 23.383


def test_implicit_and_written_out_give_the_same_classes(monkeypatch):
    cover = ls.grid(LINE, cells=200)
    written = classes(transfer(ls.maps.Logistic(3.6), cover, landing=Gaussian(0.01)))
    monkeypatch.setattr("limitsets.parameters.noise.ulam.WRITTEN_OUT", 0)
    chain = transfer(ls.maps.Logistic(3.6), cover, landing=Gaussian(0.01))
    assert not chain.written_out
    implicit = classes(chain)
    assert len(implicit) == len(written)
    np.testing.assert_allclose(implicit[0].weight, written[0].weight, rtol=0, atol=1e-9)
    assert implicit[0].escape == pytest.approx(written[0].escape, rel=1e-6)


def test_noise_of_x_in_two_dimensions_is_refused():
    with pytest.raises(AnswerError, match="noise of x"):
        transfer(Baker(), ls.grid([(0.0, 1.0), (0.0, 1.0)], cells=4), landing=Uniform(0.1))
    with pytest.raises(AnswerError, match="dimension"):
        transfer(Baker(), ls.grid(LINE, cells=4))


def rooted(x, factor):
    """No number below 0."""
    return factor * np.sqrt(x)


def test_what_has_no_image_is_undefined_and_not_outside():
    """Below 0 there is no number; from 1/4 on 2 sqrt(x) lies beyond 1, the end of the domain."""
    chain = transfer(ls.map(rooted, factor=2.0), ls.grid([(-1.0, 1.0)], cells=8))
    assert chain.exits == ("outside", "undefined")
    np.testing.assert_allclose(chain.sinks[:, 1], [1, 1, 1, 1, 0, 0, 0, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(chain.sinks[:, 0], [0, 0, 0, 0, 0, 1, 1, 1], rtol=0, atol=1e-9)


# ----------------------------------------------------------------
# Absorption, escape and arrivals, against closed forms.


def still(x):
    """x stays; noise makes it walk."""
    return x


def from_zero(x, left):
    return left * x


def from_two(x, right, over):
    return 2.0 + over - right * (2.0 - x)


def beyond_one(x):
    return x - 1.0


STAYS = ls.map(still)


def two_cells(left, right, over):
    """[0, 1) is stretched by `left` from 0, [1, 2) by `right` downwards from 2 + `over`; beyond 2 it leaves."""
    return ls.map(pieces=(from_zero, from_two), margin=beyond_one, left=left, right=right, over=over)


def walk(n, up):
    """Chain of n + 1 unit cells; a step up with probability `up`, down otherwise."""
    cover = ls.grid([(0.0, n + 1.0)], cells=n + 1)
    return transfer(STAYS, cover, landing=Samples([-1.0, 1.0], [1.0 - up, up]))


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
    part = classes(transfer(STAYS, chain.grid, landing=Samples([-1.0, 0.0, 1.0])))
    assert part == ()  # leaves faster than 2 % a step
    slow = walk(60, 0.5)
    (part,) = classes(slow)
    sine = np.sin(np.pi * np.arange(1, 62) / 62)
    np.testing.assert_allclose(part.weight, sine / sine.sum(), rtol=0, atol=1e-9)
    assert part.escape == pytest.approx(1.0 - np.cos(np.pi / 62), rel=1e-7)
    assert not part.closed
    assert part.leads_to["outside"] == pytest.approx(part.escape, rel=1e-12)


def test_the_search_for_a_distribution_ends_after_so_many_steps(monkeypatch):
    """A walk that mixes slowly, from even weights: seven steps are seven products, far from the half sine."""
    monkeypatch.setattr(absorbing, "_arnoldi", lambda part: None)
    monkeypatch.setattr(absorbing, "MOST_STEPS", 7)
    _, residual, products = absorbing.distribution(walk(60, 0.5), np.arange(61))
    assert products == 7
    assert residual > 1e-3


def test_two_cells_closed():
    """P = [[1 - a, a], [b, 1 - b]] rests at (b, a) / (a + b)."""
    chain = transfer(two_cells(1.6, 1.25, 0.0), ls.grid([(0.0, 2.0)], cells=2))
    a, b = 1 - 1 / 1.6, 1 - 1 / 1.25
    np.testing.assert_allclose(chain.matrix.toarray(), [[1 - a, a], [b, 1 - b]], rtol=0, atol=1e-14)
    (found,) = classes(chain)
    np.testing.assert_allclose(found.weight, [b / (a + b), a / (a + b)], rtol=0, atol=1e-12)
    assert found.branches["from_two"] == pytest.approx(a / (a + b), abs=1e-12)
    there = absorption(chain, np.array([False, True]))
    np.testing.assert_allclose(there.mean, [1 / a, 0.0], rtol=1e-12)


def test_two_cells_that_are_left():
    """Q = [[1 - a, a], [b, 1 - b - c]]: leading eigenvalue and left vector of a matrix of two rows."""
    left, right, over = 1.6, 1.25, 0.01
    chain = transfer(two_cells(left, right, over), ls.grid([(0.0, 2.0)], cells=2))
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
    chain = replace(free, throw=csr_array(matrix), landing=None, sinks=np.zeros((n + 1, 2)))
    parts = classes(chain)
    closed = [part.cells.mask.nonzero()[0].tolist() for part in parts if part.closed]
    assert closed == [[0], [1], [2], [8], [9], [10]]
    found = absorption(chain, np.zeros(n + 1, dtype=bool))
    # from 3 .. 7 a ruin between 2 and 8
    share = (np.arange(3, 8) - 2) / 6.0
    np.testing.assert_allclose(found.probability["class 3"][3:8], share, rtol=1e-10)
    np.testing.assert_allclose(found.probability["class 2"][3:8], 1 - share, rtol=1e-10)


def test_distribution_of_arrivals():
    """Up or stay with p: the n-th success of a row of trials, a negative binomial law."""
    n, p = 5, 0.3
    cover = ls.grid([(0.0, n + 1.0)], cells=n + 1)
    chain = transfer(STAYS, cover, landing=Samples([0.0, 1.0], [1 - p, p]))
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
