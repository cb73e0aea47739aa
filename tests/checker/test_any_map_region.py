"""Regions of parameters of a map: exact shares, and files whose boxes are no region."""

from fractions import Fraction
from functools import cache

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from limitsets.checker import show
from tests.checker import map_examples as known
from tests.checker.maps_in_files import MapCertificate, arrays_of, cycle, denied, frames_of, refused, uniform


def region():
    """Ricker's map: orbits end in [0.35, 1.65] for r in [2.3, 2.35], and do not for r in [2.5, 2.5001]."""
    certificate = known.ricker().copy()
    low = known.refined(lambda x: x * np.exp(2.50005 * (1.0 - x)), 0.3, 20_000)
    points = [low, 2.0 - low]  # the logarithms of x'/x = exp(r (1 - x)) add up to 0
    slopes = known.slopes_along(points, lambda x: [[np.exp(2.50005 * (1.0 - x)) * (1.0 - 2.50005 * x)]])
    listed = cycle(points, width=2e-4, frames=frames_of(slopes))
    first, second = certificate.header["boxes"]
    first["at"], second["at"] = [[0, 1]], [[2, 3]]
    second["parameters"], certificate.claims(1)["cycles"]["cycles"] = {"r": ["2.5", "2.5001"]}, [listed]
    certificate.header["plane"] = {"axes": [{"parameter": "r", "borders": ["2.3", "2.35", "2.5", "2.5001"]}]}
    return certificate


def axis(certificate, k=0):
    return certificate.header["plane"]["axes"][k]


def test_shares_are_exact_and_printed_to_the_safe_side(tmp_path, capsys):
    report = region().recheck(tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
    plane = report.map["plane"]
    shares = {name: Fraction(share) for name, share in plane["shares"].items()}
    proved, refuted = Fraction(500, 2001), Fraction(1, 2001)
    assert shares == {"basin": proved, "ends-in": proved, "cycles": refuted, "refuted": refuted}
    assert Fraction(plane["open"]) == Fraction(1500, 2001)
    show(report, "region")
    text = capsys.readouterr().out
    assert "region: r in [2.3, 2.5001], in 2 boxes of parameters; open on 74.97 % of it" in text  # 74.9625...
    assert (
        "    ends-in: proved on 24.98 % of the region\n    cycles: proved on 0.04 %" in text
    )  # 24.987..., 0.0499...
    assert "    the goal: refuted on 0.04 % of the region" in text
    assert "PROVED, boxes of parameters: 1 proved, 1 refuted" in text


@cache
def of_two():
    """Boxes in the plane of Leslie's two parameters, which claim nothing but the first."""
    cells = arrays_of(
        known.LESLIE,
        uniform((0, 90), (0, 70), cells=256),
        {"a": [19.6, 19.61], "b": [23.68, 23.69]},
        slack=0.2,
    )
    places = [([0, 1], [0, 1]), ([1, 2], [0, 2]), ([0, 1], [1, 2])]
    a, b = ["19.6", "19.61", "19.7"], ["23.68", "23.69", "23.8"]
    boxes = [
        ({"a": a[i[0] : i[1] + 1][:: len(a[i[0] : i[1]])], "b": [b[j[0]], b[j[1]]]}, {}, None)
        for i, j in places
    ]
    boxes[0] = (boxes[0][0], {"basin": {}}, cells)
    certificate = MapCertificate(known.LESLIE, boxes)
    for box, place in zip(certificate.header["boxes"], places, strict=True):
        box["at"] = list(place)
    certificate.header["plane"] = {
        "axes": [{"parameter": "a", "borders": a}, {"parameter": "b", "borders": b}]
    }
    return certificate


def two():
    return of_two().copy()


def test_a_box_of_a_plane_counts_by_its_area(tmp_path):
    report = two().recheck(tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
    assert Fraction(report.map["plane"]["shares"]["basin"]) == Fraction(1, 10) * Fraction(1, 12)


def put(box, **changed):
    return lambda c: c.header["boxes"][box].update(changed)


ODD = {
    "no axis": lambda c: c.header["plane"].update(axes=[]),
    "four axes": lambda c: c.header["plane"].update(axes=c.header["plane"]["axes"] * 2),
    "axis twice": lambda c: c.header["plane"].update(axes=[axis(c), axis(c)]),
    "a key too many": lambda c: c.header["plane"].update(verdict="proved"),
    "no parameter": lambda c: axis(c).update(parameter="c"),
    "parameter is a list": lambda c: axis(c).update(parameter=["a"]),
    "borders fall": lambda c: axis(c).update(borders=["19.6", "19.61", "19.60"]),
    "border twice": lambda c: axis(c).update(borders=["19.6", "19.6", "19.7"]),
    "border is a number": lambda c: axis(c).update(borders=[19.6, 19.61, 19.7]),
    "one border": lambda c: axis(c).update(borders=["19.6"]),
    "box without a place": lambda c: c.header["boxes"][1].pop("at"),
    "place in one axis": put(1, at=[[1, 2]]),
    "place reversed": put(1, at=[[2, 1], [0, 2]]),
    "place empty": put(1, at=[[1, 1], [0, 2]]),
    "place below 0": put(1, at=[[-1, 2], [0, 2]]),
    "place beyond": put(1, at=[[1, 3], [0, 2]]),
    "place true": put(0, at=[[False, True], [0, 1]]),
    "place in floats": put(0, at=[[0.0, 1.0], [0, 1]]),
    "other borders": put(1, at=[[0, 2], [0, 2]]),
    "parameters moved": lambda c: c.header["boxes"][2]["parameters"].update(a=["19.6", "19.7"]),
    "parameter without a range": lambda c: c.header["boxes"][2]["parameters"].update(a="19.6"),
    "over another": lambda c: c.header["boxes"][2].update(
        at=[[0, 1], [0, 2]], parameters={"a": ["19.6", "19.61"], "b": ["23.68", "23.8"]}
    ),
    "a place without a plane": lambda c: c.header.update(plane=None),
    "other fixed parameters": lambda c: (
        c.header["plane"].update(axes=[axis(c)]),
        [box.update(at=box["at"][:1]) for box in c.header["boxes"]],
        c.header["boxes"].pop(),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ODD)
def test_boxes_that_are_no_region_are_refused(name, tmp_path):
    certificate = two()
    ODD[name](certificate)
    refused(certificate, tmp_path)


@pytest.mark.parametrize(
    ("borders", "place", "why"),
    [
        (["2.3", "2.36", "2.5", "2.5001"], ["2.3", "2.36"], "image on branch 0"),
        (["2.25", "2.35", "2.5", "2.5001"], ["2.25", "2.35"], "image on branch 0"),
    ],
)
def test_a_box_that_is_stretched_is_denied(borders, place, why, tmp_path):
    certificate = region()
    axis(certificate)["borders"] = borders
    certificate.header["boxes"][0]["parameters"]["r"] = place
    denied(certificate, tmp_path, why)


def test_many_smallest_boxes_need_no_memory(tmp_path):
    certificate = two()
    for k in (0, 1):
        axis(certificate, k)["borders"] = [f"{n}" for n in range(10_000)]
    assert "more than 10^7" in certificate.recheck(tmp_path).reason
