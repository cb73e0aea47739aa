"""The command that does all, for the paper's scenes and any other, and what accuracy costs."""

from __future__ import annotations

import json
import math
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import limitsets as ls
from limitsets.base.errors import AnswerError, GridError, LimitsetsError, SceneError
from limitsets.feeder.thrower import impact_angles
from limitsets.parameters.analysis import in_limit_sets, other_vertex_first, plan_for
from limitsets.parameters.analysis.accuracy import _distance, _Visited
from limitsets.systems.maps import codes
from tests.scene.four_gon import FOUR_GON
from tests.test_paper import LIMIT_SETS

# ----------------------------------------------------------------
# All answers at once: the paper's scenes, parts with more sides, goals of every kind, and the JSON form.


HERE = Path(__file__).parent
PAPER = ["paper-designed", "paper-designed-small-angle", "paper-initial", "paper-initial-small-angle"]
MORE = [HERE / "four-sides.toml", HERE / "five-sides.toml"]


@lru_cache(maxsize=16)
def analysed(source, cells=4096):
    return ls.analyse(source, cells)


def changed(name, **tables):
    return {**ls.load(name).as_dict(), **tables}


def from_far(**changes):
    """Weak throws with a high arm: nothing stays on it."""
    weak = {"throw.kappa": 60.0, "arm.surface_height": -0.5}
    return ls.load(HERE / "five-sides.toml").with_values(weak | changes)


@pytest.mark.parametrize("name", PAPER)
def test_the_paper_scenes_have_one_attractor_that_takes_all(name):
    found = analysed(name)
    assert len(found.attractors) == 1
    assert found.basins.attractors[0] == pytest.approx(1.0, abs=1e-9)
    assert found.spurious == ()
    assert found.extents_from == ("end points",)
    assert found.attractors[0].flip_order == (0, 1, 2)
    assert found.second_pass < 0.01


@pytest.mark.parametrize("name", PAPER)
def test_the_goal_and_its_sharp_threshold(name):
    goal = analysed(name).goal
    threshold = max(LIMIT_SETS[name][side][-1][1] for side in (0, 1))
    assert goal.holds is (threshold <= 20.0)
    assert goal.threshold == pytest.approx(threshold, abs=1e-9)
    assert goal.how == "sampled"


@pytest.mark.parametrize(
    ("name", "borders"),
    [("paper-designed", {0: 20.1517, 1: 26.4235}), ("paper-initial", {0: 26.9141})],
)
def test_other_vertex_first(name, borders):
    scene = ls.load(name)
    found = other_vertex_first(scene)
    assert set(found) == {0, 1, 2}
    for side, parts in found.items():
        if side not in borders:
            assert parts == []
            continue
        ((lo, hi),) = parts
        assert lo == pytest.approx(borders[side], abs=1e-4)
        assert hi == scene.arm_length
        at, below = impact_angles(scene.map, [lo, np.nextafter(lo, 0.0)], side)
        assert below <= scene.sides.corner[side] < at
    assert in_limit_sets(found, analysed(name).extents[:1]) == {}


def test_other_vertex_first_agrees_with_single_throws():
    from limitsets.feeder.thrower import trace

    scene = ls.load(HERE / "five-sides.toml")
    found = other_vertex_first(scene)
    assert any(found.values())
    for side in range(5):
        for x in np.linspace(10.0, 70.0, 25):
            inside = any(lo <= x <= hi for lo, hi in found[side])
            assert inside == trace(scene.map, x, side).other_vertex_first[0]


@pytest.mark.parametrize("path", MORE, ids=lambda path: path.stem)
def test_more_sides(path):
    found = analysed(path)
    count = len(found.scene.sides)
    assert count == {"four-sides": 4, "five-sides": 5}[path.stem]
    assert found.attractors[0].flip_order == tuple(range(count))
    assert set(found.extents[0]) == set(range(count))
    assert set(found.critical_points) == set(found.other_vertex_first) == set(range(count))
    total = sum(found.basins.attractors) + sum(found.basins.exits.values()) + found.basins.undecided_between
    assert total == pytest.approx(1.0, abs=1e-9)
    orbit = ls.orbit(found.scene.map, *_inside(found), 5000)
    for side, parts in found.extents[0].items():
        x = orbit.x[orbit.side == side]
        assert all(any(lo - 1e-9 <= value <= hi + 1e-9 for lo, hi in parts) for value in x)


