"""Figures of limit sets, basins, throws and parts."""

import itertools
import re
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

import limitsets as ls
from limitsets import plot
from limitsets.base.errors import AnswerError, MapError
from limitsets.face.plot.parts import refused_part
from limitsets.face.plot.style import SETS, extents_of, keep_apart, stretch
from limitsets.feeder.scene.reading import sketch
from limitsets.feeder.thrower import fly
from tests.cli.command import run
from tests.maps_of_tests import TwoState, with_middles
from tests.plates import LEAD_QUAD
from tests.plot.artists import drawn, named

# ----------------------------------------------------------------
# Figures by their content: what the artists hold against the answers, and whether texts stay apart.


SCENES = Path(__file__).parents[1] / "analysis"
SOURCES = [
    "paper-designed",
    "paper-designed-small-angle",
    "paper-initial",
    SCENES / "four-sides.toml",
    SCENES / "five-sides.toml",
]
by_name = pytest.mark.parametrize("source", SOURCES, ids=lambda source: Path(source).stem)


@lru_cache(maxsize=8)
def analysed(source):
    return ls.analyse(source)


def luminance(colour):
    return float(np.dot(to_rgb(colour), (0.299, 0.587, 0.114)))


# ---------------------------------------------------------------- limit set


@by_name
def test_limit_set(source):
    found = analysed(source)
    count = len(found.scene.sides)
    figure = plot.limit_set(found.scene, found.limit_sets)
    (axes,) = figure.axes
    drawn_bars = named(axes, "limit set")
    bars = sorted((-round(bar.get_y()), bar.get_x(), bar.get_x() + bar.get_width()) for bar in drawn_bars)
    wanted = sorted((side, lo, hi) for side, parts in found.extents[0].items() for lo, hi in parts)
    assert bars == [pytest.approx(each) for each in wanted]
    assert len(named(axes, "limit set again")) == len(found.extents[0][0])
    path = stretch(found.scene, found.extents[0])
    assert len(named(axes, "flip")) == int((path.code == ls.maps.FLIP).sum())
    assert len(named(axes, "jog")) == int((path.code == ls.maps.JOG).sum())
    lines = named(axes, "critical point")
    marks = sorted((-round(float(np.mean(line.get_ydata()))), line.get_xdata()[0]) for line in lines)
    assert marks == [(side, point.x) for side, points in found.critical_points.items() for point in points]
    labels = [label.get_text() for label in axes.get_yticklabels()][:count]
    assert labels == [f"side {side}" for side in range(count)]
    assert axes.get_ylim()[0] < -count
    assert found.scene.unit in axes.get_xlabel()
    assert found.scene.name in axes.get_title(loc="left")
    assert len(named(axes, "goal")) == (found.scene.goal is not None)


def test_flips_go_down_one_lane_to_where_the_map_says():
    found = analysed("paper-designed")
    (axes,) = plot.limit_set(found.scene, found).axes
    path = stretch(found.scene, found.extents[0])
    flips = path.code == ls.maps.FLIP
    arrows = [arrow._posA_posB for arrow in named(axes, "flip")]
    assert [start[0] for start, _ in arrows] == pytest.approx(path.x[:-1][flips])
    assert [end[0] for _, end in arrows] == pytest.approx(path.x[1:][flips])
    assert all(0.7 < start[1] - end[1] < 1.0 for start, end in arrows)


def test_a_stretch_begins_with_an_arrival_and_is_a_whole_round():
    found = analysed("paper-designed")
    path = stretch(found.scene, found.extents[0], throws=12)
    assert path.side[0] == path.side[-1] == 0
    assert path.code.size >= 12
    assert ls.orbit(found.scene.map, path.x[0], 0, path.code.size).x == pytest.approx(path.x)


def test_what_can_be_drawn():
    found = analysed("paper-designed")
    assert extents_of(found) == list(found.extents)
    assert extents_of(found.limit_sets[0]) == [found.limit_sets[0].extents]
    assert extents_of(found.attractors) == [found.attractors[0].extents]
    assert extents_of(found.extents[0]) == [found.extents[0]]
    for wrong in (3, "designed", [1, 2]):
        with pytest.raises(AnswerError):
            plot.limit_set(found.scene, wrong)


def test_axes_of_ones_own():
    mine = Figure()
    axes = mine.subplots()
    found = analysed("paper-initial")
    assert plot.limit_set(found.scene, found, axes=axes) is mine
    assert mine.legends == []


