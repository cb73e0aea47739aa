"""The recheck of end points and periodic orbits: what is right is proved, and nothing that has been made false.

Certificates come from `forge.py` (plain floats) and, for the paper's scenes, from the prover.  True numbers are those
of 40-digit orbits (`tests/sets/part.py`, `tests/test_paper.py`).
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
from tests.proofs.test_recheck import COARSE, checker, parts, verdict, whole
from tests.sets.part import Part
from tests.test_paper import LIMIT_SETS

pytestmark = pytest.mark.usefixtures("precision")

INVARIANT, ENDS, CYCLES = range(3)


@pytest.fixture(scope="module")
def good():
    """Certificates of both models that are right, forged once."""
    models = ("designed", "small")
    return {model: forge.with_sets(forge.forge(model, **COARSE), model) for model in models}


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


@pytest.mark.parametrize("noise", ["0.05 %", "0.3 %"])
def test_end_points_with_noise(tmp_path, noise):
    path = certify("paper-designed", ["end-points"], noise={"throw.speed": noise}).save(tmp_path / "x.zip")
    report = checker.recheck(path, workers=1)
    assert report.verdict == "proved", report.reason
    assert "whatever speeds of the noise" in report.statement[0]


def test_orbits_that_attract(tmp_path):
    scene = ls.load("paper-designed").with_values(CONTRACTING)
    proof = certify(scene, ["cycles"])
    report = checker.recheck(proof.save(tmp_path / "x.zip"), workers=1)
    assert report.verdict == "proved", report.reason
    assert [each["attracts"] for each in proof.claims[0].section["cycles"]] == [True, True]
    assert report.statement[0].count("attracts, multiplier in [") == 2


@pytest.mark.parametrize(
    ("old", "new"), [("-0.2 in", "-.2 in"), ("28 in", "28. in"), ("28 in", "+2.8e+001  in")]
)
def test_numbers_as_a_scene_may_write_them(tmp_path, old, new):
    tree = ls.load("paper-designed").as_dict()
    arm = {key: new if text == old else text for key, text in ls.load("paper-designed").text["arm"].items()}
    tree["arm"] = arm
    assert new in arm.values()
    report = checker.recheck(certify(ls.load(tree), ["invariant"]).save(tmp_path / "x.zip"), workers=1)
    assert report.reason == ""


@pytest.mark.parametrize("text", [". in", "5.5.5 in", ".e5 in", "1e13 in", "1e-301 in", "1e9999 in", "5in"])
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
    step = 1e-4
    found = [[], [], []]
    for side, intervals in enumerate(union):
        for lo, hi in intervals:
            x = np.arange(lo, hi, step)
            to, image, _ = forge.throw(m, np.full(len(x), side), x)
            for k in range(3):
                found[k].append(image[to == k])
    for k in range(3):
        x = np.sort(np.concatenate(found[k]))
        held = np.zeros(len(x), dtype=bool)
        for lo, hi in outer[k]:
            held |= (lo <= x) & (x <= hi)
        assert held.all()
        for lo, hi in inner[k]:
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
    """Ways to make a section false; each takes a copy of a right certificate, and a generator."""

    def __init__(self, f, model, rng):
        self.f, self.model, self.rng = f, model, rng
        self.ends, cycles = sections(f)
        self.all, self.cycles = cycles, cycles["cycles"]
        self.cycle = rng.choice(self.cycles)

    def move_end(self, outer, inner):
        """Move an end's outer and inner number outward by so much."""
        end = self.rng.choice(self.ends["ends"])
        away = -1 if end["which"] == "lo" else 1
        end["outer"], end["inner"] = moved(end["outer"], outer * away), moved(end["inner"], inner * away)

    def outer_inward(self):
        self.move_end(-1e-7, -2e-7)

    def outer_inward_of_the_inner(self):
        end = self.rng.choice(self.ends["ends"])
        end["outer"] = end["inner"]

    def inner_outward(self):
        self.move_end(2e-7, 1e-7)

    def inner_missing(self):
        self.rng.choice(self.ends["ends"])["inner"] = None

    def interval_missing(self):
        side = self.rng.randrange(3)
        self.ends["ends"] = [end for end in self.ends["ends"] if end["side"] != side]

    def interval_added(self):
        side = self.rng.randrange(3)
        high = next(end for end in self.ends["ends"] if (end["side"], end["which"]) == (side, "hi"))
        x = float.fromhex(high["outer"])
        new = [
            {"side": side, "which": which, "outer": (x + a).hex(), "inner": (x + b).hex()}
            for which, a, b in (("lo", 1e-6, 2e-6), ("hi", 4e-6, 3e-6))
        ]
        at = self.ends["ends"].index(high) + 1
        self.ends["ends"][at:at] = new

    def sides_swapped(self):
        one, other = self.rng.sample(range(3), 2)
        for end in self.ends["ends"]:
            end["side"] = {one: other, other: one}.get(end["side"], end["side"])
        if self.rng.randrange(2):
            self.ends["ends"].sort(key=lambda end: (end["side"], end["which"] != "lo"))

    def ends_swapped(self):
        one, other = self.rng.sample(range(len(self.ends["ends"])), 2)
        self.ends["ends"][one], self.ends["ends"][other] = self.ends["ends"][other], self.ends["ends"][one]

    def too_few_images(self):
        self.ends["images"] = 1

    def piece_decided_otherwise(self):
        piece = self.rng.choice([p for p in self.ends["pieces"] if p[3] != 2])
        piece[3] = 1 - piece[3]

    def critical_point_decided(self):
        self.rng.choice([p for p in self.ends["pieces"] if p[3] == 2])[3] = self.rng.randrange(2)

    def critical_point_beside_its_piece(self):
        at = self.rng.choice([k for k, p in enumerate(self.ends["pieces"]) if p[3] == 2])
        pieces, by = self.ends["pieces"], self.rng.choice([-1e-8, 1e-8])
        pieces[at][1] = pieces[at - 1][2] = moved(pieces[at][1], by)
        pieces[at][2] = pieces[at + 1][1] = moved(pieces[at][2], by)

    def slope_of_the_other_sign(self):
        self.rng.choice(self.ends["pieces"])[4] = -1

    def piece_missing(self):
        self.ends["pieces"].pop(self.rng.randrange(len(self.ends["pieces"])))

    def piece_narrowed(self):
        piece = self.rng.choice(self.ends["pieces"])
        width = float.fromhex(piece[2]) - float.fromhex(piece[1])
        piece[1] = moved(piece[1], 0.1 * width)

    def piece_widened(self):
        self.ends["pieces"][-1][2] = moved(self.ends["pieces"][-1][2], 1e-3)

    def branch_of_another(self):
        word = self.cycle["itinerary"]
        k = self.rng.randrange(len(word))
        word[k] = 1 - word[k]

    def throw_forgotten(self):
        self.cycle["itinerary"].pop(self.rng.randrange(len(self.cycle["itinerary"])))

    def word_turned(self):
        word = self.cycle["itinerary"]
        first = next(k for k in range(1, len(word)) if word[k:] + word[:k] != word)
        word[:] = word[first:] + word[:first]

    def twice_around(self):
        self.cycle["itinerary"] *= 2
        lo, hi = sorted(float.fromhex(end) ** 2 for end in self.cycle["multiplier"])
        self.cycle["multiplier"] = [(lo * 0.999).hex(), (hi * 1.001).hex()]

    def other_multiplier(self):
        by = self.rng.choice([0.99, 1.01, 2.0, -1.0])
        ends = sorted(by * float.fromhex(end) for end in self.cycle["multiplier"])
        self.cycle["multiplier"] = [end.hex() for end in ends]

    def multiplier_turned(self):
        self.cycle["multiplier"].reverse()

    def said_to_attract(self):
        self.cycle["attracts"] = True
        if self.rng.randrange(2):
            self.cycle["multiplier"] = [(0.1).hex(), (0.9).hex()]

    def interval_beside(self):
        by = self.rng.choice([-1, 1]) * 10 ** self.rng.uniform(-9, 0)
        self.cycle["interval"] = [moved(end, by) for end in self.cycle["interval"]]

    def interval_too_wide(self):
        lo, hi = self.cycle["interval"]
        self.cycle["interval"] = [moved(lo, -0.5), moved(hi, 0.5)]

    def interval_of_a_point(self):
        self.cycle["interval"][1] = self.cycle["interval"][0]

    def on_another_side(self):
        self.cycle["side"] = self.rng.randrange(1, 3)

    def outside_the_cells(self):
        self.cycle["interval"] = [moved(end, -8.0) for end in self.cycle["interval"]]

    def the_same_twice(self):
        self.cycles.append(self.cycle)

    def the_same_from_its_next_point(self):
        m = forge.Plain(forge.scene(self.model))
        x = np.array([0.5 * sum(map(float.fromhex, self.cycle["interval"]))])
        (side,), (x,), _ = forge.throw(m, np.array([self.cycle["side"]]), x)
        word = self.cycle["itinerary"]
        again = {**self.cycle, "side": int(side), "itinerary": word[1:] + word[:1]}
        self.cycles.append({**again, "interval": [float(x - 1e-9).hex(), float(x + 1e-9).hex()]})

    def said_to_be_all(self):
        self.all["complete"] = True

    def noise_added(self):
        self.f.header["noise"] = {"throw.speed": "0.001 %"}
        kappa = self.f.header["boxes"][0]["parameters"]["kappa"]
        kappa[:] = [(float.fromhex(kappa[0]) * 0.99).hex(), (float.fromhex(kappa[1]) * 1.01).hex()]

    def cells_added(self):
        self.f.arrays["0.component"][self.rng.choice([0, 5])] = 0

    def another_key_or_one_missing(self):
        where = self.rng.choice([self.ends, self.ends["ends"][0], self.all, self.cycle])
        if self.rng.randrange(2):
            where["critical"] = None
        else:
            del where[self.rng.choice(sorted(where))]

    def of_another_kind(self):
        odd = [None, True, False, -1, 3, 2.0, 10**9, [], {}, [[]]]
        odd += ["0", "nan", "inf", "0x1.8p+9999", "-0x1.0p+1023"]
        where = self.rng.choice([self.ends, self.all, self.cycle, self.rng.choice(self.ends["ends"])])
        row = self.rng.choice([self.rng.choice(self.ends["pieces"]), *(
            self.cycle[key] for key in ("interval", "multiplier", "itinerary"))])  # fmt: skip
        where, key = self.rng.choice([(where, key) for key in where] + [(row, k) for k in range(len(row))])
        old = where[key]
        where[key] = self.rng.choice([new for new in odd if (type(new), new) != (type(old), old)])


