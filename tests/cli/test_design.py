"""`design` and `fit` at the command line."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.face.cli.arguments import bounds_of
from tests.cli.command import both, documented, json_of, names_in, prints, refusal, run, written
from tests.fitting.machines import ABOVE, ALONG, HEIGHT, RADIUS, farthest, film

# ----------------------------------------------------------------
# `limitsets design`: words, JSON, files, exit codes.


VARY = "part.mass.center.along,part.mass.center.above,throw.speed"


def points_of(scene):
    return [points[0].x for points in ls.critical_points(scene.map, scene.domain).values()]


def test_words_and_a_scene_that_loads_again(capfd):
    out = prints(capfd, "design paper-initial --critical-points 10,10,20 --vary", VARY)
    assert "Reached: every critical point wanted" in out
    assert "condition number of the derivatives: 7.066" in out
    lines = {line.split()[0]: line for line in out.splitlines() if line.strip()[:2] in ("pa", "r_")}
    assert lines["r_0"].rpartition(")")[2].split()[-5:][:2] == ["19.9999992", "10"]
    assert lines["part.mass.center.along"].split()[1] == "3.9867006"
    Path("printed.toml").write_text(out[out.index('name = "') :], encoding="utf-8")
    assert points_of(ls.load("printed.toml")) == pytest.approx([10, 10, 20], abs=1e-9)
    assert names_in() == {"printed.toml"}


def test_a_file_and_a_folder(capfd):
    words = ("design", "paper-initial", "--critical-points", "25.4 cm,10 in,20", "--vary", VARY)
    out = prints(capfd, *words, "-o", "found.toml")
    assert out.splitlines()[-1] == "scene: found.toml"
    assert points_of(ls.load("found.toml")) == pytest.approx([10, 10, 20], abs=1e-9)
    record = json_of(capfd, *words, "--stages", "2", "-o", "deep/found")
    folder = Path("deep/found")
    assert names_in(folder) == {"paper-initial-design.toml", "design.json", "design.png", "part.png"}
    assert record == json.loads((folder / "design.json").read_text(encoding="utf-8"))
    assert set(record) == documented("design --critical-points")
    assert record["reached"] is True
    assert record["targets"] == [10, 10, 20]
    assert len(record["path"]) == 3
    assert ls.load(record["scene"]) == ls.load(folder / "paper-initial-design.toml")
    assert (folder / "design.png").read_bytes().startswith(b"\x89PNG")


def test_not_reached_is_exit_1_and_a_near_miss_that_is_written_is_said_to_be_one(capfd):
    words = ("--critical-points", "10,free,20", "--vary", "throw.speed", "--starts", "0")
    near = ("design paper-initial", *words, "--bounds", "throw.speed=:'150 deg/s'")
    out = prints(capfd, *near, "-o", "found.toml", code=1)
    assert out.splitlines()[-1] == "scene: found.toml (the nearest miss, no answer)"
    out = prints(capfd, *near, code=1)
    assert "Not reached: the nearest found misses by" in out
    assert "name = " not in out
    assert "nearest miss, no answer; add -o FILE.toml" in out
    assert "1 varied for 2 wanted: least squares; throw.speed is at its upper bound" in out
    (free,) = [line for line in out.splitlines() if line.strip().startswith("r_1 ")]
    assert free.split()[-2:] == ["-", "-"]  # wanted nowhere, off by nothing


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("no-such-scene --critical-points 10,10,20", ""),
        ("paper-initial --critical-points 10,10", ""),
        ("paper-initial --critical-points 10,ten,20", ""),
        ("paper-initial --critical-points 10,10,20 --vary speed", ""),
        ("paper-initial --critical-points 10,10,20 --bounds throw.speed=3", ""),
        ("paper-initial --critical-points 10,10,20 -o taken/deeper", ""),
        ("paper-initial --critical-points 10,10,20 -o taken.toml/found.toml", ""),
        ("paper-initial", "give one of them"),
        ("paper-designed --robust --critical-points 10,10,20", "give one of them"),
        ("paper-designed --robust --bounds 'arm.length=20 in'", "QUANTITY=LOWEST:HIGHEST"),
        ("paper-designed --robust --bounds 'arm.length=:20 in'", "a lower and a higher one"),
        ("paper-designed --robust --vary arm.legnth", "arm.length"),
    ],
)
def test_bad_input_is_exit_2(capfd, words, said):
    Path("taken").write_text("a file")
    Path("taken.toml").write_text("a file")
    vary = () if "--robust" in words or "--vary" in words else ("--vary", VARY)
    assert said in refusal(capfd, f"design {words}", *vary)


def test_bare_bounds_are_in_the_unit_of_the_scenes_text():
    scene = ls.load("paper-initial").with_values({"throw.speed": "158 deg/s"})
    found = bounds_of(scene, ["throw.speed=150:160", "arm.length=25:", "part.mass.center.along=4 in:0.2 m"])
    assert found == {
        "throw.speed": pytest.approx((math.radians(150), math.radians(160)), rel=1e-15),
        "arm.length": (25.0, None),
        "part.mass.center.along": (4.0, pytest.approx(0.2 / 0.0254, rel=1e-15)),
    }


@pytest.mark.parametrize("word", ["throw.speed=160:150", "arm.length=28 in:0.7 m", "arm.length=28:28"])
def test_bounds_that_are_turned_round_are_refused(word):
    with pytest.raises(LimitsetsError, match="a lower and a higher one"):
        bounds_of(ls.load("paper-initial"), [word])


# ----------------------------------------------------------------
# `limitsets design --robust`: search without proof, its files, and what it refuses.


FEW = "--evaluations 4 --vary part.mass.center.along,throw.kappa --seconds 0"


@pytest.mark.sweep
def test_a_search_writes_scene_answer_and_figure(here, capfd):
    given = written(tolerance={"throw.speed": "1 %"})
    record = json_of(capfd, f"design {given} --robust {FEW} --out found")
    assert record["margins"] == []
    assert names_in("found") == {"paper-designed-robust.toml", "design.json", "front.png", "part.png"}
    kept = json.loads(Path("found/design.json").read_text(encoding="utf-8"))
    assert isinstance(kept["model"]["assumptions_broken"], int)  # as it is printed
    assert kept["model"] == record["model"]
    again = ls.load(Path("found") / "paper-designed-robust.toml")
    assert again.value("throw.kappa") == record["values"]["throw.kappa"]


@pytest.mark.sweep
def test_the_scene_alone(capfd):
    given = written(tolerance={"throw.speed": "1 %"})
    out = prints(capfd, f"design {given} --robust {FEW} -o found.toml")
    assert out.splitlines()[-1] == "scene: found.toml"
    assert names_in() == {given, "found.toml"}
    assert ls.load("found.toml").value("throw.kappa") > 0


def test_where_nothing_is_found_the_nearest_miss_is_written(capfd):
    line = "design paper-designed --robust --bounds part.mass.center.along=0.1:0.2 --evaluations 6"
    out, printed = both(capfd, line, "-o", "missed", "--csv", "missed.csv", code=1)
    assert "nearest miss" in out
    assert "none that feeds among" in out
    assert out.splitlines()[-1] == "scene: missed/paper-designed-robust.toml (the nearest miss, no answer)"
    record = json.loads(Path("missed/design.json").read_text(encoding="utf-8"))
    assert sum(record["ruled_out"].values()) == record["evaluations"]
    assert ls.load(record["scene"]) == ls.load("missed/paper-designed-robust.toml")
    assert set(printed) == set(record)
    assert "nearest miss" in Path("missed.csv").read_text(encoding="utf-8")


# ----------------------------------------------------------------
# `limitsets fit`: words, JSON as docs/json.md has it, files, exit codes.


TRUTH = {"throw.kappa": 25.6, ALONG: 4.25, ABOVE: 0.69, HEIGHT: -0.21, RADIUS: 1.25}


@pytest.fixture
def throws():
    """A film in a file, in mm."""
    made = film(np.random.default_rng(31), TRUTH, flipped=0.04)
    lines = ["x_before [mm],side_before,x_after [mm],side_after"]
    columns = (made.x_before * 25.4, made.side_before, made.x_after * 25.4, made.side_after)
    lines += [f"{x!r},{i},{y!r},{j}" for x, i, y, j in zip(*(each.tolist() for each in columns), strict=True)]
    Path("throws.csv").write_text("\n".join(lines), encoding="utf-8")


def test_a_table_and_files_and_the_keys_of_the_docs(capfd, throws):
    line = "fit paper-designed throws.csv --error '0.508 mm' --no-margin -o out --csv t.csv"
    out, record = both(capfd, line)
    assert set(record) == documented("fit")
    assert record["unit"] == "in"
    assert record["error"] == 0.02
    assert record["throws"] == len(record["residuals"]) == 50
    assert set(record["quantities"]["throw.speed"]) == {"value", "lo", "hi", "unit", "bounded"}
    assert set(record["scatter"]["landing.x"]) == {"value", "lo", "hi", "at_most"}
    assert set(record["misread_rate"]) == {"value", "lo", "hi"}
    assert set(record["misfit"]) == {"p", "outliers", "structure", "lacking", "rows"}
    assert {"x", "side", "gain", "shrinks"} == set(record["further"][0])
    assert set(record["residuals"][0]) == {"row", "side", "side_after", "residual", "deviation"}
    for each in record["misread"]:
        assert set(each) == {"row", "column", "recorded", "fits"}
    assert ls.load(record["scene"]).goal == ls.load("paper-designed").goal
    assert record["enough"] is None
    assert names_in("out") == {"fitted.toml", "fit.json", "part.png", "residuals.png"}
    rows = list(csv.DictReader(Path("t.csv").read_text(encoding="utf-8").splitlines()))
    speed = rows[0]
    assert speed["quantity"] == "throw.speed"
    wanted = np.sqrt(193.045 / TRUTH["throw.kappa"])
    assert float(speed["95 % interval low"]) < wanted < float(speed["95 % interval high"])
    assert "film next: throws from x = " in out
    assert "is recorded as" in out
    again = ls.load("out/fitted.toml")
    assert again.value("throw.speed") == pytest.approx(float(speed["value"]))
    assert again.tolerance


@pytest.mark.sweep
def test_whether_the_margin_is_enough(capfd, throws):
    code, out, _ = run(capfd, "fit paper-designed throws.csv", "--error", "0.508 mm", "--json")
    record = json.loads(out)
    judged = record["enough"]
    assert set(judged) == {"verdict", "sentences", "repeats", "margins", "together", "beyond"}
    # an orbit of this very machine lies beyond 20 in on another side than 2, by other formulas as well
    machine = {name: each["value"] for name, each in record["quantities"].items()}
    machine["throw.kappa"] = 193.045 / machine.pop("throw.speed") ** 2
    assert farthest(np.random.default_rng(32), machine)[:2].max() > 20.0
    assert (code, judged["verdict"]) == (1, "not-enough")
    assert judged["margins"]["throw.speed"] == {"proved": 0.0, "refuted": 0.0}
    assert judged["sentences"][0].startswith("Without any scatter an orbit of the fitted machine violates")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("paper-designed", "none.csv"), "none.csv"),
        (("no-such-scene", "throws.csv"), "scene"),
        (("paper-designed", "throws.csv", "--error", "2 deg"), "length"),
        (("paper-designed", "throws.csv", "--error", "0"), "above 0"),
    ],
)
def test_bad_input_is_exit_2_of_fit(capfd, throws, words, said):
    assert said in refusal(capfd, "fit", *words)
