"""Interval chains of scenes and maps: by hand, against throws from random places, closed forms; the text read back."""

import math
import re
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.feeder.scattering import Gaussian, Scattering, Uniform, thrown
from limitsets.proofs.chances.interval_chain import _throws
from limitsets.systems.maps import advance
from tests.closed_forms import ladder
from tests.maps_of_tests import logistic
from tests.proofs.test_noisy_maps import from_change, half, itself

NEAR = 1e-8  # of bounds that are exact but for roundings of the checker's balls


def low_piece(x):
    return 0.9 * x + 0.2


def high_piece(x):
    return 0.5 - x * x


def shares(y, e, lo, hi):
    """Length that [y - e, y + e] and [lo, hi] have in common, over 2e."""
    return np.clip((np.minimum(y + e, hi) - np.maximum(y - e, lo)) / (2.0 * e), 0.0, 1.0)


def dense(chain):
    return chain.lower.toarray(), chain.upper.toarray()


def read_drn(path):
    """Read DRN text by hand: labels by state, and by state the transitions with their two numbers."""
    head, _, body = path.read_text(encoding="utf-8").partition("@model\n")
    labels, rows = [], []
    for line in body.splitlines():
        if state := re.fullmatch(r"state (\d+)((?: \w+)*)", line):
            assert int(state[1]) == len(labels)
            labels.append(set(state[2].split()))
            rows.append({})
        elif move := re.fullmatch(r"\t\t(\d+) : \[(\S+), (\S+)\]", line):
            rows[-1][int(move[1])] = (float(move[2]), float(move[3]))
        else:
            assert re.fullmatch(r"\taction 0|//\[\d+, \S+, \S+\]", line)
    count = str(len(labels))
    assert re.search(rf"@nr_states\n{count}\n@nr_choices\n{count}\n", head)
    assert "@type: DTMC\n@value_type: double-interval\n" in head
    return labels, rows


def robust(chain, name, steps, most):
    """Extreme probability of having come to a label within so many steps: mass goes to the best states first."""
    low, high = dense(chain)
    v = np.zeros(chain.states)
    v[chain.labels[name]] = 1.0
    for _ in range(steps):
        order = np.argsort(-v if most else v, kind="stable")
        room, least = (high - low)[:, order], low[:, order]
        left = 1.0 - least.sum(axis=1, keepdims=True)
        before = np.cumsum(room, axis=1) - room
        v = (least + np.clip(left - before, 0.0, room)) @ v[order]
    return v


def bracket(chain, name, steps):
    (begin,) = chain.labels["init"]
    return tuple(robust(chain, name, steps, most)[begin] for most in (False, True))


@pytest.fixture(scope="module")
def designed():
    """Landing and speed deviate."""
    noise = Scattering(speed=Uniform(0.003), landing=Uniform(0.3))
    return ls.interval_chain("paper-designed", noise, right=(20.5, 2), wrong=20.5, cells=120)


@pytest.fixture(scope="module")
def walk():
    """Steps of half an interval or less, until the walk leaves it at the one end or the other."""
    places = {"low": [(0, -0.5, 0.0)], "high": [(0, 1.0, 1.5)]}
    line = ls.grid([(-0.5, 1.5)], cells=400)
    return ls.interval_chain(ls.map(itself), line, noise=0.5, absorbing=places, starts=[(0, 0.0, 0.5)])


@pytest.fixture(scope="module")
def two_pieces():
    own = ls.map(pieces=(low_piece, high_piece), margin=from_change)
    return ls.interval_chain(own, ls.grid([(-1.0, 1.0)], cells=90), noise=0.21)


# ---------------------------------------------------------------- by hand


def test_a_map_of_four_cells_by_hand():
    chain = ls.interval_chain(ls.map(half), ls.grid([(-1.0, 1.0)], cells=4), noise=0.5)
    assert chain.cells == ((0, -1.0, -0.5), (0, -0.5, 0.0), (0, 0.0, 0.5), (0, 0.5, 1.0), None)
    # from [0, 1/2] images y lie in [0, 1/4], from [1/2, 1] in [1/4, 1/2]; steps are even on [y - 1/2, y + 1/2]
    least, most = dense(chain)
    known = [[0.25, 0.5, 0, 0, 0], [0, 0.25, 0.5, 0, 0], [0, 0, 0.5, 0.25, 0]]
    np.testing.assert_allclose(least[[0, 2, 3]], known, atol=NEAR)
    known = [[0.5, 0.5, 0.25, 0, 0], [0, 0.5, 0.5, 0.25, 0], [0, 0.25, 0.5, 0.5, 0]]
    np.testing.assert_allclose(most[[0, 2, 3]], known, atol=NEAR)
    assert (least[4], most[4]) == (pytest.approx([0, 0, 0, 0, 1]), pytest.approx([0, 0, 0, 0, 1]))
    labels = {name: some.tolist() for name, some in chain.labels.items()}
    assert labels == {"init": [0, 1, 2, 3], "exits": [4]}


