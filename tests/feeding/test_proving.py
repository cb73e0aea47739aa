"""What is proved of a feeder: safety, progress, shares, and where parts are laid down."""

import json
import math
import re
import time
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.cell.feeding import proving
from limitsets.cell.feeding.falling import arm_end_of
from limitsets.cell.feeding.paths import Paths
from limitsets.cell.feeding.proving import proved_feeding, verdict_of, write_proof
from limitsets.feeder.scattering import Scattering, Uniform
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.certifying import spelled_deviations
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.graph.images.enclosed import enclosures
from limitsets.systems.maps import advance
from tests.cli.command import run
from tests.feeding.own_throws import shares
from tests.feeding.scenes import with_cavity
from tests.proofs.forge import with_section

# ----------------------------------------------------------------
# Safety and progress: the figures of the theory, and that no orbit contradicts what is proved.


def ends(scene, x_end, starts, most=3000):
    """Where orbits end: side beyond the end of the arm, -1 for those that never get there; and the throws it takes."""
    x, side = starts
    found, throws = np.full(x.size, -1), np.zeros(x.size, dtype=int)
    waiting = np.arange(x.size)
    for number in range(1, most + 1):
        x, side, code, _ = ls.maps.drivers.advance(scene.map, x, side, 1)
        assert (code >= 0).all()
        beyond = x > x_end
        found[waiting[beyond]], throws[waiting[beyond]] = side[beyond], number
        x, side, waiting = x[~beyond], side[~beyond], waiting[~beyond]
        if not waiting.size:
            break
    return found, throws


def random_starts(scene, x_end, count=4000, seed=5):
    random = np.random.default_rng(seed)
    side = random.integers(3, size=count)
    a = scene.sides.a[side]
    return a + (x_end - a) * random.uniform(1e-3, 1.0, count), side


def certified(scene, tmp_path, noise=None, **how):
    """Prove it, write it without a look, and recheck it."""
    end = arm_end_of(scene)
    proof = proved_feeding(end, noise, **how)
    file = write_proof(tmp_path / "fed.proof.zip", proof, end, recheck=False)
    return proof, ls.recheck(file)


def test_at_20_in_every_start_is_fed_on_side_2(tmp_path):
    """786 throws from the cells on, as `reaches` has it; the only side beyond 20 in is 2, for r_2 = 20."""
    scene = with_cavity()
    proof, report = certified(scene, tmp_path)
    assert (report.verdict, verdict_of(proof)) == ("proved", "proved")
    assert report.fed == {"safety": 1.0, "progress": 1.0}
    assert "the first rest at x >= 20 in, if there is one, is on side 2" in report.statement[0]
    assert "within 786 throws" in report.statement[0]
    safe, fed, _ = proof
    assert safe.verdict == "proved"
    assert set(safe.possible) == {2}
    assert safe.leaving == 0.0
    assert (fed.verdict, fed.throws, fed.share) == ("proved", 786, 1.0)
    found, throws = ends(scene, 20.0, random_starts(scene, 20.0))
    assert (found == 2).all()
    assert throws.max() <= fed.throws


def test_at_20_5_in_an_orbit_is_never_fed(tmp_path):
    """A periodic orbit never exceeds 20.103 in; almost every start is fed all the same."""
    proof, report = certified(with_cavity(position="20.5 in"), tmp_path)
    assert (report.verdict, verdict_of(proof)) == ("proved", "proved")
    assert report.fed == {"safety": 1.0, "almost": 1.0}
    assert "but for starts of total length zero" in report.statement[0]
    assert f"a periodic orbit, of {len(proof.fed.never_fed) - 1} throws" in report.statement[0]
    safe, fed, _ = proof
    assert fed.verdict == "refuted"
    assert fed.almost_every == "proved"
    assert max(state.hi for state in fed.never_fed) < 20.5
    first, last = fed.never_fed[0], fed.never_fed[-1]
    assert first.side == last.side
    assert min(first.hi, last.hi) >= max(first.lo, last.lo)
    assert "never fed" in fed.lines("in")[0]
    assert safe.verdict == "proved"


