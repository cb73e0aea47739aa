"""A part with a side on which it cannot rest: what loads, what is refused and how, and where its states lie."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import GridError, MapError, SceneError, TipsError
from limitsets.feeder.scene import load_to_analyse
from limitsets.feeder.thrower import trace

BOTH = {"landing": True, "roll": True}
CHAMFER = 3


def chamfered(**tables: Any) -> dict[str, Any]:
    """A square plate of 4 cm with a corner cut off, on which it tips over the right end."""
    corners = ((0, 0), (4, 0), (4, 3.6), (3.0, 4), (0, 4))
    return {
        "name": "chamfered",
        "part": {
            "vertices": [[f"{x} cm", f"{y} cm"] for x, y in corners],
            "mass": {"plate_density": "23.55 kg/m^2"},
        },
        "arm": {"surface_height": "-3 mm", "length": "40 cm"},
        "throw": {"kappa": "20 cm"},
    } | tables


def test_the_error_names_the_lines_to_add() -> None:
    with pytest.raises(TipsError) as caught:
        ls.load(chamfered())
    assert "the part cannot rest on side 3: it tips over the right end by 0.197 cm" in str(caught.value)
    assert "add landing = true and roll = true to [effects]" in str(caught.value)
    assert caught.value.key == "part.mass"


@pytest.mark.parametrize("effects", [{"roll": True}, {"landing": True}, {"landing": True, "roll": False}])
def test_one_of_the_lines_is_not_enough(effects: dict[str, bool]) -> None:
    with pytest.raises(TipsError):
        ls.load(chamfered(effects=effects))


def test_with_the_lines_it_loads_and_has_no_states_on_the_chamfer() -> None:
    scene = ls.load(chamfered(effects=BOTH))
    assert scene.sides.rests.tolist() == [True, True, True, False, True]
    assert scene.domain.inhabited.tolist() == scene.sides.rests.tolist()
    cells = ls.grid(scene.domain, cells=100)
    assert cells.shape[:, 0].tolist() == [100, 100, 100, 0, 100]
    assert (cells.index([1.0, 20.0, scene.arm_length], CHAMFER) == -1).all()
    assert (cells.index([20.0, scene.arm_length], 0) >= 0).all()
    assert cells.side_of([299, 300]).tolist() == [2, 4]
    assert cells.refine(3).shape[:, 0].tolist() == [300, 300, 300, 0, 300]
    assert ls.load(scene.as_dict()) == scene


@pytest.mark.parametrize(
    ("tables", "key", "words"),
    [
        ({"model": {"flip": "energy"}}, "model.flip", "signed"),
        (
            {"effects": BOTH | {"drive": True}, "world": {"stroke": "5 deg"}},
            "effects.drive",
            "cannot rest on side 3",
        ),
        ({"goal": {"oriented_beyond": {"x": "10 cm", "side": 3}}}, "goal.oriented_beyond.side", "0, 1, 2, 4"),
        ({"goal": {"flip_order": [0, 3]}}, "goal.flip_order[1]", "cannot rest on it"),
        (
            {"cavity": {"position": "39 cm", "width": "9 cm", "depth": "2 cm", "angle": "45 deg"}},
            "cavity",
            "rests on each of its sides",
        ),
        (
            {"feedback": {"sensor": {"side": 0}, "throws": [{"name": "one", "kappa": "20 cm"}]}},
            "feedback",
            "rests on each of its sides",
        ),
    ],
)
def test_what_knows_nothing_of_a_chamfer_is_refused(tables: dict[str, Any], key: str, words: str) -> None:
    with pytest.raises(SceneError, match=words) as caught:
        ls.load(chamfered(**{"effects": BOTH, **tables}))
    assert caught.value.key == key


def test_only_what_analyse_reads_switches_the_effects_on() -> None:
    scene, switched = load_to_analyse(chamfered())
    assert switched == ("landing", "roll")
    assert scene.as_dict()["effects"] == BOTH
    assert load_to_analyse(chamfered(effects={"roll": True}))[1] == ("landing",)
    assert load_to_analyse(chamfered(effects=BOTH))[1] == ()
    assert load_to_analyse("paper-designed") == (ls.load("paper-designed"), ())
    with pytest.raises(SceneError, match='flight = "exact"'):
        load_to_analyse(chamfered(model={"flight": "small-angle"}))


def test_no_throw_begins_on_a_chamfer() -> None:
    thrown = ls.load(chamfered(effects=BOTH)).map
    with pytest.raises(MapError, match="0, 1, 2, 4; it tips over on side 3"):
        trace(thrown, 20.0, CHAMFER)
    assert trace(thrown, 20.0, 0).code[0] >= 0


def test_a_domain_has_states_somewhere_and_no_box_that_is_empty_in_part() -> None:
    from limitsets.systems.cells import Domain

    assert Domain([[0.0], [1.0]], [[1.0], [1.0]]).inhabited.tolist() == [True, False]
    for lo, hi in (([[1.0]], [[1.0]]), ([[0.0, 1.0]], [[1.0, 1.0]]), ([[2.0], [0.0]], [[1.0], [1.0]])):
        with pytest.raises(GridError, match="lo < hi"):
            Domain(np.array(lo), np.array(hi))
