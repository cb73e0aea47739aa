"""Proofs and kernels derived from a plain function, against plain Python."""

from __future__ import annotations

import importlib
import importlib.util
import math
import random
import subprocess
import sys
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.checker import recheck
from limitsets.feeder.thrower import SmallAngle
from limitsets.numbers.interval import Interval
from limitsets.proofs.prover import averages
from limitsets.systems.graph.images.enclosed import enclosures
from limitsets.systems.maps import images
from limitsets.systems.maps.kernels import forced, image
from limitsets.systems.maps.textbook.shared import Plane, Point, plane, rectangle
from tests.bench.measure import Row, limit, take_turns, versus
from tests.bench.python_proofs import cells, with_arb
from tests.proofs import forge, test_recheck
from tests.proofs.test_averages_of_maps import bounds, circle, lanford, stretched

pytestmark = pytest.mark.bench


# ----------------------------------------------------------------
# Rigorous images, the proof of attraction and its recheck, beside the same images with other people's intervals.


enclosed = importlib.import_module("limitsets.systems.graph.images.enclosed")

CELLS = 200_000


def test_rigorous_images(benchmark, table):
    """Cells of side 2 of paper-designed, nearly all decided."""
    scene = ls.load("paper-designed")
    edges = ls.grid(scene.domain, cells=CELLS).edges[2][0]
    few = cells(400)

    def ours():
        return enclosed.enclosures(scene.map, scene.map, edges, 2)

    turns = take_turns(benchmark, ours, {"python-flint": lambda: with_arb(few)}, rounds=15)
    turns.rivals["python-flint"][:] *= CELLS / len(few)
    found = turns.answer
    assert not found.lost.any()
    per_cell = turns.ours / CELLS
    table.append(limit("rigorous images, the whole call (asked: 5e6 a second)", 1e-6 / per_cell, "M/s", None))
    table.append(limit("rigorous images: ns a cell (asked: 5 million a second)", per_cell * 1e9, "ns", 200))
    table.append(versus("rigorous images, a cell", turns, "python-flint", unit="ns", per=CELLS))