def test_where_two_sides_can_be_fed(tmp_path):
    """paper-initial: all three r_i are 20 in, so that jogs beyond it are possible on each side."""
    scene = with_cavity("paper-initial")
    proof, report = certified(scene, tmp_path)
    assert (report.verdict, verdict_of(proof)) == ("refuted", "refuted")
    assert report.fed["safety"] == pytest.approx(proof.safe.share, abs=2e-6)
    assert report.fed["progress"] == 1.0
    assert "safety is refuted" in report.statement[0]
    end, (safe, fed, _) = arm_end_of(scene), proof
    assert safe.verdict == "refuted"
    assert safe.counterexample[0].hi < 20.0
    landing = safe.counterexample[-1]
    assert landing.lo > 20.0
    assert landing.side != end.side
    x, side = random_starts(scene, 20.0)
    found, _ = ends(scene, 20.0, (x, side))
    assert set(found.tolist()) - {-1} <= set(safe.possible)
    only = np.zeros(x.size, dtype=bool)
    for number, parts in safe.only_wanted.items():
        for lo, hi in parts:
            only |= (side == number) & (x >= lo) & (x <= hi)
    assert ((found == end.side) | (found == -1))[only].all()
    assert fed.verdict in ("proved", "refuted", "undecided", "proved-on-cells")


@pytest.mark.repeats  # half a minute, on the finest cells; the next test has the same of the first ones
def test_a_throw_that_scatters_by_10_percent_feeds_side_2_only():
    safe = proved_feeding(arm_end_of(with_cavity()), {"throw.speed": "10 %"}).safe
    assert safe.verdict == "proved"
    assert set(safe.possible) == {2}


def test_when_time_is_up_what_is_proved_is_the_answer():
    """The same throw on the first cells only: the side is proved there, and progress names the cells it ended on."""
    told = []
    words = {"seconds": 0.0, "progress": lambda *step: told.append(step)}
    found = proved_feeding(arm_end_of(with_cavity()), {"throw.speed": "10 %"}, **words)
    assert (found.safe.verdict, set(found.safe.possible)) == ("proved", {2})
    assert found.fed.verdict == "undecided"
    assert "finer cells than 2048 a side were not tried" in found.fed.reason
    assert found.attraction.cover.grid.n_cells < 8192
    assert not any("8192" in stage for stage, _, _ in told)


def pentagon():
    """A part that 6 % of noise carries anywhere: a quarter of its cells can be thrown from beyond where it stands."""
    corners = [(12.145, 11.491), (8.57, 13.529), (-14.251, 9.684), (-5.53, -14.579), (17.207, -5.453)]
    mass = [{"x": "3.628 mm", "y": "2.934 mm", "mass": "180.155 g"}]
    text = """
    part.mass.plate_density = "3 kg/m^2"
    arm = {surface_height = "0.641 mm", length = "262.438 mm"}
    throw.kappa = "12.5314 mm"
    cavity = {position = "177.233 mm", width = "40.382 mm", depth = "43.016 mm", angle = "47.2 deg"}
    """
    tree = tomllib.loads(text)
    tree["part"]["vertices"] = [[f"{x} mm", f"{y} mm"] for x, y in corners]
    tree["part"]["mass"]["points"] = mass
    return ls.load(tree)


def test_a_cell_that_is_not_lost_has_the_image_that_it_has_alone():
    """Nothing more is asked of a cell once nothing is proved of it; the others are all done to the end."""
    scene = pentagon()
    box = parameter_box(scene, noise=spelled_deviations(scene, {"throw.speed": "6 %"}))
    edges = np.linspace(scene.sides.a[0] + 1.0, 0.9 * scene.arm_length, 25)
    found = enclosures(box.lo, box.hi, edges, 0)
    assert found.lost.any()
    assert not found.lost.all()
    for k in range(24):
        alone = enclosures(box.lo, box.hi, edges[k : k + 2], 0)
        assert alone.lost[0] == found.lost[k]
        if not found.lost[k]:
            own = {key: (lo[k], hi[k]) for key, (lo, hi) in found.hulls.items() if lo[k] <= hi[k]}
            assert own == {key: (lo[0], hi[0]) for key, (lo, hi) in alone.hulls.items()}


