"""`--laid SIDE=LO:HI` on the commands whose answers depend on starts."""

import json
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from tests.cli.command import run
from tests.feeding.own_throws import thrown
from tests.feeding.scenes import with_cavity
from tests.lead_triangle import left_by_some


def test_certify_exits_with_0_where_all_that_is_laid_down_is_proved(capfd):
    ls.dump(ls.load(left_by_some()), "left.toml")
    assert run(capfd, "certify", "left.toml", "--claim", "goal")[0] == 1
    scene = ls.load("left.toml")
    words = "--laid", f"2={0.4 * scene.arm_length}:{0.5 * scene.arm_length}"
    code, out, _ = run(capfd, "certify", "left.toml", *words, "--json")
    (record,) = json.loads(out)
    assert (code, record["verdict"], list(record["starts"])) == (0, "proved", ["within"])
    assert record["laid"] == record["starts"]["within"]
    code, out, _ = run(capfd, "recheck", "left.proof.zip")
    assert (code, out.splitlines()[-1]) == (0, "PROVED")


def test_certify_says_where_parts_are_laid_down(capfd):
    code, out, _ = run(capfd, "certify", "paper-designed", "--laid", "0=8:20", "--laid", "2=12:40 cm")
    assert code == 0
    assert "x = 8 to 20 in on side 0, x = 4.72441 to 15.748 in on side 2" in out
    assert "attracts-all" not in out


@pytest.mark.parametrize(
    ("word", "said"),
    [
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
    ],
)
@pytest.mark.parametrize("command", ["certify", "margin", "robustness", "feed"])
def test_bad_ranges_are_refused_in_a_line(capfd, command, word, said):
    scene = "paper-designed"
    if command == "feed":
        scene = "fed.toml"
        ls.dump(with_cavity(), scene)
    code, out, err = run(capfd, command, scene, "--laid", word)
    assert (code, out) == (2, "")
    assert said in err
    assert len(err.splitlines()) == 1


def test_critical_points_have_no_starts(capfd):
    code, _, err = run(capfd, "design", "paper-designed", "--critical-points", "10,10,20", "--laid", "0=8:9")
    assert code == 2
    assert "critical points have no starts" in err


def test_a_design_is_asked_for_what_is_laid_down_alone(capfd):
    """Of the whole arm no throw of 60 is proved: from some starts parts leave; of 120 to 150 mm on side 2 one is."""
    ls.dump(ls.load(left_by_some()).with_values({"throw.kappa": "300 mm"}), "left.toml")
    words = "left.toml", "--goal", "--vary", "throw.kappa", "--evaluations", "60", "--json"
    code, out, _ = run(capfd, "design", *words)
    assert (code, json.loads(out)["verdict"]) == (1, "undecided")
    laid = "--laid", "2=120:150"
    code, out, _ = run(capfd, "design", *words, *laid, "-o", "found.toml")
    record = json.loads(out)
    assert (code, record["verdict"]) == (0, "proved")
    assert record["room"] > 0.0 >= record["room_before"]
    assert run(capfd, "certify", "found.toml", "--claim", "goal", *laid)[0] == 0
    assert run(capfd, "recheck", "found.proof.zip")[0] == 0
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
    ls.dump(with_cavity(), "fed.toml")
    words = "--laid", "0=6:14", "--trials", "50", "--certificate", "fed.proof.zip"
    code, out, _ = run(capfd, "feed", "fed.toml", *words)
    assert code == 0
    assert "where parts are laid down: x = 6 to 14 in on side 0" in out
    assert "no start that is laid down feeds another side than 2" in out
    assert "every start that is laid down is fed within" in out
    assert Path("fed.proof.zip").exists()
    code, _, err = run(capfd, "feed", "fed.toml", "--laid", "0=6:21")
    assert code == 2
    assert "up to the end of the arm, 20 in" in err
