"""Numbers of the studies of assembly, many parts, trays, feeding and feedback."""

import json

import numpy as np
import pytest
from scipy.stats import binomtest

import limitsets as ls
from tests.studies.test_studies import STUDIES, expected_of, load_study, of_study, readme_of
from tests.trays.scenes import SIZES

pytest.importorskip("pymunk")
pytestmark = pytest.mark.sweep


# ----------------------------------------------------------------
# Study 12: what it is expected to say, from few trials with another seed.


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(STUDIES / "12_assembly"))
        study = load_study("12_assembly")
        out = tmp_path_factory.mktemp("assembly")
        return study, study.main(seed=7, out=out, trials=30, few=15, search=False), out


def test_as_expected(ran):
    """Counts of the trials that are kept, and of these: intervals of 99.99 % overlap."""
    _, numbers, out = ran
    expected = expected_of("12_assembly")
    assert set(numbers["cases"]) == set(expected["counts"])
    for case, wanted in expected["counts"].items():
        found, of = numbers["cases"][case]["counts"], sum(wanted.values())
        for outcome, count in wanted.items():
            known = binomtest(count, of).proportion_ci(0.9999, method="exact")
            own = binomtest(found[outcome], sum(found.values())).proportion_ci(0.9999, method="exact")
            assert own.low <= known.high, (case, outcome)
            assert known.low <= own.high, (case, outcome)
    for name in ("passing", "contact"):
        assert (out / f"{name}.png").stat().st_size > 20_000


def test_the_step_does_not_show(ran):
    """On the same draws, with half the step: rates move within their intervals."""
    _, numbers, _ = ran
    halved = numbers["halved step"]
    whole, half = halved["rates"].values()
    assert halved["same"] > 0.5 * halved["trials"]
    for word in whole:
        assert whole[word]["interval"][0] <= half[word]["interval"][1]
        assert half[word]["interval"][0] <= whole[word]["interval"][1]


def test_the_design_is_that_of_the_scene():
    """`limitsets.design` comes to the mass that the built-in scene has, to its digits."""
    design = load_study("12_assembly", "design")
    made = design.main()
    scene = ls.load("paper-quadrilateral")
    for name, value in made["values"].items():
        assert scene.value(name) == pytest.approx(value, abs=6e-8)
    assert made["farthest landing on another side"] < 20.0 < made["on side 1"]
    assert made["fates"]["wrong"] == 0


def test_the_scenes_have_the_committed_sizes():
    import tomllib

    sizes = tomllib.loads((STUDIES / "sizes.toml").read_text(encoding="utf-8"))
    for name in ("paper-triangle", "paper-quadrilateral"):
        tree = ls.load(name).as_dict()
        assert tree["cavity"] == sizes["cavity"]
    assert ls.load("paper-triangle").as_dict()["part"]["sides"] == sizes["triangle"]["sides"]
    assert ls.load("paper-triangle").as_dict()["part"] == ls.load("paper-designed").as_dict()["part"]
    assert tree["part"]["vertices"] == sizes["quadrilateral"]["vertices"]


# ----------------------------------------------------------------
# Study 13: what is known beforehand, of parts alone and of parts that pass through each other.


@pytest.fixture(scope="module")
def ran_many_parts_study(tmp_path_factory):
    study = load_study("13_many_parts")
    study.BATCHES = {parts: batches for parts, batches in study.BATCHES.items() if parts not in (20, 50, 100)}
    study.STEPS = study.STEPS[:3]  # finer ones take most of the time, and no test looks at them
    out = tmp_path_factory.mktemp("many_parts")
    return study, study.main(seed=7, out=out, share=0.05), out


def test_as_expected_of_many_parts_study(ran_many_parts_study):
    _, numbers, out = ran_many_parts_study
    expected = expected_of("13_many_parts")
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


def test_parts_that_push_each_other_feed_fewer(ran_many_parts_study):
    numbers = ran_many_parts_study[1]
    rows = [numbers["pushing"][parts] for parts in ("2", "3", "5", "10")]
    right = sum(row["counts"]["right"] for row in rows)
    parts = sum(sum(row["counts"].values()) for row in rows)
    met = binomtest(right, parts).proportion_ci(0.99, method="exact")
    assert met.high < 0.9
    assert all(row["met"] > 0.0 for row in rows)
    assert numbers["pushing"]["200"]["spilled"] > 150


def test_the_readme_names_how_the_corner_was_held(ran_many_parts_study):
    text = readme_of("13_many_parts")
    assert ran_many_parts_study[0].table(ran_many_parts_study[1]).splitlines()[0] in text
    assert "| 1 | hinge, pushing |" in text
    assert "| 1 | unilateral, pushing |" in text


# ----------------------------------------------------------------
# Study 14: what it is expected to say, from counts of other seeds and from the sizes that were fixed before.


HISTORIES = 10


@pytest.fixture(scope="module")
def ran_tray_study(tmp_path_factory):
    return of_study("14_tray", tmp_path_factory, seed=7, drops=800, histories=HISTORIES)


def interval(count, of):
    return binomtest(count, of).proportion_ci(0.9999, method="exact")


