"""Following attractors along a path: the public call."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from operator import itemgetter
from typing import Any

import numpy as np

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.progress import shown_in_notebooks
from limitsets.scene import load
from limitsets.sweep.continuation.events import events_of, numbered
from limitsets.sweep.continuation.path import Curve, Path, read_path
from limitsets.sweep.continuation.result import Continuation, State
from limitsets.sweep.continuation.snapshot import Snapshot
from limitsets.sweep.continuation.stepping import Follower

Progress = Callable[[str, int, int], None]


@shown_in_notebooks
@arguments_checked
def continuation(
    subject: Any,
    path: Curve,
    *,
    steps: int = 100,
    cells: int = 512,
    domain: Any = None,
    most: int = 300,
    progress: Progress | None = None,
) -> Continuation:
    """Follow the attractors along a path of parameters, and find what happens to them on the way.

    Parameters
    ----------
    subject : Scene, str or NamedTuple
        A scene, its name or file, or a registered map.
    path : dict of str to (first, last), or callable
        A straight path: first and last value of each quantity (numbers in the scene's units, or text with a unit) or
        of each parameter of the map.  Any other curve: a function of t in [0, 1] that gives the values, or the map.
    steps : int
        Equal steps in t to begin with.
    cells : int
        Cells per axis of each side, in which attractors are looked for.
    domain : Domain or list of (lo, hi), optional
        Of a map that is no textbook map.
    most : int
        Places per step at which attractors are found; beyond it the brackets stay as wide as they are.
    progress : callable, optional
        Called with what is done, how many steps of it are, and of how many.

    Returns
    -------
    Continuation
        Attractors at each step with stable numbers, and the events.

    Raises
    ------
    AnswerError
        For a path that is none, or fewer than one step.
    SceneError
        For a quantity or a value that the scene cannot have.

    Notes
    -----
    Two attractors at neighbouring places are matched when they overlap (to a fiftieth of the extent) and the states of
    one come to rest at the other under the other's map.  Where that is not one to one, where the number of bands per
    side or the period changes, or where the set moves by more than that, the step is halved, down to 1e-9 of the path;
    what is left is an event with its bracket.  A change that is undone within a step is not seen.  Nothing is proved.

    Border collisions are those of ends of bands, ends of inner gaps included, and of points of attracting cycles; a
    critical orbit that meets a critical point inside a band changes no band and is not reported.

    Source: docs/continuation.md.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.continuation(ls.maps.Logistic(3.0), {"r": (2.9, 3.1)}, steps=4)
    >>> for event in found.events:
    ...     print(event)
    bands at r = 3: period 1 -> period 2
    """
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        raise AnswerError("the number of steps", steps, "an integer from 1", "pass steps=100")
    curve = read_path(load(subject) if isinstance(subject, str) else subject, path, domain)
    follower = Follower(curve, cells, most)
    grid = np.linspace(0.0, 1.0, steps + 1).tolist()
    for k, (first, last) in enumerate(pairwise(grid)):
        if progress is not None:
            progress("steps", k, steps)
        follower.step(first, last)
    follower.touches()
    follower.settle()
    if progress is not None:
        progress("steps", steps, steps)
    return _answer(curve, follower)


def _answer(curve: Path, follower: Follower) -> Continuation:
    numbers = numbered(follower)
    visited = [follower.at(t) for t in sorted(follower.snapshots)]
    names = visited[0].place.values
    return Continuation(
        curve.name,
        curve.unit,
        np.array([each.t for each in visited]),
        {name: np.array([each.place.values[name] for each in visited]) for name in names},
        tuple(
            {
                number: State.of(found)
                for number, found in sorted(zip(row, each.found, strict=True), key=itemgetter(0))
            }
            for row, each in zip(numbers, visited, strict=True)
        ),
        tuple(_critical(each) for each in visited),
        events_of(follower, numbers),
        len(visited),
    )


def _critical(snapshot: Snapshot) -> dict[int, tuple[float, ...]]:
    if not snapshot.place.on_line:
        return {}
    found: dict[int, list[float]] = {side: [] for side in snapshot.place.forward.pieces}
    for border in snapshot.place.borders:
        if border.kind == "critical":
            found[border.side].append(border.x_above)
    return {side: tuple(x) for side, x in found.items()}
