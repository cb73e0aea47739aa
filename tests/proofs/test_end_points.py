"""End points of a limit set, orbits that are proved, and the starts."""

import dataclasses
import math
from functools import cache
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from scipy.optimize import brentq

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.proofs.prover import cover as covers, goals
from limitsets.proofs.prover.attraction import attraction, trapping
from limitsets.proofs.prover.certifying import certify
from limitsets.proofs.prover.cover import Cover, cover
from limitsets.proofs.prover.end_points import proved_ends
from limitsets.proofs.prover.orbits import proved_cycle, proved_cycles
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.proofs.prover.proof import Claim
from limitsets.proofs.prover.query import weakest_of
from limitsets.systems.cells import Domain, grid
from limitsets.systems.graph.images.enclosed import enclosures
from limitsets.systems.sets import cycles_of
from limitsets.systems.sets.end_points import limit_set_of
from tests.proofs.test_goals import scene_with
from tests.scene.four_gon import FOUR_GON
from tests.sets.part import Part
from tests.test_paper import LIMIT_SETS

# ----------------------------------------------------------------
# Proved end points of limit sets: against 40-digit orbits, long orbits, and maps that contract.


# Sides and places of the critical points that the limit set approaches.
KEPT = {
    "paper-initial-small-angle": [(0, 20), (1, 20), (2, 20)],
    "paper-designed-small-angle": [(1, 10), (2, 20)],
    "paper-initial": [(0, 20), (2, 20)],
    "paper-designed": [(2, 20)],
}
NAMES = ("jog", "flip")

# Attracting fixed points, and an attracting orbit of three flips.
CONTRACTING = {"throw.kappa": "12.21 in", "arm.surface_height": "-1.73 in"}


@cache
def cells_of(name, noise=None, cells=2048):
    scene = ls.load(name)
    return attraction(cover(parameter_box(scene, noise={"throw.speed": noise} if noise else None), cells))


@cache
def ends_of(name, noise=None):
    return proved_ends(cells_of(name, noise))


def between(end, x):
    lo, hi = sorted((end.outer, end.inner))
    return lo <= x <= hi


@pytest.mark.parametrize("name", LIMIT_SETS)
def test_the_brackets_hold_the_ends_at_40_digits(name):
    """As many as the table has, whose numbers are those of the same orbits (tests/test_paper.py)."""
    found, part = ends_of(name), Part(name)
    assert found.reason == ""
    assert found.width < (1e-12 if "small" in name else 2e-11)
    assert {side: len(parts) for side, parts in found.extents.items()} == {
        side: len(parts) for side, parts in LIMIT_SETS[name].items()
    }
    assert all(a < b < c < d for parts in found.extents.values() for (a, b), (c, d) in parts)
    scene = ls.load(name)
    near = {side: [(lo - 0.05, hi + 0.05) for lo, hi in parts] for side, parts in LIMIT_SETS[name].items()}
    orbits = [end.origin for end in limit_set_of(scene.map, near, scene.domain).ends]
    assert {(origin.side, round(origin.x)) for origin in orbits} <= set(KEPT[name])
    for end, origin in zip(found.ends, orbits, strict=True):
        x, side = part.critical_point(origin.side, origin.x), origin.side
        for branch in origin.branches:
            x, side = part.throw(x, side, branch)
        assert side == end.side
        assert between(end, x)


@pytest.mark.parametrize("name", LIMIT_SETS)
def test_a_long_orbit_stays_inside_and_comes_near_the_ends(name):
    scene, found = ls.load(name), ends_of(name)
    path = ls.orbit(scene.map, 15.0, 2, 200_000)
    x, side = path.x[5000:], path.side[5000:]
    for s, parts in found.extents.items():
        mine, held = np.sort(x[side == s]), 0
        for (lo, _), (_, hi) in parts:
            here = mine[(mine >= lo) & (mine <= hi)]
            held += here.size
            assert here[0] - lo < 2e-3
            assert hi - here[-1] < 2e-3
            assert np.diff(here).max() < 2e-2
        assert held == mine.size


def test_nothing_is_claimed_to_be_inside_where_the_map_contracts():
    scene = ls.load("paper-designed").with_values(CONTRACTING)
    found = proved_ends(attraction(cover(parameter_box(scene), 2048)))
    assert "see periodic orbits" in found.reason
    assert found.width == np.inf
    assert all(end.inner is None for end in found.ends)
    assert all(hi - lo < 1e-9 for parts in found.extents.values() for (lo, _), (_, hi) in parts)


