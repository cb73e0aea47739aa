"""Continuation: events at parameters known in closed form, from 40 digits, or by bands on both sides."""

import json
import math
import re
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError, MapError, SceneError
from limitsets.base.files import as_json
from limitsets.parameters.continuation import following
from limitsets.parameters.continuation.growth import attracting_cycles, recorded
from limitsets.parameters.continuation.path import Place, between
from limitsets.systems.maps import advance
from limitsets.systems.sets import limit_set_of
from tests.maps_of_tests import Linear2, TwoState
from tests.sets.part import Part, mp


class Steps(NamedTuple):
    """A tent with jumps at `low` and `high`, where the image is lifted beyond them.

    Known answers for 0.1 of lift, low 0.25 and high 0.9: as long as the tent's core [s (1 - s/2), s/2] lies between the
    jumps it is the attractor; its upper end meets `high` at s = 1.8, its lower end `low` at s = 1 + sqrt(1/2).
    """

    slope: float = 1.7
    low: float = 0.25
    high: float = 0.9
    lift: float = 0.1


def steps(params: Steps, x: float, side: int) -> tuple[float, int, int]:
    if x < params.low:
        return params.slope * x + params.lift, side, 0
    if x < 0.5:
        return params.slope * x, side, 1
    if x < params.high:
        return params.slope * (1.0 - x), side, 2
    return params.slope * (1.0 - x) + params.lift, side, 3


def steps_on(params: Steps, x: float, side: int, branch: int) -> tuple[float, int, float]:
    lift = params.lift if (branch == 0) | (branch == 3) else 0.0
    if branch >= 2:
        return params.slope * (1.0 - x) + lift, side, -params.slope
    return params.slope * x + lift, side, params.slope


ls.register(Steps, image=steps, image_on=steps_on, branches=("lifted up", "up", "down", "lifted down"))


def left(x, mu, slope):
    return slope * x + mu


def right(x, mu, other, jump):
    return other * x + mu - jump


def border(x):
    return x


def kink(mu=-1.0, slope=0.5, other=-0.5, jump=0.0):
    """Give the normal form of a border collision in one dimension, or with a jump beyond 0.

    Known answers at mu = 0 without one (Nusse and Yorke, Physica D 57, 1992): for 0 < slope < 1 the fixed point
    mu / (1 - slope) of mu < 0 becomes that of the other branch where abs(other) < 1, and a cycle of period 2, one point
    on each branch, where other < -1 < slope other.
    """
    return ls.map(pieces=(left, right), margin=border, mu=mu, slope=slope, other=other, jump=jump)


def delayed(x, y, a):
    """Delayed logistic map: a circle about (1 - 1/a, 1 - 1/a) attracts from a = 2 to beyond 2.26."""
    return a * x * (1.0 - y), x


LINE = [(0.0, 1.0)]


def middle(event, name):
    return 0.5 * (event.values[0][name] + event.values[1][name])


def of_kind(found, kind):
    return [event for event in found.events if event.kind == kind]


def of_top(r, count):
    """F^count(1/2) of the logistic map."""
    x = mp.mpf(1) / 2
    for _ in range(count):
        x = r * x * (1 - x)
    return x


def window_end():
    """r where F^3(c) falls on the unstable 3-cycle: F^6(c) = F^9(c), at 40 digits."""
    return float(mp.findroot(lambda r: of_top(r, 6) - of_top(r, 9), (3.8567, 3.8569)))


MERGING = float(max(np.roots([1.0, -2.0, -4.0, -8.0]).real))  # F^3(c) = 1 - 1/r

LOGISTIC = {
    "flip": (2.9, 3.1, 3.0, "period 1 -> period 2"),
    "second flip": (3.42, 3.47, 1.0 + math.sqrt(6.0), "period 2 -> period 4"),
    "tangent": (3.8282, 3.8286, 1.0 + math.sqrt(8.0), "at least 1 band -> period 3"),
    "bands merge": (3.675, 3.68, MERGING, "2 bands -> 1 band"),
    "interior crisis": (3.8566, 3.857, window_end(), "3 bands -> 1 band"),
}


