"""Study 13: what is known beforehand, of parts alone and of parts that pass through each other."""

import json

import pytest
from scipy.stats import binomtest

from tests.studies.test_studies import STUDIES, load_study

pytest.importorskip("pymunk")
pytestmark = pytest.mark.sweep  # some ten thousand throws in the engine


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    study = load_study("13_many_parts")
    out = tmp_path_factory.mktemp("many")
    return study, study.main(seed=7, out=out, share=0.05), out


def test_as_expected(ran):
    _, numbers, out = ran
    expected = json.loads((STUDIES / "13_many_parts" / "expected.json").read_text(encoding="utf-8"))
    share = expected["right of single parts"]
    alone = [numbers["pushing"]["1"], *numbers["passing"].values()]
    for row in alone:
        held = sum(row["counts"].values()) - row["counts"]["never"]
        met = binomtest(row["counts"]["right"], held).proportion_ci(0.9999, method="exact")
        assert met.low <= share <= met.high
        assert row["spilled"] == 0.0
    throws = expected["throws of single parts"]
    error = expected["standard deviation of throws"] / numbers["pushing"]["1"]["batches"] ** 0.5
    assert abs(numbers["pushing"]["1"]["throws"] - throws) < 4.0 * error
    assert (out / "many_parts.png").stat().st_size > 20_000


def test_parts_that_push_each_other_feed_fewer(ran):
    numbers = ran[1]
    rows = [numbers["pushing"][parts] for parts in ("2", "3", "5", "10")]
    right = sum(row["counts"]["right"] for row in rows)
    met = binomtest(right, sum(sum(row["counts"].values()) for row in rows)).proportion_ci(
        0.99, method="exact"
    )
    assert met.high < 0.9
    assert all(row["met"] > 0.0 for row in rows)
    assert numbers["pushing"]["200"]["spilled"] > 150


def test_the_readme_names_how_the_corner_was_held(ran):
    text = (STUDIES / "13_many_parts" / "README.md").read_text(encoding="utf-8")
    assert ran[0].table(ran[1]).splitlines()[0] in text
    assert "| 1 | hinge, pushing |" in text
    assert "| 1 | unilateral, pushing |" in text
