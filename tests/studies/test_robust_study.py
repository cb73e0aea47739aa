"""The study of robust design: what it recorded, checked by other means."""

import json
import math

import pytest

import limitsets as ls
from limitsets.parameters.margins.deviations import Tolerance
from limitsets.parameters.margins.estimate import estimated, failing
from tests.studies.test_studies import STUDIES, load_study


@pytest.fixture(scope="module")
def recorded():
    return json.loads((STUDIES / "07_robust_design" / "expected.json").read_text(encoding="utf-8"))


def design_of(recorded):
    return ls.load("paper-designed").with_values(recorded["values"])


def test_the_bound_is_a_part_that_rests_and_no_nudge_does_better(recorded):
    study = load_study("07_robust_design")
    bound = recorded["bound_of_rest"]
    assert bound["largest"] == max(bound["by_order"].values())
    # three lengths that form no triangle any more: 6.75 (1 + s %) = 9.35 (1 - s %)
    assert bound["largest"] < 100 * (9.35 - 6.75) / (9.35 + 6.75)
    # a raster of centres of mass, one order of the sides
    best = max(
        study.largest_at_rest(study.SIDES, 0.25 * i, 0.1 * j) for i in range(1, 27) for j in range(1, 20)
    )
    assert best <= bound["by_order"]["5.75, 3.6, 6.75"] + 1e-3
    assert best > 0.9 * bound["by_order"]["5.75, 3.6, 6.75"]


def test_five_times_the_margin_is_out_of_reach(recorded):
    before = recorded["before_sampled"]["margin"]
    assert recorded["bound_of_rest"]["largest"] < 5 * before


def test_the_design_holds_on_every_corner_of_its_box(recorded):
    scene = design_of(recorded)
    box = Tolerance.of(scene, load_study("07_robust_design").TOLERANCE)
    found = estimated(scene, box, 2)
    kept = recorded["sampled"]
    assert found.threshold == pytest.approx(kept["threshold"], abs=1e-9)
    at = type(found)(
        kept["margin"], recorded["x"], found.threshold, found.reach, found.invariant, found.effects
    )
    assert failing(scene, box, 2, at, 0.9995 * kept["margin"]) == []


def test_what_is_proved_is_below_what_is_refuted(recorded):
    for word in ("margins", "before_margins"):
        for one in recorded[word]:
            assert one["proved"] > 0
            assert one["refuted"] is None or one["proved"] < one["refuted"]
    # what an orbit refutes agrees with the search by floats, which knows nothing of proofs
    refuted = [one["refuted"] for one in recorded["before_margins"] if one["refuted"] is not None]
    assert min(refuted) == pytest.approx(recorded["before_sampled"]["margin"], rel=0.03)


def test_the_readme_says_what_was_found(recorded):
    text = (STUDIES / "07_robust_design" / "README.md").read_text(encoding="utf-8")
    for number in (
        recorded["bound_of_rest"]["largest"],
        recorded["sampled"]["margin"],
        recorded["before_sampled"]["margin"],
        *(row[0] for row in recorded["front"]),
    ):
        assert f"{number:.2f}" in text
    # never more than is proved, nor less than is refuted
    for one in (*recorded["margins"], *recorded["before_margins"]):
        assert f"{math.floor(1e3 * one['proved']) / 1e3:.3f}" in text
        assert one["refuted"] is None or f"{math.ceil(1e3 * one['refuted']) / 1e3:.3f}" in text
    for margin, mean, late in recorded["front"]:
        assert f"| {mean:.1f} | {late:.0f} |" in text, margin


def test_the_front_begins_with_the_design_and_falls(recorded):
    margins, means = zip(*((row[0], row[1]) for row in recorded["front"]), strict=True)
    assert margins[0] == recorded["sampled"]["margin"]
    assert means[0] == recorded["throws"]["mean"]
    assert list(margins) == sorted(margins, reverse=True)
    assert list(means) == sorted(means, reverse=True)
