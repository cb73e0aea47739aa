"""Proved end points of limit sets: against 40-digit orbits, sampled images, orbits, and maps that contract."""

import dataclasses
from functools import cache

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.proofs.prover.attraction import attraction, trapping
from limitsets.proofs.prover.certifying import certify
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.end_points import UnionImages, proved_ends, proved_pieces_of
from limitsets.proofs.prover.parameters import parameter_box
from tests.sets.part import Part
from tests.test_paper import LIMIT_SETS

# Sides and places of the critical points that the limit set approaches.
KEPT = {
    "paper-initial-small-angle": [(0, 20), (1, 20), (2, 20)],
    "paper-designed-small-angle": [(1, 10), (2, 20)],
    "paper-initial": [(0, 20), (2, 20)],
    "paper-designed": [(2, 20)],
}
NAMES = ("jog", "flip")

# Attracting fixed points, and an attracting orbit of three flips.
CONTRACTING = {"throw.kappa": "12.21 in", "arm.surface_height": "-1.73 in"}


@cache
def cells_of(name, noise=None, cells=2048):
    scene = ls.load(name)
    return attraction(cover(parameter_box(scene, noise={"throw.speed": noise} if noise else None), cells))


@cache
def ends_of(name, noise=None):
    return proved_ends(cells_of(name, noise))


def between(end, x):
    lo, hi = sorted((end.outer, end.inner))
    return lo <= x <= hi


@pytest.mark.parametrize("name", LIMIT_SETS)
def test_the_brackets_hold_the_table(name):
    found = ends_of(name)
    assert found.reason == ""
    assert found.width < (1e-12 if "small" in name else 2e-11)
    assert {side: len(parts) for side, parts in found.extents.items()} == {
        side: len(parts) for side, parts in LIMIT_SETS[name].items()
    }
    for side, parts in LIMIT_SETS[name].items():
        for (low, high), (lo, hi) in zip(found.extents[side], parts, strict=True):
            # the table's last digit is rounded
            assert low[0] - 1e-12 < lo < low[1] + 1e-12
            assert high[0] - 1e-12 < hi < high[1] + 1e-12
            assert low[0] < low[1] < high[0] < high[1]


@pytest.mark.parametrize("name", LIMIT_SETS)
def test_the_brackets_hold_the_ends_at_40_digits(name):
    found, part = ends_of(name), Part(name)
    assert [(one.side, round(one.lo)) for one in found.critical] == KEPT[name]
    for one in found.critical:
        assert one.lo < part.critical_point(one.side, one.lo) < one.hi
        assert (one.before, one.after) == (0, 1)
        assert one.hi - one.lo < 1e-11
    for end in found.ends:
        side = end.critical.side
        x = part.critical_point(side, end.critical.lo)
        for branch, (lo, hi) in zip(end.branches, end.orbit[:-1], strict=True):
            assert lo < x < hi
            x, side = part.throw(x, side, NAMES[branch])
        assert side == end.side
        assert end.orbit[-1][0] < x < end.orbit[-1][1]
        assert between(end, x)


@pytest.mark.parametrize("name", LIMIT_SETS)
def test_a_long_orbit_stays_inside_and_comes_near_the_ends(name):
    scene, found = ls.load(name), ends_of(name)
    path = ls.orbit(scene.map, 15.0, 2, 200_000)
    x, side = path.x[5000:], path.side[5000:]
    for s, parts in found.extents.items():
        mine, held = np.sort(x[side == s]), 0
        for (lo, _), (_, hi) in parts:
            here = mine[(mine >= lo) & (mine <= hi)]
            held += here.size
            assert here[0] - lo < 2e-3
            assert hi - here[-1] < 2e-3
            assert np.diff(here).max() < 2e-2
        assert held == mine.size


def unions(name, seed):
    """Some intervals of the attracting cells."""
    rng = np.random.default_rng(seed)
    found = cells_of(name)
    for _ in range(6):
        yield {
            side: sorted(tuple(np.sort(rng.uniform(lo, hi, 2)).tolist()) for lo, hi in parts)
            for side, parts in found.cells.extents().items()
        }


def images_of(name):
    found = cells_of(name)
    tiles = {}
    for side, (edges,) in enumerate(found.cover.grid.edges):
        mine = np.flatnonzero(found.component[found.cover.grid.of_side(side)] >= 0)
        tiles[side] = proved_pieces_of(found.cover.box, side, edges[mine], edges[mine + 1])
    return UnionImages(found.cover.box, tiles)


