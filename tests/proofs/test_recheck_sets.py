"""The recheck of end points and periodic orbits: what is right is proved, and nothing that has been made false.

Certificates come from the prover, throws from `forge.py` (plain floats); true numbers are those of 40-digit orbits
(`tests/sets/part.py`, `tests/test_paper.py`).
"""

import dataclasses
import json
import random
import time

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from flint import arb

import limitsets as ls
from limitsets.proofs.prover.certifying import certify
from tests.attack.generate import draft
from tests.proofs import forge
from tests.proofs.test_end_points import CONTRACTING
from tests.proofs.test_recheck import checker, parts, verdict, whole
from tests.sets.part import Part
from tests.test_paper import LIMIT_SETS

pytestmark = pytest.mark.usefixtures("precision")

INVARIANT, ENDS, CYCLES = range(3)


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Certificates of both models that are right, with two orbits each."""
    file, found = tmp_path_factory.mktemp("sets") / "x.zip", {}
    for model, name in (("designed", "paper-designed"), ("small", "paper-designed-small-angle")):
        proof = certify(name, ["invariant", "end-points", "cycles"])
        found[model] = forge.opened(proof.save(file, recheck=False))
        section = sections(found[model])[1]
        section |= {"cycles": section["cycles"][:2], "complete": False}
    return found


def sections(f):
    return f.header["claims"][ENDS]["section"], f.header["claims"][CYCLES]["section"]


def moved(text, by):
    return (float.fromhex(text) + by).hex()


# ------------------------------------------------------------------------------------------------- what is accepted


@pytest.mark.parametrize("model", ["designed", "small"])
def test_a_right_certificate_is_proved_and_says_what(good, tmp_path, model):
    report = verdict(good[model], tmp_path)
    assert report.reason == ""
    assert report.claims == [(claim, "proved", "") for claim in ("invariant", "end-points", "cycles")]
    said = "\n".join(report.statement)
    ends, cycles = sections(good[model])
    for end in ends["ends"]:
        assert repr(float.fromhex(end["outer"])) in said
        assert repr(float.fromhex(end["inner"])) in said
    for cycle in cycles["cycles"]:
        assert f"period {len(cycle['itinerary'])}, " in said


@pytest.mark.parametrize("name", LIMIT_SETS)
def test_what_is_proved_of_the_papers_scenes_is_proved_by_other_arithmetic(tmp_path, name):
    proof = certify(name, ["end-points", "cycles", "invariant"])
    assert proof.proved
    proof.save(tmp_path / "x.proof.zip")


def test_end_points_with_noise(tmp_path):
    path = certify("paper-designed", ["end-points"], noise={"throw.speed": "0.3 %"}).save(
        tmp_path / "x.zip", recheck=False
    )
    report = checker.recheck(path, workers=1)
    assert report.verdict == "proved", report.reason
    assert "whatever speeds of the noise" in report.statement[0]


def test_orbits_that_attract(tmp_path):
    scene = ls.load("paper-designed").with_values(CONTRACTING)
    proof = certify(scene, ["cycles"])
    report = checker.recheck(proof.save(tmp_path / "x.zip", recheck=False), workers=1)
    assert report.verdict == "proved", report.reason
    assert [each["attracts"] for each in proof.claims[0].section["cycles"]] == [True, True]
    assert report.statement[0].count("attracts, multiplier in [") == 2


@pytest.mark.parametrize(
    ("arm", "texts"), [("-.2 in", "28. in"), ("-0.2 in", "+2.8e+001  in")], ids=["points", "an exponent"]
)
def test_numbers_as_a_scene_may_write_them(tmp_path, arm, texts):
    tree = ls.load("paper-designed").as_dict() | {"arm": {"surface_height": arm, "length": texts}}
    report = checker.recheck(
        certify(ls.load(tree), ["invariant"]).save(tmp_path / "x.zip", recheck=False), workers=1
    )
    assert report.reason == ""


NONE = [". in", "5.5.5 in", ".e5 in", "1e13 in", "1e-301 in", "1e9999 in", "5in"]
NONE += [f"700000 {unit}" for unit in ("\u00b5m", "\u03bcm", "u\u0301m", "Um", "umm")]


@pytest.mark.parametrize("text", NONE)
def test_numbers_no_scene_has(text):
    with pytest.raises(checker.file.BadFileError):
        checker.file.quantity(text, "length", "x")


# --------------------------------------------------------------------------------- throws, against 40 digits


@pytest.mark.parametrize("model", ["designed", "initial", "small", "initial-small"])
def test_throws_and_their_slopes_at_40_digits(model):
    name = f"paper-{model}-angle" if "small" in model else f"paper-{model}"
    part = Part("paper-designed-small-angle" if model == "small" else name)
    throws = checker.end_points.Throws(checker.scene.read_scene(forge.scene(model), None))
    rng = np.random.default_rng(4)
    h = part.kappa * 0 + 1e-12
    for _ in range(20):
        side, x = int(rng.integers(3)), float(rng.uniform(6, 24))
        t = throws.interval(side, arb(x) - 1e-9, arb(x) + 1e-9)
        point = throws.point(side, x)
        want = part.throw(x, side, "jog")[0]
        assert abs(point.lo - arb(str(want))) < 1e-18
        assert abs(point.hi - arb(str(want))) < 1e-18
        assert t.lo < arb(str(want)) < t.hi
        slope = (part.throw(x + h, side, "jog")[0] - part.throw(x - h, side, "jog")[0]) / (2 * h)
        assert t.slope.rad() < 1e-7
        assert abs(t.slope.mid() - arb(str(slope))) < t.slope.rad() + 1e-20
        margin = part.margin(x, side)
        assert point.decision == (1 if margin > 0 else 0)


def test_images_of_unions_hold_samples_and_are_held(good):
    """Outward: every sampled image is inside.  Inward: between samples there are no gaps wider than their steps."""
    f = good["designed"]
    m, scene = forge.Plain(forge.scene("designed")), checker.scene.read_scene(forge.scene("designed"), None)
    pieces = checker.end_points.read_ends(sections(f)[0], 3)["pieces"]
    union = [[(15.5, 17.25)], [(13.0, 14.0), (15.0, 16.0)], [(9.0, 21.0)]]
    throws = checker.end_points.Throws(scene)
    outer, inner = (
        image(throws, union, pieces)
        for image in (checker.end_points.image_outward, checker.end_points.image_inward)
    )
    step, found = 1e-4, [[], [], []]
    for side, intervals in enumerate(union):
        for lo, hi in intervals:
            x = np.arange(lo, hi, step)
            to, image, _ = forge.throw(m, np.full(len(x), side), x)
            for k in range(3):
                found[k].append(image[to == k])
    for images, out, within in zip(found, outer, inner, strict=True):
        x = np.sort(np.concatenate(images))
        assert np.any([(lo <= x) & (x <= hi) for lo, hi in out], axis=0).all()
        for lo, hi in within:
            assert np.diff(x[(x > lo) & (x < hi)], prepend=lo, append=hi).max() < 3 * step
    undecided = [[piece._replace(branch=2) for piece in own] for own in pieces]
    assert checker.end_points.image_inward(throws, union, undecided) == [[], [], []]
    assert sum(hi - lo for part in outer for lo, hi in part) < 1e-6 + sum(
        hi - lo for part in inner for lo, hi in part
    )


def test_intersections_of_unions():
    one, other = [(0.0, 2.0), (3.0, 5.0), (6.0, 7.0)], [(1.0, 4.0), (5.0, 5.5), (6.5, 9.0)]
    want = [(1.0, 2.0), (3.0, 4.0), (5.0, 5.0), (6.5, 7.0)]
    assert checker.end_points.meeting(one, other) == checker.end_points.meeting(other, one) == want
    assert checker.end_points.first_outside([[(3.5, 4.0)]], [other]) == ""
    assert checker.end_points.first_outside([[(3.5, 4.5)]], [other]) == "side 0, x in [3.5, 4.5]"


# ------------------------------------------------------------------------------------------- what is made false


class Spoiler:
    """A copy of a right certificate, its sections, and what is drawn of them at random: an orbit, an end, a piece."""

    def __init__(self, f, model, rng):
        self.f, self.model, self.rng = f, model, rng
        self.ends, self.all = sections(f)
        self.cycles, self.pieces = self.all["cycles"], self.ends["pieces"]
        self.cycle, self.end = rng.choice(self.cycles), rng.choice(self.ends["ends"])
        self.word, self.side = self.cycle["itinerary"], rng.randrange(3)
        self.k = rng.randrange(len(self.word))

    def piece(self, choose):
        return self.rng.choice([piece for piece in self.pieces if choose(piece[3])])

    def put(self, where, key, value):
        where[key] = value

    def move_end(self, outer, inner):
        """Move an end's outer and inner number outward by so much."""
        for key, by in (("outer", outer), ("inner", inner)):
            self.end[key] = moved(self.end[key], -by if self.end["which"] == "lo" else by)

    def move(self, lo, hi):
        self.cycle["interval"] = [
            moved(x, by) for x, by in zip(self.cycle["interval"], (lo, hi), strict=True)
        ]

    def multiply(self, change, least=1.0, most=1.0):
        lo, hi = sorted(change(float.fromhex(end)) for end in self.cycle["multiplier"])
        self.cycle["multiplier"] = [(lo * least).hex(), (hi * most).hex()]


