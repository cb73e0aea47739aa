"""The game of beliefs as its definition reads: no memory, no pruning, sets of cells as whole numbers."""

from __future__ import annotations

from collections.abc import Sequence


def wins(
    images: Sequence[Sequence[int | None]],
    answers: Sequence[int],
    target: int,
    lost: int | None,
    belief: int,
    left: int,
) -> bool:
    """Whether some policy of `left` throws wins from a belief: `images[throw][cell]`, None where it may leave."""
    if belief == 0 or (lost is None and belief & ~target == 0):
        return True
    if left == 0:
        return False
    for image in images:
        after, leaves = 0, False
        for cell, where in enumerate(image):
            if belief >> cell & 1:
                leaves |= where is None
                after |= where or 0
        if leaves or (lost is not None and after & lost):
            continue
        if lost is not None:
            after &= ~target
        if all(wins(images, answers, target, lost, after & answer, left - 1) for answer in answers):
            return True
    return False


def least(
    images: Sequence[Sequence[int | None]],
    answers: Sequence[int],
    target: int,
    lost: int | None,
    starts: int,
    most: int,
) -> int | None:
    """Fewest throws that win from the starts, whatever the sensor says of them at first; None for more than `most`."""
    if lost is not None:
        starts &= ~target & ~lost
    for left in range(most + 1):
        if all(wins(images, answers, target, lost, starts & answer, left) for answer in answers):
            return left
    return None


def as_number(mask) -> int:
    """Write a set of cells as a whole number."""
    return sum(1 << cell for cell, inside in enumerate(mask) if inside)
