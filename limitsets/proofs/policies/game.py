"""The game of a controller who knows a set of cells and asks one question after every throw; beliefs as bits.

A belief B is a set of cells; after a throw and an answer it is the outer image of B, cut with the cells in which that
answer may come.  The game asks for nothing but the image of each cell under each action: any map's graph serves.
Source: docs/feedback.md; for such games and their antichains, Chatterjee, Doyen, Henzinger and Raskin, "Algorithms for
omega-regular games with imperfect information", Logical Methods in Computer Science 3, 2007.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.base.arrays import Ints, Mask
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.graph.ranges import expand

# ----------------------------------------------------------------
# Beliefs as bits, and which of many hold a given one or lie in it.


Bits = NDArray[np.uint64]

# Only so many of the latest beliefs are searched for a subset: a subset that is missed only costs time.
COMPARED = 4096


def packed(masks: Mask) -> Bits:
    """Write sets of cells as bits: shape (..., n_cells) to (..., words).

    Examples
    --------
    >>> packed(np.array([True, False, True]))
    array([5], dtype=uint64)
    """
    octets = np.packbits(masks, axis=-1, bitorder="little")
    missing = -octets.shape[-1] % 8
    whole = np.concatenate([octets, np.zeros((*octets.shape[:-1], missing), np.uint8)], axis=-1)
    return np.ascontiguousarray(whole).view(np.uint64)


def cells_of(belief: Bits) -> Ints:
    """Give the numbers of the cells, ascending."""
    return np.flatnonzero(np.unpackbits(belief.view(np.uint8), bitorder="little"))


class Kept:
    """Beliefs with a number of throws each.

    Parameters
    ----------
    words : int
        Words of 64 bits in each.
    """

    def __init__(self, words: int) -> None:
        self.rows, self.throws = np.empty((64, words), np.uint64), np.empty(64, np.int64)
        self.size = 0

    def add(self, belief: Bits, throws: int) -> int:
        """Keep a belief; its number."""
        if self.size == len(self.rows):
            self.rows = np.concatenate([self.rows, np.empty_like(self.rows)])
            self.throws = np.concatenate([self.throws, np.empty_like(self.throws)])
        self.rows[self.size], self.throws[self.size] = belief, throws
        self.size += 1
        return self.size - 1

    def superset(self, belief: Bits, most: int) -> int:
        """Find the number of one of at most so many throws that holds the belief; -1 where none does."""
        some = np.flatnonzero(self.throws[: self.size] <= most)
        return self._first(some, ~(belief & ~self.rows[some]).any(axis=1))

    def subset(self, belief: Bits, least: int) -> int:
        """Find the number of one of at least so many throws that lies in the belief; -1 where none is found."""
        begin = max(0, self.size - COMPARED)
        some = begin + np.flatnonzero(self.throws[begin : self.size] >= least)
        return self._first(some, ~(self.rows[some] & ~belief).any(axis=1))

    @staticmethod
    def _first(some: Ints, met: Any) -> int:
        return int(some[int(met.argmax())]) if met.any() else -1


# ----------------------------------------------------------------
# The game of a controller who knows a set of cells that holds the part, and asks one question after every throw.


Image: TypeAlias = Callable[[Mask], Mask | None]
"""From cells, shape (n_cells,), to all cells that their image may meet; None where some of it may leave them."""

# The images of the cells are kept as bits, n_cells squared of them per throw.
MOST_CELLS = 32_768


@dataclass(frozen=True, eq=False)
class Game:
    """Throws, answers, and what is won and lost.

    Attributes
    ----------
    throws : tuple of str
        Names of the actions.
    images : ndarray of uint64, shape (throws, n_cells, words)
        The cells that the image of each cell may meet, as bits.
    leaves : ndarray of bool, shape (throws, n_cells)
        Whether it may leave the cells: then the throw is never chosen.
    answers : dict of str to ndarray of bool, shape (n_cells,)
        The cells in which each answer may come; without a sensor one answer, which may come everywhere.
    target : ndarray of bool, shape (n_cells,)
        Where the part is wanted.
    lost : ndarray of bool, shape (n_cells,), or None
        None: the controller stops where it knows that the part is in the target.  Otherwise the part is caught as soon
        as it comes to the target, and these cells catch it wrongly.
    """

    throws: tuple[str, ...]
    images: Bits
    leaves: Mask
    answers: dict[str, Mask]
    target: Mask
    lost: Mask | None = None

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return int(self.target.size)

    @cached_property
    def heard(self) -> tuple[Bits, ...]:
        """The cells of every answer, as bits."""
        return tuple(packed(mask) for mask in self.answers.values())

    @cached_property
    def won(self) -> Bits:
        """The target, as bits."""
        return packed(self.target)

    @cached_property
    def wrong(self) -> Bits | None:
        """The cells that catch wrongly, as bits."""
        return None if self.lost is None else packed(self.lost)

    def asking(self, answers: Mapping[str, Mask] | None) -> Game:
        """Give the same game with another sensor, or none."""
        return replace(self, answers=dict(answers or {"": np.ones(self.n_cells, dtype=bool)}))

    def at_first(self, starts: Mask) -> tuple[Bits, ...]:
        """Give the beliefs at the start, by answer: the sensor is read before the first throw too."""
        begin = packed(starts)
        return tuple(begin & answer for answer in self.heard)

    def after(self, belief: Bits, throw: int) -> tuple[Bits, ...] | None:
        """Give the beliefs after a throw, by answer; None where the part may leave the cells, or be caught wrongly."""
        cells = cells_of(belief)
        if self.leaves[throw, cells].any():
            return None
        image = np.bitwise_or.reduce(self.images[throw, cells], axis=0)
        if self.wrong is not None:
            if (image & self.wrong).any():
                return None
            image &= ~self.won
        return tuple(image & answer for answer in self.heard)

    def seeing(self, throws: int) -> list[Bits]:
        """Give the cells from which one who sees the cell wins within 0, 1, ... throws: no others can be solved."""
        winning = [self.won if self.wrong is None else np.zeros_like(self.won)]
        for _ in range(throws):
            inside = winning[-1] | self.won
            good: Mask = ~(self.images & ~inside).any(axis=2) & ~self.leaves
            if self.wrong is not None:
                good &= ~(self.images & self.wrong).any(axis=2)
            winning.append(winning[-1] | packed(np.any(good, axis=0)))
        return winning


def game_of(
    images: Mapping[str, Image],
    answers: Mapping[str, Mask] | None,
    target: Mask,
    lost: Mask | None = None,
) -> Game:
    """Ask each throw for the image of each cell.

    Parameters
    ----------
    images : mapping of str to callable
        For each throw the outer image of cells: from a set of cells, shape (n_cells,), to all cells that their image
        may meet, or None where some of it may leave them.  The image of a set is that of its cells, joined.
    answers : mapping of str to ndarray of bool, or None
        The cells in which each answer may come; every cell needs one.  None: there is no sensor.
    target : ndarray of bool, shape (n_cells,)
        Where the part is wanted.
    lost : ndarray of bool, shape (n_cells,), optional
        As in `Game`.

    Returns
    -------
    Game

    Raises
    ------
    AnswerError
        For no throw, more cells than memory has room for, or a cell without an answer.

    Examples
    --------
    >>> ring = {"turn": lambda cells: np.roll(cells, 1)}
    >>> game = game_of(ring, None, np.array([False, False, True]))
    >>> [cells_of(each).tolist() for each in game.seeing(2)]
    [[2], [1, 2], [0, 1, 2]]
    """
    n = target.size
    if not images:
        raise AnswerError("the throws to choose from", "none", "one at least", "name some")
    if n > MOST_CELLS:
        raise AnswerError("the number of cells", n, f"at most {MOST_CELLS}", "ask for fewer")
    if answers is not None and not np.logical_or.reduce(list(answers.values())).all():
        raise AnswerError("the cells without an answer", "some", "none", "give every cell an answer")
    words = packed(target).size
    rows = np.zeros((len(images), n, words), np.uint64)
    leaves = np.zeros((len(images), n), dtype=bool)
    one = np.zeros(n, dtype=bool)
    for number, image in enumerate(images.values()):
        for cell in range(n):
            one[cell] = True
            reached = image(one)
            one[cell] = False
            leaves[number, cell] = reached is None
            if reached is not None:
                rows[number, cell] = packed(reached)
    bare = Game(tuple(images), rows, leaves, {}, target, lost)
    return bare.asking(answers)


# ----------------------------------------------------------------
# Outer images of sets of cells, from a transition graph.


def image_of(graph: TransitionGraph) -> Image:
    """Give the image of a graph's cells: proved to hold that of every point where its method is "boxes".

    Examples
    --------
    >>> import limitsets as ls
    >>> grid = ls.grid([(0.0, 1.0)], cells=4)
    >>> image = image_of(ls.transitions(ls.maps.Logistic(2.0), grid, "boxes"))
    >>> image(np.array([True, False, False, False])).tolist()
    [True, True, False, False]
    """
    pointer, targets = expand(graph.ranges)
    leaves = graph.ranges.exits > 0

    def image(cells: Mask) -> Mask | None:
        if (cells & leaves).any():
            return None
        reached = np.zeros(graph.n_cells, dtype=bool)
        for cell in np.flatnonzero(cells).tolist():
            reached[targets[pointer[cell] : pointer[cell + 1]]] = True
        return reached

    return image
