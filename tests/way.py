"""The way of a reader who follows a call through the package: `python -m tests.way`.

Of each function only its first call counts, in the order of the calls.  A climb is a call of a wing that stands below
the caller's in the table of CONTRIBUTING (a function or a class handed down); a return comes to a room left before.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import limitsets as ls
from limitsets import maps

PACKAGE = Path(ls.__file__).parent
WINGS = ("checker", "base", "numbers", "systems", "feeder", "proofs", "parameters", "cell", "face")


def room(code: CodeType) -> tuple[str, ...]:
    """Wing and room in which a function stands; nothing for one of another package."""
    path = Path(code.co_filename)
    if not path.is_relative_to(PACKAGE) or code.co_name == "<module>":
        return ()
    return path.relative_to(PACKAGE).with_suffix("").parts[:2]


def way(call: Callable[[], Any]) -> list[tuple[CodeType | None, CodeType]]:
    """List the functions that a call enters, each with its caller in the package."""
    callers: dict[CodeType, CodeType | None] = {}

    def seen(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code not in callers and room(frame.f_code):
            back = frame.f_back
            while back is not None and not room(back.f_code):
                back = back.f_back
            callers[frame.f_code] = back.f_code if back is not None else None

    sys.setprofile(seen)
    try:
        call()
    finally:
        sys.setprofile(None)
    return [(caller, code) for code, caller in callers.items()]


def row(name: str, call: Callable[[], Any]) -> None:
    """Print the size of a call's way, the rooms returned to most, and climbs."""
    call()  # compiled once before, for compiling under a profile takes minutes
    steps = way(call)
    rooms = [room(code) for _, code in steps]
    returns = Counter(here for k, here in enumerate(rooms) if here in rooms[:k] and here != rooms[k - 1])
    rank = {wing: number for number, wing in enumerate(WINGS)}
    climbs = [
        f"{caller.co_qualname} -> {code.co_qualname}"
        for caller, code in steps
        if caller is not None and rank.get(room(caller)[0], 9) < rank.get(room(code)[0], 9)
    ]
    files = {code.co_filename for _, code in steps}
    print(f"{name}: {len(steps)} functions, {len(files)} files, {len(set(rooms))} rooms, ", end="")
    print(f"{len(climbs)} climbs, {returns.total()} returns", flush=True)
    print("   returns:", ", ".join(f"{'/'.join(here)} {n}" for here, n in returns.most_common(7)))
    print("   climbs:", ", ".join(climbs[:8]))


if __name__ == "__main__":
    scene = ls.load("paper-designed")
    vary = ["part.mass.center.along", "part.mass.center.above", "throw.speed"]
    logistic = maps.Logistic(3.5)
    row("attractors", lambda: ls.attractors(ls.transitions(logistic, ls.grid([(0.0, 1.0)], cells=64))))
    row("certify", lambda: ls.certify(scene))
    row("margin", lambda: ls.margin(scene, "throw.speed"))
    row("feed", lambda: ls.feed("paper-triangle", trials=50, prove=False))
    row("design", lambda: ls.design("paper-initial", critical_points=[10, 10, 20], vary=vary, stages=4))