@pytest.mark.sweep
def test_the_first_cells_keep_the_time_too(monkeypatch):
    """256 pieces of this noise took 35 s of the processor before, whatever time was given."""
    end, noise = arm_end_of(pentagon(), 0), {"throw.speed": "6 %"}
    monkeypatch.setattr(proving, "SOON", 1.0)
    proved_feeding(end, noise, seconds=0.0)  # and compiles
    began = time.process_time()
    found = proved_feeding(end, noise, seconds=1.0)
    assert time.process_time() - began < 20.0
    assert (found.safe.verdict, found.fed.verdict) == ("undecided", "undecided")
    assert "pieces, not 256, which would take longer" in found.fed.reason


def test_fewer_pieces_of_the_noise_prove_less_and_say_so(monkeypatch):
    end = arm_end_of(with_cavity())
    monkeypatch.setattr(proving, "SOON", np.inf)
    whole = proved_feeding(end, {"throw.speed": "3 %"}, seconds=0.0)
    assert "pieces" not in whole.fed.reason
    monkeypatch.setattr(proving, "SOON", 0.0)
    few = proved_feeding(end, {"throw.speed": "3 %"}, seconds=0.0)
    assert "the noise was cut into 4 pieces, not 256, which would take longer" in few.fed.reason
    assert few.safe.share <= whole.safe.share
    for one, other in zip(few.attraction.cover.images, whole.attraction.cover.images, strict=True):
        for key, (lo, hi) in other.hulls.items():
            wide = one.hulls[key]
            some = (lo <= hi) & ~one.lost
            assert (wide[0][some] <= lo[some] + 1e-9).all()  # but for rounding
            assert (hi[some] <= wide[1][some] + 1e-9).all()


def test_scattered_landings_are_fed_from_some_x_on():
    """Nearer to the joint than this some throw of 0.005 in too short loses more than it gains."""
    scene = with_cavity()
    safe, fed, _ = proved_feeding(arm_end_of(scene), {"landing.x": "0.005 in"})
    assert (safe.verdict, set(safe.possible)) == ("proved", {2})
    assert safe.share == 1.0  # whatever leaves towards the joint does not feed another side
    assert fed.almost_every in ("proved", "proved-on-cells")
    assert fed.almost_share > 0.97
    for side, x in fed.almost_from["from"].items():
        # the jog from there gains what the noise may take
        a = scene.sides.a[int(side)]
        assert abs(ls.orbit(scene.map, x, int(side), 1).x[1] - x) == pytest.approx(0.005, rel=0.1)
        assert a < x < a + 1.0


def test_a_part_with_too_many_sides_is_told_so():
    corners = [[f"{10 * np.cos(t):.4f} cm", f"{10 * np.sin(t):.4f} cm"] for t in 2 * np.pi * np.arange(8) / 8]
    part = {"vertices": corners, "mass": {"plate_density": "1 kg/m^2"}}
    tables = {
        "part": part,
        "throw": {"kappa": "90 cm"},
        "arm": {"surface_height": "-1 cm", "length": "100 cm"},
    }
    scene = with_cavity(tables=tables | {"goal": {"reaches": {"x": "60 cm", "side": 0}}})
    with pytest.raises(AnswerError, match="up to 7"):
        proved_feeding(arm_end_of(scene))


def test_a_certificate_of_a_scene_with_cavity_and_feedback_is_rechecked(tmp_path):
    """The checker knows the words, and that the claims do not speak of them."""
    throws = {"sensor": {"side": 2}, "throws": [{"name": "fast", "kappa": "25 in"}]}
    scene = with_cavity(rate="2 Hz", tables={"feedback": throws})
    file = ls.certify(scene, ["goal"]).save(tmp_path / "fed.proof.zip")
    assert ls.recheck(file).verdict == "proved"


@pytest.mark.parametrize(
    ("name", "noise"),
    [
        ("paper-designed", {"throw.speed": "0.3%"}),
        ("paper-designed", {"landing.x": "0.02 in"}),
        ("paper-initial", {"throw.speed": "0.3 %"}),
        ("paper-initial", {"landing.x": "0.02 in"}),
    ],
)
def test_certificates_with_noise(tmp_path, name, noise):
    proof, report = certified(with_cavity(name), tmp_path, noise, seconds=0.0)
    assert report.verdict == verdict_of(proof)
    assert report.fed["safety"] == pytest.approx(proof.safe.share, abs=2e-6)
    assert report.fed["progress"] == pytest.approx(proof.fed.share, abs=2e-6)
    assert report.parameters["noise (at every throw)"] != "none"


