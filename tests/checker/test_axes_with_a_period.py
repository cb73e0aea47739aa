"""Certificates of maps on axes with a period: proved, denied, refused; written here apart from the package."""

import itertools

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from limitsets.checker import show
from tests.checker.maps_in_files import Example, MapCertificate, cycle, denied, hexed, refused, region

CELLS = 64


def pulled(x, p):
    """The lift of a circle: 0 attracts, 1/2 repels."""
    return x[0] - p.a * np.sin(6.283185307179586 * x[0])


def ranks_of(targets, component):
    """By cell the longest way to the component, -1 where there is none or it is endless."""
    rank = np.where(component >= 0, 0, -1)
    for _ in targets:
        for cell, on in enumerate(targets):
            if rank[cell] < 0 and all(rank[k] >= 0 for k in on):
                rank[cell] = 1 + max(rank[k] for k in on)
    return rank.astype(np.int32)


def arrays_of(edges, period, low, high, component):
    """Arrays of a circle of uniform cells whose images, by the lift, are from `low` to `high`."""
    n = len(edges)
    first = np.floor((low - edges[0]) / period * n - 1e-6).astype(int)
    last = np.floor((high - edges[0]) / period * n + 1e-6).astype(int)
    targets = [[k % n for k in range(a, b + 1)] for a, b in zip(first, last, strict=True)]
    rows = np.stack([first % n, first % n + last - first], axis=1).astype(np.int32)
    labels = {"component": component.astype(np.int32), "rank": ranks_of(targets, component)}
    return {"edges.0.0": edges, "target.0": rows} | labels


def on_circle(
    function=pulled, lo=0.0, period="1", extent=1.0, seam=0, claims=("trapping", "basin"), goal=None
):
    """A certificate of the map `pulled`, or one like it: the attracting cells lie on both sides of an edge."""
    edges = lo + extent * np.arange(CELLS) / CELLS
    parameters = {"a": "0.1"}
    ends = [function([x], type("P", (), {"a": 0.1})) for x in (edges, edges + extent / CELLS)]
    component = np.where(np.isin(np.arange(CELLS), [(seam - 1) % CELLS, seam]), 0, -1)
    made = MapCertificate(
        Example(1, "a", lambda x, p, *_: function(x, p)),
        [(parameters, {claim: {} for claim in claims}, arrays_of(edges, extent, *ends, component))],
        goal,
    )
    made.header["map"]["periodic"] = [[period]]
    return made


def turned(x, p):
    return pulled(x, p) + 7


def radians(x, p):
    return x[0] - 0.5 * np.sin(x[0])


# ---------------------------------------------------------------- true