# ---------------------------------------------------------------- trapping


@pytest.mark.parametrize("name", LIMIT_SETS)
def test_the_attracting_cells_are_trapping(name):
    assert trapping(cells_of(name)) == ""


@pytest.mark.parametrize("which", [0, -1])
def test_cells_without_the_first_or_last_are_not_trapping(which):
    found = cells_of("paper-designed")
    component, first = found.component.copy(), found.cover.grid.offset[2]
    for _ in range(40):  # the cells exceed the limit set by some
        component[first + np.flatnonzero(component[first:] >= 0)[which]] = -1
    fewer = dataclasses.replace(found, component=component)
    assert trapping(fewer).startswith("not interior to the component is the image of side")


def test_an_image_that_ends_on_the_border_is_not_interior():
    found = cells_of("paper-designed")
    (lo, _), *_ = [pair for (to, _), pair in found.cover.images[1].hulls.items() if to == 2]
    least = np.flatnonzero(found.component[found.cover.grid.of_side(1)] >= 0)[0]
    edges = found.cover.grid.edges[2][0]
    bottom = edges[np.flatnonzero(found.component[found.cover.grid.of_side(2)] >= 0)[0]]
    before = lo[least]
    try:
        lo[least] = np.nextafter(bottom, np.inf)
        assert trapping(found) == ""
        lo[least] = bottom
        assert "side 1" in trapping(found)
    finally:
        lo[least] = before


# ---------------------------------------------------------------- as claims


def test_a_tolerance_of_end_points_and_noise_of_cycles_are_refused():
    with pytest.raises(AnswerError, match="without a tolerance"):
        certify("paper-designed", ["end-points"], tolerance={"throw.kappa": "0.1 %"})
    with pytest.raises(AnswerError, match="without noise"):
        certify("paper-designed", ["cycles"], noise={"throw.speed": "0.1 %"})


# ----------------------------------------------------------------
# Proved periodic orbits: against orbits at 40 digits, and multipliers on paper; forged ones: test_recheck_sets.py.


@cache
def cycles(name, up_to):
    return proved_cycles(cells_of(name), up_to)


@pytest.mark.parametrize("name", ["paper-designed", "paper-initial"])
def test_every_orbit_found_is_proved_and_repels(name):
    found = cycles(name, 16)
    proposed = cycles_of(ls.load(name).map, cells_of(name).cells.extents(), ls.load(name).domain, 16)
    assert found.missing == ()
    assert [cycle.period for cycle in found.cycles] == [cycle.period for cycle in proposed]
    for cycle, other in zip(found.cycles, proposed, strict=True):
        assert not cycle.attracts
        assert cycle.multiplier[0] > 1.0
        assert cycle.multiplier[0] - 1e-9 < other.multiplier < cycle.multiplier[1] + 1e-9
        assert cycle.multiplier[1] - cycle.multiplier[0] < 1e-8
        assert ((cycle.lo < other.x) & (other.x < cycle.hi)).all()


def test_the_orbits_at_40_digits():
    part = Part("paper-designed")
    for cycle in cycles("paper-designed", 16).cycles[:4]:

        def around(x, cycle=cycle):
            side = int(cycle.side[0])
            points = [x]
            for branch in cycle.branches:
                x, side = part.throw(x, side, NAMES[branch])
                points.append(x)
            return points

        x = mpmath.mp.findroot(lambda x: around(x)[-1] - x, float(cycle.lo[0]), tol=1e-20)
        for lo, hi, point in zip(cycle.lo, cycle.hi, around(x)[:-1], strict=True):
            assert lo < point < hi


def test_an_orbit_of_period_13_that_stays_low():
    # "every orbit reaches X" is false for X above it
    highest = [cycle.hi.max() for cycle in cycles("paper-designed", 16).cycles if cycle.period == 13]
    assert 20.102 < min(highest) < 20.103


