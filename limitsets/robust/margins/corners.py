"""The factor on a vector of tolerances at the worst corners of its box, each a single scene."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from limitsets.robust.margins.asking import Asked, Question
from limitsets.robust.margins.effect import Effects
from limitsets.robust.margins.vector import Tolerance

__all__ = ["at_corners", "rounded"]


def at_corners(
    question: Question, tolerance: Tolerance, effects: Effects, width: Fraction
) -> tuple[Fraction, Fraction | None, Asked | None, str]:
    """Bracket the factor at the worst corners, as single scenes: proved, refuted, by what, why not."""
    corners = effects.corners() or [(1,) * len(tolerance.measures), (-1,) * len(tolerance.measures)]
    bad: Fraction | None = None
    against, good_all, reason = None, None, ""
    for signs in corners[:4]:
        good, own, by, why = _at_one(question, tolerance, signs, width, bad)
        good_all = good if good_all is None else min(good_all, good)
        if own is not None and (bad is None or own < bad):
            bad, against = own, by
        reason = reason or why
    return good_all or Fraction(0), bad, against, reason


def _at_one(
    question: Question, tolerance: Tolerance, signs: tuple[int, ...], width: Fraction, known: Fraction | None
) -> tuple[Fraction, Fraction | None, Asked | None, str]:
    good, bad, against, reason = Fraction(0), None, None, ""

    def proves(factor: Fraction) -> bool:
        nonlocal good, reason
        found = question.prove(tolerance.corner(factor, signs), tolerance.noise(factor))
        good, reason = (max(good, factor), reason) if found.verdict == "proved" else (good, found.reason)
        return found.verdict == "proved"

    def refutes(factor: Fraction) -> bool:
        nonlocal bad, against
        found = question.refute(tolerance.corner(factor, signs), tolerance.noise(factor))
        if found.verdict == "refuted":
            bad, against = factor, replace(found, within=tolerance.texts(factor))
        return found.verdict == "refuted"

    factor = known or Fraction(1, 16)
    while proves(factor):
        if known is not None or factor > 10**6:
            return good, None, None, ""
        factor *= 2
    top = factor
    while top - good > width * top and top > Fraction(1, 10**6):
        middle = rounded((good + top) / 2)
        top = top if proves(middle) else middle
    for k in range(10):
        if refutes(rounded(top * (1 + Fraction(2**k - 1, 400)))):
            break
    low = top  # what is not proved need not fail: it may hold for fewer starts than all
    while bad is not None and bad - low > width * bad:
        middle = rounded((low + bad) / 2)
        low = low if refutes(middle) else middle
    return good, bad, against, reason


def rounded(value: Fraction) -> Fraction:
    """Five digits: a factor that people can read, and whose multiples are short decimals."""
    return Fraction(f"{float(value):.5g}")
