"""Landings with effects against those of the minimal model: enclosures hold simulated throws, sentences agree."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import limitsets as ls
from limitsets.base import AnswerError, SceneError
from limitsets.face.report.machine_page import alarms_of
from limitsets.feeder.thrower.deviation_box import Compared, deviations
from limitsets.feeder.thrower.effects.landing import Landing
from limitsets.feeder.thrower.effects.roll import Roll
from limitsets.feeder.thrower.effects.slip import Slip
from limitsets.parameters.discrepancy.discrepancy_result import best_of
from limitsets.parameters.discrepancy.measuring import Moved
from limitsets.parameters.discrepancy.model_discrepancy import _Comparison, _ranked
from limitsets.proofs.auditing.findings import with_effects
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.cells import CellSet
from tests.cli.command import documented, run

# friction, kappa, surface height, arm's length, corners of the plate: ten feeders whose parts hardly slide
TEN = [
    (0.6, 52.5, -1.7, 60, (-1.14, 1.14, 1.01, -0.79, 2.07)),
    (0.8, 54.2, -0.4, 28, (-1.14, 1.21, 1.09, -0.72, 2.21)),
    (0.7, 50.7, -1.4, 28, (-1.14, 1.0, 1.02, -0.73, 2.17)),
    (0.75, 50.8, -0.8, 60, (-1.14, 1.23, 1.08, -0.65, 2.07)),
    (0.7, 38.6, -0.6, 40, (-1.14, 1.29, 0.85, -0.63, 1.87)),
    (0.7, 12.0, -0.4, 28, (-1.14, 1.03, 0.91, -0.57, 2.24)),
    (0.65, 56.7, -1.1, 28, (-1.14, 1.05, 0.97, -0.73, 2.24)),
    (0.7, 25.9, -1.2, 28, (-1.14, 1.0, 1.06, -0.43, 2.22)),
    (0.8, 18.0, -1.5, 28, (-1.14, 1.07, 0.92, -0.74, 2.13)),
    (0.6, 32.7, -1.4, 28, (-1.14, 1.0, 1.05, -0.72, 2.21)),
]
# throws that stick, whose other end cannot be held, and that roll on
ROLLING = [
    (0.45, 8.8, -0.7, 28, (-1.32, 1.32, 0.58, -0.53, 0.98)),
    (0.45, 9.7, -0.8, 28, (-0.65, 0.65, 0.3, -0.63, 2.96)),
    (0.35, 10.4, -0.4, 28, (-0.6, 0.6, 0.77, -0.42, 2.63)),
    (0.35, 39.2, -0.7, 28, (-1.18, 1.18, 0.38, -0.49, 0.88)),
    (0.5, 24.0, -0.3, 28, (-1.42, 1.42, 1.04, -1.03, 0.91)),
]
EFFECTS = ("slip", "roll", "landing")


def feeder(row, **world):
    """Build one of the ten."""
    friction, kappa, height, length, (left, right, top_right, top_left, top) = row
    corners = [(left, 0.0), (right, 0.0), (top_right, top), (top_left, top)]
    return ls.load(
        {
            "name": "plate",
            "part": {
                "mass": {"plate_density": "1 kg/m^2"},
                "vertices": [[f"{x} in", f"{y} in"] for x, y in corners],
            },
            "arm": {"length": f"{length} in", "surface_height": f"{height} in"},
            "throw": {"kappa": f"{kappa} in"},
            "world": {"friction": friction, **world},
        }
    )


def plain(name, **world):
    """Load a built-in scene without its effects."""
    return ls.load({**ls.load(name).as_dict(), "effects": {}, "world": world})


def hold(scene, effects, cells=4000, starts=4000):
    """Assert that enclosures of all cells hold simulated landings; give the shares of cells by what is proved."""
    full = with_effects(scene, effects)
    box = parameter_box(with_effects(scene, ("landing", "roll")))
    chosen = tuple(each for name, each in (("landing", Landing()), ("roll", Roll())) if name in effects)
    lo, hi = (each._replace(effects=chosen) for each in (box.lo, box.hi))
    slip = Slip(scene.world.friction) if "slip" in effects else None
    generator, shares = np.random.default_rng(7), np.zeros(len(Compared))
    for side in range(len(scene.sides)):
        edges = np.linspace(scene.domain.lo[side, 0], scene.domain.hi[side, 0], cells + 1)
        state, moved = deviations(lo, hi, slip, side, edges[:-1], edges[1:])
        shares += np.bincount(state, minlength=len(Compared))
        cell = generator.integers(0, cells, starts)
        x = edges[cell] + np.diff(edges)[cell] * generator.random(starts)
        with_them, without = ls.maps.images(full.map, x, side), ls.maps.images(scene.map, x, side)
        same, other = state[cell] == Compared.SAME, state[cell] == Compared.CHANGED
        rests = with_them.code > ls.maps.OUTSIDE_MODEL
        assert (rests & (with_them.side == without.side))[same].all()
        assert (rests & (with_them.side != without.side))[other].all()
        by = with_them.x - without.x
        # both throws are rounded, at places up to 60
        assert (by >= moved[cell, 0] - 1e-13 * scene.arm_length)[same].all()
        assert (by <= moved[cell, 1] + 1e-13 * scene.arm_length)[same].all()
    return dict(zip(Compared, shares / shares.sum(), strict=True))


@pytest.mark.parametrize("row", TEN)
def test_enclosures_hold_simulated_landings(row):
    """With friction and rolling: 1e5 throws for each of ten feeders."""
    assert hold(feeder(row), EFFECTS, starts=25_000)[Compared.SAME] > 0.2


@pytest.mark.parametrize("row", ROLLING)
def test_enclosures_hold_where_the_other_end_slides_and_the_part_rolls(row):
    """Where the part may roll on nothing is claimed."""
    assert hold(feeder(row), ("slip", "roll"), starts=20_000)[Compared.SAME] > 0.0


@pytest.mark.parametrize(
    ("name", "effects", "least"),
    [
        ("paper-initial", ("roll", "landing"), {Compared.SAME: 0.8, Compared.CHANGED: 0.05}),
        ("paper-triangle", ("landing",), {Compared.SAME: 0.8}),
        ("paper-quadrilateral", ("landing", "roll"), {Compared.SAME: 0.2, Compared.CHANGED: 0.3}),
        ("paper-initial", ("slip",), {Compared.SAME: 0.5}),
        ("paper-designed", ("slip", "roll"), {Compared.SAME: 0.5}),
        ("paper-initial", ("slip", "roll"), {Compared.SAME: 0.3}),
        ("paper-quadrilateral", ("slip", "roll"), {Compared.SAME: 0.1}),
    ],
)
def test_enclosures_hold_where_another_corner_lands_and_parts_roll(name, effects, least):
    """Where the side is another one, throws come to another one."""
    shares = hold(plain(name, friction=0.6), effects)
    assert all(shares[kind] > share for kind, share in least.items())


@pytest.mark.parametrize("row", TEN[::3])
def test_orbits_with_friction_stay_on_the_cells_that_are_covered(row):
    """The theorem: on the covered cells an orbit with effects is one of the minimal model with noise."""
    comparison = _Comparison(feeder(row), EFFECTS, 1000, 0)
    rows, deviation = comparison.compare("limit-set", lambda attracting: attracting.cells)
    assert rows[0].how == "proved"
    assert 0.0 < rows[0].most <= deviation
    cells = comparison.attraction(deviation).cells
    generator, grid = np.random.default_rng(3), cells.grid
    number = generator.choice(cells.numbers(), 500)
    side = np.array([grid.side_of(int(each)) for each in number])
    ends = [grid.boxes(np.array([each]), int(at)) for each, at in zip(number, side, strict=True)]
    x = np.array([lo[0, 0] + (hi[0, 0] - lo[0, 0]) * generator.random() for lo, hi in ends])
    extents = cells.extents()
    for _ in range(100):
        x, side, code, _ = ls.maps.advance(comparison.full.map, x, side, 1)
        assert (code >= 0).all()
        inside = [any(lo <= at <= hi for lo, hi in extents[int(k)]) for at, k in zip(x, side, strict=True)]
        assert all(inside)


def test_a_side_that_comes_down_slides_by_the_closed_form():
    """A jog, from the laws alone: landing by bisection, impact by angular momentum, fall by energy, friction."""
    scene = feeder(TEN[9])
    kappa, h, mu = scene.kappa, scene.surface_height, 0.6
    a, d = float(scene.sides.a[0]), float(scene.sides.d[0])
    rho2 = scene.radius_of_gyration**2
    with_slip = with_effects(scene, ("slip",))
    box = parameter_box(with_effects(scene, ("landing", "roll")))
    lo, hi = (each._replace(effects=()) for each in (box.lo, box.hi))
    places = np.linspace(a + 0.1, 20.0, 400)
    state, moved = deviations(lo, hi, Slip(mu), 0, places, places)
    jogs = ls.maps.images(scene.map, places, 0).side == 0
    (x, bounds), *_ = ((p, m) for p, s, m, j in zip(places, state, moved, jogs, strict=True) if s == 1 and j)

    def height(phi):
        return d + phi * (x - 0.5 * kappa * phi) - a * math.sin(phi) - d * math.cos(phi)

    low, high = 1e-6, 2.0
    while height(high) > 0.0:
        high += 0.5
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if height(middle) > 0.0 else (low, middle)
    right, above = a * math.cos(low) - d * math.sin(low), a * math.sin(low) + d * math.cos(low)
    inertia = rho2 + a * a + d * d
    omega = (rho2 + right * (x - kappa * low) + above * (h + d)) / inertia
    rate2 = omega**2 + 2.0 * kappa * (above - d) / inertia
    slide = max(d - mu * a, 0.0) ** 2 * rate2 / (2.0 * mu * kappa)
    by = ls.maps.images(with_slip.map, [x], 0).x[0] - ls.maps.images(scene.map, [x], 0).x[0]
    assert slide > 1e-4
    assert by == pytest.approx(slide, rel=1e-8)
    assert bounds[0] - 1e-15 <= slide <= bounds[1] + 1e-15
    assert bounds[1] - bounds[0] < 1e-9


def test_a_covered_scene_says_so():
    """The seventh feeder's limit set ends on side 3 alone: friction moves its landings by less than that survives."""
    goal = {"oriented_beyond": {"x": "25.252 in", "side": 3}}
    compared = ls.discrepancy({**feeder(TEN[6]).as_dict(), "goal": goal}, EFFECTS, throws=20_000)
    best, covered = compared.row("limit-set"), compared.covered["limit-set"]
    assert best.how == "proved"
    assert 0.05 < best.most <= covered < 0.07
    assert 0.27 < compared.margin.proved < 0.28
    assert compared.enough
    moves = (
        "friction, rolling and another corner that lands first move a landing by up to 0.06069 in (proved)"
    )
    assert compared.sentence.startswith(f"{moves}; the goal survives 0.27")
    assert compared.left_out["pivot"] == "called for, but not asked for"
    starts = compared.row("starts")
    assert starts.how == "proved"
    assert starts.most <= compared.covered["starts"] < compared.margin.proved
    assert 0.9 < starts.share < 1.0  # those next to the joint are lost with any noise
    assert "starts are not covered" not in compared.sentence
    by_samples = replace(compared, rows=tuple(each for each in compared.rows if each.throws))
    assert [any("samples" in line for line in alarms_of(each)) for each in (compared, by_samples)] == [
        False,
        True,
    ]
    moved_more = replace(compared, covered={"limit-set": 1.01 * compared.margin.proved})
    assert moved_more.enough is False
    assert "limitsets design --robust" in moved_more.advice[-1]