def test_with_the_surface_above_the_joint(tmp_path):
    """Parts near the joint creep to it: safety and progress are of the starts in cells, here the first ones."""
    tree = with_cavity().as_dict()
    tree["arm"]["surface_height"] = "0.1 in"
    proof, report = certified(ls.load(tree), tmp_path, seconds=0.0)
    assert report.verdict == verdict_of(proof) == "proved-on-cells"
    assert proof.fed.share < 1.0


def test_landings_beyond_the_length_of_the_arm_are_on_a_side(tmp_path):
    """Jogs on side 1 from just before the end at 20 in end beyond 20.3 in, where this arm does."""
    tree = with_cavity("paper-initial").as_dict()
    tree["arm"]["length"] = "20.3 in"
    scene = ls.load(tree)
    assert ls.orbit(ls.load(tree | {"arm": tree["arm"] | {"length": "40 in"}}).map, 19.95, 1, 1).x[1] > 20.3
    proof, report = certified(scene, tmp_path)
    assert report.verdict == verdict_of(proof) != "failed"
    assert any(lo < 19.95 < hi for lo, hi in proof.safe.possible[1][1])


def test_what_lands_before_the_first_cells_goes_on_from_there():
    """Where a part near the joint may fall short of the first cell it can be fed as from there, as throws show."""
    end = arm_end_of(with_cavity("paper-initial"))
    noise, a = 0.02, end.scene.sides.a
    box = parameter_box(end.scene, noise={"landing.x": f"{noise} in"})
    paths = Paths.of(attraction(cover(box, 2048, dict.fromkeys(range(3), (20.0,)))), end)
    random = np.random.default_rng(3)
    for side, (edges,) in enumerate(paths.attraction.cover.grid.edges):
        short = edges[1:] - a[side] < 0.5 * noise
        assert short.sum() > 100
        bits = paths.ends_on[paths.attraction.cover.grid.of_side(side)][short]
        assert (bits & paths.near[side] == paths.near[side]).all()
        x, on = np.full(200, a[side] + 1e-7), np.full(200, side)
        for _ in range(600):
            x, on, _, _ = ls.maps.drivers.advance(end.scene.map, x, on, 1)
            x = x + random.uniform(-0.2, 1.0, x.size) * noise  # outward more often, or they leave
            beyond = x > 20.0
            assert all(paths.near[side] >> each & 1 for each in on[beyond].tolist())
            stays = ~beyond & (x > a[on])
            x, on = x[stays], on[stays]


def test_a_proof_with_effects_has_no_certificate(tmp_path):
    end = arm_end_of(with_cavity(tables={"effects": {"landing": True}}))
    with pytest.raises(AnswerError, match="with effects"):
        write_proof(tmp_path / "fed.proof.zip", proved_feeding(end), end)


# a run of 64 cells that takes so long says 32 times this for the first 2048 in 256 pieces
CUT = [(0.5, 20.0, 256), (2.5, 20.0, 64), (20.0, 20.0, 4), (20.0, 40.0, 16), (1e4, 20.0, 4)]


@pytest.mark.parametrize(("took", "seconds", "pieces"), [*CUT, (1e4, math.inf, 256)])
def test_noise_is_cut_as_finely_as_time_allows(monkeypatch, took, seconds, pieces):
    clock = [0.0]

    def slow_cover(box, cells, cuts):
        clock[0] += took

    monkeypatch.setattr(proving.time, "perf_counter", lambda: clock[0])
    monkeypatch.setattr(proving, "cover", slow_cover)
    assert proving._pieces(None, {}, seconds) == pieces


# ----------------------------------------------------------------
# Proved brackets of the fates: the shares of trials lie in them; what is refused.


NOISE = Scattering(landing=Uniform(0.2))


@pytest.fixture(scope="module")
def found():
    scene = with_cavity("paper-initial", rate="4 Hz", tips="rest")
    return ls.feed(scene, NOISE, prove=False, level=False, trials=4000, brackets=500)


