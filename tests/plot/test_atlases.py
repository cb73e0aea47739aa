"""Figures of atlases and bifurcations."""

import math
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgb

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError
from limitsets.face.plot.atlas_maps import COLLAPSE_HATCH, DOUBT_HATCH, LEAVE_HATCH, UNREACHED, look_of
from limitsets.parameters.atlas.classes import UNDECIDED, legend
from tests.maps_of_tests import TwoState
from tests.plot.artists import drawn, named

# ----------------------------------------------------------------
# Maps and surfaces of an atlas: pixels, colours, words and marks against the numbers.


X, Y = "throw.speed=130:180:24", "arm.surface_height=-1:0.2:16"


@pytest.fixture(scope="module")
def feeders():
    wanted = ["class", "share", "threshold", "lyapunov", "leaves", "reach", "jogs_max"]
    return ls.atlas("paper-designed", X, Y, variables=wanted, options={"throws": 500}, chunk=(16, 24))


@cache
def along_speed():
    return ls.atlas("paper-designed", "throw.speed=150:165:7", variables=["threshold", "class"])


def lines_of(axes, gid):
    return [each for each in (*axes.lines, *axes.collections) if each.get_gid() == gid]


def words_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def image_of(figure):
    (found,) = figure.axes[0].images
    return found


@pytest.mark.sweep
def test_each_pixel_has_the_colour_of_its_class(feeders):
    figure = ls.plot.atlas(feeders)
    numbers = feeders.dataset["class"].values
    drawn = np.asarray(image_of(figure).get_array())[..., :3]
    drawn = drawn / (255.0 if drawn.dtype.kind == "u" else 1.0)
    entries = legend(feeders.dataset)
    assert len(entries) >= 5
    for each in entries:
        face = to_rgb(look_of(each.number, each.name)["facecolor"])
        assert np.allclose(drawn[numbers == each.number], face, atol=1 / 255)


def test_the_legend_is_in_words_and_numbers_stand_in_the_largest_regions(feeders):
    figure = ls.plot.atlas(feeders)
    entries = legend(feeders.dataset)
    texts = [text.replace("\n  ", "") for text in words_of(figure)]
    assert texts[0].startswith(f"1: {entries[0].words} (")
    # 158.02 deg/s is sqrt(g/kappa) of the file's decimals
    assert texts[-1] == f"paper-designed: {math.degrees(math.sqrt(193.045 / 25.3778518)):.6g}, -0.2"
    data, axes = feeders.dataset, figure.axes[0]
    written = [text for text in axes.texts if text.get_gid() == "number"]
    assert {"1", "2"} <= {text.get_text() for text in written}
    for text in written:
        x, y = text.get_position()
        here = data["class"].sel({"throw.speed": x, "arm.surface_height": y}, method="nearest")
        assert int(here) == entries[int(text.get_text()) - 1].number


def test_the_design_is_marked_where_it_is(feeders):
    (star,) = lines_of(ls.plot.atlas(feeders).axes[0], "design")
    speed = math.degrees(math.sqrt(193.045 / 25.3778518))
    assert star.get_xdata()[0] == pytest.approx(speed, rel=1e-12)
    assert star.get_ydata()[0] == pytest.approx(-0.2, rel=1e-12)
    outside = ls.atlas("paper-designed", "throw.speed=130:140:3", variables=["class"])
    assert not lines_of(ls.plot.atlas(outside).axes[0], "design")


def test_lines_part_the_classes_and_nothing_else(feeders):
    numbers = feeders.dataset["class"].values
    wanted = (numbers[1:] != numbers[:-1]).sum() + (numbers[:, 1:] != numbers[:, :-1]).sum()
    (lines,) = lines_of(ls.plot.atlas(feeders).axes[0], "boundaries")
    assert len(lines.get_segments()) == wanted


