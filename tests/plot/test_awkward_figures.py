"""What figures showed awkwardly: cut titles, labels of many sides, maps of one's own, units, single dots."""

import math
import re
from functools import lru_cache

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.face.report.writing import figure
from tests.maps_of_tests import TwoState
from tests.plot.artists import drawn, named


def many_sides(count=12):
    """A regular polygon, which can rest on every side: more than ten of them."""
    turns = [2 * math.pi * (k - 0.5) / count - math.pi / 2 for k in range(count)]
    corners = [[f"{40 * math.cos(t):.6f} mm", f"{40 * math.sin(t):.6f} mm"] for t in turns]
    return {
        "part": {"vertices": corners, "mass": {"plate_density": "3 kg/m^2"}},
        "arm": {"surface_height": "-2 mm", "length": "600 mm"},
        "throw": {"kappa": "200 mm"},
    }


@pytest.mark.parametrize(("kappa", "x"), [("14 in", 27.0), ("20 in", 50.0)])
def test_titles_of_a_high_throw_stay_in_their_panels(kappa, x):
    high = {"throw.kappa": kappa, "arm.length": "120 in"}
    made = drawn(ls.plot.flight(ls.load("paper-designed").with_values(high), x, 2))
    left, right = (axes.title if axes.get_title() else axes._left_title for axes in made.axes)
    boxes = [text.get_window_extent() for text in (left, right)]
    assert made.axes[0].get_position().y0 == made.axes[1].get_position().y0  # they stand beside each other
    assert not boxes[0].overlaps(boxes[1])
    assert all(made.bbox.x0 <= box.x0 and box.x1 <= made.bbox.x1 and box.y1 <= made.bbox.y1 for box in boxes)


def test_titles_of_a_throw_fill_their_panels():
    """Lines as wide as the panel: two of them, and not one for each phrase."""
    made = drawn(ls.plot.flight(ls.load("paper-designed"), 21.0, 2))
    assert [axes.get_title(loc="left").count("\n") for axes in made.axes] == [1, 1]


@pytest.mark.parametrize("draw", [ls.plot.limit_set, ls.plot.map], ids=["limit-set", "map"])
def test_the_number_of_a_side_is_one_subscript(draw):
    scene = ls.load(many_sides())
    made = draw(scene, {10: [(200.0, 400.0)]})
    labels = {text.get_text() for axes in made.axes for text in axes.texts if text.get_gid() == "name"}
    wanted = [text for text in labels if re.match(r"\$r_\{?1[01]", text)]
    assert wanted
    assert all(re.match(r"\$r_\{1[01]\}\$", text) for text in wanted)


@lru_cache(maxsize=1)
def own():
    graph = ls.transitions(ls.maps.Logistic(3.8), ls.grid([(0.0, 1.0)], cells=256))
    found = ls.attractors(graph)
    return graph, found, ls.basins(graph, found)


def test_a_map_of_ones_own():
    """The logistic map at 3.8: one attractor from F(F(1/2)) to F(1/2) = 0.95, switching at 1/2."""
    graph, found, shares = own()
    (axes,) = drawn(ls.plot.map(graph, found)).axes
    assert [line.get_xdata()[0] for line in named(axes, "critical point")] == pytest.approx([0.5])
    x, y = np.concatenate([line.get_xydata() for line in axes.lines if line.get_gid() in ("left", "right")]).T
    met = np.isfinite(y)
    assert y[met] == pytest.approx(3.8 * x[met] * (1.0 - x[met]))
    (axes,) = drawn(ls.plot.limit_set(graph, found)).axes
    (bar,) = named(axes, "limit set")
    assert (bar.get_x(), bar.get_x() + bar.get_width()) == pytest.approx((0.1805, 0.95), abs=4 / 256)
    for source in (graph, graph.map, graph.grid):
        made = drawn(ls.plot.basins(source, shares, found))
        assert named(made.axes[0], "attractor")
    assert "Logistic" in ls.plot.basins(graph.map, shares).get_suptitle()


def test_a_map_of_ones_own_leaves_its_domain():
    """Logistic at 3.8 on (0.3, 1): images of starts near 1 lie below 0.3, so nothing goes outward."""
    graph = ls.transitions(ls.maps.Logistic(3.8), ls.grid([(0.3, 1.0)], cells=64))
    texts = [text.get_text() for text in ls.plot.basins(graph, ls.basins(graph, ())).legends[0].get_texts()]
    assert [text for text in texts if text.startswith("leaves the domain")]
    assert not [text for text in texts if "outward" in text]


def test_a_bare_map_says_what_it_lacks():
    with pytest.raises(AnswerError, match=r"pass .* or limitsets\.transitions\("):
        ls.plot.map(ls.maps.Logistic(3.8))
    with pytest.raises(AnswerError, match=r"pass .* or limitsets\.transitions\("):
        ls.plot.limit_set(ls.maps.Logistic(3.8), own()[1])


@lru_cache(maxsize=1)
def plane():
    graph = ls.transitions(TwoState(0.5), ls.grid([(-2.0, 2.0), (-2.0, 2.0)], cells=32))
    found = ls.attractors(graph)
    return graph, found, ls.basins(graph, found)


def test_basins_in_the_plane_show_the_attractor():
    graph, found, shares = plane()
    made = drawn(ls.plot.basins(graph, shares, found))
    pictures = [each for axes in made.axes for each in named(axes, "attractor")]
    assert len(pictures) == len(found) * graph.grid.sides
    arrays = [each.get_array() for each in pictures]
    shown = sum(int(np.asarray(each).astype(bool)[~np.ma.getmaskarray(each)].sum()) for each in arrays)
    assert shown == sum(len(each.cells) for each in found)
    assert "the limit set itself" in [text.get_text() for text in made.legends[0].get_texts()]
    with pytest.raises(AnswerError, match="attractors"):
        ls.plot.basins(graph, shares, 3)
    with pytest.raises(AnswerError, match="dimension of the map"):
        ls.plot.map(graph)


def test_the_morse_graph_names_the_unit():
    found = ls.analyse("paper-designed")
    texts = [text.get_text() for text in figure(found, "morse").axes[0].texts]
    intervals = [line for text in texts for line in text.splitlines() if line.startswith("side ")]
    assert intervals
    assert all(line.endswith(" in") for line in intervals)


def test_the_morse_graph_of_the_plane_shows_both_axes():
    graph, found, _ = plane()
    texts = [text.get_text() for text in ls.plot.morse(graph).axes[0].texts]
    attracting = next(text for text in texts if "$x_1$" in text)
    assert "$x_0$" in attracting
    assert found[0].cells.extents(axis=1)


def test_the_morse_graph_of_a_map_without_sides_names_none_and_stays_legible():
    """An arrow to a way out runs behind the words of another node."""
    rectangle = ls.grid([(-0.001, 90.0), (-0.001, 70.0)], depth=12)
    graph = ls.transitions(ls.maps.Leslie(), rectangle, "corners-padded")
    words = named(ls.plot.morse(graph).axes[0], "words")
    assert words
    for each in words:
        assert "side" not in each.get_text()
        assert "$x_0$" in each.get_text()
        assert each.get_bbox_patch().get_facecolor() == (1.0, 1.0, 1.0, 1.0)
