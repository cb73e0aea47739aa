"""Designs for a critical point, and their derivatives."""

import json
import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError, SceneError
from limitsets.feeder.thrower import impact_angles
from limitsets.parameters.design import critical_jacobian, limit_sets_along, solving as trials
from tests.inverse import exact

# ----------------------------------------------------------------
# Design: both pairs of the paper, what is counted, the nearest in both senses, and what cannot be.


ALONG, ABOVE, SPEED, KAPPA = exact.ALONG, exact.ABOVE, exact.SPEED, exact.KAPPA
PAPER = (ALONG, ABOVE, SPEED)
WANTED = (10.0, 10.0, 20.0)


ALL = (ALONG, ABOVE, KAPPA, exact.RHO, exact.H, *exact.SIDES)


def quantities(scene):
    return {name: scene.value(name) for name in ALL}


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
    size = np.ptp(found.start.vertices, axis=0).max()
    assert found.scene.sides.d[2] == pytest.approx(1e-3 * size, rel=1e-3)  # as near as a part is let
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


# ----------------------------------------------------------------
# Derivatives of critical points: against a closed form and implicit roots at 40 digits, and where there are none.


def changed(name, model=None, **values):
    scene = ls.load(name)
    if values:
        scene = scene.with_values({getattr(exact, word): value for word, value in values.items()})
    return scene if model is None else ls.load(scene.as_dict() | {"model": model})


# determinants and condition numbers: known numbers of the four scenes, from an independent program
@pytest.mark.parametrize(
    ("name", "determinant", "condition"),
    [
        ("paper-initial-small-angle", 641.8, 14.8),
        ("paper-designed-small-angle", 530.3, 6.9),
        ("paper-initial", 4846.9, 11.1),
        ("paper-designed", 2152.1, 7.1),
    ],
)
def test_determinants_of_the_paper_scenes(name, determinant, condition):
    found = critical_jacobian(name, *PAPER)
    assert found.determinant == pytest.approx(determinant, abs=0.06)
    assert found.condition == pytest.approx(condition, abs=0.06)
    assert found.reasons == (None,) * 3


def require_root(found, side, root, columns=slice(None)):
    """Hold a critical point and its derivatives against a root at 40 digits."""
    q = quantities(found.scene)
    assert found.x[side] == pytest.approx(float(root(q)), rel=1e-14)
    wanted = [float(exact.slope(root, q, str(name))) for name in np.array(ALL)[columns]]
    size = float(np.abs(wanted).max())
    assert found.matrix[side, columns] == pytest.approx(wanted, rel=1e-11, abs=1e-13 * size)


# the last three: hardly above side 2; near a corner (a_0 = 0.064, d_0 = 0.038); near an end, where side 0 has no r > a
@pytest.mark.parametrize(
    "scene",
    [
        changed("paper-initial-small-angle"),
        changed("paper-designed-small-angle"),
        changed("paper-initial-small-angle", ALONG=4.6, ABOVE=0.0003, KAPPA=60.0),
        changed("paper-initial-small-angle", ALONG=4.83, ABOVE=3.0, KAPPA=60.0, RHO=0.7),
        changed("paper-initial-small-angle", ALONG=6.1, ABOVE=0.5, KAPPA=40.0),
    ],
    ids=["initial", "designed", "level", "corner", "end"],
)
def test_small_angle_closed_form(scene):
    q, found = quantities(scene), critical_jacobian(scene, *ALL)
    for side in range(3):
        r = exact.closed_form(q, side)
        if r < scene.sides.a[side]:
            assert np.isnan(found.x[side])
            continue
        require_root(found, side, lambda at, k=side: exact.closed_form(at, k))


MODELS = [("exact", "signed"), ("exact", "energy"), ("small-angle", "signed"), ("small-angle-2", "energy")]


