"""The audit against the numbers of docs/model.md, against mechanics written apart, and against itself with facts."""

import math
from functools import lru_cache
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.thrower.assumed_box import Assumed, assumed, corner_bounds
from limitsets.feeder.thrower.effects import EFFECTS
from limitsets.feeder.thrower.effects.bounce import struck
from limitsets.feeder.thrower.effects.landing import Landing, first_arrival
from limitsets.feeder.thrower.effects.slip import Slip
from limitsets.feeder.thrower.full import gather_full
from limitsets.feeder.thrower.motion import above, right_of
from limitsets.numbers.jit import entry_of
from limitsets.proofs.auditing import ASSUMPTIONS, choose_effects, where
from limitsets.proofs.prover.parameters import parameter_box
from tests.thrower.reference import paper

SCENES = ["paper-initial", "paper-designed", "paper-initial-small-angle", "paper-designed-small-angle"]
by_scene = pytest.mark.parametrize("name", SCENES)


@lru_cache(maxsize=8)
def audited(name):
    return ls.audit(name)


def finding(found, effect, what, place):
    (one,) = [each for each in found.on(place) if (each.effect, each.about.what) == (effect, what)]
    return one


def told(name, world, **effects):
    tree = ls.load(name).as_dict() | {"world": world}
    return ls.load(tree | ({"effects": effects} if effects else {}))


# ---------------------------------------------------------------- the numbers of docs/model.md

# (scene, effect, assumption) -> per side the ranges on the arm; None is the side's own end
TIPS = {"paper-initial": 5.763, "paper-designed": 2.612, "paper-initial-small-angle": 15.524}
PULLS = {"paper-initial": (1.4555, 3.363, 4.4275), "paper-designed": (1.9495, 2.087, 4.949)}
LANDS = {"paper-designed": {0: 20.1517, 1: 26.4235}, "paper-initial": {0: 26.9141}}


@pytest.mark.parametrize("name", TIPS)
def test_the_throw_tips_the_part_on_side_1(name):
    found = finding(audited(name), "release", "tipping", "domain")
    assert (found.called_for, found.how) == (True, "proved")
    assert list(found.ranges) == [1]
    ((lo, hi),) = found.ranges[1]
    assert lo == audited(name).scene.domain.lo[1, 0]
    assert hi == pytest.approx(TIPS[name], abs=6e-4)
    # in closed form: (rho^2 + d (h + d)) / R = L - a
    scene = audited(name).scene
    a, d, length = (float(each[1]) for each in (scene.sides.a, scene.sides.d, scene.sides.length))
    rho, h = scene.radius_of_gyration, scene.surface_height
    assert hi == pytest.approx((rho**2 + d * (h + d)) / (length - a), rel=1e-12)


@pytest.mark.parametrize("name", PULLS)
def test_near_the_joint_a_landing_that_sticks_would_pull(name):
    found = finding(audited(name), "slip", "press", "domain")
    assert (found.called_for, found.how) == (True, "proved")
    for side, end in enumerate(PULLS[name]):
        ((lo, hi),) = found.ranges[side]
        assert lo == audited(name).scene.domain.lo[side, 0]
        assert hi == pytest.approx(end, abs=6e-4)


@pytest.mark.parametrize("name", LANDS)
def test_where_another_corner_lands_first(name):
    found = finding(audited(name), "landing", "angle", "domain")
    assert (found.called_for, found.how) == (True, "proved")
    assert {side: parts[0][0] for side, parts in found.ranges.items()} == pytest.approx(LANDS[name], abs=6e-5)
    assert all(parts[-1][1] == 28.0 for parts in found.ranges.values())


@by_scene
def test_on_the_limit_set_these_are_proved_to_hold(name):
    found = audited(name)
    assert found.enclosed
    for effect, what in (("landing", "angle"), ("slip", "press"), ("release", "tipping"), ("arm", "reach")):
        one = finding(found, effect, what, "limit-set")
        assert (one.called_for, one.how) == (False, "proved")
        assert (one.jogs[0], one.flips[0]) == (0, 0)


