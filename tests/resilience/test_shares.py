"""Shares and shocks of basins, sampled and proved."""

import itertools
import json
import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.systems.cells import CellSet, Domain
from limitsets.systems.maps import images
from limitsets.systems.resilience import mixing as boxes
from limitsets.systems.sets.basin import longest_stays, passing
from tests.maps_of_tests import Contraction, Product, Tent, ThreeState, TwoState
from tests.resilience.maps_with_basins import Gaps, Stripes, Turnstile, Wall

# ----------------------------------------------------------------
# Entropies and shares of basins against closed forms, and the brackets of inner and outer basins.


LN2 = math.log(2.0)
CUBIC = ls.maps.Cubic(1.5)
TWO_SIDES = Domain([[-0.25], [-0.25]], [[2.0], [2.0]])


def setting(params, domain, cells, method=None):
    graph = ls.transitions(params, ls.grid(domain, cells=cells), method)
    return graph, ls.attractors(graph, throws=10)


def binary(p):
    return -sum(q * math.log(q) for q in (p, 1.0 - p) if q > 0.0)


# ---------------------------------------------------------------- entropies


def test_straight_boundaries_at_random_places_have_boundary_entropy_one_half():
    """Multiples of an irrational width fall evenly over the places in a box: the mean of the binary entropy is 1/2."""
    width = 0.005 * (3.0 + (math.sqrt(5.0) - 1.0) / 2.0)  # boxes are 0.005 wide
    found = ls.resilience.boundary_basin_entropy(*setting(Stripes(width), [(0.0, 3.0)], 60_000), box=100)
    assert found.boxes == pytest.approx(2.0 / width, abs=3)
    assert found.value == pytest.approx(0.5, abs=0.015)
    assert found.lo < 0.5 < found.hi


def test_two_basins_mixed_below_the_boxes_have_boundary_entropy_ln_2():
    width = 4.7 * 3.0 / 60_000  # below five cells; 100 cells make a box
    which = setting(Stripes(width), [(0.0, 3.0)], 60_000)
    cells = ls.resilience.boundary_basin_entropy(*which, box=100)
    assert 0.1 < cells.undecided < 0.2  # the cells on a boundary: too many for a best value
    assert math.isnan(cells.value)
    assert cells.lo < LN2 - 2e-3 < LN2 < cells.hi
    found = ls.resilience.boundary_basin_entropy(*which, box=100, starts=60_000)
    assert found.boxes == pytest.approx(400, abs=2)
    assert found.value == pytest.approx(LN2, abs=4e-3)
    assert found.lo < LN2 - 1e-3 < found.hi


def exact_entropies(boundaries, colours, edges):
    """Entropies of boxes in one dimension from the places where the basin changes, and the share that they cover."""
    values = []
    for lo, hi in itertools.pairwise(edges):
        cuts = [lo, *(b for b in boundaries if lo < b < hi), hi]
        shares = {}
        for a, b in itertools.pairwise(cuts):
            colour = colours[np.searchsorted(boundaries, 0.5 * (a + b))]
            shares[colour] = shares.get(colour, 0.0) + (b - a) / (hi - lo)
        values.append(-sum(p * math.log(p) for p in shares.values()))
    return np.array(values)


@pytest.mark.parametrize(("lo", "hi"), [(-1.5, 1.5), (-1.45, 1.37)])
def test_proved_brackets_of_entropies_hold_the_exact_ones(lo, hi):
    """u' = 1.5 u - u^3 changes its basin at 0 and +-sqrt(1.5)."""
    graph, attractors = setting(CUBIC, [(lo, hi)], 3000, "boxes")
    edges = graph.grid.edges[0][0][np.arange(151) * 20]
    values = exact_entropies([-(1.5**0.5), 0.0, 1.5**0.5], [1, 0, 1, 0], edges)
    whole = ls.resilience.basin_entropy(graph, attractors, box=20)
    border = ls.resilience.boundary_basin_entropy(graph, attractors, box=20)
    assert whole.how == border.how == "proved"
    assert whole.lo <= values.mean() <= whole.hi
    assert border.lo <= values[values > 0.0].mean() <= border.hi
    assert whole.hi - whole.lo < 0.02
    assert lo > -1.5 or border.hi > LN2  # an orbit may stay at 0, in no basin


