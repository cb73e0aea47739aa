"""More than a hundred ways to say one thing and prove another: none of them ends in PROVED.

The certificate is right, of a scene that has the goal as its own, and says what it proves; each way changes a text, a
number, a key, the starts that are claimed, ranks or attracting cells, so that what is read, shown or claimed is another
thing than what is proved.
"""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

import limitsets as ls
from limitsets.proofs.prover.attraction import attraction, near_section
from limitsets.proofs.prover.certificate import write
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.goals.kind import throws_to_reach
from limitsets.proofs.prover.goals.reaches import _wanted
from limitsets.proofs.prover.parameters import parameter_box
from tests.proofs import forge
from tests.proofs.forge import leave_out, put
from tests.proofs.test_recheck import COARSE, checker, parts, verdict, whole
from tests.scene.four_gon import FOUR_GON


@pytest.fixture(scope="module")
def good():
    f = forge.forge("designed", **COARSE)
    f.header["boxes"][0]["scene"] |= {
        "goal": {"oriented_beyond": {"x": "20 in", "side": 2}},
        "tolerance": {"throw.speed": "1 %"},
        "world": {"friction": 0.5, "scatter": {"speed": "0 %", "landing": "0 in"}},
    }
    f.header["noise"] = {"throw.speed": "0 %"}
    return f


