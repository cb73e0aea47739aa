"""The studies' pages and scripts, and the notebooks."""

import asyncio
import importlib.util
import json
import sys
import warnings
from pathlib import Path

import nbformat
import numpy as np
import pytest

from tests.closed_forms import ladder

# ----------------------------------------------------------------
# Every study runs, and says what it is expected to say.


STUDIES = Path(__file__).resolve().parents[2] / "studies"


def load_study(name, file="study"):
    spec = importlib.util.spec_from_file_location(f"{file}_{name}", STUDIES / name / f"{file}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def expected_of(name):
    return json.loads((STUDIES / name / "expected.json").read_text(encoding="utf-8"))


def readme_of(name):
    return (STUDIES / name / "README.md").read_text(encoding="utf-8")


def of_study(name, tmp_path_factory, file="study", **options):
    """A study, its numbers and the folder of its figures."""
    study = load_study(name, file)
    out = tmp_path_factory.mktemp(name)
    return study, study.main(out=out, **options), out


@pytest.mark.parametrize("folder", sorted(path.name for path in STUDIES.iterdir() if path.is_dir()))
def test_a_study_has_its_parts(folder):
    names = {path.name for path in (STUDIES / folder).iterdir()}
    assert {"study.py", "README.md", "expected.json"} <= names
    figures = [name for name in names if name.endswith(".png")]
    text = (STUDIES / folder / "README.md").read_text(encoding="utf-8")
    assert "**Question.**" in text
    assert "**Answer.**" in text
    assert figures
    assert all(f"({name})" in text for name in figures)


@pytest.fixture(scope="module")
def four_scenes(tmp_path_factory):
    return of_study("01_four_scenes", tmp_path_factory, seed=3)


def test_four_scenes_as_expected(four_scenes):
    _, numbers, out = four_scenes
    expected = expected_of("01_four_scenes")
    assert set(numbers) == set(expected)
    assert (out / "limit-sets.png").stat().st_size > 20_000
    for name, wanted in expected.items():
        found = numbers[name]
        assert found["attractors"] == 1
        assert found["share_of_starts"] == pytest.approx(1.0, abs=1e-9)
        assert set(found["extents"]) == set(wanted["extents"])
        for side, parts in wanted["extents"].items():
            assert found["extents"][side] == [pytest.approx(pair, abs=1e-9) for pair in parts]
        assert found["jogs_possible"] == wanted["jogs_possible"]
        for key in ("flips_per_throw", "lyapunov", "ln_small_angle_slope"):
            value, tolerance = wanted[key]
            assert found[key] == pytest.approx(value, abs=tolerance), (name, key)


def test_four_scenes_two_ways(four_scenes):
    _, numbers, _ = four_scenes
    for name, found in numbers.items():
        assert found["jogs_counted"] == found["jogs_possible"], name
        for side, (lo, hi) in found["seen_on_orbit"].items():
            first, last = found["extents"][side][0][0], found["extents"][side][-1][1]
            assert first - 1e-9 <= lo < first + 0.01, (name, side)
            assert last - 0.01 < hi <= last + 1e-9, (name, side)
        if name.endswith("small-angle"):
            assert found["lyapunov"] == pytest.approx(found["ln_small_angle_slope"], rel=1e-9)


def test_the_table_in_the_readme_is_what_the_study_prints(four_scenes):
    study, numbers, _ = four_scenes
    text = readme_of("01_four_scenes")
    printed = study.table(numbers).splitlines()
    intervals = [line.split("|")[3:5] for line in printed[2:]]
    shown = [line.split("|")[3:5] for line in text.splitlines() if line.startswith("| ")][1:]
    assert shown == intervals


@pytest.fixture(scope="module")
def physics_engine(tmp_path_factory):
    pytest.importorskip("pymunk")
    return of_study("02_physics_engine", tmp_path_factory, seed=3, throws=60)


@pytest.mark.sweep
def test_the_engine_agrees_with_the_map(physics_engine):
    study, numbers, out = physics_engine
    expected = expected_of("02_physics_engine")
    assert (out / "engine.png").stat().st_size > 20_000
    for name in study.SCENES:
        found, wanted = numbers[name], expected[name]
        assert found["throws"] == 60
        assert found["sides_that_differ"] == []
        # the joint's drift, (omega^2 ell / 2) step^2: ell is at most 4.4 in, and these parts turn at less than 9 w
        assert found["error"]["worst"] < 0.5 * 9.0**2 * 4.4 * study.STEP**2
        assert found["critical_points"] == pytest.approx(wanted["critical_points"], abs=5e-6)
        assert found["other_vertex"]["from"] == pytest.approx(wanted["other_vertex_from"], abs=1e-4)
    errors = numbers["convergence"]
    for kind in ("place", "critical_point"):
        assert study.order(errors["step"], errors[kind]) == pytest.approx(expected["order"], abs=0.15)


@pytest.mark.sweep
def test_unilateral_contact_in_the_engine(physics_engine):
    study, numbers, _ = physics_engine
    expected = expected_of("02_physics_engine")
    rests = numbers["unilateral"]
    assert rests["hinge"] == pytest.approx(expected["hinge"], abs=6e-4)
    lo, hi = expected["unilateral_without_slip"]
    inside = [lo < rests["by_friction"][mu] < hi for mu in ("0.3", "0.5", "1.0", "2.0", "5.0")]
    assert inside == [False] * 2 + [True] * 3
    text = readme_of("02_physics_engine")
    places = study.table(numbers).split("\n\n", 1)[1]  # what does not depend on the starts drawn
    assert set(places.splitlines()) <= set(text.splitlines())


@pytest.fixture(scope="module")
def effects_in_engine(tmp_path_factory):
    pytest.importorskip("pymunk")
    return of_study("02_physics_engine", tmp_path_factory, "effects", seed=3, throws=60)


@pytest.mark.sweep
def test_the_engine_agrees_with_the_effects(effects_in_engine):
    study, numbers, out = effects_in_engine
    assert (out / "effects.png").stat().st_size > 20_000
    # by the order of each, as above
    most = {"hinge": 0.5 * 9.0**2 * 4.4 * 1e-6, "drive": 5e-3, "contact": 0.04}
    for name, case in study.CASES.items():
        found, kind = numbers[name], name.split(",")[0]
        assert found["throws"] == max(int(60 * case.share), 1)
        assert found["same_law"] + sum(found["aside"].values()) == found["throws"]
        if name.endswith("0.5, bounce"):  # Newton's restitution against Poisson's
            continue
        assert found["sides_that_differ"] == [], name
        assert found["same_side"] == found["same_law"] > 0, name
        assert found["error"]["worst"] < most.get(kind, most["hinge"]), name


@pytest.mark.sweep
def test_the_engine_nears_the_effects_as_its_order_says(effects_in_engine):
    _, numbers, _ = effects_in_engine
    expected = expected_of("02_physics_engine")
    for name, order in expected["effects"]["order"].items():
        assert numbers["convergence"][name]["order"] == pytest.approx(order, abs=0.3), name


@pytest.mark.sweep
def test_throws_are_set_aside_where_the_laws_part(effects_in_engine):
    _, numbers, _ = effects_in_engine
    for name, found in numbers.items():
        if name.startswith("contact, friction 5"):
            assert found["aside"]["solver"] > 10
        if name in ("landing", "landing, roll", "landing, roll, bounce", "drive, landing"):
            assert found["same_law"] == 60


def test_too_few_throws_are_said_to_be_too_few(effects_in_engine, tmp_path):
    """Of one throw a case some are set aside (half of those at friction 5 are), and there are no errors to tell of."""
    study, enough, _ = effects_in_engine
    assert study.missing(enough) == []
    numbers = study.main(seed=0, out=tmp_path, throws=1)
    without = [name for name in study.CASES if numbers[name]["same_side"] == 0]
    assert without
    table, _, gap = study.table(numbers).partition("\n\n")
    rows = dict(zip(study.CASES, table.splitlines()[2:], strict=True))
    for name in study.CASES:
        assert ("| none | none | none |" in rows[name]) == (name in without)
        assert (f"{name}: none of 1 throws" in gap) == (name in without)
        assert (None in numbers[name]["error"].values()) == (name in without)
    for name, found in numbers["convergence"].items():
        assert (found["order"] is None) == (name in without)
    json.dumps(numbers, allow_nan=False)
    assert (tmp_path / "effects.png").stat().st_size > 20_000


@pytest.fixture(scope="module")
def chaos(tmp_path_factory):
    few = {"names": ("paper-designed",), "cells": 4000, "finer": (500, 2000), "between": ()}
    return of_study("15_chaos", tmp_path_factory, noises={0.01: 2000}, **few)


def test_chaos_and_order_as_expected(chaos):
    _, numbers, out = chaos
    expected = expected_of("15_chaos")
    assert all((out / name).stat().st_size > 20_000 for name in ("feeders.png", "order.png"))
    (name,) = numbers["feeders"]
    for word, (lo, hi) in expected["feeders"][name].items():
        least, most = numbers["feeders"][name][word]
        assert least <= hi  # both hold the number
        assert lo <= most
        assert most - least < 2e-3
    assert numbers["widths"][2000] < 0.4 * numbers["widths"][500]
    for noise, (lo, hi) in numbers["order"].items():
        least, most = expected["order"][f"{noise:g}"]
        assert lo <= most
        assert least <= hi < 0.0
        assert lo - 0.004 < numbers["sampled"][noise] < hi + 0.004  # of 1e7 steps, which are correlated


def test_the_tables_of_chaos_are_those_expected():
    expected, text = expected_of("15_chaos"), readme_of("15_chaos")
    digits = {"lyapunov": 7, "flips_per_throw": 5, "entropy": 9}
    for name, row in expected["feeders"].items():
        told = [f"{row[word][0]:.{count}f} to {row[word][1]:.{count}f}" for word, count in digits.items()]
        assert f"| {name} | {' | '.join(told)} |" in text
    for noise, (lo, hi) in expected["order"].items():
        assert f"| {noise} | {lo:.4f} to {hi:.4f} |" in text


# P(x >= 18 in) after 0, 1, ... jogs of paper-designed-small-angle, from 15 to 16 in, each landing within 0.05 in
LADDER = ladder((4.4179581, 1.0 + 2.0 / 48.6228609), (15.0, 16.0), 0.05, 18.0, 7)


def stored_rows(case):
    """What is stored of Storm's bounds, by the number of cells."""
    return {int(cells): row for cells, row in expected_of("16_exchange")[case]["cells"].items()}


def test_the_bounds_of_storm_hold_the_exact_values_and_meet_ours():
    walk = 2.0 - np.cos(0.5) / (1.0 - np.sin(0.5))
    for case, exact in (("walk", walk), ("ladder", LADDER[5]), ("feeder", None)):
        for row in stored_rows(case).values():
            lo, hi = row["storm"]["bounds"]
            least, most = row.get("ours", (lo, hi))
            assert max(lo, least) <= min(hi, most)
            assert exact is None or (lo <= exact <= hi and least <= exact <= most)
            assert row["storm"]["version"] == "2.0.0"
            assert row["storm"]["states"] == row["states"]


def test_exchange_without_storm_is_as_stored(tmp_path):
    study = load_study("16_exchange")
    numbers = study.main(out=tmp_path, walks=(100,), ladders=(300,), feeders=(250,))
    assert numbers["ladder"]["exact"] == pytest.approx(LADDER[5], abs=1e-9)
    assert not list(tmp_path.iterdir())  # no figure without Storm
    for case, one in numbers.items():
        for cells, row in one["cells"].items():
            stored = stored_rows(case)[cells]
            assert (row["states"], row["storm"]) == (stored["states"], None)
            assert row.get("ours") == pytest.approx(stored.get("ours"), abs=1e-6)
    study.figure(expected_of("16_exchange"), tmp_path)
    assert (tmp_path / "widths.png").stat().st_size > 20_000


def test_the_table_of_exchange_is_that_of_the_stored_numbers():
    stored = {name: one for name, one in expected_of("16_exchange").items() if name != "command"}
    assert load_study("16_exchange").table(stored) in readme_of("16_exchange")


# ----------------------------------------------------------------
# Every notebook runs from top to bottom, and shows what is stored in it.


NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))
LONG = {
    "4_margins_and_design.ipynb",
    "5_the_atlas.ipynb",
    "6_your_own_map.ipynb",
}  # the last compiles its maps
TO_RUN = [pytest.param(n, marks=pytest.mark.sweep) if n.name in LONG else n for n in NOTEBOOKS]


