"""Basins by two throws and by one."""

import math
import sys
from dataclasses import replace
from fractions import Fraction
from itertools import product

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.scattering import Scattering, Uniform, thrown
from limitsets.feeder.thrower import impact_angles
from limitsets.proofs.prover import two_throws
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.proofs.prover.two_throws import FLIP, JOG, TwoThrows, kinds_of_two_throws, stays_below
from limitsets.systems.maps import advance
from tests.one_throw import highest_off, highest_scattered, mean_after
from tests.proofs.test_by_angle import DESIGNED, boxed, written
from tests.proofs.test_probabilities import certificate, mesh
from tests.proofs.test_recheck import checker

# ----------------------------------------------------------------
# Two throws with the same parameters: what is proved, attacked by plain orbits of single scenes of the box.
# No orbit may reach a place that is proved to be out of reach; and the orbits at the corners nearly do.


SMALL = {
    "throw.kappa": Fraction(1, 100),
    "arm.surface_height": Fraction(1, 1000),
    "part.sides[0]": Fraction(1, 1000),
    "part.mass.center.along": Fraction(1, 1000),
}
WIDE = {
    "throw.kappa": Fraction(1, 10),
    "arm.surface_height": Fraction(1, 250),
    "part.mass.center.above": Fraction(1, 250),
    "part.mass.radius_of_gyration": Fraction(1, 200),
}


class Attacked:
    """A box of scenes: the lowest place that is proved, and the highest that orbits of its scenes reach, off a side."""

    def __init__(self, name, widths, landing=0.0, model=None, side=2, cells=1024):
        self.side, self.landing, self.widths = side, landing, widths
        self.scene, tree = boxed(written(name, model), widths)
        noise = {"landing.x": f"{landing!r} in"} if landing else {}
        self.box = parameter_box(self.scene, tree=tree, noise=noise)
        self.found = attraction(cover(self.box, cells, {}, 8))
        assert (self.found.component >= 0).any()

    def bad(self, x):
        beyond = np.zeros(self.found.component.size, dtype=bool)
        for side, (edges,) in enumerate(self.found.cover.grid.edges):
            beyond[self.found.cover.grid.of_side(side)] = (side != self.side) & (edges[1:] > x)
        return beyond & (self.found.component >= 0)

    def proved(self, x):
        return stays_below(self.found, self.scene, self.bad(x), x)

    def lowest(self, low, high, width=2e-4):
        """Bisect for the lowest place that is proved."""
        assert self.proved(high)
        assert not self.proved(low)
        while high - low > width:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.proved(middle) else (middle, high)
        return high

    def scenes(self, random, inside):
        """Maps at all corners, and at random places inside."""
        count = len(self.widths)
        corners, between = product((-1, 1), repeat=count), random.uniform(-1, 1, (inside, count)).tolist()
        for signs in (*corners, *between):
            widths = zip(self.widths.items(), signs, strict=True)
            moved = {name: self.scene.value(name) + float(width) * sign for (name, width), sign in widths}
            yield self.scene.with_values(moved).map

    def highest(self, random, inside=20, throws=100_000):
        """Highest place off the side that long orbits reach."""
        return max(highest_off(throw, throws, self.side) for throw in self.scenes(random, inside))

    def highest_with_noise(self, random):
        """As `highest`, of many starts, each landing moved to either end of the noise as a random number has it."""
        return max(highest_scattered(throw, self.landing, random) for throw in self.scenes(random, 0))


# by how much what is proved may exceed what orbits reach; paper-initial: its highest place is three throws from what
# decides it, so two throws from attracting cells, which allow for more, lead farther
SHARP = {
    "few": ("paper-designed", SMALL, 0.003),
    "others": ("paper-designed", WIDE, 0.003),
    "small-angle": ("paper-initial-small-angle", SMALL, 0.003),
    "designed-small-angle": ("paper-designed-small-angle", SMALL, 0.003),
    "three-throws": ("paper-initial", SMALL, 0.03),
    "exact-energy": ("paper-designed-small-angle", SMALL, 0.003, ("exact", "energy")),
    "second-order": ("paper-designed-small-angle", SMALL, 0.003, ("small-angle-2", "energy")),
}


@pytest.mark.parametrize(
    "given",
    [
        pytest.param(given, id=name, marks=() if name in ("others", "three-throws") else pytest.mark.sweep)
        for name, given in SHARP.items()
    ],
)
def test_no_orbit_of_any_scene_exceeds_what_is_proved_and_some_nearly_reach_it(given):
    name, widths, gap, *model = given
    box = Attacked(name, widths, model=model[0] if model else None)
    reached = box.highest(np.random.default_rng(6))
    for less in (1e-7, 1e-3, 0.05):
        assert not box.proved(reached - less)
    assert box.proved(reached + gap)


