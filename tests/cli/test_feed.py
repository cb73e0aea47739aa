"""`feed` at the command line: where parts are laid, chamfers, scatter."""

import json
import re
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from tests.cli.command import DOCS, both, json_of, names_in, prints, refusal, run, written
from tests.feeding.own_throws import thrown
from tests.feeding.scenes import with_cavity
from tests.plates import left_by_some
from tests.scene.test_load import BOTH, chamfered

# ----------------------------------------------------------------
# `limitsets feed`: words, JSON, files, exit codes.

PAGE = (DOCS / "json.md").read_text(encoding="utf-8")


def fed(name="paper-designed", **changes):
    return written(with_cavity(name, **changes), "fed.toml")


def test_words_files_and_exit(capfd):
    out = prints(capfd, f"feed {fed(rate='2 Hz')} --trials 200 -o fed")
    assert "the arm ends at x = 20 in, side 2 is wanted" in out
    assert "safety: PROVED" in out
    assert "within 786 throws" in out
    assert names_in("fed") == {"feeding.json", "part.png", "feeding.png"}
    assert json.loads(Path("fed/feeding.json").read_text())["scene"] == "paper-designed"


@pytest.mark.sweep
def test_json_alone_and_noise(capfd):
    words = "--no-proof --scatter 'landing.x=0.1 in' --law bounded --trials 50 --seed 4"
    table = json_of(capfd, f"feed {fed()} {words}")
    assert table["safety"] is None
    assert table["scatter"] == {"landing": "Uniform(bound=0.1)"}
    assert table["trials"]["seed"] == 4
    assert table["success"]["wanted"] == 0.95


@pytest.mark.sweep
def test_the_certificate_is_written_and_rechecked(capfd):
    line = f"feed {fed(position='20.5 in')} --trials 50 --certificate fed.proof.zip"
    assert "certificate: fed.proof.zip, rechecked in" in prints(capfd, line)
    out = prints(capfd, "recheck fed.proof.zip")
    assert "feeds: the arm ends at x = 20.5 in" in out
    assert "feeds: PROVED" in out
    record = json_of(capfd, f"{line} --no-recheck")
    assert record["certificate"] == {"file": "fed.proof.zip", "denied": False, "recheck": None}


def test_what_the_checker_denies_is_undecided(capfd, monkeypatch):
    """It is kept, and the command says so."""
    from limitsets.cell.feeding import proving as writing

    right = writing.section_of

    def too_few(proof, end):
        section = right(proof, end)
        return section | {"progress": section["progress"] | {"throws": 5}}

    monkeypatch.setattr(writing, "section_of", too_few)
    out = prints(capfd, f"feed {fed()} --trials 50 --certificate fed.proof.zip", code=1)
    assert "progress: UNDECIDED, the checker denies it: side 0, cell" in out
    assert "the checker denies the certificate: it is kept as fed.denied.zip" in out
    assert Path("fed.denied.zip").exists()
    assert not Path("fed.proof.zip").exists()


@pytest.mark.sweep
def test_a_run_that_is_ended_leaves_no_draft():
    """A signal that ends a process leaves its files as they are: the command has to take away what it began."""
    command = [sys.executable, "-m", "limitsets", "feed", fed(position="20.5 in")]
    command += ["--trials", "50", "--certificate", "out/fed.proof.zip"]
    folder = Path("out")
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None and not list(folder.glob(".draft-*")):
            time.sleep(0.002)
        assert list(folder.glob(".draft-*"))
        process.terminate()
    assert process.returncode == 128 + signal.SIGTERM
    assert not list(folder.iterdir())


def test_not_proved_is_exit_1(capfd):
    out = prints(capfd, f"feed {fed('paper-initial')} --trials 50", code=1)
    assert "safety: REFUTED" in out


def test_a_scene_without_a_cavity_is_told_so(capfd):
    assert "add [cavity]" in refusal(capfd, "feed paper-designed")


@pytest.mark.sweep
def test_many_parts_at_once(capfd):
    """The keys are those of docs/json.md; without contact nothing is thrown at once."""
    pytest.importorskip("pymunk")
    tables = {"world": {"friction": 0.9, "throw_rate": "2 Hz"}, "effects": {"contact": True}}
    many = written(with_cavity(tables=tables))
    quick = ("--no-proof", "--trials", "20", "--parts", "2", "--batches", "2")
    out, record = both(capfd, f"feed {many}", *quick)
    line = next(line for line in PAGE.splitlines() if line.startswith("| `crowds`"))
    named = re.search(r"`\{(.*?)\}`", line).group(1).split(", ")
    for crowd, between in zip(record["crowds"], (True, False), strict=True):
        assert list(crowd) == named
        assert (crowd["parts"], crowd["batches"], crowd["between"]) == (2, 2, between)
        rate = crowd["right_per_throw"]["value"]
        assert crowd["right_per_minute"] == pytest.approx(120.0 * rate)
    assert "2 parts at once that push each other (arm: hinge):" in out
    assert "right per throw" in out
    assert "effects.contact" in refusal(capfd, f"feed {fed()}", *quick)


