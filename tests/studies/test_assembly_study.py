"""Study 12: what it is expected to say, from few trials with another seed."""

import json

import pytest
from scipy.stats import binomtest

import limitsets as ls
from tests.studies.test_studies import STUDIES, load_study

pytestmark = pytest.mark.sweep  # trials in the engine


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    pytest.importorskip("pymunk")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(STUDIES / "12_assembly"))
        study = load_study("12_assembly")
        out = tmp_path_factory.mktemp("assembly")
        return study, study.main(seed=7, out=out, trials=150, few=60, search=False), out


def test_as_expected(ran):
    """Counts of the trials that are kept, and of these: intervals of 99.99 % overlap."""
    _, numbers, out = ran
    expected = json.loads((STUDIES / "12_assembly" / "expected.json").read_text(encoding="utf-8"))
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
