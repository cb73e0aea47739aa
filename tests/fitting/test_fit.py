"""The fit against machines of known truth, which other formulas throw (`tests.fitting.machines`)."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import binom

import limitsets as ls
from limitsets.face.report.pages import lines_of
from limitsets.parameters.fitting import searching
from tests.fitting.machines import ABOVE, ALONG, HEIGHT, KAPPA, RADIUS, described, film, machine, run_film
from tests.proofs.forge import scene

PLACES = (KAPPA, ALONG, ABOVE, HEIGHT)
SPEED, LANDING = 0.002, 0.01


def aimed_at():
    """What the builder of all these machines knows."""
    return ls.load(scene("designed"))


def filmed(seed, n=50, **how):
    """A machine and its film."""
    draw = np.random.default_rng(seed)
    truth = machine(draw)
    return truth, film(draw, truth, n, **how)


def arrays_of(throws):
    return {name: each for name, each in vars(throws).items() if isinstance(each, np.ndarray)}


def repeated(count, seed, **how):
    """Machines, films and fits."""
    draw = np.random.default_rng(seed)
    for _ in range(count):
        truth = machine(draw)
        yield truth, ls.fit(aimed_at(), film(draw, truth, speed=SPEED, landing=LANDING, **how))


def held_by(found, truth):
    """Which intervals hold the truth; those of positions in one region as well."""
    held = {each.name: each.lo <= truth[each.name] <= each.hi for each in found.quantities}
    held["speed"] = found.speed.lo <= SPEED <= found.speed.hi
    held["landing"] = found.landing.lo <= LANDING <= found.landing.hi
    fitted = [name for name in PLACES if name not in found.held]
    joint = searching.threshold_of(len(fitted), len(found.rows.throws), len(fitted))
    machines = found.machines
    off = [(truth[name] - machines.values[name]) / machines.halves[name] for name in machines.together]
    held["ellipsoid"] = off @ np.linalg.solve(machines.correlation, off) <= machines.stretch(len(off)) ** 2
    held["region"] = found.deviance({name: truth[name] for name in fitted}) <= joint
    return held


@cache
def fifteen(flipped):
    return list(repeated(15, seed=2, flipped=flipped))


@pytest.mark.sweep
@pytest.mark.parametrize("flipped", [0.05, pytest.param(0.0, marks=pytest.mark.repeats)])
def test_intervals_of_15_machines_hold(flipped):
    """A thousand machines, from both sides, are in the benchmarks."""
    cases = [held_by(found, truth) for truth, found in fifteen(flipped)]
    for name in (
        *PLACES,
        "region",
        "ellipsoid",
        RADIUS,
        "speed",
        "landing",
    ):  # at a bound an interval holds more often
        held = [each[name] for each in cases if name in each]
        assert len(held) == 15 or name in (RADIUS, "speed", "landing")
        assert sum(held) >= binom.ppf(1e-3, len(held), 0.95), (name, held)


def test_sides_recorded_wrong_are_named_and_move_nothing():
    draw = np.random.default_rng(3)
    truth = machine(draw)
    seed = int(draw.integers(1 << 30))
    clean, flipped = (
        ls.fit(aimed_at(), film(np.random.default_rng(seed), truth, flipped=share)) for share in (0.0, 0.1)
    )
    right = clean.rows.throws.side_after
    wrong = flipped.rows.throws.row[flipped.rows.throws.side_after != right]
    assert wrong.size
    assert [row for row, *_ in flipped.misread] == wrong.tolist()
    assert all(column == "side_after" for _, column, *_ in flipped.misread)
    share, low, high = flipped.misread_rate
    assert share == wrong.size / 100
    # Clopper and Pearson: so many or more at the lower end, so few or fewer at the upper one
    assert binom.sf(wrong.size - 1, 100, low) == pytest.approx(0.025)
    assert binom.cdf(wrong.size, 100, high) == pytest.approx(0.025)
    for name in PLACES:
        assert flipped[name].value == pytest.approx(clean[name].value, abs=1e-3 * clean[name].half)
    assert clean.misread == ()


def test_a_side_before_that_is_recorded_wrong_is_seen_too():
    throws = filmed(4)[1]
    bad = throws.side_before.copy()
    bad[7] = (bad[7] + 2) % 3
    found = ls.fit(aimed_at(), replace(throws, side_before=bad))
    assert found.misread == ((9, "side_before", int(bad[7]), int(throws.side_before[7])),)


@pytest.mark.sweep  # many fits
def test_shifts_by_flipped_sides_are_below_a_standard_error():
    shifts = {name: [] for name in PLACES}
    for truth, found in fifteen(0.05):
        for name in PLACES:
            # the half of a 95 % interval is about two standard errors
            shifts[name].append((found[name].value - truth[name]) / (0.5 * found[name].half))
    for name, each in shifts.items():
        assert abs(np.median(each)) < 1.0, name


@pytest.mark.sweep
def test_throws_that_follow_each_other_share_readings():
    draw = np.random.default_rng(6)
    inside = 0
    for _ in range(5):
        truth = machine(draw)
        found = ls.fit(aimed_at(), run_film(draw, truth, 60), error="0.02 in")
        assert found.rows.throws.shared.sum() == 59
        fitted = [name for name in PLACES if name not in found.held]
        inside += sum(found[name].lo <= truth[name] <= found[name].hi for name in fitted)
    assert inside >= binom.ppf(1e-4, 5 * len(PLACES), 0.95) - 1


def test_the_error_of_measurement_is_found_from_places_read_twice():
    draw = np.random.default_rng(7)
    found = ls.fit(aimed_at(), run_film(draw, machine(draw), 80, twice=True))
    # 79 differences of two readings: their spread is known to an eighth or so
    assert found.error == pytest.approx(0.02, rel=0.4)
    assert not found.landing.at_most


def test_without_an_error_the_scatter_is_a_bound():
    truth, throws = filmed(8, known=False)
    found = ls.fit(aimed_at(), throws)
    assert found.error is None
    assert found.landing.at_most
    assert found.landing.hi > LANDING
    assert all(found[name].lo <= truth[name] <= found[name].hi for name in PLACES)


def test_what_the_throws_cannot_tell_is_kept_and_named():
    throws = filmed(9, 400)[1]
    alike = (throws.side_before == 2) & (throws.side_after == 2) & (np.abs(throws.x_before - 10.0) < 2.0)
    few = {name: each[alike] for name, each in arrays_of(throws).items()}
    found = ls.fit(aimed_at(), replace(throws, **few))
    assert found.held
    for name in found.held:
        assert found.scene.value(name) == pytest.approx(aimed_at().value(name))
    assert not {each.name for each in found.quantities} & set(found.held)


def test_the_scene_holds_values_uncertainty_and_scatter():
    truth, throws = filmed(10)
    given = ls.load("paper-designed")
    found = ls.fit(given, throws)
    again = ls.load(found.scene.as_dict())
    speed = found["throw.speed"]  # gravity is given: it is the speed that is fitted
    assert speed.unit == "rad/s"
    assert speed.lo <= np.sqrt(given.gravity / truth[KAPPA]) <= speed.hi
    assert again.value("throw.speed") == pytest.approx(speed.value)
    assert again.tolerance["throw.speed"].of(speed.value) == pytest.approx(speed.half, rel=0.01)
    assert again.tolerance[HEIGHT].of(1.0) == pytest.approx(found[HEIGHT].half, rel=0.01)
    assert again.world.scatter.landing.value == pytest.approx(found.landing.value, rel=0.01, abs=1e-9)
    assert again.goal == given.goal
    assert again.map.a == pytest.approx(ls.load(described(truth)).map.a, abs=0.1)


def test_the_same_film_gives_the_same_fit():
    throws = filmed(11)[1]
    one, two = (ls.fit(aimed_at(), throws) for _ in range(2))
    assert [each.value for each in one.quantities] == [each.value for each in two.quantities]
    assert one.misfit == two.misfit


def test_from_far_away_the_same_maximum_is_found():
    throws = filmed(12)[1]
    near = ls.fit(aimed_at(), throws)
    far = ls.fit(aimed_at().with_values({KAPPA: 28.0, ALONG: 4.0, HEIGHT: -0.35, RADIUS: 1.1}), throws)
    for name in PLACES:
        assert far[name].value == pytest.approx(near[name].value, abs=0.02 * near[name].half)


def test_places_without_any_error_give_the_truth():
    truth, throws = filmed(13, error=0.0, speed=0.0, landing=0.0, known=False)
    found = ls.fit(aimed_at(), throws)
    for name in PLACES:
        assert found[name].value == pytest.approx(truth[name], abs=1e-5)
    assert found[RADIUS].lo <= truth[RADIUS] <= found[RADIUS].hi


def test_further_throws_sharpen_as_they_say():
    """Ten more throws from where it says, against ten more from a place next to it that nobody recommends."""
    truth, throws = filmed(14)
    found = ls.fit(aimed_at(), throws)
    best = found.further[0]
    assert best.gain > 0
    assert sorted(each.side for each in found.further) == [0, 1, 2]
    name = max((n for n in best.shrinks if n in PLACES), key=lambda n: best.shrinks[n])
    halves = []
    for at in ((best.x, best.side), (4.0, 0)):
        more = vars(film(np.random.default_rng(15), truth, 10, at=at))
        both = {key: np.concatenate([each, more[key]]) for key, each in arrays_of(throws).items()}
        halves.append(ls.fit(aimed_at(), type(throws)(**both))[name].half)
    assert halves[0] < halves[1]
    assert found[name].half / halves[0] == pytest.approx(best.shrinks[name], rel=0.35)


def test_what_goes_with_a_held_quantity_has_no_interval():
    throws = filmed(5, 10, error=0.5)[1]
    found = ls.fit(aimed_at(), throws)
    assert found.held[KAPPA].startswith("the landings do not tell it apart from arm.surface_height")
    height = found[HEIGHT]
    assert (height.lo, height.hi) == (-np.inf, np.inf)
    assert HEIGHT not in found.scene.tolerance
    assert found.undetermined[HEIGHT] == KAPPA
    assert not height.bounded
    assert any(line.startswith(f"{HEIGHT} is not determined by these throws") for line in lines_of(found))
    assert found.to_json()["quantities"][HEIGHT]["lo"] is None


@pytest.mark.parametrize("seed", [3, 4, pytest.param(6, marks=pytest.mark.sweep)])
def test_intervals_end_where_no_part_exists(seed):
    found = ls.fit(aimed_at(), filmed(seed, 10, error=0.5, corner=True)[1])
    base, left, right = 6.75, 5.75, 3.6
    foot = (base**2 + left**2 - right**2) / (2.0 * base)
    top = np.sqrt(left**2 - foot**2)
    for name, most in ((ALONG, base), (ABOVE, top), (RADIUS, base / 2.0), (KAPPA, np.inf)):
        if name in found.held or (np.isinf(found[name].lo) and np.isinf(found[name].hi)):
            continue
        assert -1e-9 <= found[name].lo <= found[name].value <= found[name].hi <= most + 1e-9, name


def test_an_end_that_the_throws_do_not_set_is_that_of_the_part():
    found = ls.fit(aimed_at(), filmed(80, corner=True)[1])
    radius = found[RADIUS]
    assert radius.lo == pytest.approx(0.0, abs=1e-12)
    assert RADIUS not in found.scene.tolerance
    assert not radius.bounded


def test_the_scene_is_written_in_the_units_of_the_file():
    throws = filmed(15, speed=0.0)[1]
    given = ls.load("paper-designed").with_values({ALONG: "107.33 mm", "throw.speed": "26.3 rpm"})
    found = ls.fit(given, throws)
    text = found.scene.as_dict()
    assert text["part"]["mass"]["center"]["along"].endswith(" mm")
    assert text["throw"]["speed"].endswith(" rpm")
    assert text["tolerance"][ALONG].endswith(" mm")
    assert found.scene.value(ALONG) == pytest.approx(found[ALONG].value)
    assert found.scene.tolerance[ALONG].of(1.0) == pytest.approx(found[ALONG].half, rel=0.01)


def test_a_scatter_that_may_be_above_0_is_not_written_as_0():
    found = ls.fit(aimed_at(), filmed(5, 12, error=0.3, speed=0.0, landing=0.0)[1])
    assert 0.0 in (found.speed.value, found.landing.value)
    written = found.scene.world.scatter
    for size, scatter in ((written.speed.value, found.speed), (written.landing.value, found.landing)):
        assert size == pytest.approx(scatter.value or scatter.hi, rel=0.01)
        assert size > 0.0