@pytest.mark.parametrize("name", LOGISTIC)
def test_bifurcations_of_the_logistic_map(name):
    first, last, at, change = LOGISTIC[name]
    found = ls.continuation(maps.Logistic(3.0), {"r": (first, last)}, steps=1)
    assert [(event.kind, event.change) for event in found.events] == [("bands", change)]
    (event,) = found.events
    assert event.t[1] - event.t[0] <= 1e-9
    assert abs(middle(event, "r") - at) < 2e-9
    assert event.before == event.after == (0,)
    # A crisis and a tangent bifurcation change the set at once, the others from nothing on.
    assert (event.jump > 0.1) == (name in ("tangent", "interior crisis"))
    assert event.jump > 0.1 or event.jump < 1e-4
    assert event.collision is None


def test_the_numbers_of_the_logistic_map():
    assert abs(MERGING - 3.678573510428322) < 1e-14
    assert window_end() == pytest.approx(3.8568, abs=1e-4)  # Grebogi, Ott, Yorke, Physica D 7, 1983


def test_bands_of_the_logistic_map_in_closed_form():
    found = ls.continuation(maps.Logistic(3.6), {"r": (3.70, 3.71)}, steps=2)
    for r, states in zip(found.values["r"], found.attractors, strict=True):
        if states[0].period == 0:
            assert states[0].decided
            (lo, hi) = states[0].extents[0][0]
            assert abs(hi - r / 4.0) < 1e-12
            assert abs(lo - r * (r / 4.0) * (1.0 - r / 4.0)) < 1e-12


@pytest.mark.parametrize("period", [6, 7, 8])
def test_long_transients_hide_no_cycle(period):
    """The last superstable cycle below r = 4: most orbits wander for thousands of steps before they come to it."""
    guess = 4.0 - 10.0 / 4.0**period
    r = float(mp.findroot(lambda r: of_top(r, period) - mp.mpf(1) / 2, (guess, guess + 1e-3 / 4.0**period)))
    found = ls.continuation(maps.Logistic(3.0), lambda t: {"r": r}, steps=1)
    assert [state.period for states in found.attractors for state in states.values()] == [period] * 2


def test_an_attractor_leaves_at_four():
    found = ls.continuation(maps.Logistic(3.0), {"r": (3.9999, 4.0001)}, steps=3)
    (death,) = of_kind(found, "death")
    assert abs(middle(death, "r") - 4.0) < 1e-9
    assert death.after == ()
    assert found.attractors[-1] == {}
    # F(1/2) = r / 4 leaves [0, 1].
    assert (death.collision.k, death.collision.x, death.collision.change) == (1, 1.0, "end of the domain")


def test_two_attractors_merge_and_split():
    """x' = r x - x^3: the two chaotic sets of one sign each meet at 0 where F^2(c) = 0, r = 3 sqrt(3) / 2.

    Two cycles nearer than rounding lets a slope of 1 be told are one at r = 1: (16 eps)^(2/3) and more.
    """
    for first, last, steps, kind, at, numbers, near in (
        (2.59, 2.605, 1, "merge", 1.5 * math.sqrt(3.0), ((0, 1), (0,)), 1e-9),
        (2.605, 2.59, 1, "split", 1.5 * math.sqrt(3.0), ((0,), (0, 1)), 1e-9),
        (0.9, 1.1, 4, "split", 1.0, ((0,), (0, 1)), 5e-9),
    ):
        found = ls.continuation(maps.Cubic(1.5), {"r": (first, last)}, steps=steps, domain=[(-2.0, 2.0)])
        (event,) = of_kind(found, kind)
        assert abs(middle(event, "r") - at) < near
        assert (event.before, event.after) == numbers