def test_rigorous_images_beside_codac(table):
    """codac in a process of its own: its import leaves the whole process rounding upward."""
    if importlib.util.find_spec("codac") is None:
        pytest.skip("codac is not installed here")
    script = Path(__file__).with_name("python_proofs.py")
    command = [sys.executable, str(script), "codac", "400"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    table.append(limit("rigorous images with codac in Python, a cell", float(done.stdout) * 1e6, "us", None))


def test_the_proof_and_its_recheck(benchmark, table, tmp_path):
    """attracts-all of the exact designed scene, warm; the certificate rechecked."""
    scene = ls.load("paper-designed")
    turns = take_turns(benchmark, lambda: ls.certify(scene, ["attracts-all"]), {}, rounds=15)
    assert turns.answer.proved
    table.append(limit("paper-designed: attraction proved, warm", turns.ours, "s", 0.2))
    path = turns.answer.save(tmp_path / "designed.proof.zip")
    seconds, counted = [], 0
    for _ in range(3):
        report = recheck(path, workers=1)
        assert report.verdict == "proved"
        seconds.append(report.seconds)
        counted = report.cells
    each = np.array(seconds) / counted * 1e6
    table.append(limit("recheck, one core: us a cell (asked: 25 000 a second)", each, "us", 40))


def test_the_recheck_of_damaged_and_forged_files(table, tmp_path):
    """Each kind of file of the checker's own tests: how long the worst takes, imports apart."""
    good = {model: forge.forge(model, **test_recheck.COARSE) for model in ("designed", "small")}
    path = tmp_path / "x.proof.zip"

    def worst_of(files, verdict):
        slowest = 0.0, ""
        for name, data in files:
            path.write_bytes(data)
            begin = perf_counter()
            found = test_recheck.checker.recheck(path, workers=1).verdict
            slowest = max(slowest, (perf_counter() - begin, name))
            assert found in verdict, name
        return slowest

    def forged():
        for way in test_recheck.WAYS:
            rng = random.Random(f"{way} 0")
            model = rng.choice(["designed", "small"])
            spoiler = test_recheck.Spoiler(good[model].copy(), model, rng)
            getattr(spoiler, way)()
            yield way, spoiler.f.seal().bytes()

    for what, files, verdict in (
        ("damaged", test_recheck.damaged_files(good["designed"]), {"bad file"}),
        ("forged", forged(), {"bad file", "failed"}),
    ):
        seconds, name = worst_of(files, verdict)
        table.append(limit(f"recheck of {what} files, the slowest ({name})", seconds, "s", 1.0))


VARIED = ("throw.kappa", "arm.surface_height", "part.mass.center.along", "part.mass.center.above")


def test_no_enclosure_is_violated(table):
    """1e8 random points of random cells of random scenes lie in the images of their cells."""
    rng = np.random.default_rng(20)
    base = ls.load("paper-designed")
    points = violated = 0
    while points < 100_000_000:
        values = rng.uniform((8.0, -1.5, 2.5, 0.4), (80.0, 0.5, 4.8, 1.2)).tolist()
        scene = base.with_values(dict(zip(VARIED, values, strict=True)))
        for side in range(3):
            edges = ls.grid(scene.domain, cells=int(rng.integers(200, 5000))).edges[side][0]
            found = enclosed.enclosures(scene.map, scene.map, edges, side)
            for _ in range(100):
                x = rng.uniform(edges[:-1], edges[1:])
                got = images(scene.map, x, side)
                good = (got.code > ls.maps.OUTSIDE_MODEL) & ~found.lost
                inside = np.zeros(x.size, dtype=bool)
                for (to, _), (lo, hi) in found.hulls.items():
                    # the point map itself rounds, by some 1e-15 of the lengths involved
                    slack = 1e-13 * (np.abs(x) + np.abs(got.x))
                    inside |= (got.side == to) & (got.x >= lo - slack) & (got.x <= hi + slack)
                points += int(good.sum())
                violated += int((good & ~inside).sum())
    assert violated == 0
    table.append(limit("random points outside the image of their cell, of 1e8", violated, "", 1))


# ----------------------------------------------------------------
# Averages: how near the bounds of the exponent come, the search and the recheck of it, beside one long orbit.

ORBIT = "an orbit of 1e6 throws, whose exponent is known to 5e-4"


@pytest.mark.parametrize(
    ("cells", "width", "search", "again"), [(8192, 6e-5, 0.3, 2.0), (144_000, 4e-6, 3.0, 10.0)]
)
def test_the_exponent_of_the_designed_feeder(
    cells, width, search, again, benchmark, table, tmp_path, monkeypatch
):
    scene, seconds = ls.load("paper-designed"), []
    searched = averages.search_component

    def timed(*given):
        begin = perf_counter()
        answer = searched(*given)
        seconds.append(perf_counter() - begin)
        return answer

    monkeypatch.setattr(averages, "search_component", timed)
    turns = take_turns(
        benchmark,
        lambda: ls.average(scene, "lyapunov", cells=cells),
        {ORBIT: lambda: maps.lyapunov(scene.map, 20.0, 2, 1_000_000)},
        rounds=3,
    )
    average, what = turns.answer.average, f"paper-designed, exponent, {cells} cells"
    table.append(limit(f"{what}: width of the bounds", average.hi - average.lo, "", width))
    table.append(limit(f"{what}: search for the numbers", np.array(seconds), "s", search))
    table.append(versus(f"{what}: search and recheck", turns, ORBIT, inform=True))
    report = recheck(turns.answer.save(tmp_path / "average.proof.zip", recheck=False), workers=1)
    assert report.verdict == "proved"
    assert average.lo < turns.answers[ORBIT].exponent + 2e-3
    table.append(limit(f"{what}: recheck", report.seconds, "s", again))


@pytest.mark.parametrize("name", ["paper-designed", "paper-initial", "paper-designed-small-angle"])
def test_a_hundred_million_throws_lie_in_the_bounds(name, table):
    """Means over orbits from many starts in the limit set, within five standard errors of the bounds."""
    scene, random = ls.load(name), np.random.default_rng(1)
    proved = ls.average(scene, ["flips_per_throw", "side_shares", lambda x: x]).average.numbers
    count, throws = 10_000, 10_000
    x, side, _, _ = maps.advance(
        scene.map, random.uniform(0.45, 0.7, count) * scene.map.arm_length, random.integers(0, 3, count), 300
    )
    sums = np.zeros((5, count))
    for _ in range(throws):
        after, turned, code, _ = maps.advance(scene.map, x, side, 1)
        sums += np.array([code == 1, side == 0, side == 1, side == 2, x])
        x, side = after, turned
    for (what, by_component), own in zip(proved.items(), sums / throws, strict=True):
        (lo, hi), mean, error = by_component[0], own.mean(), own.std() / math.sqrt(count)
        beyond = max(lo - mean, mean - hi, 0.0) / error
        table.append(limit(f"{name}, {what}: 1e8 throws beyond the bounds, standard errors", beyond, "", 5.0))


# ----------------------------------------------------------------
# Exponents of examples of RigorousInvariantMeasures.jl (JuliaDynamics; compute_lyapunov.jl, 175_ulam.jl).  Those with
# kinks are left out: no average of them is found here.  It prints one number: Lanford's in [0.657604, 0.65772], from
# 2^21 cells (notebooks/LanfordLyap.ipynb as of commit b6bbfef, 2022; without its time).  24 digits of it stand in the
# tests of wormell/Poltergeist.jl.

PRINTED = 1.1463512420506472e-4


def perturbed(x):
    return 4.0 * x + 0.01 * np.sin(8.0 * math.pi * x)


def spectral_exponent():
    """Of the perturbed map, by 81 waves: coefficients of analytic densities fall faster than any power."""
    x, k = np.arange(2048) / 2048, np.arange(-40, 41)
    waves = np.exp(2j * math.pi * np.outer(x, k))
    step, density = np.exp(-2j * math.pi * np.outer(k, perturbed(x))) @ waves / x.size, 1.0 * (k == 0)
    for _ in range(60):
        density = step @ density
    return float(np.mean((waves @ density).real * np.log(4.0 + 0.08 * math.pi * np.cos(8.0 * math.pi * x))))


PUBLISHED = {
    "Lanford": (ls.map(lanford), 0.657661780006597677541582, PRINTED),
    "4x + 0.01 sin(8 pi x)": (ls.map(perturbed), spectral_exponent(), None),
    "17x/5": (ls.map(stretched, b=3.4), math.log(3.4), None),
}


@pytest.mark.parametrize("count", [16_384, 131_072])
@pytest.mark.parametrize("name", PUBLISHED)
def test_exponents_of_published_examples(name, count, table, tmp_path):
    params, exact, printed = PUBLISHED[name]
    ls.average(params, circle(1000), "lyapunov")  # compiled
    begin, what = perf_counter(), f"exponent of {name}, {count} cells"
    proof = ls.average(params, circle(count), "lyapunov")
    table.append(limit(f"{what}: search and recheck", perf_counter() - begin, "s", None))
    lo, hi = bounds(proof)
    assert lo <= exact <= hi
    rival = {"rival": "RigorousInvariantMeasures.jl, 2^21 cells, as printed", "theirs": printed}
    ratio = {} if printed is None else rival | {"ratio": printed / (hi - lo), "reads": "rival/ours"}
    table.append(Row(f"{what}: width of the bounds", hi - lo, "", **ratio))
    report = recheck(proof.save(tmp_path / "average.proof.zip", recheck=False), workers=1)
    assert report.verdict == "proved"
    table.append(limit(f"{what}: recheck", report.seconds, "s", None))


# ----------------------------------------------------------------
# Boxes derived from a map's plain kernels beside those written by hand: how wide, and how long they take.
# The throw is that of the small-angle model: its impact angle is a formula.  That of the exact flight is the root
# of an equation, which the throw's own boxes bracket; no kernel without a loop that compares gives it.


class LogisticDerived(NamedTuple):
    r: float = 4.0


class LeslieDerived(NamedTuple):
    young: float = 19.6
    old: float = 23.68
    crowding: float = 0.1
    survival: float = 0.7


def _leslie(p: Any, x: Any, side: int) -> Any:
    born = p.young * x[0] + p.old * x[1]
    return (born * math.exp(-p.crowding * (x[0] + x[1])), p.survival * x[0]), side, 0


class HenonByHand(NamedTuple):
    a: float = 1.4
    b: float = 0.3


def _henon_box(lo_map: HenonByHand, hi_map: HenonByHand, lo: Point, hi: Point, side: int) -> Plane:
    """Exact range: each number occurs once."""
    x, y = rectangle(lo, hi)
    bent = 1.0 - Interval(lo_map.a, hi_map.a) * x**2
    return plane((bent + y, Interval(lo_map.b, hi_map.b) * x), side, 0)


class SmallThrow(NamedTuple):
    """The throw of the small-angle model as a user writes it down from the paper."""

    kappa: float
    h: float
    rho2: float
    a: np.ndarray
    d: np.ndarray
    ell: np.ndarray
    shift: np.ndarray
    next: np.ndarray


def _small_margin(p: Any, x: Any, side: int) -> Any:
    a, d, reach = p.a[side], p.d[side], x - p.a[side]
    own = a**2 + d**2
    omega = (p.rho2 - a * reach + own + d * p.h) / (p.rho2 + own)
    barrier = p.kappa * (a**2 / (p.ell[side] + d)) - 2.0 * (a * reach)
    return 0.5 * (p.rho2 + own) * (omega * abs(omega)) - barrier


def _small_on(p: Any, x: Any, side: int, branch: int) -> Any:
    after = x - p.h * (2.0 * (x - p.a[side]) / p.kappa)
    if branch == 1:
        return after - p.shift[side], int(p.next[side])
    return after, side


def _small(p: Any, x: Any, side: int) -> Any:
    branch = 1 if _small_margin(p, x, side) > 0.0 else 0
    after, to = _small_on(p, x, side, branch)
    return after, to, branch


ls.register(LogisticDerived, image=image.methods[maps.Logistic], image_on=forced.methods[maps.Logistic])
ls.register(LeslieDerived, image=_leslie, dimension=2)
ls.register(HenonByHand, image=image.methods[maps.Henon], image_box=_henon_box, dimension=2)
ls.register(SmallThrow, image=_small, image_on=_small_on, margin=_small_margin, branches=("jog", "flip"))


def small_throw() -> tuple[Any, Any]:
    """The throw map of paper-designed with small angles, and the same as a user's map."""
    throw = ls.load("paper-designed").map._replace(flight=SmallAngle())
    a, d = throw.a, throw.d
    after = np.roll(np.arange(a.size), -1)
    shift = a + throw.length[after] - a[after]
    rho2 = throw.radius_of_gyration**2
    own = SmallThrow(throw.kappa, throw.surface_height, rho2, a, d, np.hypot(a, d), shift, after)
    return throw, maps.coerce(own)


THROW = small_throw()
PAIRS = {
    "logistic": (maps.Logistic(3.9), LogisticDerived(3.9), np.linspace(0.0, 1.0, 200_001)),
    "Henon": (HenonByHand(), maps.Henon(), (np.linspace(-2.0, 2.0, 401),) * 2),
    "Leslie": (maps.Leslie(), LeslieDerived(), tuple(np.linspace(0.0, end, 401) for end in (90.0, 70.0))),
    "throw, small angles": (*THROW, np.linspace(float(THROW[0].a[2]) + 0.1, THROW[0].arm_length, 200_001)),
}


def widths(found: Any) -> np.ndarray:
    """Width of the first coordinate of each cell's boxes, the sum where there are two."""
    total = 0.0
    for lo, hi in found.hulls.values():
        first, last = (end.reshape(end.shape[0], -1)[:, 0] for end in (lo, hi))
        total = total + np.where(first <= last, last - first, 0.0)
    return np.asarray(total)


@pytest.mark.parametrize("name", PAIRS)
def test_derived_boxes(benchmark, name, table):
    hand, derived, edges = PAIRS[name]
    side = 2 if "throw" in name else 0

    def ours():
        return enclosures(derived, derived, edges, side)

    turns = take_turns(benchmark, ours, {"by hand": lambda: enclosures(hand, hand, edges, side)}, rounds=9)
    own, theirs = widths(turns.answer), widths(turns.answers["by hand"])
    real = theirs > 0.0
    ratio = own[real] / theirs[real]
    assert not turns.answer.lost.any()
    assert np.median(ratio) < 1.001
    for what, value in (("median", np.median(ratio)), ("mean", ratio.mean()), ("largest", ratio.max())):
        table.append(limit(f"boxes of {name}, derived: {what} width to that by hand", float(value), "", None))
    table.append(versus(f"boxes of {name}, derived, a cell", turns, "by hand", unit="ns", per=own.size))


# ----------------------------------------------------------------
# Every periodic orbit of Henon's map up to period 16, and that the list is complete.

# Galias, "Interval methods for rigorous investigations of periodic orbits", 2001; of period 1 also the one outside.
HENON_ORBITS = (2, 1, 0, 1, 0, 2, 4, 7, 6, 10, 14, 19, 32, 44, 72, 102)


def henon_step(x, y, a, b):
    return 1 - a * x**2 + y, b * x


def test_all_periodic_orbits_of_henon(table, tmp_path):
    """One file of 316 orbits; its recheck searches the rectangle again."""
    henon = ls.map(henon_step, a=1.4, b=0.3)
    rectangle = ls.grid([(-1.5, 1.5), (-0.5, 0.5)], cells=16)
    ls.certify(henon, rectangle, ["all-cycles"], period=2)  # compiled
    begin = perf_counter()
    proof = ls.certify(henon, rectangle, ["all-cycles"], period=len(HENON_ORBITS))
    proved = perf_counter()
    counts = tuple(sum(cycle.period == p for cycle in proof.cycles) for p in range(1, len(HENON_ORBITS) + 1))
    assert proof.proved
    assert counts == HENON_ORBITS
    file = proof.save(tmp_path / "henon.proof.zip", recheck=False)
    table.append(limit("all 316 orbits of Henon's map to period 16, proved", proved - begin, "s", None))
    begin = perf_counter()
    assert recheck(file).verdict == "proved"
    table.append(limit("the same list rechecked as complete", perf_counter() - begin, "s", None))
