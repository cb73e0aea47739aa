"""Throws against 50 digits, and the paper's scenes."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from mpmath import mpf

from limitsets import maps
from limitsets.base.errors import MapError
from limitsets.feeder.thrower import Throw, fly, throw_map, trace
from limitsets.systems.maps import drivers
from tests.thrower import reference
from tests.thrower.reference import Facts

# ----------------------------------------------------------------
# One throw, every model of flight and criterion of the flip, against 50 digits on random parts.


FLIGHTS = ("exact", "small-angle", "small-angle-2")
FLIPS = ("signed", "energy")
MODELS = [(flight, flip) for flight in FLIGHTS for flip in FLIPS]
KAPPA = ("below d", "between", "above ell")
# Closer to the edge between two outcomes than this (relative), rounding decides.
TIE = 1e-9


@cache
def random_scenes(flight: str, flip: str) -> list[tuple[str, Facts, int, float]]:
    """Random parts and starts, as many for each of the three kinds of kappa."""
    rng = np.random.default_rng(7)
    found = []
    for k in range(90):
        n = int(rng.integers(3, 6))
        a, d = rng.uniform(0.2, 5.0, n), rng.uniform(0.1, 4.0, n)
        side = int(rng.integers(n))
        ell = math.hypot(a[side], d[side])
        kind = KAPPA[k % 3]
        if kind == "below d":
            kappa = float(rng.uniform(0.3, 0.98) * d[side])
        elif kind == "between":
            kappa = float(rng.uniform(d[side], ell))
        else:
            kappa = float(ell * math.exp(rng.uniform(0.01, 3.0)))
        # From 1e-6 to beyond the last start that lands within a full turn.
        x = float(a[side] + 10.0 ** rng.uniform(-6.0, math.log10(1.1 * math.pi * kappa)))
        length, corner = a + rng.uniform(0.2, 5.0, n), np.full(n, 2.0 * math.pi / n)
        numbers = {"a": a, "d": d, "length": length, "corner": corner, "kappa": kappa}
        numbers |= {"flight": flight, "flip": flip}
        numbers["radius_of_gyration"] = float(rng.uniform(0.3, 2.0))
        numbers["surface_height"] = float(rng.uniform(-2.0, 1.0))
        numbers["arm_length"] = float(rng.uniform(6.0, 30.0))
        found.append((kind, Facts(numbers), side, x))
    return found


@cache
def answers(flight: str, flip: str) -> list[reference.Throw | None]:
    return [reference.throw(facts, side, x) for _, facts, side, x in random_scenes(flight, flip)]


def cases(model: tuple[str, str]) -> list[tuple[str, Facts, Throw, int, float, reference.Throw | None]]:
    scenes = random_scenes(*model)
    return [
        (kind, facts, throw_map(**facts.numbers), side, x, answer)
        for (kind, facts, side, x), answer in zip(scenes, answers(*model), strict=True)
    ]


def tied(facts: Facts, answer: reference.Throw) -> bool:
    scale = answer.kinetic + abs(answer.potential)
    a = facts.a[answer.side]
    edges = (answer.x - a, answer.x - facts.arm_length)
    return bool(abs(answer.margin) < TIE * scale) or any(abs(edge) < TIE for edge in edges)


def test_the_sample_holds_every_kind() -> None:
    exact = cases(("exact", "signed"))
    codes = {answer.code for *_, answer in exact if answer is not None}
    assert codes == {maps.JOG, maps.FLIP, maps.INWARD, maps.OUTWARD}
    assert any(answer is None for *_, answer in exact)
    several = [reference.roots_in_turn(facts, side, x) for _, facts, _, side, x, _ in exact]
    assert sum(count >= 2 for count in several) >= 10
    for model in MODELS:
        ties = sum(answer is not None and tied(facts, answer) for _, facts, _, _, _, answer in cases(model))
        assert ties <= 1


@pytest.mark.parametrize("model", MODELS, ids="-".join)
def test_outcome(model: tuple[str, str]) -> None:
    for kind, facts, params, side, x, answer in cases(model):
        found = maps.images(params, [x], side)
        what = (kind, side, x)
        if answer is None:
            assert (found.code[0], found.side[0], found.x[0]) == (maps.OUTSIDE_MODEL, side, x), what
        elif not tied(facts, answer):
            assert (found.code[0], found.side[0]) == (answer.code, answer.side), what
            assert found.x[0] == pytest.approx(float(answer.x), rel=1e-12, abs=1e-12), what


@pytest.mark.parametrize("flight", FLIGHTS)
def test_flight_impact_and_displacement(flight: str) -> None:
    for kind, facts, params, side, x, answer in cases((flight, "signed")):
        if answer is None:
            continue
        found, path, what = fly(params, x, side), trace(params, x, side, 1), (kind, side, x)
        kappa, omega = float(facts.kappa), float(answer.omega)
        assert found.phi == pytest.approx(float(answer.phi), rel=1e-11), what
        assert found.omega == pytest.approx(omega, rel=1e-10, abs=1e-10), what
        assert found.kinetic == pytest.approx(float(answer.kinetic), rel=1e-10, abs=1e-10), what
        barrier = float(-answer.potential if answer.past else answer.potential)
        assert found.barrier == pytest.approx(barrier, rel=1e-10, abs=1e-10 * kappa), what
        if path.stopped != "stalled" and not tied(facts, answer):
            assert path.displacement[0] == pytest.approx(float(answer.displacement), rel=1e-10), what
            assert path.turned[0] == (answer.side - side) % len(facts.a)


def slope(params: Throw, side: int, branch: int, x: float) -> float:
    return float(maps.along(params, [x], side, [branch])[2][0])


@pytest.mark.parametrize("flight", FLIGHTS)
@pytest.mark.parametrize("branch", [maps.JOG, maps.FLIP])
def test_forced_branches_and_their_slopes(flight: str, branch: int) -> None:
    for kind, facts, params, side, x, answer in cases((flight, "signed"))[::2]:
        if answer is None:
            continue
        what = (kind, side, x)
        after, side_after = maps.images_on(params, [x], side, branch)
        place = reference.land(facts, side, mpf(x), answer.phi, branch == maps.FLIP)
        assert after[0] == pytest.approx(float(place), rel=1e-12, abs=1e-12), what
        assert side_after[0] == ((side + 1) % len(facts.a) if branch == maps.FLIP else side)
        expected = float(reference.slope(facts, side, x, answer.phi, branch == maps.FLIP))
        assert slope(params, side, branch, x) == pytest.approx(expected, rel=1e-8, abs=1e-8), what


# ---------------------------------------------------------------- the ends of the model


@pytest.mark.parametrize("flight", FLIGHTS)
@pytest.mark.parametrize("reach", [1e-5, 1e-13, 0.0])
def test_relative_accuracy_close_to_the_vertex(flight: str, reach: float) -> None:
    facts = reference.paper("designed", flight=flight)
    params = throw_map(**facts.numbers)
    for side in range(3):
        a = facts.numbers["a"][side]
        x = a + reach if reach else math.nextafter(a, math.inf)
        answer = reference.throw(facts, side, x)
        assert answer is not None
        assert answer.code == maps.JOG
        assert fly(params, x, side).phi == pytest.approx(float(answer.phi), rel=1e-14)
        found = drivers._displacement(params, x, side)
        assert found == pytest.approx(float(answer.displacement), rel=1e-13)
        assert found > 0.0


@pytest.mark.parametrize("model", MODELS, ids="-".join)
@pytest.mark.parametrize("kappa", [0.3, 2.5, 25.0])
def test_starts_that_are_none(model: tuple[str, str], kappa: float) -> None:
    params = throw_map(**reference.paper("designed", flight=model[0], flip=model[1], kappa=kappa).numbers)
    for side in range(3):
        starts = [params.a[side], params.a[side] - 1.0, 0.0, -5.0, -math.inf, math.inf]
        assert (maps.images(params, starts, side).code == maps.OUTSIDE_MODEL).all()
        assert maps.images(params, [math.nan], side).code == maps.UNDEFINED


def test_the_second_pass() -> None:
    for name in ("initial", "designed"):
        params = throw_map(**reference.paper(name).numbers)
        for side in range(3):
            reach = np.geomspace(1e-12, params.arm_length - params.a[side], 20_000)
            assert maps.images(params, params.a[side] + reach, side).second_pass == 0.0
    several = throw_map(**reference.paper("designed", kappa=1.0).numbers)
    assert maps.images(several, [5.0, 6.0], 0).second_pass == 1.0
    small = throw_map(**reference.paper("designed-small", kappa=1.0).numbers)
    assert maps.images(small, [5.0, 6.0], 0).second_pass == 0.0


def test_wrong_parameters_are_refused() -> None:
    numbers: dict[str, Any] = reference.paper("designed").numbers
    for change, allowed in (
        ({"flight": "medium"}, "exact"),
        ({"flip": "sometimes"}, "signed"),
        ({"kappa": 0.0}, "> 0"),
        ({"arm_length": -1.0}, "> 0"),
        ({"a": [1.0, 2.0]}, "equal length"),
        ({"d": [1.0, math.nan, 1.0]}, "finite"),
    ):
        with pytest.raises(MapError, match=allowed):
            throw_map(**{**numbers, **change})
    with pytest.raises(MapError, match="0 to 2"):
        trace(throw_map(**numbers), 8.0, 3)


# ----------------------------------------------------------------
# Numbers of the paper's four scenes that two other programs agree on; more of them stand in tests/test_paper.py.


def scene(name: str, **changes: object) -> Throw:
    return throw_map(**reference.paper(name, **changes).numbers)


@pytest.mark.parametrize(("h", "expected"), [(0.1, [3.16, 3.19, 4.81]), (0.2, [4.64, 4.55, 5.39])])
def test_a_raised_surface_draws_close_starts_inward(h: float, expected: list[float]) -> None:
    params = scene("designed", surface_height=h)
    for side, x in enumerate(expected):  # rounded down: every start below collapses
        assert drivers._displacement(params, x - 0.001, side) < 0.0
        assert drivers._displacement(params, x + 0.011, side) > 0.0


@pytest.mark.parametrize(
    ("name", "side", "edge"), [("designed", 0, 20.1517), ("designed", 1, 26.4235), ("initial", 0, 26.9141)]
)
def test_where_another_vertex_lands_first(name: str, side: int, edge: float) -> None:
    params = scene(name)
    assert not trace(params, edge - 1e-4, side).other_vertex_first[0]
    assert trace(params, edge + 1e-4, side).other_vertex_first[0]
    assert not trace(scene("designed"), 27.9999, 2).other_vertex_first[0]
