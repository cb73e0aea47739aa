"""Design: both pairs of the paper, what is counted, the nearest in both senses, and what cannot be."""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError, SceneError
from limitsets.parameters.design import critical_jacobian, limit_sets_along
from limitsets.parameters.design import solving as trials

PLACE = Path(__file__).with_name("exact.py")
spec = importlib.util.spec_from_file_location("exact_critical_points_of_designs", PLACE)
exact = importlib.util.module_from_spec(spec)
sys.modules[spec.name] = exact
spec.loader.exec_module(exact)

ALONG, ABOVE, SPEED, KAPPA = exact.ALONG, exact.ABOVE, exact.SPEED, exact.KAPPA
PAPER = (ALONG, ABOVE, SPEED)
WANTED = (10.0, 10.0, 20.0)


def quantities(scene):
    return {name: scene.value(name) for name in (ALONG, ABOVE, KAPPA, exact.RHO, exact.H, *exact.SIDES)}


def points_of(scene):
    return [points[0].x for points in ls.critical_points(scene.map, scene.domain).values()]


@pytest.fixture
def counted(monkeypatch):
    """Count every computation of critical points that a search makes, from outside."""
    calls = []

    def spy(scene, *names):
        calls.append(scene)
        return critical_jacobian(scene, *names)

    monkeypatch.setattr(trials, "critical_jacobian", spy)
    return calls


# along, above, kappa: the built-in designed scenes, whose decimals hold to about 1e-7
@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("paper-initial-small-angle", (4.4179581, 0.5040259, 48.6228609)),
        ("paper-initial", (4.2255778, 0.7082490, 25.3778518)),
    ],
)
def test_the_pairs_of_the_paper(name, known, counted, tmp_path):
    start = ls.load(name)
    found = ls.design(start, critical_points=WANTED, vary=PAPER)
    assert found.reached
    assert found.evaluations == len(counted) <= 25
    ls.dump(found.scene, tmp_path / "designed.toml")
    again = ls.load(tmp_path / "designed.toml")
    assert points_of(again) == pytest.approx(WANTED, abs=1e-9)
    if again.flip == "energy":
        r = [float(exact.closed_form(quantities(again), side)) for side in range(3)]
        assert r == pytest.approx(WANTED, abs=1e-9)
    assert [again.value(word) for word in (ALONG, ABOVE, KAPPA)] == pytest.approx(known, abs=1e-5)
    assert again.value(SPEED) > start.value(SPEED)
    assert again.name == f"{name}-design"
    assert found.path[0] == start
    assert found.path[-1] is found.scene
    assert found.scene.kappa == again.kappa
    assert found.residual == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert found.condition == pytest.approx(6.9 if again.flip == "energy" else 7.1, abs=0.06)


@pytest.mark.parametrize("name", ["paper-initial-small-angle", "paper-initial"])
def test_perturbed_starts_reach_the_same_point(name):
    scene, random, ends = ls.load(name), np.random.default_rng(7), []
    center = np.array([scene.value(ALONG), scene.value(ABOVE), np.log(scene.kappa)])
    for _ in range(6):
        along, above, log = (center + 0.1 * random.standard_normal(3)).tolist()
        start = scene.with_values({ALONG: along, ABOVE: above, KAPPA: float(np.exp(log))})
        found = ls.design(start, critical_points=WANTED, vary=(ALONG, ABOVE, KAPPA), starts=0)
        assert found.reached
        assert found.evaluations <= 25
        ends.append([after for _, after, _ in found.quantities().values()])
    assert np.ptp(ends, axis=0).max() < 1e-8


def test_stages_move_the_targets_evenly(counted):
    start = ls.load("paper-initial")
    found = ls.design(start, critical_points=WANTED, vary=PAPER, stages=4)
    assert found.reached
    assert len(found.path) == 5
    assert found.evaluations == len(counted)
    first = points_of(start)
    for stage, scene in enumerate(found.path):
        between = [a + stage / 4 * (b - a) for a, b in zip(first, WANTED, strict=True)]
        assert points_of(scene) == pytest.approx(between, abs=1e-6)
    sets = limit_sets_along(found)
    # known limit sets of both ends of the path (40 digits, another program); the path's end is not the rounded decimal
    assert sets[0][0][2] == [pytest.approx((16.262705754, 21.886351326), abs=1e-8)]
    assert sets[-1][0][2] == [pytest.approx((8.914025908, 23.383151921), abs=1e-5)]


