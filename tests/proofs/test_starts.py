"""For which starts a goal is proved: the proved basin, and what is left out of it.

Truths come from the formulas of docs/model.md, solved here with scipy, and from orbits.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

import limitsets as ls
from limitsets.proofs.prover import cover as covers
from limitsets.proofs.prover import goals
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.cover import Cover, cover
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.proofs.prover.proof import Claim
from limitsets.proofs.prover.query import weakest_of
from limitsets.proofs.prover.thinning import perron_frobenius_bound
from limitsets.systems.cells import Domain, grid
from limitsets.systems.graph.images.enclosed import enclosures
from tests.scene.four_gon import FOUR_GON


def attraction_of(scene, cells, **noise):
    return attraction(cover(parameter_box(scene, **noise), cells, {}))


def with_goal(goal, name="paper-designed", **tables):
    tree = ls.load(name).as_dict()
    return ls.load(tree | {"goal": goal} | {key: tree.get(key, {}) | new for key, new in tables.items()})


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


def test_every_start_of_the_papers_scenes():
    for name in ("paper-designed", "paper-designed-small-angle"):
        (claim,) = ls.certify(name, ["goal"]).claims
        assert (claim.verdict, claim.starts) == ("proved", "every")
        assert claim.shares == {"share": 1.0, "leaves": 0.0, "creeps": 0.0, "open": 0.0}


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
    scene = with_goal({"oriented_beyond": {"x": "20 in", "side": 2}}, arm={"surface_height": "0.1 in"})
    (claim,) = ls.certify(scene, ["goal"]).claims
    assert claim.verdict == "proved"
    given = [claim.starts["from"][str(side)] for side in range(3)]
    assert given == pytest.approx([3.16, 3.19, 4.81], abs=0.006)
    creep = sum(x - a for x, a in zip(given, scene.sides.a, strict=True))
    total = float((scene.arm_length - scene.sides.a).sum())
    assert claim.shares["creeps"] == pytest.approx(creep / total, rel=1e-6)
    for word, verdict in (("attracts_all", "refuted"), ("stays_on_arm", "proved")):
        other = with_goal({word: True}, arm={"surface_height": "0.1 in"})
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


def test_pieces_of_a_tolerance_claim_the_fewest_starts():
    def claim(starts, share, **section):
        return Claim("goal", "proved", "", {"kind": "stays_on_arm", "starts": starts} | section, starts=starts,
                     shares={"share": share, "leaves": 0.0, "creeps": 0.0, "open": 1.0 - share})  # fmt: skip

    near = {"0": {"q": (1.5).hex()}}
    far = {"0": {"q": (1.25).hex()}}
    every, almost = (
        claim("every", 1.0, near_joint=near),
        claim("almost-every", 1.0, thinning=7, near_joint=far),
    )

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
    assert joined.starts == {
        "from": {"0": 2.25}
    }  # before its cells nothing is claimed of the first piece any more
    assert "near_joint" not in joined.section
    assert "lost" not in joined.section  # of every start it is proved, there, that none is


def test_starts_next_to_a_fixed_point_that_attracts_do_not_thin_out():
    found = attraction_of(ls.load(FOUR_GON), 256)
    (there,) = found.cover.grid.index([274.729], 3)
    cells = np.arange(found.component.size) == there  # its jogs stay in it, with slope 0.519
    result = perron_frobenius_bound(found.cover, cells)
    assert result.thick[there]
    assert result.reason