def _inside(found):
    lo, hi = found.extents[0][0][0]
    return 0.5 * (lo + hi), 0


def test_coarse_cells_are_told():
    found = analysed("paper-initial", 512)
    assert len(found.spurious) > 1000
    written = found.to_json()
    assert written["spurious_count"] == len(found.spurious)
    sizes = [one["cells"] for one in written["spurious"]]
    assert sizes == sorted((len(cells) for cells in found.spurious), reverse=True)[: len(sizes)]
    assert len(sizes) == 20
    assert found.extents[0][0] == [pytest.approx((13.522673689975, 20.915912223359), abs=1e-9)]


def test_nothing_stays():
    found = ls.analyse(from_far())
    assert found.attractors == found.limit_sets == found.extents == ()
    assert found.basins.exits["inward"] == pytest.approx(1.0, abs=1e-9)
    assert found.goal.holds is None  # "beyond 40 cm side 1" is said of nothing
    assert json.loads(json.dumps(found.to_json(), allow_nan=False))["goal"]["threshold"] is None


# ---------------------------------------------------------------- goals


@pytest.mark.parametrize(
    ("goal", "holds", "threshold"),
    [
        ({"attracts_all": True}, True, None),
        ({"flip_order": [1, 2, 0]}, True, None),
        ({"flip_order": [0, 2, 1]}, False, None),
        ({"stays_on_arm": True}, True, None),
        ({"stays_on_arm": True, "from_anywhere": True}, True, None),
        ({"reaches": {"x": "23 in", "side": 2}}, True, 23.383151921158),
        ({"reaches": {"x": "24 in", "side": 2}}, False, 23.383151921158),
        ({"reaches": {"x": "23 in", "side": 2, "every_orbit": True}}, None, 23.383151921158),
        ({"oriented_beyond": {"x": "19.7 in", "side": 2}}, False, 19.75268801485),
    ],
)
def test_goals_of_every_kind(goal, holds, threshold):
    found = ls.analyse(changed("paper-designed", goal=goal)).goal
    assert found.holds is holds
    assert found.threshold == (None if threshold is None else pytest.approx(threshold, abs=1e-9))


def test_a_goal_from_anywhere_counts_what_transients_reach():
    goal = {"oriented_beyond": {"x": "20 in", "side": 2}, "from_anywhere": True}
    found = ls.analyse(changed("paper-designed", goal=goal))
    reached = -np.inf
    for side in range(3):
        lo, hi = float(found.scene.domain.lo[side, 0]), float(found.scene.domain.hi[side, 0])
        images = ls.maps.images(found.scene.map, np.linspace(lo, hi, 20_001), side)
        other = (images.code >= 0) & (images.side != 2)
        reached = max(reached, images.x[other].max(initial=-np.inf))
    assert found.goal.holds is False
    assert found.goal.threshold == pytest.approx(reached, abs=1e-9)


def test_starts_that_leave_count_against_staying():
    goal = {"stays_on_arm": True, "from_anywhere": True}
    assert ls.analyse({**ls.load(MORE[0]).as_dict(), "goal": goal}).goal.holds is False
    assert ls.analyse({**from_far().as_dict(), "goal": {"stays_on_arm": True}}).goal.holds is False


@pytest.mark.parametrize("name", ["paper-designed", "paper-initial", "paper-quadrilateral"])
def test_every_x_that_is_proposed_holds_and_is_no_empty_promise(name):
    analysis = ls.analyse(name)
    assert analysis.choices
    for side, lo, hi in analysis.choices:
        off = 1e-6 * (hi - lo)
        for x, holds, vacuous in (
            (lo - off, False, False),
            (lo + off, True, False),
            (hi - off, True, False),
            (hi + off, True, True),
        ):
            goal = {"oriented_beyond": {"x": f"{x!r} in", "side": side}}
            outcome = ls.analyse(ls.load(name).as_dict() | {"goal": goal}).goal
            assert (outcome.holds, outcome.vacuous) == (holds, vacuous), (side, x)


# ---------------------------------------------------------------- JSON

