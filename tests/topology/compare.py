"""One point's topology against the reference: the fields in which they differ."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from limitsets.systems.sets.topology import Topologies
from tests.topology.reference import Reference

EXTENT, SHARE = 1e-6, 0.02


def class_of(t: Topologies, i: int) -> tuple[Any, ...]:
    """Class of a point: attractors, bands, flip order, period, what leaves and what collapses."""
    k = int(t.attractors[i])
    return (
        k,
        tuple(map(tuple, t.bands[i, :k].tolist())),
        tuple(map(tuple, t.flip_order[i, :k].tolist())),
        tuple(t.period[i, :k].tolist()),
        in_words(float(t.leaves[i])),
        in_words(float(t.collapses[i])),
    )


def in_words(share: float) -> str:
    """How much of the starts a share is."""
    return "none" if share == 0.0 else "all" if share == 1.0 else "some"


def differences(t: Topologies, i: int, r: Reference, starts: int, scale: float) -> dict[str, Any]:
    """Fields in which point i differs from the reference: theirs and ours."""
    found: dict[str, Any] = {}

    def note(name: str, theirs: Any, ours: Any, same: bool) -> None:
        if not same:
            found[name] = (theirs, ours)

    def slack_of(share: float) -> float:
        return SHARE + 4.0 * math.sqrt(max(share * (1.0 - share), 1.0 / starts) / starts) + r.remain

    k = int(t.attractors[i])
    note("attractors", len(r.attractors), k, len(r.attractors) == k)
    for name, share in (("leaves", r.leaves), ("collapses", r.collapses)):
        ours = float(getattr(t, name)[i])
        note(name, share, ours, abs(share - ours) <= slack_of(share))
        word = r.some[name]
        note(name + " in words", word, ours, word in ("?", in_words(ours)))
    for a in range(k if len(r.attractors) == k else 0):
        each = r.attractors[a]
        ours = float(t.share[i, a])
        note(f"share {a}", each.share, ours, abs(each.share - ours) <= slack_of(each.share))
        order = tuple(int(s) for s in t.flip_order[i, a] if s != -1)
        theirs = (-2,) * len(order) if each.flip_order is None else each.flip_order
        note(f"flip_order {a}", theirs, order, theirs == order)
        note(f"period {a}", each.period, int(t.period[i, a]), each.period == t.period[i, a])
        for side in range(t.bands.shape[2]):
            bands = each.bands.get(side, [])
            note(f"bands {a} {side}", bands, int(t.bands[i, a, side]), len(bands) == t.bands[i, a, side])
            if bands and t.bands[i, a, side]:
                ends = np.array([bands[0][0], bands[-1][1]])
                mine = np.array([t.lowest[i, a, side], t.reach[i, a, side]])
                same = bool(np.all(np.abs(ends - mine) <= EXTENT * max(scale, 1.0)))
                note(f"extents {a} {side}", ends, mine, same)
            jogs = each.jogs.get(side, (-1, -1))
            mine_jogs = (int(t.jogs_min[i, a, side]), int(t.jogs_max[i, a, side]))
            note(f"jogs {a} {side}", (jogs, each.seen_jogs.get(side)), mine_jogs, jogs == mine_jogs)
            seen = each.seen_jogs.get(side)
            inside = seen is None or (mine_jogs[0] <= seen[0] and seen[1] <= mine_jogs[1])
            note(f"jogs seen {a} {side}", seen, mine_jogs, inside)
    return found
