"""Scenes that scatter their throws: each door says whether its answer has the scatter, and proposes what runs."""

import re
from pathlib import Path

import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from tests.cli.command import run
from tests.feeding.scenes import with_cavity

LAWS = ("bounded", "gaussian")
WITHOUT = "of the scene without its scatter"

# A latch of 2 mm steel with a weight: parts leave the arm towards the joint from one start in ten.
LATCH = {
    "name": "latch",
    "part": {
        "vertices": [[f"{x} mm", f"{y} mm"] for x, y in ((0, 0), (120, 0), (140, 60), (25, 85))],
        "mass": {
            "plate_density": "7850 kg/m^3",
            "plate_thickness": "2 mm",
            "points": [{"x": "100 mm", "y": "12 mm", "mass": "45 g"}],
        },
    },
    "arm": {"surface_height": "-12 mm", "length": "650 mm"},
    "throw": {"speed": "38 rpm"},
    "gravity": {"acceleration": "9.81 m/s^2"},
    "goal": {"oriented_beyond": {"x": "443 mm", "side": 0}},
    "world": {"scatter": {"speed": "0.4 %", "landing": "1 mm"}},
}


def scattering(law, scene="paper-designed"):
    """Give a built-in scene whose throws scatter."""
    world = {"scatter": {"speed": "0.1 %", "landing": "0.01 in"}}
    return ls.load(ls.load(scene).as_dict() | {"world": world, "effects": {"spread": law}})


def latch(law):
    """Write the latch; without a law its scatter is a fact only."""
    name = f"{law or 'plain'}.toml"
    ls.dump(ls.load(LATCH | ({"effects": {"spread": law}} if law else {})), name)
    return name


@pytest.mark.parametrize("law", LAWS)
def test_a_margin_of_a_scene_that_scatters_is_that_of_the_scene_without_its_scatter(law):
    """Bounded scatter was refused, and normal scatter gave 0 because "there is no such part or throw"."""
    (plain,) = ls.margin("paper-designed", "throw.speed", width=0.1)
    (found,) = ls.margin(scattering(law), "throw.speed", width=0.1)
    assert (found.proved, found.refuted) == (plain.proved, plain.refuted)
    assert found.model.left_out == ("scatter",)


@pytest.mark.parametrize("law", LAWS)
def test_margin_in_the_shell_says_that_the_scatter_is_left_out(capfd, law):
    ls.dump(scattering(law), "mine.toml")
    code, out, _ = run(capfd, "margin", "mine.toml", "throw.speed", "--width", "0.1")
    assert code == 1  # proved of another scene than the one that was asked about
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


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("command", ["certify", "margin", "analyse"])
def test_a_proposed_command_answers_or_is_not_proposed(capfd, law, command):
    """`certify` proposed `margin`, which refused; `margin` proposed `certify`, which refuses normal scatter."""
    name = latch(law)
    words = [command, name, *(("--no-recheck",) if command == "certify" else ())]
    out = run(capfd, *words)[1]
    (line,) = [each for each in out.splitlines() if each.startswith("next: ")] or [""]
    assert ("limitsets certify" in line) <= (law == "bounded")
    # not every start stays on the arm, so that all margins are 0
    assert "limitsets margin" not in line


def test_noise_that_covers_the_scatter_does_not_break_its_assumption(capfd):
    """Of the proof that has the scatter as noise the last line counted `spread` among the broken assumptions."""
    noise = "--noise", "throw.speed=0.4 %", "--noise", "landing.x=1 mm", "--no-recheck"
    last = run(capfd, "certify", latch(None), *noise)[1].splitlines()[-1]
    effect = run(capfd, "certify", latch("bounded"), "--no-recheck")[1].splitlines()[-1]
    assert last.replace("minimal model", "model with spread").replace("plain.toml", "bounded.toml") == effect
    assert "spread" in run(capfd, "certify", latch(None), "--no-recheck")[1].splitlines()[-1]


def test_a_sampled_limit_set_is_said_to_be_without_scatter(capfd):
    """`analyse` said that no part gets beyond 443 mm; with the scatter most parts do, in some hundred throws."""
    _, out, _ = run(capfd, "analyse", latch("gaussian"), "-o", "found")
    assert "limit set 0, of throws without scatter: from 90.7 % of all starts" in out
    assert "but without scatter no part gets there: the limit set ends at x = 441.826 mm" in out
    assert "But without scatter no part gets there" in Path("found/report.md").read_text(encoding="utf-8")
    _, out, _ = run(capfd, "analyse", latch(None), "-o", "found")
    assert "without scatter" not in out


def test_feed_says_what_ends_a_part_and_how_throws_scatter(capfd):
    """Parts whose throw acts beyond the end were counted as fed or off the arm; the law was not printed."""
    tree = with_cavity("paper-designed").as_dict()
    world = {"scatter": {"speed": "0.5 %", "landing": "0.02 in"}, "throw_rate": "2 Hz"}
    ls.dump(ls.load(tree | {"world": world, "effects": {"spread": "gaussian"}}), "mine.toml")
    _, out, _ = run(capfd, "feed", "mine.toml", "--trials", "2000", "--no-level", "--no-proof")
    assert "or comes to lie where its throw acts beyond the end: " in out
    assert "speed: normal, standard deviation 0.5 %; landing: normal, standard deviation 0.02 in" in out


def test_a_deviation_without_its_unit_is_told_of_percent(capfd):
    """Only units of a speed were allowed, of which nobody gives the scatter."""
    _, _, err = run(capfd, "feed", "paper-designed", "--scatter", "throw.speed=0.4")
    assert '"<decimal number> %" or an angular speed' in err
    _, _, err = run(capfd, "certify", "paper-designed", "--noise", "landing.x=1")
    assert "%" not in err  # a share of a landing means nothing


def test_the_explorer_says_of_which_model_its_proofs_are():
    """The starts of the last claim stood in place of the model's sentence."""
    from limitsets.face.explorer.answers import proof_words

    model = "of the minimal model: friction of [world] is not in it"
    claim = {"claim": "goal", "verdict": "proved", "reason": "", "starts": "every", "share": 1.0, "note": ""}
    shown = proof_words([claim], [], "rested", model)
    assert model in shown
    assert "for every start" in shown