def test_the_sizes_are_those_that_were_fixed(ran_tray_study):
    study, numbers, _ = ran_tray_study
    tree = study.scene().as_dict()["tray"]
    assert {name: tree[name] for name in SIZES} == SIZES
    assert numbers["tray"]["tray"]["contact"] == "unilateral"


def test_counts_agree_with_those_of_another_seed(ran_tray_study):
    _, numbers, out = ran_tray_study
    expected = expected_of("14_tray")
    found = numbers["tray"]
    pairs = [(expected["arrivals"], found["arrivals"])]
    pairs += [(expected["kicks"][state], found["kicks"][state]) for state in expected["kicks"]]
    for wanted, met in pairs:
        for state, count in wanted["counts"].items():
            one, other = interval(count, wanted["of"]), interval(met["counts"].get(state, 0), met["of"])
            assert one.low <= other.high, state
            assert other.low <= one.high, state
    assert (out / "tray.png").stat().st_size > 20_000


def test_the_chain_meets_the_histories_of_new_parts(ran_tray_study):
    for row in ran_tray_study[1]["chain and histories"]:
        low, high = interval(round(HISTORIES * row["histories"]), HISTORIES)
        assert low <= row["chain interval"][1], row["passes"]
        assert row["chain interval"][0] <= high, row["passes"]


def test_the_step_hardly_matters(ran_tray_study):
    rows = ran_tray_study[1]["step halved"]
    assert rows["unfinished"] == 0
    for word in ("captured rightly", "released"):
        whole, half = rows[word]
        assert whole["interval"][0] <= half["interval"][1]
        assert half["interval"][0] <= whole["interval"][1]
        assert rows[f"{word}: trials that differ"] <= 0.03 * rows["trials"]


def test_the_tables_are_written(ran_tray_study):
    study, numbers, _ = ran_tray_study
    lines = study.table(numbers).splitlines()
    assert sum(line.startswith("| leaning") for line in lines) == 3
    assert sum(line.startswith("| captured rightly") for line in lines) == 4


def test_many_parts_stand_beside_the_chain(tmp_path, monkeypatch):
    study = load_study("14_tray", "many_parts")
    monkeypatch.setattr(study, "BATCHES", {(10, 20): 2, (40, 20): 2})
    monkeypatch.setattr(study, "DROPS", 300)
    monkeypatch.setattr(study, "PASSES", 8)
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
    text = readme_of("14_tray")
    assert study.table(numbers).splitlines()[0] in text


# ----------------------------------------------------------------
# Study 09: what it is expected to say, from proofs, from theory and from trials.


@pytest.fixture(scope="module")
def ran_feeding_study(tmp_path_factory):
    return of_study("09_feeding", tmp_path_factory, seed=7, trials=4000, level=False)


def test_as_expected_of_feeding_study(ran_feeding_study):
    _, numbers, out = ran_feeding_study
    expected = expected_of("09_feeding")
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


def test_nothing_fails_within_the_margin(ran_feeding_study):
    for case in ("robust", "designed"):
        trials = ran_feeding_study[1][f"{case}, starts named"]["trials"]
        assert trials["right"] + trials["edge"] == 4000
        # assumed not to be fed: nothing is proved of a throw that acts beyond the end
        assert trials["edge"] > 0


def test_the_readme_has_the_paper_s_counts(ran_feeding_study):
    text = readme_of("09_feeding")
    study, numbers, _ = ran_feeding_study
    assert study.table(numbers).splitlines()[2] in text  # 19 of 20, and its interval


# ----------------------------------------------------------------
# Study 11: one bit brings the initial part to its goal, none does not; the README has what the study prints.


FOLDER = STUDIES / "11_feedback"


@pytest.fixture(scope="module")
def ran_feedback_study(tmp_path_factory):
    study = load_study("11_feedback")
    study.FROM, study.NOISE, study.PLACES = study.FROM[:1], study.NOISE[:1], np.array([16.0, 19.0, 22.0])
    out = tmp_path_factory.mktemp("feedback")
    return study, study.main(seed=5, out=out, parts=500), out


def test_as_expected_of_feedback_study(ran_feedback_study):
    _, numbers, out = ran_feedback_study
    expected = json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))
    for mode, asked in expected["solved"].items():
        found = numbers["sensors"][asked][mode]
        assert (found["verdict"], found["reached"]) == ("solved", 500)
        assert found["throws"] > expected["not_within"]  # the one is an upper bound, the other a lower one
        assert 0 < found["mean"] < found["throws"]
        assert numbers["sensors"][expected["blind"]][mode]["verdict"] == "not-solved"
    for shown in numbers["enclosed"].values():
        assert shown["not_within"] == expected["not_within"]
    for kind in ("starts", "noise"):
        for both in numbers[kind].values():
            assert all(row["reached"] == 500 for row in both.values() if row["verdict"] == "solved")
    assert [row["verdict"] for row in numbers["swept"]["stop"]] == ["solved", "solved", "not-solved"]
    for name in ("policy", "places"):
        assert (out / f"{name}.png").stat().st_size > 10_000


def test_the_readme_has_what_the_study_prints(ran_feedback_study):
    study, numbers, _ = ran_feedback_study
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert set(study.table(numbers).splitlines()) <= set(text.splitlines())
