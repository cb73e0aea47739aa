"""The study of margins: one scene of it again, and what it says of all."""

import json
import math

import pytest

from tests.studies.test_studies import STUDIES, load_study


@pytest.fixture(scope="module")
def recorded():
    return json.loads((STUDIES / "04_margins" / "expected.json").read_text(encoding="utf-8"))


@pytest.mark.sweep
def test_brackets_are_found_again_within_each_other(recorded, tmp_path):
    study = load_study("04_margins")
    found = study.main(
        ["paper-designed"],
        ["throw.speed", "arm.surface_height"],
        seconds=0.0,
        places=0,
        width=0.05,
        out=tmp_path,
    )
    assert (tmp_path / "margins-paper-designed.png").stat().st_size > 10_000
    wanted = {(one["quantity"], one["reading"]): one for one in recorded["paper-designed"]["margins"]}
    for one in found["paper-designed"]["margins"]:
        other = wanted[one["quantity"], one["reading"]]
        # both hold the sharp one
        assert one["proved"] < other["refuted"]
        assert other["proved"] < one["refuted"]


def test_the_speed_is_that_of_the_table(recorded):
    by_name = {(one["quantity"], one["reading"]): one for one in recorded["paper-designed"]["margins"]}
    for reading, sharp in (("fixed", 0.733), ("per-throw", 0.397)):
        one = by_name["throw.speed", reading]
        assert one["proved"] < sharp + 5e-4
        assert one["refuted"] > sharp - 5e-4
        assert one["refuted"] - one["proved"] <= 0.01 * one["refuted"]


def test_the_readme_shows_what_was_found(recorded):
    study = load_study("04_margins")
    text = (STUDIES / "04_margins" / "README.md").read_text(encoding="utf-8")
    assert study.table(recorded) in text
    # never more than is proved
    assert f"{math.floor(1e4 * recorded['joint']['proved']) / 1e4:.4f}" in text
    assert f"{math.ceil(1e4 * recorded['joint']['refuted']) / 1e4:.4f}" in text
    best, margin = recorded["beyond"]["best"]
    assert f"{best:.1f} in instead of 20 in" in text
    assert f"{margin:.1f} %" in text