@pytest.mark.sweep
def test_no_orbit_exceeds_it_with_the_worst_landings_either():
    box = Attacked("paper-designed", {name: SMALL[name] for name in ("throw.kappa", "part.sides[0]")}, 0.02)
    reached = box.highest_with_noise(np.random.default_rng(7))
    # twice the noise: of the first landing and of the last; both are within reach of the random ones
    still = Attacked("paper-designed", {"throw.kappa": Fraction(1, 100)})
    assert reached > still.highest(np.random.default_rng(7), 0)
    for less in (1e-7, 1e-3, 0.03):
        assert not box.proved(reached - less)
    assert box.proved(reached + 0.003)


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.sweep) for k in range(1, 6))])
def test_random_boxes_are_never_proved_below_an_orbit(seed):
    random = np.random.default_rng(seed)
    names = random.choice(list(DESIGNED), int(random.integers(1, 6)), replace=False).tolist()
    widths = {name: Fraction(int(random.integers(1, 40)), 10_000) for name in names}
    name = str(random.choice([name for name in ls.scenes() if ls.load(name).cavity is None]))
    # another model in which the designed scenes keep parts on the arm
    model = ("exact", "energy") if "designed" in name and seed % 2 else None
    box = Attacked(name, widths, model=model, cells=512)
    reached = box.highest(random, inside=10, throws=30_000)
    for less in (1e-7, 1e-3):
        assert not box.proved(reached - less)


def test_every_two_throws_that_end_in_bad_cells_are_among_the_kinds():
    box = Attacked("paper-designed", SMALL)
    grid, random = box.found.cover.grid, np.random.default_rng(8)
    bad = box.bad(16.0)
    kinds = {tuple(kind): ranges for kind, ranges in kinds_of_two_throws(box.found, bad)}
    seen = set()
    for throw in box.scenes(random, 0):
        path = ls.orbit(throw, 15.0, 2, 20_000)
        x, side = np.asarray(path.x)[1000:], np.asarray(path.side)[1000:]
        cell = np.empty(x.size, np.int64)
        phi = np.empty(x.size)
        for k, (edges,) in enumerate(grid.edges):
            own = side == k
            cell[own] = np.arange(grid.n_cells)[grid.of_side(k)][np.searchsorted(edges, x[own]) - 1]
            phi[own] = impact_angles(throw, x[own], k)
        for end in np.flatnonzero(bad[cell[2:]]) + 2:
            begin = end - 2
            kind = (side[begin], *(int(side[k] != side[k + 1]) for k in (begin, begin + 1)))
            (low, high) = np.array(kinds[kind]).T
            assert (low <= phi[begin:end]).all()
            assert (phi[begin:end] <= high).all()
            seen.add(kind)
    assert len(seen) >= 2


# --------------------------------------------------------------------------------------------------- what it refuses


def anything(tree, wide=None, noise=None):
    """Whether even 100 in is proved, with cells called bad that no throw comes to."""
    scene = ls.load(tree)
    found = attraction(cover(parameter_box(scene, tree=wide, noise=noise), 512, {}, 8))
    return stays_below(found, scene, np.zeros(found.component.size, dtype=bool), 100.0)


def test_what_differs_at_every_throw_is_refused():
    tree = written("paper-designed")
    _, wide = boxed(tree, SMALL)
    assert anything(tree, wide)
    assert anything(tree, wide, {"landing.x": "0.01 in"})
    assert not anything(tree, wide, {"throw.speed": "0.01 %"})
    tilted = tree | {"throw": {"speed": "158.02 deg/s"}, "gravity": {"tilt": "30 deg"}}
    _, wide = boxed(tilted, {"part.sides[0]": Fraction(1, 1000)})
    assert anything(tilted, wide)
    assert not anything(tilted, wide, {"gravity.tilt": "0.01 deg"})


def test_effects_are_refused():
    """Their throws are other ones than the formulas', even where the cells are those of the minimal model."""
    box = Attacked("paper-designed", SMALL, cells=512)
    scene, wide = boxed(written("paper-designed") | {"effects": {"landing": True}}, SMALL)
    full = replace(box.found, cover=replace(box.found.cover, box=parameter_box(scene, tree=wide)))
    nothing = np.zeros(box.found.component.size, dtype=bool)
    assert stays_below(box.found, box.scene, nothing, 100.0)
    assert not stays_below(full, scene, nothing, 100.0)


def test_without_any_tolerance_nothing_is_to_be_gained():
    assert not anything(written("paper-designed"))
    assert not anything(written("paper-designed"), None, {"landing.x": "0.01 in"})


def test_an_angle_that_is_not_known_proves_nothing():
    box = Attacked("paper-designed", SMALL)
    x = 19.8
    assert box.proved(x)
    bad, grid = box.bad(x), box.found.cover.grid
    assert bad.any()
    ((kind, ranges),) = kinds_of_two_throws(box.found, bad)
    assert (kind, grid.sides) == (TwoThrows(2, JOG, FLIP), 3)  # the way to the highest place, by r_2 = 20
    angles = box.found.cover.images[2].witness
    for end, cell in product((0, 1), [int(np.flatnonzero(angles[1] == last)[0]) for last in ranges[:, 1]]):
        known = angles[end, cell]
        angles[end, cell] = math.nan
        assert not box.proved(x)
        angles[end, cell] = known
    assert box.proved(x)