def interval_added(s):
    ends = s.ends["ends"]
    at, high = next((k, end) for k, end in enumerate(ends) if (end["side"], end["which"]) == (s.side, "hi"))
    ends[at + 1 : at + 1] = [
        {"side": s.side, "which": which, "outer": moved(high["outer"], a), "inner": moved(high["outer"], b)}
        for which, a, b in (("lo", 1e-6, 2e-6), ("hi", 4e-6, 3e-6))
    ]


def sides_swapped(s):
    one, other = s.rng.sample(range(3), 2)
    for end in s.ends["ends"]:
        end["side"] = {one: other, other: one}.get(end["side"], end["side"])
    if s.rng.randrange(2):
        s.ends["ends"].sort(key=lambda end: (end["side"], end["which"] != "lo"))


def ends_swapped(s):
    ends = s.ends["ends"]
    one, other = s.rng.sample(range(len(ends)), 2)
    ends[one], ends[other] = ends[other], ends[one]


def critical_point_beside_its_piece(s):
    at, by = s.pieces.index(s.piece(lambda branch: branch == 2)), s.rng.choice([-1e-8, 1e-8])
    s.pieces[at][1] = s.pieces[at - 1][2] = moved(s.pieces[at][1], by)
    s.pieces[at][2] = s.pieces[at + 1][1] = moved(s.pieces[at][2], by)