def test_continuation_where_newton_fails():
    """Targets far away, taken from a part that is there: centre of mass (0.609, 0.376), kappa 26.013."""
    part = {ALONG: 0.609, ABOVE: 0.376, KAPPA: 26.013}
    start = ls.load("paper-initial")
    wanted = points_of(start.with_values(part))
    found = ls.design(start, critical_points=wanted, vary=tuple(part), starts=0)
    assert found.reached
    assert points_of(found.scene) == pytest.approx(wanted, abs=1e-9)
    assert found.how == "continuation in the targets"


def seen(found):
    """Derivatives and the way gone, in shares and sizes of the part: the unknowns in which nearest is meant."""
    names = found.jacobian.names
    size = float(np.ptp(found.start.vertices, axis=0).max())
    logs = np.array([name.startswith("throw.") or "radius" in name or ".sides" in name for name in names])
    before = np.array([found.start.value(name) for name in names])
    after = np.array([found.scene.value(name) for name in names])
    way = np.where(logs, np.log(np.where(logs, after / before, 1.0)), (after - before) / size)
    return found.jacobian.matrix * np.where(logs, after, size), way


@pytest.mark.parametrize(
    ("vary", "wanted"),
    [((*PAPER, exact.RHO, exact.H), WANTED), (PAPER, (10.0, None, 20.0)), (PAPER, (None, None, "15 in"))],
)
def test_more_quantities_than_targets_gives_the_nearest(vary, wanted):
    """Lagrange: at the nearest point the way gone is a combination of the gradients of the targets."""
    found = ls.design("paper-initial", critical_points=wanted, vary=vary)
    assert found.reached
    sides = [side for side, target in enumerate(wanted) if target is not None]
    targets = [float(str(wanted[side]).removesuffix(" in")) for side in sides]
    assert [points_of(found.scene)[side] for side in sides] == pytest.approx(targets, abs=1e-9)
    assert [found.residual[side] is None for side in range(3)] == [side not in sides for side in range(3)]
    slope, way = seen(found)
    multipliers = np.linalg.lstsq(slope[sides].T, way, rcond=None)[0]
    assert np.linalg.norm(way - slope[sides].T @ multipliers) < 1e-4 * np.linalg.norm(way)
    assert "nearest" in found.how


def test_fewer_quantities_than_targets_gives_least_squares():
    """One unknown: the closed form on a fine grid of speeds says where the least sum of squares is."""
    start = ls.load("paper-initial-small-angle")
    found = ls.design(start, critical_points=WANTED, vary=[KAPPA], starts=2)
    assert not found.reached
    assert "1 varied for 3 wanted" in found.message
    q = quantities(start)

    def cost(kappa):
        try:
            r = [float(exact.closed_form({**q, KAPPA: kappa}, side)) for side in range(3)]
        except TypeError:  # complex: none there
            return np.inf
        return sum((a - b) ** 2 for a, b in zip(r, WANTED, strict=True))

    grid = np.geomspace(5.0, 200.0, 2001)
    best = grid[np.argmin([cost(kappa) for kappa in grid])]
    assert found.scene.kappa == pytest.approx(best, rel=2e-3)
    assert sum(value**2 for value in found.residual) <= cost(best) * (1.0 + 1e-12)


def test_bounds_hold_and_are_said():
    bounds = {ALONG: ("3 in", "4 in"), SPEED: (None, 3.5)}
    found = ls.design("paper-initial", critical_points=WANTED, vary=PAPER, bounds=bounds, starts=1)
    assert not found.reached
    assert found.scene.value(ALONG) == pytest.approx(4.0, abs=1e-5)
    assert f"{ALONG} is at its upper bound" in found.message
    # least squares on that bound: the free quantities' gradients are nothing, that of along points beyond it
    gradient = np.array(found.residual) @ found.jacobian.scaled
    size = np.linalg.norm(found.residual) * np.linalg.norm(found.jacobian.scaled)
    assert np.abs(gradient[1:]).max() < 1e-4 * size
    assert gradient[0] < -1e-3 * size


