"""What `certify` proves, and how cells are thinned."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError
from limitsets.feeder.scene.units import parse
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.certificate import arrays_of
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.proofs.prover.thinning import _Largest, perron_frobenius_bound
from limitsets.systems.maps import images
from tests.test_paper import LIMIT_SETS, THRESHOLDS
from tests.thrower import reference

# ----------------------------------------------------------------
# What is proved of the paper's feeders, and what is refuted: global attraction, expansion, the goal, noise,
# tolerance.
# The truths are those of the model: closed forms where there are some (docs/model.md), the tables of
# `test_paper.py`, which come from 40-digit orbits, and margins found by reachability and bisection apart from this
# package.  Refuting orbits are thrown again by `tests/thrower/reference.py`, 50 digits of the plain formulas.


# Least slope of the map on the limit set: constant in the small-angle scenes, a minimum in the exact ones.
LEAST_LOG_SLOPE = {"paper-initial": (0.058, 0.0597), "paper-designed": (0.030, 0.0324)}

ASKED = ["attracts-all", "invariant", "expanding", "goal"]


def verdicts(proof):
    return {claim.claim: claim.verdict for claim in proof.claims}


def claim_of(proof, word):
    return next(claim for claim in proof.claims if claim.claim == word)


def table_of(proof, word):
    return next(record for record in proof.to_json() if record["claim"] == word)


def numbers(scene):
    """Facts of a built-in scene from its decimals, by plane geometry at 50 digits."""
    return reference.paper(scene.name.removeprefix("paper-").removesuffix("-angle"))


def require_rechecked(proof, tmp_path):
    """Save it, which the checker has to confirm, and see that each claim that may be written was."""
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False))
    written = {claim.claim: claim.verdict for claim in proof.claims if claim.written}
    assert {claim: state for claim, state, _ in report.claims} == written
    assert report.verdict == max(written.values(), key=("proved", "proved-on-cells").index), report.reason


@pytest.fixture(scope="module", params=LIMIT_SETS)
def paper(request):
    return ls.certify(request.param, ASKED)


# ---------------------------------------------------------------- the paper's four scenes


def test_every_start_on_the_arm_is_attracted(paper):
    """Global attraction, for the exact decimals of each of the paper's scenes."""
    assert verdicts(paper)["attracts-all"] == "proved"
    bound, scene = table_of(paper, "attracts-all")["max_throws"], paper.scene
    facts, extents, rng = numbers(scene), table_of_extents(paper), np.random.default_rng(11)
    for side in range(3):
        begin = bound["beyond"][str(side)]
        assert 0.0 < begin - float(facts.a[side]) < 1e-4  # "every start" leaves out nothing but what follows
        for x in [begin, scene.arm_length, *rng.uniform(begin, scene.arm_length, 6)]:
            require_inside(ls.orbit(scene.map, x, side, bound["throws"] + 500), extents, bound["throws"])


def require_inside(path, extents, late):
    """It stays on the arm, and from some throw on in these cells."""
    assert path.stopped is None
    for number, cells in extents.items():
        x = path.x[late:][path.side[late:] == int(number)]
        assert np.any([(lo <= x) & (x <= hi) for lo, hi in cells], axis=0).all()


def table_of_extents(proof):
    return {
        side: [(part[0][0], part[1][1]) for part in parts]
        for side, parts in table_of(proof, "attracts-all")["extents"].items()
    }


def test_nearer_to_the_joint_every_throw_goes_outward(paper):
    """R' - a >= (1 + 2 |h| / kappa) (R - a) near the joint: closed form."""
    facts = numbers(paper.scene)
    factor = 1 + 2 * abs(facts.surface_height) / facts.kappa
    found = table_of(paper, "attracts-all")["max_throws"]["near_joint"]
    assert factor * (1 - 1e-9) < found <= factor