def piece_narrowed(s):
    piece = s.rng.choice(s.pieces)
    piece[1] = moved(piece[1], 0.1 * (float.fromhex(piece[2]) - float.fromhex(piece[1])))


def word_turned(s):
    first = next(k for k in range(1, len(s.word)) if s.word[k:] + s.word[:k] != s.word)
    s.word[:] = s.word[first:] + s.word[:first]


def twice_around(s):
    s.cycle["itinerary"] = 2 * s.word
    s.multiply(lambda x: x**2, 0.999, 1.001)


def said_to_attract(s):
    s.cycle["attracts"] = True
    if s.rng.randrange(2):
        s.cycle["multiplier"] = [(0.1).hex(), (0.9).hex()]


def the_same_from_its_next_point(s):
    m = forge.Plain(forge.scene(s.model))
    x = np.array([0.5 * sum(map(float.fromhex, s.cycle["interval"]))])
    (side,), (x,), _ = forge.throw(m, np.array([s.cycle["side"]]), x)
    again = s.cycle | {"side": int(side), "itinerary": s.word[1:] + s.word[:1]}
    s.cycles.append(again | {"interval": [float(x - 1e-9).hex(), float(x + 1e-9).hex()]})


def noise_added(s):
    s.f.header["noise"] = {"throw.speed": "0.001 %"}
    kappa = s.f.header["boxes"][0]["parameters"]["kappa"]
    kappa[:] = [(float.fromhex(end) * by).hex() for end, by in zip(kappa, (0.99, 1.01), strict=True)]


def another_key_or_one_missing(s):
    where = s.rng.choice([s.ends, s.ends["ends"][0], s.all, s.cycle])
    if s.rng.randrange(2):
        where["critical"] = None
    else:
        del where[s.rng.choice(sorted(where))]


