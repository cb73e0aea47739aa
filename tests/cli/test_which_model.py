"""A verdict says of which model it is: which facts of [world] are left out, through every door."""

import json
import time
from pathlib import Path

import pytest

import limitsets as ls
from limitsets.feeder.scene.left_out import Model
from tests.cli.command import run
from tests.feeding.scenes import with_cavity

RUBBED = {"friction": 0.3, "restitution": 0.2}
LEFT_OUT = "of the minimal model: friction and restitution of [world] are not in it"
MODEL = {"simulated": [], "left_out": ["friction", "restitution"]}
ALL = "of the minimal model: no fact of [world] is left out"
THROWS = [{"name": "own", "kappa": "25.3778518 in"}]
FEEDBACK = {"sensor": {"beyond": "20 in"}, "throws": THROWS}
SPREAD = {"world": {"scatter": {"speed": "0.5 %"}}, "effects": {"spread": "gaussian"}}
QUICK = ("--trials", "100", "--no-level")


def scene(**tables):
    """Give the designed feeder with these tables."""
    return ls.load(ls.load("paper-designed").as_dict() | tables)


def written(found, name="mine.toml"):
    ls.dump(found, name)
    return name


def broken(found):
    """Count by the whole audit what breaks on the limit set, effects of the scene apart."""
    return sum(bool(each.called_for) and not each.simulated for each in ls.audit(found).on("limit-set"))


# Verdicts after which the limit set of the scene is audited, and others.
AUDITED = {
    "certify": ("certify", "mine.toml"),
    "margin": ("margin", "mine.toml", "throw.speed", "--width", "0.5"),
    "robustness": (
        "robustness", "mine.toml", "-o", "sheet", "--quantity", "throw.speed", "--reading", "fixed", "--width", "0.5",
        "--seconds", "0", "--without", "noise", "--without", "joint", "--without", "curve",
    ),
    "feed": ("feed", "mine.toml", *QUICK),
    "design --critical-points": (
        "design", "mine.toml", "--critical-points", "10.1,10,20", "--starts", "0", "--vary",
        "part.mass.center.along,part.mass.center.above,throw.kappa",
    ),
    "design --goal": ("design", "mine.toml", "--goal", "--vary", "throw.kappa", "--evaluations", "5"),
    "design --robust": (
        "design", "mine.toml", "--robust", "--vary", "part.mass.center.along", "--evaluations", "4", "--seconds", "0",
    ),
}  # fmt: skip
OTHERS = {
    "feedback": ("feedback", "mine.toml", "--starts", "2=16:16.5", "--cells", "256", "--parts", "10"),
    "atlas": ("atlas", "mine.toml", "--x", "throw.kappa=25:26:3", "--workers", "1"),
}


@pytest.mark.parametrize("words", [*AUDITED.values(), *OTHERS.values()], ids=[*AUDITED, *OTHERS])
def test_every_command_names_what_is_left_out(capfd, words):
    found = with_cavity(tables={"world": RUBBED, "feedback": FEEDBACK})
    written(found)
    _, out, _ = run(capfd, *words)
    lines = [line for line in out.splitlines() if line.startswith(LEFT_OUT)]
    assert len(lines) == 1
    _, out, _ = run(capfd, *words, "--json")
    records = json.loads(out)
    for record in records if isinstance(records, list) else [records]:
        count = record["model"].pop("assumptions_broken")
        assert record["model"] == MODEL
        if words in OTHERS.values():
            assert count is None
            assert "; not audited" in lines[0]
        elif words[0] != "design":  # a design is another feeder
            assert count == broken(found) > 0
            assert f"; {count} assumptions break on the limit set: " in lines[0]
        else:
            assert isinstance(count, int)


def test_the_answer_is_there_before_the_audit(capfd, monkeypatch):
    import limitsets.proofs.auditing

    def late(model, scene):
        assert "attracts-all: PROVED" in capfd.readouterr().out
        raise KeyboardInterrupt

    monkeypatch.setattr(limitsets.auditing, "audited", late)
    code, out, _ = run(capfd, "certify", written(scene(world=RUBBED)))
    assert code == 130
    assert "assumption" not in out


