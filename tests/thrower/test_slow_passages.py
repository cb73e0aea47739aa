"""Hard throws: slow passages, bounds of a turn, several roots, and their machine code."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from llvmlite.binding import get_host_cpu_features
from mpmath import mp, mpf

import limitsets as ls
from limitsets import maps
from limitsets.feeder.thrower import Throw, flight_box as boxes, throw_map
from limitsets.feeder.thrower.flight import V0, V1, V2, V3, V4, V5, V6, V7, W0, W1, W2, W3, W4, W5, W6, W7
from limitsets.feeder.thrower.traced import impact_angles
from limitsets.numbers.interval import Interval
from limitsets.systems.cells import Domain
from limitsets.systems.graph.images.enclosed import enclosures
from limitsets.systems.maps import OUTSIDE_MODEL, images
from limitsets.systems.sets import limit_set_of

# ----------------------------------------------------------------
# Passages of about a million throws: counted right, and never taken for an end of the orbit or of a limit set.
# A map x' = x + D(x) with small D crosses from x0 to x1 in
#     N = integral of dx / D + ln(D(x1) / D(x0)) / 2 + O(D')
# steps, the flow that interpolates the map (Julia's equation) to second order.  The angle phi of the impact gives
# both x and D of a jog in closed form, so that N is one integral, taken here at 40 digits.
# Where a jog is what the part does, D is convex in phi as long as the centre of mass is right of the vertex (its
# second derivative is X), and D = 0 at phi = 0: for h > 0 it has one more zero there.


mp.dps = 40

A, D, KAPPA, RHO = 2.0, 1.0, 12.0, 1.25
ARM = 40.0


def part(h: float, kappa: float = KAPPA) -> Throw:
    """Three equal sides that are like no triangle's: only side 0 is asked."""
    sides = {"a": [A] * 3, "d": [D] * 3, "length": [2.0 * A] * 3, "corner": [2.0] * 3}
    return throw_map(**sides, radius_of_gyration=RHO, kappa=kappa, surface_height=h, arm_length=ARM)


def x_of(phi: mpf, kappa: float = KAPPA) -> mpf:
    """Start that lands at phi: f(phi) = 0 solved for R."""
    return (A * mp.sin(phi) - D * (1 - mp.cos(phi))) / phi + mpf(kappa) * phi / 2


def rate(phi: mpf, kappa: float = KAPPA) -> mpf:
    """Derivative of `x_of`."""
    low = A * mp.sin(phi) - D * (1 - mp.cos(phi))
    return (A * mp.cos(phi) - D * mp.sin(phi)) / phi - low / phi**2 + mpf(kappa) / 2


def moved(phi: mpf, h: mpf) -> mpf:
    return A * (1 - mp.cos(phi)) - D * (phi - mp.sin(phi)) - h * phi


def throws_between(one: mpf, two: mpf, h: mpf, peaks: list[mpf], kappa: float = KAPPA) -> mpf:
    """N from angle to angle."""
    total = mp.quad(lambda phi: rate(phi, kappa) / moved(phi, h), [one, *peaks, two])
    return total + mp.log(moved(two, h) / moved(one, h)) / 2


def test_an_orbit_that_needs_a_million_throws_to_get_away_from_the_vertex() -> None:
    h = -2e-5
    first, last = mpf("1e-8"), mpf("1e-2")
    peaks = [mpf(10) ** -k for k in (7, 6, 5, 4, 3)]
    expected = throws_between(first, last, mpf(h), peaks)
    start, end = float(x_of(first)), float(x_of(last))
    path = ls.orbit(part(h), start, 0, 3_000_000)
    count = int(np.argmax(path.x >= end))
    assert 1e6 < count < 3e6
    # D = 2e-13 at first, where rounding x' by 2e-16 either way makes a throw in a thousand uncertain, and 2e-8 at last.
    assert count == pytest.approx(float(expected), rel=2e-4)
    assert path.stopped is None or path.code[-1] < 0