def test_the_bracket_is_that_of_all_allotments():
    """Against trying them all, in steps of 1/60."""
    rng = np.random.default_rng(3)
    parts = np.array([p for p in itertools.product(range(61), repeat=3) if sum(p) == 60]).T / 60.0
    for _ in range(40):
        mass, rest = rng.random(3) * (rng.random(3) < 0.7), rng.random() + 0.05
        may = rng.random(3) < 0.7
        may[rng.integers(3)] = True
        tried = boxes.entropy_of(mass[:, None] + rest * parts[:, (parts[~may] == 0.0).all(axis=0)])
        column = mass[:, None], may[:, None], np.array([rest])
        assert boxes.least_entropy(*column)[0] == pytest.approx(tried.min(), abs=1e-12)
        assert boxes.largest_entropy(*column)[0] == pytest.approx(tried.max(), abs=2e-3)
        assert boxes.largest_entropy(*column)[0] >= tried.max() - 1e-12


def test_one_basin_has_no_entropy_and_no_boundary():
    scene = ls.load("paper-designed")
    graph, attractors = setting(scene.map, scene.domain, 1024)
    assert ls.resilience.basin_entropy(graph, attractors).value == 0.0
    border = ls.resilience.boundary_basin_entropy(graph, attractors)
    assert border.boxes == 0
    assert math.isnan(border.value)
    assert border.to_json()["value"] is None


# ---------------------------------------------------------------- shares


@pytest.mark.parametrize("method", [None, "boxes"])
def test_shares_of_the_cubic_map(method):
    """On [-1, 1.1] the basin of +sqrt(1/2) is (0, 1.1]."""
    graph, attractors = setting(CUBIC, [(-1.0, 1.1)], 1500, method)
    found = ls.resilience.basin_stability(graph, attractors)
    assert found.how == ("proved" if method else "cells")
    for share, exact in zip(found.attractors, (1.0 / 2.1, 1.1 / 2.1), strict=True):
        assert share.lo <= exact <= share.hi < share.lo + 0.006
        assert share.share == pytest.approx(exact, abs=2e-3)
    assert found.inner[0] <= found.outer[0]
    assert not (found.inner[0] & found.outer[1]).mask.any()


def test_a_basin_of_the_only_cell_is_every_start():
    """x' = x/2 keeps [-1, 1]."""
    found = ls.resilience.basin_stability(*setting(Contraction(0.5, 0.0), [(-1.0, 1.0)], 1, "boxes"))
    (share,) = found.attractors
    assert (found.how, share.lo, share.hi) == ("proved", 1.0, 1.0)


def test_sampled_shares_lie_in_their_intervals():
    graph, attractors = setting(CUBIC, [(-1.0, 1.1)], 1500)
    inside = 0
    for seed in range(40):
        found = ls.resilience.basin_stability(graph, attractors, starts=400, seed=seed)
        assert found.how == "sampled"
        inside += found.attractors[1].lo <= 1.1 / 2.1 <= found.attractors[1].hi
    assert inside >= 34  # 38 expected; fewer than 34 of 40 in 1 of 100 runs
    late = ls.resilience.basin_stability(graph, attractors, starts=400, steps=1)
    assert late.undecided > 0.1
    assert math.isnan(late.attractors[1].share)
    assert late.attractors[1].hi - late.attractors[1].lo > late.undecided


def test_every_start_leaves_an_open_map_but_for_a_cantor_set():
    """The tent of slope 3: what stays lies in 2^k intervals of length 3^-k, a share of (2/3)^k."""
    graph, attractors = setting(Tent(3.0), [(0.0, 1.0)], 3**8, "boxes")
    found = ls.resilience.basin_stability(graph, attractors)
    assert attractors == ()
    assert found.exits["outside"].hi == 1.0
    assert found.undecided >= (2.0 / 3.0) ** 8
    assert 1.0 - 3.0 * (2.0 / 3.0) ** 8 < found.exits["outside"].lo < 1.0 - (2.0 / 3.0) ** 8
    assert found.exits["undefined"].hi == 0.0


