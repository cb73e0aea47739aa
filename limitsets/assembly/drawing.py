"""What a trial draws, from its seed and its number alone: starts, and the deviations of every throw."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limitsets.assembly.pairing import Pair, Start, are_apart
from limitsets.errors import AnswerError
from limitsets.robust.noise.laws import Gaussian, Uniform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from limitsets.robust.noise.laws import Law

# Pairs of starts drawn before it is believed that none are apart; throws drawn at once.
MOST_DRAWN, AT_ONCE = 10_000, 64


class Draws:
    """Random numbers of one trial.

    Parameters
    ----------
    pair : Pair
        The parts and the noise.
    seed, number : int
        Of the series of trials, and of the trial in it.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.assembly.pairing import pair_of
    >>> pair = pair_of("paper-triangle", "paper-quadrilateral")
    >>> Draws(pair, 0, 7).starts(apart=True) == Draws(pair, 0, 7).starts(apart=True)
    True
    """

    def __init__(self, pair: Pair, seed: int, number: int) -> None:
        self.pair = pair
        self.random = np.random.Generator(np.random.Philox(key=np.array([seed, number], dtype=np.uint64)))
        self.rows: list[list[float]] = []

    def starts(self, *, apart: bool) -> tuple[Start, Start]:
        """Draw where the parts lie at first, each as `limitsets.feed` does; `apart`: until they do not overlap."""
        for _ in range(MOST_DRAWN):
            first, second = (self._start(number) for number in (0, 1))
            if not apart or are_apart(self.pair, (first, second)):
                return first, second
        remedy = "lengthen the arm, or throw without contact"
        raise AnswerError("the arm", "too short for both parts", "room for two parts side by side", remedy)

    def _start(self, number: int) -> Start:
        end = self.pair.ends[number]
        x, side = end.drawn(self.random, 1)
        return float(x[0]), int(side[0])

    def throw(self) -> tuple[float, tuple[float, float]]:
        """Draw the next throw: relative deviation of the speed, and of each part's landing place [length]."""
        if not self.rows:
            scatter, shape = self.pair.scatter, (AT_ONCE, 1)
            speed = _drawn(scatter.speed, self.random, shape)
            landing = _drawn(scatter.landing, self.random, (AT_ONCE, 2))
            self.rows = np.hstack([speed, landing])[::-1].tolist()
        speed_of, one, two = self.rows.pop()
        return speed_of, (one, two)


def _drawn(law: Law | None, random: np.random.Generator, shape: tuple[int, int]) -> NDArray[np.float64]:
    if isinstance(law, Gaussian):
        return law.sigma * random.standard_normal(shape)
    if isinstance(law, Uniform):
        return random.uniform(-law.bound, law.bound, shape)
    return np.zeros(shape)