WORDS = {
    "scene", "units", "cells", "critical_points", "attractors", "basins", "cycles", "goal", "other_vertex_first",
    "goal_vacuous", "choices", "effects", "spurious", "spurious_count", "second_pass", "timings", "accuracy", "starts",
    "advice",
}  # fmt: skip


def numbers_in(record):
    if isinstance(record, dict):
        assert all(isinstance(key, str) for key in record)
        record = list(record.values())
    if isinstance(record, list):
        for each in record:
            yield from numbers_in(each)
    else:
        yield record


@pytest.mark.parametrize("source", [*PAPER, *MORE], ids=str)
def test_json(source):
    found = analysed(source)
    record = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert set(record) == WORDS
    assert ls.load(record["scene"]) == found.scene
    sides = {str(side) for side in range(len(found.scene.sides))}
    assert set(record["critical_points"]) == set(record["other_vertex_first"]) == sides
    for points in record["critical_points"].values():
        assert all(set(point) == {"x", "kind"} for point in points)
        assert {point["kind"] for point in points} <= {"jog->flip", "flip->jog"}
        assert [point["x"] for point in points] == sorted(point["x"] for point in points)
    (attractor,) = record["attractors"]
    assert {"extents", "flip_order", "jogs_per_visit", "flips_per_throw", "lyapunov"} <= set(attractor)
    assert attractor["extents_from"] == "end points"
    assert record["effects"] == {"simulated": [], "switched_on": [], "left_out": {}, "tipping": []}
    extents = {str(side): [list(pair) for pair in parts] for side, parts in found.extents[0].items()}
    assert attractor["extents"] == extents
    exits = {"inward", "outward", "outside_model", "undefined"}
    assert set(record["basins"]) == {"attractors", "undecided_between", *exits}
    assert record["basins"]["undefined"] == 0.0
    assert set(record["starts"]) == {"count", "throws", "elsewhere", "contradicted"}
    assert record["advice"] == []
    assert record["accuracy"] is None
    if record["goal"] is not None:
        assert set(record["goal"]) == {"kind", "holds", "threshold", "how"}
    assert all(value is None or isinstance(value, str | bool | int | float) for value in numbers_in(record))


def test_a_lyapunov_exponent_that_is_no_number_is_null():
    from dataclasses import replace

    found = analysed("paper-designed")
    odd = replace(found, attractors=(replace(found.attractors[0], lyapunov=-np.inf),))
    assert odd.to_json()["attractors"][0]["lyapunov"] is None


def test_cycles_repel():
    found = ls.analyse("paper-designed", cycles=10)
    record = found.to_json()["cycles"]
    assert len(record) == len(found.cycles) > 0
    assert all(abs(cycle["multiplier"]) > 1 and len(cycle["x"]) == cycle["period"] <= 10 for cycle in record)


# ---------------------------------------------------------------- calls


def test_progress_and_timings_name_the_same_steps():
    seen = []
    found = ls.analyse("paper-designed", progress=lambda step, done, of: seen.append((step, done, of)))
    assert [step for step, _, _ in seen] == list(found.timings)
    assert [done for _, done, _ in seen] == list(range(len(seen)))
    assert {of for _, _, of in seen} == {len(seen)}


def test_a_scene_a_name_a_path_and_a_structure_are_the_same():
    scene = ls.load("paper-initial")
    several = [ls.analyse(source, 2048) for source in (scene, "paper-initial", scene.as_dict())]
    assert len({json.dumps(found.to_json()["attractors"]) for found in several}) == 1


def test_wrong_calls():
    with pytest.raises(SceneError):
        ls.analyse("no-such-scene")
    with pytest.raises(GridError):
        ls.analyse("paper-designed", 0)
    for wrong in ({"throws": 0}, {"cycles": -1}):
        with pytest.raises(AnswerError):
            ls.analyse("paper-designed", **wrong)
    with pytest.raises(AnswerError, match="not both"):
        ls.analyse("paper-designed", 64, error=1e-3)
    for error in (0, -1.0, math.nan, math.inf, "fine"):
        with pytest.raises(AnswerError, match="error"):
            ls.analyse("paper-designed", error=error)


# ---------------------------------------------------------------- random starts


