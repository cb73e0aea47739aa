"""Random scenes, some of them broken: an answer or an error of the package's own, in bounded time, and no nan."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.systems.maps import codes

UNITS = st.sampled_from(["m", "cm", "mm", "in", "ft"])


def powers(least: float, most: float) -> st.SearchStrategy[float]:
    return st.floats(least, most).map(lambda power: 10.0**power)


def triangle(size: float, draw: Any) -> dict[str, Any]:
    return {"sides": [size * draw(st.floats(0.5, 1.0)) for _ in range(3)]}


def needle(size: float, draw: Any) -> dict[str, Any]:
    top = [size * draw(st.floats(0.3, 0.7)), size * draw(powers(-13.0, -1.0))]
    return {"vertices": [[0.0, 0.0], [size, 0.0], top]}


def polygon(size: float, draw: Any) -> dict[str, Any]:
    count = draw(st.integers(3, 64))
    angle = (
        2.0 * math.pi * (np.arange(count) + np.array(draw(st.floats(0.0, 0.3))) * np.cos(np.arange(count)))
    )
    return {"vertices": [[size * math.cos(t / count), size * math.sin(t / count)] for t in angle]}


@st.composite
def scenes(draw: Any) -> dict[str, Any]:
    """Sizes from 1e-7 to 1e4, gravity and speed over all their range; some parts cannot rest, some are none."""
    unit, size = draw(UNITS), draw(powers(-7.0, 4.0))

    def written(value: Any) -> Any:
        return [written(entry) for entry in value] if isinstance(value, list) else f"{float(value)!r} {unit}"

    shape = draw(st.sampled_from([triangle, needle, polygon]))(size, draw)
    part: dict[str, Any] = {key: written(value) for key, value in shape.items()}
    if draw(st.booleans()):
        part["mass"] = {"plate_density": "1 kg/m^2"}
    else:
        centre = {
            "side": draw(st.integers(0, 3)),
            "along": written(size * draw(st.floats(-0.1, 0.9))),
            "above": written(size * draw(powers(-12.0, -0.3))),
        }
        part["mass"] = {"center": centre, "radius_of_gyration": written(size * draw(powers(-3.0, 1.0)))}
    if draw(st.booleans()):
        throw = {"throw": {"kappa": written(size * draw(powers(-6.0, 12.0) | powers(-0.5, 1.5)))}}
    else:
        speed = f"{draw(powers(-9.0, 9.0))!r} {draw(st.sampled_from(['deg/s', 'rad/s']))}"
        throw = {"throw": {"speed": speed}, "gravity": {"tilt": "30 deg"}}
    height = draw(st.sampled_from([-1.0, 1.0, 0.0])) * size * draw(powers(-6.0, 0.5))
    arm = {"surface_height": written(height), "length": written(size * draw(powers(-0.2, 2.0)))}
    model = {"flip": draw(st.sampled_from(["signed", "energy"]))}
    return {"name": "any", "part": part, "arm": arm, "model": model, **throw}


def check_throws(scene: ls.scene.Scene) -> None:
    for side in range(len(scene.sides)):
        a = float(scene.sides.a[side])
        for share in (1e-15, 1e-6, 0.1, 0.5, 1.0):
            path = ls.orbit(scene.map, a + (scene.arm_length - a) * share, side, 100)
            assert np.isfinite(path.x).all()
            assert (path.code[:-1] >= 0).all()
            assert path.code.size == 100 or path.stopped is not None
            assert ((path.side >= 0) & (path.side < len(scene.sides))).all()


@pytest.mark.sweep
@settings(max_examples=30, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(scenes())
def test_an_answer_or_an_error(table: dict[str, Any]) -> None:
    try:
        scene = ls.load(table)
        found = ls.analyse(scene, cells=16, throws=100)
    except LimitsetsError:
        return
    check_throws(scene)
    shares = [*found.basins.attractors, found.basins.undecided_between, *found.basins.exits.values()]
    assert math.isclose(sum(shares), 1.0, rel_tol=1e-9)
    assert found.basins.labels.min() >= codes.UNDEFINED
    assert found.basins.labels.max() < len(found.attractors)
    for limit, attractor in zip(found.limit_sets, found.attractors, strict=True):
        assert limit.converged or limit.advice
        assert attractor.stopped in (None, "stalled", *found.graph.exits)
    json.dumps(found.to_json(), allow_nan=False)
