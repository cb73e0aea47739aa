"""Numbers of the studies of accuracy, fits, atlases and sizes."""

from __future__ import annotations

import importlib
import importlib.util
import math
import sys
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

import limitsets as ls
from tests.studies.test_studies import expected_of, load_study, readme_of

# ----------------------------------------------------------------
# The study of accuracy: errors and exponents, never seconds.


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


WANTED = expected_of("03_accuracy")


def near(found, wanted):
    """Whether each number is within its tolerance; tables of them may lie within each other."""
    for name, one in wanted.items():
        if isinstance(one, dict):
            near(found[name], one)
        else:
            assert found[name] == pytest.approx(one[0], abs=one[1]), name


def between(found, wanted):
    assert set(found) == set(wanted)
    for name, (low, high) in wanted.items():
        assert low <= found[name] <= high, name


def errors_of(numbers, kind, method):
    return [point["error"] for point in numbers["points"][kind] if point["method"] == method]


@pytest.mark.sweep
def test_the_reference_and_one_throw(answer):
    numbers, _ = answer
    for side, parts in WANTED["reference"].items():
        assert numbers["reference"][side] == [pytest.approx(pair, abs=2e-12) for pair in parts]
    between(numbers["throw"], WANTED["throw"])
    between(numbers["critical_points"], WANTED["critical_points"])
    near(numbers["small_over_exact"], WANTED["small_over_exact"])
    # Newton's method doubles its digits
    errors = errors_of(numbers, "throw", "exact, libm and Newton, compiled")
    assert errors[1] < errors[0] / 50
    assert errors[2] < 10 * errors[1] ** 2
    assert errors[3] < 1e-13


@pytest.mark.sweep
def test_exponents_of_the_limit_set_and_of_long_runs(answer):
    numbers, _ = answer
    near(numbers["limit_set"]["exponents"], WANTED["limit_set"]["exponents"])
    between(
        {name: numbers["limit_set"]["least"][name] for name in WANTED["limit_set"]["least"]},
        WANTED["limit_set"]["least"],
    )
    near(numbers["long_run"], WANTED["long_run"])
    near(numbers["lyapunov"], WANTED["lyapunov"])
    # refining borders alone is geometric
    errors = errors_of(numbers, "limit set", "border cells refined")
    assert all(after < before / 20 for before, after in pairwise(errors))


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


# ----------------------------------------------------------------
# The study of fits: machines of known truth.


FOLDER_FIT_STUDY = Path(__file__).resolve().parents[2] / "studies" / "10_fit"
EXPECTED = expected_of("10_fit")


@pytest.fixture(scope="module")
def study():
    return load_study("10_fit")


@pytest.mark.sweep  # fits of many machines
def test_intervals_hold_and_are_as_wide_as_claimed(study):
    found = study.many(6, seed=3, flipped=0.05)
    for name in study.NAMES[:4]:
        assert found[name]["held"] >= binom.ppf(1e-4, found[name]["told"], 0.95)
        # of six machines' median half width against that of two hundred
        assert found[name]["half"] == pytest.approx(EXPECTED["half"][name], rel=0.25)


@pytest.mark.sweep  # fits of many machines
def test_the_table_of_the_page_is_that_of_the_study(study):
    page = (FOLDER_FIT_STUDY / "README.md").read_text(encoding="utf-8")
    for line in study.table(EXPECTED["numbers"]).splitlines():
        assert line in page


@pytest.mark.sweep
def test_the_figure_and_the_bootstrap(study, tmp_path):
    numbers = study.one(0, tmp_path, 2)
    assert (tmp_path / "residuals.png").stat().st_size > 20_000
    assert numbers["bootstrap"]["films"] == 2
    for each in numbers["quantities"].values():
        assert each["lo"] <= each["hi"]
    assert numbers["enough"] == EXPECTED["numbers"]["one"]["enough"]
    assert numbers["misread"] == EXPECTED["numbers"]["one"]["misread"]


# ----------------------------------------------------------------
# The study of the atlas, smaller: the same classes, closed forms of the textbook maps, and what the README says.


@pytest.fixture(scope="module")
def recorded():
    return expected_of("08_atlas")


@pytest.fixture(scope="module")
def study_atlas_study():
    return load_study("08_atlas")


def test_feeders_of_a_coarser_grid_have_the_same_classes(study_atlas_study, recorded, tmp_path):
    found = study_atlas_study.feeders(48, tmp_path)
    assert (tmp_path / "feeders.png").stat().st_size > 20_000
    wanted = {each["class"]: each["share"] for each in recorded["feeders"]["classes"]}
    shares = {each["class"]: each["share"] for each in found["classes"]}
    assert set(shares) - {"undecided"} == set(wanted) - {"undecided"}
    for name, share in shares.items():
        # a boundary crosses at most some hundred of the 2304 pixels
        assert share == pytest.approx(wanted[name], abs=0.02)
    for words, share in found["starts"].items():
        assert share == pytest.approx(recorded["feeders"]["starts"][words], abs=0.02)


