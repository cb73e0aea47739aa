"""Rigorous images, the proof of attraction and its recheck, beside the same images with other people's intervals."""

from __future__ import annotations

import importlib
import importlib.util
import os
import random
import subprocess
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest

import limitsets as ls
from limitsets.checker import recheck
from limitsets.systems.maps import images
from tests.bench.measure import limit, take_turns, versus
from tests.bench.python_proofs import cells, with_arb
from tests.proofs import forge, test_recheck

pytestmark = pytest.mark.bench

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
    done = subprocess.run(
        [sys.executable, str(script), "codac", "400"],
        capture_output=True,
        text=True,
        check=True,
        env=dict(os.environ),
    )
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


def test_no_enclosure_is_violated(table):
    """1e8 random points of random cells of random scenes lie in the images of their cells."""
    rng = np.random.default_rng(20)
    base = ls.load("paper-designed")
    points = violated = 0
    while points < 100_000_000:
        scene = base.with_values(
            {
                "throw.kappa": float(rng.uniform(8.0, 80.0)),
                "arm.surface_height": float(rng.uniform(-1.5, 0.5)),
                "part.mass.center.along": float(rng.uniform(2.5, 4.8)),
                "part.mass.center.above": float(rng.uniform(0.4, 1.2)),
            }
        )
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
