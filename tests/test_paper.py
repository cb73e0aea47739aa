"""The paper's four scenes end to end, through the public names.

First the tables: what the scenes are, where their throws lead, what the goal says.  Then numbers that are found in
two or three ways which share no code.

Source: Murphey, Bernheisel, Choi and Lynch, "An Example of Parts Handling and Self-Assembly Using Stable Limit Sets",
whose parts and goal these are.  Its printed numbers cannot be had from its printed data; the numbers here are derived
from first principles (docs/model.md).  Lengths are inches, angles radians.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import root

import limitsets as ls
from tests.sets.part import Part


class Row(NamedTuple):
    """What is known of a scene: per side a_i, d_i; per throw the Lyapunov exponent, its tolerance, and flips."""

    a: tuple[float, float, float]
    d: tuple[float, float, float]
    lyapunov: float
    within: float
    flips: float | None


INITIAL, DESIGNED = "paper-initial", "paper-designed"
TABLE = {
    f"{INITIAL}-small-angle": Row(
        (2.05089, 3.36103, 3.24447), (0.21620, 2.04836, 1.78985), 0.0232, 5e-5, None
    ),
    f"{DESIGNED}-small-angle": Row(
        (1.74394, 1.65101, 4.41796), (1.92973, 1.72239, 0.50403), 0.0403, 5e-5, None
    ),
    INITIAL: Row((1.37302, 3.05205, 3.98670), (0.53272, 1.36702, 1.88360), 0.099, 6e-4, 0.1998),
    DESIGNED: Row((1.79776, 1.92575, 4.22558), (1.65438, 1.77927, 0.70825), 0.206, 6e-4, 0.3191),
}

# End points from the decimal scenes at 40 digits.
LIMIT_SETS = {
    "paper-initial-small-angle": {
        0: [(13.449486219312, 20.421069168761)],
        1: [(18.13120694042, 20.390334647524)],
        2: [(13.523779592226, 20.393068935673)],
    },
    "paper-designed-small-angle": {
        0: [(12.216914068142, 12.88421238353)],
        1: [(8.9547723861184, 10.343418249967)],
        2: [(6.3603646024764, 20.640934683962)],
    },
    "paper-initial": {
        0: [(13.522673689975, 20.915912223359)],
        1: [(18.994941734574, 19.975954977782), (20.434045200511, 21.554457325114)],
        2: [(16.262705754072, 21.886351326378)],
    },
    "paper-designed": {
        0: [(15.205338825681, 19.75268801485)],
        1: [(12.637023572659, 17.439819281769)],
        2: [(8.9140259080455, 23.383151921158)],
    },
}

FIRST_THROWS = {
    "paper-initial-small-angle": [8.111560, 8.225738, 8.342593],
    "paper-designed": [8.262013, 8.557124, 8.891802],
}

# The goal "x > 20 implies side 2" on the limit set: from which x on it holds, and whether that is within 20.
THRESHOLDS = {
    "paper-initial-small-angle": (20.421, False),
    "paper-designed-small-angle": (12.884, True),
    "paper-initial": (21.554, False),
    "paper-designed": (19.753, True),
}

THROWS = 1_000_000


@dataclass(frozen=True)
class Answers:
    """All answers about one scene."""

    name: str
    scene: object
    graph: object
    found: tuple
    limit: object
    path: object

    @property
    def attractor(self):
        return self.found[0]

    @property
    def row(self):
        return TABLE[self.name]


@pytest.fixture(scope="module", params=TABLE)
def paper(request):
    scene = ls.load(request.param)
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
    found = ls.attractors(graph, throws=THROWS)
    path = ls.orbit(scene.map, 15.0, 2, THROWS)
    return Answers(request.param, scene, graph, found, ls.limit_set(graph, found[0]), path)


def beyond_it(extents, side):
    """Largest x on any other side: from there on, beyond x means this side."""
    return max(hi for other, parts in extents.items() if other != side for _, hi in parts)


# ---------------------------------------------------------------- the tables


def test_the_four_scenes():
    assert [name for name in ls.scenes() if ls.load(name).cavity is None] == sorted(TABLE)


def test_resting_sides(paper):
    assert paper.scene.sides.a == pytest.approx(paper.row.a, abs=6e-6)
    assert paper.scene.sides.d == pytest.approx(paper.row.d, abs=6e-6)


@pytest.mark.parametrize(("name", "expected"), FIRST_THROWS.items())
def test_the_first_throws_from_8_on_side_2_are_jogs(name, expected):
    path = ls.orbit(ls.load(name).map, 8.0, 2, 3)
    assert path.x[1:] == pytest.approx(expected, abs=6e-7)
    assert (path.side == 2).all()


def test_one_attractor_and_the_whole_arm_leads_to_it(paper):
    share = ls.basins(paper.graph, paper.found)
    assert len(paper.found) == 1
    assert (share.labels == 0).all()
    assert share.attractors == (pytest.approx(1.0, abs=1e-12),)
    assert share.undecided_between == 0.0
    assert set(share.exits.values()) == {0.0}
    assert ls.morse_graph(paper.graph).number_of_nodes() == 1


def test_end_points_of_the_limit_sets(paper):
    expected = LIMIT_SETS[paper.name]
    assert paper.limit.converged
    assert paper.limit.extents.keys() == expected.keys()
    for side, parts in expected.items():
        assert np.array(paper.limit.extents[side]) == pytest.approx(np.array(parts), abs=1e-9)


def test_the_sides_follow_each_other_and_the_throws_drift_apart(paper):
    assert paper.attractor.flip_order == (0, 1, 2)
    assert paper.attractor.lyapunov == pytest.approx(paper.row.lyapunov, abs=paper.row.within)
    if paper.row.flips is not None:
        assert paper.attractor.flips_per_throw == pytest.approx(paper.row.flips, abs=5e-4)


def test_the_goal(paper):
    """Beyond 20 a part lies on side 2: so designed, and not before."""
    threshold, holds = THRESHOLDS[paper.name]
    assert beyond_it(paper.limit.extents, 2) == pytest.approx(threshold, abs=5e-4)
    assert (beyond_it(paper.limit.extents, 2) <= 20.0) is holds


def moved(scene, along, above, log_kappa):
    """Give the scene another centre of mass and speed of throw."""
    centre = {"part.mass.center.along": along, "part.mass.center.above": above}
    return scene.with_values({**centre, "throw.kappa": math.exp(log_kappa)})


def designed_anew(scene, r):
    """Give the scene the centre of mass and the speed that make r its first critical points."""

    def missing(unknowns):
        part = moved(scene, *unknowns)
        found = ls.critical_points(part.map, part.domain)
        return [found[side][0].x - r[side] for side in range(3)]

    centre = [scene.value(f"part.mass.center.{word}") for word in ("along", "above")]
    solution = root(missing, [*centre, math.log(scene.kappa)], tol=1e-9)
    assert solution.success
    return moved(scene, *solution.x)


@pytest.mark.parametrize(
    ("h", "as_it_is", "anew"), [(-0.5, 21.058, 21.04), (-0.3, 20.184, 20.18), (0.1, 18.484, 18.52)]
)
def test_the_goal_depends_on_the_height_of_the_arm(h, as_it_is, anew):
    """Where it begins to hold: of the same part, and of one designed anew to have (10, 10, 20) at that height."""
    scene = ls.load("paper-designed").with_values({"arm.surface_height": h})
    cases = [(scene, as_it_is, 5e-4), (designed_anew(scene, (10.0, 10.0, 20.0)), anew, 5e-3)]
    for part, threshold, within in cases:
        graph = ls.transitions(part.map, ls.grid(part.domain, cells=4096))
        assert beyond_it(ls.limit_set(graph).extents, 2) == pytest.approx(threshold, abs=within)


# A little above the longest of the shortest periods, and the least slope on each limit set.
@pytest.mark.parametrize(
    ("name", "up_to", "least"),
    [
        ("paper-initial-small-angle", 48, 1.0234),
        ("paper-designed-small-angle", 56, 1.0411),
        ("paper-initial", 30, 1.0615),
        ("paper-designed", 13, 1.0330),
    ],
)
def test_every_cycle_repels_so_the_limit_set_is_none(name, up_to, least):
    scene = ls.load(name)
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
    found = ls.cycles(graph, up_to, ls.limit_set(graph, ls.attractors(graph, throws=1000)[0]))
    assert found.complete
    assert found
    assert all(cycle.multiplier > least**cycle.period for cycle in found)


# ---------------------------------------------------------------- end points: by critical orbits, cells, long orbits


@pytest.mark.parametrize("cells", [4096, 65536])
def test_cells_contain_the_limit_set_and_close_in_on_it(paper, cells):
    """Beyond every end there are three cells at most, but for one stray cell of 4096 on side 2 of paper-initial."""
    graph = ls.transitions(paper.scene.map, ls.grid(paper.scene.domain, cells=cells))
    (attractor,) = ls.attractors(graph, throws=1000)
    stray = paper.name == "paper-initial" and cells == 4096
    for side, parts in LIMIT_SETS[paper.name].items():
        edges = graph.grid.edges[side][0]
        covers = attractor.extents[side]
        if stray and side == 2:
            one, *covers = covers
            assert np.searchsorted(edges, one[1]) - np.searchsorted(edges, one[0]) == 1
        for (lo, hi), (least, largest) in zip(covers, parts, strict=True):
            assert lo <= least
            assert largest <= hi
            first, last = np.searchsorted(edges, [least, largest])
            assert first - np.searchsorted(edges, lo) <= 4  # the cell that holds the end, and three
            assert np.searchsorted(edges, hi) - last <= 3


def test_long_orbits_approach_the_ends_from_inside(paper):
    x, sides = paper.path.x[5000:], paper.path.side[5000:]
    assert paper.path.stopped is None
    for side, parts in LIMIT_SETS[paper.name].items():
        here = x[sides == side]
        inside = np.zeros(here.size, dtype=bool)
        for lo, hi in parts:
            part = (here >= lo - 1e-11) & (here <= hi + 1e-11)
            assert here[part].min() - lo < 2e-4
            assert hi - here[part].max() < 2e-4
            inside |= part
        assert inside.all()


# ---------------------------------------------------------------- Lyapunov exponents: by an orbit, on paper


def test_constant_slopes_give_the_lyapunov_exponent(paper):
    """A small-angle branch has the slope q = 1 + 2|h|/kappa everywhere."""
    theory = math.log1p(2.0 * abs(paper.scene.surface_height) / paper.scene.kappa)
    if "small-angle" in paper.name:
        assert paper.attractor.lyapunov == pytest.approx(theory, rel=1e-12)
    else:
        assert paper.attractor.lyapunov > theory


# ---------------------------------------------------------------- critical points: by a search, in closed form


def test_critical_points_of_the_small_angle_energy_model_in_closed_form(paper):
    """With z the rate after the impact, M z^2 / 2 = kappa (ell - d) - 2 a (r - a) and M z = A - a r."""
    table = paper.scene.as_dict()
    table["model"] = {"flight": "small-angle", "flip": "energy"}
    scene = ls.load(table).with_values({"arm.length": 80.0})
    found = ls.critical_points(scene.map, scene.domain)
    for side, (a, d) in enumerate(zip(scene.sides.a, scene.sides.d, strict=True)):
        ell, rho2 = math.hypot(a, d), scene.radius_of_gyration**2
        M, A = rho2 + ell**2, rho2 + 2.0 * a**2 + d**2 + d * scene.surface_height
        z = 2.0 - math.sqrt(4.0 - (2.0 / M) * (2.0 * A - 2.0 * a**2 - scene.kappa * (ell - d)))
        assert found[side][0].x == pytest.approx((A - M * z) / a, rel=1e-12)


# ---------------------------------------------------------------- jogs: counted on an orbit, between the end points


def jogs(part, x, side, r):
    """How many jogs it takes from x to r or beyond."""
    count = 0
    while x < r:
        x, count = part.throw(x, side, "jog")[0], count + 1
    return count


def test_jogs_per_visit_follow_from_the_first_and_the_last_landing_place(paper):
    """A visit begins where a flip lands.  Jogs keep order and go outward, so nearer starts need no fewer of them."""
    part, critical = Part(paper.name), ls.critical_points(paper.scene.map, paper.scene.domain)
    r = [part.critical_point(side, critical[side][0].x) for side in range(3)]
    for side in range(3):
        before = (side - 1) % 3
        flipping = [(max(lo, r[before]), hi) for lo, hi in paper.limit.extents[before] if hi > r[before]]
        landings = [part.throw(x, before, "flip") for pair in flipping for x in pair]
        assert {to for _, to in landings} == {side}
        first, last = min(x for x, _ in landings), max(x for x, _ in landings)
        forced = jogs(part, last, side, r[side]), jogs(part, first, side, r[side])
        assert paper.attractor.jogs_per_visit[side] == forced
