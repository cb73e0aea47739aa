"""The margin curve, place by place: the middle first, as many X as time permits, each stored as soon as it is found."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from limitsets.robust.margins.beyond import MarginsBeyond, margins_beyond, places_beyond
from limitsets.scene import Scene

__all__ = ["curve", "curve_read"]

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


def curve(
    scene: Scene,
    side: int,
    tolerance: Mapping[str, str],
    known: Mapping[str, Any] | None,
    *,
    seconds: float = SECONDS,
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
    seconds : float
        Shared by the proofs of all places; after it no further place is begun, but the middle one always is.
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
    begin = time.perf_counter()
    names = ("joint",) if tolerance else ("throw.speed",)
    places = places_beyond(scene, side, PLACES)
    places = places[np.argsort(np.abs(places - places.mean()), kind="stable")]
    found = None if known is None or known["side"] != side else curve_read(known, scene)
    done = set() if found is None else {round(x, 9) for x in found.x.tolist()}
    for number, x in enumerate(places.tolist()):
        if round(x, 9) in done:
            continue
        left = begin + seconds - time.perf_counter()
        if found is not None and left < 0.0:
            return found, len(places) - found.x.size
        each = min(EACH, max(left / (len(places) - number), LEAST))
        tell(f"margin beyond x = {x:.4g}", number / PLACES)
        one = margins_beyond(scene, side, names, x=[x], tolerance=tolerance, width=COARSE, seconds=each)
        found = _joined(found, one)
        keep(found.to_json())
    assert found is not None
    return found, 0
