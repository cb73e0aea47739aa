"""The study of fits: machines of known truth."""

import importlib.util
import json
from pathlib import Path

import pytest
from scipy.stats import binom

FOLDER = Path(__file__).resolve().parents[2] / "studies" / "10_fit"
EXPECTED = json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def study():
    spec = importlib.util.spec_from_file_location("study_10_fit", FOLDER / "study.py")
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


@pytest.mark.sweep  # fits of many machines
def test_intervals_hold_and_are_as_wide_as_claimed(study):
    found = study.many(10, seed=3, flipped=0.05)
    for name in study.NAMES[:4]:
        assert found[name]["held"] >= binom.ppf(1e-4, found[name]["told"], 0.95)
        # of ten machines' median half width against that of two hundred
        assert found[name]["half"] == pytest.approx(EXPECTED["half"][name], rel=0.25)


@pytest.mark.sweep  # fits of many machines
def test_the_table_of_the_page_is_that_of_the_study(study):
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    for line in study.table(EXPECTED["numbers"]).splitlines():
        assert line in page


@pytest.mark.sweep
def test_the_figure_and_the_bootstrap(study, tmp_path):
    numbers = study.one(0, tmp_path, 4)
    assert (tmp_path / "residuals.png").stat().st_size > 20_000
    assert numbers["bootstrap"]["films"] == 4
    for each in numbers["quantities"].values():
        assert each["lo"] <= each["hi"]
    assert numbers["enough"] == EXPECTED["numbers"]["one"]["enough"]
    assert numbers["misread"] == EXPECTED["numbers"]["one"]["misread"]