def test_no_limit_set():
    scene = ls.load(SCENES / "five-sides.toml").with_values({"throw.kappa": 60.0, "arm.surface_height": -0.5})
    found = ls.analyse(scene)
    for figure in (
        plot.limit_set(scene, found),
        plot.map(scene, found),
        plot.basins(scene, found.basins, found),
        plot.morse(found.morse, scene.name),
    ):
        drawn(figure)


# ---------------------------------------------------------------- map


@by_name
def test_map(source):
    found = analysed(source)
    scene, count = found.scene, len(found.scene.sides)
    figure = plot.map(scene, found)
    panels = [axes for axes in figure.axes if axes.axison]
    assert len(panels) == count
    for side, axes in enumerate(panels):
        for name, code in (("jog", ls.maps.JOG), ("flip", ls.maps.FLIP)):
            (line,) = named(axes, name)
            x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
            there = ls.maps.images(scene.map, x, side)
            assert (np.isfinite(y) == (there.code == code)).all()
            assert y[np.isfinite(y)] == pytest.approx(there.x[there.code == code])
        marks = [mark.get_xdata()[0] for mark in named(axes, "critical point")]
        assert marks == [point.x for point in found.critical_points[side]]
        assert len(named(axes, "limit set")) == len(found.extents[0].get(side, ()))
        assert len(named(axes, "other vertex first")) == len(found.other_vertex_first[side])
        jog, flip = named(axes, "jog")[0], named(axes, "flip")[0]
        assert jog.get_linestyle() != flip.get_linestyle()
    path = stretch(scene, found.extents[0], throws=10)
    cobweb = sum(len(named(axes, "cobweb")) for axes in panels)
    assert cobweb == path.code.size
    assert sum(len(named(axes, "departure")) for axes in panels) == int((path.code == ls.maps.FLIP).sum())


def test_map_alone_shows_the_whole_arm():
    scene = ls.load("paper-initial")
    figure = plot.map(scene)
    assert figure.axes[0].get_xlim() == (0.0, 28.0)
    assert not named(figure.axes[0], "cobweb")


# ---------------------------------------------------------------- basins


@by_name
def test_basins_in_strips(source):
    found = analysed(source)
    (axes,) = plot.basins(found.scene, found.basins, found).axes
    total = float(found.grid.measure.sum())
    for label in set(found.basins.labels.tolist()):
        width = sum(strip.get_width() for strip in named(axes, f"label {label}"))
        weight = found.grid.measure[found.basins.labels == label].sum()
        assert width / total == pytest.approx(weight / total, abs=1e-12)
    assert len(named(axes, "attractor")) == sum(len(parts) for parts in found.extents[0].values())


@with_middles
def test_basins_in_the_plane():
    graph = ls.transitions(TwoState(1.0), ls.grid([(-2, 2), (-2, 2)], cells=32), method="middles")
    shares = ls.basins(graph, ls.attractors(graph))
    figure = plot.basins(graph.grid, shares)
    (axes,) = figure.axes
    picture = np.asarray(axes.collections[0].get_array()).reshape(32, 32)
    assert (picture[:, :16] == picture[0, 0]).all()
    assert (picture[:, 16:] == picture[0, -1]).all()
    assert picture[0, 0] != picture[0, -1]
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["to limit set 0: 50.0 % of all starts", "to limit set 1: 50.0 % of all starts"]


def test_basins_in_space_are_refused():
    from limitsets.systems.sets import Basins

    grid = ls.grid([(0, 1)] * 3, cells=2)
    with pytest.raises(AnswerError):
        plot.basins(grid, Basins(grid, np.zeros(8, np.int32), (1.0,), 0.0, {"outside": 0.0}))


def test_sets_differ_in_grey():
    from limitsets.face.plot.basin import ATTRACTORS, HATCHES

    grey = [luminance(colour) for colour in ATTRACTORS]
    assert min(abs(a - b) for a, b in itertools.combinations(grey, 2)) > 0.05
    assert len(set(HATCHES)) == len(HATCHES)
    assert len({hatch for _, hatch in SETS}) == len(SETS)


# ---------------------------------------------------------------- Morse graph


def chain(length):
    graph = nx.DiGraph()
    for k in range(length):
        exits = ["inward"] if k == 3 else []
        graph.add_node(k, cells=k + 1, attracting=k == 0, extents={0: [(0.0, 1.0)]}, exits=exits)
    graph.add_edges_from((k + 1, k) for k in range(length - 1))
    return graph