@pytest.mark.parametrize("name", ["paper-initial", "paper-designed-small-angle"])
def test_images_of_intervals_against_sampled_ones(name):
    scene, images, step = ls.load(name), images_of(name), 1e-3
    assert sum(map(len, images.tiles.values())) < 20  # cut where the branch changes, not elsewhere
    for union in unions(name, 5):
        outer, inner = images.outward(union), images.inward(union)
        sampled = {side: [] for side in range(3)}
        for side, parts in union.items():
            for lo, hi in parts:
                got = ls.maps.images(scene.map, np.linspace(lo, hi, int((hi - lo) / step) + 2), side)
                for to in range(3):
                    sampled[to].append(got.x[got.side == to])
        for to in range(3):
            x = np.sort(np.concatenate(sampled[to]))
            held = np.zeros(x.size, dtype=bool)
            for lo, hi in outer.get(to, []):
                held |= (x > lo) & (x < hi)
            assert held.all()
            for lo, hi in inner.get(to, []):
                assert np.diff(x[(x > lo) & (x < hi)], prepend=lo, append=hi).max() < 2.0 * step


def test_noise_widens_the_brackets_and_keeps_their_order():
    exact, noisy = ends_of("paper-designed"), ends_of("paper-designed", "0.1 %")
    assert noisy.reason == ""
    for one, other in zip(exact.ends, noisy.ends, strict=True):
        away = 1.0 if one.which == "hi" else -1.0
        assert away * (other.outer - one.outer) > 0.0
        assert away * (one.inner - other.inner) > 0.0
        assert abs(other.outer - other.inner) < 0.2


def test_nothing_is_claimed_to_be_inside_where_the_map_contracts():
    scene = ls.load("paper-designed").with_values(CONTRACTING)
    found = proved_ends(attraction(cover(parameter_box(scene), 2048)))
    assert "see periodic orbits" in found.reason
    assert found.width == np.inf
    assert all(end.inner is None and end.critical is None for end in found.ends)
    assert all(hi - lo < 1e-9 for parts in found.extents.values() for (lo, _), (_, hi) in parts)


def test_without_attracting_cells_there_are_no_ends():
    found = cells_of("paper-designed")
    none = dataclasses.replace(found, component=np.full_like(found.component, -1))
    assert proved_ends(none).ends == ()
    assert proved_ends(none).reason == "there are no attracting cells"
    assert trapping(none) == "there are no attracting cells"


# ---------------------------------------------------------------- trapping


@pytest.mark.parametrize("name", LIMIT_SETS)
def test_the_attracting_cells_are_trapping(name):
    assert trapping(cells_of(name)) == ""


@pytest.mark.parametrize("which", [0, -1])
def test_cells_without_the_first_or_last_are_not_trapping(which):
    found = cells_of("paper-designed")
    fewer = found
    for _ in range(40):  # the cells exceed the limit set by some
        mine = np.flatnonzero(
            (fewer.component >= 0) & (np.arange(found.component.size) >= found.cover.grid.offset[2])
        )
        component = fewer.component.copy()
        component[mine[which]] = -1
        fewer = dataclasses.replace(fewer, component=component)
    assert trapping(fewer).startswith("not interior to the component is the image of side")


def test_an_image_that_ends_on_the_border_is_not_interior():
    found = cells_of("paper-designed")
    (lo, _), *_ = [pair for (to, _), pair in found.cover.images[1].hulls.items() if to == 2]
    least = np.flatnonzero(found.component[found.cover.grid.of_side(1)] >= 0)[0]
    edges = found.cover.grid.edges[2][0]
    bottom = edges[np.flatnonzero(found.component[found.cover.grid.of_side(2)] >= 0)[0]]
    before = lo[least]
    try:
        lo[least] = np.nextafter(bottom, np.inf)
        assert trapping(found) == ""
        lo[least] = bottom
        assert "side 1" in trapping(found)
    finally:
        lo[least] = before


# ---------------------------------------------------------------- as claims


def test_claims_and_their_sections():
    proof = certify("paper-initial", ["end-points", "trapping"])
    assert [(claim.claim, claim.verdict) for claim in proof.claims] == [
        ("end-points", "proved"),
        ("trapping", "proved"),
    ]
    section = proof.claims[0].section
    assert len(section["ends"]) == 8
    first = section["ends"][0]
    assert float.fromhex(first["outer"]) < 13.522673689975 < float.fromhex(first["inner"])
    assert (first["side"], first["which"]) == (0, "lo")
    assert proof.claims[1].section == {}


def test_a_tolerance_is_refused():
    with pytest.raises(AnswerError, match="without a tolerance"):
        certify("paper-designed", ["end-points"], tolerance={"throw.kappa": "0.1 %"})
