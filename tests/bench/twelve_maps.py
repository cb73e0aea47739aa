"""Twelve maps as researchers write them, with numpy: the same function runs compiled, and on arrays in CMGDB.

They stand apart from what is asked of them: machine code is kept on disk as long as this file is not edited.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import erf


def gap_below(x, slope):
    return slope * x + 0.9


def gap_above(x, slope):
    return slope * x - 1.0


def tent_below(x, a, b):
    return 1.0 + a * x


def tent_above(x, a, b):
    return 1.0 - b * x


def above_zero(x):
    return x


def ricker(x, r):
    return x * np.exp(r * (1.0 - x))


def two_species(x, y, birth, rivalry):
    return birth * x / (1.0 + x + rivalry * y), birth * y / (1.0 + y + rivalry * x)


def ikeda(x, y, u):
    angle = 0.4 - 6.0 / (1.0 + x**2 + y**2)
    return 1.0 + u * (x * np.cos(angle) - y * np.sin(angle)), u * (x * np.sin(angle) + y * np.cos(angle))


def delayed_logistic(x, y, a):
    return y, a * y * (1.0 - x)


def henon_in_space(x, y, z, a, b):
    return a - y**2 - b * z, x, y


def beetles(larvae, pupae, adults, b, cel, cea, cpa, mul, mua):
    return (
        b * adults * np.exp(-cel * larvae - cea * adults),
        larvae * (1.0 - mul),
        pupae * np.exp(-cpa * adults) + adults * (1.0 - mua),
    )


def circle(x, omega, k):
    return x + omega - k / (2.0 * math.pi) * np.sin(2.0 * math.pi * x)


def torus(x, y):
    return 2.0 * x + y, x + y


def standard(p, q, k):
    kick = k / (2.0 * math.pi) * np.sin(2.0 * math.pi * q)
    return p + kick, p + q + kick


STEPS = 16


def pull(x, v, t, damping, push):
    return x - x**3 - damping * v + push * np.cos(t)


def duffing(x, v, damping, push):
    h = 2.0 * math.pi / STEPS
    for k in range(STEPS):
        a1 = pull(x, v, k * h, damping, push)
        v2 = v + 0.5 * h * a1
        a2 = pull(x + 0.5 * h * v, v2, (k + 0.5) * h, damping, push)
        v3 = v + 0.5 * h * a2
        a3 = pull(x + 0.5 * h * v2, v3, (k + 0.5) * h, damping, push)
        v4 = v + h * a3
        a4 = pull(x + h * v3, v4, (k + 1) * h, damping, push)
        x = x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
        v = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return x, v


def saturating(x, gain):
    return erf(gain * x)