WAYS = sorted(name for name in vars(Spoiler) if not name.startswith("_") and name != "move_end")


@pytest.mark.parametrize("way", WAYS)
def test_no_spoiled_section_is_proved(good, tmp_path, way):
    for seed in range({"of_another_kind": 60, "another_key_or_one_missing": 16}.get(way, 8)):
        rng = random.Random(f"{way} {seed}")
        model = rng.choice(["designed", "small"])
        f = good[model].copy()
        getattr(Spoiler(f, model, rng), way)()
        report = verdict(f.seal(), tmp_path)
        assert report.verdict in ("failed", "bad file"), (way, seed, model)
        assert 5 < len(report.reason) < 300
        assert report.reason.isprintable(), report.reason


def test_what_fails_is_named_and_the_rest_is_proved(good, tmp_path):
    f = good["designed"].copy()
    ends, cycles = sections(f)
    ends["ends"][1]["outer"] = moved(ends["ends"][1]["inner"], 1e-11)  # the end lies in the middle of 8e-10
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


def test_orbits_are_of_one_speed(tmp_path):
    """Noise so small that everything else is proved with it."""
    f = forge.with_sets(forge.forge("small", noise=1e-14, **COARSE), "small")
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

    yield "a million ends", told(end_points={"ends": [end] * 1_000_000})
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