@pytest.mark.parametrize(("flight", "flip"), MODELS)
@pytest.mark.parametrize("name", ["paper-initial", "paper-designed"])
def test_implicit_roots_at_40_digits(name, flight, flip):
    scene = changed(name, {"flight": flight, "flip": flip})
    found = critical_jacobian(scene, *ALL)
    sides = np.flatnonzero(np.isfinite(found.x)).tolist()
    # the known table of first critical points: with small angles and signs initial has none, designed two
    assert len(sides) == {("paper-initial", "signed"): 0, ("paper-designed", "signed"): 2}.get(
        (name, flip) if flight == "small-angle" else None, 3
    )
    for side in sides:
        near = (found.x[side], impact_angles(scene.map, found.x[[side]], side)[0])

        def root(at, side=side, near=near):
            return exact.critical_point(at, side, flight, flip, near)

        require_root(found, side, root, slice(None) if (flight, flip) == MODELS[0] else [0, 2, 3, 4])


def differences(scene, names, step=1e-5):
    columns = []
    for name in names:
        value = scene.value(name)
        far = step * max(abs(value), 0.1)
        up, down = (critical_jacobian(scene.with_values({name: value + s * far})).x for s in (1, -1))
        columns.append((up - down) / (2 * far))
    return np.array(columns).T


def test_a_plate_with_points_by_vertices_and_tilt():
    text = """
    name = "kite"
    part.vertices = [["0 cm", "0 cm"], ["10 cm", "-1 cm"], ["12 cm", "7 cm"], ["3 cm", "8 cm"]]
    part.mass.plate_density = "5 kg/m^2"
    part.mass.points = [{x="7 cm", y="2 cm", mass="30 g"}, {x="6 cm", y="5 cm", mass="20 g"}]
    arm = {surface_height = "-5 mm", length = "150 cm"}
    throw.speed = "150 deg/s"
    gravity.tilt = "30 deg"
    """
    scene = ls.load(text)
    names = [f"part.vertices[{k}].{axis}" for k in range(4) for axis in "xy"]
    names += [f"part.mass.points[{k}].{word}" for k in range(2) for word in ("x", "y", "mass")]
    names += ["throw.speed", "gravity.tilt", "arm.surface_height"]
    found = critical_jacobian(scene, *names)
    assert found.x == pytest.approx(points_of(scene))
    wanted = differences(scene, names)
    assert np.abs(found.matrix - wanted).max() < 1e-7 * np.abs(wanted).max()
    # the same plate by its thickness, and the same speed in turns per minute
    tree = scene.as_dict()
    tree["part"]["mass"] |= {"plate_density": "2.5 g/cm^3", "plate_thickness": "2 mm"}
    tree["throw"] = {"speed": "25 rpm"}
    again = critical_jacobian(ls.load(tree), *names)
    assert again.matrix == pytest.approx(found.matrix, rel=1e-9)
    # moving the whole part moves nothing: the columns of all x, and of all y, add up to nothing
    for axis in "xy":
        columns = [k for k, name in enumerate(names) if name.endswith(f".{axis}")]
        assert np.abs(found.matrix[:, columns].sum(axis=1)).max() < 1e-12 * np.abs(found.matrix).max()
    assert found.determinant is None
    assert found.condition > 1.0


def test_slacks_are_what_keeps_the_part_at_rest():
    found = critical_jacobian("paper-designed", exact.ALONG, exact.ABOVE)
    sides = found.scene.sides
    assert found.slack == pytest.approx(np.column_stack([sides.a, sides.right, sides.d]).ravel(), rel=1e-13)
    # side 2 is where along and above are measured
    assert found.slack_matrix[6:].tolist() == [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]]


def test_speed_of_a_scene_that_does_not_know_it():
    """kappa = g / w^2: d r / d ln w = -2 kappa dr / dkappa, whatever g."""
    tree = ls.load("paper-designed").as_dict()
    del tree["gravity"]
    bare = critical_jacobian(ls.load(tree), "throw.speed")
    by_kappa = critical_jacobian("paper-designed", "throw.kappa")
    assert bare.values.tolist() == [1.0]
    assert bare.scaled == pytest.approx(-2.0 * by_kappa.scaled, rel=1e-13)
    assert critical_jacobian("paper-designed", "throw.speed").scaled == pytest.approx(bare.scaled, rel=1e-13)
    # a throw given by kappa holds gravity in it
    assert not critical_jacobian("paper-designed", "gravity.acceleration").matrix.any()