def test_morse_nodes_edges_and_ways_out():
    (axes,) = plot.morse(chain(5), "a chain").axes
    assert len(named(axes, "attracting")) == len(named(axes, "border")) == 1
    assert len(named(axes, "recurrent")) == 4
    assert len(named(axes, "exit")) == 1
    height = {text.get_text(): text.xy[1] for text in axes.texts if text.get_text().isdigit()}
    assert [height[str(k)] for k in range(5)] == sorted(height.values())
    small, large = named(axes, "recurrent")[0], named(axes, "recurrent")[-1]
    assert small.get_markersize() < large.get_markersize()


def test_morse_of_very_many_sets_draws_some_and_says_so():
    (axes,) = plot.morse(chain(300)).axes
    assert "300 recurrent sets, 1 attracting" in axes.get_title(loc="left")
    assert "288 of the smallest are not drawn" in axes.get_title(loc="left")
    assert len(named(axes, "attracting")) == 1
    assert max(axes.figure.get_size_inches()) < 12


# ---------------------------------------------------------------- flight


@pytest.mark.parametrize(
    ("source", "x", "side"),
    [
        ("paper-designed", 23.0, 2),
        ("paper-designed", 8.0, 2),
        ("paper-initial", 21.0, 1),
        (SCENES / "four-sides.toml", 14.0, 0),
        (SCENES / "five-sides.toml", 29.0, 0),
        (SCENES / "five-sides.toml", 31.0, 0),
    ],
)
def test_flight(source, x, side):
    scene = ls.load(source)
    figure = plot.flight(scene, x, side)
    above, below = figure.axes
    (start,), (impact,), (rest,) = named(above, "start"), named(above, "impact"), named(below, "rest")[:1]
    h, sides = scene.surface_height, scene.sides
    corners = start.get_xy()[:-1]
    assert sorted(corners[:, 1])[:2] == pytest.approx([h, h], abs=1e-12)
    assert corners[:, 0].min() <= x - sides.a[side] + 1e-9
    landed = impact.get_xy()[:-1]
    assert landed[:, 1].min() == pytest.approx(h, abs=1e-9)  # the vertex is on the arm, and nothing below it
    struck = landed[np.argmin(landed[:, 1])]
    (path,) = named(above, "path")
    after = ls.orbit(scene.map, x, side, 1)
    to = int(after.side[1])
    at_rest = rest.get_xy()[:-1]
    assert sorted(at_rest[:, 1])[:2] == pytest.approx([h, h], abs=1e-9)
    assert path.get_xdata()[0] == x
    turned = at_rest[np.argmin(np.hypot(*(at_rest - struck).T))]
    assert turned == pytest.approx(struck, abs=1e-9)  # it turned about the struck vertex
    lengths = np.sort(np.hypot(*np.diff(np.vstack([landed, landed[:1]]), axis=0).T))
    assert lengths == pytest.approx(np.sort(sides.length), abs=1e-9)
    title = below.get_title(loc="left")
    assert f"{after.x[1]:.2f}" in title
    assert ("a flip" if to != side else "a jog") in title
    assert f"{np.degrees(fly(scene.map, x, side).phi):.1f}" in above.get_title(loc="left")


def test_flight_by_small_angles_hangs_at_the_vertex_whose_path_is_known():
    scene = ls.load("paper-designed-small-angle")
    figure = plot.flight(scene, 20.5, 2)
    assert "small-angle" in figure.get_suptitle()
    (impact,) = named(figure.axes[0], "impact")
    # the left end of side 2, vertex 1, strikes
    assert impact.get_xy()[1, 1] == pytest.approx(scene.surface_height, abs=1e-9)
    assert not named(figure.axes[1], "turning")


def test_flight_that_is_none():
    scene = ls.load("paper-designed")
    with pytest.raises(AnswerError):
        plot.flight(scene, 1.0, 2)
    with pytest.raises(MapError):
        plot.flight(scene, 10.0, 3)


# ---------------------------------------------------------------- all of them


def every_figure(source):
    found = analysed(source)
    scene = found.scene
    path = stretch(scene, found.extents[0])
    yield plot.limit_set(scene, found)
    yield plot.map(scene, found)
    yield plot.map(scene)
    yield plot.basins(scene, found.basins, found)
    yield plot.morse(found.morse, scene.name)
    for code in (ls.maps.JOG, ls.maps.FLIP):
        k = int((path.code == code).argmax())
        yield plot.flight(scene, float(path.x[k]), int(path.side[k]))


