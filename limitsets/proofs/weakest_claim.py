"""One claim of all pieces of a tolerance, from those of each: the weakest numbers, for the fewest starts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from limitsets.proofs.attraction import Attraction
from limitsets.proofs.proof import Claim

# For which starts a goal holds: the fewer the later.
STARTS = ("every", "within", "almost-every", "from", "cells")


def weakest_of(claims: Sequence[Claim], found: Sequence[Attraction]) -> Claim:
    """Join one claim, proved on every piece by its cells: with the weakest of the numbers, for the fewest starts."""
    sections = [claim.section for claim in claims]
    section = dict(sections[0])
    near = [other["near_joint"] for other in sections if "near_joint" in other]
    section.pop("near_joint", None)
    if len(near) == len(sections):
        section["near_joint"] = {side: _weakest([other[side] for other in near]) for side in near[0]}
    for count in ("max_rank", "throws", "jogs", "thinning"):
        counts = [other[count] for other in sections if count in other]
        if counts:
            section[count] = max(counts)
    if "least_slope" in section:
        section["least_slope"] = min((other["least_slope"] for other in sections), key=float.fromhex)
    if claims[0].starts is None:
        return Claim(claims[0].claim, "proved", "", section)
    words = [one.starts if isinstance(one.starts, str) else next(iter(one.starts)) for one in claims]
    weakest = max(zip(words, claims, strict=True), key=lambda each: STARTS.index(each[0]))[1]
    starts = weakest.starts
    section.pop("lost", None)
    if isinstance(starts, dict) and "from" in starts:
        given = [claim.starts["from"] for claim in claims if isinstance(claim.starts, dict)]
        if len(near) < len(sections):  # of starts before the cells nothing is claimed then
            first = [[float(edges[0]) for (edges,) in one.cover.grid.edges] for one in found]
            given += [{side: cells[int(side)] for side in given[0]} for cells in first]
        starts = {"from": {side: max(each[side] for each in given) for side in given[0]}}
        section["starts"] = {"from": {side: x.hex() for side, x in starts["from"].items()}}
        lost = [other["lost"] for other in sections if "lost" in other]
        if len(lost) == len(claims):
            section["lost"] = {
                side: min((each[side] for each in lost), key=float.fromhex) for side in lost[0]
            }
        most, whole = zip(*(one.shares_from(section) for one in found), strict=True)
    else:
        section["starts"] = weakest.section["starts"]
        most, whole = tuple(claim.shares for claim in claims), (True,)
    least = {"share": min, "leaves": min, "creeps": min, "open": max}
    shares = {key: pick(each[key] for each in most) for key, pick in least.items()}
    notes = {claim.note for claim in claims}
    note = notes.pop() if len(notes) == 1 else ""
    joined = replace(weakest, section=section, counterexample=(), starts=starts, shares=shares, note=note)
    if all(whole):
        return joined
    share = math.ceil(1000.0 * shares["open"]) / 10.0
    reason = (
        "each value is proved alone, but near the joint starts that come out at one value may stay behind at another:"
        f" of {share:g} % of the starts the same is not proved for all, and 1 % may be"
    )
    return replace(joined, verdict="proved-on-cells", reason=reason)


def _weakest(near: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Near the joint on one side of every piece: the least factor, and a bracket of all fixed points."""
    joined: dict[str, Any] = {"q": min((each["q"] for each in near), key=float.fromhex)}
    if "fixed_point" in near[0]:  # or in none of them: h = 0 would lie in a piece between
        ends = [each["fixed_point"] for each in near]
        lowest, highest = (lo for lo, _ in ends), (hi for _, hi in ends)
        joined["fixed_point"] = [min(lowest, key=float.fromhex), max(highest, key=float.fromhex)]
    return joined
