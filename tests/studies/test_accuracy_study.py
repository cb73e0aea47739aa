"""The study of accuracy: errors and exponents, never seconds."""

import importlib
import importlib.util
import json
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls

FOLDER = Path(__file__).resolve().parents[2] / "studies" / "03_accuracy"


@pytest.fixture(scope="module")
def modules():
    """Its files import each other: as from its own folder."""
    sys.path.insert(0, str(FOLDER))
    names = ["points", "throw", "ends", "long_run", "effects", "figures"]
    try:
        loaded = {name: importlib.import_module(f"accuracy_{name}") for name in names}
        spec = importlib.util.spec_from_file_location("study_03_accuracy", FOLDER / "study.py")
        loaded["study"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(loaded["study"])
    finally:
        sys.path.remove(str(FOLDER))
    return loaded


@pytest.fixture(scope="module")
def answer(modules, tmp_path_factory):
    out = tmp_path_factory.mktemp("accuracy")
    return modules["study"].main(seed=5, out=out, quick=True), out


def expected():
    return json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))


@pytest.mark.sweep
def test_reference_has_the_known_ends(answer):
    numbers, _ = answer
    for side, parts in expected()["reference"].items():
        assert numbers["reference"][side] == [pytest.approx(pair, abs=2e-12) for pair in parts]


@pytest.mark.sweep
@pytest.mark.parametrize("what", ["throw", "critical_points"])
def test_errors_of_one_throw(answer, what):
    numbers, _ = answer
    wanted = expected()[what]
    assert set(numbers[what]) == set(wanted)
    for name, (low, high) in wanted.items():
        assert low <= numbers[what][name] <= high, name


@pytest.mark.sweep
def test_newton_doubles_its_digits(answer):
    points = answer[0]["points"]["throw"]
    errors = [point["error"] for point in points if point["method"] == "exact, libm and Newton, compiled"]
    assert errors[1] < errors[0] / 50
    assert errors[2] < 10 * errors[1] ** 2
    assert errors[3] < 1e-13


@pytest.mark.sweep
def test_small_angles_over_random_parts(answer):
    for key, (value, tolerance) in expected()["small_over_exact"].items():
        assert answer[0]["small_over_exact"][key] == pytest.approx(value, abs=tolerance)


@pytest.mark.sweep
def test_exponents_of_the_limit_set(answer):
    found = answer[0]["limit_set"]
    for name, (value, tolerance) in expected()["limit_set"]["exponents"].items():
        assert found["exponents"][name] == pytest.approx(value, abs=tolerance), name
    for name, (low, high) in expected()["limit_set"]["least"].items():
        assert low <= found["least"][name] <= high, name


@pytest.mark.sweep
def test_refining_borders_alone_is_geometric(answer):
    points = answer[0]["points"]["limit set"]
    errors = [point["error"] for point in points if point["method"] == "border cells refined"]
    assert all(after < before / 20 for before, after in pairwise(errors))


@pytest.mark.sweep
def test_exponents_of_long_runs(answer):
    for title, wanted in expected()["long_run"].items():
        for name, (value, tolerance) in wanted.items():
            assert answer[0]["long_run"][title][name] == pytest.approx(value, abs=tolerance), (title, name)
    for key, (value, tolerance) in expected()["lyapunov"].items():
        assert answer[0]["lyapunov"][key] == pytest.approx(value, abs=tolerance)


@pytest.mark.sweep
def test_figures_and_the_table(answer, modules):
    numbers, out = answer
    for name in ("one-throw.png", "limit-set.png", "long-run.png"):
        assert (out / name).stat().st_size > 20_000
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    for line in modules["study"].table(numbers).splitlines()[2:]:
        assert f"| {line.split('|')[1].strip()} |" in text


def test_l1_distance_from_the_arcsine_density(modules):
    # Of the uniform density: 2 (F(b) - F(a) - (b - a)) taken over where 1 / (pi sqrt(x (1 - x))) < 1, the middle.
    low = 0.5 * (1 - np.sqrt(1 - 4 / np.pi**2))
    share = 2 / np.pi * (np.arcsin(np.sqrt(1 - low)) - np.arcsin(np.sqrt(low)))
    found = modules["long_run"].l1_arcsine(np.ones(64))
    assert found == pytest.approx(2 * ((1 - 2 * low) - share), abs=1e-12)


def test_distance_of_unions(modules):
    distance = modules["ends"].distance
    assert distance({0: [(0.0, 4.0)]}, {0: [(0.0, 1.0), (3.0, 4.0)]}) == 1.0
    assert distance({0: [(0.0, 1.0), (3.0, 4.5)]}, {0: [(0.0, 1.0), (3.0, 4.0)]}) == 0.5


def test_costs_of_effects_take_any_table_of_maps(modules, tmp_path):
    scene = ls.load("paper-designed")
    x = np.linspace(9.0, 23.0, 1000)
    higher = scene.map._replace(surface_height=scene.map.surface_height - 0.1)
    maps = {"nothing": scene.map, "h": higher}
    same, moved = modules["effects"].costs(scene.map, maps, {2: x}, least=0.01)
    assert (same.typical, same.worst, same.changed) == (0.0, 0.0, 0.0)
    # A jog moves by -h phi more; phi lies between 0.2 and 2.5 rad there.
    assert 0.02 < moved.typical < moved.worst < 0.25
    figure = modules["effects"].effects_figure({"moved": [moved]})
    figure.savefig(tmp_path / "effects.png")
    assert figure.axes[0].get_xscale() == "log"


@pytest.mark.sweep
def test_what_leaving_effects_out_is_worth(answer):
    """docs/model.md: landing is never called for on these limit sets, roll in 8.3 % of the jogs of initial alone."""
    effects = answer[0]["effects"]
    for scene in ("paper-designed", "paper-initial"):
        assert effects[scene]["landing"]["changed"] == 0.0
        assert effects[scene]["landing"]["worst"] == 0.0
    assert effects["paper-designed"]["roll"]["changed"] == 0.0
    # 8.3 % of the jogs, which are 80 % of the throws; 4000 throws of one orbit
    assert effects["paper-initial"]["roll"]["changed"] == pytest.approx(0.083 * 0.8002, abs=0.006)