def test_cells_that_come_back_and_leave_may_do_either():
    """Of three cells all are recurrent, and the middle one leaves as well."""
    found = ls.resilience.basin_stability(*setting(Tent(3.0), [(0.0, 1.0)], 3, "boxes"))
    assert (found.exits["outside"].lo, found.exits["outside"].hi) == (0.0, 1.0)


def test_exits_share_the_starts_of_an_open_map():
    graph, attractors = setting(Gaps(3.0, 0.0), [(0.0, 1.0)], 20_011)
    for starts in (None, 4000):
        found = ls.resilience.basin_stability(graph, attractors, starts=starts)
        for name in ("first", "second", "third"):
            assert found.exits[name].lo <= 1.0 / 3.0 <= found.exits[name].hi
            # more than a tenth of the cells is undecided: there is no best value
            best = 1.0 / 3.0 if found.undecided <= 0.1 else math.nan
            assert found.exits[name].share == pytest.approx(best, abs=0.02, nan_ok=True)


def test_orbits_leave_the_domain_by_the_exit_of_its_cells():
    """On [0, 0.7] an image beyond 0.7 leaves by the upper exit of the cells, the second; an orbit goes on.

    Orbits: 0.2 leaves by the first gap, 0.1 by the second, and half of each of the branches, 3.5/5 of a whole one, by
    either: (0.2 + 0.2) / 0.7 and (0.1 + 0.2) / 0.7, since branches cover 0.4 of [0, 0.7].
    """
    graph, attractors = setting(Gaps(2.0, 0.0), [(0.0, 0.7)], 20_011)
    cells = ls.resilience.basin_stability(graph, attractors)
    orbits = ls.resilience.basin_stability(graph, attractors, starts=4000)
    assert cells.exits["first"].hi < cells.exits["second"].lo
    assert cells.cut
    for name, share in (("first", 4.0 / 7.0), ("second", 3.0 / 7.0)):
        assert orbits.exits[name].lo <= share <= orbits.exits[name].hi


def test_an_outer_basin_leaves_out_what_lies_between_others():
    """Next to +1 only the middle and the upper basin meet: it is no outer cell of the lower one."""
    graph, attractors = setting(ThreeState(), [(-3.0, 3.0)], 600, "boxes")
    found = ls.resilience.basin_stability(graph, attractors)
    lower = min(range(3), key=lambda k: attractors[k].extents[0][0])
    ((_, end),) = found.outer[lower].extents()[0]
    assert -1.0 <= end < -0.97
    others = [k for k in range(3) if k != lower]
    assert found.outer[lower] != ~(found.inner[others[0]] | found.inner[others[1]])
    assert found.outer[lower] <= ~(found.inner[others[0]] | found.inner[others[1]])


@pytest.mark.parametrize("method", [None, "boxes"])
def test_shares_on_two_sides(method):
    """x' = x^2 turns over for x > 1/2: 2^(-2^-k) are the boundaries below 1, where the sides change places."""
    graph, attractors = setting(Turnstile(2.0), TWO_SIDES, 20_000, method)
    found = ls.resilience.basin_stability(graph, attractors)
    assert len(attractors) == 2
    for share in found.attractors:
        assert share.lo <= 1.25 / 4.5 <= share.hi < share.lo + 0.01  # of both sides: half of what is below 1
    assert found.exits["outside"].lo <= 2.0 / 4.5 <= found.exits["outside"].hi
    own = attractors[0].cells.extents().popitem()[0]
    borders = [2.0 ** -(2.0**-k) for k in range(8)]
    inner = found.inner[0].extents()
    for k, (lo, hi) in enumerate(itertools.pairwise([-0.25, *borders])):
        mine = inner[own if k % 2 == 0 else 1 - own]
        assert any(a <= lo + 1e-3 and hi - 1e-3 <= b for a, b in mine)


