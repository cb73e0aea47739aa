"""The engine's step and its half on the same draws: what that does to single trials and to the rates."""

from __future__ import annotations

from typing import Any

from limitsets.cell.assembly.assembly_run import rate_of
from limitsets.cell.assembly.pairing import pair_of
from limitsets.cell.assembly.trials import Question, push
from limitsets.feeder.scattering import Scattering

STEPS = (4e-3, 2e-3)


def both_steps(parts: list[Any], noise: Scattering, trials: int, seed: int) -> dict[str, Any]:
    """Count what becomes of the same pairs, the struck corner held, with each step."""
    pair = pair_of(*parts, noise)
    found = [
        [push(pair, seed, number, Question(step=step))[0].outcome for number in range(trials)]
        for step in STEPS
    ]
    words = sorted({word for each in found for word in each})
    rates = {
        str(step): {word: rate_of(each.count(word), trials) for word in words}
        for step, each in zip(STEPS, found, strict=True)
    }
    return {"trials": trials, "same": sum(a == b for a, b in zip(*found, strict=True)), "rates": rates}