@pytest.mark.sweep
def test_random_starts_that_stay_elsewhere_ask_for_finer_cells():
    """At 4096 cells a side the set that collects 83 % of the starts has an edge out; at 16 384 it has none."""
    found = ls.analyse(FOUR_GON)
    assert found.grid.shape[0, 0] == 16_384
    assert found.starts.missed == 0.0
    assert found.advice == ()
    assert found.basins.attractors == (pytest.approx(0.832, abs=0.002), pytest.approx(0.0194, abs=0.001))
    assert found.goal.holds is False  # a fixed point at 274.7 mm on side 3 never gets there


def test_cells_that_were_asked_for_are_kept_and_what_is_missing_is_said():
    found = ls.analyse(FOUR_GON, 4096)
    assert found.grid.shape[0, 0] == 4096
    assert found.starts.elsewhere == pytest.approx(0.83, abs=0.04)
    undecided, missing = found.advice
    assert "undecided; ask for finer cells" in undecided
    assert "where no limit set was found" in missing
    assert found.to_json()["advice"] == [undecided, missing]
    assert found.basins.undecided_between > 0.8


def test_a_goal_does_not_hold_where_starts_stay_that_nothing_is_known_of():
    goal = {"oriented_beyond": {"x": "200 mm", "side": 3}}
    found = ls.analyse({**FOUR_GON, "goal": goal}, 4096)
    assert found.goal.holds is None  # of the fixed point on side 3 alone it would hold


# ----------------------------------------------------------------
# Random scenes, some of them broken: an answer or an error of the package's own, in bounded time, and no nan.


UNITS = st.sampled_from(["m", "cm", "mm", "in", "ft"])


def powers(least: float, most: float) -> st.SearchStrategy[float]:
    return st.floats(least, most).map(lambda power: 10.0**power)


def triangle(size: float, draw: Any) -> dict[str, Any]:
    return {"sides": [size * draw(st.floats(0.5, 1.0)) for _ in range(3)]}


def needle(size: float, draw: Any) -> dict[str, Any]:
    top = [size * draw(st.floats(0.3, 0.7)), size * draw(powers(-13.0, -1.0))]
    return {"vertices": [[0.0, 0.0], [size, 0.0], top]}


def polygon(size: float, draw: Any) -> dict[str, Any]:
    count = draw(st.integers(3, 64))
    k = np.arange(count)
    angle = 2.0 * math.pi * (k + draw(st.floats(0.0, 0.3)) * np.cos(k))
    return {"vertices": [[size * math.cos(t / count), size * math.sin(t / count)] for t in angle]}


@st.composite
def scenes(draw: Any) -> dict[str, Any]:
    """Sizes from 1e-7 to 1e4, gravity and speed over all their range; some parts cannot rest, some are none."""
    unit, size = draw(UNITS), draw(powers(-7.0, 4.0))

    def written(value: Any) -> Any:
        return [written(entry) for entry in value] if isinstance(value, list) else f"{float(value)!r} {unit}"

    shape = draw(st.sampled_from([triangle, needle, polygon]))(size, draw)
    part: dict[str, Any] = {key: written(value) for key, value in shape.items()}
    if draw(st.booleans()):
        part["mass"] = {"plate_density": "1 kg/m^2"}
    else:
        centre = {
            "side": draw(st.integers(0, 3)),
            "along": written(size * draw(st.floats(-0.1, 0.9))),
            "above": written(size * draw(powers(-12.0, -0.3))),
        }
        part["mass"] = {"center": centre, "radius_of_gyration": written(size * draw(powers(-3.0, 1.0)))}
    if draw(st.booleans()):
        throw = {"throw": {"kappa": written(size * draw(powers(-6.0, 12.0) | powers(-0.5, 1.5)))}}
    else:
        speed = f"{draw(powers(-9.0, 9.0))!r} {draw(st.sampled_from(['deg/s', 'rad/s']))}"
        throw = {"throw": {"speed": speed}, "gravity": {"tilt": "30 deg"}}
    height = draw(st.sampled_from([-1.0, 1.0, 0.0])) * size * draw(powers(-6.0, 0.5))
    arm = {"surface_height": written(height), "length": written(size * draw(powers(-0.2, 2.0)))}
    model = {"flip": draw(st.sampled_from(["signed", "energy"]))}
    return {"name": "any", "part": part, "arm": arm, "model": model, **throw}


