"""One throw, and the critical points, by every method there is: error against seconds."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from accuracy_points import Point, timed
from mpmath import mp, mpf

import limitsets as ls
from limitsets.feeder.thrower import Energy, SmallAngle, SmallAngle2
from limitsets.systems.graph.images.enclosed import enclosures

__all__ = ["SIDE", "critical_errors", "libm_map", "random_ratios", "throw_errors"]

SIDE = 2
STARTS, CHECKED = 4096, 64
DIGITS = 60  # of the reference
SMALL = {"small angle (the paper)": SmallAngle(), "small angle, second order": SmallAngle2()}


# ---------------------------------------------------------------- the model's formulas, in any arithmetic


class Facts(NamedTuple):
    """What the formulas need of one side [in]; numbers of any kind."""

    a: Any
    d: Any
    h: Any
    kappa: Any
    rho: Any


def facts_of(params: Any, side: int, number: Callable[[Any], Any] = float) -> Facts:
    """Read one side of a throw map."""
    return Facts(
        *map(number, (params.a[side], params.d[side], params.surface_height, params.kappa)),
        number(params.radius_of_gyration),
    )


def turned(p: Facts, x: Any, phi: Any, steps: int, sin: Any, cos: Any) -> Any:
    """Newton's method for the angle of the impact: so many steps from a first guess."""
    for _ in range(steps):
        s, c = sin(phi), cos(phi)
        height = x * phi - p.a * s + p.d * (1 - c) - p.kappa * phi * phi / 2
        phi = phi - height / (x - p.a * c + p.d * s - p.kappa * phi)
    return phi


def jog(p: Facts, x: Any, phi: Any, sin: Any, cos: Any) -> Any:
    """Where a jog ends."""
    return x - p.h * phi + p.a * (1 - cos(phi)) - p.d * (phi - sin(phi))


def margin(p: Facts, x: Any, phi: Any, sin: Any, cos: Any, root: Any) -> Any:
    """Return the number whose sign decides the flip: sgn(omega) K - sgn(X) V."""
    ell2 = p.a * p.a + p.d * p.d
    right, above = p.a * cos(phi) - p.d * sin(phi), p.a * sin(phi) + p.d * cos(phi)
    inertia = p.rho * p.rho + ell2
    omega = (p.rho * p.rho + right * (x - p.kappa * phi) + above * (p.h + p.d)) / inertia
    return inertia * omega * abs(omega) / 2 - p.kappa * (root(ell2) - above) * (right / abs(right))


def guess(p: Facts, x: Any) -> Any:
    """First guess of the angle: small angles, to second order."""
    return 2 * (x - p.a) / (p.kappa - p.d)