@pytest.mark.sweep
def test_the_trials_lie_in_the_brackets(found):
    assert set(found.brackets.within) == {"any", "right", "wrong", "wall", "edge", "exits"}
    parts = found.trials.fate.size
    for name in ("right", "wrong", "wall"):
        low, high = found.brackets.within[name][:, -1]
        assert high - low < 0.015
        share = found.trials.counts[name] / parts
        error = 4.0 * (share * (1.0 - share) / parts) ** 0.5
        assert low - error <= share <= high + error
    low, high = found.brackets.mean
    error = 4.0 * found.trials.throws.std() / parts**0.5
    assert low - error <= found.shares.mean_throws <= high + error
    first, by = found.brackets.quantile(0.95)
    error = 4.0 * (0.05 * 0.95 / parts) ** 0.5
    assert found.shares.ended[first - 1] < 0.95 + error
    assert found.shares.ended[by] >= 0.95 - error


@pytest.mark.sweep
def test_the_json_has_them(found):
    table = json.loads(json.dumps(found.to_json()))["brackets"]
    assert table["how"] == "proved"
    assert set(table["within"]["wall"]) == {"lo", "hi"}
    assert table["starts"][0][2] == 20.0


def test_without_noise_there_are_none():
    with pytest.raises(AnswerError, match="the noise of the brackets"):
        ls.feed(with_cavity("paper-initial"), prove=False, trials=10, brackets=50)


