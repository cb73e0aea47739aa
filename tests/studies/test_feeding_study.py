"""Study 09: what it is expected to say, from proofs, from theory and from trials."""

import json

import pytest
from scipy.stats import binomtest

from tests.studies.test_studies import STUDIES, load_study

pytestmark = pytest.mark.sweep  # five scenes, each proved and thrown


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    study = load_study("09_feeding")
    out = tmp_path_factory.mktemp("feeding")
    return study, study.main(seed=7, out=out, trials=4000, level=False), out


def test_as_expected(ran):
    _, numbers, out = ran
    expected = json.loads((STUDIES / "09_feeding" / "expected.json").read_text(encoding="utf-8"))
    assert set(numbers) == set(expected)
    for case, wanted in expected.items():
        found = numbers[case]
        for name in ("safety", "sides that can be fed", "progress of almost every start", "throws proved"):
            assert found[name] == wanted[name], (case, name)
        for fate, (count, trials) in wanted["trials"].items():
            # of 100 000 trials with another seed, and of these
            low, high = binomtest(count, trials).proportion_ci(0.9999, method="exact")
            met = binomtest(found["trials"][fate], 4000).proportion_ci(0.9999, method="exact")
            assert met.low <= high, (case, fate)
            assert met.high >= low, (case, fate)
    for name in ("designed", "initial"):
        assert (out / f"{name}.png").stat().st_size > 20_000


def test_nothing_fails_within_the_margin(ran):
    for case in ("robust", "designed"):
        trials = ran[1][f"{case}, starts named"]["trials"]
        assert trials["right"] + trials["edge"] == 4000
        assert (
            trials["edge"] > 0
        )  # assumed not to be fed: nothing is proved of a throw that acts beyond the end


def test_the_readme_has_the_paper_s_counts(ran):
    text = (STUDIES / "09_feeding" / "README.md").read_text(encoding="utf-8")
    assert ran[0].table(ran[1]).splitlines()[2] in text  # 19 of 20, and its interval
