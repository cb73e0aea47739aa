"""Study 05: the operator's numbers are those of long runs of throws, and its own short runs agree."""

import json
import math

import pytest

from tests.studies.test_studies import STUDIES, load_study

pytestmark = pytest.mark.sweep  # each case by 100 000 throws


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    study = load_study("05_noise")
    study.FACTORS = (1.0,)
    out = tmp_path_factory.mktemp("noise")
    return study.main(seed=2, out=out, throws=100_000, parts=1000, slopes=False), out


def test_as_expected(ran):
    numbers, out = ran
    expected = json.loads((STUDIES / "05_noise" / "expected.json").read_text(encoding="utf-8"))
    assert set(numbers["cases"]) == set(expected)
    for case, wanted in expected.items():
        for name, (value, tolerance) in wanted.items():
            assert numbers["cases"][case]["numbers"][name]["operator"] == pytest.approx(value, abs=tolerance)
    for name in ("density", "arrivals", "levels", "levels-short-arm"):
        assert (out / f"{name}.png").stat().st_size > 10_000


def test_throws_agree(ran):
    for case in ran[0]["cases"].values():
        for name in ("time on side 0", "time beyond", "fed"):
            row = case["numbers"][name]
            error = math.hypot(row["its error"], row["its standard error"])
            assert abs(row["operator"] - row["thrown"]) <= 4.5 * error, name