def test_shares_and_entropy_in_space():
    graph, attractors = setting(Wall(0.3), [(-1.0, 1.0)] * 3, 40)
    found = ls.resilience.basin_stability(graph, attractors)
    assert found.attractors[0].lo <= 0.65 <= found.attractors[0].hi
    border = ls.resilience.boundary_basin_entropy(graph, attractors, box=20)
    assert border.boxes == 4
    # the undecided cells lead to one of the two at once: nothing stays elsewhere
    assert border.hi <= LN2 + 1e-9
    assert border.value == pytest.approx(binary(0.3), abs=0.05)


# ---------------------------------------------------------------- calls


def test_answers_are_json():
    graph, attractors = setting(CUBIC, [(-2.0, 2.0)], 400, "boxes")
    room = ls.resilience
    answers = [
        room.basin_entropy(graph, attractors),
        room.boundary_basin_entropy(graph, attractors),
        room.basin_stability(graph, attractors),
        room.uncertainty_exponent(graph, attractors),
        room.wada(graph, attractors, boxes=10),
        room.minimal_fatal_shock(graph, attractors, 0.7),
        room.convergence_times(graph, attractors, starts=50),
    ]
    for answer in answers:
        table = json.loads(json.dumps(answer.to_json(), allow_nan=False))
        assert table["how"].split(",")[0] in ("proved", "cells", "sampled")


def test_wrong_calls_name_the_remedy():
    graph, attractors = setting(CUBIC, [(-1.2, 1.2)], 101)
    other = setting(CUBIC, [(-1.2, 1.2)], 101)[1]
    room = ls.resilience
    for call in (
        lambda: room.basin_entropy(graph, other),
        lambda: room.basin_entropy(graph, attractors, box=1),
        lambda: room.boundary_basin_entropy(graph, attractors, box=102),
        lambda: room.basin_stability(graph, attractors, starts=0),
        lambda: room.basin_stability(graph, attractors, starts=10, steps=0),
        lambda: room.convergence_times(graph, attractors, starts=0),
        lambda: room.wada(graph, attractors, boxes=0),
        lambda: room.minimal_fatal_shock(graph, attractors, 5.0),
        lambda: room.minimal_fatal_shock(graph, attractors, 0.5, side=1),
        lambda: room.minimal_fatal_shock(graph, attractors, (0.5, 0.5)),
        lambda: room.minimal_fatal_shock(graph, attractors, 0.0),  # undecided
        lambda: room.uncertainty_exponent(*setting(CUBIC, [(-1.2, 1.2)], 39)),
    ):
        with pytest.raises(AnswerError, match="allowed"):
            call()


# ----------------------------------------------------------------
# Inner and outer basins of enclosed images: against orbits, and what refining a recurrent set proves.


SQUARE = [(-2.0, 2.0), (-2.0, 2.0)]


def ends(params, grid, attractors, starts, steps):
    """Number of the attractor whose cells each orbit of one side is in at the end; -1 none; -2 once it has left."""
    x, end = starts.copy(), np.full(len(starts), -1)
    going = np.arange(len(starts))
    for _ in range(steps):
        there = images(params, x[going] if grid.dimension > 1 else x[going, 0], 0)
        x[going] = there.x.reshape(going.size, -1)
        out = (there.code < 0) | (grid.index(x[going], 0) < 0)
        end[going[out]] = -2
        going = going[~out]
    for number, attractor in enumerate(attractors):
        end[going[attractor.cells.holds(x[going], 0)]] = number
    return end