def test_a_critical_point_beyond_the_arm_is_still_there():
    tree = ls.load("paper-designed").as_dict()
    del tree["goal"]
    short = critical_jacobian(ls.load(tree).with_values({"arm.length": 15.0}), *PAPER)
    whole = critical_jacobian("paper-designed", *PAPER)
    assert short.x[2] > 15.0
    assert short.matrix == pytest.approx(whole.matrix, rel=1e-12)


def test_none_where_every_throw_is_decided_alike():
    scene = changed("paper-initial-small-angle", {"flight": "small-angle", "flip": "signed"})
    found = critical_jacobian(scene, *PAPER)
    assert np.isnan(found.x).all()
    assert found.reasons == ("every throw is decided alike",) * 3
    assert found.determinant is None
    assert found.condition is None
    record = found.to_json()
    assert record["critical_points"] == [None] * 3
    assert record["matrix"] == [[None] * 3] * 3


def three(h):
    """Energy alone decides: side 0 changes three times, at 14.17, 18.24 and 20.00 for kappa 33.06 and h -0.5."""
    scene = changed("paper-initial", {"flight": "exact", "flip": "energy"})
    return scene.with_values({exact.H: h, exact.KAPPA: 33.06})


def test_the_first_of_three():
    scene = three(-0.5)
    points = [round(point.x, 2) for point in ls.critical_points(scene.map, scene.domain)[0]]
    assert points == pytest.approx([14.17, 18.24, 20.0], abs=0.02)
    found = critical_jacobian(scene, exact.KAPPA)
    assert found.x[0] == pytest.approx(14.17, abs=0.02)
    assert found.matrix[0, 0] == pytest.approx(differences(scene, [exact.KAPPA])[0, 0], rel=1e-6)


def test_where_the_first_two_of_three_meet():
    """Between h -0.3 (three) and -0.1 (one) two of them meet, dr/dh growing like a root's, and are gone."""
    few, many = -0.1, -0.3
    first = critical_jacobian(three(many), exact.H)
    assert critical_jacobian(three(few)).x[0] > 19.0
    slopes = [abs(first.matrix[0, 0])]
    while (middle := 0.5 * (few + many)) not in (few, many):
        found = critical_jacobian(three(middle), exact.H)
        if found.x[0] < 19.0:
            many = middle
            slopes.append(abs(found.matrix[0, 0]))
        else:
            few = middle
    assert np.nanmax(slopes) > 1e4 * slopes[0]
    meet, gone = (critical_jacobian(three(height), exact.H) for height in (many, few))
    assert "two critical points meet" in meet.reasons[0]
    assert math.isnan(meet.matrix[0, 0])
    assert gone.x[0] > 19.0
    assert "another critical point is about to be the first, at x = 1" in gone.reasons[0]
    assert math.isnan(gone.matrix[0, 0])
    assert gone.reasons[1:] == (None, None)  # other sides keep theirs
    assert np.isfinite(gone.matrix[1:]).all()


def roots_in_a_turn(scene, side, x):
    """How often the height of the vertex over the arm changes its sign, by the plain formula."""
    a, d, phi = scene.sides.a[side], scene.sides.d[side], np.linspace(1e-6, 2.0 * np.pi, 200_001)
    over = x * phi - a * np.sin(phi) + d * (1.0 - np.cos(phi)) - 0.5 * scene.kappa * phi**2 > 0.0
    return int(np.count_nonzero(over[1:] != over[:-1]))