def test_how_often_the_hinge_pulls():
    designed, initial = (
        finding(audited(name), "pivot", "press", "limit-set") for name in ("paper-designed", "paper-initial")
    )
    assert designed.jogs[0] == designed.jogs[1] > 10_000
    for (pulls, throws), share in (
        (designed.flips, 6097 / 6327),
        (initial.jogs, 4842 / 15832),
        (initial.flips, 2645 / 3967),
    ):
        assert pulls / throws == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize(("name", "share"), [("paper-initial", 0.083), ("paper-initial-small-angle", 0.112)])
def test_every_jog_on_side_1_has_the_energy_to_roll_and_no_other_throw(name, share):
    found = finding(audited(name), "roll", "energy", "limit-set")
    assert found.called_for is True
    assert found.flips[0] == 0
    assert found.jogs[0] / found.jogs[1] == pytest.approx(share, abs=1.5e-3)
    scene = audited(name).scene
    path = ls.orbit(scene.map, 19.0, 1, 5000)
    box = parameter_box(scene)
    for side in range(3):
        jogs = path.x[1:-1][(path.side[1:-1] == side) & (path.code[1:] == ls.maps.JOG)]
        ratio = assumed(box.lo, box.hi, side, jogs, jogs)[:, Assumed.ROLL]
        assert (ratio[:, 0] > 1.0).all() if side == 1 else (ratio[:, 1] < 1.0).all()
        assert jogs.size > 300


@pytest.mark.parametrize("name", ["paper-designed", "paper-designed-small-angle"])
def test_no_throw_of_the_designed_scenes_rolls_anywhere(name):
    for place in ("limit-set", "domain"):
        found = finding(audited(name), "roll", "energy", place)
        assert (found.called_for, found.how) == (False, "proved")


# ---------------------------------------------------------------- against mechanics written apart


def mechanics(facts, side, x):
    """One exact throw by vectors and small steps of the pivot's angle, at 30 digits."""
    a, d = (mp.mpf(facts[name][side]) for name in ("a", "d"))
    kappa, h = (mp.mpf(facts[name]) for name in ("kappa", "surface_height"))
    rho2 = mp.mpf(facts["radius_of_gyration"]) ** 2

    def rise(phi):  # of the left corner over the arm, in complex numbers
        flown = (mp.mpc(x, h + d) * mp.mpc(1, phi)).imag - kappa * phi**2 / 2
        return flown + (mp.mpc(-a, -d) * mp.expj(phi)).imag - h

    near = 2 * (x - a) / (kappa - d)
    phi = mp.findroot(rise, (near, near * mp.mpf("1.01") + mp.mpf("1e-6")))
    lever = mp.mpc(a, d) * mp.expj(phi)  # from the corner to the centre
    speed = mp.mpc(-(h + d), x - kappa * phi)
    m = rho2 + abs(lever) ** 2
    omega = (rho2 + (mp.conj(lever) * speed).imag) / m
    impulse = mp.mpc(0, 1) * lever * omega - speed
    # at rest along the arm, an impulse up sets the corner sliding unless friction is this part of it
    held = abs(lever.real * lever.imag) / (rho2 + lever.imag**2)
    energy = m * omega**2 / 2 + kappa * lever.imag
    corner = mp.mpf(facts["corner"][side])
    top = kappa * abs(lever)
    over = energy > top and (omega > 0) if lever.real > 0 else not (omega < 0 and energy >= top)
    # angles passed: from phi up to the top or to where the energy ends, and to a face
    last = corner if over else mp.mpf(0)
    turned = mp.atan2(d, a)
    if not over and omega > 0:
        high = mp.asin(energy / kappa / abs(lever)) - turned
        path = [(phi, high), (high, mp.mpf(0))]
    else:
        path = [(phi, last)]
    least, friction = mp.inf, mp.mpf(0)
    for first, end in path:
        for k in range(401):
            angle = first + (end - first) * k / 400
            r = mp.mpc(a, d) * mp.expj(angle)
            rate2 = max(2 * (energy - kappa * r.imag) / m, mp.mpf(0))
            turning = -kappa * r.real / m
            push = mp.mpc(0, 1) * r * turning - r * rate2 + mp.mpc(0, kappa)
            least = min(least, push.imag / kappa)
            friction = max(friction, abs(push.real) / push.imag) if least > 0 else mp.inf
    fall = (speed + mp.mpc(0, 1) * -lever).imag
    return {
        Assumed.ANGLE: phi,
        Assumed.PRESS: impulse.imag / x,
        Assumed.STICK_FRICTION: max(abs(impulse.real) / impulse.imag, held) if impulse.imag > 0 else mp.inf,
        Assumed.DROP: fall**2 / (2 * kappa),
        Assumed.FORCE: least,
        Assumed.HOLD_FRICTION: friction,
    }


