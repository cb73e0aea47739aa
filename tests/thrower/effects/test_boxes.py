"""The boxes of a throw with landing, roll and spread: they hold the images of points, and are decided on most cells.

Points are thrown by the point kernels, which have tests of their own; the boxes share no code with them.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import SceneError
from limitsets.feeder.thrower.motion import all_enclosed
from limitsets.numbers.jit import cover_foreign_class
from limitsets.proofs.prover.orbits import replay
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.graph.images.enclosed import enclosures
from limitsets.systems.maps import codes, images

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
        tree = {
            "name": "random",
            "part": {
                "vertices": [[f"{x!r} in", f"{y!r} in"] for x, y in corners.tolist()],
                "mass": {
                    "center": {
                        "side": 0,
                        "along": f"{float(along[0] * x + along[1] * y)!r} in",
                        "above": f"{float(along[0] * y - along[1] * x)!r} in",
                    },
                    "radius_of_gyration": f"{random.uniform(0.5, 2.0)!r} in",
                },
            },
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
    points = lost = cells = 0
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
                seen.update(
                    zip(got.code.tolist(), ((got.side - side) % len(case.sides)).tolist(), strict=True)
                )
    assert points > 1e5
    assert lost < 0.01 * cells
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


@pytest.mark.parametrize("k", [0, 1, 2])
def test_nothing_is_proved_of_an_effect_that_no_box_kernel_names(k):
    """It was enclosed as if it were the effect of its place, or absent."""
    params = scene("paper-designed").map
    params = params._replace(effects=(*params.effects[:k], Wind(1.0), *params.effects[k:]))
    found = enclosures(params, params, np.linspace(8.0, 28.0, 100), 0)
    assert found.lost.all()


def test_no_orbit_is_proved_with_an_effect_that_no_box_kernel_names():
    given = scene("paper-designed")
    box = parameter_box(given)
    known = replay(box, (9.0, 9.0), 2, np.tile([[box.lo.kappa], [box.hi.kappa]], 3), np.zeros(3))
    assert known[0].size == 4
    lo, hi = (each._replace(effects=(*each.effects, Wind(1.0))) for each in (box.lo, box.hi))
    other = replay(
        replace(box, lo=lo, hi=hi), (9.0, 9.0), 2, np.tile([[box.lo.kappa], [box.hi.kappa]], 3), np.zeros(3)
    )
    assert other[0].size == 1
