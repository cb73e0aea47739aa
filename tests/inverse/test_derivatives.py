"""Derivatives of critical points: against a closed form and implicit roots at 40 digits, and where there are none."""

import importlib.util
import math
import sys
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, SceneError
from limitsets.feeder.thrower import impact_angles
from limitsets.parameters.design import critical_jacobian


def load_exact():
    place = Path(__file__).with_name("exact.py")
    spec = importlib.util.spec_from_file_location("exact_critical_points", place)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


exact = load_exact()
PAPER = (exact.ALONG, exact.ABOVE, exact.SPEED)
ALL = (exact.ALONG, exact.ABOVE, exact.KAPPA, exact.RHO, exact.H, *exact.SIDES)


def quantities(scene, names=ALL):
    return {name: scene.value(name) for name in (*ALL, *names)}


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


# the last three: hardly above side 2; near a corner (a_0 = 0.064, d_0 = 0.038); near an end, where side 0 has no r > a
@pytest.mark.parametrize(
    "scene",
    [
        changed("paper-initial-small-angle"),
        changed("paper-designed-small-angle"),
        changed("paper-initial-small-angle", ALONG=4.6, ABOVE=0.0003, KAPPA=60.0),
        changed("paper-initial-small-angle", ALONG=4.83, ABOVE=3.0, KAPPA=60.0),
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
        assert found.x[side] == pytest.approx(float(r), rel=1e-14)
        wanted = [float(exact.slope(lambda at, k=side: exact.closed_form(at, k), q, name)) for name in ALL]
        size = float(np.abs(wanted).max())
        assert found.matrix[side] == pytest.approx(wanted, rel=1e-11, abs=1e-13 * size)


MODELS = [("exact", "signed"), ("exact", "energy"), ("small-angle", "signed"), ("small-angle-2", "energy")]


@pytest.mark.parametrize(("flight", "flip"), MODELS)
@pytest.mark.parametrize("name", ["paper-initial", "paper-designed"])
def test_implicit_roots_at_40_digits(name, flight, flip):
    scene = changed(name, {"flight": flight, "flip": flip})
    q, found = quantities(scene), critical_jacobian(scene, *ALL)
    sides = np.flatnonzero(np.isfinite(found.x)).tolist()
    # the known table of first critical points: with small angles and signs initial has none, designed two
    assert len(sides) == {("paper-initial", "signed"): 0, ("paper-designed", "signed"): 2}.get(
        (name, flip) if flight == "small-angle" else None, 3
    )
    for side in sides:
        near = (found.x[side], impact_angles(scene.map, found.x[[side]], side)[0])
        assert found.x[side] == pytest.approx(
            float(exact.critical_point(q, side, flight, flip, near)), rel=1e-14
        )

        def root(at, side=side, near=near):
            return exact.critical_point(at, side, flight, flip, near)

        columns = range(len(ALL)) if (flight, flip) == MODELS[0] else (0, 2, 3, 4)
        wanted = [float(exact.slope(root, q, ALL[k])) for k in columns]
        size = float(np.abs(wanted).max())
        assert found.matrix[side, columns] == pytest.approx(wanted, rel=1e-11, abs=1e-13 * size)


def differences(scene, names, step=1e-5):
    columns = []
    for name in names:
        value = scene.value(name)
        far = step * max(abs(value), 0.1)
        up, down = (critical_jacobian(scene.with_values({name: value + s * far})).x for s in (1, -1))
        columns.append((up - down) / (2 * far))
    return np.array(columns).T


def test_a_plate_with_points_by_vertices_and_tilt():
    scene = ls.load(
        {
            "name": "kite",
            "part": {
                "vertices": [["0 cm", "0 cm"], ["10 cm", "-1 cm"], ["12 cm", "7 cm"], ["3 cm", "8 cm"]],
                "mass": {
                    "plate_density": "5 kg/m^2",
                    "points": [
                        {"x": "7 cm", "y": "2 cm", "mass": "30 g"},
                        {"x": "6 cm", "y": "5 cm", "mass": "20 g"},
                    ],
                },
            },
            "arm": {"surface_height": "-5 mm", "length": "150 cm"},
            "throw": {"speed": "150 deg/s"},
            "gravity": {"tilt": "30 deg"},
            "model": {"flight": "exact", "flip": "signed"},
        }
    )
    names = [f"part.vertices[{k}].{axis}" for k in range(4) for axis in "xy"]
    names += [f"part.mass.points[{k}].{word}" for k in range(2) for word in ("x", "y", "mass")]
    names += ["throw.speed", "gravity.tilt", "arm.surface_height"]
    found = critical_jacobian(scene, *names)
    assert found.x == pytest.approx(
        [points[0].x for points in ls.critical_points(scene.map, scene.domain).values()]
    )
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
    meet, gone = critical_jacobian(three(many), exact.H), critical_jacobian(three(few), exact.H)
    assert "two critical points meet" in meet.reasons[0]
    assert math.isnan(meet.matrix[0, 0])
    assert gone.x[0] > 19.0
    assert "another critical point is about to be the first, at x = 1" in gone.reasons[0]
    assert math.isnan(gone.matrix[0, 0])
    assert gone.reasons[1:] == (None, None)  # other sides keep theirs
    assert np.isfinite(gone.matrix[1:]).all()


def roots_in_a_turn(scene, side, x):
    """How often the height of the vertex over the arm changes its sign, by the plain formula."""
    a, d, phi = (
        float(scene.sides.a[side]),
        float(scene.sides.d[side]),
        np.linspace(1e-6, 2.0 * np.pi, 200_001),
    )
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

    assert x == pytest.approx(float(root(q)), rel=1e-14)
    wanted = [float(exact.slope(root, q, name)) for name in ALL]
    size = float(np.abs(wanted).max())
    assert found.matrix[side] == pytest.approx(wanted, rel=1e-11, abs=1e-13 * size)


@pytest.mark.parametrize(
    ("names", "error"),
    [
        (("throw.sped",), SceneError),
        (("landing.x",), SceneError),
        (("gravity.tilt",), SceneError),
        (("throw.speed", "throw.kappa"), SceneError),
        (("part.vertices[0].x",), SceneError),
        (("throw.speed", "throw.speed"), AnswerError),
    ],
)
def test_refusals(names, error):
    with pytest.raises(error):
        critical_jacobian("paper-designed", *names)


def test_a_scene_with_effects_is_refused():
    tree = ls.load("paper-initial").as_dict() | {"effects": {"landing": True, "roll": True}}
    with pytest.raises(AnswerError, match="minimal model"):
        critical_jacobian(ls.load(tree), "throw.speed")