@pytest.mark.repeats  # of a tangent bifurcation, as in a window of the logistic map
def test_the_first_tongue_of_the_circle_map_ends():
    found = ls.continuation(maps.Circle(0.0, 0.5), {"omega": (0.078, 0.081)}, steps=1)
    first = found.events[0]
    assert first.kind == "bands"
    assert first.change.startswith("period 1 -> ")
    assert abs(middle(first, "omega") - 0.5 / math.tau) < 1e-9


# ---------------------------------------------------------------- border collisions


def test_ends_of_a_band_meet_jumps_where_they_should():
    found = ls.continuation(Steps(), {"slope": (1.65, 1.85)}, steps=2, domain=LINE)
    collisions = of_kind(found, "border collision")
    expected = [(1.0 + math.sqrt(0.5), 0.25, 2, ("down",)), (1.8, 0.9, 1, ())]
    assert len(collisions) == 2
    for event, (at, x, k, rest) in zip(collisions, expected, strict=True):
        assert event.t[1] - event.t[0] <= 1e-9
        assert event.values[0]["slope"] < at < event.values[1]["slope"]
        met = event.collision
        assert (met.k, met.side, met.start_side, met.start) == (k, 0, 0, pytest.approx(0.5, abs=1e-15))
        assert met.x == pytest.approx(x, abs=1e-12)
        # The tent is continuous at 1/2: both limits lead there.
        assert met.limit in ("c-", "c+")
        assert met.itinerary == ("up" if met.limit == "c-" else "down", *rest)
    assert collisions[1].collision.change == "down->lifted down"


@pytest.mark.parametrize(("other", "change"), [(-0.5, ""), (-1.5, "period 1 -> period 2")])
def test_a_point_of_a_cycle_meets_the_border(other, change):
    found = ls.continuation(kink(other=other), {"mu": (-0.5, 0.73)}, steps=1, domain=[(-2.0, 2.0)])
    (event,) = found.events
    assert (event.kind, event.change) == ("border collision", change)
    assert event.values[0]["mu"] < 0.0 < event.values[1]["mu"]
    assert event.t[1] - event.t[0] <= 1e-9
    assert (event.collision.k, event.collision.limit) == (1, "cycle")
    assert event.collision.x == pytest.approx(0.0, abs=1e-9)
    last = found.attractors[-1][0].extents[0]
    mu, period_two = 0.73, other < -1.0
    # x1 = slope x0 + mu and x0 = other x1 + mu; or mu / (1 - other).
    low = mu * (1.0 + other) / (1.0 - 0.5 * other)
    points = [low, 0.5 * low + mu] if period_two else [mu / (1.0 - other)]
    assert [lo for lo, _ in last] == pytest.approx(points, abs=1e-12)
    (told,) = json.loads(as_json(found))["events"]
    assert (told["kind"], told["collision"]["start"]) == ("border collision", None)
    assert told["collision"]["itinerary"] in (["left"], ["right"]) or period_two
    assert "words" not in told


def test_a_touch_and_two_collisions_within_a_step():
    def along(highest):
        path = lambda t: {"slope": highest - 0.2 * (t - 0.55) ** 2}  # noqa: E731
        return ls.continuation(Steps(), path, steps=10, domain=LINE).events

    (touch,) = along(1.8)
    assert touch.kind == "touch"
    assert touch.t[0] < 0.55 < touch.t[1]
    assert (touch.collision.k, touch.collision.x) == (1, pytest.approx(0.9, abs=1e-9))
    events = along(1.8001)
    assert [event.kind for event in events] == ["border collision"] * 2
    for event, sign in zip(events, (-1.0, 1.0), strict=True):
        assert abs(sum(event.t) / 2.0 - (0.55 + sign * math.sqrt(0.0005))) < 1e-9


def test_a_cycle_begins_with_its_least_point_wherever_an_orbit_is():
    """From each point of the cycle of period 3 of the logistic map, which rises twice and falls."""
    place = Place(0.0, {}, {}, maps.Logistic(3.84), ls.grid([(0.0, 1.0)]).domain)
    x, _, _, _ = advance(place.params, [0.4], 0, 3000)
    for _ in range(3):
        (cycle,), _ = attracting_cycles(place, recorded(place, x, np.zeros(1, np.int64), 3))
        assert cycle.x.tolist() == sorted(cycle.x.tolist())
        assert cycle.x[1:] == pytest.approx(3.84 * cycle.x[:-1] * (1.0 - cycle.x[:-1]))
        x = 3.84 * x * (1.0 - x)