@pytest.mark.parametrize(("thin", "cells"), [(False, [0, 1]), (True, [0])])
def test_almost_every_start_is_not_enough(thin, cells):
    """A set of length zero for each sequence of deviations is none for deviations that depend on the start."""
    basin = SimpleNamespace(rank=np.array([0, 1, -1]), thin=np.array([False, thin, False]))
    cover = SimpleNamespace(grid=ls.grid([(0.0, 3.0)], cells=3))
    assert _ranked(SimpleNamespace(cover=cover, basin=basin)).numbers().tolist() == cells


def test_what_is_proved_of_a_part_of_the_cells_gives_way_to_samples():
    """A proof that leaves some cells open says nothing of the place."""
    ends = {"lo": -0.1, "hi": 0.2, "changed": 0.0, "share": 1.0}
    proved = Moved("starts", ("slip",), "proved", unknown=0.0, **ends)
    partly = Moved("starts", ("slip",), "proved", unknown=0.1, **ends)
    sampled = Moved("starts", ("slip",), "sampled", unknown=0.0, throws=10, **ends)
    assert best_of([proved, sampled]) is proved
    assert best_of([partly, sampled]) is sampled
    assert best_of([sampled]).most == 0.2


@pytest.mark.parametrize(
    "row",
    [pytest.param(row, marks=[pytest.mark.repeats] * (number % 8 > 0)) for number, row in enumerate(TEN)],
)
def test_with_restitution_the_sentence_says_what_simulations_do(row):
    """Sampled, not covered if a side changes; the share that arrives is that of other starts, within chance."""
    scene = feeder(row, restitution=0.3, bounce_threshold="0.01 in")
    text = {**scene.as_dict(), "goal": {"stays_on_arm": True}}
    compared = ls.discrepancy(text, ("slip", "bounce", "roll"), throws=5000)
    best = compared.row("limit-set")
    assert best.how == "sampled"
    assert f"(sampled, {best.throws:.0e} throws)".replace("e+0", "e") in compared.sentence
    full = with_effects(scene, ("slip", "bounce", "roll"))
    generator, stays, starts = np.random.default_rng(99), 0, 1000
    lo, hi = full.domain.lo[:, 0], full.domain.hi[:, 0]
    side = generator.choice(lo.size, starts, p=(hi - lo) / (hi - lo).sum())
    x = lo[side] + (hi - lo)[side] * generator.random(starts)
    stays = int((ls.maps.advance(full.map, x, side, 500)[2] >= 0).sum())
    share = compared.arrive["effects"].share
    assert abs(stays / starts - share) <= 4.0 * math.sqrt(max(share * (1 - share), 1e-3) / starts)
    if best.changed or best.unknown:
        assert "not covered" in compared.sentence
        assert "limit-set" not in compared.covered


