"""The figure of the part: sides by number, masses, and the first picture of every report."""

import json
import re

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

import limitsets as ls
from limitsets.face.plot.parts import refused_part
from limitsets.face.report.writing import write, write_audit
from limitsets.feeder.scene.reading import sketch
from tests.cli.command import run
from tests.lead_quad import LEAD_QUAD

# Side 0 of this part lies on the x axis with its left end at 0: what the scene writes is where it is drawn.
LEAD = {key: table for key, table in LEAD_QUAD.items() if key != "goal"}


def named(axes, gid):
    return [artist for artist in axes.get_children() if artist.get_gid() == gid]


def test_outline_sides_in_flip_order_centre_masses_arm_and_units():
    scene = ls.load(LEAD)
    figure = ls.plot.part(scene)
    (axes,) = figure.axes
    (outline,) = named(axes, "part")
    assert np.allclose(outline.get_xy()[:-1], [(0, 0), (130, 0), (150, 70), (30, 100)])
    # interfaces: side 0 is P0-P1, side 1 is P(n-1)-P0, side 2 is P(n-2)-P(n-1), ...
    middles = {0: (65, 0), 1: (15, 50), 2: (90, 85), 3: (140, 35)}
    lengths = [130.0, np.hypot(30, 100), np.hypot(120, 30), np.hypot(20, 70)]
    for text in named(axes, "side"):
        side, length, unit = re.fullmatch(r"side (\d): ([\d.]+) (\w+)", text.get_text()).groups()
        assert text.xy == pytest.approx(middles.pop(int(side)))
        assert float(length) == pytest.approx(lengths[int(side)], rel=1e-4)
        assert unit == "mm"
    assert not middles
    (centre,) = named(axes, "centre of mass")
    assert centre.get_xydata()[0] == pytest.approx(scene.centre)
    (mass,) = named(axes, "added mass")
    assert mass.get_xydata()[0] == pytest.approx((110, 15))
    assert [text.get_text() for text in named(axes, "mass")] == ["60 g"]
    assert named(axes, "arm")
    assert (
        named(axes, "measure")[0].get_text() == f"a = {scene.centre[0]:.4g} mm, d = {scene.centre[1]:.4g} mm"
    )


@pytest.mark.parametrize("source", ["paper-designed", "paper-quadrilateral", LEAD])
def test_names_of_the_sides_keep_off_the_part_and_each_other(source):
    figure = ls.plot.part(ls.load(source))
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    (outline,) = named(axes, "part")
    boxes = [
        Text.get_window_extent(text) for text in named(axes, "side")
    ]  # of the words, without their leader
    assert not any(
        outline.get_path().transformed(outline.get_transform()).intersects_bbox(box) for box in boxes
    )
    assert not any(one.overlaps(two) for k, one in enumerate(boxes) for two in boxes[:k])
    assert all(figure.bbox.contains(*corner) for box in boxes for corner in box.corners())


def test_a_part_given_by_three_lengths():
    texts = named(ls.plot.part(ls.load("paper-designed")).axes[0], "side")
    assert [text.get_text() for text in texts] == ["side 0: 5.75 in", "side 1: 3.6 in", "side 2: 6.75 in"]


def test_plot_part_needs_no_analysis(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capfd, "plot", "paper-designed", "part", "--json")
    assert (code, err) == (0, "")
    assert json.loads(out) == {"figure": "paper-designed-part.png"}
    assert (tmp_path / "paper-designed-part.png").read_bytes().startswith(b"\x89PNG")


def test_it_is_the_first_figure_of_reports(tmp_path):
    write(ls.analyse("paper-designed", 256), tmp_path)
    write_audit(ls.audit("paper-designed"), tmp_path)
    for page in ("report.md", "audit.md"):
        assert re.search(r"!\[.*?\]\((.*?)\)", (tmp_path / page).read_text())[1] == "part.png"
    assert (tmp_path / "part.png").exists()


CONCAVE = {
    "name": "bent",
    "part": {
        "vertices": [["0 mm", "0 mm"], ["130 mm", "0 mm"], ["60 mm", "30 mm"], ["150 mm", "70 mm"]],
        "mass": {"center": {"side": 0, "along": "70 mm", "above": "40 mm"}, "radius_of_gyration": "40 mm"},
    },
    "arm": {"length": "700 mm", "surface_height": "-5 mm"},
    "throw": {"kappa": "640 mm"},
}


def test_a_part_that_is_refused_is_drawn_as_it_is_written(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = ls.dump(ls.load("paper-designed")).replace(
        '"5.75 in"', '"50 in"'
    )  # longer than the other two together
    (tmp_path / "needle.toml").write_text(text, encoding="utf-8")
    code, out, err = run(capfd, "plot", "needle.toml", "part")
    assert (code, out) == (2, "figure: paper-designed-part.png\n")
    assert "part.sides" in err
    assert (tmp_path / "paper-designed-part.png").is_file()
    found = sketch(CONCAVE)
    assert found.vertices.tolist() == [[0, 0], [130, 0], [60, 30], [150, 70]]
    assert found.centre == (70.0, 40.0)
    axes = refused_part(found, "the polygon is not convex").axes[0]
    assert [text.get_text() for text in named(axes, "side")][1] == f"side 1: {np.hypot(150, 70):.5g} mm"
    assert "not convex" in axes.get_xlabel()
    assert sketch({"part": {"vertices": "none"}}) is None


def test_the_name_of_a_side_that_overhangs_is_led_to_it():
    axes = ls.plot.part(ls.load("paper-quadrilateral")).axes[0]
    assert [text.arrow_patch is not None for text in named(axes, "side")] == [False, True, False, False]