@pytest.mark.parametrize("name", ["initial", "designed"])
def test_against_mechanics_written_apart(name):
    facts, scene = paper(name), ls.load(f"paper-{name}")
    box = parameter_box(scene)
    random = np.random.default_rng(5)
    for side in range(3):
        for x in random.uniform(scene.sides.a[side] + 0.05, 27.0, 6):
            with mp.workdps(30):
                wanted = mechanics(facts.numbers, side, mp.mpf(float(x)))
            got = assumed(box.lo, box.hi, side, [x], [x])[0]
            for column in (Assumed.ANGLE, Assumed.PRESS, Assumed.STICK_FRICTION, Assumed.DROP):
                assert got[column].mean() == pytest.approx(float(wanted[column]), rel=1e-9), (side, x, column)
            # the steps of the reference miss a least force between two of them by 1e-4 of it or so
            force = float(wanted[Assumed.FORCE])
            assert got[Assumed.FORCE].mean() == pytest.approx(force, rel=1e-3, abs=1e-4)
            friction = float(wanted[Assumed.HOLD_FRICTION])
            if friction < 20.0:
                assert got[Assumed.HOLD_FRICTION, 0] == pytest.approx(friction, rel=0.02)
                assert got[Assumed.HOLD_FRICTION, 1] >= friction * (1 - 1e-3)
            elif math.isinf(friction):
                assert math.isinf(got[Assumed.HOLD_FRICTION, 1])


@pytest.mark.sweep
def test_the_friction_a_landing_needs_is_that_from_which_on_it_does_not_slip():
    scene = told("paper-designed", {"friction": 1.0}, landing=True, slip=True)
    random = np.random.default_rng(6)
    box, held = parameter_box(ls.load("paper-designed")), 0
    for side in range(3):
        for x in random.uniform(6.0, 20.0, 12):
            need = assumed(box.lo, box.hi, side, [x], [x])[0, Assumed.STICK_FRICTION].mean()
            part = gather_full(scene.map, side)
            hit, _ = first_arrival(entry_of(part.effects, Landing), part, x)
            right, high = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi)
            held += need == pytest.approx(abs(right * high) / (part.own.rho2 + high * high), rel=1e-9)
            slides = [struck(None, Slip(need * by), part, hit).slide != 0.0 for by in (1 - 1e-6, 1 + 1e-6)]
            assert slides == [True, False], (side, x)
    assert held > 5


def test_a_change_of_the_speed_shifts_the_landing_as_the_map_says():
    """Central differences of the map itself; a relative change of w by s makes kappa (1 + s)^-2 as large."""
    scene = ls.load("paper-designed")
    step = 1e-6
    fast, slow = (scene.with_values({"throw.kappa": scene.kappa / (1 + s) ** 2}).map for s in (step, -step))
    box = parameter_box(scene)
    for x, side in ((14.0, 0), (9.0, 1), (12.0, 2), (22.0, 2)):
        moved = (ls.orbit(fast, x, side, 1).x[1] - ls.orbit(slow, x, side, 1).x[1]) / (2 * step)
        speed = assumed(box.lo, box.hi, side, [x], [x])[0, Assumed.SPEED]
        assert speed.mean() == pytest.approx(abs(moved), rel=1e-5)