def test_a_cell_whose_images_meet_the_middle_of_a_target_is_bounded_by_the_largest_share():
    # images lie in [-1/2, 1/2], steps within 0.9 of these: all of them stay at y = 0, 14/18 at the ends
    chain = ls.interval_chain(ls.map(half), ls.grid([(-1.0, 1.0)], cells=1), noise=0.9)
    least, most = dense(chain)
    assert least[0] == pytest.approx([1.4 / 1.8, 0.0], abs=NEAR)
    assert most[0] == pytest.approx([1.0, 0.8 / 1.8], abs=NEAR)  # what leaves at either end is added up


def test_starts_are_shared_out_by_length():
    line, starts = ls.grid([(-1.0, 1.0)], cells=8), [(0, -0.8, -0.5), (0, 0.1, 0.6)]
    chain = ls.interval_chain(ls.map(half), line, noise=0.5, starts=starts)
    assert chain.labels["init"].tolist() == [0]
    # lengths 0.3 and 0.5 of 0.8: cells from -0.75, from 0.5, and so on
    share = np.array([0, 0.05, 0.25, 0, 0, 0.15, 0.25, 0.1, 0, 0]) / 0.8
    least, most = dense(chain)
    np.testing.assert_allclose(least[0], share, atol=1e-12)
    np.testing.assert_allclose(most[0], share, atol=1e-12)
    assert (least[0] <= share).all()


# ---------------------------------------------------------------- every point of a cell


@pytest.mark.parametrize("name", ["designed", "walk", "two_pieces"])
def test_each_row_admits_a_distribution(name, request):
    chain = request.getfixturevalue(name)
    assert (chain.lower.sum(axis=1) <= 1.0).all()
    assert (chain.upper.sum(axis=1) >= 1.0).all()
    least, most = dense(chain)
    assert ((least >= 0.0) & (least <= most) & (most <= 1.0)).all()
    places = [some[0] for label, some in chain.labels.items() if label != "init"]
    np.testing.assert_array_equal(least[places], np.eye(chain.states)[places])


def test_steps_of_a_map_from_random_places_lie_within_bounds(two_pieces):
    random, (least, most), e = np.random.default_rng(4), dense(two_pieces), 0.21
    lo, hi = np.array([cell[1:] for cell in two_pieces.cells if cell]).T
    for k in range(lo.size):
        x = random.uniform(lo[k], hi[k], 12)[:, None]
        y = np.where(x < 0.3, low_piece(x), high_piece(x))
        inside = shares(y, e, lo, hi)
        true = np.hstack([inside, 1.0 - inside.sum(axis=1, keepdims=True)])  # the last state are the exits
        assert (least[k] <= true + 1e-12).all()
        assert (true <= most[k] + 1e-12).all()


def test_throws_of_a_cell_are_wider_by_what_is_not_proved():
    """A cell by hand: deviations from -1 to 1 in four parts, the border at 0.25 and up to 0.4 off."""
    links = SimpleNamespace(
        start=10,
        deltas=np.array([-1.0, 1.0]),
        place=np.array([[0.0, 2.0], [1.0, 3.0]]),
        law=SimpleNamespace(most=0.5),
        noisy=SimpleNamespace(far=0.0),
        branch_of=lambda cell: SimpleNamespace(cut=(0.25, 0.25), gap=0.2, below=0, above=1),
        range_of=lambda flips, lo, hi: (2 * flips, lo - 7.0 * flips, hi - 7.0 * flips),
    )
    # all throws lie from -0.5 to 3.5: half more than those of the nodes
    rows = _throws(links, (10, 0.0, 0, -0.5, 3.5, 0, 0.0, 0.0), 0.1)
    jogs = [(10, 0.25, 0, 0.5 * k - 0.5, 0.5 * k + 2.0, k == 0, 0.1) for k in range(4)]
    flips = [(10, 0.25, 2, 0.5 * k - 7.5, 0.5 * k - 5.0, 0.0, 0.1) for k in (1, 2, 3)]
    np.testing.assert_allclose(rows, [*jogs, *flips], atol=1e-12)


