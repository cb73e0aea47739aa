"""Every key that `--json` prints stands in docs/json.md, and no other: commands whose own tests do not ask for it."""

import json
from pathlib import Path

import pytest

import limitsets as ls
from tests.cli.command import documented, run

VARY = "part.mass.center.along,part.mass.center.above,throw.speed"
SHORT = ("--quantity", "arm.surface_height", "--seconds", "0", "--without", "noise", "--without", "audit")
IN_ITS_TEXT = ("effects", "basins", "starts", "goal", "units")


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("scenes", ()),
        ("throw", ("paper-designed", "--x", "8", "--side", "2")),
        ("plot", ("paper-designed", "part")),
        ("new", ("new.toml",)),
        ("audit", ("paper-designed",)),
        ("margin", ("paper-designed", "throw.speed", "--width", "0.2")),
        ("design --critical-points", ("paper-initial", "--critical-points", "10,10,20", "--vary", VARY)),
        ("robustness", ("paper-designed", "-o", "sheet", *SHORT)),
        ("animate", ("paper-designed", "-o", "run.html")),
    ],
)
def test_the_keys_are_those_of_the_page(capfd, section, words):
    code, out, _ = run(capfd, section.partition(" ")[0], *words, "--json")
    record = json.loads(out)
    assert code == 0
    assert set(record[0] if isinstance(record, list) else record) == documented(section)


def test_keys_of_an_analysis(capfd):
    tree = ls.load("paper-designed").as_dict()
    ls.dump(ls.load(tree), "mine.toml")
    code, out, _ = run(capfd, "analyse", "mine.toml", "--cells", "256", "--json")
    record = json.loads(out)
    assert code == 0
    assert set(record) == documented("analyse")
    page = Path(__file__).resolve().parents[2] / "docs" / "json.md"
    text = page.read_text(encoding="utf-8").split("## analyse", 1)[1].split("\n## ", 1)[0]
    inner = [
        *(record[key] for key in IN_ITS_TEXT),
        *record["attractors"],
        *record["cycles"],
        *record["spurious"],
    ]
    missing = {key for table in inner for key in table if key not in text}
    assert not missing


def test_keys_of_a_proof_and_of_its_recheck(capfd):
    code, out, _ = run(capfd, "certify", "paper-designed", "--json")
    assert code == 0
    assert set(json.loads(out)[0]) == documented("The JSON of `limitsets certify --json`", "certificates.md")
    code, out, _ = run(capfd, "recheck", "paper-designed.proof.zip", "--json")
    assert (code, set(json.loads(out))) == (0, documented("recheck"))
