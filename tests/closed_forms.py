"""Probabilities in closed form, which tests of several rooms compare with."""

from itertools import product

import mpmath
import numpy as np


def sum_of_uniforms(widths, t):
    """P(sum of independent uniform numbers on [0, w_i] <= t), with 60 digits: the terms cancel."""
    with mpmath.workdps(60):
        n, total = len(widths), mpmath.mpf(0)
        for signs in product((0, 1), repeat=n):
            rest = mpmath.mpf(t) - sum(w for s, w in zip(signs, widths, strict=True) if s)
            if rest > 0:
                total += (-1) ** sum(signs) * rest**n
        return float(total / (mpmath.factorial(n) * mpmath.fprod(widths)))


def ladder(stretch, starts, scatter, end, throws):
    """P(x_n >= end), n = 0 to `throws`: a jog stretches x - a by q, and each landing scatters evenly within b.

    `stretch` is (a, q); starts are even on an interval; where jogs gain more than b it is P(T <= n).
    """
    (a, q), (lo, hi), b = stretch, starts, scatter
    exact = []
    for n in range(throws + 1):
        widths = [q**n * (hi - lo)] + [2.0 * b * q**k for k in range(n)]
        least = a + q**n * (lo - a) - b * sum(q**k for k in range(n))
        exact.append(1.0 - min(sum_of_uniforms(widths, end - least), 1.0) if end > least else 1.0)
    return np.array(exact)