def test_no_border_where_the_map_is_smooth():
    """At r = 1 + sqrt(5) a point of the 2-cycle passes the top 1/2, which names two branches and is no border."""
    found = ls.continuation(maps.Logistic(3.0), {"r": (3.2, 3.3)}, steps=4)
    assert found.events == ()


# ---------------------------------------------------------------- throws


def collision_of_part(start, word, target):
    """kappa where an orbit from critical point `start` along `word` meets that of side `target`, at 40 digits."""

    def gap(kappa):
        part = Part("paper-initial", ("-0.2", "3.9867006", "1.8835981", kappa))
        side, near = start
        x = part.critical_point(side, near)
        for branch in word:
            x, side = part.throw(x, side, branch)
        assert side == target[0]
        return x - part.critical_point(*target)

    return gap


@pytest.mark.parametrize(
    ("first", "last", "bands"), [("120.5 deg/s", "121.5 deg/s", (7, 8)), ("135.8 deg/s", "137 deg/s", (5, 4))]
)
def test_a_throw_meets_a_border_where_40_digits_say(first, last, bands):
    scene = ls.load("paper-initial")
    found = ls.continuation(scene, {"throw.speed": (first, last)}, steps=1)
    (event,) = found.events
    assert event.kind == "border collision"
    assert event.t[1] - event.t[0] <= 1e-9
    assert event.change == f"{bands[0]} bands -> {bands[1]} bands"
    met = event.collision
    assert len(met.itinerary) == met.k
    assert met.limit == ("c-" if met.itinerary[0] == "jog" else "c+")  # jogs below r_i, flips from there on
    gap = collision_of_part((met.start_side, met.start), met.itinerary, (met.side, met.x))
    gravity = mp.mpf(scene.value("gravity.acceleration"))
    ends = [gravity / mp.mpf(values["throw.speed"]) ** 2 for values in event.values]
    assert gap(ends[0]) * gap(ends[1]) < 0
    # Bands on both sides by images of a whole neighbourhood, from outside.
    for values, step, count in zip(event.values, (-1e-7, 1e-7), bands, strict=True):
        there = scene.with_values({"throw.speed": values["throw.speed"] + step})
        graph = ls.transitions(there.map, ls.grid(there.domain, cells=8192))
        (cells,) = ls.attractors(graph, throws=1000)
        outer = limit_set_of(there.map, cells.extents, there.domain).extents
        assert sum(len(parts) for parts in outer.values()) == count


def test_the_set_begins_where_the_longest_jog_ends_on_the_arm():
    """paper-designed: below some speed the jog from r_2 - 0 passes the arm's end, 28 in."""
    scene = ls.load("paper-designed")
    found = ls.continuation(scene, {"throw.speed": ("140 deg/s", "142 deg/s")}, steps=1)
    (birth,) = found.events
    assert (birth.kind, birth.before, birth.after) == ("birth", (), (0,))
    assert birth.t[1] - birth.t[0] <= 1e-9
    met = birth.collision
    assert (met.change, met.x, met.side) == ("end of the domain", 28.0, 2)
    assert (met.k, met.limit, met.itinerary, met.start_side) == (1, "c-", ("jog",), 2)
    gravity = mp.mpf(scene.value("gravity.acceleration"))
    ends = []
    for values in birth.values:
        kappa = gravity / mp.mpf(values["throw.speed"]) ** 2
        part = Part("paper-designed", ("-0.2", "4.2255778", "0.7082490", kappa))
        ends.append(part.throw(part.critical_point(2, met.start), 2, "jog")[0] - 28)
    assert ends[0] > 0 > ends[1]