@pytest.mark.parametrize(
    ("name", "h", "kappa", "period"),
    [("paper-designed-small-angle", 1.0, 48.6228609, 54), ("paper-initial-small-angle", 1.0, 85.2549144, 48)],
)
def test_small_angle_multipliers_are_powers_of_one_slope(name, h, kappa, period):
    found = proved_cycles(cells_of(name))  # the largest period is chosen
    assert found.up_to == 64
    assert found.cycles[0].period == period
    for cycle in found.cycles:
        expected = math.exp(cycle.period * math.log1p(2.0 * h / kappa))
        assert cycle.multiplier[0] - 1e-12 < expected < cycle.multiplier[1] + 1e-12
        assert not cycle.attracts


def test_orbits_that_attract():
    scene = ls.load("paper-designed").with_values(CONTRACTING)
    found = proved_cycles(attraction(cover(parameter_box(scene), 2048)), 6)
    assert found.missing == ()
    assert [(cycle.period, cycle.attracts) for cycle in found.cycles] == [(1, True), (3, True)]
    assert found.cycles[1].branches.tolist() == [1, 1, 1]
    path = ls.orbit(scene.map, float(found.cycles[1].lo[0]) + 0.1, 0, 300)
    assert np.abs(path.x[-3:] - np.roll(found.cycles[1].lo, -int(path.side[-3]))).max() < 1e-9


def test_what_is_no_orbit_is_not_proved():
    """Run twice; beside it; and two flips, eleven jogs, a flip, from whose fixed point the part jogs once more."""
    scene, box = ls.load("paper-designed"), cells_of("paper-designed").cover.box
    one = cycles_of(scene.map, cells_of("paper-designed").cells.extents(), scene.domain, 7)[0]
    word = np.array([1, 1, *[0] * 11, 1])
    fixed = brentq(lambda x: float(ls.maps.along(scene.map, [x], 0, word)[0][0]) - x, 6.0, 26.0, xtol=1e-13)
    nowhere = {"x": np.full(14, fixed), "side": np.zeros(14, np.int64), "branches": word}
    twice = {name: np.tile(getattr(one, name), 2) for name in ("x", "side", "branches")}
    for change, words in (
        (twice, "its period may be smaller"),
        ({"x": one.x + 1e-3}, "opposite signs"),
        (nowhere, "a decision along it is not proved"),
    ):
        assert words in proved_cycle(box, dataclasses.replace(one, **change))


# ----------------------------------------------------------------
# For which starts a goal is proved: the proved basin, and what is left out of it.
# Truths come from the formulas of docs/model.md, solved here with scipy, and from orbits.


def attraction_of(scene, cells, **noise):
    return attraction(cover(parameter_box(scene, **noise), cells, {}))


def test_a_fixed_point_that_attracts_and_never_meets_the_goal_is_seen():
    """At x = 274.729 mm on side 3 a jog falls back where it began, with slope 0.519: 2 % of the starts go there."""
    scene = ls.load(FOUR_GON)
    path = ls.orbit(scene.map, 274.8, 3, 200)
    assert path.x[-1] == pytest.approx(274.729, abs=1e-3)
    for cells in (256, 1024, 4096):
        found = attraction_of(scene, cells)
        (there,) = found.cover.grid.index([274.729], 3)
        # either the cell around it attracts, and the goal fails in it; or nothing is claimed of its starts
        assert found.component[there] >= 0 or found.basin.rank[there] == -1
        assert goals.prove(found, scene, scene.goal).verdict != "proved"
    proof = ls.certify(scene, ["goal"])
    assert proof.claims[0].verdict == "refuted"
    assert proof.claims[0].starts == "almost-every"


def test_a_limit_set_that_leaks_is_not_proved_for_almost_every_start():
    """paper-designed at 177.7 deg/s, h = -0.13 in, 300 uniform cells a side: the largest recurrent set may leak."""
    scene = ls.load("paper-designed").with_values(
        {"throw.speed": "177.7 deg/s", "arm.surface_height": "-0.13 in"}
    )
    box = parameter_box(scene)
    lo = box.hi.a + 1e-6 * (box.hi.arm_length - box.hi.a)
    ends = np.full(3, box.hi.arm_length)
    cells = grid(Domain(lo[:, None], ends[:, None], None), cells=300)
    assert np.ptp(np.diff(cells.edges[0][0])) < 1e-9  # uniform
    images = tuple(
        covers._widened(enclosures(box.lo, box.hi, edges, side), edges, 0.0)
        for side, (edges,) in enumerate(cells.edges)
    )
    found = attraction(Cover(box, cells, images, covers._graph(box, cells, images), ()))
    assert max(len(each) for each in found.cover.graph.recurrent_components()) > 100
    assert found.basin.starts == "cells"
    assert found.basin.leaves + found.basin.open > 0.15  # 17 % of 1000 starts do not stay on the arm
    assert goals.prove_or_refute(found, scene, scene.goal).verdict != "proved"


