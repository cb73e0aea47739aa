"""What was asked of a scene, what was answered, and the scenes that an answer is about."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from typing import Any

from mpmath import mp, mpf

from tests.attack import facts as model
from tests.attack.generate import Case


@dataclass
class Verdict:
    """What was asked and answered, and where orbits say otherwise."""

    case: Case
    claims: list[dict[str, Any]] = field(default_factory=list)
    recheck: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)

    def fault(self, text: str) -> None:
        self.faults.append(text)


@dataclass(frozen=True)
class Range:
    """A scene within a tolerance, with its noise."""

    facts: model.Facts
    lo: float
    hi: float
    e: float

    @property
    def noisy(self) -> bool:
        return self.hi > self.lo or self.e > 0


def ranges(case: Case, rng: Any) -> list[Range]:
    """The scene; with a tolerance its two ends, the middle and one in between."""
    scene = tomllib.loads(case.text)
    found = [scene]
    for quantity, by in case.tolerance.items():
        share = model.si(by)
        shifts = [mpf(1), 1 - share, 1 + share, 1 + share * mpf(float(rng.uniform(-1, 1)))]
        found = [model.moved(scene, quantity, mp.nstr(shift, 40)) for shift in shifts]
    every = []
    for each in found:
        facts = model.read(each)
        lo, hi = model.kappas(facts, scene, case.noise)
        every.append(Range(facts, float(lo), float(hi), float(model.landing(facts, case.noise))))
    return every
