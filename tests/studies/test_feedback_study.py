"""Study 11: one bit brings the initial part to its goal, none does not; the README has what the study prints."""

import json

import numpy as np
import pytest

from tests.studies.test_studies import STUDIES, load_study

pytestmark = pytest.mark.sweep  # some twenty policies on 3072 cells

FOLDER = STUDIES / "11_feedback"


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    study = load_study("11_feedback")
    study.FROM, study.NOISE, study.PLACES = study.FROM[:1], study.NOISE[:1], np.array([16.0, 19.0, 22.0])
    out = tmp_path_factory.mktemp("feedback")
    return study, study.main(seed=5, out=out, parts=2000), out


def test_as_expected(ran):
    _, numbers, out = ran
    expected = json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))
    for mode, asked in expected["solved"].items():
        found = numbers["sensors"][asked][mode]
        assert (found["verdict"], found["reached"]) == ("solved", 2000)
        assert found["throws"] > expected["not_within"]  # the one is an upper bound, the other a lower one
        assert 0 < found["mean"] < found["throws"]
        assert numbers["sensors"][expected["blind"]][mode]["verdict"] == "not-solved"
    for shown in numbers["enclosed"].values():
        assert shown["not_within"] == expected["not_within"]
    for kind in ("starts", "noise"):
        for both in numbers[kind].values():
            assert all(row["reached"] == 2000 for row in both.values() if row["verdict"] == "solved")
    assert [row["verdict"] for row in numbers["swept"]["stop"]] == ["solved", "solved", "not-solved"]
    for name in ("policy", "places"):
        assert (out / f"{name}.png").stat().st_size > 10_000


def test_the_readme_has_what_the_study_prints(ran):
    study, numbers, _ = ran
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert set(study.table(numbers).splitlines()) <= set(text.splitlines())