# ----------------------------------------------------------------
# `--laid SIDE=LO:HI` on the commands whose answers depend on starts.


def test_certify_exits_with_0_where_all_that_is_laid_down_is_proved(capfd):
    left = written(left_by_some(), "left.toml")
    prints(capfd, f"certify {left} --claim goal", code=1)
    length = ls.load(left).arm_length
    (record,) = json_of(capfd, f"certify {left} --laid 2={0.4 * length}:{0.5 * length}")
    assert (record["verdict"], list(record["starts"])) == ("proved", ["within"])
    assert record["laid"] == record["starts"]["within"]
    assert prints(capfd, "recheck left.proof.zip").splitlines()[-1] == "PROVED"


def test_certify_says_where_parts_are_laid_down(capfd):
    out = prints(capfd, "certify paper-designed --laid 0=8:20 --laid '2=12:40 cm'")
    assert "x = 8 to 20 in on side 0, x = 4.72441 to 15.748 in on side 2" in out
    assert "attracts-all" not in out


@pytest.mark.parametrize(
    "command", [*(f"{name} paper-designed" for name in ("certify", "margin", "robustness")), "feed fed.toml"]
)
def test_bad_ranges_are_refused_in_a_line(capfd, command):
    fed()
    for word, said in (
        ("0", "SIDE=LO:HI"),
        ("0=8", "SIDE=LO:HI"),
        ("0=8:9:10", "SIDE=LO:HI"),
        ("a=8:9", "SIDE=LO:HI"),
        ("-1=8:9", "SIDE=LO:HI"),
        ("0=eight:9", "eight"),
        ("3=8:9", "0, 1, 2"),
        ("0=9:8", "a lower end and a higher one"),
        ("0=1:8", "tips over the joint"),
        ("0=8:28.001", "the arm's end"),
        ("0=8:9 deg", "deg"),
    ):
        assert said in refusal(capfd, command, "--laid", word)


def test_critical_points_have_no_starts(capfd):
    assert "critical points have no starts" in refusal(
        capfd, "design paper-designed --critical-points 10,10,20 --laid 0=8:9"
    )


def test_a_design_is_asked_for_what_is_laid_down_alone(capfd):
    """Of the whole arm no throw of 60 is proved: from some starts parts leave; of 120 to 150 mm on side 2 one is."""
    left = written(left_by_some(), values={"throw.kappa": "300 mm"})
    words = f"design {left} --goal --vary throw.kappa --evaluations 60"
    assert json_of(capfd, words, code=1)["verdict"] == "undecided"
    record = json_of(capfd, f"{words} --laid 2=120:150 -o found.toml")
    assert record["verdict"] == "proved"
    assert record["room"] > 0.0 >= record["room_before"]
    prints(capfd, "certify found.toml --claim goal --laid 2=120:150")
    prints(capfd, "recheck found.proof.zip")
    # apart from the package: every part that is laid down comes beyond X, on side 2 alone, and none leaves the arm
    scene = ls.load("found.toml")
    x, side = np.linspace(120.0, 150.0, 3001), np.full(3001, 2)
    met = np.zeros(x.size, dtype=bool)
    for _ in range(2000):
        x, side = thrown(scene, scene.kappa, x, side)
        assert ((x > scene.sides.a[side]) & (x <= scene.arm_length)).all()
        assert (side[x >= 160.0] == 2).all()
        met |= x >= 160.0
    assert met.all()


def test_feed_says_where_parts_are_laid_down(capfd):
    out = prints(capfd, f"feed {fed()} --laid 0=6:14 --trials 50 --certificate fed.proof.zip")
    assert "where parts are laid down: x = 6 to 14 in on side 0" in out
    assert "no start that is laid down feeds another side than 2" in out
    assert "every start that is laid down is fed within" in out
    assert Path("fed.proof.zip").exists()
    assert "up to the end of the arm, 20 in" in refusal(capfd, "feed fed.toml --laid 0=6:21")


# ----------------------------------------------------------------
# A part that cannot rest on a side: `analyse` alone switches landing and roll on; with them all commands go.


FIRST = "switched on landing and roll: the part cannot rest on side 3, and tips on from there; other commands ask for"