@pytest.mark.parametrize(
    "made",
    [
        on_circle(),
        on_circle(turned),  # a lift may turn as often as it likes
        on_circle(lo=-0.25, seam=CELLS // 4),  # the attracting cells lie in the middle
        on_circle(radians, period="tau", extent=2 * np.pi),
    ],
    ids=["seam", "turned", "moved", "tau"],
)
def test_true_certificates_are_proved(made, tmp_path):
    report = made.recheck(tmp_path)
    assert report.verdict == "proved", report
    assert [claim[1] for claim in report.claims] == ["proved", "proved"]


def test_images_that_go_round_are_the_whole_circle(tmp_path):
    made = on_circle(lambda x, p: 100 * x[0] + p.a, claims=["invariant"])
    made.arrays["0.target.0"][:] = [0, CELLS - 1]
    made.arrays["0.component"][:] = made.arrays["0.rank"][:] = 0
    assert made.recheck(tmp_path).verdict == "proved"


def test_the_report_names_the_period_and_where_the_formula_is_evaluated(tmp_path, capsys):
    show(on_circle(lo=-0.25, seam=CELLS // 4).recheck(tmp_path), "circle.proof.zip")
    text = capsys.readouterr().out
    assert "x0' modulo 1, in [-0.25, -0.25 + 1)" in text
    # beside 1/2, where the slope is 1.63, two cells on each side meet their own images: 60 of 64, rounded down
    assert "93.7 % of [-0.25, 0.75]" in text


def test_one_axis_of_two_may_close(tmp_path):
    made = on_circle()
    one = {name.removeprefix("0."): array for name, array in made.arrays.items()}
    row = one["target.0"]
    # 4 cells of y in [-1, 1], halved: the outer ones come to the inner ones, which stay
    ys = np.array([[1, 2]] * 4)
    rows = [[row[i, 0], a, row[i, 1], b] for i, (a, b) in itertools.product(range(CELLS), ys)]
    inner = np.tile([False, True, True, False], CELLS)
    component = np.where(inner, np.repeat(one["component"], 4), -1).astype(np.int32)
    rank = np.repeat(one["rank"], 4)
    rank = np.where((component < 0) & (rank >= 0), np.maximum(rank, 1), rank).astype(np.int32)
    arrays = {"edges.0.0": one["edges.0.0"], "edges.0.1": np.linspace(-1.0, 1.0, 5)}
    arrays |= {"target.0": np.array(rows, np.int32), "component": component, "rank": rank}
    plane = MapCertificate(
        Example(2, "a", lambda x, p, *_: (pulled(x, p), 0.49 * x[1])),
        [({"a": "0.1"}, {"trapping": {}, "basin": {}}, arrays)],
    )
    plane.header["map"]["periodic"] = [["1", None]]
    assert plane.recheck(tmp_path).verdict == "proved"
    plane.header["map"]["periodic"] = [[None, "2"]]
    refused(plane, tmp_path)


def test_goal_of_starts_short_of_the_seam(tmp_path):
    ends = [region((0.0, 0.25)), region((0.75, 1.0))]
    for starts, verdict in (
        ((0.625, 0.96875), "proved"),
        ((0.625, 1.0), "failed"),
        ((0.25, 0.625), "failed"),
    ):
        made = on_circle(claims=["ends-in"], goal={"starts": [region(starts)], "ends": ends})
        assert made.recheck(tmp_path).verdict == verdict


# ---------------------------------------------------------------- false


def cell(name, number, value):
    def forge(made):
        made.arrays[f"0.{name}"][number] = value

    return forge


def period(text):
    return lambda made: made.header["map"].update(periodic=[[text]])


def formula(function):
    def forge(made):
        made.header["map"]["programs"] = Example(1, "a", lambda x, p, *_: function(x, p)).header()["programs"]

    return forge


def both(*forges):
    return lambda made: [forge(made) for forge in forges]


def drops_the_first_cell(made):
    """Leave the cell behind the seam out of the component; it and all others are a step farther."""
    rank = made.arrays["0.rank"]
    rank[rank > 0] += 1
    made.arrays["0.component"][0], rank[0] = -1, 1


FALSE = {
    "half a turn more": formula(lambda x, p: pulled(x, p) + 0.5),
    "a hair more than a turn": formula(lambda x, p: pulled(x, p) + 1.01),
    "another period": period("2"),
    "a period a little longer": period("1.02"),
    "a parameter": lambda made: made.header["boxes"][0]["parameters"].update(a="-0.1"),
    "target shortened before the seam": cell("target.0", 0, [0, 0]),
    "target shortened behind the seam": cell("target.0", CELLS - 1, [CELLS - 1, CELLS - 1]),
    "target moved on": cell("target.0", 20, [40, 41]),
    "component without the cell before the seam": both(
        cell("component", CELLS - 1, -1), cell("rank", CELLS - 1, 1)
    ),
    "component without the cell behind the seam": drops_the_first_cell,
    "rank of a cell that stays": both(cell("rank", CELLS // 2, 30), cell("rank", CELLS // 2 - 1, 30)),
    "rank lowered": cell("rank", 20, 1),
    "component of a far cell": both(cell("component", 20, 0), cell("rank", 20, 0)),
    "the whole circle": cell("target.0", 20, [0, CELLS - 1]),
}


@pytest.mark.parametrize("name", FALSE)
def test_false_certificates_are_denied(name, tmp_path):
    # cut elsewhere the last cell does not attract: one that is too long shows
    made = on_circle(lo=-0.25, seam=CELLS // 4) if "period" in name else on_circle().copy()
    FALSE[name](made)
    denied(made, tmp_path)


def test_an_image_on_the_seam_is_of_the_first_cell(tmp_path):
    """x' = 1 is the state 0, whose formula is evaluated at 0: the last cell does not hold it."""
    made = on_circle(lambda x, p: 1 + 0 * x[0], claims=["invariant", "basin"])
    assert made.recheck(tmp_path).verdict == "proved"
    made.arrays["0.target.0"][:] = [CELLS - 1, CELLS - 1]
    made.arrays["0.component"][0], made.arrays["0.rank"][0] = -1, 1
    denied(made, tmp_path)


# ---------------------------------------------------------------- odd


def second_box(made, first):
    box = made.header["boxes"][0] | {"prefix": "1."}
    made.header["boxes"].append(box)
    made.arrays |= {"1." + name[2:]: array.copy() for name, array in made.arrays.items()}
    made.arrays["1.edges.0.0"] += first


def last_edge_at_the_double(made):
    """0.7 stands for the double below it too."""
    made.header["map"].update(periodic=[["0.7"]])
    made.arrays["0.edges.0.0"] = np.append(0.69 * np.arange(CELLS - 1) / CELLS, 0.7)


ODD = {
    "last edge on a seam that is no double": last_edge_at_the_double,
    "more than a turn": cell("target.0", 20, [3, 3 + CELLS]),
    "a range of many turns": cell("target.0", 20, [3, 2**31 - 1]),
    "first cell beyond the circle": cell("target.0", 20, [CELLS, CELLS]),
    "first cell before the circle": cell("target.0", 20, [-1, 2]),
    "range reversed": cell("target.0", 20, [5, 4]),
    "edges that do not ascend": cell("edges.0.0", 5, 4 / CELLS),
    "last edge on the seam": cell("edges.0.0", -1, 1.0),
    "last edge beyond the seam": cell("edges.0.0", -1, 1.5),
    "edge nan": cell("edges.0.0", 0, np.nan),
    "edge infinite": cell("edges.0.0", -1, np.inf),
    "an edge too many": lambda made: made.arrays.update({"0.edges.0.0": np.linspace(0, 1, CELLS + 1)}),
    "no edge": lambda made: made.arrays.update({"0.edges.0.0": np.zeros(0)}),
    "a period too short": period("0.5"),
    "a period of 0": period("0"),
    "a period below 0": period("-1"),
    "a period by name": period("pi"),
    "a period that is a number": period(1.0),
    "a period that is a list": period(["1"]),
    "no period where edges have none": period(None),
    "periods of another axis": lambda made: made.header["map"].update(periodic=[["1", "1"]]),
    "boxes that begin elsewhere": lambda made: second_box(made, 1 / 1024),
    "cycles without their turns": lambda made: made.claim("cycles", cycles=[cycle([0.5])]),
    "cycles of a domain that begins elsewhere": lambda made: made.claim(
        "cycles", cycles=[cycle([0.5]) | {"turns": [[0]]}], begins=[hexed([0.25])]
    ),
    "escapes": lambda made: made.claim("escapes"),
    "all cycles": lambda made: made.claim(
        "all-cycles", period=1, domain=[{"side": 0, "box": hexed([(0.0, 1.0)])}]
    ),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_files_are_refused(name, tmp_path):
    made = on_circle().copy()
    ODD[name](made)
    refused(made, tmp_path)


def test_cycles_of_a_map_whose_axes_end_have_no_turns(tmp_path):
    made = MapCertificate(Example(1, "", lambda x, *_: 0.5 * x[0] + 0.25), [({}, {}, None)])
    made.claim("cycles", cycles=[cycle([0.5])])
    assert made.recheck(tmp_path).verdict == "proved"
    made.claims()["cycles"]["cycles"][0]["turns"] = [[0]]
    refused(made, tmp_path)


def test_boxes_that_begin_alike_are_read(tmp_path):
    made = on_circle()
    second_box(made, 0.0)
    assert made.recheck(tmp_path).verdict == "proved"