@pytest.mark.parametrize("name", ["paper-initial", "paper-designed"])
def test_the_count_is_that_of_the_audit_and_quick(name):
    from limitsets.proofs.auditing import audited

    for world in ({}, RUBBED, {"friction": 0.01, "restitution": 0.9, "bounce_threshold": "0.01 in"}):
        found = ls.load(ls.load(name).as_dict() | {"world": world})
        assert audited(Model.of(found), found).assumptions_broken == broken(found)
        begin = time.perf_counter()
        audited(Model.of(found), found)
        assert time.perf_counter() - begin < 2.0


def test_what_is_left_out():
    """By physics.md: landing and roll need no fact; a landing without rebound is the minimal model's own."""
    scatter = {"speed": "0.5 %"}
    cases = [
        ({}, {}, (), ()),
        ({"throw_rate": "2 Hz"}, {}, (), ()),
        ({"restitution": 0.0, "bounce_threshold": "1 mm"}, {}, (), ()),
        ({"bounce_threshold": "1 mm", "stroke": "5 deg"}, {}, (), ("bounce_threshold", "stroke")),
        ({"friction": 0.9}, {"landing": True, "roll": True}, ("landing", "roll"), ("friction",)),
        ({"friction": 0.9}, {"slip": True, "pivot": True}, ("slip", "pivot"), ()),
        ({"friction": 0.9, "stroke": "5 deg"}, {"drive": True}, ("drive",), ()),
        ({"scatter": scatter}, {}, (), ("scatter",)),
        ({"scatter": scatter, "restitution": 0.2}, {"spread": "bounded"}, ("spread",), ("restitution",)),
        ({"scatter": {"speed": "0 %"}}, {}, (), ()),
    ]
    for world, effects, simulated, left_out in cases:
        model = Model.of(scene(world=world, effects=effects))
        assert (model.simulated, model.left_out) == (simulated, left_out)


def test_noise_that_allows_for_the_scatter_has_it():
    """Of each quantity as much as the scene scatters; less, or of another quantity, has not."""
    found = scene(world={"scatter": {"speed": "0.5 %", "landing": "1 mm"}})
    both = {"throw.speed": "0.5 %", "landing.x": "0.04 in"}
    assert Model.of(found, both).left_out == ()
    assert Model.of(found, both | {"landing.x": "0.03 in"}).left_out == ("scatter",)
    assert Model.of(found, {"throw.speed": "0.5 %"}).left_out == ("scatter",)
    # a third of a percent of 150 deg/s, though 0.0087 rad/s is the larger number
    assert Model.of(found, both | {"throw.speed": "0.5 deg/s"}).left_out == ("scatter",)


def test_nothing_is_left_out_of_a_scene_whose_effects_have_all_its_facts(capfd):
    """Bounded scatter is in the proof; of a scene that states nothing nothing can be left out."""
    file = written(scene(world={"scatter": {"speed": "0.1 %"}}, effects={"spread": "bounded"}))
    code, out, _ = run(capfd, "certify", file, "-o", "mine.proof.zip")
    assert code == 0
    assert "of the model with spread: no fact of [world] is left out;" in out
    assert json.loads(run(capfd, "certify", file, "--json")[1])[0]["model"]["left_out"] == []
    assert (
        "of the model with spread: no fact of [world] is left out;"
        in run(capfd, "recheck", "mine.proof.zip")[1]
    )
    assert ALL in run(capfd, "certify", "paper-designed")[1]


def test_tables_and_python_name_it():
    proof = ls.certify(scene(world=RUBBED))
    assert proof.model.sentence == LEFT_OUT
    assert proof.model.assumptions_broken is None
    assert all(LEFT_OUT in table for table in (proof.table().text(), proof._repr_html_()))
    heads, *rows = proof.table().csv().splitlines()
    assert heads.endswith(",not simulated")
    assert all(row.endswith('"friction, restitution"') for row in rows)
    (margin,) = ls.margin(scene(world=RUBBED), "throw.speed", width=0.5)
    assert LEFT_OUT in margin._repr_html_()
    assert margin.table().csv().splitlines()[1].endswith('"friction, restitution"')
    fed = ls.feed(with_cavity(tables={"world": RUBBED}), trials=10, level=False)
    assert LEFT_OUT in fed._repr_html_()