def test_the_limit_sets_of_the_table_lie_in_the_attracting_cells(paper):
    cells = table_of_extents(paper)
    for side, parts in LIMIT_SETS[paper.scene.name].items():
        for lo, hi in parts:
            held = [(left, right) for left, right in cells[str(side)] if left <= lo and hi <= right]
            # inches: cells around it, not the whole arm
            assert min(max(lo - left, right - hi) for left, right in held) < 0.5


def test_nothing_in_the_limit_set_attracts_and_the_entropy_is_bounded(paper):
    assert verdicts(paper)["expanding"] == "proved"
    found = table_of(paper, "expanding")["entropy"]
    name = paper.scene.name
    if name not in LEAST_LOG_SLOPE:
        facts = numbers(paper.scene)
        exact = float(reference.mp.log(1 + 2 * abs(facts.surface_height) / facts.kappa))
        assert exact - 1e-3 <= found <= exact
    else:
        least, most = LEAST_LOG_SLOPE[name]
        assert least <= found <= most
    assert table_of(paper, "expanding")["least_slope"] == pytest.approx(math.exp(found), rel=1e-12)


def test_the_goal_is_proved_where_it_holds_and_refuted_where_not(paper):
    _, holds = THRESHOLDS[paper.scene.name]
    assert verdicts(paper)["goal"] == ("proved" if holds else "refuted")
    if not holds:
        require_refuting_orbit(paper)
        return
    assert claim_of(paper, "goal").starts == "every"
    assert claim_of(paper, "goal").shares == {"share": 1.0, "leaves": 0.0, "creeps": 0.0, "open": 0.0}


def thrown_again(states, facts, room):
    """Throw an orbit again at 50 digits, each throw as it says, and see that it does so: kappa and throw of each."""
    for before, after in pairwise(states):
        said = before["parameters"]
        kappa = float(parse(said["throw.kappa"], "length").number)
        own = reference.Facts({**facts.numbers, "kappa": kappa})
        thrown = reference.throw(own, before["side"], before["x"])
        shift = float(said["landing.x"].split()[0]) if "landing.x" in said else 0.0
        # each throw is begun at the middle of an interval of width w: it ends within a few w of the next one's
        width = room + 4 * (before["between"][1] - before["between"][0])
        assert thrown.side == after["side"]
        assert after["between"][0] - width <= thrown.x + shift <= after["between"][1] + width
        yield kappa, thrown


def require_refuting_orbit(proof, share=0.0):
    """Throw the orbit again with the plain formulas, and see that it does what is said."""
    goal, facts = proof.scene.goal, numbers(proof.scene)
    states = table_of(proof, "goal")["counterexample"]
    first, last = states[0], states[-1]
    cells = table_of_extents(proof) if verdicts(proof).get("attracts-all") == "proved" else {}
    assert not cells or any(lo <= first["x"] <= hi for lo, hi in cells[str(first["side"])])
    least, most = (facts.kappa / (1 + by) ** 2 for by in (share, -share))
    for kappa, thrown in thrown_again(states, facts, 1e-12):
        assert least * (1 - 1e-12) <= kappa <= most * (1 + 1e-12)
        assert thrown.code in (0, 1)
    assert last["parameters"] is None
    assert last["between"][0] > goal.x
    assert last["side"] != goal.side


def test_what_is_proved_is_proved_by_other_arithmetic_too(paper, tmp_path):
    require_rechecked(paper, tmp_path)


# ---------------------------------------------------------------- noise and tolerance


def test_noise_at_every_throw():
    """The goal of the designed scene, sharp at 0.397 %: a slow throw jogs, a fast one then flips.

    That 0.38 % is proved, and rechecked: test_recheck_bands.py.
    """
    proof = ls.certify("paper-designed", noise={"throw.speed": "0.41%"})
    assert verdicts(proof) == {"attracts-all": "proved", "goal": "refuted"}
    states = table_of(proof, "goal")["counterexample"]
    assert len({state["parameters"]["throw.kappa"] for state in states[:-1]}) > 1
    require_refuting_orbit(proof, 0.0041)