def displacement(a, d, h, kappa):
    """D(x) of a jog, from the impact equation solved by bisection."""

    def of(x):
        def height(phi):
            return x * phi - a * math.sin(phi) + d * (1 - math.cos(phi)) - 0.5 * kappa * phi**2

        least = (x - a) / kappa
        phi = brentq(height, least, 2 * (x + a + 2 * d) / kappa + 1, xtol=1e-15)
        return -h * phi + a * (1 - math.cos(phi)) - d * (phi - math.sin(phi))

    return of


@pytest.mark.parametrize("speed", [None, "0.1 %"])
def test_scattered_landings_are_overcome_from_where_a_jog_is_longer_than_they_scatter(speed):
    scene = ls.load("paper-designed")
    noise = {"landing.x": "0.02 in"} | ({"throw.speed": speed} if speed else {})
    (claim,) = ls.certify(scene, ["goal"], noise=noise).claims
    assert claim.verdict == "proved"
    kappa = scene.kappa * (1.0 if speed is None else 1.0 / (1.0 - 0.001) ** 2)  # a slow throw jogs least
    below = 0.0
    for side, (a, d) in enumerate(zip(scene.sides.a, scene.sides.d, strict=True)):
        jog = displacement(a, d, scene.surface_height, kappa)
        x = brentq(lambda x, jog=jog: jog(x) - 0.02, a + 1e-3, a + 3.0)
        start = claim.starts["from"][str(side)]
        lost = float.fromhex(claim.section["lost"][str(side)])
        assert lost <= x <= start  # whatever lies below is lost by the worst landings, all beyond is not
        assert start - lost < 0.04 * (x - a)
        below += start - a
    total = float((scene.arm_length - scene.sides.a).sum())
    assert claim.shares["share"] == pytest.approx(1.0 - below / total, abs=1e-6)
    assert sum(claim.shares.values()) == pytest.approx(1.0)


def test_landings_that_scatter_more_leave_starts_in_the_middle_open():
    (claim,) = ls.certify("paper-designed", ["goal"], noise={"landing.x": "0.1 in"}).claims
    assert (claim.verdict, claim.starts) == ("proved-on-cells", "cells")
    assert claim.shares["open"] > 0.01
    # 2.92, 2.83 and 2.15 from the foot: there a jog is as long as the scatter (the formulas, solved by hand)
    lost = [2.92, 2.83, 2.15]
    scene = ls.load("paper-designed")
    share = sum(lost) / float((scene.arm_length - scene.sides.a).sum())
    assert claim.shares["leaves"] == pytest.approx(share, rel=0.02)


def test_starts_that_creep_to_the_joint_are_told_apart():
    """With h = 0.1 in starts below 3.16, 3.19 and 4.81 in creep (docs/model.md, "The sign of h")."""
    scene = scene_with({"oriented_beyond": {"x": "20 in", "side": 2}}, arm={"surface_height": "0.1 in"})
    (claim,) = ls.certify(scene, ["goal"]).claims
    assert claim.verdict == "proved"
    given = [claim.starts["from"][str(side)] for side in range(3)]
    assert given == pytest.approx([3.16, 3.19, 4.81], abs=0.006)
    creep = sum(x - a for x, a in zip(given, scene.sides.a, strict=True))
    total = float((scene.arm_length - scene.sides.a).sum())
    assert claim.shares["creeps"] == pytest.approx(creep / total, rel=1e-6)
    for word, verdict in (("attracts_all", "refuted"), ("stays_on_arm", "proved")):
        other = scene_with({word: True}, arm={"surface_height": "0.1 in"})
        (claim,) = ls.certify(other, ["goal"]).claims
        assert claim.verdict == verdict
    # where it is refuted an orbit creeps
    creeping = ls.orbit(scene.map, 3.0, 0, 2000)
    assert creeping.x[-1] < creeping.x[0]