def of_another_kind(s):
    odd = [None, True, False, -1, 3, 2.0, 10**9, [], {}, [[]]]
    odd += ["0", "nan", "inf", "0x1.8p+9999", "-0x1.0p+1023"]
    table = s.rng.choice([s.ends, s.all, s.cycle, s.end])
    row = s.rng.choice(
        [s.rng.choice(s.pieces), *(s.cycle[key] for key in ("interval", "multiplier")), s.word]
    )
    where, key = s.rng.choice([(table, key) for key in table] + [(row, k) for k in range(len(row))])
    old = where[key]
    where[key] = s.rng.choice([new for new in odd if (type(new), new) != (type(old), old)])


# Ways to make a section false.
WAYS = {
    "outer inward": lambda s: s.move_end(-1e-7, -2e-7),
    "outer inward of the inner": lambda s: s.end.update(outer=s.end["inner"]),
    "inner outward": lambda s: s.move_end(2e-7, 1e-7),
    "inner missing": lambda s: s.end.update(inner=None),
    "interval missing": lambda s: s.put(
        s.ends, "ends", [end for end in s.ends["ends"] if end["side"] != s.side]
    ),
    "interval added": interval_added,
    "sides swapped": sides_swapped,
    "ends swapped": ends_swapped,
    "too few images": lambda s: s.ends.update(images=1),
    "piece decided otherwise": lambda s: s.put((p := s.piece(lambda branch: branch != 2)), 3, 1 - p[3]),
    "critical point decided": lambda s: s.put(s.piece(lambda branch: branch == 2), 3, s.rng.randrange(2)),
    "critical point beside its piece": critical_point_beside_its_piece,
    "slope of the other sign": lambda s: s.put(s.rng.choice(s.pieces), 4, -1),
    "piece missing": lambda s: s.pieces.pop(s.rng.randrange(len(s.pieces))),
    "piece narrowed": piece_narrowed,
    "piece widened": lambda s: s.put(s.pieces[-1], 2, moved(s.pieces[-1][2], 1e-3)),
    "branch of another": lambda s: s.put(s.word, s.k, 1 - s.word[s.k]),
    "throw forgotten": lambda s: s.word.pop(s.k),
    "word turned": word_turned,
    "twice around": twice_around,
    "other multiplier": lambda s: s.multiply(float(s.rng.choice([0.99, 1.01, 2.0, -1.0])).__mul__),
    "multiplier turned": lambda s: s.cycle["multiplier"].reverse(),
    "said to attract": said_to_attract,
    "interval beside": lambda s: s.move(*[s.rng.choice([-1, 1]) * 10 ** s.rng.uniform(-9, 0)] * 2),
    "interval too wide": lambda s: s.move(-0.5, 0.5),
    "interval of a point": lambda s: s.put(s.cycle["interval"], 1, s.cycle["interval"][0]),
    "on another side": lambda s: s.cycle.update(side=s.rng.randrange(1, 3)),
    "outside the cells": lambda s: s.move(-8.0, -8.0),
    "the same twice": lambda s: s.cycles.append(s.cycle),
    "the same from its next point": the_same_from_its_next_point,
    "said to be all": lambda s: s.all.update(complete=True),
    "noise added": noise_added,
    "cells added": lambda s: s.put(s.f.arrays["0.component"], s.rng.choice([0, 5]), 0),
    "another key or one missing": another_key_or_one_missing,
    "of another kind": of_another_kind,
}


@pytest.mark.parametrize("seeds", [range(4), pytest.param(range(4, 12), marks=pytest.mark.repeats)], ids=str)
@pytest.mark.parametrize("way", WAYS)
def test_no_spoiled_section_is_proved(good, tmp_path, way, seeds):
    times = {"of another kind": 6, "another key or one missing": 2}.get(way, 1)
    for seed in range(times * seeds.start, times * seeds.stop):
        model = ("designed", "small")[seed % 2]
        f = good[model].copy()
        WAYS[way](Spoiler(f, model, random.Random(f"{way} {seed}")))
        report = verdict(f.seal(), tmp_path)
        assert report.verdict in ("failed", "bad file"), (way, seed, model)
        assert 5 < len(report.reason) < 300
        assert report.reason.isprintable(), report.reason


