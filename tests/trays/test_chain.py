"""The chain of a depression against closed forms, with probabilities that are known."""

import numpy as np
import pytest

from limitsets.cell.trays.filling import Chain, chain_of, drawn_chains, filled
from limitsets.cell.trays.passing import Counts

EMPTY, RIGHT = 0, 1


def two_states(capture, release):
    return Chain(np.array([1.0 - capture, capture]), np.array([[1.0, 0.0], [release, 1.0 - release]]), RIGHT)


def counts_of(captured, kicked, right=1, names=("empty", "side 0", "side 1")):
    return Counts(tuple(names), right, np.array(captured), np.array(kicked), 0, {})


@pytest.mark.parametrize(("capture", "release"), [(0.3, 0.1), (0.05, 0.4), (0.9, 0.9)])
def test_two_states_fill_geometrically(capture, release):
    chain = two_states(capture, release)
    # a part that popped out may be replaced in the same pass
    lost = release * (1.0 - capture)
    last, ratio = capture / (capture + lost), 1.0 - capture - lost
    n = np.arange(31)
    assert chain.occupied(30)[:, RIGHT] == pytest.approx(last * (1.0 - ratio**n), abs=1e-12)
    assert chain.at_last() == pytest.approx([1.0 - last, last], abs=1e-12)
    assert [float(each) for each in chain.capture_and_release] == pytest.approx([capture, lost], abs=1e-12)


def test_a_wrong_part_that_no_kick_moves_takes_all_that_it_can():
    # capture rightly 0.2, wrongly 0.1; what is right never leaves: the shares of who came first
    kicked = np.eye(3)
    chain = Chain(np.array([0.7, 0.2, 0.1]), kicked, RIGHT)
    assert chain.at_last() == pytest.approx([0.0, 2 / 3, 1 / 3], abs=1e-9)
    # and where right ones leave, wrong ones have all in the end
    kicked = np.array([[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]])
    assert Chain(np.array([0.7, 0.2, 0.1]), kicked, RIGHT).at_last() == pytest.approx(
        [0.0, 0.0, 1.0], abs=1e-9
    )


def test_the_watched_chain_has_the_shares_of_the_whole_one():
    random = np.random.default_rng(8)
    for _ in range(20):
        kicked = random.dirichlet(np.ones(5), 5)
        kicked[EMPTY] = [1, 0, 0, 0, 0]
        chain = Chain(random.dirichlet(np.ones(5)), kicked, 3)
        # the left eigenvector of the whole chain, by numpy
        values, vectors = np.linalg.eig(chain.passed.T)
        still = np.real(vectors[:, np.argmin(abs(values - 1.0))])
        still /= still.sum()
        assert chain.at_last() == pytest.approx(still, abs=1e-9)
        capture, release = chain.capture_and_release
        assert release / (capture + release) == pytest.approx(still[0] / (still[0] + still[3]), abs=1e-9)


def test_a_pass_by_hand():
    # right: 0.1 to wrong, 0.2 out; wrong: 0.4 out, 0.1 to right; a part that comes: 0.5 nothing, 0.3 right, 0.2 wrong
    counts = counts_of([50, 30, 20], [[0, 0, 0], [20, 70, 10], [40, 10, 50]])
    step = chain_of(counts).passed
    expected = [[0.5, 0.3, 0.2], [0.1, 0.7 + 0.06, 0.1 + 0.04], [0.2, 0.1 + 0.12, 0.5 + 0.08]]
    assert step == pytest.approx(np.array(expected), abs=1e-12)


def test_intervals_cover_as_often_as_they_say():
    random = np.random.default_rng(2)
    captured, right, wrong = [0.6, 0.25, 0.15], [0.1, 0.85, 0.05], [0.3, 0.1, 0.6]
    truth = Chain(np.array(captured), np.array([[1.0, 0.0, 0.0], right, wrong]), RIGHT).occupied(12)[
        -1, RIGHT
    ]
    inside, repeats = 0, 300
    for _ in range(repeats):
        rows = [np.zeros(3, int), random.multinomial(100, right), random.multinomial(100, wrong)]
        counts = counts_of(random.multinomial(200, captured), rows)
        drawn = drawn_chains(counts, random, draws=200).occupied(12)[:, -1, RIGHT]
        low, high = np.quantile(drawn, [0.025, 0.975])
        inside += low <= truth <= high
    assert 0.90 <= inside / repeats <= 0.985


def test_each_drawn_row_has_its_counts_and_one_more_spread_evenly():
    """The mean of Dirichlet's law: (n_k + 1/3)/(n + 1) for three states."""
    counts = counts_of([4, 0, 2], [[0, 0, 0], [0, 3, 0], [1, 0, 1]])
    drawn = drawn_chains(counts, np.random.default_rng(1), draws=20_000)
    third = 1 / 3
    assert drawn.captured.mean(axis=0) == pytest.approx(np.array([4 + third, third, 2 + third]) / 7, abs=0.01)
    assert drawn.kicked[:, 1].mean(axis=0) == pytest.approx(np.array([third, 3 + third, third]) / 4, abs=0.01)
    assert (drawn.kicked[:, 0] == [1.0, 0.0, 0.0]).all()


def test_what_is_said_of_many_passes():
    counts = counts_of([60, 40, 0], [[0, 0, 0], [10, 90, 0], [0, 0, 0]])
    found = filled(counts, 200, np.random.default_rng(0))
    last = 0.4 / (0.4 + 0.1 * 0.6)
    assert found.states == ("empty", "side 0")
    assert found.right[0] == 0.0
    assert found.right[-1] == pytest.approx(last, abs=1e-12)
    assert found.unfilled == pytest.approx({"empty": 1.0 - last, "wrong": 0.0}, abs=1e-12)
    assert found.rest == pytest.approx(1.0 - last, abs=1e-12)
    assert found.rest_interval[0] < found.rest < found.rest_interval[1]
    assert np.all(found.interval[1:, 0] < found.right[1:])
    assert np.all(found.interval[1:, 1] > found.right[1:])
    # the first n after which no more than 5 % are missing
    assert found.passes_to(0.95) == int(np.ceil(np.log(0.05) / np.log(1.0 - 0.4 - 0.06)))
    assert found.stays[1] == pytest.approx(1.0 / 0.06)


def test_of_a_state_that_never_comes_no_share_is_filled():
    found = filled(counts_of([60, 0, 40], [[0, 0, 0], [10, 90, 0], [10, 0, 90]]), 5, np.random.default_rng(0))
    assert found.last[found.number] == 0.0
    assert found.passes_to(0.95) is None
