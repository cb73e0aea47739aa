"""Feeding of parts that are laid down in ranges: proofs, their certificates, forged ones, and random starts."""

import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest

import limitsets as ls
from limitsets.cell.feeding.falling import arm_end_of
from limitsets.cell.feeding.paths import Paths
from limitsets.cell.feeding.proving import proved_feeding, write_proof
from limitsets.systems.maps import advance
from tests.feeding.scenes import with_cavity

LAID = {0: [(6, 14)], 2: [(9, 19)]}


@pytest.fixture(scope="module")
def fed(tmp_path_factory):
    """On paper-initial starts on side 1 feed side 1: what is laid down on side 0 far in feeds side 2."""
    end = arm_end_of(with_cavity(position="20.5 in"), laid=LAID)
    proof, file = proved_feeding(end), tmp_path_factory.mktemp("fed") / "fed.proof.zip"
    return end, proof, write_proof(file, proof, end)


def forged(path, target, change):
    with zipfile.ZipFile(path) as file:
        header, arrays = json.loads(file.read("header.json")), file.read("arrays.npz")
    change(header["claims"][0]["section"])
    with zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as file:
        file.writestr("header.json", json.dumps(header))
        file.writestr("arrays.npz", io.BytesIO(arrays).getvalue())
    return ls.recheck(target)


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
    report = forged(fed[2], tmp_path / "f.zip", lambda section: section.update(laid=said))
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
    assert forged(file, tmp_path / "f.zip", lambda section: section.pop("laid")).verdict == "failed"
    elsewhere = {"1": [[(12.0).hex(), (19.0).hex()]]}
    assert (
        forged(file, tmp_path / "f.zip", lambda section: section.update(laid=elsewhere)).verdict == "failed"
    )


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