@pytest.mark.sweep
def test_a_class_looks_alike_in_every_picture():
    few = ls.atlas(maps.Logistic(3.8), "r=3.83:3.832:2", domain=[(0, 1)])
    many = ls.atlas(maps.Logistic(3.8), "r=2.8:3.832:12", domain=[(0, 1)])
    looks = []
    for found in (few, many):
        (number,) = {each.number for each in legend(found.dataset) if "a cycle of 3" in each.words}
        row = np.flatnonzero(found.dataset["class"].values == number)[0]
        looks.append(np.asarray(image_of(ls.plot.atlas(found)).get_array())[0, row])
    assert len(legend(many.dataset)) > len(legend(few.dataset))
    assert np.array_equal(*looks)


def lightness(colour):
    """CIE L* of sRGB, from its definition."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    y = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return 116 * y ** (1 / 3) - 16


def test_classes_of_feeders_differ_without_colour():
    names = [
        "bands:1+1+1,order:0-1-2,period:0;leaves:none;collapses:none",
        "bands:1+1+1,order:0-1-2,period:0;leaves:some;collapses:none",
        "bands:1+1+1,order:0-1-2,period:0;leaves:none;collapses:some",
        "no-attractor;leaves:all;collapses:none",
        "no-attractor;leaves:none;collapses:all",
        "no-attractor;leaves:some;collapses:some",
    ]
    looks = [look_of(1, name) for name in names] + [look_of(UNDECIDED, "undecided")]
    for k, one in enumerate(looks):
        for other in looks[:k]:
            apart = abs(lightness(one["facecolor"]) - lightness(other["facecolor"]))
            assert one["hatch"] != other["hatch"] or apart > 8


def test_undecided_points_are_hatched_grey():
    look = look_of(UNDECIDED, "undecided")
    red, green, blue = to_rgb(look["facecolor"])
    assert red == green == blue
    assert look["hatch"]


@pytest.mark.parametrize(
    ("variable", "side", "label"),
    [
        ("threshold", None, "threshold of the goal [in]"),
        ("lyapunov", None, "Lyapunov exponent [per throw]"),
        ("leaves", None, "share of the starts that leave"),
        ("reach", 1, "largest x of the attractor, side 1 [in]"),
        ("jogs_max", 2, "most jogs of a visit, side 2"),
    ],
)
def test_surfaces_show_the_largest_attractor_and_nothing_where_there_is_none(feeders, variable, side, label):
    figure = ls.plot.atlas_surface(feeders, variable, side)
    data = feeders.dataset
    values = data[variable].values.astype(float)
    if side is not None:
        values = values[..., side]
    values = values[..., 0] if values.ndim == 3 else values  # here there is one attractor at most
    drawn = image_of(figure).get_array()
    shown = np.isfinite(values) & (values >= 0)
    assert np.array_equal(~np.ma.getmaskarray(drawn), shown)
    assert np.array_equal(drawn[shown], values[shown])
    assert figure.axes[1].get_ylabel() == label


def test_the_line_of_the_goal_parts_what_holds_from_what_does_not(feeders):
    (line,) = lines_of(ls.plot.atlas_surface(feeders, "threshold").axes[0], "level")
    data = feeders.dataset
    for x, y in line.get_paths()[0].vertices[::5]:
        near = data.threshold.sel({"throw.speed": x, "arm.surface_height": y}, method="nearest")
        assert abs(float(near) - 20.0) < 0.5  # a pixel is 2 deg/s wide


@pytest.mark.parametrize("goal", ["oriented_beyond", "reaches"])
def test_the_map_has_a_line_where_the_goal_ends_with_ticks_where_it_fails(goal, feeders):
    """The scene's own goal, and one that side 0 gets to 20 in."""
    tree = ls.load("paper-designed").as_dict() | {"goal": {"reaches": {"x": "20 in", "side": 0}}}
    found = feeders
    if goal == "reaches":
        found = ls.atlas(ls.load(tree), X, Y, variables=["class", "threshold"])
    figure = ls.plot.atlas(found)
    (line,) = lines_of(figure.axes[0], "goal")
    ticked = line.get_path_effects()[-1]
    angle = math.radians(ticked._angle)
    threshold = found.dataset["threshold"]
    checked = 0
    for path in line.get_paths():
        shown = figure.axes[0].transData.transform(path.vertices)
        for (x0, y0), (x1, y1) in pairwise(shown):
            size = math.hypot(x1 - x0, y1 - y0)
            if size < 1.0:
                continue
            turned = complex(x1 - x0, y1 - y0) / size * complex(math.cos(angle), math.sin(angle))
            for side, inside in ((1, True), (-1, False)):  # two pixels of the atlas off
                off = 40.0 * side
                beside = 0.5 * (x0 + x1) + off * turned.real, 0.5 * (y0 + y1) + off * turned.imag
                x, y = figure.axes[0].transData.inverted().transform(beside)
                near = float(threshold.sel({"throw.speed": x, "arm.surface_height": y}, method="nearest"))
                if not math.isnan(near):
                    assert ((near > 20.0) if goal == "oriented_beyond" else (near < 20.0)) == inside
                    checked += 1
    assert checked > 20
    assert "the goal fails on the side of the ticks" in words_of(figure)