def test_a_repelling_cycle_off_the_attractor_takes_a_set_of_length_zero():
    tree = FOUR_GON | {
        "arm": {"surface_height": "-14.7082 mm", "length": "511.974 mm"}, "throw": {"kappa": "343.2667 mm"},
    }  # fmt: skip
    scene = ls.load(tree)
    found = attraction_of(scene, 4096)
    thin = found.unresolved.mask & (found.basin.rank >= 0)
    assert thin.any()
    assert found.basin.thinning > 0
    assert found.basin.starts == "cells"  # some starts leave inward
    assert found.basin.leaves > 0.05
    # almost every start in the thin cells comes to the attracting ones: 2000 at random do, and none stays or leaves
    rng = np.random.default_rng(1)
    cells = np.flatnonzero(thin)
    for cell in rng.choice(cells, 40):
        side = int(found.cover.grid.side_of(cell))
        lo, hi = found.cover.grid.boxes([cell], side)
        for x in rng.uniform(lo[0, 0], hi[0, 0], 50):
            path = ls.orbit(scene.map, float(x), side, 400)
            (last,) = found.cover.grid.index([path.x[-1]], int(path.side[-1]))
            assert found.component[last] >= 0


@pytest.mark.parametrize(("share", "counts"), [(0.008, True), (0.0099, False)])
def test_starts_that_leave_over_a_hundredth_open_do_not_count(share, counts):
    """Just below a hundredth of the arm lies before them, and a part of the cell in which they begin is open too."""
    found = attraction(cover(parameter_box(ls.load("paper-designed")), 256))
    foot, end = found.cover.box.lo.a, found.cover.box.lo.arm_length
    before = share * (end - foot).sum() / foot.size
    starts = {str(side): float(a + before).hex() for side, a in enumerate(foot)}
    shares, proved = found.shares_from({"starts": {"from": starts}})
    assert (shares["open"] <= 0.01) is proved is counts
    assert shares["open"] > share


def test_pieces_of_a_tolerance_claim_the_fewest_starts():
    def claim(starts, share, **section):
        return Claim("goal", "proved", "", {"kind": "stays_on_arm", "starts": starts} | section, starts=starts,
                     shares={"share": share, "leaves": 0.0, "creeps": 0.0, "open": 1.0 - share})  # fmt: skip

    near = {"0": {"q": (1.5).hex()}}
    far = {"0": {"q": (1.25).hex()}}
    every = claim("every", 1.0, near_joint=near)
    almost = claim("almost-every", 0.875, thinning=7, near_joint=far)

    def cells(first, *, counts=True):
        def shares_from(section):  # as much as the starts claimed leave of 0 to 10
            share = 1.0 - 0.1 * float.fromhex(section["starts"]["from"]["0"])
            return {"share": share, "leaves": 0.0, "creeps": 0.0, "open": 1.0 - share}, counts

        covered = SimpleNamespace(grid=SimpleNamespace(edges=[(np.array([first, 9.0]),)]))
        return SimpleNamespace(cover=covered, shares_from=shares_from)

    joined = weakest_of([every, almost], [cells(1.5), cells(3.5)])
    assert joined.starts == joined.section["starts"] == "almost-every"
    assert joined.section["thinning"] == 7
    assert joined.section["near_joint"] == far
    assert (joined.shares["share"], joined.shares["open"]) == (0.875, 0.125)  # of the piece that says less
    some = claim({"from": {"0": 2.0}}, 0.9, lost={"0": (1.9).hex()})
    more = claim({"from": {"0": 2.5}}, 0.8, lost={"0": (1.8).hex()})
    joined = weakest_of([some, more], [cells(1.5), cells(2.0)])
    assert joined.starts == {"from": {"0": 2.5}}
    assert joined.section["starts"] == {"from": {"0": (2.5).hex()}}
    assert joined.section["lost"] == {"0": (1.8).hex()}
    assert joined.shares["share"] == 0.75
    assert joined.verdict == "proved"
    apart = weakest_of([some, more], [cells(1.5), cells(2.0, counts=False)])
    assert apart.verdict == "proved-on-cells"  # of the starts of both together, less than of each alone
    assert "of 25 % of the starts the same is not proved for all" in apart.reason
    joined = weakest_of([every, some], [cells(2.25), cells(1.5)])
    # before its cells nothing is claimed of the first piece any more
    assert joined.starts == {"from": {"0": 2.25}}
    assert "near_joint" not in joined.section
    assert "lost" not in joined.section  # of every start it is proved, there, that none is