@by_scene
def test_enclosures_of_cells_hold_the_points_in_them(name):
    scene = ls.load(name)
    box, random = parameter_box(scene), np.random.default_rng(11)
    for side in range(3):
        lo = random.uniform(scene.domain.lo[side, 0], scene.arm_length - 0.5, 200)
        hi = lo + random.uniform(0.0, 0.3, 200)
        x = lo + random.uniform(0.0, 1.0, 200) * (hi - lo)
        cell, point = assumed(box.lo, box.hi, side, lo, hi), assumed(box.lo, box.hi, side, x, x)
        # the number itself lies in both, so they meet
        assert (cell[:, :, 0] <= point[:, :, 1]).all()
        assert (point[:, :, 0] <= cell[:, :, 1]).all()


def test_the_exterior_angle_is_enclosed():
    for name in ("initial", "designed"):
        box = parameter_box(ls.load(f"paper-{name}"))
        facts = paper(name).numbers
        for side in range(3):
            lo, hi = corner_bounds(box.lo, box.hi, side, facts["corner"][side])
            assert lo < facts["corner"][side] < hi
            assert hi - lo < 1e-11
            # a wrong guess is not believed
            assert corner_bounds(box.lo, box.hi, side, 1.1 * facts["corner"][side])[0] < facts["corner"][side]


# ---------------------------------------------------------------- facts


def test_missing_facts_are_named_with_the_value_that_matters():
    found = audited("paper-designed")
    need = finding(found, "slip", "friction", "limit-set")
    assert (need.called_for, need.missing) == (None, "friction")
    for friction, holds in ((need.threshold * 1.001, True), (need.threshold * 0.999, False)):
        known = ls.audit(told("paper-designed", {"friction": friction}))
        again = finding(known, "slip", "friction", "limit-set")
        assert again.called_for is not holds
        assert again.how == ("proved" if holds else "sampled") or holds
    assert finding(found, "bounce", "height", "domain").missing == "restitution"


def test_where_no_friction_is_enough_it_is_called_for_without_the_fact():
    found = finding(audited("paper-designed"), "pivot", "friction", "limit-set")
    assert (found.called_for, found.worst, found.missing) == (True, None, "friction")


def test_bounce_begins_to_matter_at_the_restitution_that_is_named():
    unknown = ls.audit(told("paper-initial", {"bounce_threshold": "0.1 in"}))
    need = finding(unknown, "bounce", "height", "domain")
    assert need.missing == "restitution"
    for e, called in ((need.threshold * 0.999, False), (need.threshold * 1.001, True)):
        world = {"bounce_threshold": "0.1 in", "restitution": e}
        again = finding(ls.audit(told("paper-initial", world)), "bounce", "height", "domain")
        assert (again.called_for, again.how) == (called, "proved")
    dead = finding(ls.audit(told("paper-initial", {"restitution": 0.0})), "bounce", "height", "domain")
    assert dead.called_for is False


def test_scatter_and_stroke_count_from_a_thousandth_of_the_arm():
    need = {each.effect: each for each in audited("paper-initial").on("domain")}
    for factor in (0.999, 1.001):
        world = {
            "stroke": f"{math.degrees(need['drive'].threshold) * factor:.9f} deg",
            "scatter": {"speed": f"{100 * need['spread'].threshold * factor:.9f} %"},
        }
        again = {each.effect: each for each in ls.audit(told("paper-initial", world)).on("domain")}
        assert again["drive"].called_for is (factor > 1)
        assert again["spread"].called_for is (factor > 1)