def test_of_a_map_nothing_of_this_is_said():
    proof = ls.certify(ls.maps.Logistic(2.5), ls.grid([(0.1, 0.9)], cells=512), ["attracts-all"])
    assert not hasattr(proof, "model")
    assert not any("[world]" in table.text() for table in proof.tables())


def test_a_recheck_names_what_the_file_leaves_out(capfd):
    file = written(scene(world=RUBBED))
    code, *_ = run(capfd, "certify", file, "-o", "mine.proof.zip")
    assert code == 0
    code, out, _ = run(capfd, "recheck", "mine.proof.zip")
    assert code == 0
    assert f"{LEFT_OUT}; not audited" in out
    record = json.loads(run(capfd, "recheck", "mine.proof.zip", "--json")[1])
    assert record["model"] == MODEL | {"assumptions_broken": None}
    assert LEFT_OUT in ls.recheck("mine.proof.zip")._repr_html_()


def test_a_feeder_that_scatters_without_bounds(capfd):
    """Safety and progress are of the scene without its scatter: in the verdict, and the command exits 1."""
    file = written(with_cavity(tables=SPREAD))
    code, out, _ = run(capfd, "feed", file, *QUICK, "--certificate", "fed.proof.zip")
    assert code == 1
    assert "safety: PROVED of the scene without its scatter, no start on the arm feeds another side" in out
    assert "progress: PROVED of the scene without its scatter, every start" in out
    assert "of the minimal model, of the scene without its scatter: scatter of [world] is not in it" in out
    found = ls.feed(file, trials=10, level=False)
    record = found.to_json()
    assert record["safety"]["verdict"] == "proved of the scene without its scatter"
    assert record["progress"]["verdict"] == "proved of the scene without its scatter"
    assert record["model"]["left_out"] == ["scatter"]
    assert "of the scene without its scatter" in run(capfd, "recheck", "fed.proof.zip")[1]
    assert not found.proved
    assert found.safe.verdict == found.fed.verdict == "proved of the scene without its scatter"
    assert "proved of the scene without its scatter" in found.tables()[1].csv()


def test_a_sheet_of_a_scene_that_scatters(capfd):
    """Margins are of the scene without its scatter, and so is the verdict on the goal."""
    for effect in ("gaussian", "bounded"):
        file = written(scene(world=SPREAD["world"], effects={"spread": effect}))
        words = ("-o", effect, *AUDITED["robustness"][4:])
        code, out, _ = run(capfd, "robustness", file, *words)
        assert code == 1
        assert "In the scene without its scatter this holds, proved." in out
        assert (
            "of the minimal model, of the scene without its scatter: scatter of [world] is not in it" in out
        )
        _, out, _ = run(capfd, "robustness", file, *words, "--json")
        assert json.loads(out)["holds"] is None


def test_a_feeder_that_feeds_nothing_says_so_first(capfd):
    """The end is beyond all that the throws reach: 23.4 in on side 2, known_answers.md; most stay on the arm."""
    file = written(with_cavity(position="26 in"))
    code, out, _ = run(capfd, "feed", file, *QUICK, "-o", "fed")
    assert code == 1
    assert out.splitlines()[0].startswith("paper-designed: nothing is fed, none of 100 parts thrown")
    assert "throws until" not in out
    record = json.loads(Path("fed/feeding.json").read_text(encoding="utf-8"))
    assert record["vacuous"] is True
    assert sum(record["trials"]["counts"][name] for name in ("right", "wrong", "wall")) == 0
    assert not ls.feed(with_cavity(), prove=False, level=False, trials=10).vacuous


def test_the_explorer_names_it():
    pytest.importorskip("panel")
    from limitsets.face.explorer.page import ScenePage

    page = ScenePage(scene(world=RUBBED))
    assert f"{LEFT_OUT}; not audited" in page._proved.object
    assert f"{LEFT_OUT}; not audited" in page._estimated.object
    page.close()