def test_a_speed_that_is_fixed_but_unknown(tmp_path):
    """Sharp at 0.733 %, slower; by throws with the same parameters in one piece."""
    proof = ls.certify("paper-designed", tolerance={"throw.speed": "0.73 %"})
    assert verdicts(proof) == {"attracts-all": "proved", "goal": "proved"}
    assert len(proof.attractions) == 1
    require_rechecked(proof, tmp_path)
    proof = ls.certify("paper-designed", tolerance={"throw.speed": "0.74 %"})
    assert verdicts(proof)["goal"] == "refuted"


@pytest.mark.sweep
def test_a_tolerance_is_cut_where_such_throws_do_not_do(tmp_path):
    scene = ls.load("paper-designed").as_dict() | {"goal": {"reaches": {"x": "22.5 in", "side": 2}}}
    proof = ls.certify(ls.load(scene), ["goal"], tolerance={"throw.speed": "1 %"})
    assert verdicts(proof) == {"goal": "proved"}
    assert len(proof.attractions) > 1
    require_rechecked(proof, tmp_path)


def test_a_tolerance_is_refuted_at_one_of_its_values_and_the_rest_is_still_proved_of_all(tmp_path):
    proof = ls.certify("paper-designed", tolerance={"throw.speed": "0.8%"})
    assert verdicts(proof) == {"attracts-all": "proved", "goal": "refuted"}
    kappas = {state["parameters"]["throw.kappa"] for state in table_of(proof, "goal")["counterexample"][:-1]}
    assert len(kappas) == 1
    require_refuting_orbit(proof, 0.008)
    require_rechecked(proof, tmp_path)  # the checker refuses boxes that do not cover the tolerance


def test_what_is_refuted_at_a_corner_is_never_called_proved_of_the_rest():
    """A surface 0.12 in lower or higher: the designed goal fails at h = -0.3 (20.18), so it is refuted there."""
    proof = ls.certify("paper-designed", ["goal", "invariant"], tolerance={"arm.surface_height": "0.12 in"})
    assert verdicts(proof)["goal"] == "refuted"
    record = table_of(proof, "goal")
    assert record["extents"] is None
    lo, hi = record["counterexample"][0]["parameters"]["arm.surface_height"]
    assert float(parse(lo, "length").number) == pytest.approx(-0.32)
    assert lo == hi


# ---------------------------------------------------------------- what cannot be proved


def test_a_surface_above_the_joint_does_not_attract_from_everywhere():
    """With h = 0.1 in every start below 3.16 in on side 0 creeps to the joint: what is proved is of starts beyond."""
    scene = ls.load("paper-designed").with_values({"arm.surface_height": 0.1})
    path = ls.orbit(scene.map, 2.5, 0, 3000)
    assert path.x[-1] < path.x[0]
    proof = ls.certify(scene)
    assert verdicts(proof) == {"attracts-all": "proved", "goal": "proved"}  # the goal is sharp at 18.52 there
    record = table_of(proof, "attracts-all")
    assert 2.5 < record["jog_fixed_points"]["0"][0] < record["max_throws"]["beyond"]["0"]


@pytest.mark.parametrize("kappa", [2.0, 3.0])
def test_throws_so_fast_that_parts_never_land_are_undecided(kappa):
    """kappa < ell: f may have several roots, or none within a turn, as from x = 27 on here."""
    scene = ls.load("paper-designed").with_values({"throw.kappa": kappa})
    assert ls.orbit(scene.map, 27.0, 0, 1).stopped == "outside-model"
    proof = ls.certify(scene, ["attracts-all", "goal", "invariant", "expanding"])
    for claim in proof.claims:
        assert claim.verdict == "undecided" or claim.claim == "attracts-all"
        assert claim.reason
        assert claim.section == {}
    attracts = claim_of(proof, "attracts-all")
    assert attracts.verdict == ("undecided" if kappa == 2.0 else "refuted")
    for last in attracts.counterexample[-1:]:  # other starts do land, off the arm
        assert last.hi <= scene.sides.a[last.side] or last.lo > scene.arm_length
    assert "side " in claim_of(proof, "attracts-all").reason
    with pytest.raises(AnswerError, match="without a proved claim"):
        proof.save("nowhere.proof.zip")