@pytest.mark.sweep  # brackets of 200 cells
def test_the_command_shows_them(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ls.dump(with_cavity("paper-initial"), "fed.toml")
    code, out, _ = run(
        capfd, "feed", "fed.toml", "--no-proof", "--scatter", "landing.x=0.2 in", "--law", "bounded",
        "--trials", "50", "--brackets", "200",
    )  # fmt: skip
    assert code == 0
    said = re.search(
        r"PROVED: on the wanted side, clear of the wall within 200 throws: ([\d.]+) to ([\d.]+)", out
    )
    assert said, out
    low, high = (float(number) for number in said.groups())
    end = arm_end_of(ls.load("fed.toml"))
    own = shares(end, 20_000, 3, landing=lambda random, n: random.uniform(-0.2, 0.2, n))["right"]
    error = 4.0 * (own * (1.0 - own) / 20_000) ** 0.5
    assert low - error <= own <= high + error
    assert "PROVED: the least number of throws within which 95 % have ended: " in out


# ----------------------------------------------------------------
# Feeding of parts that are laid down in ranges: proofs, their certificates, forged ones, and random starts.


LAID = {0: [(6, 14)], 2: [(9, 19)]}


@pytest.fixture(scope="module")
def fed(tmp_path_factory):
    """On paper-initial starts on side 1 feed side 1: what is laid down on side 0 far in feeds side 2."""
    end = arm_end_of(with_cavity(position="20.5 in"), laid=LAID)
    proof, file = proved_feeding(end), tmp_path_factory.mktemp("fed") / "fed.proof.zip"
    return end, proof, write_proof(file, proof, end)


def test_safety_and_progress_are_of_the_starts_laid_down(fed):
    end, (safe, progress, _), file = fed
    assert (safe.verdict, safe.share) == ("proved", 1.0)
    assert progress.almost_every == "proved"
    # the orbit that is never fed has a place where parts are laid down
    inside = [(s.side, s.lo) for s in progress.never_fed if any(
        side == s.side and lo < s.lo < s.hi < hi for side, lo, hi in end.laid)]  # fmt: skip
    assert (progress.verdict, bool(inside)) == ("refuted", True)
    report = ls.recheck(file)
    assert (report.verdict, report.fed) == ("proved", {"safety": 1.0, "almost": 1.0})
    assert "6.0 <= x <= 14.0 on side 0, or 9.0 <= x <= 19.0 on side 2" in report.statement[0]


def test_an_orbit_elsewhere_refutes_nothing():
    end = arm_end_of(with_cavity(position="20.5 in"), laid={0: [(6, 14)]})
    _, progress, _ = proved_feeding(end)
    assert not progress.never_fed
    assert progress.almost_every == "proved" or progress.verdict == "proved"


@pytest.mark.parametrize(
    "ranges",
    [{"0": [[1.8, 14.0]]}, {"0": [[6.0, 20.6]]}, {"0": [[6.0, 40.0]]}, {"0": [[14.0, 6.0]]}, {}],
    ids=str,
)
def test_forged_ranges_are_denied(fed, tmp_path, ranges):
    said = json.loads(json.dumps(ranges), parse_float=lambda x: float(x).hex())
    report = ls.recheck(with_section(fed[2], tmp_path / "f.zip", lambda s: s.update(laid=said)))
    assert report.verdict in ("failed", "bad file"), report


def test_removed_ranges_and_starts_elsewhere_are_denied(tmp_path):
    """On paper-initial at 20 in 15 % of the starts feed side 2 only: laid down on side 1, parts feed side 1."""
    whole = proved_feeding(arm_end_of(with_cavity("paper-initial")))
    assert whole.safe.verdict == "refuted"
    (side, pairs), *_ = [(side, pairs) for side, pairs in whole.safe.only_wanted.items() if pairs]
    lo, hi = max(pairs, key=lambda pair: pair[1] - pair[0])
    inner = (0.75 * lo + 0.25 * hi, min(0.25 * lo + 0.75 * hi, 20.0))
    end = arm_end_of(with_cavity("paper-initial"), laid={side: [inner]})
    proof = proved_feeding(end)
    assert proof.safe.verdict == "proved"
    file = write_proof(tmp_path / "a.proof.zip", proof, end)
    assert ls.recheck(file).claims[0][1] in ("proved", "proved-on-cells", "refuted")
    elsewhere = {"1": [[(12.0).hex(), (19.0).hex()]]}
    for change in (lambda section: section.pop("laid"), lambda section: section.update(laid=elsewhere)):
        assert ls.recheck(with_section(file, tmp_path / "f.zip", change)).verdict == "failed"


def test_random_starts_lie_where_parts_are_laid_down():
    scene = with_cavity()
    end = arm_end_of(scene, laid=LAID)
    x, side = end.drawn(np.random.default_rng(0), 30_000)
    for on, lo, hi in end.laid:
        mine = x[side == on]
        assert mine.size / x.size == pytest.approx((hi - lo) / 18.0, abs=0.01)
        assert lo <= mine.min() < lo + 0.01 < hi - 0.01 < mine.max() <= hi
        assert mine.mean() == pytest.approx(0.5 * (lo + hi), abs=0.1)
    found = ls.feed(scene, laid=LAID, trials=4000, level=False)
    record = found.to_json()
    assert (record["laid"], record["starts_from"]) == ({"0": [[6.0, 14.0]], "2": [[9.0, 19.0]]}, None)
    # mean number of throws of these starts, by orbits of their own
    throws, places, sides = np.zeros(x.size), x.copy(), side.copy()
    for number in range(1, 400):
        going = throws == 0
        places[going], sides[going], *_ = advance(scene.map, places[going], sides[going], 1)
        throws[going & (places >= 20.0)] = number
    assert found.shares.mean_throws == pytest.approx(throws.mean(), rel=0.05)
    assert found.trials.throws.mean() == pytest.approx(throws.mean(), rel=0.1)


def test_a_share_of_all_but_a_sliver_is_not_the_whole(fed):
    """A range that reaches into an unproved cell by the last digit: the quotient of the lengths rounds to 1."""
    end, proof, _ = fed
    grid = proof.attraction.cover.grid
    (edges,) = grid.edges[0]
    j = int(np.searchsorted(edges, 20.0))
    k, least = next(  # the first range whose length in proved cells is its whole length in floats
        (k, least)
        for k in range(int(np.searchsorted(edges, 6.5)), j - 100)
        if np.diff(edges[k : j + 1]).sum() == edges[j] - (least := float(np.nextafter(edges[k], 0.0)))
    )
    some = np.ones(grid.n_cells, dtype=bool)
    some[k - 1] = False  # cells of side 0 are numbered from 0
    near = np.ones(grid.sides, dtype=bool)
    share = Paths.of(proof.attraction, replace(end, laid=((0, least, float(edges[j])),))).share(some, near)
    assert 1.0 - 1e-6 < share < 1.0