def test_facts_of_effects_that_are_on_are_used_all_the_same():
    scene = told("paper-initial", {"friction": 0.9}, landing=True, roll=True)
    found = ls.audit(scene)
    assert not found.enclosed
    assert {each.effect for each in found.findings if each.simulated} == {"landing", "roll"}
    assert finding(found, "release", "friction", "domain").how == "proved"
    assert finding(found, "release", "friction", "limit-set").how == "sampled"
    # with rolling, side 0 reaches about 23.48
    assert found.extents[0][-1][1] == pytest.approx(23.48, abs=0.05)


@pytest.mark.parametrize("name", ["four-sides", "five-sides"])
def test_parts_with_more_sides(name):
    """What the audit calls broken on the domain is broken in numbers computed apart; what is proved to hold holds."""
    found = ls.audit(Path(__file__).parents[1] / "analysis" / f"{name}.toml")
    scene, one = found.scene, finding(found, "release", "tipping", "domain")
    rho, h = scene.radius_of_gyration, scene.surface_height
    for side in range(len(scene.sides)):
        a, d, length = (float(each[side]) for each in (scene.sides.a, scene.sides.d, scene.sides.length))
        least = (rho**2 + d * (h + d)) / (length - a)
        if least > scene.domain.lo[side, 0]:
            assert one.ranges[side][0][1] == pytest.approx(least, rel=1e-12)
        else:
            assert side not in one.ranges


# ---------------------------------------------------------------- auto


@pytest.mark.sweep
def test_auto_switches_on_what_is_called_for_and_names_the_rest():
    chosen = choose_effects(told("paper-initial", {}, auto=True))
    assert chosen.switched_on[0] == "roll"
    assert not chosen.scene.effects.auto
    assert chosen.left_out["slip"] == "world.friction is missing: cannot tell"
    assert "pivot" in chosen.left_out
    assert "landing" not in (*chosen.left_out, *chosen.switched_on)
    # only what this version builds can be switched on
    assert set(chosen.switched_on) <= set(EFFECTS)
    assert ls.load(chosen.scene.as_dict()) == chosen.scene


def test_auto_of_a_scene_that_calls_for_nothing_that_can_be_had_is_the_minimal_model():
    chosen = choose_effects(told("paper-designed", {"restitution": 0.0}, auto=True))
    assert "roll" not in chosen.switched_on
    assert "bounce" not in chosen.left_out
    assert "landing" not in chosen.switched_on


def test_auto_says_that_effects_need_the_exact_flight():
    chosen = choose_effects(told("paper-initial-small-angle", {}, auto=True))
    assert chosen.switched_on == ()
    assert chosen.left_out["roll"] == 'called for, but it needs flight = "exact"'


@pytest.mark.sweep
def test_auto_leaves_out_what_cannot_be_simulated_beside_what_is_on():
    """Without restitution the bounce changes nothing, and the stroke is called for as in the minimal model."""
    world = {"stroke": "6 deg", "restitution": 0.0, "bounce_threshold": "0.01 in"}
    minimal = ls.audit(told("paper-designed", world)).on("limit-set")
    assert [each.called_for for each in minimal if each.effect == "drive"] == [True]
    chosen = choose_effects(told("paper-designed", world, auto=True, bounce=True))
    assert "drive" not in chosen.switched_on
    assert chosen.left_out["drive"] == "called for, but it cannot be simulated together with bounce"


def test_without_auto_nothing_changes():
    scene = ls.load("paper-initial")
    assert choose_effects(scene).scene is scene


# ---------------------------------------------------------------- words


@by_scene
def test_json(name):
    record = audited(name).to_json()
    assert len(record) == 2 * len(ASSUMPTIONS)
    keys = {"effect", "where", "called_for", "how", "side", "x", "worst", "threshold"}
    assert all(keys <= set(row) for row in record)
    assert {row["called_for"] for row in record} <= {True, False, "cannot tell"}
    assert {row["how"] for row in record} == {"proved", "sampled"}


def test_stretches_end_between_adjacent_floats():
    ((lo, hi),) = where(lambda x: x * x > 2.0, np.linspace(0.0, 3.0, 7))
    assert lo * lo > 2.0 >= math.nextafter(lo, 0.0) ** 2
    assert hi == 3.0