WRONG = [{"claims": ["attracts"]}, {"noise": {"throw.speeed": "1 %"}}]
# the scene is given by kappa
WRONG += [{"noise": {"throw.speed": text}} for text in ("-1 %", "100 %", "1 deg/s")]
WRONG += [{"tolerance": {"throw.speed": text}} for text in ("-1 %", "1 in")]
WRONG += [{"tolerance": {name: "1 %"}} for name in ("gravity.tilt", "part.sides[7]")]
WRONG += [{"tolerance": {"throw.speed": "1 %", "throw.kappa": "1 %"}}]
WRONG += [{"tolerance": {"part.mass.center.above": "0.8 in"}}]


@pytest.mark.parametrize("asked", WRONG, ids=str)
def test_questions_that_are_none(asked):
    with pytest.raises(LimitsetsError):
        ls.certify("paper-designed", **asked)


def test_a_goal_that_is_not_there():
    tree = ls.load("paper-designed").as_dict()
    del tree["goal"]
    assert verdicts(ls.certify(ls.load(tree))) == {"attracts-all": "proved"}
    with pytest.raises(AnswerError, match="the goal"):
        ls.certify(ls.load(tree), ["goal"])


def test_noise_of_a_speed_with_a_unit():
    """w = sqrt(g / kappa): 0.5 % of it and the same in degrees per second enclose the same kappas."""
    tree = ls.load("paper-designed").as_dict()
    tree["throw"] = {"speed": "158 deg/s"}
    scene = ls.load(tree)
    one, two = (parameter_box(scene, noise={"throw.speed": text}) for text in ("0.5 %", "0.79 deg/s"))
    assert one.lo.kappa == pytest.approx(two.lo.kappa, rel=1e-14)
    assert one.hi.kappa == pytest.approx(two.hi.kappa, rel=1e-14)
    speed = math.radians(158)
    assert one.lo.kappa < 193.045 / (speed * 1.005) ** 2 * (1 + 1e-15)
    assert one.hi.kappa > 193.045 / (speed * 0.995) ** 2 * (1 - 1e-15)


# ---------------------------------------------------------------- JSON


def test_json_has_the_fixed_words_and_no_nan(paper):
    words = {
        "claim", "verdict", "counterexample", "parameters", "noise", "max_throws", "extents", "cells", "undecided",
        "unresolved", "timings",
    }  # fmt: skip
    records = json.loads(json.dumps(paper.to_json(), allow_nan=False))
    assert [record["claim"] for record in records] == ASKED
    (attraction,) = paper.attractions
    for record in records:
        assert words <= set(record)
        assert record["verdict"] in ("proved", "refuted", "undecided")
        said = [record["parameters"][name] for name in ("part.sides[1]", "throw.kappa")]
        assert said == ["3.6 in", paper.scene.text["throw"]["kappa"]]
        assert record["cells"] == attraction.cover.grid.n_cells
        assert 0 < record["undecided"] < record["cells"]
        assert (record["noise"], record["unresolved"]) == (None, {})
        assert (record["max_throws"] is not None) is (record["claim"] == "attracts-all")


# ---------------------------------------------------------------- enclosures

MODELS = [("exact", "signed"), ("exact", "energy"), ("small-angle", "energy")]
SCENES_OF_A_MODEL, POINTS, CELLS = 7, 2000, 200