def test_inside_the_fixed_point_of_a_jog_with_h_above_0_the_part_creeps_to_the_vertex() -> None:
    h = 1e-4
    params = part(h)
    still = mp.findroot(lambda p: moved(p, mpf(h)), 2 * h / A)  # the unstable zero, near 2 h / a
    one, two = still * mpf("0.9"), still * mpf("1e-3")
    peaks = [still * mpf(10) ** -k for k in (1, 2)]
    expected = throws_between(one, two, mpf(h), peaks)
    path = ls.orbit(params, float(x_of(one)), 0, 2_000_000)
    count = int(np.argmax(path.x <= float(x_of(two))))
    # D = 1e-11 at last: rounding makes 2e-5 of those throws uncertain.
    assert count == pytest.approx(float(expected), rel=1e-5)
    # It never arrives: its throws round away, which is said, and is neither a fixed point nor an exit.
    assert path.stopped == "stalled"
    assert (np.diff(path.x) < 0.0).all()
    assert path.x[-1] > A
    assert (path.code == maps.JOG).all()


def test_ends_that_creep_are_not_at_rest() -> None:
    """Throws of 1e-16 of the arm: the ends stand still as numbers, and all the same all of it runs to the vertex."""
    fast = part(1e-5, kappa=1e11)
    held = limit_set_of(fast, {0: [(3.0, 5.0)]}, Domain([[2.1]] * 3, [[ARM]] * 3, [A] * 3))
    assert not held.converged
    assert "creeps" in str(held.advice)


def test_an_attractor_of_throws_that_round_away_says_so() -> None:
    scene = ls.load("paper-designed").with_values({"throw.kappa": "1e11 in", "arm.surface_height": "1e-7 in"})
    found = ls.analyse(scene, cells=32, throws=100)
    assert found.attractors
    assert all(attractor.stopped == "stalled" for attractor in found.attractors)
    assert not any(limit.converged for limit in found.limit_sets)
    assert found.extents_from == ("cells",) * len(found.attractors)
    path = ls.orbit(scene.map, 15.0, 2, 100)
    assert path.stopped == "stalled"
    assert path.code.size == 0


# ----------------------------------------------------------------
# The bounds of `turn_box`, proved in exact rationals; and both versions of `turn` against mpmath.


U = Fraction(1, 2**53)
W = [Fraction(c) for c in (W0, W1, W2, W3, W4, W5, W6, W7)]
V = [Fraction(c) for c in (V0, V1, V2, V3, V4, V5, V6, V7)]
# t = phi/8 is exact; pi < 355/113 bounds it.
T = Fraction(355, 113) / 4
Q = T * T


def series_relative_error(coefficients, shift):
    """Relative error of the computed t^p (c0 + q c1 + ...) against the function, for 0 <= t <= T.

    The sum is at least c0 - |c1| Q; rounding is followed through Horner's scheme term by term.
    """
    exact = [Fraction((-1) ** k, math.factorial(2 * k + shift)) for k in range(len(coefficients))]
    size, error = abs(coefficients[-1]), Fraction(0)
    for c in reversed(coefficients[:-1]):
        error = error * Q * (1 + U) ** 2 + 3 * U * size * Q  # q known to u, product rounded
        size = size * Q * (1 + 3 * U) + abs(c)
        error = error * (1 + U) + U * size
    truncated = Q ** len(exact) / math.factorial(2 * len(exact) + shift)
    coefficient = sum(abs(c - x) * Q**k for k, (c, x) in enumerate(zip(coefficients, exact, strict=True)))
    smallest = exact[0] - abs(exact[1]) * Q
    relative = (error + truncated + coefficient) / smallest
    return (1 + relative) * (1 + U) ** 4 - 1  # the powers of t in front: q and up to three products


def doubled(angle, ew, ev, es):
    """Errors after one doubling, from angles up to `angle` <= pi.

    |error of s| <= es phi, |error of v| <= ev phi^2/2, |error of w| <= ew w.  With s <= phi and v <= phi^2/2:
    w' = 2 (w + s v) >= 2 w, and phi v <= 3 w, phi^3/2 <= 5 w for phi <= pi (both ratios are monotone; at pi 2, 4.94);
    v' = 2 s^2 against phi'^2/2 = 2 phi^2;  s' = 2 s (1 - v), |1 - v| <= 1, against phi' = 2 phi.
    """
    new_w = (1 + ew + 3 * es + 5 * ev + 5 * es * ev) * (1 + U) ** 2 - 1
    new_v = (1 + es) ** 2 * (1 + U) - 1
    absolute_v = ev * angle * angle / 2
    new_s = (1 + es) * (1 + absolute_v + U * (1 + absolute_v)) * (1 + U) - 1
    return new_w, new_v, new_s