@pytest.mark.parametrize(
    ("params", "domain", "cells", "least"),
    [
        (ls.maps.Cubic(1.8), [(-1.7, 1.7)], 2000, 0.95),
        (ls.maps.Cubic(2.4), [(-1.7, 1.7)], 2000, 0.4),
        (ls.maps.Logistic(2.9), [(-0.2, 1.2)], 2000, 0.95),
        (Contraction(0.9, 0.0), [(-1.0, 1.0)], 1001, 1.0),
        pytest.param(Product(), [(0.0, 1.2), (0.0, 1.2)], 64, 0.5, marks=pytest.mark.repeats),
        (TwoState(1.0), SQUARE, 64, 0.9),
    ],
    ids=str,
)
def test_no_orbit_contradicts_inner_or_outer_basins(params, domain, cells, least):
    graph, attractors = setting(params, domain, cells, "boxes")
    found = ls.resilience.basin_stability(graph, attractors)
    grid, rng = graph.grid, np.random.default_rng(4)
    numbers = rng.choice(grid.n_cells, 4000)
    lo, hi = grid.boxes(numbers, 0)
    end = ends(params, grid, attractors, lo + rng.random(lo.shape) * (hi - lo), 400)
    for number in range(len(attractors)):
        assert found.outer[number].mask[numbers[end == number]].all()
        assert (end[found.inner[number].mask[numbers]] == number).all()
    left = CellSet(grid, found.inner[len(attractors)].mask | found.inner[len(attractors) + 1].mask)
    assert (end[left.mask[numbers]] == -2).all()
    assert sum(share.lo for share in found.attractors) + found.exits["outside"].lo >= least


def test_recurrent_cells_beside_a_fixed_point_are_proved_to_be_passed_through():
    """At slope 0.9 the cells next to the fixed point's meet their own images; orbits leave them nevertheless."""
    graph, attractors = setting(Contraction(0.9, 0.0), [(-1.0, 1.0)], 1001, "boxes")
    sets = graph.recurrent_components()
    through = passing(graph)
    assert len(attractors) == 1
    assert len(sets) > 10
    assert through.sum() == len(sets) - 1
    # k cells from the fixed point an orbit stays for ln((k + 1/2) / (k - 1/2)) / ln(1/0.9) steps, rounded up
    stays = longest_stays(graph)
    for cells, stay in zip(sets, stays, strict=True):
        k = abs(int(cells[0]) - 500)
        if k:
            bound = np.log((k + 0.5) / (k - 0.5)) / np.log(1.0 / 0.9)
            assert bound < stay <= bound + 2.5
        else:
            assert stay == 0
    found = ls.resilience.basin_stability(graph, attractors)
    assert (found.attractors[0].lo, found.undecided) == (1.0, 0.0)


@pytest.mark.parametrize("method", ["corners", "boxes"])
@pytest.mark.parametrize("share", [0.4, 0.2, 1 / 40, 1 / 100])
def test_a_shift_passes_through_every_cell_that_it_moves_by_a_fine_one(method, share):
    """x' = x + c meets its own cell of width w while c < w, and not its own 64th part where c > w / 64."""
    cover = ls.grid([(0.0, 1.0)], cells=100)
    graph = ls.transitions(Contraction(1.0, 0.01 * share), cover, method)
    assert len(graph.recurrent_components()) == 100
    assert passing(graph).all() == (share > 1 / 64)
    if share > 1 / 64:
        # an image begins in the fine cell so many further on, and the slowest path goes on from there
        assert (longest_stays(graph) == np.ceil(64 / np.floor(64 * share))).all()
    else:
        assert not longest_stays(graph).any()
    expected = 0.0 if share > 1 / 64 else 1.0
    assert ls.basins(graph, ls.attractors(graph)).undecided_between == pytest.approx(expected)


@pytest.mark.sweep
def test_what_is_passed_through_is_so_for_every_parameter():
    """For slopes from 0.5 to 1.2 no orbit need leave the cells beside 0, for the lower corner alone all do."""
    lower, upper = Contraction(0.5, 0.0), Contraction(1.2, 0.0)
    cover = ls.grid([(-1.0, 1.0)], cells=101)
    both = ls.transitions(lower, cover, "boxes", upper=upper)
    assert not passing(both).any()
    assert passing(ls.transitions(lower, cover, "boxes")).any()
    found = ls.resilience.basin_stability(both, ls.attractors(both, throws=10))
    assert found.undecided > 0.5