def mean_shares(scene, side, x, speeds, e, bounds):
    """By place the shares of one throw from x in cells of all sides, over even deviations of the speed."""
    total, at = np.zeros((x.size, len(bounds))), thrown(scene.map)
    on, lo, hi = np.array(bounds).T
    for delta in speeds:
        y, turned, code, _ = advance(at(1.0 / (1.0 + delta) ** 2), x, side, 1)
        assert (code >= 0).all()
        total += (turned[:, None] == on) * shares(y[:, None], e, lo, hi)
    return total / len(speeds)


@pytest.fixture(scope="module")
def coarse():
    """Cells so wide, and speeds so different, that the border of the branches is far from its chord."""
    noise = Scattering(speed=Uniform(0.04), landing=Uniform(0.02))
    return ls.interval_chain("paper-designed", noise, right=(20.5, 2), wrong=20.5, cells=24)


@pytest.mark.parametrize(("name", "bound", "e"), [("designed", 0.003, 0.3), ("coarse", 0.04, 0.02)])
def test_throws_from_random_places_lie_within_bounds(name, bound, e, request):
    chain, scene = request.getfixturevalue(name), ls.load("paper-designed")
    random, count = np.random.default_rng(5), 2000
    least, most = dense(chain)
    own = [(k, cell) for k, cell in enumerate(chain.cells) if cell and cell[2] - cell[1] > 1e-3]
    own = [(k, cell) for k, cell in own if cell[1] > scene.sides.a[cell[0]] + 0.1]
    states = {label: int(some[0]) for label, some in chain.labels.items()}
    speeds = bound * (2.0 * (np.arange(count) + 0.5) / count - 1.0)
    # behind the cells: the places that absorb, then what lies off the arm
    bounds = [cell for _, cell in own] + [(side, 20.5, 28.0) for side in range(3)]
    # cells from which some throws jog and some flip, and random ones
    on = np.array([cell[0] if cell else -1 for cell in chain.cells])
    both = [
        k
        for k, (state, (side, *_)) in enumerate(own)
        if all(most[state, on == each].sum() > 0.05 for each in (side, (side + 1) % 3))
    ]
    assert len(both) >= 2
    assert min(least[own[k][0]].sum() for k in both) < 0.9  # which branch is open for some speeds
    for k in {*both, *random.choice(len(own), 15, replace=False).tolist()}:
        state, (side, lo, hi) = own[k]
        x = random.uniform(lo, hi, 8)
        true = mean_shares(scene, np.full(8, side), x, speeds, e, bounds)
        wrong, right = true[:, -3] + true[:, -2], true[:, -1]
        columns = [*(number for number, _ in own), states["wrong"], states["right"]]
        true = np.column_stack([true[:, :-3], wrong, right])
        near = 1.0 / count  # a sum of so many in place of the mean over the speed
        assert (least[state, columns] <= true + near).all()
        assert (true <= most[state, columns] + near).all()
        rest = 1.0 - true.sum(axis=1)  # the exits, and cells next to the joint
        assert (least[state, states["exits"]] <= rest + near).all()


def test_a_map_without_a_bound_leads_anywhere():
    """The image of a cell with the pole is not enclosed."""
    chain = ls.interval_chain(ls.map(inverted), ls.grid([(-1.0, 1.0)], cells=11), noise=0.25)
    least, most = dense(chain)
    assert (least[5] == 0.0).all()
    np.testing.assert_allclose(most[5, :-1], (2.0 / 11.0) / 0.5, atol=NEAR)
    assert most[5, -1] == 1.0


def inverted(x):
    return 0.5 / x


# ---------------------------------------------------------------- closed forms


def test_a_walk_leaves_at_the_upper_end_as_often_as_theory_says(walk):
    # h' (x) = h(x + 1/2) below 1/2, and h(1 - x) = 1 - h(x): h = 1 + A cos x + sin(x)/2, A = -cos(1/2)/(2 - 2 sin(1/2))
    exact = 2.0 - math.cos(0.5) / (1.0 - math.sin(0.5))
    least, most = bracket(walk, "high", 80)[0], 1.0 - bracket(walk, "low", 80)[0]
    assert least <= exact <= most < least + 0.02


