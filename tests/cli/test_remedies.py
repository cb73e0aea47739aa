"""What commands say of what they do not use, do not find, or cannot take."""

from pathlib import Path

import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from tests.cli.command import run
from tests.feeding.scenes import with_cavity

SCATTER = {"speed": "0.3 %", "landing": "0.02 in"}
QUICK = ("--no-proof", "--trials", "20")


def noisy(**tables):
    ls.dump(with_cavity("paper-designed", tables={"world": {"scatter": SCATTER}, **tables}), "noisy.toml")
    return "noisy.toml"


def test_feed_says_in_its_first_line_that_the_scatter_is_not_used(capfd):
    _, out, _ = run(capfd, "feed", noisy(), *QUICK)
    assert "[world] scatter is not used" in out.splitlines()[0]
    assert "--scatter" in out.splitlines()[0]
    _, _, err = run(capfd, "feed", noisy(), *QUICK, "--json")
    assert "[world] scatter is not used" in err
    words = ("--scatter", "throw.speed=0.3 %", "--no-level")
    _, out, _ = run(capfd, "feed", noisy(), *QUICK, *words)
    assert "not used" not in out
    _, out, _ = run(capfd, "feed", noisy(effects={"spread": "gaussian"}), *QUICK, "--no-level")
    assert "not used" not in out


def test_the_levels_of_the_noise_can_be_left_out(capfd):
    scene = noisy(effects={"spread": "gaussian"})
    assert "times the noise" in run(capfd, "feed", scene, *QUICK)[1]
    code, out, _ = run(capfd, "feed", scene, *QUICK, "--no-level")
    assert code == 0
    assert "times the noise" not in out


def test_the_cavities_of_two_scenes_are_told_in_words():
    one = with_cavity("paper-designed")
    two = ls.load(one.as_dict() | {"cavity": one.as_dict()["cavity"] | {"width": "9.4 in"}})
    with pytest.raises(LimitsetsError) as caught:
        ls.assemble(one, two, trials=1)
    assert "Cavity(" not in str(caught.value)
    for scene in (one, two):
        assert ", ".join(f"{key} {text}" for key, text in scene.text["cavity"].items()) in str(caught.value)
    fast = one.with_values({"throw.kappa": "20 in"})
    with pytest.raises(LimitsetsError, match=r"25\.3778518 in and 20 in"):
        ls.assemble(one, fast, trials=1)


@pytest.mark.parametrize(("name", "file"), [("mine", "mine.proof.zip"), ("mine.zip", "mine.zip")])
def test_a_certificate_without_an_ending_gets_one(capfd, name, file):
    _, out, _ = run(capfd, "certify", "paper-designed", "--claim", "invariant", "-o", name)
    assert f"{file}" in out
    assert [path.name for path in Path().glob("mine*")] == [file]


def test_where_there_is_no_policy_the_next_thing_is_told(capfd):
    tree = ls.load("paper-initial").as_dict()
    throws = [{"name": "own", **tree["throw"]}]
    tree["feedback"] = {"sensor": {"beyond": "20 in"}, "throws": throws}
    ls.dump(ls.load(tree), "one.toml")
    words = ("--starts", "2=17:18", "--cells", "64", "--throws", "1")
    code, out, _ = run(capfd, "feedback", "one.toml", *words)
    assert code == 1
    assert "not with 1 throws on these cells" in out
    assert "next: more --throws or --cells, --sweep LO:HI:N for another place of the sensor" in out


def test_analyse_tells_what_is_improbable(capfd):
    ls.dump(ls.load("paper-designed").with_values({"throw.speed": "160 rpm"}), "fast.toml")
    _, out, _ = run(capfd, "analyse", "fast.toml", "--cells", "64")
    assert "throw.speed: careful, '160 rpm'" in out
    _, out, err = run(capfd, "analyse", "fast.toml", "--cells", "64", "--json")
    assert "throw.speed: careful, '160 rpm'" in err
    assert "careful" not in run(capfd, "analyse", "paper-designed", "--cells", "64")[1].replace(
        "careful: of", ""
    )