def code_of(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def shown(cell):
    """What a cell shows, by kind.  Prints may come in pieces; bars of progress leave empty pages where it is slow."""
    outputs = [each for each in cell.outputs if each.output_type in ("execute_result", "display_data")]
    return [sorted(output.data) for output in outputs if output.data.get("text/html") != ""]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_stored_as_it_ran(path):
    """From top to bottom in a new kernel, without errors or warnings, with pictures that load fast."""
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    code = code_of(notebook)
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    outputs = [output for cell in code for output in cell.outputs]
    assert not any(each.output_type == "error" or each.get("name") == "stderr" for each in outputs)
    assert path.stat().st_size < 150_000


@pytest.mark.sweep
@pytest.mark.parametrize("path", TO_RUN, ids=lambda path: path.name)
def test_runs_and_shows_what_is_stored(path, tmp_path):
    with warnings.catch_warnings():  # of jupyter's own making
        warnings.simplefilter("ignore")
        from nbclient import NotebookClient

        notebook = nbformat.read(path, as_version=4)
        stored = [shown(cell) for cell in code_of(notebook)]
        place = {"metadata": {"path": tmp_path}}
        client = NotebookClient(notebook, timeout=300, kernel_name="python3", resources=place)
        asyncio.run(client.async_execute())
    outputs = [output for cell in code_of(notebook) for output in cell.outputs]
    assert not [output for output in outputs if output.output_type == "error"]
    assert [shown(cell) for cell in code_of(notebook)] == stored
    assert len([kinds for cell in stored for kinds in cell if "image/png" in kinds]) >= 2
