"""Every public answer is shown in a notebook: well-formed, labelled, with its numbers; and saved in full."""

import csv
import io
from xml.etree import ElementTree as ET

import pytest

import limitsets as ls
from limitsets.base.tables import Tabled
from limitsets.parameters.margins.single import Margin


@pytest.fixture(scope="module")
def graph():
    scene = ls.load("paper-designed")
    return ls.transitions(scene.map, ls.grid(scene.domain, cells=512))


@pytest.fixture(scope="module")
def found(graph):
    return ls.attractors(graph, throws=2000)


def shown(answer):
    """Tables of an answer as texts, from its HTML; its name is a line."""
    assert "\n" not in repr(answer)
    assert len(repr(answer)) <= 250
    tree = ET.fromstring(f"<div>{answer._repr_html_()}</div>")
    tables = tree.findall("table")
    assert tables
    for table in tables:
        heads = len(table.findall("thead/tr/th"))
        assert heads >= 2
        assert all(len(row) == heads for row in table.findall("tbody/tr"))
    return [[[cell.text or "" for cell in row] for row in table.iter("tr")] for table in tables]


def captions(answer):
    return [caption.text for caption in ET.fromstring(f"<div>{answer._repr_html_()}</div>").iter("caption")]


def saved(answer):
    return list(csv.reader(io.StringIO(answer.table().csv())))


def test_scene_graph_and_sets(graph, found):
    assert shown(ls.load("paper-designed"))[0][0][1] == "length [in]"
    assert "sampled, not proved" in captions(graph)[0]
    assert "proved" in captions(ls.transitions(graph.map, graph.grid, "boxes"))[0]
    (attractor,) = found
    bands = [
        (str(side), repr(lo), repr(hi))
        for side, parts in sorted(attractor.extents.items())
        for lo, hi in parts
    ]
    assert [tuple(row[:3]) for row in saved(attractor)[1:]] == bands
    basins = ls.basins(graph, found)
    assert [float(row[1]) for row in saved(basins)[1:]] == [
        *basins.attractors,
        *basins.exits.values(),
        basins.undecided_between,
    ]
    assert len(shown(basins)[0]) == 1 + len(basins.attractors) + len(basins.exits) + 1
    limit = ls.limit_set(graph, attractor)
    assert [float(row[2]) for row in saved(limit)[1:]] == [end.x for end in limit.ends]
    assert shown(limit)
    path = ls.orbit(graph.map, 15.0, 2, 30)
    assert [float(row[1]) for row in saved(path)[1:]] == path.x.tolist()
    assert shown(path)


def test_cycles_of_a_plane_map():
    graph = ls.transitions(ls.maps.Henon(), ls.grid([(-1.5, 1.5), (-0.5, 0.5)], cells=(64, 64)))
    cycles = ls.cycles(graph, 2)
    assert shown(cycles)
    assert "not proved" in captions(cycles)[0]
    assert len(saved(cycles)) == 1 + sum(each.period for each in cycles)


def test_analysis_and_audit():
    analysis = ls.analyse("paper-designed", cells=512)
    assert "x [in]" in shown(analysis)[0][0]
    assert all("not proved" in caption for caption in captions(analysis))
    audit = ls.audit("paper-designed")
    assert {row[4] for row in saved(audit)[1:]} <= {"proved", "sampled"}
    assert len(shown(audit)[0]) == 1 + len(audit.findings)


def test_resilience(graph, found):
    answers = (
        ls.resilience.basin_entropy(graph, found),
        ls.resilience.basin_stability(graph, found),
        ls.resilience.convergence_times(graph, found, starts=200),
        ls.resilience.uncertainty_exponent(graph, found),
    )
    for answer in answers:
        assert shown(answer)
        assert "not proved" in captions(answer)[0]
    assert float(saved(answers[1])[1][1]) == answers[1].attractors[0].share


@pytest.mark.sweep
def test_proofs_and_their_recheck(tmp_path):
    pytest.importorskip("flint", reason="the checker needs python-flint")
    proof = ls.certify("paper-designed")
    claims = [row[:2] for row in shown(proof)[0][1:]]
    assert claims == [[each.claim, each.verdict] for each in proof.claims]
    report = ls.recheck(proof.save(tmp_path / "a.proof.zip"))
    rows = shown(report)[0]
    assert [row[0] for row in rows[1:]] == [*(name for name, _, _ in report.claims), "certificate"]
    assert rows[-1][1] == "PROVED"


@pytest.mark.sweep
def test_margins_designs_and_noise():
    (margin,) = ls.margin("paper-designed", "throw.speed", width=0.2)
    row = saved(margin)[1]
    assert [float(row[2]), float(row[3])] == [margin.proved, margin.refuted]
    assert captions(margin)[0].endswith(
        "(brackets: proved below, refuted above; of the minimal model: no fact of [world] is left out)"
    )
    assert shown(margin)
    design = ls.design("paper-initial", critical_points=[10, 10, 20], vary=["throw.kappa"])
    assert shown(design)
    assert [float(each[2]) for each in saved(design)[1:2]] == [design.scene.kappa]
    scene = ls.load("paper-designed")
    noise = ls.noise_statistics(
        scene, ls.robust.Scattering(speed=ls.robust.Gaussian(0.005)), cells=64, strata=4, sensitivity=False
    )
    assert {row[0]: float(row[1]) for row in saved(noise)[1:] if row[1]} == {
        name: value for name, value in noise.numbers.items() if value == value
    }


def test_continuation_and_atlas(tmp_path):
    pytest.importorskip("xarray", reason="the extra atlas")
    found = ls.atlas(
        "paper-designed", "throw.kappa=25:26:2", task="limitsets.parameters.atlas.examples:critical_points"
    )
    assert shown(found)
    assert len(saved(found)) == 3
    assert saved(found)[0][0] == "throw.kappa [in]"


def test_every_answer_of_a_public_function_is_tabled():
    from limitsets import (
        analysis,
        assembly,
        auditing,
        feeding,
        fitting,
        graph,
        inverse,
        policies,
        robust,
        trays,
    )
    from limitsets.parameters.atlas import Atlas
    from limitsets.parameters.continuation.snapshot import Continuation
    from limitsets.parameters.sheet.summary import Robustness
    from limitsets.proofs.prover import Proof

    answers = [
        analysis.Analysis,
        assembly.Assembly,
        auditing.Audit,
        feeding.Feeding,
        fitting.Fit,
        graph.TransitionGraph,
        inverse.Design,
        inverse.RobustDesign,
        policies.Synthesis,
        robust.AbsorptionBrackets,
        robust.Margin,
        trays.TrayFill,
        Atlas,
        Continuation,
        Proof,
        Robustness,
    ]
    for each in answers:
        assert issubclass(each, Tabled), each
        assert each.tables is not Tabled.tables, each


def test_a_margin_is_rounded_to_the_safe_side():
    scene = ls.load("paper-designed")
    ends = 0.7331966, 0.7337001
    found = Margin("throw.speed", "fixed", (), *ends, "%", 2.7, "", True, 1.0, scene, {}, {}, {}, (), None)
    assert found.table().shown()[0][2:4] == ["0.7331", "0.7338"]  # at six digits 0.733197 would be claimed
    assert found.table().csv().splitlines()[1].split(",")[2:4] == ["0.7331966", "0.7337001"]