def test_a_noisy_parabola_has_its_closed_form_at_every_step():
    # each step lands on [y - 1, y + 1], which has [0, 1] in it: P(above 1) = y/2, and P(stays) = 1/2, evenly
    places = {"low": [(0, -1.0, 0.0)], "high": [(0, 1.0, 2.0)]}
    line, starts = ls.grid([(-1.0, 2.0)], cells=300), [(0, 0.0, 1.0)]
    chain = ls.interval_chain(ls.map(logistic, r=4.0), line, noise=1.0, absorbing=places, starts=starts)
    for n in (1, 2, 5):
        least, most = bracket(chain, "high", n + 1)
        assert least <= float(Fraction(2, 3) * (1 - Fraction(1, 2**n))) <= most < least + 0.02


def test_a_ladder_of_jogs_lies_between_the_bounds_at_every_throw():
    scene = ls.load("paper-designed-small-angle")
    a, q = float(scene.sides.a[2]), 1.0 + 2.0 * abs(scene.map.surface_height) / scene.map.kappa
    exact = ladder((a, q), (15.0, 16.0), 0.05, 18.0, 7)
    noise, starts = Scattering(landing=Uniform(0.05)), [(2, 15.0, 16.0)]
    chain = ls.interval_chain(scene, noise, right=(18.0, 2), starts=starts, cells=600)
    for n in (3, 5, 7):
        least, most = bracket(chain, "right", n + 1)
        assert least - 1e-9 <= exact[n] <= most + 1e-9
    least, most = bracket(chain, "right", 6)
    assert least > 0.3
    assert most - least < 0.25


# ---------------------------------------------------------------- text, and what is refused


def test_the_text_read_back_is_the_chain(designed, tmp_path):
    path = designed.save(tmp_path / "designed.drn")
    labels, rows = read_drn(path)
    least, most = dense(designed)
    for k, row in enumerate(rows):
        assert sorted(row) == np.flatnonzero(most[k]).tolist()
        assert all((least[k, to], most[k, to]) == pair for to, pair in row.items())
        assert labels[k] == {name for name, some in designed.labels.items() if k in some}
    notes = re.findall(r"^//\[(\d+), (\S+), (\S+)\]$", path.read_text(encoding="utf-8"), re.M)
    assert [(int(s), float(lo), float(hi)) for s, lo, hi in notes] == list(filter(None, designed.cells))
    assert [each.name for each in tmp_path.iterdir()] == ["designed.drn"]


LINE = ls.grid([(-1.0, 1.0)], cells=8)
LANDING = Scattering(landing=Uniform(0.1))
HALF = ls.map(half)


@pytest.mark.parametrize(
    ("given", "words", "said"),
    [
        (("paper-designed", Scattering(landing=Gaussian(0.1))), {"right": (20.5, 2)}, "Uniform"),
        (("paper-designed", Scattering(speed=Uniform(0.01))), {"right": (20.5, 2)}, "Uniform"),
        (("paper-designed", LINE), {"right": (20.5, 2)}, "Scattering"),
        (("paper-designed", LANDING), {"right": (20.5, 2), "noise": 0.1}, "beside a scene"),
        (("paper-designed", LANDING), {}, "starts"),
        (("paper-designed", LANDING), {"right": (20.5, 2), "cells": 0}, "1 or more"),
        (("paper-designed", LANDING), {"right": (20.5, 2), "absorbing": {"a b": [(0, 5.0, 6.0)]}}, "labels"),
        (("paper-designed", LANDING), {"right": (20.5, 2), "starts": [(7, 5.0, 6.0)]}, "a start"),
        ((HALF, LINE), {}, "the noise"),
        ((HALF, LINE), {"noise": 0.1, "cells": 5}, "beside a map"),
        ((HALF, LANDING), {"noise": 0.1}, "the grid"),
        ((HALF, LINE), {"noise": 0.1, "absorbing": {"init": [(0, 0.0, 1.0)]}}, "labels"),
        ((HALF, LINE), {"noise": 0.1, "absorbing": {"far": [(0, 0.0, 1.5)]}}, "a place"),
        ((HALF, LINE), {"noise": 0.1, "starts": [(1, 0.0, 0.5)]}, "a place"),
        ((HALF, ls.grid([(0.0, 1.0)], cells=8, periodic=True)), {"noise": 0.1}, "closes"),
    ],
)
def test_what_does_not_fit_is_refused(given, words, said):
    with pytest.raises(AnswerError, match=said):
        ls.interval_chain(*given, **words)