def random_scene(rng, flight, flip):
    """A part, an arm and a throw that can be: drawn until one is."""
    tree = ls.load("paper-designed").as_dict()
    while True:
        inches = rng.uniform([1, 0.1, 0.3, -2, 15, math.log(2)], [6, 3, 3, 0.5, 50, math.log(90)])
        along, above, rho, height, length, kappa = (f"{x:.6f} in" for x in (*inches[:5], math.exp(inches[5])))
        tree["part"]["mass"] = {
            "center": {"side": 2, "along": along, "above": above},
            "radius_of_gyration": rho,
        }
        tree["arm"], tree["throw"] = {"surface_height": height, "length": length}, {"kappa": kappa}
        tree["model"] = {"flight": flight, "flip": flip}
        try:
            return ls.load(tree)
        except LimitsetsError:
            continue


def landed_where_the_cells_say(found, thrown, rng, points, landing=0.0):
    """Throw points of random cells of each side, and hold branch and target against the cells': how many landed."""
    arrays, offset, met = arrays_of(found, ""), found.cover.grid.offset, 0
    leaves = found.cover.graph.ranges.exits != 0
    for side in range(3):
        edges = arrays[f"edges.{side}"]
        k = rng.integers(0, edges.size - 1, points)
        got = images(thrown, edges[k] + rng.random(points) * (edges[k + 1] - edges[k]), side)
        x, cell = got.x + (landing * rng.uniform(-1, 1, points) if landing else 0.0), offset[side] + k
        stays = got.code >= 0
        assert leaves[cell[~stays]].all()
        for branch, name in enumerate(("jog", "flip")):
            mine = stays & (got.code == branch) & ~leaves[cell]
            assert np.isin(arrays["branch"][cell[mine]], (branch, 2)).all()
            first, last = arrays[name][cell[mine]].T
            to, local = arrays[f"edges.{(side + branch) % 3}"], offset[(side + branch) % 3]
            assert (to[first - local] <= x[mine]).all()
            assert (x[mine] <= to[last - local + 1]).all()
            met += int(mine.sum())
    return met


@pytest.mark.parametrize(("flight", "flip"), MODELS)
def test_random_points_land_where_the_cells_say(flight, flip):
    """Of random points of random cells of random scenes, thrown with kappa anywhere in the noise: branch and target."""
    rng = np.random.default_rng(20)
    total = met = 0
    for number in range(SCENES_OF_A_MODEL):
        scene = random_scene(rng, flight, flip)
        noise = {"throw.speed": "0.3 %"} if number % 2 else {}
        box = parameter_box(scene, noise=noise)
        found = attraction(cover(box, CELLS))
        share = rng.uniform(-0.003, 0.003) if noise else 0.0
        thrown = scene.map._replace(kappa=scene.kappa / (1 + share) ** 2)
        met += landed_where_the_cells_say(found, thrown, rng, POINTS)
        total += 3 * POINTS
    assert met > 0.3 * total  # most scenes keep most of their parts


def test_effects_that_are_not_enclosed_are_refused_rather_than_left_out():
    """Nothing of the minimal map may pass for a map with effects."""
    tree = ls.load("paper-initial").as_dict() | {"effects": {"slip": True}, "world": {"friction": 0.5}}
    with pytest.raises(AnswerError, match="slip"):
        ls.certify(ls.load(tree))


@pytest.mark.parametrize(("x", "stay"), [(22.65, False), (22.7, True)])
def test_how_bounds_of_thinning_go_on_is_known_before_they_are_there(monkeypatch, x, stay):
    """Orbits leave the attracting cells before x by side 2 alone: slowly, and beyond 22.7 in not within 4000 throws.

    How many throws are enough the checker counts again, of every certificate that is saved.
    """
    plain, calls = _Largest.__call__, []
    monkeypatch.setattr(_Largest, "__call__", lambda self, values: calls.append(1) or plain(self, values))
    found = cover(parameter_box(ls.load("paper-designed")), 1000, {2: [x]})
    left = attraction(found).component >= 0
    left[found.grid.of_side(2)] &= found.grid.edges[2][0][1:] <= x
    throws, thick, reason = perron_frobenius_bound(found, left)
    assert (thick == (left & stay)).all()
    assert ("not proved to thin out" in reason) is stay
    assert len(calls) < (200 if stay else throws / 5)
    assert stay or throws <= 4000