def test_of_one_quantity_the_line_of_the_goal_stands_where_the_threshold_is_its_x():
    found = along_speed()
    (line,) = lines_of(ls.plot.atlas(found).axes[0], "goal")
    x, values = found.dataset["throw.speed"].values, found.dataset["threshold"].values
    assert line.get_xdata()[0] == pytest.approx(np.interp(-20.0, -values, x))  # it falls with the speed
    assert line.get_path_effects()[-1]._angle == 90  # to the left of a line upwards: slower


def test_where_no_line_is_the_legend_says_whether_the_goal_holds():
    for speeds, word in (("165:168:3", "holds"), ("150:152:3", "fails")):
        found = ls.atlas("paper-designed", f"throw.speed={speeds}", variables=["threshold", "class"])
        assert f"the goal {word} wherever there is a limit set" in words_of(ls.plot.atlas(found))


def test_each_hatch_says_one_thing():
    """Dots meant "some starts collapse" and "no part gets to X" in one figure."""
    marks = [set(hatch) for hatch in (LEAVE_HATCH, COLLAPSE_HATCH, DOUBT_HATCH, UNREACHED)]
    assert sum(map(len, marks)) == len(set.union(*marks))


def test_where_no_part_gets_to_x_it_is_said():
    """A goal of parts beyond X holds there of none: paper-designed gets to 23.3831516 on side 2."""
    for x, words in ((23.3, False), (23.5, True)):
        tree = ls.load("paper-designed").as_dict()
        tree["goal"] = {"oriented_beyond": {"x": f"{x} in", "side": 2}}
        found = ls.atlas(ls.load(tree), "throw.kappa=25.3778518:25.3778519:2")
        assert (f"no part gets to x = {x}" in words_of(ls.plot.atlas(found))) == words


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("bands:1+2+2,order:0-1-2,period:0", "bands:1+3+1,order:0-1-2,period:0"),
        ("bands:1+3+1,order:0-1-2,period:0", "bands:1+3+1,order:0-2-1,period:0"),
        ("bands:2,order:0,period:2", "bands:16,order:0,period:16"),
    ],
)
def test_classes_with_as_many_bands_or_some_sevens_more_look_different(one, other):
    faces = [look_of(1, f"{name};leaves:none;collapses:none")["facecolor"] for name in (one, other)]
    assert abs(lightness(faces[0]) - lightness(faces[1])) > 3


def test_a_long_legend_stays_in_the_picture():
    found = ls.atlas("paper-initial", "throw.speed=120:200:20", "arm.surface_height=-1:0.4:20")
    figure = ls.plot.atlas(found)
    assert len(figure.legends[0].get_texts()) > 10
    figure.canvas.draw()
    box = figure.legends[0].get_window_extent()
    assert box.y0 >= 0.0
    assert box.y1 <= figure.bbox.height


