"""Numbers along an attractor: topological entropy of its own bands, errors of means; against other ways to them."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.parameters.atlas.of_topology import topology
from limitsets.parameters.atlas.plan import registered
from limitsets.parameters.atlas.subjects import SceneSubject
from limitsets.systems.maps import advance

UNIT = [(0, 1)]


def letters(turns_down, x, step, count=48):
    """Say of an orbit which points lie where the map falls."""
    found = []
    for _ in range(count):
        found.append(turns_down(x))
        x = step(x)
    return found


def is_less(one, other):
    """Order of kneading sequences (Milnor and Thurston): each letter where the map falls turns the order round."""
    turned = False
    for a, b in zip(one, other, strict=True):
        if a != b:
            return b != turned
        turned ^= a
    return False


def entropy_of(falls, image, step):
    """Entropy of a map of one turning point: logarithm of the slope of the tent with its kneading sequence."""
    known, lo, hi = letters(falls, image, step), 1.0, 2.0
    for _ in range(50):
        slope = 0.5 * (lo + hi)
        tent = letters(lambda x: x > 0.5, 0.5 * slope, lambda x, s=slope: s * min(x, 1.0 - x))
        lo, hi = (slope, hi) if is_less(tent, known) else (lo, slope)
    return math.log(lo)


def logistic_entropy(r, bands):
    """Of the logistic map on `bands` bands: F^bands has one turning point on that about 1/2."""

    def through(x):
        slope = 1.0
        for _ in range(bands):
            slope, x = slope * r * (1.0 - 2.0 * x), r * x * (1.0 - x)
        return x, slope

    return entropy_of(lambda x: through(x)[1] < 0.0, through(0.5)[0], lambda x: through(x)[0]) / bands


def test_entropy_is_that_of_the_attractor_alone():
    # both lie in the window of period three: between the bands there is a Cantor set of entropy 0.4812
    found = ls.atlas(
        maps.Logistic(3.8), "r=3.84:3.8536:2", domain=UNIT, variables=["entropy", "period", "bands"]
    )
    entropy = found.dataset["entropy"].values[:, 0]
    assert found.dataset["period"].values[:, 0].tolist() == [3, 0]
    assert entropy[0] == 0.0
    assert entropy[1] == pytest.approx(logistic_entropy(3.8536, 3), abs=1e-6)
    assert entropy[1] == pytest.approx(0.1604, abs=5e-5)


@pytest.mark.parametrize(("r", "bands"), [(3.7, 1), (3.9, 1), (3.62, 2), (3.58, 4)])
def test_entropy_of_bands(r, bands):
    found = ls.atlas(maps.Logistic(3.8), f"r={r}:4:2", domain=UNIT, variables=["entropy", "bands"])
    assert found.dataset["bands"].values[0, 0, 0] == bands
    assert found.dataset["entropy"].values[0, 0] == pytest.approx(logistic_entropy(r, bands), abs=1e-6)


def flips_of(scene, lo, hi, throws, starts):
    """Flips per throw along many orbits that begin between two places of side 2."""
    x, side = np.random.default_rng(5).uniform(lo, hi, starts), np.full(starts, 2)
    x, side, _, _ = advance(scene.map, x, side, 2000)
    flips = np.zeros(starts)
    for _ in range(throws):
        x, after, _, _ = advance(scene.map, x, side, 1)
        flips += after != side
        side = after
    return flips / throws


def test_the_error_of_the_flips_is_honest():
    # visits of up to 534 jogs: one orbit of 10 000 throws scatters by 8 %
    at = {"throw.speed": "178.784 deg/s", "arm.surface_height": "-0.0754 in"}
    axes = ("throw.speed=178.784:178.785:2", "arm.surface_height=-0.0754:-0.0753:2")
    wanted = ["flips_per_throw", "flips_per_throw_error", "lowest", "reach"]
    found = ls.atlas("paper-designed", *axes, variables=wanted).dataset.isel(
        {"throw.speed": 0, "arm.surface_height": 0, "attractor": 0}
    )
    mean, error = (float(found[name]) for name in wanted[:2])
    lo, hi = (float(found[name][2]) for name in wanted[2:])
    others = flips_of(ls.load("paper-designed").with_values(at), lo, hi, 10_000, 200)
    assert abs(mean - others.mean()) <= 3.0 * error
    assert 0.6 * others.std() <= error <= 2.0 * others.std()


def test_errors_of_means_cover_the_mean():
    """Points of a small window have means that hardly differ: each scatters about them as its error says."""
    wanted = ["flips_per_throw", "flips_per_throw_error", "lyapunov", "lyapunov_error", "attractors"]
    found = ls.atlas(
        "paper-designed",
        "throw.speed=178.784:178.7841:10",
        "arm.surface_height=-0.07541:-0.0754:10",
        variables=wanted,
    ).dataset
    for name in ("flips_per_throw", "lyapunov"):
        mean, error = found[name].values[..., 0].ravel(), found[f"{name}_error"].values[..., 0].ravel()
        off = np.abs(mean - np.nanmean(mean)) / error
        assert (off <= 2.0).mean() >= 0.9
        assert (off <= 0.5).mean() <= 0.6  # nor is the error far too large


def test_the_page_explains_every_number_of_the_topology():
    """docs/json.md sends to this table for the names of an atlas."""
    page = (Path(__file__).parents[2] / "docs" / "atlas.md").read_text(encoding="utf-8")
    section = page.split("## What is said of each point\n", 1)[1].split("\n## ", 1)[0]
    explained = {
        name
        for line in section.splitlines()
        if line.startswith("| `")
        for name in re.findall(r"`(\w+)`", line.split("|")[1])
    }
    subject = SceneSubject(ls.load("paper-designed"))
    assert explained == {*registered(topology).variables(subject, margin="throw.speed")}