def test_the_bound():
    ew = series_relative_error(W, 3)
    ev = series_relative_error(V, 2)
    es = ew * Q / 6 * 2 + U  # s = t - w, w <= t Q / 6
    angle = T
    for _ in range(3):
        ew, ev, es = doubled(angle, ew, ev, es)
        angle *= 2
    # s -+ BOUND phi, and so on: a product or two and a sum round, by U of phi, of phi^2 and of w at most, and the
    # results are clipped to what they may be.
    assert ew + 4 * U < Fraction(boxes.BOUND)
    assert es + 4 * U < Fraction(boxes.BOUND)
    assert ev / 2 + 4 * U < Fraction(boxes.BOUND)
    assert angle >= 2 * Fraction(math.pi)
    assert math.pi**3 / 2 < 5 * math.pi


def test_enclosures_hold_against_mpmath():
    rng = np.random.default_rng(3)
    angles = np.concatenate([rng.uniform(0, 2 * np.pi, 500), 10.0 ** rng.uniform(-200, 0.7, 500)])
    angles = np.concatenate([angles, np.arange(0, 9) * np.pi / 4])
    with mpmath.workdps(450):
        for phi in angles[angles <= 2 * np.pi].tolist():
            p = mpmath.mpf(phi)
            exact = (mpmath.sin(p), 1 - mpmath.cos(p), p - mpmath.sin(p))
            for box, value in zip(boxes.turn_point(phi)[1:], exact, strict=True):
                assert box.lo <= value <= box.hi


def test_boxes_hold_their_points_and_their_extremes():
    rng = np.random.default_rng(4)
    for lo, hi in np.sort(rng.uniform(0, 2 * np.pi, (500, 2)), axis=1).tolist():
        phi = np.linspace(lo, hi, 7)
        exact = (np.sin(phi), 1 - np.cos(phi), phi - np.sin(phi))
        for box, values in zip(boxes.turn_box(Interval(lo, hi))[1:], exact, strict=True):
            assert box.lo <= values.min() + 1e-15
            assert values.max() - 1e-15 <= box.hi


# ----------------------------------------------------------------
# Boxes where kappa < ell: several roots, a first root that jumps, impacts that graze, none within a full turn.


@pytest.mark.parametrize("kappa", [4.0, 2.0, 1.0, 0.3])
@pytest.mark.parametrize("side", [0, 1, 2])
def test_enclosures_hold_whatever_the_number_of_roots(kappa, side):
    """The point map finds the smallest root by a march of its own (`tests/thrower` holds it against 50 digits)."""
    scene = ls.load("paper-designed").with_values({"throw.kappa": kappa})
    a = scene.map.a[side]
    edges = np.linspace(a * (1.0 + 1e-6), min(28.0, 3.0 * kappa + a), 1501)
    found = enclosures(scene.map, scene.map, edges, side)
    rng = np.random.default_rng(5)
    for _ in range(5):
        x = rng.uniform(edges[:-1], edges[1:])
        got = images(scene.map, x, side)
        flown = (got.code > OUTSIDE_MODEL) & ~found.lost
        inside = np.zeros(x.size, dtype=bool)
        for (to, _), (lo, hi) in found.hulls.items():
            # the point map rounds, by some 1e-15 of the lengths involved
            slack = 1e-13 * (np.abs(x) + np.abs(got.x))
            inside |= (got.side == to) & (got.x >= lo - slack) & (got.x <= hi + slack)
        assert not (flown & ~inside).any()
        # but for the cell in which a full turn is reached, nothing is proved there
        beyond = got.code == OUTSIDE_MODEL
        assert not beyond.any() or found.lost[beyond].mean() > 0.9