def test_where_the_decision_jumps():
    """kappa < ell: on side 2 an earlier impact appears (a grazing flight), on side 1 a part lands upside down."""
    scene = changed("paper-initial", ALONG=3.7577, ABOVE=1.0369, KAPPA=3.1744, RHO=1.6827, H=-1.4335)
    found = critical_jacobian(scene, exact.KAPPA)
    assert "the decision jumps" in found.reasons[1]
    assert "the decision jumps" in found.reasons[2]
    assert np.isnan(found.matrix[1:]).all()
    x = found.x[2]
    assert {roots_in_a_turn(scene, 2, x - 1e-3), roots_in_a_turn(scene, 2, x + 1e-3)} == {3, 1}
    phi = impact_angles(scene.map, [found.x[1]], 1)[0]
    a, d = scene.sides.a[1], scene.sides.d[1]
    assert abs(a * math.cos(phi) - d * math.sin(phi)) < 1e-9  # X = 0
    assert a * math.sin(phi) + d * math.cos(phi) < 0.0  # H < 0


def first_impact(q, side, x):
    """Where the height of the vertex over the arm is negative for the first time, by the plain formula [rad]."""
    (a, d), phi = map(float, exact.feet(q)[side]), np.linspace(1e-6, 2.0 * np.pi, 200_001)
    over = x * phi - a * np.sin(phi) + d * (1.0 - np.cos(phi)) - 0.5 * q[exact.KAPPA] * phi**2
    return float(phi[np.flatnonzero(over < 0.0)[0]])


# A centre that is past the vertex would fall on over it, but the part comes down turning back (omega < 0): where that
# is just enough to lift it back, K = V, jog and flip change places.  Upside down (H < 0) the other form of V counts.
PAST = {"ALONG": 4.44, "ABOVE": 0.75, "KAPPA": 33.3, "RHO": 0.43, "H": -3.3}
UPSIDE_DOWN = {"ALONG": 3.9, "ABOVE": 0.55, "KAPPA": 3.6, "RHO": 0.42, "H": 6.0}
SHORT_OF_IT = {"ALONG": 4.45, "ABOVE": 2.42, "KAPPA": 1.2, "RHO": 2.09, "H": -3.3}


@pytest.mark.parametrize(
    ("values", "side", "past", "upright"),
    [
        (PAST, 0, True, True),
        (PAST, 1, True, True),
        (PAST, 2, True, True),
        (UPSIDE_DOWN, 0, True, False),
        (UPSIDE_DOWN, 1, True, False),
        (SHORT_OF_IT, 0, False, False),
    ],
)
def test_a_centre_past_the_vertex(values, side, past, upright):
    scene = changed("paper-initial", **values)
    q, found = quantities(scene), critical_jacobian(scene, *ALL)
    x, model = found.x[side], ("exact", "signed")
    phi = first_impact(q, side, x)
    a, d = map(float, exact.feet(q)[side])
    right, above = a * math.cos(phi) - d * math.sin(phi), a * math.sin(phi) + d * math.cos(phi)
    assert (right < -0.1, above > 0.1) == (past, upright)
    assert abs(right) > 0.1
    assert abs(above) > 0.1
    moment = q[exact.RHO] ** 2 + right * (x - q[exact.KAPPA] * phi) + above * (q[exact.H] + d)
    assert (moment < -0.1) == past
    assert found.reasons[side] is None
    below, beyond = (exact.margin(q, side, *model, x * (1.0 + s), phi) > 0.0 for s in (-1e-9, 1e-9))
    assert found.kinds[side] == {(False, True): "jog->flip", (True, False): "flip->jog"}[below, beyond]

    def root(at):
        return exact.critical_point(at, side, *model, (x, phi))

    require_root(found, side, root)


NO_NAMES = [(name,) for name in ("throw.sped", "landing.x", "gravity.tilt", "part.vertices[0].x")]
REFUSED = [(names, SceneError) for names in (*NO_NAMES, ("throw.speed", "throw.kappa"))]


@pytest.mark.parametrize(("names", "error"), [*REFUSED, (("throw.speed", "throw.speed"), AnswerError)])
def test_refusals_of_derivatives(names, error):
    with pytest.raises(error):
        critical_jacobian("paper-designed", *names)


def test_a_scene_with_effects_is_refused():
    tree = ls.load("paper-initial").as_dict() | {"effects": {"landing": True, "roll": True}}
    with pytest.raises(AnswerError, match="minimal model"):
        critical_jacobian(ls.load(tree), "throw.speed")
