"""What the paper's experimenters counted stands in no answer about a user's own scenes, through any door."""

import json
import re

import pytest

import limitsets as ls
from limitsets.base.files import as_json
from limitsets.feeder.scattering import Gaussian, Scattering
from tests.assembly.pairs import both_own
from tests.cli.command import run
from tests.feeding.scenes import with_cavity

THEIRS = re.compile(r"\bpaper\b|\b(19|17|11) of( the)? 20\b", re.IGNORECASE)
NOISE = Scattering(speed=Gaussian(0.005))


def said_by(figure):
    """Every text of a figure, legends and notes too."""
    from matplotlib.text import Text

    return " ".join(each.get_text() for each in figure.findobj(Text))


def clean(words, *names):
    for name in names:
        words = words.replace(name, "own")
    assert not THEIRS.search(words), THEIRS.search(words)
    return words


def test_feeding(capfd, tmp_path):
    tree = {**with_cavity().as_dict(), "name": "own"}
    scene = ls.load(tree)
    found = ls.feed(scene, NOISE, trials=40, prove=False)
    words = [as_json(found), said_by(ls.plot.feeding(found)), *(str(table) for table in found.tables())]
    clean(" ".join(words))
    assert "assumed" in said_by(ls.plot.feeding(found))
    ls.dump(scene, tmp_path / "own.toml")
    flags = ("--trials", "40", "--no-proof", "--scatter", "throw.speed=0.5 %")
    _, out, err = run(capfd, "feed", str(tmp_path / "own.toml"), *flags, "-o", str(tmp_path / "out"))
    clean(out + err + (tmp_path / "out" / "feeding.json").read_text(), str(tmp_path))
    assert "assumed: " in out


@pytest.mark.parametrize("contact", [False, True])
def test_assembly(capfd, tmp_path, contact):
    if contact:
        pytest.importorskip("pymunk")
    one, two = both_own(contact=contact)
    found = ls.assemble(one, two, NOISE, trials=3)
    assert (
        json.loads(as_json(found))["carried"] is contact
    )  # the cavity is part of the arm unless asked otherwise
    clean(" ".join([as_json(found), said_by(ls.plot.assembly(found)), str(found.table())]))
    for name, each in (("one", one), ("two", two)):
        ls.dump(each, tmp_path / f"{name}.toml")
    files = (str(tmp_path / "one.toml"), str(tmp_path / "two.toml"))
    code, out, err = run(capfd, "assemble", *files, "--trials", "3", "-o", str(tmp_path / "out"))
    assert code == 0
    clean(out + err + (tmp_path / "out" / "assembly.json").read_text(), str(tmp_path))
    if contact:
        assert "the cavity is thrown too" in out
        _, out, _ = run(capfd, "assemble", *files, "--trials", "1", "--standing")
        assert "the cavity stands" in out