def test_it_is_proved_as_it_is(good, tmp_path):
    report = verdict(good, tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
    assert "x > 20 in implies side 2" in " ".join(report.statement)
    assert report.parameters["noise (at every throw)"] == "throw.speed within 0 %"


SCENE = ("boxes", 0, "scene")
GOAL = ("claims", 4, "section")
NEAR = (*GOAL, "near_joint")
PLACES = {  # every text that is shown, and what it says
    "goal": ((*GOAL, "x"), "20", "in"),
    "own goal": ((*SCENE, "goal", "oriented_beyond", "x"), "20", "in"),
    "noise": (("noise", "throw.speed"), "0", "%"),
    "kappa": ((*SCENE, "throw", "kappa"), "25.3778518", "in"),
    "arm": ((*SCENE, "arm", "length"), "28", "in"),
    "scatter": ((*SCENE, "world", "scatter", "landing"), "0", "in"),
}
TEXTS = {
    "an exponent behind many digits": lambda v, u: f"{v}.{'0' * 200}e1 {u}",
    "a unit behind many blanks": lambda v, u: f"{v}{' ' * 100}{'ft' if u == 'in' else u}",
    "two blanks": lambda v, u: f"{v}  {u}",
    "blanks before": lambda v, u: f" {v} {u}",
    "blanks after": lambda v, u: f"{v} {u} ",
    "a tab": lambda v, u: f"{v}\t{u}",
    "a line break": lambda v, u: f"{v} {u}\n",
    "another blank": lambda v, u: f"{v}\u00a0{u}",
    "other digits": lambda v, u: "".join(chr(0x660 + int(c)) if c.isdigit() else c for c in v) + f" {u}",
    "wide digits": lambda v, u: "".join(chr(0xFF10 + int(c)) if c.isdigit() else c for c in v) + f" {u}",
    "turned by a mark": lambda v, u: f"\u202e{v} {u}",
    "a letter that looks alike": lambda v, u: f"{v} {u.replace('i', chr(0x456)).replace('%', chr(0xFF05))}",
    "two units": lambda v, u: f"{v} {u} {u}",
    "out of range": lambda v, u: f"1e400 {u}",
    "a null at its end": lambda v, u: f"{v} {u}\0",
    "a number": lambda v, u: float(v),
    "a table": lambda v, u: {"value": f"{v} {u}"},
    "three ends": lambda v, u: [f"{v} {u}"] * 3,
    "nothing": lambda v, u: None,
}


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("place", PLACES)
def test_a_text_that_says_another_thing(good, tmp_path, place, text):
    f = good.copy()
    path, value, unit = PLACES[place]
    put(*path, TEXTS[text](value, unit))(f)
    report = verdict(f, tmp_path)
    assert report.verdict == "bad file"
    assert "\n" not in report.reason
    assert report.reason.isascii()


def all_of(*changes):
    def change(f):
        for each in changes:
            each(f)

    return change


def rank_of(where, value):
    """Change ranks of cells off the component, `where` of them."""

    def change(f):
        off = np.flatnonzero(f.arrays["0.component"] < 0)
        f.arrays["0.rank"][off[where]] = value

    return change


def no_attractor(rank):
    def change(f):
        f.arrays["0.component"][:] = -1
        f.arrays["0.rank"][:] = rank

    return change


def half_an_attractor(f):
    inside = np.flatnonzero(f.arrays["0.component"] >= 0)
    f.arrays["0.component"][inside[::2]] = -1
    f.arrays["0.rank"][inside[::2]] = 1


def a_second_attractor(f):
    off = np.flatnonzero(f.arrays["0.component"] < 0)
    f.arrays["0.component"][off[-5:]] = 1
    f.arrays["0.rank"][off[-5:]] = 0


def a_transient_made_attracting(f):
    rank, component = f.arrays["0.rank"], f.arrays["0.component"]
    component[rank == 1], rank[rank == 1] = component.max(), 0


OF_CELLS = (put(*GOAL, "starts", "cells"), leave_out(*NEAR))
THIN = (put(*GOAL, "starts", "almost-every"), put(*GOAL, "thinning", 50))


def from_on(x):
    """Claimed of starts from x on, on each side."""
    return all_of(put(*GOAL, "starts", {"from": dict.fromkeys("012", x.hex())}), leave_out(*NEAR))


def of_the_first_attracting(value):
    """Another rank of that cell."""
    return lambda f: f.arrays["0.rank"].__setitem__(np.argmax(f.arrays["0.component"] >= 0), value)


def scattering(key, text):
    """A scatter of the scene that is on."""
    bounded = put(*SCENE, "effects", {"spread": "bounded"})
    return all_of(bounded, put(*SCENE, "world", "scatter", key, text))


BEYOND = {str(i): (2.0).hex() for i in range(3)}
WAYS = {
    # the goal of the scene is another
    "own goal nearer": put(*SCENE, "goal", "oriented_beyond", "x", "19 in"),
    "own goal a little nearer": put(*SCENE, "goal", "oriented_beyond", "x", "19.9999999999999999999 in"),
    "own goal in another unit": put(*SCENE, "goal", "oriented_beyond", "x", "20 cm"),
    "own goal of another side": put(*SCENE, "goal", "oriented_beyond", "side", 1),
    "own goal from anywhere": put(*SCENE, "goal", "from_anywhere", True),
    "own goal of another kind": put(*SCENE, "goal", {"stays_on_arm": True}),
    "own goal reaches": put(*SCENE, "goal", {"reaches": {"x": "20 in", "side": 2}}),
    "own goals, two": put(*SCENE, "goal", "stays_on_arm", True),
    "own goal of no kind": put(*SCENE, "goal", {}),
    "own goal unknown": put(*SCENE, "goal", {"oriented_within": {"x": "20 in", "side": 2}}),
    "own goal denied": put(*SCENE, "goal", {"stays_on_arm": False}),
    "own goal with a key more": put(*SCENE, "goal", "oriented_beyond", "unless", "x > 10 in"),
    "own goal a word": put(*SCENE, "goal", "stays_on_arm"),
    "goal farther": put(*GOAL, "x", "27 in"),
    "goal a little farther": put(*GOAL, "x", "20.0000000000000000000001 in"),
    "goal in feet": put(*GOAL, "x", "20 ft"),
    "goal of a share": put(*GOAL, "x", "20 %"),
    "goal of side true": put(*GOAL, "side", True),
    "goal of side 2.0": put(*GOAL, "side", 2.0),
    "goal of side 5": put(*GOAL, "side", 5),
    "goal after no throws, said": put(*GOAL, "throws", False),
    "goal from anywhere, 1": put(*GOAL, "from_anywhere", 1),
    "goal from anywhere": put(*GOAL, "from_anywhere", True),
    "goal of a kind unknown": put(*GOAL, "kind", "Oriented_beyond"),
    # what else the scene says
    "scatter that is on": scattering("speed", "0.1 %"),
    "scatter of the landing that is on": scattering("landing", "1 mm"),
    "scatter without bounds": put(*SCENE, "effects", {"spread": "gaussian"}),
    "an effect that is on": put(*SCENE, "effects", {"roll": True}),
    "an effect that is 1": put(*SCENE, "effects", {"roll": 1}),
    "scatter of another thing": put(*SCENE, "world", "scatter", {"kappa": "1 %"}),
    "a world with more": put(*SCENE, "world", "proved", True),
    "a tolerance of nothing": put("tolerance", {}),
    "a tolerance not covered": put("tolerance", {"throw.speed": "1 %"}),
    "a tolerance of a goal": put("tolerance", {"goal.oriented_beyond.x": "1 in"}),
    "a scene with more": put(*SCENE, "note", "proved of all parts"),
    "another model": put(*SCENE, "model", "flip", "energy"),
    # kinds of JSON; other versions and keys: tests/checker/test_versions.py
    "version true": put("version", True),
    "version 3.0": put("version", 3.0),
    "version as text": put("version", "3"),
    "format in capitals": put("format", "LIMITSETS-PROOF"),
    "a claim in capitals": put("claims", 4, "claim", "Goal"),
    "a claim with a blank": put("claims", 4, "claim", "goal "),
    "a claim with a long name": put("claims", 4, "claim", "goal" + " " * 100 + "is not proved"),
    "a claim without a section": put("claims", 4, "section", None),
    # the starts
    "no starts": leave_out(*GOAL, "starts"),
    "starts in capitals": put(*GOAL, "starts", "Every"),
    "starts true": put(*GOAL, "starts", True),
    "starts of no side": put(*GOAL, "starts", {"from": {}}),
    "starts of a side too many": put(*GOAL, "starts", {"from": BEYOND | {"3": "0x1.0p+0"}}),
    "starts as numbers": put(*GOAL, "starts", {"from": dict.fromkeys("012", 2.0)}),
    "starts from the joint on": from_on(0.0),
    "starts from a negative x on": from_on(-5.0),
    "starts far out": from_on(27.0),
    "starts from, and up to": put(*GOAL, "starts", {"from": BEYOND, "to": BEYOND}),
    "almost every without thinning": put(*GOAL, "starts", "almost-every"),
    "every with thinning": put(*GOAL, "thinning", 5),
    "thinning true": all_of(put(*GOAL, "starts", "almost-every"), put(*GOAL, "thinning", True)),
    "thinning for ever": all_of(put(*GOAL, "starts", "almost-every"), put(*GOAL, "thinning", 10**9)),
    "every, nothing near the joint": leave_out(*NEAR),
    "every, near one side": put(*GOAL, "near_joint", {"0": {"q": (1.01).hex()}}),
    "a factor too large": put(*NEAR, "1", "q", (1.2).hex()),
    "a factor of 1": put(*NEAR, "1", "q", (1.0).hex()),
    "a fixed point below the joint": put(*NEAR, "1", "fixed_point", [(3.0).hex(), (4.0).hex()]),
    "lost without noise": all_of(*OF_CELLS, put(*GOAL, "lost", {str(i): (5.0).hex() for i in range(3)})),
    "lost, and every start": put(*GOAL, "lost", BEYOND),
    "only the cells": all_of(*OF_CELLS),
    # ranks, transients, attractors
    "one cell unranked": rank_of(-1, -1),
    "all cells unranked": rank_of(slice(None), -1),
    "unranked, of the cells": all_of(rank_of(slice(None, None, 2), -1), *OF_CELLS),
    "a rank below -1": rank_of(-1, -2),
    "all ranks alike": rank_of(slice(None), 7),
    "all ranks 0": rank_of(slice(None), 0),
    "all ranks alike, thin": all_of(rank_of(slice(None), 7), *THIN),
    "all ranks 0, of the cells": all_of(rank_of(slice(None), 0), *OF_CELLS),
    "an attracting cell ranked": of_the_first_attracting(1),
    "an attracting cell unranked": of_the_first_attracting(-1),
    "no attractor, unranked": no_attractor(-1),
    "no attractor, ranked": no_attractor(5),
    "no attractor, thin": all_of(no_attractor(5), *THIN),
    "half an attractor": half_an_attractor,
    "half an attractor, thin": all_of(half_an_attractor, *THIN),
    "a second attractor": a_second_attractor,
    "a transient made attracting": a_transient_made_attracting,
    "an attractor in two": lambda f: f.arrays["0.component"].__setitem__(
        np.flatnonzero(f.arrays["0.component"] >= 0)[::2], 1
    ),
    "targets everywhere": all_of(lambda f: f.arrays["0.jog"].__setitem__(slice(None), (0, 600)), *OF_CELLS),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_certificate_that_says_another_thing(good, tmp_path, way):
    f = good.copy()
    WAYS[way](f)
    # what a goal says is not caught by other claims
    f.header["claims"] = [c for c in f.header["claims"] if c["claim"] not in ("attracts-all", "expanding")]
    report = verdict(f.seal(), tmp_path)
    assert report.verdict in ("bad file", "failed", "proved-on-cells")
    assert report.reason
    assert "\n" not in report.reason
    cells_only = {"starts far out", "only the cells"}
    assert (report.verdict == "proved-on-cells") <= (way in cells_only)


# ------------------------------------------------------------------------------------------- a dropped attractor

# Two attractors, 16384 cells a side being enough to find both: that of most starts, which comes to side 1 beyond 69 mm
# again and again, and a fixed point near x = 274.73 mm on side 3 (slope 0.52) that never does.


@pytest.fixture(scope="module")
def two():
    scene = ls.load(FOUR_GON)
    return attraction(cover(parameter_box(scene), 16384, {side: [69.0806] for side in range(4)}))


def dropped(found, component, starts, tmp_path, **more):
    """The goal of FOUR_GON with some attracting cells only, ranks and thinning made for them."""
    doctored = replace(found, component=component)
    throws, left = throws_to_reach(doctored, component >= 0, _wanted(doctored, ls.load(FOUR_GON).goal))
    section = {"kind": "reaches", "x": "69.0806 mm", "side": 1, "every_orbit": True}
    claims = [{"claim": "goal", "section": section | {"throws": throws, "starts": starts} | more}]
    path = tmp_path / "x.proof.zip"
    write(path, [doctored], claims, noise=None, tolerance=None, recheck=False)
    return checker.recheck(path, workers=1), left.size


def test_a_dropped_attractor_leaves_the_goal_proved_on_cells_at_most(two, tmp_path):
    grid = two.cover.grid
    fixed = two.component == two.component[grid.offset[3] + np.searchsorted(grid.edges[3][0], 274.729) - 1]
    assert two.component[fixed].min() >= 0
    one = np.where(fixed, -1, np.minimum(two.component, 0)).astype(np.int32)
    report, left = dropped(two, one, "cells", tmp_path)
    assert left == 0
    assert (report.verdict, report.starts) == ("proved-on-cells", "cells")
    assert 0.01 < report.share < 1
    # both are rounded to 1e-6, against the claim
    assert report.open == pytest.approx(1 - report.share, abs=1e-12)
    near = near_section(two)
    for starts, more in (
        ("every", {"near_joint": near}),
        ("almost-every", {"near_joint": near, "thinning": 500}),
        ({"from": {str(i): (400.0).hex() for i in range(4)}}, {"thinning": 500}),
    ):
        report, _ = dropped(two, one, starts, tmp_path, **more)
        assert report.verdict in ("failed", "proved-on-cells"), starts
    both, left = dropped(two, two.component, "cells", tmp_path)
    assert left > 0
    assert both.verdict == "failed"


# ----------------------------------------------------------------------------------------------------------- JSON

RAW = {  # as bytes of the header: what JSON itself lets through
    "a key twice": ('"kind": "oriented_beyond"', '"kind": "oriented_beyond", "kind": "stays_on_arm"'),
    "a key twice, once escaped": ('"x": "20 in", "side"', '"x": "20 in", "\\u0078": "2 in", "side"'),
    "a key twice in the scene": ('"surface_height"', '"surface_height": "-0.3 in", "surface_height"'),
    "minus nothing": ('"side": 2, "starts"', '"side": -0, "starts"'),
    "a side with a point": ('"side": 2, "starts"', '"side": 2.0, "starts"'),
    "a side with an exponent": ('"side": 2, "starts"', '"side": 2e0, "starts"'),
    "a number too large": ('"version": 3', '"version": 1e400'),
    "a version with digits before": ('"version": 3', '"version": 0002'),
    "no number": ('"version": 3', '"version": NaN'),
    "a mark at the beginning": ("{", "\ufeff{"),
    "a half of a sign": ('"20 in", "side": 2, "starts"', '"20 \\ud800in", "side": 2, "starts"'),
    "a blank in hexadecimal": ('"q": "0x1.', '"q": " 0x1.'),
    "a large hexadecimal": ('"q": "0x1.', '"q": "0x123.'),
    "capitals in hexadecimal": ('"q": "0x1.', '"q": "0X1.'),
    "a comment": ('"version": 3', '/* 4 */ "version": 3'),
    "text behind": ("}", "} true"),
}


@pytest.mark.parametrize("way", RAW)
def test_a_header_that_reads_in_two_ways(good, tmp_path, way):
    header, arrays = parts(good)
    old, new = RAW[way]
    text = header.decode()
    assert old in text
    at = text.rindex(old) if way == "text behind" else text.index(old)
    changed = text[:at] + new + text[at + len(old) :]
    report = verdict(whole(changed.encode("utf-8", "surrogatepass"), arrays), tmp_path)
    assert report.verdict in ("bad file", "failed")


def test_what_is_shown_is_what_was_read(good, tmp_path):
    """Numbers are written from the numbers; a text of another form that means the same may be read."""
    f = good.copy()
    f.header["claims"][4]["section"]["x"] = "+02.00e1 in"
    f.header["boxes"][0]["scene"]["goal"]["oriented_beyond"]["x"] = "50.8 cm"
    f.header["boxes"][0]["scene"]["arm"]["length"] = "0.28000e2 in"
    report = verdict(f, tmp_path)
    assert report.verdict == "proved"
    assert "x > 20 in implies side 2" in " ".join(report.statement)
    assert report.parameters["arm.length"] == "28 in"


@pytest.mark.parametrize(
    ("value", "text"),
    [("20", "20"), ("0.05", "0.05"), ("-1.50", "-1.5"), ("0", "0"), ("-0", "0"), ("1e3", "1000"), ("123e-9", "1.23e-7"),
     ("1e20", "1e20"), ("-12.5e18", "-1.25e19"), ("0.000001", "0.000001"), ("1/3", "1/3")],
)  # fmt: skip
def test_a_decimal_is_written_as_it_is(value, text):
    assert checker.file.decimal(Fraction(value)) == text
    assert Fraction(text) == Fraction(value)