def test_what_cannot_be_reached_says_what_is_in_the_way():
    found = ls.design("paper-initial", critical_points=[4, 4, 27.9], vary=PAPER, starts=0)
    assert not found.reached
    assert found.message.startswith("not reached: the nearest found misses by")
    assert "the centre of mass is at the level of side 2" in found.message
    assert found.scene.sides.d[2] < 0.02
    misses = [x - target for x, target in zip(points_of(found.scene), (4, 4, 27.9), strict=True)]
    assert misses == pytest.approx(found.residual, abs=1e-9)
    fixed = ls.design("paper-initial", critical_points=[None, None, 25], vary=["part.sides[0]"], starts=0)
    assert "the critical point of side 2 does not depend on what is varied" in fixed.message


@pytest.mark.sweep
def test_a_start_without_critical_points():
    """Small angles and signs: initial has none (known table, none below 80), so other starts are drawn."""
    tree = ls.load("paper-initial-small-angle").as_dict()
    start = ls.load(tree | {"model": {"flight": "small-angle", "flip": "signed"}})
    found = ls.design(start, critical_points=[10, None, None], vary=(*PAPER, exact.RHO), starts=3)
    assert found.reached
    assert "drawn" in found.how
    points = ls.critical_points(found.scene.map, found.scene.domain)
    assert points[0][0].x == pytest.approx(10.0, abs=1e-9)
    record = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert record["before"]["critical_points"] == [None] * 3
    assert record["residual"][1:] == [None, None]
    none = ls.design(start, critical_points=[10, 10, 10], vary=[exact.H], starts=1)
    assert not none.reached
    assert "no scene tried has all the critical points wanted" in none.message
    assert none.residual == (None, None, None)
    assert none.scene == start


def test_an_open_speed():
    tree = ls.load("paper-initial").as_dict()
    del tree["gravity"]
    found = ls.design(ls.load(tree), critical_points=WANTED, vary=PAPER)
    assert found.reached
    assert found.scene.kappa == pytest.approx(25.3778518, abs=1e-5)
    before, after, unit = found.quantities()[SPEED]
    assert (before, unit) == (1.0, "of its own value")
    assert after == pytest.approx((33.3605945 / 25.3778518) ** 0.5, rel=1e-6)


@pytest.mark.parametrize(
    ("words", "error", "says"),
    [
        ({"critical_points": [10, 10]}, AnswerError, "3, one for each side"),
        ({"critical_points": [None] * 3}, AnswerError, "not all free"),
        ({"critical_points": [10, 10, 30]}, AnswerError, "up to 28 in"),
        ({"critical_points": [10, 10, "20 deg"]}, SceneError, "unit of angle"),
        ({"critical_points": [10, 10, float("nan")]}, AnswerError, "argument critical_points"),
        ({"vary": []}, AnswerError, "one or more"),
        ({"vary": [ALONG, ALONG]}, AnswerError, "each once"),
        ({"vary": ["part.mass.centre.along"]}, SceneError, "did you mean"),
        ({"vary": ["landing.x"]}, SceneError, "noise of landings"),
        ({"vary": [ALONG, "arm.length"]}, AnswerError, "depend on"),
        ({"vary": [ALONG, "gravity.acceleration"]}, AnswerError, "gravity is part of that"),
        ({"vary": [SPEED, KAPPA]}, SceneError, "leave out one of"),
        ({"bounds": {exact.H: (0, 1)}}, AnswerError, "that is varied"),
        ({"bounds": {ALONG: (5, 4)}}, AnswerError, "lowest below"),
        ({"bounds": {ALONG: "4 in"}}, AnswerError, "give a pair"),
    ],
)
def test_refusals(words, error, says):
    with pytest.raises(error) as caught:
        ls.design("paper-initial", **{"critical_points": WANTED, "vary": PAPER, **words})
    assert isinstance(caught.value, LimitsetsError)
    assert says in str(caught.value)
