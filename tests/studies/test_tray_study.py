"""Study 14: what it is expected to say, from counts of other seeds and from the sizes that were fixed before."""

import json

import pytest
from scipy.stats import binomtest

from tests.studies.test_studies import STUDIES, load_study
from tests.trays.scenes import SIZES

pytest.importorskip("pymunk")
pytestmark = pytest.mark.sweep  # thousands of drops


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    study = load_study("14_tray")
    out = tmp_path_factory.mktemp("tray")
    return study, study.main(seed=7, out=out, drops=1200, histories=40), out


def interval(count, of):
    return binomtest(count, of).proportion_ci(0.9999, method="exact")


def test_the_sizes_are_those_that_were_fixed(ran):
    study, numbers, _ = ran
    tree = study.scene().as_dict()["tray"]
    assert {name: tree[name] for name in SIZES} == SIZES
    assert numbers["tray"]["tray"]["contact"] == "unilateral"


def test_counts_agree_with_those_of_another_seed(ran):
    _, numbers, out = ran
    expected = json.loads((STUDIES / "14_tray" / "expected.json").read_text(encoding="utf-8"))
    found = numbers["tray"]
    pairs = [(expected["arrivals"], found["arrivals"])]
    pairs += [(expected["kicks"][state], found["kicks"][state]) for state in expected["kicks"]]
    for wanted, met in pairs:
        for state, count in wanted["counts"].items():
            one, other = interval(count, wanted["of"]), interval(met["counts"].get(state, 0), met["of"])
            assert one.low <= other.high, state
            assert other.low <= one.high, state
    assert (out / "tray.png").stat().st_size > 20_000


def test_the_chain_meets_the_histories_of_new_parts(ran):
    for row in ran[1]["chain and histories"]:
        count = round(40 * row["histories"])
        low, high = interval(count, 40)
        assert low <= row["chain interval"][1], row["passes"]
        assert row["chain interval"][0] <= high, row["passes"]


def test_the_step_hardly_matters(ran):
    rows = ran[1]["step halved"]
    assert rows["unfinished"] == 0
    for word in ("captured rightly", "released"):
        whole, half = rows[word]
        assert whole["interval"][0] <= half["interval"][1]
        assert half["interval"][0] <= whole["interval"][1]
        assert rows[f"{word}: trials that differ"] <= 0.03 * rows["trials"]


def test_the_tables_are_written(ran):
    study, numbers, _ = ran
    lines = study.table(numbers).splitlines()
    assert sum(line.startswith("| leaning") for line in lines) == 3
    assert sum(line.startswith("| captured rightly") for line in lines) == 4


def test_many_parts_stand_beside_the_chain(tmp_path, monkeypatch):
    study = load_study("14_tray", "many_parts")
    monkeypatch.setattr(study, "BATCHES", {(10, 20): 2, (40, 20): 2})
    numbers = study.main(seed=7, out=tmp_path)
    for each in numbers.values():
        passing, chain = each["passing"], each["chain"]
        for word in ("right", "wrong"):
            low, high = interval(round(40 * passing[word]["value"]), 40)
            assert low <= chain[word]["interval"][1]
            assert chain[word]["interval"][0] <= high
        assert passing["covered"]["value"] == passing["met"] == 0.0
        assert each["pushing"]["met"] == 1.0
        assert each["pushing"]["right"]["value"] < chain["right"]["interval"][0]
    assert (tmp_path / "many_parts.png").stat().st_size > 20_000
    text = (STUDIES / "14_tray" / "README.md").read_text(encoding="utf-8")
    assert study.table(numbers).splitlines()[0] in text