def test_a_box_whose_terms_are_nan_stays_open():
    box = Attacked("paper-designed", SMALL)
    boxes = two_throws._Boxes(box.box, box.scene, 100.0)
    good = np.array([[0.9, 1.0], [0.9, 1.0]])
    kind = TwoThrows(2, JOG, FLIP)
    assert boxes.settled(kind, good)
    for k in product((0, 1), (0, 1)):
        wrong = good.copy()
        wrong[k] = math.nan
        assert not boxes.settled(kind, wrong)
    # an angle of 0: nothing is known of (a sin p - d (1 - cos p)) / p by the formula
    assert not boxes.settled(kind, np.array([[0.9, 1.0], [0.0, 0.0]]))


# ----------------------------------------------------------------
# One step of the checker's noisy chain against midpoints, at any place.


pytest.importorskip("flint", reason="the checker needs python-flint")


X = 20.0
# places that end within cells of side 1, three next to each other: no more is known of these cells than where their
# throws may land
WALLS = [(15.03, 15.08), (15.22, 15.26), (15.4, 15.45)]
EVEN = [np.linspace(1, 28, 150)] * 3


def of_checker(name):
    return sys.modules[f"{checker.__name__}.{name}"]


def chain_of(speed, landing, strata, tmp_path):
    """The checker's chain of paper-initial on cells of 0.18 in, and its nodes by side."""
    laws = {"landing.x": f"{landing} in"} | ({"throw.speed": f"{speed:%}"} if speed else {})
    forged = certificate(
        "initial",
        laws,
        [[2, "15 in", "16 in"]],
        {"right": [[2, f"{X} in", None]], "wall": [[1, *(f"{end} in" for end in wall)] for wall in WALLS]},
        mesh("initial", EVEN, {2: [X]}),
        {"right": np.array([[0.0, 1.0]])},
        strata=strata,
    )
    path = forged.write(tmp_path / "x.proof.zip")
    brackets = of_checker("brackets")
    claim = brackets.read_chances(*checker.report.open_certificate(path))
    chain, _ = brackets.chain_on(claim.setting, claim.edges, lambda more: None)
    return chain, [slice(*chain.mesh.first[k : k + 2]) for k in range(3)]


# speed, landing, strata, midpoints of each law
WIDER = [(0.01, 0.2, 8, 100), (0.05, 0.1, 8, 100), (0.3, 0.1, 8, 100)]
LAWS = [(0.0, 0.05, 1, 1000), *(pytest.param(*law, marks=pytest.mark.sweep) for law in WIDER)]


@pytest.mark.usefixtures("precision")
@pytest.mark.parametrize(("speed", "landing", "strata", "count"), LAWS)
def test_one_throw_is_bounded_at_every_place(speed, landing, strata, count, tmp_path):
    scene = ls.load("paper-initial")
    scatter = Scattering(speed=Uniform(speed) if speed else None, landing=Uniform(landing))
    chain, rows = chain_of(speed, landing, strata, tmp_path)
    place = chain.mesh.place
    assert not np.isfinite(chain.hard.steep).all()
    random = np.random.default_rng(5)
    side = random.integers(0, 3, 3000)
    x = random.uniform(scene.sides.a[side] + 1e-3, np.where(side == 2, X, 24.0))
    x[:60] = scene.sides.a[side[:60]] + 10.0 ** random.uniform(-9.0, -3.0, 60)  # cells at the joint
    x[60:160], side[60:160] = random.uniform(14.9, 15.6, 100), 1
    # throws are made from there
    some = ~((side == 1) & np.any([(a <= x) & (x <= b) for a, b in WALLS], axis=0))
    for share in np.linspace(-1.0, 1.0, 41):  # a mean of throws that end on the arm
        some &= advance(thrown(scene.map)(1.0 / (1.0 + share * speed) ** 2), x, side, 1)[2] >= 0
    x, side = x[some], side[some]
    for waves in (
        np.sin(3.0 * place),
        np.cos(1.0 * place),
        1.0 * (place > 17.3),
        (place - 15.0) ** 2 / 200.0,
    ):
        values = np.where(np.abs(place) < 100.0, waves, 0.0)
        found = mean_after(scene, scatter, [(place[row], values[row]) for row in rows], x, side, count)
        none = np.full(len(place), -np.inf)
        above, below = chain.above(values, none), -chain.above(-values, none)
        high, low = (
            np.select([side == k for k in range(3)], [np.interp(x, place[row], bound[row]) for row in rows])
            for bound in (above, below)
        )
        # midpoints of a function that jumps by 2 at most, where the branch changes or at 17.3: by half a weight each
        slack = 2.0 / count
        assert (found <= high + slack).all()
        assert (found >= low - slack).all()