# ---------------------------------------------------------------- cells, numbers, forms


def test_births_and_deaths_on_cells(monkeypatch):
    """Below r = 1/2 all goes to the origin, from there on to one of (r, r) and (-r, -r)."""
    looks, confirmed = [], following.confirmed

    def counted(snapshot):
        looks.append(snapshot)
        assert (
            len(looks) <= 40
        )  # at the 4 ends of steps, at 3 places for each of log2(1/3 / 1e-4) < 12 halvings
        return confirmed(snapshot)

    monkeypatch.setattr(following, "confirmed", counted)
    square = [(-2.0, 2.0), (-2.0, 2.0)]
    found = ls.continuation(TwoState(1.0), {"r": (0.3, 0.8)}, steps=3, cells=64, domain=square)
    assert sorted(event.kind for event in found.events) == ["birth", "birth", "death"]
    for event in found.events:
        assert event.values[0]["r"] < 0.5 <= event.values[1]["r"]
        assert event.t[1] - event.t[0] <= 1e-4
        # not more digits than the cells allow: both ends
        assert " at r = 0.4999" in str(event) or " at r = 0.5000" in str(event)
        assert " to 0.500" in str(event)
    assert set(found.attractors[0]) == {0}
    assert set(found.attractors[-1]) == {1, 2}
    assert found.critical[0] == {}


START = np.full((4, 2), [0.4, 0.5]) + 0.01 * np.arange(4)[:, None]


def after_long(a):
    """Where four starts are after 100 000 steps."""
    return advance(ls.map(delayed, a=a), START, np.zeros(4, np.int64), 100_000)[0]


@pytest.mark.parametrize("domain", [(0.0, 1.0), (0.01, 1.0)])
def test_what_coarse_cells_lose_is_no_death(domain):
    """On 128 cells no set is closed from about a = 2.1 on, though orbits stay."""
    for a in (2.1, 2.15, 2.2):
        assert (after_long(a) > 0.01).all()
        assert (after_long(a) < 1.0).all()
    square = [domain, domain]
    found = ls.continuation(ls.map(delayed, a=2.0), {"a": (2.05, 2.2)}, steps=4, cells=128, domain=square)
    assert (found.events, found.numbers) == ((), (0,))
    assert all(list(states) == [0] for states in found.attractors)


def test_a_death_on_cells_has_the_bracket_that_they_allow():
    # beyond a = 2.28 orbits leave; before 2.26 they stay
    assert (after_long(2.26) > 0.0).all()
    assert not (after_long(2.29) > 0.0).any()
    found = ls.continuation(
        ls.map(delayed, a=2.0), {"a": (2.2, 2.4)}, steps=2, cells=128, domain=[*LINE, *LINE]
    )
    (death,) = found.events
    assert death.kind == "death"
    assert death.values[0]["a"] < 2.29
    assert death.values[1]["a"] > 2.26
    assert re.search(r"at a = 2\.\d{1,4} to 2\.\d{1,4}:", str(death))


def test_a_step_on_which_finer_cells_do_not_agree_is_left_out():
    """A quarter turn that grows.

    At 1.0005 orbits from within 0.2 of the origin stay for 3000 steps, and nothing attracts them.
    """
    turns = {"xy": (-0.5, -1.501), "yx": (0.5, 1.501)}
    square = [(-1.0, 1.0), (-1.0, 1.0)]
    path = ls.continuation(Linear2(0.0, -0.5, 0.5, 0.0), turns, steps=2, cells=16, domain=square)
    assert 0.5 not in path.t
    for growth, states in zip(path.values["yx"], path.attractors, strict=True):
        assert len(states) == (growth < 1.0)


def test_ends_of_a_bracket_are_rounded_outward():
    def place(value):
        return Place(0.0, {"a": value}, {"a": (value, " in")}, None, None)

    assert between(place(2.25234), place(2.28611)) == "a = 2.252 to 2.287 in"
    assert between(place(2.28611), place(2.25234)) == "a = 2.287 to 2.252 in"
    assert between(place(1234.0), place(5678.0)) == "a = 1200 to 5700 in"
    assert between(place(2.0), place(2.0 + 1e-10)) == "a = 2 in"