def test_one_quantity_is_a_line():
    found = along_speed()
    (line,) = lines_of(ls.plot.atlas_surface(found, "threshold").axes[0], "values")
    assert np.array_equal(line.get_ydata(), found.dataset.threshold.values)
    assert image_of(ls.plot.atlas(found)).get_array().shape[:2] == (1, 7)


def test_what_is_no_surface(feeders):
    for variable, side, words in (
        ("class", None, "the variable to draw"),
        ("nothing", None, "the variable to draw"),
        ("reach", None, "the side of reach"),
        ("reach", 3, "the side of reach"),
        ("threshold", 0, "the side of threshold"),
    ):
        with pytest.raises(AnswerError, match=words):
            ls.plot.atlas_surface(feeders, variable, side)


def test_an_atlas_without_classes():
    task = "limitsets.parameters.atlas.examples:critical_points"
    found = ls.atlas("paper-designed", "throw.kappa=25.3778518:26:2", task=task)
    with pytest.raises(AnswerError, match=r"one with the variable class, .* with ls\.plot\.atlas_surface"):
        ls.plot.atlas(found)


def test_a_surface_of_a_map_with_one_side_needs_no_side():
    """A fixed point of the logistic map lies at 1 - 1/r."""
    found = ls.atlas(ls.maps.Logistic(2.5), "r=2:2.8:3", variables=["reach", "share"], domain=[(0.0, 1.0)])
    lines = ls.plot.atlas_surface(found, "reach").axes[0].lines
    (line, *_) = [line for line in lines if len(line.get_ydata()) == 3]
    assert line.get_ydata() == pytest.approx([0.5, 1 - 1 / 2.4, 1 - 1 / 2.8])


# ----------------------------------------------------------------
# Bifurcation diagrams, by their content.


@pytest.fixture(scope="module")
def thrown():
    return ls.continuation("paper-initial", {"throw.speed": ("136 deg/s", "137 deg/s")}, steps=2)


def test_every_side_shows_its_bands_its_critical_points_and_the_event(thrown):
    figure = drawn(ls.plot.bifurcation(thrown))
    assert [axes.get_ylabel() for axes in figure.axes] == [f"x on side {side} [in]" for side in range(3)]
    assert figure.axes[-1].get_xlabel() == "throw.speed [deg/s]"
    assert figure.axes[0].get_xlim() == pytest.approx((136.0, 137.0))
    for side, axes in enumerate(figure.axes):
        (areas,) = named(axes, "bands")
        first, last = areas.get_paths()[0].vertices, areas.get_paths()[-1].vertices
        lo, hi = thrown.attractors[0][0].extents[side][0]
        assert first[0] == pytest.approx((136.0, lo))
        assert first[3] == pytest.approx((136.0, hi))
        assert last[:, 0].max() == pytest.approx(137.0)
        (line,) = named(axes, "critical point")
        assert line.get_xdata()[[0, -1]] == pytest.approx([136.0, 137.0])
        assert line.get_ydata()[0] == pytest.approx(thrown.critical[0][side][0])
    (event,) = thrown.events
    (mark,) = named(figure.axes[1], "border collision")
    assert mark.get_xdata()[0] == pytest.approx(math.degrees(event.values[0]["throw.speed"]))
    assert mark.get_ydata()[0] == pytest.approx(event.collision.x)
    assert words_of(figure) == ["attractor 0", "critical point", "event: border collision"]


def test_against_t_or_another_quantity(thrown):
    figure = ls.plot.bifurcation(thrown, "t")
    assert figure.axes[-1].get_xlabel() == "t"
    assert figure.axes[0].get_xlim() == (0.0, 1.0)
    with pytest.raises(AnswerError, match=r"arm\.length"):
        ls.plot.bifurcation(thrown, "arm.length")
    square = [(-2.0, 2.0), (-2.0, 2.0)]
    plane = ls.continuation(TwoState(1.0), {"r": (0.8, 0.9)}, steps=1, cells=16, domain=square)
    with pytest.raises(AnswerError, match="one-dimensional"):
        ls.plot.bifurcation(plane)