def test_what_is_called_for_is_asked_by_itself():
    """Facts that are missing are named; a scene without facts is compared with what needs none."""
    compared = ls.discrepancy(plain("paper-designed"), throws=2000)
    assert compared.effects == ("landing",)
    assert compared.left_out["slip"] == "world.friction is missing: cannot tell"
    assert compared.left_out["pivot"] == "called for, but world.friction missing"
    assert compared.row("limit-set").most == 0.0
    assert compared.enough


def test_the_command_and_its_page(capfd, tmp_path):
    """paper-designed is proved to bring every start to its goal; a throw a second then feeds as many parts."""
    scene = plain("paper-designed", friction=0.5, throw_rate="1 Hz")
    file, out = tmp_path / "mine.toml", tmp_path / "out"
    file.write_text(ls.dump(scene))
    code, said, _ = run(capfd, f"discrepancy {file} --effect slip --throws 1000 --json -o {out}")
    answer = json.loads(said)
    assert code == 1
    assert set(answer) == documented("discrepancy")
    assert answer["arrive"]["minimal"]["share"] == 1.0
    page = (out / "report.md").read_text()
    assert page.startswith("# paper-designed: will it work on my machine?\n\n**Calls for attention:**")
    assert f"| parts per minute | {60.0 / answer['arrive']['minimal']['throws']:.3g} |" in page
    assert answer["sentence"][1:] in page
    assert (out / "discrepancy.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("scene", "effects", "kind", "words"),
    [
        ("paper-designed-small-angle", ("landing",), SceneError, "exact"),
        ("paper-designed", ("spread",), AnswerError, "spread"),
        ("paper-designed", ("slip",), SceneError, "friction"),
        ("paper-designed", ("fly",), AnswerError, "fly"),
    ],
)
def test_effects_that_cannot_be_are_refused(scene, effects, kind, words):
    """In one line that names them."""
    with pytest.raises(kind, match=words):
        ls.discrepancy(plain(scene), effects)


def test_a_part_that_tips_over_is_refused():
    """The minimal model has no throw from such a side."""
    text = ls.load("paper-designed").as_dict()
    text["part"]["mass"]["center"] = {"side": 2, "along": "6.9 in", "above": "0.2 in"}
    with pytest.raises((AnswerError, SceneError)):
        ls.discrepancy({**text, "effects": {"landing": True, "roll": True}})


def test_cells_of_which_nothing_is_proved_are_counted():
    """Friction that holds no landing proves nothing anywhere, and says so."""
    comparison = _Comparison(plain("paper-designed", friction=0.01), ("slip",), 1000, 0)
    grid = comparison.attraction(0.0).cover.grid
    proved, sampled = comparison.on("starts", ~CellSet.of(grid, []))
    assert proved.unknown > 0.9
    assert not proved.same_sides
    assert sampled.how == "sampled"
