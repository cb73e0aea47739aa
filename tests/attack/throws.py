"""The minimal map in floats, many orbits at once: the smallest positive root by a march that cannot step over one.

f'' >= -(ell + kappa) everywhere, so from a height f with slope f' the part is still up before the root of
f + f' s - (ell + kappa) s^2 / 2. Steps of that length come to the first root from below, quadratically where the part
comes down at a slope.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

JOG, FLIP, INWARD, OUTWARD, OUTSIDE = 0, 1, -1, -2, -3
TURN = 2 * math.pi


@njit(cache=True)
def height(x, a, d, kappa, phi):
    """Height of the left vertex and its two derivatives, without cancellation at small angles."""
    s, half = math.sin(phi), math.sin(0.5 * phi)
    gone = 2 * half * half
    f = (x - a) * phi + a * late(phi, s) + d * gone - 0.5 * kappa * phi * phi
    return f, (x - a) + a * gone + d * s - kappa * phi, a * s + d * (1 - gone) - kappa


@njit(cache=True)
def late(phi, s):
    """Return phi - sin(phi)."""
    if phi > 0.3:
        return phi - s
    q = phi * phi
    return phi * q * (1 / 6 - q * (1 / 120 - q * (1 / 5040 - q * (1 / 362880 - q / 39916800))))


@njit(cache=True)
def impact(x, a, d, kappa):
    """Angle at which the left vertex lands; nan if not within a full turn."""
    if not x > a:
        return math.nan
    bend = math.hypot(a, d) + kappa
    if kappa > bend - kappa:
        # concave: where it is down at a falling slope is the only root, however it was found
        phi = 2 * (x - a) / (kappa - d)
        for _ in range(8):
            f, slope, curve = height(x, a, d, kappa, phi)
            step = f / slope / (1 - 0.5 * f * curve / (slope * slope))
            if not (slope < 0.0 and step < phi):
                break
            phi -= step
            if abs(step) < 1e-7 * phi:
                return phi if phi <= TURN else math.nan
    phi = 0.0
    for _ in range(2000):
        f, slope, _ = height(x, a, d, kappa, phi)
        if phi > 0.0 and f <= 0.0:
            break
        root = math.sqrt(slope * slope + 2 * bend * f)
        step = 2 * f / (root - slope) if slope < 0.0 else (slope + root) / bend
        phi += step
        if step <= 1e-16 * phi:
            break
        if phi > TURN:
            return math.nan
    return phi


@njit(cache=True)
def throw(x, i, a, d, side, rho, kappa, h, arm, flight, flip, shift):
    """One throw: where the part comes to rest, on which side, and the code."""
    A, D = a[i], d[i]
    if flight == 0:
        phi = impact(x, A, D, kappa)
    elif flight == 1:
        phi = 2 * (x - A) / kappa
    else:
        phi = 2 * (x - A) / (kappa - D)
    if not (x > A and 0.0 < phi <= TURN):
        return x, i, OUTSIDE
    ell = math.hypot(A, D)
    M = rho * rho + ell * ell
    if flight == 0:
        c, s, half = math.cos(phi), math.sin(phi), math.sin(0.5 * phi)
        X, H = A * c - D * s, A * s + D * c
        om = (rho * rho + X * (x - kappa * phi) + H * (h + D)) / M
        K, V = 0.5 * M * om * om, kappa * (ell - H)
        jog = x - h * phi + 2 * A * half * half - D * late(phi, s)
        if flip == 1:
            over = K > V or X < 0
        elif X > 0:
            over = om > 0 and K > V
        else:
            over = not (om < 0 and K >= V)
    else:
        om = (rho * rho - A * x + 2 * A * A + D * D + D * h) / M
        K, V = 0.5 * M * om * om, kappa * (ell - D) - 2 * A * (x - A)
        jog = x - h * phi
        over = K > V if flip == 1 else (K if om > 0 else -K) > V
    if over:
        j = (i + 1) % a.size
        to = jog - A - (side[j] - a[j]) + shift
        code = FLIP
    else:
        j, to, code = i, jog + shift, JOG
    if not to > a[j]:
        return to, j, INWARD
    if to > arm:
        return to, j, OUTWARD
    return to, j, code


@njit(cache=True)
def note(k, n, side, x, ends, most, least, last_out):
    """Note where throw n of orbit k ends."""
    most[k, side] = max(most[k, side], x)
    least[k, side] = min(least[k, side], x)
    for piece in range(ends.shape[1]):
        if ends[side, piece, 0] <= x <= ends[side, piece, 1]:
            return
    last_out[k] = n


@njit(cache=True)
def fly(numbers, x, i, code, throws, kappa, shift, ends, most, least, run, longest, last_out):
    """Move all orbits on by some throws, all with the same kappa and shift at the same throw.

    code : 0 or 1 where an orbit is on the arm, else how it left; it is not moved then.
    ends : (sides, pieces, 2), nan where there is none: `last_out` is the last throw that ends in none of them.
    most, least : (orbits, sides), farthest and nearest places of rest.
    run, longest : jogs since the last flip, and the most of them.
    """
    a, d, side, rho, _, h, arm, flight, flip = numbers
    for k in range(x.size):
        at, on, how, jogs = x[k], i[k], code[k], run[k]
        for n in range(throws):
            if how < 0:
                break
            at, on, how = throw(at, on, a, d, side, rho, kappa[n], h, arm, flight, flip, shift[n])
            if how < 0:
                last_out[k] = n
                break
            if how == 1:
                jogs = 0
            else:
                jogs += 1
                longest[k] = max(longest[k], jogs)
            note(k, n, on, at, ends, most, least, last_out)
        x[k], i[k], code[k], run[k] = at, on, how, jogs


@njit(cache=True)
def luck():
    return np.random.random()  # noqa: NPY002 - what numba has


@njit(cache=True)
def chase(numbers, x, i, code, throws, lo, hi, e, weights, ends, most, least, run, longest, last_out, seed):
    """As `fly`, with noise chosen anew at every throw and for every orbit, each by a taste of its own.

    Of five throws within the noise (its corners and one at random) the orbit follows the one that scores best by its
    weights: far out, a flip, on each side. What the others do is looked at as well: they may leave, or lie outside.
    """
    np.random.seed(seed)  # noqa: NPY002 - what numba has
    a, d, side, rho, _, h, arm, flight, flip = numbers
    for k in range(x.size):
        at, on, how, jogs = x[k], i[k], code[k], run[k]
        for n in range(throws):
            if how < 0:
                break
            best, to, there, what = -math.inf, at, on, how
            for c in range(5):
                kappa = lo if c < 2 else hi
                off = e if c % 2 == 0 else -e
                if c == 4:
                    kappa, off = lo + (hi - lo) * luck(), e * (2 * luck() - 1)
                y, j, seen = throw(at, on, a, d, side, rho, kappa, h, arm, flight, flip, off)
                if seen < 0:
                    best, to, there, what = math.inf, y, j, seen
                    break
                note(k, n, j, y, ends, most, least, last_out)
                score = weights[k, 0] * y / arm + weights[k, 1] * seen + weights[k, 2 + j]
                score += weights[k, 2 + a.size] * luck()
                if score > best:
                    best, to, there, what = score, y, j, seen
            at, on, how = to, there, what
            if how < 0:
                last_out[k] = n
                break
            jogs = 0 if how == 1 else jogs + 1
            longest[k] = max(longest[k], jogs)
        x[k], i[k], code[k], run[k] = at, on, how, jogs


class Orbits:
    """Where many orbits are, and what has been seen of each since `look`."""

    def __init__(self, numbers: tuple[Any, ...], x: Any, i: Any, ends: Any = None) -> None:
        self.numbers = numbers
        self.x, self.i = np.array(x, dtype=float), np.array(i, dtype=np.int64)
        self.code = np.zeros(self.x.size, dtype=np.int64)
        self.run = np.zeros(self.x.size, dtype=np.int64)
        self.ends = np.full((numbers[0].size, 1, 2), np.nan) if ends is None else ends
        self.look()

    def look(self) -> None:
        """Forget what was seen."""
        shape = (self.x.size, self.numbers[0].size)
        self.most, self.least = np.full(shape, -np.inf), np.full(shape, np.inf)
        self.longest = self.run.copy()
        self.last_out = np.full(self.x.size, -1, dtype=np.int64)

    def fly(self, throws: int, kappa: Any = None, shift: Any = None) -> None:
        """Go on, with the same values at the same throw for all."""
        kappa = np.full(throws, self.numbers[4]) if kappa is None else kappa
        shift = np.zeros(throws) if shift is None else shift
        fly(self.numbers, self.x, self.i, self.code, throws, kappa, shift, self.ends,
            self.most, self.least, self.run, self.longest, self.last_out)  # fmt: skip

    def chase(self, throws: int, lo: float, hi: float, e: float, weights: Any, seed: int) -> None:
        """Go on, with the noise that each likes best."""
        chase(self.numbers, self.x, self.i, self.code, throws, lo, hi, e, weights, self.ends,
              self.most, self.least, self.run, self.longest, self.last_out, seed)  # fmt: skip

    def only(self, which: Any) -> Orbits:
        """Some of the orbits, from where they are."""
        found = Orbits(self.numbers, self.x[which], self.i[which], self.ends)
        found.code, found.run = self.code[which].copy(), self.run[which].copy()
        found.look()
        return found


@njit(cache=True)
def decisions(numbers, x, i):
    """Whether a part at each x on one side flips: 0, 1, -3 where it is outside the model."""
    a, d, side, rho, kappa, h, _, flight, flip = numbers
    found = np.empty(x.size, dtype=np.int64)
    for k in range(x.size):
        j = i
        if x[k] > a[i]:
            _, j, code = throw(x[k], i, a, d, side, rho, kappa, h, 1e300, flight, flip, 0.0)
            found[k] = OUTSIDE if code == OUTSIDE else (1 if j != i else 0)
        else:
            found[k] = OUTSIDE
    return found


def changes(numbers: tuple[Any, ...], i: int, points: int = 4000) -> Any:
    """Places on a side at which the decision changes, as far as a scan shows them."""
    a, arm = numbers[0][i], numbers[6]
    x = np.linspace(a, arm, points + 1)[1:]
    seen = decisions(numbers, x, i)
    k = np.flatnonzero(seen[1:] != seen[:-1])
    lo, hi, left = x[k].copy(), x[k + 1].copy(), seen[k]
    for _ in range(60):
        middle = 0.5 * (lo + hi)
        same = decisions(numbers, middle, i) == left
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    return 0.5 * (lo + hi)
