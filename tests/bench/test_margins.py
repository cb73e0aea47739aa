"""One margin, proved and refuted to 1 %, beside what one would write with `certify` alone: a plain bisection."""

from __future__ import annotations

import pytest

import limitsets as ls
from tests.bench.measure import limit, take_turns, versus

pytestmark = pytest.mark.bench


def bisected(width: float = 0.01) -> tuple[float, float]:
    """Bracket the margin of the speed: every step proves the whole tolerance anew, or refutes it at an end."""
    low, high = 0.0, 2.0
    while high - low > width * high:
        middle = 0.5 * (low + high)
        proof = ls.certify("paper-designed", ["goal"], tolerance={"throw.speed": f"{middle:.9f} %"})
        if proof.claims[0].verdict == "proved":
            low = middle
        elif proof.claims[0].verdict == "refuted":
            high = middle
        else:
            break
    return low, high


def test_one_margin(benchmark, table):
    def ours():
        (found,) = ls.margin("paper-designed", "throw.speed")
        return found

    turns = take_turns(benchmark, ours, {"certify, bisected": bisected}, rounds=3)
    found = turns.answer
    assert found.closed
    assert found.proved < 0.733 < found.refuted
    table.append(limit("margin of the speed to 1 %, fixed (asked: 5 s)", turns.ours, "s", 5.0))
    table.append(versus("margin of the speed to 1 %, fixed", turns, "certify, bisected", unit="s"))


def test_one_margin_at_every_throw(benchmark, table):
    def ours():
        (found,) = ls.margin("paper-designed", "throw.speed", reading="per-throw")
        return found

    turns = take_turns(benchmark, ours, {}, rounds=3)
    assert turns.answer.closed
    table.append(limit("margin of the speed to 1 %, every throw (asked: 5 s)", turns.ours, "s", 5.0))