def test_what_fails_is_named_and_the_rest_is_proved(good, tmp_path):
    f = good["designed"].copy()
    ends, cycles = sections(f)
    ends["ends"][1]["outer"] = moved(ends["ends"][1]["inner"], 2e-14)  # the end lies in the middle of 1.5e-11
    cycles["cycles"][1]["multiplier"] = [(5.4).hex(), (5.45).hex()]
    claims = {claim: (state, why) for claim, state, why in verdict(f, tmp_path).claims}
    assert claims["invariant"] == ("proved", "")
    state, why = claims["end-points"]
    assert state == "failed"
    assert why.startswith("side 0, x in [15.2")
    assert "not proved to lie within the outer ends" in why
    state, why = claims["cycles"]
    assert state == "failed"
    assert why.startswith(f"period 8, side 0, x in [{float.fromhex(cycles['cycles'][1]['interval'][0])!r}, ")
    assert "multiplier" in why


def test_an_orbit_outside_of_the_attracting_cells_is_none_in_them(good):
    throws = checker.end_points.Throws(checker.scene.read_scene(forge.scene("designed"), None))
    (orbit, *_) = checker.refutations.read_orbits(sections(good["designed"])[1], 3)["orbits"]
    checker.refutations.prove_orbit(throws, [[(orbit.lo, orbit.hi)], [], []], orbit)
    for cells in ([[], [], []], [[(orbit.lo + 1e-12, orbit.hi)], [(0.0, 30.0)], [(0.0, 30.0)]]):
        with pytest.raises(checker.balls.UnprovedError, match="not in the attracting cells"):
            checker.refutations.prove_orbit(throws, cells, orbit)


def test_an_itinerary_that_the_map_does_not_take_is_none():
    """Two flips, eleven jogs and a flip have a fixed point; but from the last of its points the part jogs."""
    throws = checker.end_points.Throws(checker.scene.read_scene(forge.scene("designed"), None))
    m = forge.Plain(forge.scene("designed"))
    cycle = forge.refined(m, np.array([1, 1, *[0] * 11, 1]), 6.0, 26.0)
    (orbit,) = checker.refutations.read_orbits({"cycles": [cycle], "complete": False}, 3)["orbits"]
    with pytest.raises(checker.balls.UnprovedError, match="throw 14: that it is a flip is not proved"):
        checker.refutations.prove_orbit(throws, [[(0.0, 30.0)]] * 3, orbit)


def test_orbits_are_of_one_speed(good, tmp_path):
    """End points are those of all speeds of the noise, orbits of none but one."""
    proof = certify("paper-designed", ["end-points"], noise={"throw.speed": "0.05 %"})
    f = forge.opened(proof.save(tmp_path / "noisy.zip", recheck=False))
    f.header["claims"].append(good["designed"].header["claims"][CYCLES])
    claims = {claim: (state, why) for claim, state, why in verdict(f, tmp_path).claims}
    assert claims["end-points"] == ("proved", "")
    assert claims["cycles"][0] == "failed"
    assert "not with noise" in claims["cycles"][1]


def test_a_gap_of_the_limit_set_cannot_be_filled(tmp_path):
    """Side 1 of paper-initial has two intervals; between them no part comes to rest."""
    proof = certify("paper-initial", ["end-points"])
    (claim,) = proof.claims
    ends = claim.section["ends"]
    assert [end["side"] for end in ends] == [0, 0, 1, 1, 1, 1, 2, 2]
    section = {**claim.section, "ends": [*ends[:3], *ends[5:]]}
    object.__setattr__(proof, "claims", (dataclasses.replace(claim, section=section),))
    report = checker.recheck(proof.save(tmp_path / "x.zip", recheck=False), workers=1)
    assert report.verdict == "failed"
    assert "not in the attracting cells" in report.reason


# -------------------------------------------------------------------------------------------------- hostile sizes


