"""What is added from a file outside the package works, is not taken for anything else, and goes away again."""

import math
from collections.abc import Iterator
from dataclasses import replace
from json import loads
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from typer.testing import CliRunner

import limitsets as ls
from limitsets.base.errors import AnswerError, MapError, SceneError
from limitsets.face.cli.app import app
from limitsets.face.report.pages import goal_sentence, page, verdict_of
from limitsets.face.report.writing import summary
from limitsets.feeder.goals import GOALS, OrientedBeyond, declare, evaluate
from limitsets.feeder.thrower import effects, impact_angles
from limitsets.feeder.thrower.effects import EFFECTS
from limitsets.feeder.thrower.motion import all_enclosed
from limitsets.feeder.world import FACTS, Fact
from limitsets.parameters.analysis import GoalOutcome
from limitsets.proofs.prover.goals import KINDS, sentence
from limitsets.proofs.prover.query import Query
from limitsets.systems.graph.images import METHODS
from limitsets.systems.graph.images.sampled import sampled
from limitsets.systems.maps import contract, images
from tests.extending import outside
from tests.proofs.forge import rewritten

DESIGNED = ls.load("paper-designed")
X = np.linspace(9.0, 27.0, 200)


@pytest.fixture
def added() -> Iterator[None]:
    """Add everything, and take it away again."""
    effects.declare(outside.WEAR)
    declare(outside.KeepsBelow)
    KINDS["keeps_below"] = outside.KEEPS_BELOW
    METHODS["thirds"] = sampled(outside.thirds)
    ls.register(outside.Tent, image=outside.tent, branches=("up", "down"))
    app.command()(outside.perimeter)
    try:
        yield
    finally:
        for table, names in ((FACTS, outside.WEAR.facts), (EFFECTS, ["wear"]), (GOALS, ["keeps_below"])):
            for name in names:
                del table[name]
        del KINDS["keeps_below"], METHODS["thirds"], contract._KINDS[outside.Tent]
        app.registered_commands.pop()


def worn(how: str = "loose", lost: float = 0.0, creep: str = "1e-9 in", **tables):
    own = {"effects": {"wear": how}, "world": {"lost": lost, "creep": creep}}
    return ls.load({**DESIGNED.as_dict(), **own, **tables})


def test_without_it_a_scene_knows_nothing_of_it():
    for table, key in (
        ({"effects": {"wear": "loose"}}, "effects.wear"),
        ({"world": {"lost": 0.1}}, "world.lost"),
        ({"goal": {"keeps_below": "24 in"}}, "goal.keeps_below"),
    ):
        with pytest.raises(SceneError, match="it is not known") as caught:
            ls.load({**DESIGNED.as_dict(), **table})
        assert caught.value.key == key


# ---------------------------------------------------------------- the effect


@pytest.mark.usefixtures("added")
def test_the_effect_is_simulated():
    """A slower arm is the bare map with its kappa; what creeps is that much farther; what sticks just falls."""
    bare = DESIGNED.bare_map
    slow = images(worn(lost=0.1).map, X, 2)
    expected = images(bare._replace(kappa=bare.kappa / 0.81), X, 2)
    kept = expected.code >= 0
    assert (slow.side == expected.side)[kept].all()
    np.testing.assert_allclose(slow.x[kept], expected.x[kept], rtol=1e-9)
    assert (expected.side[kept] != 2).any()  # some flip

    plain, crept = images(bare, X, 2), images(worn(creep="0.25 in").map, X, 2)
    kept = crept.code >= 0
    np.testing.assert_allclose(crept.x[kept], plain.x[kept] + 0.25, rtol=1e-12)

    # without rotation it falls to the side on which its centre of mass is: over the vertex where a cos phi < d sin phi
    held, phi = images(worn("firm").map, X, 2), impact_angles(bare, X, 2)
    over = bare.a[2] * np.cos(phi) < bare.d[2] * np.sin(phi)
    kept = held.code >= 0
    assert (held.side == np.where(over, 0, 2))[kept].all()
    assert set(held.side[kept].tolist()) == {0, 2}


