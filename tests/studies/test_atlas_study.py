"""The study of the atlas, smaller: the same classes, closed forms of the textbook maps, and what the README says."""

import json
import math

import numpy as np
import pytest

from tests.studies.test_studies import STUDIES, load_study


@pytest.fixture(scope="module")
def recorded():
    return json.loads((STUDIES / "08_atlas" / "expected.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def study():
    return load_study("08_atlas")


def test_feeders_of_a_coarser_grid_have_the_same_classes(study, recorded, tmp_path):
    found = study.feeders(48, tmp_path)
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


def test_tongues_of_the_circle_map(study, recorded, tmp_path):
    assert recorded["circle"]["main tongue differs"] == 0
    assert set(range(1, 20)) <= set(recorded["circle"]["periods"])
    refined = [recorded["circle"]["refined"][step] for step in ("4", "8", "16")]
    assert [each["differ"] for each in refined] == sorted(each["differ"] for each in refined)
    assert [each["computed"] for each in refined] == sorted(
        (each["computed"] for each in refined), reverse=True
    )
    found = study.circle(40, tmp_path)
    assert found["main tongue differs"] == 0


def test_a_row_of_a_class_is_as_wide_as_its_pixels_without_a_gap(study):
    found = study.widths(np.array([[1, 1, 2, 1], [3, 3, 3, 3]]))
    assert found.tolist() == [[2, 2, 1, 1], [4, 4, 4, 4]]


def test_the_readme_says_what_was_found(recorded):
    text = " ".join((STUDIES / "08_atlas" / "README.md").read_text(encoding="utf-8").split())
    starts = recorded["feeders"]["starts"]
    for share in (*starts.values(), recorded["feeders"]["refined"]["8"]["computed"]):
        assert f"{100 * share:.1f} %" in text
    for step in ("4", "8", "16"):
        each = recorded["circle"]["refined"][step]
        assert (
            f"| {step} | {100 * each['computed']:.1f} % | {100 * each['differ']:.2f} % | {each['widest missed']} |"
            in text
        )
    assert f"({100 * recorded['logistic']['undecided']:.1f} % of all)" in text
    assert f"steps of {recorded['logistic']['step']:.4f}" in text
