"""Plates with notches and holes in proofs: the numbers of both readers against closed forms, and files made false."""

import copy

import flint
import pytest

import limitsets as ls
from limitsets.base import AnswerError, SceneError
from limitsets.feeder.scene.quantities import replaced
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.proofs.prover.stability import stability
from tests.plates import bracket
from tests.proofs import forge
from tests.proofs.test_recheck import checker

pytestmark = pytest.mark.usefixtures("precision")


# As the prover writes a scene into a file.
MODEL = {"model": {"flight": "exact", "flip": "signed"}}


def closed_form() -> tuple[flint.arb, flint.arb, flint.arb]:
    """Centre of mass and squared radius of gyration of the bracket, from rectangles, a triangle and a disc [mm, g]."""
    arb = flint.arb
    by_area = arb(157) / 10_000  # 7850 kg/m^3 x 2 mm, in g/mm^2
    disc = arb.pi() * 25

    def block(sign: int, x: int, y: int, wide: int, high: int) -> tuple[flint.arb, ...]:
        second = arb(wide * wide + high * high) / 12
        return sign * arb(wide * high), arb(2 * x + wide) / 2, arb(2 * y + high) / 2, second

    # a right triangle with legs of 10: its polar moment about the centre is m (10^2 + 10^2)/18
    pieces = [block(1, 0, 0, 80, 40), block(1, 0, 40, 40, 40), block(-1, 30, 0, 20, 5)]
    pieces += [(-disc, arb(20), arb(60), arb(25) / 2), (arb(-50), arb(40) / 3, arb(40) / 3, arb(200) / 18)]
    masses = [(by_area * area, x, y, own) for area, x, y, own in pieces] + [
        (arb(18), arb(60), arb(20), arb(0))
    ]
    total = sum((m for m, *_ in masses), arb(0))
    cx, cy = (sum((each[0] * each[k] for each in masses), arb(0)) / total for k in (1, 2))
    second = sum((m * (own + (x - cx) ** 2 + (y - cy) ** 2) for m, x, y, own in masses), arb(0))
    return cx, cy, second / total


def test_the_prover_s_and_the_checker_s_numbers_hold_those_of_closed_forms() -> None:
    cx, cy, rho2 = closed_form()
    box = parameter_box(ls.load(bracket()))
    checked = checker.scene.read_scene(bracket() | MODEL, None)
    for lo, hi, value in (
        (box.lo.a[0], box.hi.a[0], cx),
        (box.lo.d[0], box.hi.d[0], cy),
        (box.lo.a[1], box.hi.a[1], 80 - cy),  # side 1, from (0, 80) down to (0, 0)
        (box.lo.d[1], box.hi.d[1], cx),
        (box.lo.radius_of_gyration, box.hi.radius_of_gyration, rho2.sqrt()),
    ):
        assert value >= lo
        assert value <= hi
        assert hi - lo < 1e-13 * hi
    assert len(checked.sides) == 5
    for side, a, d in ((0, cx, cy), (1, 80 - cy, cx), (4, cy, 80 - cx)):
        assert checked.sides[side].a.overlaps(a)
        assert checked.sides[side].d.overlaps(d)
        assert checked.sides[side].a.rad() < 1e-20
    assert checked.sides[0].rho2.overlaps(rho2)


@pytest.mark.parametrize(
    "tolerance",
    [
        {},
        {"part.vertices[7].x": "0.2 mm", "part.mass.points[0].y": "0.1 mm"},
        {"part.vertices[6].x": "0.05 mm"},
    ],
)
def test_a_plate_with_notch_and_holes_is_proved_and_rechecked(tolerance, tmp_path) -> None:
    proof = ls.certify(bracket(), ["invariant", "trapping"], tolerance=tolerance)
    assert [claim.verdict for claim in proof.claims] == ["proved", "proved"]
    file = proof.save(tmp_path / "bracket.proof.zip")
    assert ls.recheck(file).verdict == "proved"

    def without_holes(header: dict) -> None:
        for scene in [header["scene"], *(box.get("scene", {}) for box in header.get("boxes", []))]:
            scene.get("part", {}).pop("holes", None)

    if not tolerance:  # without its holes it is another part, by half a millimetre
        other = forge.rewritten(file, tmp_path / "other.proof.zip", without_holes)
        assert checker.recheck(other, workers=1).verdict != "proved"


def test_a_vertex_that_a_tolerance_may_move_out_of_the_hull_is_refused_by_both() -> None:
    with pytest.raises(AnswerError, match="perhaps with a corner at vertex 1"):
        ls.certify(bracket(), ["invariant"], tolerance={"part.vertices[1].y": "0.1 mm"})
    raw = bracket() | MODEL
    raw["part"]["vertices"][1][1] = ["-1e-9 mm", "0.1 mm"]
    with pytest.raises(
        checker.file.BadFileError, match="vertex 1 of the part may lie beyond its convex hull"
    ):
        checker.scene.read_scene(raw, None)
    raw["part"]["vertices"][1][1] = ["0 mm", "0.1 mm"]  # on the edge of the hull, or within
    assert len(checker.scene.read_scene(raw, None).sides) == 5