def test_a_cell_on_which_the_impact_grazes_has_a_wide_bracket_and_is_still_enclosed():
    """kappa = 2, side 2: the first root jumps from one hump of the height to the next as x grows."""
    scene = ls.load("paper-designed").with_values({"throw.kappa": 2.0})
    edges = np.linspace(scene.map.a[2] * (1.0 + 1e-6), 8.0, 3001)
    found = enclosures(scene.map, scene.map, edges, 2)
    width = found.witness[1] - found.witness[0]
    wide = np.flatnonzero((width > 0.2) & ~found.lost)
    middle = 0.5 * (edges[1:] + edges[:-1])
    phi = impact_angles(scene.map, middle, 2)
    good = ~found.lost & np.isfinite(phi)
    assert ((found.witness[0] <= phi) & (phi <= found.witness[1]))[good].all()
    jumps = np.flatnonzero(np.diff(phi) > 0.2)
    assert jumps.size >= 1
    assert wide.size >= 1
    assert all(np.abs(wide - k).min() <= 1 for k in jumps if not found.lost[k])


# A start at the upper end of what is known of a: no reach is proved, and the march once never came back from there.
AT_A = """
import numpy as np
import limitsets as ls
from limitsets.systems.graph.images.enclosed import enclosures

scene = ls.load("paper-designed").with_values({"throw.kappa": 2.0})
wide = scene.map._replace(a=scene.map.a + 0.001)
for low, upper in ((scene.map, scene.map), (scene.map, wide)):
    found = enclosures(low, upper, upper.a[0] + np.array([0.0, 1e-9, 1.0]), 0)
    print(found.lost[0])
"""


def test_a_cell_that_begins_at_the_upper_end_of_a_is_answered():
    done = subprocess.run(
        [sys.executable, "-c", AT_A], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.stdout.split() == ["True", "True"], done.stderr


# ----------------------------------------------------------------
# What the compiler makes of kernels: operations fused, vectors as wide as the processor's, references counted.
# The formulas of the throw are written once and called on floats and on intervals: a bound must not be fused.


# In a process of its own with an empty cache: code that comes from the cache cannot be read.
READ = r"""
import json, re, sys
import numba
import numpy as np
import limitsets as ls
from limitsets.systems.graph.images.enclosed import _enclose, enclosures
from limitsets.systems.graph.images.sampled import _hulls
from limitsets.maps import drivers, images

fused = re.compile(r"\bvfn?m(add|sub)|\bvfm(addsub|subadd)")
x = np.linspace(8.0, 28.0, 50)
for flight, flip in json.loads(sys.argv[1]):
    scene = ls.load({**ls.load("paper-designed").as_dict(), "model": {"flight": flight, "flip": flip}})
    enclosures(scene.map, scene.map, x, 0)
    images(scene.map, x, 0)
ls.transitions(scene.map, ls.grid(scene.domain, cells=8))
codes = {"boxes": _enclose.inspect_asm(), "floats": drivers.fill_images.inspect_asm()}
found = {key: [len(fused.findall(code)) for code in found.values()] for key, found in codes.items()}
found["widest"] = [code.count("zmm") for code in codes["floats"].values()]
found["counted"] = [code.count("NRT_") for code in _hulls.inspect_asm().values()]
found["target"] = numba.core.registry.cpu_target.target_context.codegen().magic_tuple()
print(json.dumps(found))
"""

WIDE = bool(get_host_cpu_features().get("avx512vl"))


# each rule of the flip; the flight of second order has all terms of the small-angle one
MODELS = [("exact", "signed"), ("small-angle-2", "energy")]


@pytest.mark.sweep
def test_no_bound_is_fused_and_loops_are_as_wide_and_free_of_counting_as_they_can_be(tmp_path):
    # One of the processors for which LLVM by itself prefers vectors of 256 bits to those of 512 that it has.
    processor = {"NUMBA_CPU_NAME": "skylake-avx512"} if WIDE else {}
    environment = {**os.environ, **processor, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", READ, json.dumps(MODELS)]
    found = json.loads(subprocess.run(command, env=environment, check=True, capture_output=True).stdout)
    assert [len(found[key]) for key in ("boxes", "floats")] == [len(MODELS)] * 2
    assert not any(found["boxes"])
    # where the processor can, floats are fused: so the line above can fail
    assert all(found["floats"]) == bool(get_host_cpu_features().get("fma"))
    assert all(count > 0 for count in found["widest"]) == WIDE
    # numba's own key of compiled code has the features of the target, and `jit` puts it into the name of each file
    assert ("-prefer-256-bit" in found["target"][2]) == WIDE
    assert found["counted"] == [0]
