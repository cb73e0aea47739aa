"""Topological entropy from both sides: known answers, other algorithms, forged files, maps without an answer."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from flint import arb
from limitsets.cells import Domain

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.checker.balls import UnprovedError
from limitsets.checker.entropy import Lap, Row, laps_of
from limitsets.checker.file import open_certificate
from limitsets.checker.report import read_certificate
from limitsets.proofs.prover.entropy import laps_in
from limitsets.systems.sets.entropy import growth_of_curve
from tests.maps_of_tests import logistic, stretched, tent
from tests.proofs.forge import opened, spoiled

GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0


def bimodal(x, a, c):
    return a * x**3 + (1.0 - a) * x + c * (1.0 - x * x)


def product(x, y, r, s, t):
    return r * x * (1.0 - x), s * y * (1.0 - y) + t * (5.0 * y + x)


def circle(cells=100):
    return ls.grid([(0.0, 1.0)], cells=cells, periodic=True)


def line(lo=0.001, hi=0.999, cells=500):
    return ls.grid([(lo, hi)], cells=cells)


def ends(proof):
    assert proof.claims[-1].verdict == "proved", proof.claims[-1].reason
    return proof.entropy.lo, proof.entropy.hi


# Slopes of one size s everywhere have entropy ln s (Misiurewicz and Szlenk 1980).
KNOWN = {
    "doubling": (ls.map(stretched, b=2.0), circle(), math.log(2.0)),
    "b x mod 1": (ls.map(stretched, b=2.6), circle(), math.log(2.6)),
    "golden b": (ls.map(stretched, b=GOLDEN), circle(), math.log(GOLDEN)),
    "falling": (ls.map(stretched, b=-3.3), circle(), math.log(3.3)),
    "tent": (tent(1.7), line(), math.log(1.7)),
    "tent of two bands": (tent(1.2), line(), math.log(1.2)),
    "golden tent": (tent(GOLDEN), line(), math.log(GOLDEN)),
}


@pytest.mark.parametrize("name", KNOWN)
def test_entropies_that_are_known(name, tmp_path):
    the_map, grid, known = KNOWN[name]
    proof = ls.entropy(the_map, grid)
    lo, hi = ends(proof)
    assert lo <= known <= hi < lo + 1e-8
    report = ls.recheck(proof.save(tmp_path / "entropy.proof.zip", recheck=False))
    assert report.verdict == "proved"
    assert any("entropy (growth of the words of laps)" in text for text in report.statement), report.statement


def test_a_seam_that_is_no_double():
    """The axis closes after 0.3, which no double is: the last cell ends a little beyond."""
    lo, hi = ends(ls.entropy(ls.map(stretched, b=3.0), ls.grid([(0.1, 0.4)], cells=90, periodic=True)))
    assert lo <= math.log(3.0) <= hi < lo + 1e-6


def kneading_entropy(r):
    """-ln of the least zero of the kneading series of the orbit of 1/2 (Milnor and Thurston 1988)."""
    x, sign, series = logistic(0.5, r), 1.0, [1.0]
    for _ in range(60):
        sign *= 1.0 if x < 0.5 else -1.0
        series.append(sign)
        x = logistic(x, r)
    zeros = np.roots(series[::-1])
    real = zeros[(abs(zeros.imag) < 1e-9) & (zeros.real > 0.4)].real
    return -math.log(real.min())


@pytest.mark.parametrize("r", [3.6, 3.97])
def test_the_logistic_map_by_its_kneading_series(r):
    lo, hi = ends(ls.entropy(ls.map(logistic, r=r), line(cells=1000)))
    assert lo - 1e-4 < kneading_entropy(r) < hi + 1e-4  # 60 terms, of an orbit in floats
    assert hi - lo < 1e-6


def test_words_counted_one_by_one():
    """Laps of the n-th iterate of a cubic map, by preimages of its two turning points, for n = 12."""
    a, turns = 3.7, np.sqrt((3.7 - 1.0) / (3.0 * 3.7)) * np.array([-1.0, 1.0])
    counts, points = [], turns
    for _ in range(12):
        counts.append(points.size + 1)
        roots = [np.roots([a, 0.0, 1.0 - a, -y]) for y in points]
        before = np.array(
            [x.real for some in roots for x in some if abs(x.imag) < 1e-9 and abs(x.real) <= 1.0]
        )
        points = np.unique(np.round(np.concatenate([before, turns]), 12))
    lo, hi = ends(ls.entropy(ls.map(bimodal, a=a, c=0.0), line(-0.9999, 0.9999, 1000)))
    # laps of the interval itself are those of the attracting cells but for what enters these: growth of both is one
    assert lo - 0.02 < math.log(counts[-1] / counts[-2]) < hi + 0.02
    assert hi - lo < 1e-6


@pytest.fixture(scope="module")
def designed():
    return ls.entropy("paper-designed")


@pytest.fixture(scope="module")
def designed_file(designed, tmp_path_factory):
    return designed.save(tmp_path_factory.mktemp("entropy") / "designed.zip", recheck=False)


def test_the_scenes_of_the_paper(designed):
    """The small-angle model has the one slope 1 + 2 |h| / kappa: its logarithm is the entropy."""
    for name, kappa in (
        ("paper-designed-small-angle", 48.6228609),
        ("paper-initial-small-angle", 85.2549144),
    ):
        lo, hi = ends(ls.entropy(name))
        assert lo <= math.log(1.0 + 2.0 / kappa) <= hi < lo + 2e-5, name
    lo, hi = ends(designed)
    assert 0.205943 < lo <= hi < lo + 1e-8
    assert ls.average("paper-designed", of="lyapunov", cells=2000).average.lo < lo  # Rokhlin, Ruelle


def test_what_contracts_has_none_and_none_can_be_forged(tmp_path):
    proof = ls.entropy(ls.map(stretched, b=0.5), line(-1.0, 1.0, 50))
    lo, hi = ends(proof)
    assert lo == 0.0
    assert hi < 1e-9
    forged = opened(proof.save(tmp_path / "honest.zip", recheck=False))
    section(forged).update(lower=(1.0 + 2.0**-30).hex(), upper=(1.5).hex())
    forged.arrays["0.entropy.covered"] = np.array([[0.0, -0.1, 0.1, 1.0], [0.0, -0.01, 0.01, 1.0]])
    report = ls.recheck(forged.seal().write(tmp_path / "forged.zip"))
    assert (report.verdict, "images cover too little" in report.reason) == ("failed", True), report.reason


@pytest.mark.parametrize(
    "seed", [*range(3), *(pytest.param(k, marks=pytest.mark.repeats) for k in range(3, 12))]
)
def test_the_sampled_number_lies_between(seed):
    """Another algorithm, in floats; unimodal and bimodal maps with chaos, cycles and windows."""
    rng = np.random.default_rng(seed)
    a, c = rng.uniform(2.8, 3.6), rng.uniform(-0.1, 0.1)
    for the_map, grid in (
        (ls.map(logistic, r=rng.uniform(3.57, 3.98)), line(cells=800)),
        (ls.map(bimodal, a=a, c=c), line(-0.9999, 0.9999, 800)),
    ):
        found = ls.entropy(the_map, grid).entropy
        assert found.lo - 1e-6 <= found.sampled <= found.hi + 1e-6
        assert found.hi - found.lo < 1e-3 or found.lo < 0.05


def test_a_range_of_parameters():
    wide = ls.entropy(ls.map(logistic, r=3.9), line(cells=1000), upper=ls.map(logistic, r=3.9 + 1e-9))
    lo, hi = ends(wide)
    for r in (3.9, 3.9 + 1e-9):
        assert lo - 1e-7 < ls.entropy(ls.map(logistic, r=r), line(cells=1000)).entropy.sampled < hi + 1e-7
    assert hi - lo < 0.01


# ---------------------------------------------------------------- what has none


def test_nothing_is_proved_without_attracting_cells_or_with_a_spread():
    assert "no attracting cells" in ls.entropy(ls.map(stretched, b=2.5), line()).claims[-1].reason
    spread = {"world": {"scatter": {"speed": "0.1 %"}}, "effects": {"spread": "bounded"}}
    proof = ls.entropy(ls.load(ls.load("paper-designed").as_dict() | spread))
    assert "entropy with a spread cannot be proved" in proof.claims[-1].reason


def test_the_plane_is_sampled_alone():
    found = ls.entropy(ls.maps.Henon(1.4, 0.3), ls.grid([(-1.6, 1.6), (-0.6, 0.6)], cells=64))
    assert found.claims[-1].verdict == "undecided"
    assert (found.entropy.lo, found.entropy.hi) == (0.0, math.inf)
    assert abs(found.entropy.sampled - 0.4647) < 0.005  # Galias; Newhouse and others print 0.46469 at least
    assert found.to_json()[-1]["bounds"] == {"lo": 0.0, "hi": None, "sampled": found.entropy.sampled}
    square = ls.grid([(0.0, 1.0), (0.0, 1.0)], cells=8).domain
    assert abs(growth_of_curve(ls.map(product, r=3.9, s=0.0, t=0.1), square) - kneading_entropy(3.9)) < 0.005
    assert growth_of_curve(ls.map(product, r=3.2, s=0.0, t=0.1), square) == 0.0


def test_what_cannot_be_asked_is_refused():
    with pytest.raises(AnswerError, match="cells to prove it on"):
        ls.entropy(tent(1.7), None)
    with pytest.raises(AnswerError, match="beside a scene"):
        ls.entropy("paper-designed", line())
    with pytest.raises(AnswerError, match="beside a map"):
        ls.entropy(tent(1.7), line(), cells=5)
    with pytest.raises(AnswerError, match="1 or more"):
        ls.entropy("paper-designed", cells=0)


def test_awkward_maps_have_an_answer():
    """What a hostile reader found: laps that are brackets alone, an attractor at the seam, a side without cells."""
    lo, hi = ends(ls.entropy(ls.map(logistic, r=2.0), line()))  # the turning point is the attractor
    assert (lo, hi < math.log(2.0) + 1e-9) == (0.0, True)

    def near(x, c):
        return c + 0.1 * np.sin(4.0 * (x - c))

    lo, hi = ends(ls.entropy(ls.map(near, c=0.995), circle()))
    assert (lo, hi < 1e-8) == (0.0, True)
    lo, hi = ends(
        ls.entropy(TwoSides(3.9), ls.grid(Domain([[0.001], [0.001]], [[0.999], [0.999]]), cells=400))
    )
    assert lo - 1e-4 < kneading_entropy(3.9) < hi + 1e-4


class TwoSides(NamedTuple):
    r: float


def to_side_0(p, x, side):
    return p.r * x * (1.0 - x), 0, 0


ls.register(TwoSides, image=to_side_0)


def test_a_map_of_which_numbers_grow_apart():
    """Components of one growth behind each other: the numbers of the intervals have to stay within bounds."""

    def one(x, a, s):
        return a * x * x - 0.16993306085344084 * x + 0.3

    def other(x, a, s):
        return -0.29821512845611764 * x * x + 1.5701069199944482 * x - 0.2

    def change(x, a, s):
        return x - s

    def at(more):
        return ls.map(
            pieces=(one, other), margin=change, a=-2.837198492313565 + more, s=0.14798732939184123 + more
        )

    proof = ls.entropy(at(0.0), line(-1.5, 1.5, 16), upper=at(1e-9))
    assert proof.claims[-1].verdict == "proved" or "hexadecimal" not in proof.claims[-1].reason
    assert "number of an interval" not in proof.claims[-1].reason


def test_two_directions_that_stretch_are_said_to_be_more():
    found = ls.entropy(
        ls.map(product, r=3.9, s=3.9, t=0.0), ls.grid([(0.001, 0.999), (0.001, 0.999)], cells=16)
    )
    assert found.entropy.sampled < 2.0 * kneading_entropy(3.9)
    assert "at most the entropy" in found.claims[-1].reason


# ---------------------------------------------------------------- laps


def rows(*given):
    """Cells of length 1 from 0 on: sign of the slope, of the second derivative, place."""
    return [
        Row(k, (float(k), k + 1.0), arb(slope) if slope else arb(0, 1), arb(second), arb(k), place)
        for k, (slope, second, place) in enumerate(given)
    ]


def test_cells_become_laps():
    up, down, turn = (1, 0, -1), (-1, 0, -1), (0, -1, -1)
    one, two = laps_of(0, 0, rows(up, up, turn, down), arb)
    assert (one.outer, one.inner, two.outer, two.inner) == ((0, 3), (0, 2), (2, 4), (3, 4))
    (alone,) = laps_of(0, 0, rows((1, 0, 1), up, (1, 0, 0)), arb)
    assert (alone.outer, alone.inner) == ((0, 3), (1, 2))
    hidden = list(laps_of(0, 0, rows(turn, down), arb))  # a lap may begin and end within the turn
    assert [(lap.outer, lap.inner) for lap in hidden] == [((0, 1), None), ((0, 2), (1, 2))]
    assert [lap.inner for lap in laps_of(0, 0, rows((1, 0, 0)), arb)] == [None]
    # an undecided cell below one that is decided takes the branch up to the border
    (whole,) = laps_of(0, 0, rows(up, (1, 0, 0), up, (1, 0, 1), up), arb)
    assert whole.inner == (0, 5)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ([(1, 0, -1), (0, 0, -1), (-1, 0, -1)], "turns once at most"),
        ([(1, 0, -1), (0, -1, 0)], "a slope whose sign is not proved"),
        ([(1, 0, -1), (1, 0, 0), (1, 0, 0), (1, 0, 1), (1, 0, -1)], "one interval"),
        ([(1, 0, 0), (1, 0, 1)], "one interval"),
        ([(0, -1, -1), (0, 1, -1)], "turns once at most"),
    ],
)  # fmt: skip
def test_cells_that_may_hold_more_ends_of_laps_are_refused(given, why):
    with pytest.raises(UnprovedError, match=why):
        list(laps_of(0, 0, rows(*given), arb))


def test_images_of_parts_of_a_lap():
    """f(x) = x known to 0.1; -5 on the bracket from 0 to 1, 9 on that from 3 to 4."""
    lap = Lap(0, 0, (0.0, 4.0), (1.0, 3.0), (arb(-5), arb(9)), lambda x: arb(x, 0.1))
    for part, outer, inner in (
        ((0.0, 4.0), (-5.0, 9.0), (1.1, 2.9)),
        ((1.5, 2.5), (1.4, 2.6), (1.6, 2.4)),
        ((0.5, 2.0), (-5.0, 2.1), (1.1, 1.9)),
        ((2.0, 3.5), (1.9, 9.0), (2.1, 2.9)),
        ((3.5, 5.0), (9.0, 9.0), None),
        ((1.0, 1.1), (0.9, 1.2), None),
        ((4.0, 5.0), None, None),
    ):
        for found, known, way in ((lap.outward(*part), outer, 1.0), (lap.inward(*part), inner, -1.0)):
            assert (found is None) == (known is None), part
            if known is not None:  # rounded to the safe side
                off = (known[0] - found[0]) * way, (found[1] - known[1]) * way
                assert all(-1e-12 < each < 1e-8 for each in off), (part, found)


def test_laps_leave_out_what_is_not_known(tmp_path):
    """A cell with two branches is in no lap but as a bracket; the last cell of a closed axis ends before the seam."""
    scene = ls.average("paper-designed", of="flips_per_throw", cells=300)
    file = scene.save(tmp_path / "scene.zip", recheck=False)
    (laps, runs), (cells,) = laps_in(file), read_certificate(*open_certificate(file)).cells
    open_cells = np.flatnonzero((cells.branch == 2) & (cells.component >= 0))
    assert open_cells.size >= 1
    for k in open_cells.tolist():
        side = int(cells.side[k])
        lo, hi = cells.edges[side][k - cells.start[side] + np.arange(2)]
        beside = [lap for lap in laps if lap.side == side and lap.outer[0] < hi and lo < lap.outer[1]]
        assert len(beside) == 2
        assert sum(lap.inner[1] <= lo and lap.brackets[1] is not None for lap in beside) == 1
        assert sum(lap.inner[0] >= hi and lap.brackets[0] is not None for lap in beside) == 1
    axis = ls.grid([(0.1, 0.4)], cells=90, periodic=True)
    own = ls.average(ls.map(stretched, b=3.0), axis)
    laps, runs = laps_in(own.save(tmp_path / "circle.zip", recheck=False))
    ((_, seam),) = runs.by_side[0]
    assert max(lap.inner[1] for lap in laps) < seam <= max(lap.outer[1] for lap in laps)


# ---------------------------------------------------------------- forged


CAVITY = {"position": "22 in", "width": "9 in", "depth": "9 in", "angle": "20 deg"}


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda f: f.header["boxes"][0]["scene"].update(cavity=CAVITY), "beyond the end of the arm"),
        (lambda f: f.header.update(noise={"throw.speed": "0.1 %"}), "it is about one scene"),
    ],
)
def test_a_scene_of_which_no_entropy_is_proved_is_denied(change, why, designed_file, tmp_path):
    report = ls.recheck(spoiled(designed_file, change, tmp_path / "forged.zip"))
    assert (report.verdict, why in str(report.claims)) == ("failed", True), report.claims


def test_each_run_of_cells_has_to_be_held(tmp_path):
    forged = opened(ls.entropy(tent(1.2), line()).save(tmp_path / "honest.zip", recheck=False))
    runs = forged.arrays["0.entropy.met"][:2]
    assert runs[0, 2] < runs[1, 1]  # of two bands
    changed("met", lambda met: np.delete(met, 1, axis=0))(forged)
    report = ls.recheck(forged.seal().write(tmp_path / "forged.zip"))
    assert "do not hold the attracting cells" in report.reason, report.reason


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    proof = ls.entropy(ls.map(logistic, r=3.9), line(cells=1000))
    return proof.save(tmp_path_factory.mktemp("entropy") / "logistic.proof.zip")


def section(f):
    return next(each["section"] for each in f.header["boxes"][0]["claims"] if each["claim"] == "entropy")


def moved(key, by):
    def change(f):
        section(f)[key] = (float.fromhex(section(f)[key]) * by).hex()

    return change


def changed(word, change):
    def forged(f):
        f.arrays[f"0.entropy.{word}"] = np.ascontiguousarray(change(f.arrays[f"0.entropy.{word}"].copy()))

    return forged


def column(k, change):
    def of(rows_of_file):
        rows_of_file[:, k] = change(rows_of_file[:, k])
        return rows_of_file

    return of


FORGED = {
    "a smaller upper end": (moved("upper", 1.0 - 5e-11), "images meet too much"),
    "a larger lower end": (moved("lower", 1.0 + 5e-11), "images cover too little"),
    "equal numbers above": (changed("met", column(3, np.ones_like)), "images meet too much"),
    "equal numbers below": (changed("covered", column(3, np.ones_like)), "images cover too little"),
    "an interval less above": (changed("met", lambda r: r[1:]), "do not hold the attracting cells"),
    "few intervals above": (changed("met", lambda r: r[:9]), "images meet too much"),
    "few intervals below": (changed("covered", lambda r: r[:9]), "images cover too little"),
    "none below": (changed("covered", lambda r: r[:0]), "there are no intervals"),
    "narrower above": (changed("met", column(2, lambda hi: hi - 1e-9)), "do not hold the attracting cells"),
    "wider below": (changed("covered", column(2, lambda hi: hi + 1e-9)), "images cover too little"),
    "elsewhere below": (changed("covered", column(1, lambda lo: lo + 1.0)), "no interval of a side"),
    # and others that are no certificates
    "a number that is none": (changed("met", column(3, lambda x: x * np.nan)), ""),
    "another side": (changed("met", column(0, lambda side: side + 1)), ""),
    "half a side": (changed("met", column(0, lambda side: side + 0.5)), ""),
    "an infinite interval": (changed("met", column(2, lambda hi: hi * np.inf)), ""),
    "a number 0": (changed("covered", column(3, lambda x: 0.0 * x)), ""),
    "no length": (changed("covered", lambda r: np.where(np.arange(4) == 2, r[:, 1:2], r)), ""),
    "ends exchanged": (lambda f: section(f).update(upper=(1.0).hex()), ""),
    "below 1": (lambda f: section(f).update(lower=(0.5).hex()), ""),
    "five columns": (changed("met", lambda r: np.column_stack([r, r[:, :1]])), ""),
}


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_entropy_is_denied(name, honest, tmp_path):
    change, why = FORGED[name]
    report = ls.recheck(spoiled(honest, change, tmp_path / "forged.zip"))
    assert report.verdict == ("bad file" if why in ("", "no interval of a side") else "failed"), report.reason
    assert why in report.reason


def test_other_numbers_and_intervals_are_as_good(honest, tmp_path):
    """Scaled, in another order, with intervals of no use, and between wider ends."""
    forged = opened(honest)
    for word in ("met", "covered"):
        changed(word, lambda r: np.concatenate([r[::-1], r[3:5]]) * [1.0, 1.0, 1.0, 7.0])(forged)
    moved("upper", 1.5)(forged)
    moved("lower", 0.7)(forged)
    assert ls.recheck(forged.seal().write(tmp_path / "other.zip")).verdict == "proved"