def check_throws(scene: ls.scene.Scene) -> None:
    for side in range(len(scene.sides)):
        a = float(scene.sides.a[side])
        for share in (1e-15, 1e-6, 0.1, 0.5, 1.0):
            path = ls.orbit(scene.map, a + (scene.arm_length - a) * share, side, 100)
            assert np.isfinite(path.x).all()
            assert (path.code[:-1] >= 0).all()
            assert path.code.size == 100 or path.stopped is not None
            assert ((path.side >= 0) & (path.side < len(scene.sides))).all()


@pytest.mark.sweep
@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(scenes())
def test_an_answer_or_an_error(table: dict[str, Any]) -> None:
    try:
        scene = ls.load(table)
        found = ls.analyse(scene, cells=16, throws=100)
    except LimitsetsError:
        return
    check_throws(scene)
    shares = [*found.basins.attractors, found.basins.undecided_between, *found.basins.exits.values()]
    assert math.isclose(sum(shares), 1.0, rel_tol=1e-9)
    assert found.basins.labels.min() >= codes.UNDEFINED
    assert found.basins.labels.max() < len(found.attractors)
    for limit, attractor in zip(found.limit_sets, found.attractors, strict=True):
        assert limit.converged or limit.advice
        assert attractor.stopped in (None, "stalled", *found.graph.exits)
    json.dumps(found.to_json(), allow_nan=False)


# ----------------------------------------------------------------
# An error asked for: which method is picked for it, and whether what is reached is true.


@pytest.mark.parametrize(
    ("name", "error"),
    [("paper-designed", error) for error in (0.5, 1e-3, 1e-10)]
    + [("paper-initial", error) for error in (0.05, 1e-6)],
)
def test_the_error_asked_for_is_met_and_known(name, error):
    plans = []
    found = ls.analyse(name, error=error, announce=plans.append)
    reached = found.accuracy
    assert plans == [reached.plan]
    assert reached.plan.expected
    assert reached.met
    # the ends above have twelve digits
    assert _distance(found.extents[0], LIMIT_SETS[name]) <= reached.reached + 1e-12
    assert found.extents_from == (reached.plan.chosen.method,)
    assert found.graph.grid.shape[0, 0] == reached.plan.chosen.cells
    assert reached.plan.chosen.error <= error


def test_cells_never_do_for_a_small_error():
    plan = plan_for(ls.load("paper-designed"), 1e-6)
    assert plan.chosen.method == "end points"
    assert plan.other.method == "cells"
    assert plan.other.error > 1e-6


def test_what_cannot_be_met_is_told():
    found = ls.analyse("paper-designed", error=1e-16)
    assert not found.accuracy.plan.expected
    assert not found.accuracy.met
    assert "rounding" in found.accuracy.advice
    assert found.accuracy.proved < 1e-10
    record = json.loads(json.dumps(found.to_json(), allow_nan=False))["accuracy"]
    assert record["met"] is False
    assert record["reached"] > record["asked"] == 1e-16


def test_where_nothing_stays_there_is_nothing_to_meet():
    found = ls.analyse(from_far(), error=1e-3)
    assert found.attractors == ()
    assert found.accuracy.reached is None
    assert not found.accuracy.met
    json.dumps(found.to_json(), allow_nan=False)


def test_distance_of_unions():
    assert _distance({0: [(0.0, 1.0)]}, {0: [(0.25, 1.5)]}) == 0.5
    assert _distance({0: [(0.0, 4.0)]}, {0: [(0.0, 1.0), (3.0, 4.0)]}) == 1.0  # the middle of the gap
    assert _distance({0: [(0.0, 4.0)]}, {0: [(0.0, 4.0)], 1: [(0.0, 1.0)]}) == float("inf")


def test_a_hole_counts_by_half():
    seen = _Visited(0, 0.0, 10.0, 0.01)
    seen.add(np.concatenate([np.arange(0.0, 4.0, 0.005), np.arange(6.0, 10.0, 0.005)]))
    assert seen.gap() == pytest.approx(1.0, abs=0.03)
