"""What no policy can do: the same game on finitely many starts, whose images are enclosed.

Cells are outer images, on which a policy may fail that would work.  Here a belief is a set of single starts that saw
the same throws and answers.  A start of which an answer, a decision or the goal region is not certain is taken out,
which makes the game easier; so what is not won within n throws is won by no policy, on those starts or any that hold
them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.graph.images.hulls import DECIDED, BoxImages
from limitsets.policies.synthesis import Synthesis
from limitsets.proofs.parameters import ParameterBox, parameter_box
from limitsets.scene.sensing import BeyondSensor, SideSensor

BEAT = 16


@dataclass(frozen=True, eq=False)
class Impossible:
    """What was shown of the starts.

    Attributes
    ----------
    throws : int
        No policy of so many throws serves all of the starts; -1 if nothing was shown.
    starts : tuple of (float, int)
        x and side [length].
    decided : bool
        False where the time was used up, or where the starts were won, within one throw more than `throws`.
    beliefs : int
        Sets of starts looked at.
    """

    throws: int
    starts: tuple[tuple[float, int], ...]
    decided: bool
    beliefs: int


@dataclass(frozen=True, eq=False)
class _Parts:
    """Where the starts are now: brackets of x, and the side of each."""

    lo: NDArray[np.float64]
    hi: NDArray[np.float64]
    side: NDArray[np.int64]

    def some(self, which: NDArray[np.bool_]) -> _Parts:
        return _Parts(self.lo[which], self.hi[which], self.side[which])


class _SpentError(Exception):
    """Time is used up."""


class _Enclosed:
    def __init__(self, found: Synthesis, boxes: Sequence[ParameterBox], until: float) -> None:
        self.found, self.boxes, self.until, self.seen = found, boxes, until, 0

    def may_be_won(self, parts: _Parts) -> NDArray[np.bool_]:
        x, side = self.found.goal
        won: NDArray[np.bool_] = (parts.hi >= x) & (parts.side == side)
        return won

    def thrown(self, parts: _Parts, box: ParameterBox) -> _Parts | None:
        """Throw all; None where one is certainly lost."""
        lo, hi, side = parts.lo.copy(), parts.hi.copy(), parts.side.copy()
        sure = np.zeros(side.size, dtype=bool)
        for own in np.unique(side).tolist():
            some = np.flatnonzero(parts.side == own)
            boxes = BoxImages(
                box.lo,
                box.hi,
                own,
                (np.ascontiguousarray(parts.lo[some]),),
                (np.ascontiguousarray(parts.hi[some]),),
            )
            lo[some], hi[some] = boxes.slots[0][0][0], boxes.slots[0][1][0]
            side[some], sure[some] = boxes.to[0], boxes.count == DECIDED
        bare_lo, bare_hi = box.bare
        a_lo, a_hi = bare_lo.a[side], bare_hi.a[side]
        gone = (hi <= a_lo) | (lo > bare_hi.arm_length)
        stays = (lo > a_hi) & (hi <= bare_lo.arm_length)
        x, wanted = self.found.goal
        if self.found.mode == "catch":
            gone |= (lo >= x) & (side != wanted)
            stays &= (hi < x) | ((lo >= x) & (side == wanted))
        if (sure & gone).any():
            return None
        return _Parts(lo, hi, side).some(sure & stays)

    def heard(self, parts: _Parts) -> list[_Parts]:
        """Give the parts of which each answer may certainly come, those that are caught left out."""
        if self.found.mode == "catch":
            parts = parts.some(~self.may_be_won(parts))
        sensor = self.found.sensor
        if isinstance(sensor, SideSensor):
            on = parts.side == sensor.side
            return [parts.some(on), parts.some(~on)]
        if isinstance(sensor, BeyondSensor):
            low = np.nextafter(sensor.x - sensor.error, np.inf)
            high = np.nextafter(sensor.x + sensor.error, -np.inf)
            if not sensor.error:
                low = high = sensor.x
            return [parts.some(parts.lo > low), parts.some(parts.hi <= high)]
        return [parts]

    def won(self, parts: _Parts, left: int) -> bool:
        """Whether a policy of so many throws may serve all of them, after an answer."""
        inside = self.may_be_won(parts)
        if inside.all():  # of none too
            return True
        if left == 0:
            return False
        self.seen += 1
        if self.seen % BEAT == 0 and time.monotonic() > self.until:
            raise _SpentError
        for box in self.boxes:
            after = self.thrown(parts, box)
            if after is None:
                continue
            heard = sorted(self.heard(after), key=lambda each: -each.side.size)
            if all(self.won(each, left - 1) for each in heard):
                return True
        return False


def not_within(
    found: Synthesis,
    starts: Sequence[tuple[float, int]],
    throws: int | None = None,
    *,
    seconds: float = 60.0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Impossible:
    """Show that no policy of so many throws serves some starts; without noise, which makes it no easier.

    Parameters
    ----------
    found : Synthesis
        The question: throws, sensor, mode and goal.
    starts : sequence of (float, int)
        x and side of each start, all of them in the starts of the question [length].
    throws : int, optional
        The most throws; default: one more than the search on cells got to.
    seconds : float
        The most time [s].
    progress : callable, optional
        Told the step, its number and how many there are.

    Returns
    -------
    Impossible

    Raises
    ------
    AnswerError
        For a start that is not one of the question.
    """
    for x, side in starts:
        if not (0 <= side < found.grid.sides and found.starts.holds([x], side)[0]):
            raise AnswerError("the start", (x, side), "one of the starts of the question", "choose another")
    scene = found.scene
    assert scene.feedback is not None
    boxes = [parameter_box(scene.with_values({each.quantity: each.text})) for each in scene.feedback.throws]
    most = found.found.throws + 1 if throws is None else throws
    places = np.array([at for at, _ in starts], dtype=np.float64)
    begin = _Parts(places, places.copy(), np.array([side for _, side in starts], dtype=np.int64))
    run, shown, decided = _Enclosed(found, boxes, time.monotonic() + seconds), -1, True
    try:
        for left in range(most + 1):
            if progress is not None:
                progress(f"enclosed starts, {left} throws", left, most + 1)
            if all(run.won(each, left) for each in run.heard(begin)):
                decided = False
                break
            shown = left
    except _SpentError:
        decided = False
    return Impossible(shown, tuple((float(at), int(side)) for at, side in starts), decided, run.seen)