def test_any_curve_and_its_forms():
    def curve(t):
        return maps.Logistic(3.2 + 0.01 * math.sin(math.pi * t))

    steps = []
    found = ls.continuation(maps.Logistic(3.0), curve, steps=2, progress=lambda *what: steps.append(what))
    assert steps == [("steps", 0, 2), ("steps", 1, 2), ("steps", 2, 2)]
    assert found.values["r"] == pytest.approx([3.2, 3.21, 3.2])
    assert found.numbers == (0,)
    table = json.loads(as_json(found))
    assert [step["attractors"]["0"]["period"] for step in table["steps"]] == [2, 2, 2]
    assert table["steps"][0]["critical_points"] == {"0": [0.5]}
    assert table["events"] == []
    frame = found.to_dataframe()
    assert list(frame.columns) == ["t", "r", "attractor", "period", "decided", "side", "band", "lo", "hi"]
    assert len(frame) == 6
    assert (frame.lo == frame.hi).all()


@pytest.mark.parametrize(
    ("unit", "per_degree"), [("deg/s", 1.0), ("rad/s", np.pi / 180.0), ("rpm", 1.0 / 6.0)]
)
def test_events_are_told_in_the_units_of_the_scene(unit, per_degree):
    scene = ls.load("paper-designed").with_values({"throw.speed": f"{158.0 * per_degree!r} {unit}"})
    found = ls.continuation(scene, {"throw.speed": ("140 deg/s", "142 deg/s")}, steps=1)
    event = found.events[0]
    value = np.degrees(event.values[0]["throw.speed"]) * per_degree
    assert f"at throw.speed = {value:.10g} {unit}" in str(event)


def test_what_is_no_path_is_refused():
    for subject, path, options, error in (
        (maps.Logistic(3.0), {"r": (3.0, 3.1)}, {"steps": 0}, AnswerError),
        *(
            (maps.Logistic(3.0), path, {}, AnswerError)
            for path in ({"r": 3.0}, {}, {"q": (3.0, 3.1)}, lambda t: 3.0)
        ),
        (
            kink(),
            lambda t: {"mu": 1.0} if t < 1.0 else {"slope": 0.5},
            {"domain": [(-2.0, 2.0)]},
            AnswerError,
        ),
        (kink(), {"mu": (-1.0, 1.0)}, {}, MapError),
        ("paper-designed", {"throw.sped": (1.0, 2.0)}, {}, SceneError),
        ("paper-designed", {"throw.speed": (2.6, 2.7)}, {"domain": LINE}, AnswerError),
        ("paper-designed", {"throw.speed": ("1 in", "2 in")}, {}, SceneError),
    ):
        with pytest.raises(error):
            ls.continuation(subject, path, **options)


@pytest.mark.sweep
def test_bands_beyond_the_resolution_are_told_as_the_least_there_are():
    # periods of 128, 256 and 512: they double at 3.569934 and 3.569943, and doublings accumulate at 3.5699457
    found = ls.continuation(maps.Logistic(3.569), {"r": (3.56993, 3.569944)}, steps=2)
    last = found.attractors[-1][0]
    assert (last.period, last.decided) == (0, False)
    assert last.words().startswith("at least ")
    assert any("-> at least " in event.change for event in found.events)
    assert not any(event.change.count("at least") == 2 for event in found.events)


@pytest.mark.sweep
def test_a_change_at_zero_is_told_as_zero():
    # beyond mu = 2 / 15 the cycle of period 4 is another: its point next to the jump meets x = 0 there
    found = ls.continuation(
        kink(0.13, other=0.5, jump=1.0), {"mu": (0.13, 0.134)}, domain=[(-2, 2)], steps=2, most=30
    )
    told = [str(event) for event in found.events if event.collision]
    assert told
    assert all("at x = 0 on side 0" in text for text in told)