def test_boxes_of_a_tolerance_that_differ_in_their_holes_are_not_one_part(tmp_path) -> None:
    """Two true proofs, one of the part without holes, put into one file that claims a tolerance of the solid width."""

    def proved(x: str, *, holes: bool):
        raw = bracket()
        raw["part"]["vertices"][7][0] = x
        if not holes:
            del raw["part"]["holes"]
        proof = ls.certify(raw, ["invariant", "trapping"], tolerance={"part.vertices[7].x": "0.1 mm"})
        return forge.opened(proof.save(tmp_path / f"{x}.proof.zip"))

    drilled, solid = proved("39.9 mm", holes=True), proved("40.1 mm", holes=False)
    drilled.header["boxes"].append({**copy.deepcopy(solid.header["boxes"][0]), "prefix": "1."})
    drilled.header["tolerance"] = {"part.vertices[7].x": "0.2 mm"}
    for name, array in solid.arrays.items():
        drilled.arrays[f"1.{name[2:]}"] = array
    file = tmp_path / "mixed.proof.zip"
    drilled.seal().write(file)
    report = checker.recheck(file, workers=1)
    assert report.verdict == "failed"
    assert report.reason.endswith("the boxes differ in something else than the tolerance")


def test_a_report_names_the_holes_and_what_is_believed_of_them(tmp_path) -> None:
    proof = ls.certify(bracket(), ["invariant"])
    report = checker.recheck(proof.save(tmp_path / "bracket.proof.zip"), workers=1)
    told = {name: report.parameters[f"part.holes[0].{name}"] for name in ("center.x", "center.y", "diameter")}
    assert told == {"center.x": "20 mm", "center.y": "60 mm", "diameter": "10 mm"}
    assert report.parameters["part.holes[1].vertices[2].y"] == "20 mm"
    assert any("holes inside it and apart" in line for line in report.relied_on)


@pytest.mark.parametrize("decimals", [False, True])
def test_upright_edges_at_places_that_are_no_binary_numbers(decimals: bool, tmp_path) -> None:
    """A rectangle of 62.3 mm, and an isosceles triangle about the origin: differences of equal decimals are balls."""
    raw = bracket()
    corners = [(0, 0), (62.3, 0), (62.3, 40), (0, 40)] if decimals else [(-30.1, 0), (30.1, 0), (0, 42.7)]
    raw["part"] = {
        "vertices": [[f"{x} mm", f"{y} mm"] for x, y in corners],
        "mass": {"plate_density": "3 kg/m^2"},
    }
    checked = checker.scene.read_scene(raw | MODEL, None)
    scene = ls.load(raw)
    for side, rest in enumerate(checked.sides):
        assert float(rest.a.mid()) == pytest.approx(scene.sides.a[side], rel=1e-14)
        assert rest.a.rad() < 1e-20
    assert float(checked.sides[0].rho2.mid()) == pytest.approx(scene.radius_of_gyration**2, rel=1e-13)


def test_a_piece_of_a_tolerance_whose_own_hull_has_other_corners_is_refused() -> None:
    """The inward corner moved beyond the line of side 3: six sides throughout, where the scene has five."""
    scene, tree = ls.load(bracket()), bracket()
    tree["part"]["vertices"][7] = [["61 mm", "62 mm"], ["61 mm", "62 mm"]]
    with pytest.raises(AnswerError, match="one with the corners 0, 5, 6, 7, 8, 9 of its hull"):
        parameter_box(scene, tree=tree)


@pytest.mark.parametrize("measured", [False, True])
def test_a_corner_that_a_tolerance_may_take_away_is_refused(measured: bool) -> None:
    """At y = 99.5 mm the top of this part is one side of 100 mm, not two."""
    mass = {"plate_density": "3 kg/m^2"}
    if measured:
        mass = {"center": {"side": 0, "along": "50 mm", "above": "50 mm"}, "radius_of_gyration": "40 mm"}
    corners = [(0, 0), (100, 0), (100, 100), (30, 101), (0, 100)]
    part = {"vertices": [[f"{x} mm", f"{y} mm"] for x, y in corners], "mass": mass}
    effects = {"landing": True, "roll": True}
    scene = ls.load(bracket() | {"part": part, "effects": effects})
    assert len(stability(scene, tolerance={"part.vertices[3].y": "0.5 mm"}).sides) == 5
    with pytest.raises(AnswerError, match="perhaps without the corner at vertex 3"):
        stability(scene, tolerance={"part.vertices[3].y": "2 mm"})