def in_digits(p: Facts, x: Any) -> Any:
    """Angle of the impact to the last digit of mpmath's present precision."""
    phi = guess(p, x)
    for _ in range(60):
        after = turned(p, x, phi, 1, mp.sin, mp.cos)
        if abs(after - phi) <= abs(phi) * mpf(10) ** (-mp.dps // 2 - 2):
            return turned(p, x, after, 1, mp.sin, mp.cos)
        phi = after
    return phi


# ---------------------------------------------------------------- a compiled map with libm's sine


class Libm(NamedTuple):
    """The same throw with libm's sin and cos and plain Newton steps, to be compared with: one side."""

    a: float
    d: float
    h: float
    kappa: float
    rho2: float
    ell: float
    steps: int


def _libm(p: Libm, x: float, side: int) -> tuple[float, int, int]:
    phi = 2.0 * (x - p.a) / (p.kappa - p.d)
    for _ in range(p.steps):
        s, c = math.sin(phi), math.cos(phi)
        height = x * phi - p.a * s + p.d * (1.0 - c) - 0.5 * p.kappa * phi * phi
        phi -= height / (x - p.a * c + p.d * s - p.kappa * phi)
    s, c = math.sin(phi), math.cos(phi)
    right, above = p.a * c - p.d * s, p.a * s + p.d * c
    inertia = p.rho2 + p.ell * p.ell
    omega = (p.rho2 + right * (x - p.kappa * phi) + above * (p.h + p.d)) / inertia
    barrier = p.kappa * (p.ell - above)
    flips = 0.5 * inertia * omega * abs(omega) > (barrier if right > 0.0 else -barrier)
    # Where it would jog to; a flip adds a constant, and only tells itself by the branch.
    return x - p.h * phi + p.a * (1.0 - c) - p.d * (phi - s), side, 1 if flips else 0


ls.register(Libm, image=_libm, branches=("jog", "flip"))


def libm_map(params: Any, side: int, steps: int) -> Libm:
    """Give one side of a throw map as `Libm`."""
    p = facts_of(params, side)
    return Libm(p.a, p.d, p.h, p.kappa, p.rho**2, math.hypot(p.a, p.d), steps)


# ---------------------------------------------------------------- x after one throw


def throw_errors(scene: Any, limit: tuple[float, float], seed: int = 0, quick: bool = False) -> list[Point]:
    """Largest error of x' (on the branch that is taken) over starts in the limit set, and seconds per throw."""
    params = scene.map
    x = np.random.default_rng(seed).uniform(*limit, STARTS)
    some = x[:CHECKED].tolist()
    with mp.workdps(DIGITS):
        p = facts_of(params, SIDE, mpf)
        exact = [jog(p, mpf(v), in_digits(p, mpf(v)), mp.sin, mp.cos) for v in some]
    least = 0.02 if quick else 0.5

    def worst(found: Any) -> float:
        with mp.workdps(DIGITS):
            pairs = zip(np.asarray(found)[:CHECKED].tolist(), exact, strict=True)
            return float(max(abs(mpf(a) - b) for a, b in pairs))

    points = []
    for name, flight in SMALL.items():
        model = params._replace(flight=flight, flip=Energy())
        found, _ = ls.maps.images_on(model, x, SIDE, 0)
        _, seconds = timed(lambda model=model: ls.maps.images(model, x, SIDE), least, 2000, 20)
        points.append(Point(name, 1, worst(found), seconds / STARTS))
    found, _ = ls.maps.images_on(params, x, SIDE, 0)
    _, seconds = timed(lambda: ls.maps.images(params, x, SIDE), least, 2000, 20)
    points.append(Point("exact, vectorised (limitsets)", 1, worst(found), seconds / STARTS))
    for steps in range(1, 7):
        rival = libm_map(params, SIDE, steps)
        found, seconds = timed(lambda rival=rival: ls.maps.images(rival, x, 0), least, 500)
        points.append(Point("exact, libm and Newton, compiled", steps, worst(found.x), seconds / STARTS))
    for name, kind in (("exact, numpy, float64", np.float64), ("exact, numpy, float32", np.float32)):
        p32 = facts_of(params, SIDE, kind)
        starts = x.astype(kind)
        for steps in range(1, 7):

            def run(steps: int = steps, p32: Facts = p32, starts: Any = starts) -> Any:
                phi = turned(p32, starts, guess(p32, starts), steps, np.sin, np.cos)
                margin(p32, starts, phi, np.sin, np.cos, np.sqrt)
                return jog(p32, starts, phi, np.sin, np.cos)

            found, seconds = timed(run, least, 500)
            points.append(Point(name, steps, worst(found.astype(np.float64)), seconds / STARTS))
    points.append(_enclosed(params, x, least))
    points += [_in_digits(params, some, exact, digits, quick) for digits in (20, 30, 50)]
    return points


def _enclosed(params: Any, x: Any, least: float) -> Point:
    """Proof kernel: cells one float wide, in runs of 4096; the error is the proved width."""
    runs = []
    for start in x[:4].tolist():
        offsets = np.arange(4097) * math.ulp(start)
        runs.append(start + offsets)
    found = [enclosures(params, params, run, SIDE) for run in runs]
    widths = [float((hi - lo)[hi >= lo].max()) for each in found for lo, hi in each.hulls.values()]
    _, seconds = timed(lambda: [enclosures(params, params, run, SIDE) for run in runs], least, 100)
    return Point("proof kernel (width)", 1, max(widths), seconds / (4 * 4096))


def _in_digits(params: Any, some: list[float], exact: list[Any], digits: int, quick: bool) -> Point:
    starts = some[: 4 if quick else 16]
    with mp.workdps(digits):
        p = facts_of(params, SIDE, mpf)

        def run() -> list[Any]:
            ends = []
            for v in map(mpf, starts):
                phi = in_digits(p, v)
                margin(p, v, phi, mp.sin, mp.cos, mp.sqrt)
                ends.append(jog(p, v, phi, mp.sin, mp.cos))
            return ends

        found, seconds = timed(run, 0.05, 5)
    with mp.workdps(DIGITS):
        error = max(abs(a - b) for a, b in zip(found, exact, strict=False))
        return Point("mpmath, 20, 30, 50 digits", digits, float(error), seconds / len(starts))


# ---------------------------------------------------------------- critical points


def _decide(p: Facts, x: Any) -> Any:
    return margin(p, x, in_digits(p, x), mp.sin, mp.cos, mp.sqrt)


def _exact_critical(scene: Any, digits: int) -> list[Any]:
    """First critical point of each side to so many digits: the secant method on the deciding number."""
    near = ls.critical_points(scene.map, scene.domain)
    found = []
    with mp.workdps(digits + 5):
        for side, points in near.items():
            p = facts_of(scene.map, side, mpf)

            start = mpf(points[0].x)
            found.append(mp.findroot(partial(_decide, p), (start, start + mpf("1e-9"))))
    return found


def _sectioned(scene: Any, kind: Any, parts: int = 64) -> list[float]:
    """First critical points in numpy: cut the side into parts, keep the first that changes its sign, cut it again."""
    found = []
    for side in range(len(scene.sides)):
        p = facts_of(scene.map, side, kind)
        lo, hi = kind(scene.sides.a[side] + 1.0), kind(scene.arm_length)
        while True:
            x = np.linspace(lo, hi, parts + 1).astype(kind)
            phi = turned(p, x, guess(p, x), 6, np.sin, np.cos)
            change = np.flatnonzero(margin(p, x, phi, np.sin, np.cos, np.sqrt)[1:] > 0)
            k = int(change[0])
            if not (lo < x[k] or x[k + 1] < hi) or x[k + 1] - x[k] <= 2 * np.spacing(x[k]):
                break
            lo, hi = x[k], x[k + 1]
        found.append(float(x[k + 1]))
    return found


def _bracketed(scene: Any, parts: int = 64) -> list[tuple[float, float]]:
    """First critical points between proved numbers: cells that may take both branches, cut again and again."""
    found = []
    for side in range(len(scene.sides)):
        lo, hi = float(scene.sides.a[side]) + 1.0, scene.arm_length
        for _ in range(12):
            edges = np.unique(np.linspace(lo, hi, parts + 1))
            hulls = enclosures(scene.map, scene.map, edges, side).hulls
            may = np.zeros((2, edges.size - 1), dtype=bool)
            for (_, branch), (low, high) in hulls.items():
                may[branch] |= low <= high
            both = np.flatnonzero(may.all(axis=0))
            first = int(np.flatnonzero(may[1])[0])
            cells = both[both <= first + both.size]
            bottom, top = (
                (edges[cells[0]], edges[cells[-1] + 1]) if cells.size else (edges[first], edges[first])
            )
            if not cells.size or top - bottom >= hi - lo:
                break
            lo, hi = float(bottom), float(top)
        found.append((lo, hi))
    return found


def critical_errors(scene: Any, quick: bool = False) -> list[Point]:
    """Largest error of the first critical points r_i of the three sides, and seconds for all three."""
    exact = _exact_critical(scene, DIGITS)
    least = 0.02 if quick else 0.4

    def worst(found: Any) -> float:
        with mp.workdps(DIGITS):
            return float(max(abs(mpf(a) - b) for a, b in zip(found, exact, strict=True)))

    def first(params: Any, samples: int) -> list[float]:
        found = ls.critical_points(params, scene.domain, samples=samples)
        return [points[0].x for points in found.values()]

    points = []
    for name, flight in SMALL.items():
        model = scene.map._replace(flight=flight, flip=Energy())
        found, seconds = timed(lambda model=model: first(model, 64), least)
        points.append(Point(name, 64, worst(found), seconds))
    for samples in (64, 512, 4096):
        found, seconds = timed(lambda samples=samples: first(scene.map, samples), least)
        points.append(Point("exact, vectorised (limitsets)", samples, worst(found), seconds))
    for name, kind in (("exact, numpy, float64", np.float64), ("exact, numpy, float32", np.float32)):
        found, seconds = timed(lambda kind=kind: _sectioned(scene, kind), least)
        points.append(Point(name, 64, worst(found), seconds))
    found, seconds = timed(lambda: _bracketed(scene), least)
    width = max(hi - lo for lo, hi in found)
    if not all(lo <= r <= hi for (lo, hi), r in zip(found, exact, strict=True)):
        raise ArithmeticError("a proved bracket does not hold the critical point")
    points.append(Point("proof kernel (width)", 64, width, seconds))
    for digits in (20, 30, 50):
        found, seconds = timed(lambda digits=digits: _exact_critical(scene, digits), 0.02, 2)
        points.append(Point("mpmath, 20, 30, 50 digits", digits, worst(found), seconds))
    return points


# ---------------------------------------------------------------- the small-angle model against the exact one


def random_ratios(count: int, seed: int = 0) -> Any:
    """r_small / r_exact of random parts on random arms, for those that flip in both models.

    Parts and throws of about the paper's size, all drawn evenly [in]: foot of the centre of mass 0.7 to 4.7 from the
    left vertex, 0.4 to 2.5 above it, radius of gyration 0.7 to 1.8, kappa 15 to 95, surface 0.1 to 1 below the joint.
    """
    random = np.random.default_rng(seed)
    a, d = random.uniform(0.7, 4.7, count), random.uniform(0.4, 2.5, count)
    rho, kappa = random.uniform(0.7, 1.8, count), random.uniform(15.0, 95.0, count)
    h = -random.uniform(0.1, 1.0, count)
    ell, inertia = np.hypot(a, d), rho**2 + a**2 + d**2
    # Closed form of the small-angle energy criterion.
    start = rho**2 + 2 * a**2 + d**2 + d * h
    under = 4 - 2 / inertia * (2 * start - 2 * a**2 - kappa * (ell - d))
    small = (start - inertia * (2 - np.sqrt(np.where(under > 0, under, np.nan)))) / a
    # The exact one along the angle of the impact, which grows with x.
    phi = np.linspace(1e-4, 2 * math.pi, 4001)[:, None]
    s, c = np.sin(phi), np.cos(phi)
    x = (a * s - d * (1 - c)) / phi + kappa * phi / 2
    right, high = a * c - d * s, a * s + d * c
    omega = (rho**2 + right * (x - kappa * phi) + high * (h + d)) / inertia
    flips = inertia * omega * np.abs(omega) / 2 > np.sign(right) * kappa * (ell - high)
    first = flips.argmax(axis=0)
    exact = np.where(flips.any(axis=0), x[first, np.arange(count)], np.nan)
    ratio = small / exact
    return ratio[np.isfinite(ratio) & (small > a)]
