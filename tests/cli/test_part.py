"""`limitsets part`, and `limitsets new --from` a drawing."""

import re
import tomllib
from pathlib import Path

import pytest

import limitsets as ls
from limitsets.face import report
from limitsets.feeder.scene.checking import examined
from tests.cli.command import DOCS, both, documented, json_of, names_in, prints, refusal
from tests.plates import bracket

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="50mm" viewBox="0 0 80 50">
<path d="M0 50 L80 50 L80 20 L30 20 L30 0 L0 0 Z"/> <circle cx="15" cy="30" r="4"/> <text>M8</text>
</svg>"""


def test_the_sides_of_a_part_as_table_figure_and_json(capfd):
    ls.dump(ls.load(bracket()), "bracket.toml")
    text, record = both(capfd, "part bracket.toml")
    assert names_in() == {"bracket.toml", "bracket-sides.png"}
    assert set(record) == documented("part")
    assert [side["over_left"] for side in record["sides"]] == [1, 2, 3, 4, 0]
    assert "1.26" in text
    prints(capfd, "part bracket.toml --tolerance part.vertices[7].x='0.5 mm' -o sides.svg --csv sides.csv")
    assert Path("sides.svg").read_bytes().startswith(b"<?xml")
    heads = Path("sides.csv").read_text(encoding="utf-8").splitlines()[0]
    assert heads.startswith("side,length low [mm],length high [mm],")
    assert "ends in .png, .svg, .pdf" in refusal(capfd, "part bracket.toml -o sides.txt")
    assert "a quantity that the scene gives" in refusal(
        capfd, "part bracket.toml --tolerance part.sides[0]='1 mm'"
    )


def test_a_drawing_becomes_a_scene_and_a_picture(capfd):
    pytest.importorskip("svgelements")
    Path("plate.svg").write_text(SVG, encoding="utf-8")
    text, record = both(capfd, "new own.toml --from plate.svg --material steel --thickness '2 mm'", code=None)
    assert names_in() == {"plate.svg", "own.toml", "own.png"}
    assert "80 x 50 mm" in text
    assert "left out: 1 text" in text
    assert set(record) == documented("new")
    scene = ls.load("own.toml")
    assert examined("own.toml") == ((), ())
    assert (scene.unit, len(scene.outline), len(scene.holes)) == ("mm", 6, 1)
    assert len(scene.vertices) == 5
    assert scene.text["part"]["mass"] == {"plate_density": "7850 kg/m^3", "plate_thickness": "2 mm"}
    area, disc = 80 * 30 + 30 * 20, 3.141592653589793 * 16
    assert scene.centre[0] == pytest.approx((2400 * 40 + 600 * 15 - disc * 15) / (area - disc), rel=1e-9)
    # the feeder has the proportions of the paper's: the arm four times as long as the part
    assert scene.arm_length == pytest.approx(28 / 6.75 * 80, rel=0.05)
    before = Path("own.toml").read_bytes()
    refusal(capfd, "new own.toml --from plate.svg")
    assert Path("own.toml").read_bytes() == before


def test_the_tutorial_s_commands_say_what_it_says(capfd):
    """The page's drawing, commands and goal, but for the report, the margin and the films, which other tests have."""
    pytest.importorskip("svgelements")
    page = (DOCS / "my_drawing.md").read_text(encoding="utf-8")
    drawing, proposed = re.findall(r"```text\n(.*?)```", page, re.S)
    Path("plate.svg").write_text(drawing, encoding="utf-8")
    commands = dict(re.findall(r"^limitsets ((\w+) .*)$", page, re.M)[::-1])
    commands = {name: line for line, name in commands.items()}
    assert "an outline with 4 vertices and 1 hole, 90 x 40 mm, 2746.06 mm^2" in page
    assert "an outline with 4 vertices and 1 hole, 90 x 40 mm, 2746.06 mm^2" in prints(capfd, commands["new"])
    assert "11.80" in prints(capfd, commands["part"])
    analysis = ls.analyse("plate.toml", 512)
    assert report.pages.choice_of(analysis) == [proposed.strip()]
    text = Path("plate.toml").read_text(encoding="utf-8")
    goal = re.findall(r"```toml\n(.*?)```", page, re.S)[0]
    Path("plate.toml").write_text(text.replace("# [goal]\n", goal, 1), encoding="utf-8")
    assert "goal: PROVED\n" in prints(capfd, commands["certify"])
    laid = {0: [("60 mm", "300 mm")]}
    (claim,) = ls.certify("plate.toml", ["goal"], tolerance={"throw.speed": "5.2 %"}, laid=laid).claims
    assert claim.verdict == "proved"
    assert "up to 5.2 % and 16.6 mm" in page


def test_a_drawing_in_pixels_needs_its_unit(capfd):
    pytest.importorskip("svgelements")
    Path("plate.svg").write_text(SVG.replace('80mm"', '80"').replace('50mm"', '50"'), encoding="utf-8")
    assert "--unit" in refusal(capfd, "new own.toml --from plate.svg")
    assert names_in() == {"plate.svg"}
    record = json_of(capfd, "new own.toml --from plate.svg --unit in")
    assert (record["unit"], record["extent"]) == ("in", [80.0, 50.0])
    tree = tomllib.loads(Path("own.toml").read_text(encoding="utf-8"))
    assert tree["part"]["mass"] == {"plate_density": "1 kg/m^2"}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("new own.toml --material steel", "beside --from"),
        ("new own.toml --scale '1 mm'", "beside --from"),
        ("new own.toml --from plate.svg --material cheese", "steel, stainless steel, aluminium"),
        ("new own.toml --from plate.svg --material steel --density '2 kg/m^2'", "leave one of the two out"),
        ("new own.toml --from plate.svg --material steel", "plate_thickness"),
        ("new own.toml --from none.svg", "No such file"),
        ("new own.toml --from plate.svg --layer cut", "layer"),
    ],
)
def test_what_cannot_be_read_is_refused_in_a_line_and_writes_nothing(capfd, line, words):
    pytest.importorskip("svgelements")
    Path("plate.svg").write_text(SVG, encoding="utf-8")
    assert words in refusal(capfd, line)
    assert names_in() == {"plate.svg"}