def test_a_tolerance_in_which_the_outline_cuts_a_hole_is_refused() -> None:
    raw = bracket()
    raw["part"]["holes"] = [{"center": {"x": "35.9 mm", "y": "44.1 mm"}, "diameter": "8 mm"}]
    with pytest.raises(AnswerError, match="hole 0 is 'beyond the outline'"):
        ls.certify(raw, ["invariant"], tolerance={"part.vertices[7].x": "0.3 mm"})


def test_values_that_make_another_hull_are_refused() -> None:
    scene = ls.load(bracket())
    with pytest.raises(SceneError, match="one with the corners 0, 5, 8, 9'"):
        scene.with_values({"part.vertices[6].x": 45.0})
    with pytest.raises(SceneError, match=r"part\.holes: hole 0"):
        scene.with_values({"part.vertices[7].x": 18.0, "part.vertices[7].y": 58.0})


def other(path: str, value: object) -> dict:
    raw = bracket() | MODEL
    node, *words = raw["part"], *path.split("/")
    for word in words[:-1]:
        node = node[int(word) if isinstance(node, list) else word]
    node[int(words[-1]) if isinstance(node, list) else words[-1]] = value
    return raw


BAD = [
    ("holes/0/diameter", "0 mm", r"part.holes\[0\].diameter is not positive"),
    ("holes/0/diameter", ["10 mm", "11 mm"], "is an interval"),
    ("holes/0/diameter", "10 kg", "length"),
    ("holes/0/center", {"x": "20 mm"}, "y missing"),
    ("holes/0/depth", "1 mm", "unknown key depth"),
    ("holes/0", {"diameter": "1 mm"}, "vertices alone, or center and diameter"),
    (
        "holes/1/vertices",
        [["10 mm", "10 mm"], ["10 mm", "20 mm"], ["20 mm", "10 mm"]],
        "not counterclockwise",
    ),
    ("holes/1/diameter", "1 mm", "vertices alone"),
    ("holes/1/vertices", [["10 mm", "10 mm"]], "not a list of a fitting length"),
    ("holes", "none", "not a list of a fitting length"),
    ("holes/0/diameter", "200 mm", "the holes are larger than the part"),
    ("vertices", bracket()["part"]["vertices"][::-1], "not counterclockwise"),
    (
        "vertices",
        [["0 mm", "0 mm"], ["10 mm", "10 mm"], ["20 mm", "20 mm"]],
        "not counterclockwise|fewer than 3",
    ),
    ("vertices", [["0 mm", "0 mm"]] * 4, "not counterclockwise|fewer than 3"),
    (
        "mass",
        {"center": {"side": 0, "along": "38 mm", "above": "30 mm"}, "radius_of_gyration": "30 mm"},
        "of a plate alone",
    ),
]


@pytest.mark.parametrize(("path", "value", "words"), BAD)
def test_a_plate_that_the_checker_refuses(path: str, value: object, words: str) -> None:
    with pytest.raises(checker.file.BadFileError, match=words):
        checker.scene.read_scene(other(path, value), None)


def test_a_vertex_beside_the_hull_by_less_than_a_double_tells() -> None:
    """The hull is that of the decimals: 10^-30 mm beyond the edge, a vertex is a corner, and there is no such side."""
    text = "-1e-30 mm"
    beyond = replaced(bracket(), "mm", None, {"part.vertices[1].y": text})
    with pytest.raises(SceneError, match="vertex 1 is 'almost on the line"):
        ls.load(beyond)


def test_a_triangle_by_its_sides_may_have_holes_in_the_frame_of_side_0() -> None:
    """A triangle of 60, 80 and 100 mm with its right angle at (0, 0), bored through at (20, 20): masses by hand."""
    raw = bracket() | MODEL
    hole = {"center": {"x": "20 mm", "y": "20 mm"}, "diameter": "20 mm"}
    mass = {"plate_density": "1 kg/m^2"}
    raw["part"] = {"sides": ["60 mm", "80 mm", "100 mm"], "holes": [hole], "mass": mass}
    arb = flint.arb
    area, disc = arb(2400), arb.pi() * 100
    x, y = ((area * middle - disc * 20) / (area - disc) for middle in (arb(20), arb(80) / 3))
    # about the corner with the right angle: b h (b^2 + h^2)/12; of the disc r^2/2 + 20^2 + 20^2
    second = arb(60 * 80 * (60**2 + 80**2)) / 12 - disc * (50 + 800)
    rho2 = second / (area - disc) - x**2 - y**2
    box, checked = parameter_box(ls.load(raw)), checker.scene.read_scene(raw, None)
    for value, lo, hi in (
        (x, box.lo.a[0], box.hi.a[0]),
        (y, box.lo.d[0], box.hi.d[0]),
        (rho2.sqrt(), box.lo.radius_of_gyration, box.hi.radius_of_gyration),
    ):
        assert value >= lo
        assert value <= hi
        assert hi - lo < 1e-12 * hi
    assert checked.sides[0].a.overlaps(x)
    assert checked.sides[0].rho2.overlaps(rho2)