def spoiled_sizes(f):
    """Name and bytes of certificates of absurd size."""
    header, arrays = parts(f)
    end, piece = sections(f)[0]["ends"][0], sections(f)[0]["pieces"][0]

    def told(**sections_):
        new = json.loads(header)
        for claim in new["claims"]:
            claim["section"] |= sections_.get(claim["claim"].replace("-", "_"), {})
        return whole(json.dumps(new).encode(), arrays)

    yield "a hundred thousand ends", told(end_points={"ends": [end] * 100_000})
    yield "a thousand ends", told(end_points={"ends": [end] * 1000})
    yield "many pieces", told(end_points={"pieces": [piece] * 20_000})
    for images in (10**9, 10**16, 0, -1, True, 1.0, "4", None):
        yield f"images {images!r}", told(end_points={"images": images})
    cycle = sections(f)[1]["cycles"][0]
    yield "many cycles", told(cycles={"cycles": [cycle] * 1000})
    yield "a long itinerary", told(cycles={"cycles": [{**cycle, "itinerary": [0] * 100_000}]})
    deep = b'"images": ' + b"[" * 50_000 + b"]" * 50_000 + b', "x": '
    yield "deep", whole(header.replace(b'"images": ', deep), arrays)
    for text in ("nan", "inf", "0x1.0p+1024", "0x1.0p+99999", "0X1P3", "1.5", "0x1.0000000000000000001p+3"):
        ends = [{**end, "inner": text}, *sections(f)[0]["ends"][1:]]
        yield f"inner {text}", told(end_points={"ends": ends})


def test_absurd_sizes_give_one_clear_line_at_once(good, tmp_path):
    for name, data in spoiled_sizes(good["designed"]):
        begun = time.process_time()
        report = verdict(data, tmp_path)
        assert report.verdict == "bad file", name
        assert 5 < len(report.reason) < 250, name
        assert report.reason.isprintable(), name
        assert time.process_time() - begun < 30.0, name  # no hang; seconds depend on the machine and its load


@pytest.mark.parametrize(("claim", "most"), [("end-points", 150), ("cycles", 100)])
def test_work_is_limited(good, tmp_path, monkeypatch, claim, most):
    monkeypatch.setattr(checker.end_points, "MOST_THROWN", most)
    reasons = {word: why for word, _, why in verdict(good["designed"], tmp_path).claims}
    assert f"more than {most} boxes would be needed" in reasons[claim]


def test_where_there_may_be_several_impacts_nothing_is_proved(good, tmp_path):
    """kappa < ell: f may have several roots, and the impact angle may jump."""
    raw = forge.scene("designed")
    raw["throw"]["kappa"] = "2.3 in"
    scene = checker.scene.read_scene(raw, None)
    with pytest.raises(checker.balls.UnprovedError, match="not bracketed"):
        checker.end_points.Throws(scene).point(2, 6.0)
    f = good["designed"]
    cells = checker.file.Cells([f.arrays[f"0.edges.{i}"] for i in range(3)], *[
        f.arrays[f"0.{name}"] for name in ("jog", "flip", "branch", "rank", "component", "phi")])  # fmt: skip
    ends, cycles = sections(f)
    with pytest.raises(checker.balls.UnprovedError, match="several impacts"):
        checker.end_points.check_ends(scene, cells, checker.end_points.read_ends(ends, 3))
    with pytest.raises(checker.balls.UnprovedError, match="kappa > ell"):
        checker.refutations.check_orbits(scene, cells, checker.refutations.read_orbits(cycles, 3))


def test_the_impact_is_bracketed_next_to_the_joint():
    """Angles a thousand times smaller than where the search begins: half of these were denied."""

    rng, tried = random.Random(3), 0
    for seed in range(30):
        raw, *_ = draft(np.random.default_rng(seed))
        scene = checker.scene.read_scene(raw, None)
        for s in scene.sides:
            x = arb(float(s.a) + float(s.arm - s.a) * 10 ** rng.uniform(-7, -2))
            if not (s.exact and s.concave and x > s.a):
                continue
            low, high = (checker.end_points.beside_root(s, x, scene.k_lo, before) for before in (True, False))
            assert checker.model.flight(x, scene.k_lo, low) > 0
            assert checker.model.flight(x, scene.k_lo, high) < 0
            assert high.p - low.p < low.p * arb(2) ** -20
            tried += 1
    assert tried > 40