def test_a_tenth_of_the_evaluations_gives_the_same_picture(recorded):
    refined = recorded["feeders"]["refined"]["8"]
    assert refined["computed"] < 0.1
    assert refined["differ"] == 0.0


def test_windows_of_the_logistic_map_begin_where_theory_says(recorded):
    windows, step = recorded["logistic"]["windows"], recorded["logistic"]["step"]
    # The point nearest a bifurcation may be undecided; Myrberg 1958, Metropolis, Stein and Stein 1973
    ends = {"1": (None, 3.0), "2": (3.0, 1 + math.sqrt(6)), "4": (1 + math.sqrt(6), 3.5440903596)}
    ends["3"] = (1 + math.sqrt(8), 3.8414990075)
    for period, (first, last) in ends.items():
        if first is not None:
            assert first <= windows[period][0] < first + 2 * step
        assert last - 2 * step < windows[period][1] <= last


@pytest.mark.sweep
def test_tongues_of_the_circle_map(study_atlas_study, recorded, tmp_path):
    assert recorded["circle"]["main tongue differs"] == 0
    assert set(range(1, 20)) <= set(recorded["circle"]["periods"])
    refined = [recorded["circle"]["refined"][step] for step in ("4", "8", "16")]
    assert [each["differ"] for each in refined] == sorted(each["differ"] for each in refined)
    computed = [each["computed"] for each in refined]
    assert computed == sorted(computed, reverse=True)
    found = study_atlas_study.circle(40, tmp_path)
    assert found["main tongue differs"] == 0


def test_a_row_of_a_class_is_as_wide_as_its_pixels_without_a_gap(study_atlas_study):
    found = study_atlas_study.widths(np.array([[1, 1, 2, 1], [3, 3, 3, 3]]))
    assert found.tolist() == [[2, 2, 1, 1], [4, 4, 4, 4]]


def test_the_readme_says_what_was_found(recorded):
    text = " ".join(readme_of("08_atlas").split())
    starts = recorded["feeders"]["starts"]
    for share in (*starts.values(), recorded["feeders"]["refined"]["8"]["computed"]):
        assert f"{100 * share:.1f} %" in text
    for step in ("4", "8", "16"):
        each = recorded["circle"]["refined"][step]
        shares = f"{100 * each['computed']:.1f} % | {100 * each['differ']:.2f} %"
        assert f"| {step} | {shares} | {each['widest missed']} |" in text
    assert f"({100 * recorded['logistic']['undecided']:.1f} % of all)" in text
    assert f"steps of {recorded['logistic']['step']:.4f}" in text


# ----------------------------------------------------------------
# The sizes of Section IV follow from the triangle, as their file says.


SIZES = tomllib.loads((Path(__file__).parents[2] / "studies" / "sizes.toml").read_text())


def inches(text):
    value, unit = text.split()
    assert unit == "in"
    return float(value)


A, B, C = (inches(text) for text in SIZES["triangle"]["sides"])  # sides 0, 1, 2
AT_LEFT = math.degrees(math.acos((A * A + C * C - B * B) / (2 * A * C)))  # at P1, by the law of cosines


def test_the_triangle_is_the_one_of_the_scenes():
    import limitsets as ls

    assert ls.load("paper-designed").sides.length == pytest.approx((A, B, C))


def test_the_ramp_and_the_wall_hold_the_triangle():
    cavity = SIZES["cavity"]
    angle = float(cavity["angle"].removesuffix(" deg"))
    width, depth = inches(cavity["width"]), inches(cavity["depth"])
    assert angle == pytest.approx(AT_LEFT, abs=5e-3)
    assert width == pytest.approx(1.6 * A + 0.1, abs=1e-9)
    assert depth == pytest.approx(width * math.tan(math.radians(angle)), abs=5e-5)
    # with side 2 on the ramp and P0 at the wall, P2 lies left of the wall: the corner at P0 is below a right angle
    at_top = math.degrees(math.acos((A * A + B * B - C * C) / (2 * A * B)))
    assert 89.0 < at_top < 90.0


def test_the_quadrilateral_fills_what_is_left_of_the_mouth():
    corners = [tuple(map(inches, corner)) for corner in SIZES["quadrilateral"]["vertices"]]
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = corners
    assert (x1 - x0, y0, y1) == (A, 0.0, 0.0)
    assert x2 == x1
    assert y2 == y3
    assert x2 - x3 == pytest.approx(1.6 * A, abs=1e-9)
    assert math.degrees(math.atan2(y3, -x3)) == pytest.approx(AT_LEFT, abs=0.05)
    area = 0.5 * sum(a * d - b * c for (a, b), (c, d) in zip(corners, corners[1:] + corners[:1], strict=True))
    assert area > 0.0  # counterclockwise


def test_the_tray_follows_from_side_2():
    tray = SIZES["tray"]
    height = A * math.sin(math.radians(AT_LEFT))
    assert inches(tray["depression_width"]) == pytest.approx(1.04 * C, abs=1e-9)
    assert inches(tray["depression_depth"]) == pytest.approx(0.5 * height, abs=5e-3)
    assert inches(tray["pitch"]) == pytest.approx(2 * inches(tray["depression_width"]), abs=1e-9)