def written_chamfer(**tables):
    """Write a scene's file, and return its text."""
    written(chamfered(**{"effects": BOTH, **tables}), "chamfered.toml")
    return Path("chamfered.toml").read_text(encoding="utf-8")


def without_lines():
    """Write it without the effects; what cannot be loaded cannot be dumped."""
    lines = ("[effects]", "landing = true", "roll = true")
    kept = [line for line in written_chamfer().splitlines() if line not in lines]
    Path("chamfered.toml").write_text("\n".join(kept) + "\n", encoding="utf-8")


def test_analyse_says_in_its_first_line_what_it_switched_on(capfd):
    without_lines()
    out = prints(capfd, "analyse chamfered.toml --cells 512 -o found")
    assert out.splitlines()[0] == f"{FIRST} landing = true and roll = true in [effects]"
    page = Path("found/report.md").read_text(encoding="utf-8")
    assert "**Switched on landing and roll: the part cannot rest on side 3" in page.split("\n\n")[2]
    record = json.loads(Path("found/analysis.json").read_text(encoding="utf-8"))
    assert record["scene"]["effects"] == BOTH
    assert record["effects"]["tipping"] == ["landing", "roll"]
    assert "3" not in record["attractors"][0]["extents"]
    assert record["attractors"][0]["flip_order"] == [0, 1, 2, 4]
    assert sum(record["basins"]["attractors"]) == pytest.approx(1.0)
    assert ls.load(record["scene"]).sides.rests.tolist() == [True, True, True, False, True]


def test_with_the_lines_nothing_is_switched_on_and_nothing_said(capfd):
    written_chamfer()
    code, out, err = run(capfd, "analyse chamfered.toml --cells 512 -o found --json")
    assert code == 0
    assert "switched on" not in err
    assert json.loads(out)["effects"]["tipping"] == []


def test_all_others_name_the_lines(capfd):
    without_lines()
    for command in ("certify", "throw --x 20 --side 0", "audit", "margin"):
        err = refusal(capfd, f"{command} chamfered.toml")
        assert "the part cannot rest on side 3" in err
        assert "add landing = true and roll = true to [effects]" in err


@pytest.mark.sweep
def test_with_the_lines_all_of_them_go(capfd):
    written_chamfer(goal={"stays_on_arm": True})
    for kind in ("part", "limit-set", "map", "basins", "morse", "flight"):
        prints(capfd, "plot chamfered.toml", kind, "-o", f"{kind}.png", "--cells", "256")
    titles = [axes.get_title() for axes in ls.plot.map(ls.load("chamfered.toml")).axes]
    assert titles[3] == "on side 3: no part rests there"
    code, out, _ = run(capfd, "throw chamfered.toml --x 20 --side 0 --count 50 --json")
    sides = {row["side"] for row in json.loads(out)}
    assert code == 0
    assert sides == {0, 1, 2, 4}
    out = prints(capfd, "audit chamfered.toml --json")
    assert 3 not in {row["side"] for row in json.loads(out)}
    assert all("3" not in row["ranges"] for row in json.loads(out))
    assert "tips over on side 3" in refusal(capfd, "throw chamfered.toml --x 20 --side 3")


# ----------------------------------------------------------------
# Scenes that scatter their throws: each door says whether its answer has the scatter, and proposes what runs.


LAWS = ("bounded", "gaussian")
WITHOUT = "of the scene without its scatter"

# A latch of 2 mm steel with a weight: parts leave the arm towards the joint from one start in ten.
LATCH = tomllib.loads("""
name = "latch"
part.vertices = [["0 mm", "0 mm"], ["120 mm", "0 mm"], ["140 mm", "60 mm"], ["25 mm", "85 mm"]]
part.mass.plate_density = "7850 kg/m^3"
part.mass.plate_thickness = "2 mm"
part.mass.points = [{ x = "100 mm", y = "12 mm", mass = "45 g" }]
arm = { surface_height = "-12 mm", length = "650 mm" }
throw.speed = "38 rpm"
gravity.acceleration = "9.81 m/s^2"
goal.oriented_beyond = { x = "443 mm", side = 0 }
world.scatter = { speed = "0.4 %", landing = "1 mm" }
""")


def scattering(law, scene="paper-designed"):
    """Give a built-in scene whose throws scatter."""
    world = {"scatter": {"speed": "0.1 %", "landing": "0.01 in"}}
    return ls.load(ls.load(scene).as_dict() | {"world": world, "effects": {"spread": law}})


def latch(law):
    """Write the latch; without a law its scatter is a fact only."""
    return written(LATCH, f"{law or 'plain'}.toml", **({"effects": {"spread": law}} if law else {}))


