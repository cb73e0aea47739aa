"""Certificates of maps whose claims are true: proved, refuted, printed; and what a checker cannot prove is denied.

Expected answers: Henon's blocks and 7-cycle, Ricker's stability and Leslie's two attractors are known from the
literature, the 2-cycle of the map with a gap by hand.
"""

import json
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from limitsets.checker import cells, recheck, show
from limitsets.checker.labels import box_max
from tests.checker import map_examples as known
from tests.checker.maps_in_files import (
    Example,
    MapCertificate,
    arrays_of,
    cycle,
    denied,
    frames_of,
    hexed,
    region,
    uniform,
)

PROVED = {
    "gap": known.gap,
    "seven": known.seven,
    "seven, every a in a range": lambda: known.seven(("1.2399", "1.2401"), 0.003),
    "delayed Ricker": known.delayed,
    "Ricker": known.ricker,
    "Leslie": known.two_ages,
    "pendulum": known.pushed,
}


def words_of(report):
    return {name: word for name, word, _ in report.claims}


@pytest.mark.parametrize("name", PROVED)
def test_what_is_true_is_proved(name, tmp_path):
    report = PROVED[name]().recheck(tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
    assert set(words_of(report).values()) <= {"proved", "refuted"}


def test_the_map_with_a_gap(tmp_path, capsys):
    certificate = known.gap()
    report = certificate.recheck(tmp_path)
    show(report, "gap.proof.zip")
    text = capsys.readouterr().out
    assert certificate.claims()["attracts-all"]["max_rank"] == 1
    assert "certificate of a map: 1 coordinate, 1 side, 2 branches" in text
    assert "side 0: branch 1 if and only if margin > 0, else branch 0" in text
    assert "the proof is of these formulas, not of the function image" in text
    assert "    x0' = s * x0 - 1\n" in text
    assert "s = 1.4" in text
    assert "at least 0.336471" in text  # ln 1.4 = 0.33647223...
    assert "period 2 in [-0.270834, -0.270833]" in text  # -0.26/0.96
    assert text.endswith("PROVED\n")


def test_leslie_has_two_blocks(tmp_path):
    trapping, basin = known.two_ages().recheck(tmp_path).statement
    assert (
        trapping.count("component 1 (165 cells"),
        trapping.count("component 2"),
        basin.count("component"),
    ) == (1, 1, 0)


def test_sentences_say_for_which_parameters(tmp_path, capsys):
    show(known.delayed().recheck(tmp_path), "delayed")
    text = capsys.readouterr().out
    assert (
        "for every alpha in the range, fixed in time: cycles, converges; changed at every step too: basin"
        in text
    )
    assert "alpha in [0.6, 0.601]" in text
    show(known.ricker().recheck(tmp_path), "margin")
    text = capsys.readouterr().out
    assert "PROVED, boxes of parameters: 1 proved, 1 refuted" in text
    assert "every start in [0.02, 2.6] ends in [0.35, 1.65] and stays" in text
    assert "refuted: REFUTED - an open set of starts" in text


def test_refutations_alone_are_refuted(tmp_path):
    certificate = known.ricker().copy()
    del certificate.header["boxes"][0]
    certificate.arrays.clear()
    report = certificate.recheck(tmp_path)
    assert (report.verdict, words_of(report)) == ("refuted", {"cycles": "proved", "refuted": "refuted"})


def test_processes_that_share_the_work_come_to_the_same_verdict(tmp_path, monkeypatch):
    monkeypatch.setattr(cells, "SMALL", 10)
    certificate = known.delayed().copy()
    file = certificate.write(tmp_path / "map.proof.zip")
    done = []
    report = recheck(file, workers=2, progress=lambda *counts: done.append(counts))
    assert report.verdict == "proved"
    assert done[-1][0] == done[-1][1] == report.boxes
    certificate.header["boxes"][0]["parameters"]["alpha"] = ["0.6", "0.605"]
    assert recheck(certificate.write(file), workers=2).reason == certificate.recheck(tmp_path).reason != ""


def test_command_line(tmp_path):
    """Exit codes, JSON, and formulas that are long."""
    long = Example(1, "", lambda x, *_: sum((np.sin(x[0] + k) / 500 for k in range(300)), 0.5 * x[0]))
    cells = arrays_of(long, uniform((-1, 1), cells=20), {})
    file = MapCertificate(long, [({}, {"trapping": {}}, cells)]).write(tmp_path / "long.proof.zip")
    forged = known.seven().copy()
    forged.header["map"]["programs"][0]["ops"][0] = ["sin", 0]
    bad = forged.write(tmp_path / "bad.proof.zip")

    def run(*words):
        return subprocess.run(
            [sys.executable, "-m", "limitsets.checker", *words], capture_output=True, text=True
        )

    short, whole, told = run(str(file)), run(str(file), "--formulas"), run(str(file), "--json")
    assert (short.returncode, whole.returncode, told.returncode) == (0, 0, 0)
    assert "lines of formulas are not shown: --formulas shows all" in short.stdout
    assert "not shown" not in whole.stdout
    assert len(json.loads(told.stdout)["map"]["formulas"]) > 40
    assert json.loads(told.stdout)["map"]["boxes"][0]["verdict"] == "proved"
    denied = run(str(bad))
    assert denied.returncode == 2
    assert "BAD FILE" in denied.stdout
    assert denied.stderr == ""


# ------------------------------------------------------------------------------ small maps


def square(x, p, *_):
    return 1.0 - x[0] ** 2


def small(image, cells, *, claims, dimension=1, names="", parameters=None, margin=None, **how):
    example = Example(dimension, names, image, margin, **how)
    return MapCertificate(example, [(parameters or {}, claims, cells)])


def cells_with(edges, targets, rank, component):
    """Arrays by hand, on one side of one dimension."""
    named = {f"target.{b}": np.array(rows, np.int32) for b, rows in enumerate(targets)}
    return {"edges.0.0": np.array(edges, float), **named, "rank": np.array(rank, np.int32),
            "component": np.array(component, np.int32)}  # fmt: skip


def by_hand():
    """Certificates by hand: the identity, a superstable cycle, a line, margins at the end of a cell, two sides."""
    one = cells_with([0, 1], [[[0, 0]]], [0], [0])
    yield "identity", small(lambda x, *_: x[0], one, claims={"invariant": {}})
    listed = cycle([0.0, 1.0], width=1e-3, frames=frames_of([np.array([[0.0]]), np.array([[-2.0]])]))
    yield "superstable", small(square, None, claims={"cycles": {"cycles": [listed]}})
    grid = arrays_of(Example(2, "", lambda x, *_: (x[1], 0.0 * x[0])), uniform((-1, 1), (-1, 1), cells=3), {})
    yield (
        "line",
        small(lambda x, *_: (x[1], 0.0 * x[0]), grid, claims={"trapping": {}, "basin": {}}, dimension=2),
    )
    half = cells_with([-1, 0, 1], [[[0, 1], [-2, -2]], [[-2, -2], [0, 0]]], [0, 0], [0, 0])
    half["target.1"][0], half["target.0"][1] = -2, -2
    margin = small(
        lambda x, p, _, b: -0.5 if b else 0.5 * x[0],
        half,
        claims={"invariant": {}},
        margin=lambda x, *_: x[0] + 0,
    )
    # at 0, which belongs to both cells, branch 0 is taken: cell 1 needs its target too
    margin.arrays["0.target.0"][1] = [0, 1]
    yield "margin on an edge", margin
    both = Example(1, "", lambda x, p, side, _: 0.25 * x[0] + side, sides=2, to=lambda side, _: 1 - side)
    edges = [[np.linspace(-1, 2, 7)], [np.linspace(-1, 2, 13)]]
    yield "two sides", MapCertificate(both, [({}, {"trapping": {}, "basin": {}}, arrays_of(both, edges, {}))])
    fold = arrays_of(Example(1, "", lambda x, *_: 0.5 * abs(x[0])), uniform((-1, 1), cells=4), {})
    yield "a fold", small(lambda x, *_: 0.5 * np.abs(x[0]), fold, claims={"basin": {}})
    three = Example(3, "", lambda x, *_: (0.5 * x[1], 0.5 * x[2], 0.5 * np.sin(x[0])))
    yield (
        "three coordinates",
        MapCertificate(
            three,
            [
                (
                    {},
                    {"trapping": {}, "basin": {}},
                    arrays_of(three, uniform((-1, 1), (-1, 1), (-1, 1), cells=5), {}, count=3),
                )
            ],
        ),
    )


@pytest.mark.parametrize(("name", "certificate"), list(by_hand()))
def test_maps_by_hand_are_proved(name, certificate, tmp_path):
    report = certificate.recheck(tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")


def test_claims_about_orbits_alone_need_no_cells_and_may_be_many(tmp_path):
    """x' = 4 x (1 - x) has the fixed point 3/4 and the 2-cycle (5 -+ sqrt 5)/8; the fixed point repels."""
    low, high = ((5 + s * np.sqrt(5)) / 8 for s in (-1, 1))
    cycles = [cycle([0.75]), cycle([low, high])]
    certificate = small(lambda x, *_: 4.0 * x[0] * (1.0 - x[0]), None, claims={"cycles": {"cycles": cycles}})
    report = certificate.recheck(tmp_path)
    assert report.verdict == "proved"
    assert "2 periodic orbits: period 1 in [0.749999, 0.750001]; period 2 in" in report.statement[0]


@pytest.mark.parametrize(
    ("slope", "unstable"),
    [
        ([[2.0]], True),
        ([[-1.001]], True),
        ([[0.999]], False),
        ([[0.5, 3.0], [0.0, -1.01]], True),  # a real eigenvalue below -1
        ([[1.01, 3.0], [0.0, 0.2]], True),  # one above 1
        ([[0.8, -0.8], [0.8, 0.8]], True),  # a spiral, |det| = 1.28
        ([[0.6, -0.8], [0.8, 0.61]], True),  # |det| = 1.006
        ([[0.6, -0.8], [0.8, 0.6]], False),  # a rotation
        ([[0.6, -0.8], [0.8, 0.59]], False),
        ([[0.5, 0.0, 0.0], [0.0, 0.0, 2.0], [0.0, 0.6, 0.0]], True),  # +- sqrt(1.2): det = -0.6
        ([[0.5, 0.0, 0.0], [0.0, 0.0, 2.0], [0.0, 0.4, 0.0]], False),
    ],
)
def test_a_fixed_point_is_unstable_where_an_eigenvalue_lies_beyond_the_unit_circle(slope, unstable, tmp_path):
    def linear(x, *_):
        return tuple(
            sum((v * y for v, y in zip(row[1:], x[1:], strict=True)), row[0] * x[0]) for row in slope
        )

    claims = {"cycles": {"cycles": [cycle([[0.0] * len(slope)]) | {"unstable": True}]}}
    report = small(linear, None, claims=claims, dimension=len(slope)).recheck(tmp_path)
    assert report.verdict == ("proved" if unstable else "failed")
    said = report.statement[0] if unstable else report.reason
    assert said.endswith(", unstable" if unstable else "that it is unstable is not proved")


def test_the_steps_of_an_unstable_cycle_are_multiplied_in_their_order(tmp_path):
    """Of (x, y) -> (y, 0) -> (0, x) -> (0, 2 y): in this order y doubles, in the opposite one all comes to 0."""

    def turned(x, p, side, _):
        return [(x[1], 0.0 * x[0]), (0.0 * x[0], x[0] + 0.0), (0.0 * x[0], 2.0 * x[1])][side]

    for unstable, verdict in (((0, 1, 2), "proved"), ((2, 1, 0), "failed")):
        steps = Example(
            2,
            "",
            lambda x, p, side, b, order=unstable: turned(x, p, order[side], b),
            sides=3,
            to=lambda side, _: (side + 1) % 3,
        )
        listed = cycle(np.zeros((3, 2)), sides=[0, 1, 2]) | {"unstable": True}
        report = MapCertificate(steps, [({}, {"cycles": {"cycles": [listed]}}, None)]).recheck(tmp_path)
        assert report.verdict == verdict, report.reason


def test_attracts_all_with_the_ball_of_a_cycle(tmp_path):
    """x' = x/2: every start tends to 0; the number of attractors is exact."""
    half = Example(1, "", lambda x, *_: 0.5 * x[0])
    edges = uniform((-1, 1), cells=16)
    final = np.abs(np.arange(16) - 7.5) < 4
    cells = arrays_of(half, edges, {}, final=final)
    listed = cycle([0.0], frames=[[[1.0]]], radius=0.75)
    claims = {
        "cycles": {"cycles": [listed]},
        "converges": {"components": [0], "cycles": [0]},
        "attracts-all": {"max_rank": int(cells["rank"].max())},
        "ends-in": {},
    }
    goal = {"starts": [region((-1, 1))], "ends": [region((-0.8, 0.8))]}
    certificate = MapCertificate(half, [({}, claims, cells)], goal)
    assert certificate.recheck(tmp_path).verdict == "proved"
    certificate.header["goal"]["ends"] = [region((-0.6, 0.8))]
    assert words_of(certificate.recheck(tmp_path)) == {**dict.fromkeys(claims, "proved"), "ends-in": "failed"}
    certificate.claims()["cycles"]["cycles"][0]["radius"] = hexed(1.5)
    assert words_of(certificate.recheck(tmp_path))["attracts-all"] == "failed"


def fourfold(image=lambda x, *_: 4.0 * x[0]):
    """x' = 4 x on [-1, 1]: every start leaves, but those near 0, within two steps; -1/4 -> -1 is still inside."""
    low = [[-1, -1], [-1, -1], [-1, 0], [-2, -2]]
    targets = [[*low, [-2, -2], [7, 8], [8, 8], [8, 8]]]
    cells = cells_with(np.linspace(-1, 1, 9), targets, rank=[-1] * 8, component=[-1] * 8)
    cells["exit"] = np.array([0, 0, 1, -1, -1, 1, 0, 0], np.int32)
    return small(image, cells, claims={"escapes": {}})


def test_orbits_that_leave_the_domain(tmp_path):
    report = fourfold().recheck(tmp_path)
    assert report.verdict == "proved"
    words = "every start in cells that cover 74.9 % of [-1.0, 1.0] leaves it within 2 steps"
    assert report.statement == [f"escapes: {words}"]


def undefined(x, *_):
    return 4.0 * x[0] + np.log(x[0] - 0.7) * 0.0


FALL, IMAGE = "exit does not fall", "image on branch 0"


@pytest.mark.parametrize(
    ("cell", "changed", "verdict", "why"),
    [
        (2, {"exit": 0}, "failed", FALL),
        (2, {"exit": 0, "target.0": -1}, "failed", IMAGE),  # -1 is in the domain
        (5, {"exit": 0, "target.0": 8}, "failed", IMAGE),
        (3, {"exit": 2, "target.0": [-1, 3]}, "failed", FALL),
        (3, {"exit": 2, "target.0": [0, 2]}, "failed", IMAGE),
        (0, {"exit": 1, "target.0": [3, 3]}, "failed", FALL),
        (7, {"exit": -1, "target.0": -2}, "failed", FALL),
        (slice(None), {"exit": -1, "target.0": -2}, "failed", "no cell has an exit"),
        (0, {"exit": -1}, "bad file", "out of range"),
        (0, {"rank": 0}, "bad file", "out of range"),
        (0, {"exit": -2}, "bad file", "below -1"),
        (0, {"target.0": [-2, -1]}, "bad file", "out of range"),
        (7, {"target.0": [8, 9]}, "bad file", "out of range"),
        (0, {}, "failed", IMAGE),
    ],
)
def test_exits_that_are_false(cell, changed, verdict, why, tmp_path):
    """Of the last row the formula is not defined everywhere."""
    certificate = fourfold() if changed else fourfold(undefined)
    for name, value in changed.items():
        certificate.arrays[f"0.{name}"][cell] = value
    report = certificate.recheck(tmp_path)
    assert report.verdict == verdict
    assert why in report.reason


@pytest.mark.parametrize(("other", "verdict"), [(lambda y: 0.5 * y, "proved"), (np.log, "failed")])
def test_who_leaves_along_one_axis_may_be_anywhere_along_another_but_somewhere(other, verdict, tmp_path):
    cells = {f"edges.0.{a}": np.array([0.0, 1.0]) for a in (0, 1)}
    cells |= {"target.0": np.array([[1, 0, 1, 0]], np.int32), "exit": np.zeros(1, np.int32)}
    cells |= dict.fromkeys(("rank", "component"), np.full(1, -1, np.int32))
    out = small(lambda x, *_: (x[0] + 2.0, other(x[1])), cells, claims={"escapes": {}}, dimension=2)
    assert out.recheck(tmp_path).verdict == verdict


def test_components_are_compared_from_below_and_from_above(tmp_path):
    """Of the identity on two cells, one of which is said to lead into the other component too."""
    for rows in ([[0, 1], [1, 1]], [[0, 0], [0, 1]]):
        cells = cells_with([0, 1, 2], [rows], [0, 0], [0, 1])
        report = small(lambda x, *_: x[0], cells, claims={"invariant": {}}).recheck(tmp_path)
        assert "lead out of its component" in report.reason


def test_an_image_that_reaches_the_border_is_invariant_and_no_trap(tmp_path):
    one = cells_with([0, 1], [[[0, 0]]], [0], [0])
    for image in (lambda x, *_: x[0], lambda x, *_: 0.5 * x[0], lambda x, *_: 0.5 + 0.5 * x[0]):
        assert small(image, one, claims={"invariant": {}}).recheck(tmp_path).verdict == "proved"
        assert small(image, one, claims={"trapping": {}}).recheck(tmp_path).verdict == "failed"
    assert (
        small(lambda x, *_: 0.25 + 0.5 * x[0], one, claims={"trapping": {}}).recheck(tmp_path).verdict
        == "proved"
    )


@pytest.mark.parametrize(
    ("image", "points", "why"),
    [
        (lambda x, *_: np.sqrt(x[0]), [0.0], "singular"),  # no slope at 0, the end of the formula's domain
        (lambda x, *_: np.floor(x[0]) + 0.5 * x[0], [0.0], "singular"),  # jumps at 0
        (lambda x, *_: x[0] + x[0] ** 2 + 1e-12, [0.0], ""),  # comes near to itself, and has no fixed point
        (
            lambda x, *_: 1.0 - x[0],
            [0.25, 0.75],
            "singular",
        ),  # half a turn: Newton cannot tell its cycles apart
    ],
)
def test_cycles_that_are_not_proved(image, points, why, tmp_path):
    claims = {"cycles": {"cycles": [cycle(points, width=1e-3 if len(points) == 1 else 1e-9)]}}
    denied(small(image, None, claims=claims), tmp_path, why)


@pytest.mark.parametrize("shape", [(40,), (13, 9), (5, 6, 7)])
def test_the_largest_label_of_a_box_of_cells(shape):
    generator = np.random.default_rng(len(shape))
    table = generator.integers(-1, 1000, shape)
    ends = np.sort([generator.integers(0, n, (2, 300)) for n in shape], axis=1)
    first, last = ends[:, 0].T, ends[:, 1].T
    slices = [
        tuple(slice(a, b + 1) for a, b in zip(*box, strict=True)) for box in zip(first, last, strict=True)
    ]
    assert box_max(table, first, last).tolist() == [table[box].max() for box in slices]
