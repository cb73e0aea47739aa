"""`limitsets tray`: words, JSON as docs/json.md has it, files, errors."""

import csv
import json
import re
from pathlib import Path

import pytest

import limitsets as ls
from tests.cli.command import documented, json_of, names_in, prints, refusal
from tests.trays.scenes import with_tray

pytest.importorskip("pymunk")

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "json.md").read_text(encoding="utf-8")
FEW = ("--drops", "80", "--kicks", "20", "--passes", "12")


@pytest.fixture(autouse=True)
def _scene(here):
    ls.dump(with_tray(), "tray.toml")


def test_words_files_and_table(capfd):
    out = prints(capfd, "tray tray.toml", *FEW, "--histories", "2", "-o", "out", "--csv", "filled.csv")
    for words in (
        "depressions 7.02 in wide and 1.53 in deep, side 2 is right; unilateral contact, friction 0.3, restitution 0.3",
        "side 2: right",
        "filled rightly after 12 passes",
        "p_release/(p_capture + p_release)",
        "2 histories with parts that return",
    ):
        assert words in out
    assert names_in("out") == {"tray.json", "tray.png"}
    rows = list(csv.reader(Path("filled.csv").read_text().splitlines()))
    assert rows[0] == ["passes", "filled rightly", "95 % interval low", "95 % interval high"]
    assert [int(row[0]) for row in rows[1:]] == list(range(13))
    record = json.loads(Path("out/tray.json").read_text())
    assert [float(row[1]) for row in rows[1:]] == record["filled"]["right"]


def test_json_has_the_keys_of_the_page(capfd):
    record = json_of(capfd, "tray tray.toml", *FEW, "--histories", "1", "--seed", "3")
    assert set(record) == documented("tray")
    assert record["seed"] == 3
    assert record["arrivals"]["of"] + record["unfinished"] >= 80
    assert set(record["filled"]["last"]) == set(record["arrivals"]["counts"])
    assert sum(record["filled"]["last"].values()) == pytest.approx(1.0)
    assert [each["returning"] for each in record["histories"]] == [False, True]


def test_many_parts_at_once(capfd):
    words = ("--parts", "3", "--depressions", "2", "--batches", "2", "--file", "kept.json")
    out = prints(capfd, "tray tray.toml", *FEW, "--passes", "3", *words, "-o", "out", "--csv", "f.csv")
    for words in ("3 parts at once over 2 depressions, after 3 passes", "pushing", "passing through"):
        assert words in out
    assert "by the chain, of as many parts one by one" in out
    record = json.loads(Path("out/tray.json").read_text())
    assert [each["between"] for each in record["crowds"]] == [True, False]
    row = PAGE.split("## tray\n", 1)[1].split("| `crowds` |", 1)[1].split("\n", 1)[0]
    keys = re.search(r"`\{([^}]*seconds_per_part_and_pass)\}`", row)[1]
    for each in record["crowds"]:
        assert set(each) == set(keys.split(", "))
        for name in ("right", "covered", "wrong"):
            assert len(each[name]["value"]) == len(each[name]["interval"]) == 4
    assert set(record["crowd_chain"]) == set(record["filled"])
    rows = list(csv.DictReader(Path("f.csv").read_text().splitlines()))
    for name, each in zip(("pushing", "passing through"), record["crowds"], strict=True):
        shares = [float(row[f"filled rightly, {name}"]) for row in rows]
        assert shares == pytest.approx(each["right"]["value"])
        lows = [float(row[f"95 % interval, {name} low"]) for row in rows]
        assert lows == pytest.approx([low for low, _ in each["right"]["interval"]])
    # the same command goes on from the file: nothing is left to do
    assert len(json.loads(Path("kept.json").read_text())["trials"]) == 2


def test_one_clear_error(capfd):
    assert "add [tray]" in refusal(capfd, "tray paper-designed", *FEW)
    assert "side wanted" in refusal(capfd, "tray tray.toml --side 7", *FEW)