@pytest.mark.parametrize("law", LAWS)
def test_a_margin_of_a_scene_that_scatters_is_that_of_the_scene_without_its_scatter(capfd, law):
    """Bounded scatter was refused, and normal scatter gave 0 because "there is no such part or throw"."""
    (plain,) = ls.margin("paper-designed", "throw.speed", width=0.1)
    (found,) = ls.margin(scattering(law), "throw.speed", width=0.1)
    assert (found.proved, found.refuted) == (plain.proved, plain.refuted)
    assert found.model.left_out == ("scatter",)
    # proved of another scene than the one that was asked about
    out = prints(capfd, f"margin {written(scattering(law))} throw.speed --width 0.1", code=1)
    assert WITHOUT in out.splitlines()[0]
    (row,) = (line.split() for line in out.splitlines() if line.startswith(" throw.speed"))
    proved, refuted = (float(word) for word in row if re.fullmatch(r"[0-9.]+", word))
    assert proved < 0.733 < refuted  # the margin of the minimal model, in percent


def test_a_margin_names_an_effect_of_which_nothing_is_proved():
    """The reason was "there is no such part or throw", and `certify`, which refuses, was proposed."""
    world = {"friction": 0.9, "restitution": 0.3, "bounce_threshold": "1 mm"}
    tree = ls.load("paper-designed").as_dict() | {"world": world, "effects": {"bounce": True}}
    with pytest.raises(AnswerError, match="bounce"):
        ls.margin(ls.load(tree))


def proposes_what_runs(out, law):
    (line,) = [each for each in out.splitlines() if each.startswith("next: ")] or [""]
    assert ("limitsets certify" in line) <= (law == "bounded")
    # not every start stays on the arm, so that all margins are 0
    assert "limitsets margin" not in line


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("command", ["certify --no-recheck", "margin"])
def test_a_proposed_command_answers_or_is_not_proposed(capfd, law, command):
    """`certify` proposed `margin`, which refused; `margin` proposed `certify`, which refuses normal scatter."""
    proposes_what_runs(run(capfd, f"{command} {latch(law)}")[1], law)


def test_noise_that_covers_the_scatter_does_not_break_its_assumption(capfd):
    """Of the proof that has the scatter as noise the last line counted `spread` among the broken assumptions."""
    noise = "--noise", "throw.speed=0.4 %", "--noise", "landing.x=1 mm", "--no-recheck"
    last = run(capfd, "certify", latch(None), *noise)[1].splitlines()[-1]
    effect = run(capfd, "certify", latch("bounded"), "--no-recheck")[1].splitlines()[-1]
    assert last.replace("minimal model", "model with spread").replace("plain.toml", "bounded.toml") == effect
    assert "spread" in run(capfd, "certify", latch(None), "--no-recheck")[1].splitlines()[-1]


@pytest.mark.sweep
def test_a_sampled_limit_set_is_said_to_be_without_scatter(capfd):
    """`analyse` said that no part gets beyond 443 mm; with the scatter most parts do, in some hundred throws."""
    _, out, _ = run(capfd, "analyse", latch("gaussian"), "-o", "found")
    assert "limit set 0, of throws without scatter: from 90.7 % of all starts" in out
    assert "but without scatter no part gets there: the limit set ends at x = 441.826 mm" in out
    page = Path("found/report.md").read_text(encoding="utf-8")
    assert "(sampled, not proved): without scatter no part gets there" in page
    proposes_what_runs(out, "gaussian")
    _, out, _ = run(capfd, "analyse", latch(None), "--cells", "256", "-o", "plain")
    assert "without scatter" not in out
    proposes_what_runs(
        run(capfd, "analyse", latch("bounded"), "--cells", "256", "-o", "bounded")[1], "bounded"
    )


def test_feed_says_what_ends_a_part_and_how_throws_scatter(capfd):
    """Parts whose throw acts beyond the end were counted as fed or off the arm; the law was not printed."""
    world = {"scatter": {"speed": "0.5 %", "landing": "0.02 in"}, "throw_rate": "2 Hz"}
    file = written(with_cavity(), world=world, effects={"spread": "gaussian"})
    _, out, _ = run(capfd, f"feed {file} --trials 2000 --no-level --no-proof")
    assert "or comes to lie where its throw acts beyond the end: " in out
    assert "speed: normal, standard deviation 0.5 %; landing: normal, standard deviation 0.02 in" in out


def test_a_deviation_without_its_unit_is_told_of_percent(capfd):
    """Only units of a speed were allowed, of which nobody gives the scatter."""
    _, _, err = run(capfd, "feed paper-designed --scatter throw.speed=0.4")
    assert '"<decimal number> %" or an angular speed' in err
    _, _, err = run(capfd, "certify paper-designed --noise landing.x=1")
    assert "%" not in err  # a share of a landing means nothing
