"""Boxes of effects hold their throws; chamfers."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import SceneError
from limitsets.feeder.thrower.full import with_effects
from limitsets.feeder.thrower.motion import all_enclosed
from limitsets.numbers.jit import cover_foreign_class
from limitsets.proofs.prover.orbits import replay
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.graph.images.enclosed import enclosures
from limitsets.systems.maps import codes, images
from limitsets.systems.maps.drivers import images as images_of_chamfer
from tests.thrower.effects.simulation import Body
from tests.thrower.effects.throws import Case, agree, same_end

# ----------------------------------------------------------------
# The boxes of a throw with landing, roll and spread: they hold the images of points, and are decided on most cells.
# Points are thrown by the point kernels, which have tests of their own; the boxes share no code with them.


EFFECTS = {"landing": True, "roll": True}


def scene(name, **effects):
    return ls.load(ls.load(name).as_dict() | {"effects": effects or EFFECTS})


def random_part(random):
    """A polygon of three to six sides that rests on each of them, on a 30 in arm, with landing and roll."""
    while True:
        n = int(random.integers(3, 7))
        turn = np.sort(random.uniform(0.0, 2 * math.pi, n))
        corners = 3.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        centre = random.dirichlet(np.full(n, 3.0)) @ corners
        along = corners[1] - corners[0]
        along /= np.linalg.norm(along)
        x, y = centre - corners[0]
        foot, above = along[0] * x + along[1] * y, along[0] * y - along[1] * x
        center = {"side": 0, "along": f"{float(foot)!r} in", "above": f"{float(above)!r} in"}
        mass = {"center": center, "radius_of_gyration": f"{random.uniform(0.5, 2.0)!r} in"}
        tree = {
            "name": "random",
            "part": {"vertices": [[f"{x!r} in", f"{y!r} in"] for x, y in corners.tolist()], "mass": mass},
            "arm": {"length": "30 in", "surface_height": f"{random.uniform(-1.0, 0.3)!r} in"},
            "throw": {"kappa": f"{random.uniform(9.0, 40.0)!r} in"},
            "model": {"flight": "exact", "flip": "signed"},
            "effects": EFFECTS,
        }
        try:
            return ls.load(tree)
        except SceneError:  # it tips over on one of its sides
            continue


def with_kappa(params, factor):
    return params._replace(bare=params.bare._replace(kappa=params.bare.kappa * factor))


def outside(found, x, got):
    """Points whose image no hull holds, with the branch taken; what leaves the arm has no branch to show."""
    held = found.lost | (got.code == codes.OUTSIDE_MODEL)
    for (to, branch), (lo, hi) in found.hulls.items():
        # the point map itself rounds, by some 1e-15 of the lengths involved
        more = 1e-13 * (np.abs(x) + np.abs(got.x))
        same = (got.code == branch) | (got.code < 0)
        held |= same & (got.side == to) & (got.x >= lo - more) & (got.x <= hi + more)
    return ~held


@pytest.mark.parametrize("name", ["paper-initial", "paper-designed"])
def test_hold_the_paper_s_parts_over_the_whole_arm(name):
    case, random = scene(name), np.random.default_rng(1)
    seen, both = set(), 0
    for side in range(3):
        edges = ls.grid(case.domain, cells=2000).edges[side][0]
        found = enclosures(case.map, case.map, edges, side)
        assert not found.lost.any()
        both += int((np.sum([lo <= hi for lo, hi in found.hulls.values()], axis=0) > 1).sum())
        for _ in range(9):
            x = random.uniform(edges[:-1], edges[1:])
            got = images(case.map, x, side)
            assert not outside(found, x, got).any()
            seen.update(got.code.tolist())
    # one cell a critical point: of jog and flip on each side, of landings and rolls on some
    assert 3 <= both <= 12
    assert seen >= {codes.JOG, codes.FLIP}
    assert (2 in seen) == (name == "paper-initial")


def test_hold_random_parts_with_a_known_speed_and_an_unknown_one():
    random = np.random.default_rng(3)
    points = lost = cells = wide = alone = 0
    seen = set()
    for k in range(25):
        case = random_part(random)
        width = 0.0 if k % 3 else 0.002
        lo, hi = with_kappa(case.map, 1.0 - width), with_kappa(case.map, 1.0 + width)
        for side in range(len(case.sides)):
            edges = ls.grid(case.domain, cells=250).edges[side][0]
            found = enclosures(lo, hi, edges, side)
            model = images(case.map, edges[:-1], side).code != codes.OUTSIDE_MODEL
            lost, cells = lost + int((found.lost & model).sum()), cells + int(model.sum())
            for _ in range(5):
                x = random.uniform(edges[:-1], edges[1:])
                got = images(with_kappa(case.map, 1.0 + width * random.uniform(-1, 1)), x, side)
                assert not outside(found, x, got).any()
                points += x.size
                turned = (got.side - side) % len(case.sides)
                seen.update(zip(got.code.tolist(), turned.tolist(), strict=True))
            # of one scene a place that grows with the start lies between those of the cell's ends
            ends = [
                images(case.map, (1.0 - s) * edges[:-1] + s * edges[1:], side)
                for s in (1e-9, 0.5, 1.0 - 1e-9)
            ]
            spread = np.ptp([end.x for end in ends], axis=0)
            for (to, branch), (least, most) in found.hulls.items() if width == 0.0 else ():
                own = np.all([(end.side == to) & (end.code == branch) for end in ends], axis=0)
                alone, wide = alone + int(own.sum()), wide + int((own & (most - least > spread + 1e-6)).sum())
    assert points > 1e5
    assert lost < 0.01 * cells
    assert wide < 0.01 * alone
    # rolls forward by two, three ... sides, and back by one or more
    assert {turned for code, turned in seen if code == 2} >= {0, 1, 2, 3, 4, 5}


def test_a_part_that_cannot_roll_lands_as_in_the_minimal_model():
    """On side 0 of paper-designed, below the angle at which another vertex lands, and with h = -0.2: the same."""
    case, bare = scene("paper-designed"), ls.load("paper-designed")
    edges = np.linspace(5.0, 20.0, 801)
    full, plain = enclosures(case.map, case.map, edges, 0), enclosures(bare.map, bare.map, edges, 0)
    assert full.hulls.keys() == plain.hulls.keys() == {(0, 0), (1, 1)}
    for key, ends in plain.hulls.items():
        for ours, theirs in zip(full.hulls[key], ends, strict=True):
            assert np.allclose(ours, theirs, rtol=0, atol=1e-11)


def test_a_bounded_spread_takes_the_whole_interval():
    """x' of a throw anywhere in the bounds; by how much it may differ is an interval on kappa and one on x'."""
    tree = ls.load("paper-designed").as_dict()
    tree["effects"] = {"spread": "bounded"}
    tree["world"] = {"scatter": {"speed": "0.4 %", "landing": "0.05 in"}}
    case, bare = ls.load(tree), ls.load("paper-designed")
    edges, random = np.linspace(9.0, 23.0, 300), np.random.default_rng(8)
    found = enclosures(case.map, case.map, edges, 2)
    assert not found.lost.any()
    for delta in (-0.004, 0.0, 0.0025, 0.004):
        for shift in (-0.05, 0.05):
            x = random.uniform(edges[:-1], edges[1:])
            got = images(bare.map._replace(kappa=bare.kappa / (1 + delta) ** 2), x, 2)
            assert not outside(found, x, replace(got, x=got.x + shift)).any()


@pytest.mark.parametrize("effects", [{"drive": True}, {"spread": "gaussian"}])
def test_of_other_effects_nothing_is_proved(effects):
    facts = ls.load("paper-designed").as_dict()
    facts |= {"world": {"stroke": "5 deg", "scatter": {"speed": "0.4 %"}}, "effects": effects}
    case = ls.load(facts)
    assert enclosures(case.map, case.map, np.linspace(9.0, 20.0, 50), 2).lost.all()


class Wind(NamedTuple):
    """An effect that has not said that boxes follow it."""

    strength: float


def blown(wind):
    return wind.strength


cover_foreign_class(Wind, [blown])  # so that what is compiled for it is kept on disk


def test_without_any_effect_everything_is_enclosed():
    assert all_enclosed(()) is True


@pytest.mark.sweep
@pytest.mark.parametrize("k", [1, *(pytest.param(k, marks=pytest.mark.repeats) for k in (0, 2))])
def test_nothing_is_proved_of_an_effect_that_no_box_kernel_names(k):
    """It was enclosed as if it were the effect of its place, or absent."""
    params = scene("paper-designed").map
    params = params._replace(effects=(*params.effects[:k], Wind(1.0), *params.effects[k:]))
    found = enclosures(params, params, np.linspace(8.0, 28.0, 100), 0)
    assert found.lost.all()


def test_no_orbit_is_proved_with_an_effect_that_no_box_kernel_names():
    given = scene("paper-designed")
    box = parameter_box(given)
    throws = np.tile([[box.lo.kappa], [box.hi.kappa]], 3), np.zeros(3)
    known = replay(box, (9.0, 9.0), 2, *throws)
    assert known[0].size == 4
    lo, hi = (each._replace(effects=(*each.effects, Wind(1.0))) for each in (box.lo, box.hi))
    other = replay(replace(box, lo=lo, hi=hi), (9.0, 9.0), 2, *throws)
    assert other[0].size == 1


# ----------------------------------------------------------------
# A part with a side on which it cannot rest, a chamfer: it tips on to the next side, and never rests there.
# The float kernel against the integrated rigid body of `simulation.py`, which knows nothing of sides that tip but
# that nothing holds a part beside its foot.


BOTH = ("landing", "roll")


def chamfered(rng: np.random.Generator) -> Body:
    """A convex part that tips over on one of its sides, or on two, and so far that it takes energy to lie there."""
    while True:
        n = int(rng.integers(3, 7))
        angles = np.sort(rng.uniform(0.0, 2 * np.pi, n))
        corners = 2.0 * np.stack([np.cos(angles), rng.uniform(0.4, 1.0) * np.sin(angles)], 1)
        corners -= rng.dirichlet(np.full(n, 2.0)) @ corners
        body = Body(corners, rng.uniform(0.5, 0.9) * float(np.hypot(*corners.T).mean()))
        facts = body.numbers()
        a, d, right = facts["a"], facts["d"], facts["length"] - facts["a"]
        beside = np.minimum(a, right)
        clear = ((beside > 0.05) | (beside < -0.4)).all() and (d > 0.15).all()
        if clear and (beside < 0).any():
            return body


def chamfered_cases(count: int, seed: int) -> list[Case]:
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        body = chamfered(rng)
        facts = body.numbers()
        rests = np.flatnonzero((facts["a"] > 0) & (facts["a"] < facts["length"]))
        side = int(rng.choice(rests))
        kappa = float(np.hypot(facts["a"], facts["d"]).max() * np.exp(rng.uniform(0.1, 2.0)))
        x = float(facts["a"][side] + kappa * rng.uniform(0.1, 1.5))
        world = SimpleNamespace(friction=0.7, restitution=0.4, bounce_threshold=0.01)
        found.append(Case(body, kappa, float(rng.uniform(-1.0, 0.5)), x, side, world))
    return found


@pytest.mark.sweep
def test_it_ends_where_the_rigid_body_does() -> None:
    """Integrated in (x, y, theta); many of these throws come down on the chamfer, and go on over it or back."""
    on = back = 0
    for case in chamfered_cases(30, 7):
        simulation = case.simulation(BOTH)
        end = simulation.run(case.x, case.side)
        assert same_end(case.mapped(BOTH), end, 1e-8)
        if "tips" in simulation.modes:
            on, back = on + (end[1] != case.side), back + (end[1] == case.side)
    assert on > 3
    assert back > 0


@pytest.mark.sweep
@pytest.mark.parametrize("others", [("slip",), ("bounce",), ("slip", "pivot", "bounce")])
def test_it_ends_where_the_rigid_body_does_with_other_effects(others: tuple[str, ...]) -> None:
    assert all(agree(case, (*BOTH, *others)) for case in chamfered_cases(15, 11))


def test_no_start_comes_to_rest_on_a_chamfer_and_none_begins_there() -> None:
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(40):
        (case,) = chamfered_cases(1, int(rng.integers(1 << 30)))
        bare = case.bare
        rests = (bare.a > 0) & (bare.a < bare.length)
        thrown = case.full(BOTH)
        for side in range(rests.size):
            x = max(float(bare.a[side]), 0.0) + case.kappa * rng.uniform(0.0, 2.0, 2000)
            got = images_of_chamfer(thrown, x, side)
            if not rests[side]:
                assert (got.code == -3).all()
                continue
            landed = got.code != -3
            assert landed.mean() > 0.9  # beyond a full turn there is no model
            assert rests[got.side[landed]].all()
            seen |= set(got.code.tolist())
    assert {0, 1, 2} <= seen


def thin_triangle() -> Body:
    """An obtuse plate: on its shortest side the centre of mass stands beside the left end."""
    corners = np.array([(0.0, 0.0), (5.0, 0.0), (6.5, 1.0)])
    return Body(corners - corners.mean(axis=0), 1.3)


@pytest.mark.sweep
def test_boxes_hold_the_points() -> None:
    rng = np.random.default_rng(5)
    points = lost = cells = 0
    for number in range(12):
        (case,) = chamfered_cases(1, int(rng.integers(1 << 30)))
        bare = case.bare._replace(arm_length=case.kappa)
        params = with_effects(bare, dict.fromkeys(BOTH, True), case.world)
        width = 0.0 if number % 3 else 0.002
        lo, hi = with_kappa(params, 1.0 - width), with_kappa(params, 1.0 + width)
        for side in range(bare.a.size):
            edges = np.linspace(max(float(bare.a[side]), 0.0) + 1e-6, case.kappa, 251)
            found = enclosures(lo, hi, edges, side)
            if not 0 < bare.a[side] < bare.length[side]:
                assert found.lost.all()
                continue
            model = images_of_chamfer(params, edges[:-1], side).code != codes.OUTSIDE_MODEL
            lost, cells = lost + int((found.lost & model).sum()), cells + int(model.sum())
            for _ in range(15):
                x = rng.uniform(edges[:-1], edges[1:])
                got = images_of_chamfer(with_kappa(params, 1.0 + width * rng.uniform(-1, 1)), x, side)
                assert not outside(found, x, got).any()
                points += x.size
    assert points > 1e5
    assert lost < 0.01 * cells


def test_where_it_depends_on_the_parameters_whether_it_can_rest_nothing_is_proved() -> None:
    body = thin_triangle()
    facts = body.numbers()
    case = Case(body, 20.0, -0.3, 0.0, 0, SimpleNamespace())
    thrown = case.full(BOTH)
    chamfer = int(np.flatnonzero(facts["a"] < 0)[0])
    side = (chamfer + 1) % 3
    edges = np.linspace(float(facts["a"][side]) + 1.0, 12.0, 5)

    def standing(foot: float) -> Any:
        a = thrown.bare.a.copy()
        a[chamfer] = foot
        return thrown._replace(bare=thrown.bare._replace(a=a))

    assert not enclosures(standing(-2e-9), standing(-1e-9), edges, side).lost.any()
    assert not enclosures(standing(1e-9), standing(2e-9), edges, side).lost.any()
    assert enclosures(standing(-1e-9), standing(1e-9), edges, side).lost.all()
