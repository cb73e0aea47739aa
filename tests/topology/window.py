"""Points of a scene's window, half of them next to where the class changes, and their topology."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import limitsets as ls
from limitsets.feeder.scene.arrays import ThrowStack, throw_stack
from limitsets.systems.sets.topology import Topologies, topologies
from tests.topology.compare import class_of

# The window of the atlas: speed [deg/s], height of the surface [in].
SPEED, HEIGHT = (120.0, 180.0), (-1.0, 0.2)
# How near a pair comes to a boundary, and how far apart its points are at first, as shares of the window.
NEAR, APART = 1e-4, 0.03


@dataclass(frozen=True)
class Points:
    """Places in the window from 0 to 1, their throws and their topology; which were drawn next to a boundary."""

    places: Any
    stack: ThrowStack
    found: Topologies
    at_boundary: Any


def looked_at(scene: ls.Scene, places: Any) -> tuple[ThrowStack, Topologies]:
    """Throws and topology at places of the window."""
    speed, height = (low + (high - low) * places[:, k] for k, (low, high) in enumerate((SPEED, HEIGHT)))
    stack = throw_stack(scene, {"throw.speed": np.radians(speed), "arm.surface_height": height})
    return stack, topologies(stack.params, stack.lo, stack.hi, stack.anchor)


def classes(found: Topologies) -> list[Any]:
    """Class of every point, None where it is undecided."""
    return [None if found.undecided[i] else class_of(found, i) for i in range(found.attractors.size)]


def beside_boundaries(scene: ls.Scene, count: int, rng: Any) -> Any:
    """Places a ten-thousandth of the window from a boundary: pairs of other classes, halved until that near."""
    kept = np.empty((0, 2))
    while len(kept) < count:
        a = rng.random((4 * count + 20, 2))
        angle = rng.uniform(0.0, 2.0 * np.pi, len(a))
        b = np.clip(a + APART * np.column_stack([np.cos(angle), np.sin(angle)]), 0.0, 1.0)
        first, second = (classes(looked_at(scene, each)[1]) for each in (a, b))
        pairs = [k for k in range(len(a)) if first[k] is not None is not second[k] and first[k] != second[k]]
        a, b, first = a[pairs], b[pairs], [first[k] for k in pairs]
        while len(a) and np.linalg.norm(a - b, axis=1).max() > NEAR:
            middle = 0.5 * (a + b)
            same = np.array(
                [x == y for x, y in zip(classes(looked_at(scene, middle)[1]), first, strict=True)]
            )
            a, b = np.where(same[:, None], middle, a), np.where(same[:, None], b, middle)
        either = rng.random(len(a)) < 0.5
        kept = np.concatenate([kept, np.where(either[:, None], a, b)])
    return kept[:count]


def points_of(scene: ls.Scene, count: int, seed: int) -> Points:
    """Half of the points anywhere in the window, half next to boundaries of classes."""
    rng = np.random.default_rng(seed)
    near = beside_boundaries(scene, count // 2, rng)
    places = np.concatenate([rng.random((count - len(near), 2)), near])
    stack, found = looked_at(scene, places)
    return Points(places, stack, found, np.arange(count) >= count - len(near))