@pytest.mark.usefixtures("added")
def test_the_effect_is_read_and_refused_as_others_are():
    assert worn().effects.on() == ("wear",)
    assert (worn().effects.wear, worn().world.lost, DESIGNED.world.lost) == ("loose", 0.0, None)
    for tables, words in (
        ({"world": {"creep": "1 in"}}, r"the fact world.lost is 'missing'"),
        ({"world": {"lost": 0.6, "creep": "1 in"}}, r"the lost share.*from 0 to 0.5"),
        ({"world": {"lost": 0.1, "creep": "1 deg"}}, r"this length.*deg.*a unit of m, cm"),
        ({"world": {"lsot": 0.1, "creep": "1 in"}}, r"lsot.*it is not known.*lost"),
        ({"effects": {"wear": True}}, '"loose" or "firm"'),
        ({"model": {"flight": "small-angle"}}, "the flight"),
    ):
        with pytest.raises(SceneError, match=words):
            worn(**tables)
    with pytest.raises(MapError, match=r"the name of the effect.*wear"):
        effects.declare(outside.WEAR)
    for taken in ("creep", "friction", "scatter"):
        again = outside.WEAR._replace(name="tear", facts={taken: Fact("another", words="1")})
        with pytest.raises(MapError, match=f"the name of the fact.*{taken}"):
            effects.declare(again)
    assert "tear" not in EFFECTS


@pytest.mark.usefixtures("added")
def test_nothing_is_proved_of_the_effect():
    assert all_enclosed((outside.Wear(0.1, 0.0, 0.0),)) is False
    with pytest.raises(AnswerError, match=r"wear.*landing, roll and bounded spread"):
        ls.certify(worn())


@pytest.mark.usefixtures("added")
def test_a_certificate_names_its_facts_as_left_out(tmp_path):
    """The checker knows neither: they stand apart in the file, and other keys of [world] are refused as before."""
    stated = {"friction": 0.3, "lost": 0.1, "creep": "1e-3 in"}
    proof = ls.certify(ls.load({**DESIGNED.as_dict(), "world": stated}), claims=["invariant"])
    file = proof.save(tmp_path / "p.proof.zip")
    report = ls.recheck(file)
    assert (report.verdict, report.model["left_out"]) == ("proved", ["friction", "lost", "creep"])
    assert report.model["left_out"] == list(proof.model.left_out)
    assert proof.model.sentence.endswith("friction, lost and creep of [world] are not in it")
    with ZipFile(file) as zipped:
        (box,) = loads(zipped.read("header.json"))["boxes"]
    assert box["scene"]["world"] == {"friction": 0.3, "other": {"lost": 0.1, "creep": "1e-3 in"}}
    for world in ({"friction": 0.3, "lost": 0.1}, {"other": stated}):
        assert ls.recheck(forged(file, world)).verdict == "bad file"


def forged(file: Path, world: dict) -> Path:
    """The same certificate, with another [world] in its scene."""
    return rewritten(
        file, file.with_name("q.zip"), lambda header: header["boxes"][0]["scene"].update(world=world)
    )


@pytest.mark.usefixtures("added")
def test_audit_and_report_name_the_effect_and_not_another():
    scene = worn(lost=0.02)
    found = ls.audit(scene)
    assert "Simulated: wear." in " ".join(summary(found))
    assert not any(each.simulated for each in found.findings)
    text = page(replace(ls.analyse("paper-designed", cells=256), scene=scene), {})
    assert "**Simulated** beyond the minimal model: wear." in text
    assert "the arm is as new" not in text
    assert "the left bottom vertex lands first" in text


# ---------------------------------------------------------------- the goal


def asking(x: str, **tables):
    return ls.load({**DESIGNED.as_dict(), "goal": {"keeps_below": x}, **tables})


@pytest.mark.usefixtures("added")
def test_the_goal_is_asked_answered_and_reported():
    scene = asking("24 in")
    assert scene.goal == outside.KeepsBelow(24.0)
    # the limit set of the paper's scene ends at 23.38 (docs/model.md)
    assert evaluate(scene.goal, {0: [(15.2, 19.8)], 2: [(8.9, 23.38)]}) == (True, 23.38)
    text = page(ls.analyse(scene, cells=1024), {})
    asked = "Asked: no part rests beyond x = 24 in (asked of the limit set)"
    assert f"{asked}. **It holds of the limit set**" in text
    assert "The farthest part is at x = 23.3" in text
    false = GoalOutcome(outside.KeepsBelow(20.0), False, 23.38)
    assert verdict_of(false, 1.0) == "does not hold"
    with pytest.raises(SceneError, match=r"goal.keeps_below.*from 0 to below the arm's length"):
        asking("30 in")
    with pytest.raises(AnswerError, match="KeepsBelow"):
        declare(outside.KeepsBelow)