@by_name
def test_legends_titles_and_axes_stay_apart_and_inside(source):
    for figure in every_figure(source):
        drawn(figure)
        renderer = figure.canvas.get_renderer()
        axes = [each.get_tightbbox(renderer) for each in figure.axes if each.axison]
        others = [legend.get_window_extent(renderer) for legend in figure.legends]
        if figure._suptitle is not None:
            others.append(figure._suptitle.get_window_extent(renderer))
        for box in others:
            assert not any(box.overlaps(area) for area in axes), figure.get_suptitle()
        width, height = figure.canvas.get_width_height()
        for box in [*axes, *others]:
            assert box.x0 >= -1
            assert box.y0 >= -1
            assert box.x1 <= width + 1
            assert box.y1 <= height + 1


def test_pyplot_is_never_imported():
    code = "import sys, limitsets as ls; ls.plot.map(ls.load('paper-designed')); "
    command = [sys.executable, "-W", "error", "-c", code + "print('matplotlib.pyplot' in sys.modules)"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False"]


def test_names_of_critical_points_that_would_run_into_each_other_are_taken_away():
    axes = Figure().subplots()
    axes.set_xlim(0.0, 10.0)
    for x, y in [(2.0, 0.0), (2.5, 0.0), (3.1, 0.0), (3.2, 1.0), (9.0, 1.0)]:
        axes.annotate(f"{x}", (x, y), gid="name")
    axes.annotate("other", (2.1, 0.0))
    keep_apart(axes, 0.1)
    assert [text.get_text() for text in axes.texts] == ["2.0", "3.1", "3.2", "9.0", "other"]


# ----------------------------------------------------------------
# The figure of the part: sides by number, masses, and the first picture of every report.


# Side 0 of this part lies on the x axis with its left end at 0: what the scene writes is where it is drawn.
LEAD = {key: table for key, table in LEAD_QUAD.items() if key != "goal"}


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
    a, d = scene.centre
    assert named(axes, "measure")[0].get_text() == f"a = {a:.4g} mm, d = {d:.4g} mm"


@pytest.mark.parametrize("source", ["paper-designed", "paper-quadrilateral", LEAD])
def test_names_of_the_sides_keep_off_the_part_and_each_other(source):
    figure = drawn(ls.plot.part(ls.load(source)))
    (axes,) = figure.axes
    (outline,) = named(axes, "part")
    # of the words, without their leader
    boxes = [Text.get_window_extent(text) for text in named(axes, "side")]
    path = outline.get_path().transformed(outline.get_transform())
    assert not any(path.intersects_bbox(box) for box in boxes)
    assert not any(one.overlaps(two) for k, one in enumerate(boxes) for two in boxes[:k])
    assert all(figure.bbox.contains(*corner) for box in boxes for corner in box.corners())


CORNERS = [[0, 0], [130, 0], [60, 30], [150, 70]]
MASS = {"center": {"side": 0, "along": "70 mm", "above": "40 mm"}, "radius_of_gyration": "40 mm"}
CONCAVE = {
    "part": {"vertices": [[f"{x} mm", f"{y} mm"] for x, y in CORNERS], "mass": MASS},
    "arm": {"length": "700 mm", "surface_height": "-5 mm"},
    "throw": {"kappa": "640 mm"},
}


def test_a_part_that_is_refused_is_drawn_as_it_is_written(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # longer than the other two together
    text = ls.dump(ls.load("paper-designed")).replace('"5.75 in"', '"50 in"')
    (tmp_path / "needle.toml").write_text(text, encoding="utf-8")
    code, out, err = run(capfd, "plot needle.toml part")
    assert (code, out) == (2, "figure: paper-designed-part.png\n")
    assert "part.sides" in err
    assert (tmp_path / "paper-designed-part.png").is_file()
    found = sketch(CONCAVE)
    assert found.vertices.tolist() == CORNERS
    assert found.centre == (70.0, 40.0)
    axes = refused_part(found, "the polygon is not convex").axes[0]
    assert [text.get_text() for text in named(axes, "side")][1] == f"side 1: {np.hypot(150, 70):.5g} mm"
    assert "not convex" in axes.get_xlabel()
    assert sketch({"part": {"vertices": "none"}}) is None


def test_the_name_of_a_side_that_overhangs_is_led_to_it():
    axes = ls.plot.part(ls.load("paper-quadrilateral")).axes[0]
    assert [text.arrow_patch is not None for text in named(axes, "side")] == [False, True, False, False]
