"""The margin curve, place by place: the middle first, as many X as time permits, each stored as soon as it is found."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import replace
from typing import Any

import numpy as np

from limitsets.robust.margins.beyond import MarginsBeyond, margins_beyond, places_beyond
from limitsets.scene import Scene
from limitsets.scene.laid import LaidLike

# Places; how close their brackets are; most and least seconds for the proof of one joint margin, and seconds in all.
PLACES, COARSE, EACH, LEAST, SECONDS = 7, 0.1, 15.0, 1.0, 20.0


def curve_read(table: Mapping[str, Any], scene: Scene) -> MarginsBeyond:
    """Read what `MarginsBeyond.to_json` wrote, without the proofs."""
    names, units = tuple(table["quantities"]), tuple(table["units"])
    # null becomes nan
    x, proved, refuted = (np.array(table[key], dtype=np.float64) for key in ("x", "proved", "refuted"))
    return MarginsBeyond(scene, table["side"], x, names, units, proved, refuted, ())


def _joined(one: MarginsBeyond | None, other: MarginsBeyond) -> MarginsBeyond:
    """Put the places of both together, ascending, without the proofs."""
    if one is None:
        return other
    order = np.argsort(np.concatenate([one.x, other.x]))
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(one, name), getattr(other, name)])[order]
        for name in ("x", "proved", "refuted")
    }
    return replace(one, **columns, margins=())


class _Here(Executor):
    """Computes in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Compute at once."""
        done: Future[Any] = Future()
        done.set_result(fn(*args, **kwargs))
        return done


def _place(
    scene: Scene, side: int, names: tuple[str, ...], words: Mapping[str, Any], x: float, seconds: float
) -> MarginsBeyond:
    """Ask about one place; without the proofs, which would go from process to process."""
    return replace(margins_beyond(scene, side, names, x=[x], seconds=seconds, **words), margins=())


def curve(
    scene: Scene,
    side: int,
    tolerance: Mapping[str, str],
    known: Mapping[str, Any] | None,
    *,
    laid: LaidLike | None = None,
    seconds: float = SECONDS,
    executor: Executor | None = None,
    tell: Callable[[str, float], None],
    keep: Callable[[dict[str, Any]], None],
) -> tuple[MarginsBeyond, int]:
    """Bracket margins of "beyond X only this side, and almost every orbit comes there" at some X.

    Parameters
    ----------
    scene : Scene
        The scene.
    side : int
        The side wanted.
    tolerance : mapping of str to str
        Of the joint margin; if it is empty, the margin is that of throw.speed.
    known : mapping or None
        What an earlier run kept.
    laid : mapping of int to sequence of (float, float), optional
        Where parts are laid down; default the whole arm.
    seconds : float
        Shared by the proofs of all places; no place is begun for which less is left than the dearest took, but the
        middle one always is.
    executor : Executor, optional
        Where places are asked about, as many at once as it has workers; default, here.
    tell, keep : callable
        Called with what is done and its share, and with what is found so far.

    Returns
    -------
    MarginsBeyond
        Without the proofs.
    int
        Places that there was no time for.

    Raises
    ------
    AnswerError
        The limit set gets farther on another side than on this one.
    """
    end = time.perf_counter() + seconds
    names = ("joint",) if tolerance else ("throw.speed",)
    words = {"tolerance": tolerance, "laid": laid, "width": COARSE}
    places = places_beyond(scene, side, PLACES)
    places = places[np.argsort(np.abs(places - places.mean()), kind="stable")]
    found = None if known is None or known["side"] != side else curve_read(known, scene)
    done = set() if found is None else {round(x, 9) for x in found.x.tolist()}
    waiting = [x for x in places.tolist() if round(x, 9) not in done]
    pool = executor or _Here()
    # concurrent.futures has no public word for it; of an executor of another kind it is not known
    at_once = getattr(pool, "_max_workers", 1)
    begun: dict[Future[MarginsBeyond], float] = {}
    dearest = 0.0
    while True:
        while waiting and len(begun) < at_once:
            now = time.perf_counter()
            dearest = max([dearest, *(now - since for since in begun.values())])
            # what would not end in time is left to a later run
            if (found is not None or begun) and end - now < dearest:
                break
            x, each = waiting[0], at_once * (end - now) / len(waiting)
            tell(f"margin beyond x = {x:.4g}", 1.0 - len(waiting) / PLACES)
            one = pool.submit(_place, scene, side, names, words, x, min(EACH, max(each, LEAST)))
            begun[one] = now
            del waiting[0]
        if not begun:
            break
        for one in wait(begun, return_when=FIRST_COMPLETED).done:
            dearest = max(dearest, time.perf_counter() - begun.pop(one))
            found = _joined(found, one.result())
            keep(found.to_json())
    assert found is not None
    return found, len(waiting)