@pytest.mark.usefixtures("added")
def test_the_goal_is_proved_and_refuted_and_no_certificate_is_written(tmp_path):
    proved = ls.certify(asking("24 in"), claims=["goal"])
    assert [(each.verdict, each.starts) for each in proved.claims] == [("proved", "every")]
    said = "In the attracting cells, no part rests beyond x = 24 in."
    assert sentence(proved.claims[0].section).startswith(said)
    with pytest.raises(AnswerError, match=r"keeps_below.*goals that the checker knows"):
        proved.save(tmp_path / "p.proof.zip")
    (refuted,) = ls.certify(asking("22 in"), claims=["goal"]).claims
    assert refuted.verdict == "refuted"
    assert refuted.counterexample[-1].lo > 22.0
    assert Query.of(asking("24 in"), (outside.KeepsBelow(24.0),)).prove().verdict == "proved"


@pytest.mark.usefixtures("added")
def test_a_goal_without_a_proof_is_undecided(monkeypatch):
    monkeypatch.delitem(KINDS, "keeps_below")
    (claim,) = ls.certify(asking("24 in"), claims=["goal"]).claims
    assert (claim.verdict, claim.reason) == ("undecided", "nothing proves keeps_below in this version")


@pytest.mark.usefixtures("added")
def test_other_claims_of_a_scene_are_saved_and_rechecked_whatever_its_goal(tmp_path, monkeypatch):
    """The checker knows no goal from outside: it says that nothing is claimed of it, and checks the rest."""
    monkeypatch.chdir(tmp_path)
    ls.dump(asking("24 in"), "own.toml")
    done = CliRunner().invoke(app, ["certify", "own.toml", "--claims", "goal"])
    assert done.exit_code == 0
    assert "goal: PROVED" in done.output
    assert "no certificate is written" in done.output
    assert "nothing rechecks others" in " ".join(done.output.split())
    monkeypatch.delitem(KINDS, "keeps_below")
    for claims in ("attracts-all", "attracts-all,goal"):
        done = CliRunner().invoke(app, ["certify", "own.toml", "--claims", claims, "--out", "own.proof.zip"])
        assert "certificate: own.proof.zip" in done.output
        report = ls.recheck("own.proof.zip")
        assert report.claims == [("attracts-all", "proved", "")]
        assert any("goal" in line for line in report.statement)


# ---------------------------------------------------------------- the rest


@pytest.mark.usefixtures("added")
def test_the_map_and_the_image_method():
    """Of the tent of slope 2, 0.2 goes to 0.4, 0.8, 0.4; of slope 1.9, no third of a cell goes to a border of cells."""
    assert ls.orbit(outside.Tent(2.0), 0.2, 0, 3).x.tolist() == pytest.approx([0.2, 0.4, 0.8, 0.4])
    graph = ls.transitions(outside.Tent(1.9), ls.grid([(0.0, 1.0)], cells=100), method="thirds")
    for cell in range(100):
        points = [outside.tent(outside.Tent(1.9), (cell + third) / 100, 0)[0] for third in (1 / 3, 2 / 3)]
        first, last = (math.floor(100 * x) for x in sorted(points))
        assert graph.successors(cell).tolist() == list(range(first, last + 1))
    halved = ls.map(lambda x: 0.5 * x, vectorised=True)
    METHODS["thirds"] = sampled(lambda grid, side: replace(outside.thirds(grid, side), split=True))
    with pytest.raises(MapError, match="a method that cuts cells"):
        ls.transitions(halved, ls.grid([(0.0, 1.0)], cells=100), method="thirds")


def test_the_figure():
    figure = outside.lengths(DESIGNED)
    bars = [each.get_height() for each in figure.axes[0].patches]
    assert bars == [5.75, 3.6, 6.75]


@pytest.mark.usefixtures("added")
def test_the_command():
    done = CliRunner().invoke(app, ["perimeter", "paper-designed"])
    assert (done.exit_code, done.output) == (0, "16.1 in\n")


def test_afterwards_the_package_is_as_it_was():
    test_without_it_a_scene_knows_nothing_of_it()
    assert goal_sentence(OrientedBeyond(20.0, 2), "in").startswith("every part at rest beyond")
    assert "perimeter" not in [command.callback.__name__ for command in app.registered_commands]
