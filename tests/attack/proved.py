"""What is proved against thousands of orbits: no start that a verdict speaks of may go on violating it."""

from __future__ import annotations

import io
import json
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from tests.attack import facts as model
from tests.attack.goals import Range, Verdict
from tests.attack.throws import Orbits, changes


def starts(facts: model.Facts, rng: Any, count: int) -> tuple[Any, Any, int]:
    """Starts on the arm: first those spread evenly (their number is returned), then near joint and critical points."""
    numbers = facts.floats()
    a, arm = numbers[0], numbers[6]
    even = int(0.8 * count)
    i = rng.choice(a.size, count, p=np.maximum(arm - a, 0) / np.maximum(arm - a, 0).sum())
    x = a[i] + (arm - a[i]) * (1 - rng.random(count))
    near = np.arange(count) >= even
    joint = near & (rng.random(count) < 0.3)
    x[joint] = (a[i] + (arm - a[i]) * 10 ** rng.uniform(-7, 0, count))[joint]
    for side in range(a.size):
        places = np.append(changes(numbers, side), arm)
        mine = near & ~joint & (i == side)
        off = rng.choice((-1, 1), count) * 10 ** rng.uniform(-11, -1.5, count) * (arm - a[side])
        # nearer to the joint a throw may move by less than floats can tell
        least = a[side] + 1e-9 * (arm - a[side])
        x[mine] = np.clip(rng.choice(places, count) + off, least, arm)[mine]
    return x, i, even


def wrong(goal: dict[str, Any], facts: model.Facts, orbits: Orbits, throws: int) -> Any:
    """Which orbits, from what was seen of them in this many throws, do not what the goal asks."""
    unit = model.UNITS[facts.unit]
    kind = next(key for key in goal if key != "from_anywhere")
    left = orbits.code < 0
    if kind == "oriented_beyond":
        x, side = float(model.si(goal[kind]["x"]) / unit), goal[kind]["side"]
        most = np.delete(orbits.most, side, axis=1).max(axis=1)
        return left | (most > x * (1 + 1e-12))
    if kind == "reaches":
        x, side = float(model.si(goal[kind]["x"]) / unit), goal[kind]["side"]
        return orbits.most[:, side] < x * (1 - 1e-12)
    if kind == "flip_order":
        order, n = goal[kind], len(facts.a)
        if len(order) == 1:
            others = np.delete(orbits.most, order[0], axis=1).max(axis=1)
            return left | (others > -np.inf)
        if len(order) != n or any((order[k - 1] + 1) % n != order[k] for k in range(n)):
            return np.ones_like(left)
        return left | (orbits.longest >= throws)
    return left


def sequence(rng: Any, within: Range, throws: int, style: int) -> tuple[Any, Any]:
    """Noise of many throws, the same for all orbits: at random, at the ends, or an end kept for some throws."""
    if style == 0:
        return rng.uniform(within.lo, within.hi, throws), within.e * rng.uniform(-1, 1, throws)
    signs = rng.choice((-1, 1), (2, throws))
    if style == 2:
        signs = np.repeat(rng.choice((-1, 1), (2, throws // 20 + 1)), 20, axis=1)[:, :throws]
    if style == 3:
        signs = np.full((2, throws), 1) * rng.choice((-1, 1), (2, 1))
    return np.where(signs[0] > 0, within.hi, within.lo), within.e * signs[1]


def move(orbits: Orbits, within: Range, throws: int, rng: Any, style: int) -> None:
    """Throw on; style -1 is without noise, 4 chooses it for each orbit."""
    if not within.noisy or style < 0:
        orbits.fly(throws)
    elif style == 4:
        sides = orbits.numbers[0].size
        shape = orbits.x.size, sides + 3
        weights = rng.normal(0, 1, shape) * rng.choice((0, 1, 5), shape)
        orbits.chase(throws, within.lo, within.hi, within.e, weights, int(rng.integers(1 << 31)))
    else:
        orbits.fly(throws, *sequence(rng, within, throws, style))


def settle(goal: dict[str, Any], within: Range, x: Any, i: Any, rng: Any, style: int, least: int) -> Any:
    """Which starts' orbits go on violating the goal however long one waits, and how each ended.

    All orbits are watched in windows; those that did wrong in the last one are watched again in a longer one, up to
    some ten thousand throws after as many: what is only on its way has time to arrive.
    """
    anywhere = goal.get("from_anywhere", False)
    orbits = Orbits(within.facts.floats(), x, i)
    bad = np.arange(orbits.x.size)
    code, at, side = np.zeros(orbits.x.size, dtype=int), orbits.x.copy(), orbits.i.copy()
    many = style == 4
    windows = (200, 500, 2000, 8000) if many else (500, 1000, 4000, 16000)
    for window in windows:
        window = max(window, least)
        if not anywhere:
            move(orbits, within, window, rng, style)
        if not anywhere or "reaches" not in goal:
            orbits.look()
        move(orbits, within, window, rng, style)
        code[bad], at[bad], side[bad] = orbits.code, orbits.x, orbits.i
        still = wrong(goal, within.facts, orbits, window)
        bad = bad[still]
        if not bad.size:
            break
        final = anywhere and "reaches" not in goal and "flip_order" not in goal
        if final:
            break
        orbits = orbits.only(still) if not anywhere else _kept(orbits, still)
    return bad, code, at, side


def _kept(orbits: Orbits, which: Any) -> Orbits:
    """Some of the orbits with what was seen of them."""
    found = orbits.only(which)
    found.most, found.least = orbits.most[which].copy(), orbits.least[which].copy()
    return found


def cells_of(file: Path) -> list[tuple[Any, list[Any]]]:
    """Per box the ranks and the borders of the cells of each side, from a certificate."""
    with zipfile.ZipFile(file) as whole:
        header = json.loads(whole.read("header.json"))
        arrays = np.load(io.BytesIO(whole.read("arrays.npz")))
        found = []
        for box in header["boxes"]:
            prefix = box["prefix"]
            count = sum(key.startswith(f"{prefix}edges.") for key in arrays)
            sides = [arrays[f"{prefix}edges.{k}"] for k in range(count)]
            found.append((arrays[f"{prefix}rank"], sides))
    return found


def cycles(facts: model.Facts, grid: int = 4000, longest: int = 10) -> list[tuple[float, int, int]]:
    """Periodic orbits, repelling ones too: x, side and period, where neighbours of one itinerary change order."""
    numbers = facts.floats()
    a, arm = numbers[0], numbers[6]
    x = np.concatenate([near + (arm - near) * (np.arange(grid) + 0.5) / grid for near in a])
    i = np.repeat(np.arange(a.size), grid)
    orbits, word, found = Orbits(numbers, x, i), np.ones(x.size, dtype=np.int64), []
    for period in range(1, longest + 1):
        orbits.fly(1)
        word = 2 * word + orbits.code
        back = (orbits.code >= 0) & (orbits.i == i)
        gap = orbits.x - x
        k = np.flatnonzero(
            back[1:] & back[:-1] & (word[1:] == word[:-1]) & (i[1:] == i[:-1]) & (gap[1:] * gap[:-1] < 0)
        )
        lo, hi = x[k].copy(), x[k + 1].copy()
        for _ in range(60):
            middle = Orbits(numbers, 0.5 * (lo + hi), i[k])
            start = middle.x.copy()
            middle.fly(period)
            same = (middle.x > start) == (gap[k] > 0)
            lo, hi = np.where(same, start, lo), np.where(same, hi, start)
        there = Orbits(numbers, lo, i[k])
        there.fly(period)
        good = (there.code >= 0) & (there.i == i[k]) & (np.abs(there.x - lo) < 1e-6 * arm)
        found += [(float(at), int(on), period) for at, on in zip(lo[good], i[k][good], strict=True)]
    return found


def claimed(claim: dict[str, Any], file: Path, x: Any, i: Any) -> Any:
    """Which starts a verdict speaks of."""
    of = claim.get("starts")
    if isinstance(of, dict):
        first = np.full(int(i.max()) + 1, np.inf)
        for side, value in of["from"].items():
            if int(side) < first.size:
                first[int(side)] = float.fromhex(value) if isinstance(value, str) else float(value)
        return x > first[i]
    if of == "cells":
        allowed = np.ones(x.size, dtype=bool)
        for rank, sides in cells_of(file):
            base = 0
            for side, borders in enumerate(sides):
                mine = i == side
                k = np.searchsorted(borders, x) - 1
                inside = (k >= 0) & (k < borders.size - 1) & (x > borders[0]) & (x < borders[-1])
                k = np.clip(k, 0, borders.size - 2)
                allowed[mine] &= (inside & (rank[base + k] >= 0))[mine]
                base += borders.size - 1
        return allowed
    return np.ones(x.size, dtype=bool)


def shown(facts: model.Facts, x: Any, i: Any, k: Any) -> str:
    return ", ".join(f"({float(x[j])!r} {facts.unit}, side {int(i[j])})" for j in k[:3])


def proved_goal(
    found: Verdict, claim: dict[str, Any], within: list[Range], file: Path, rng: Any, count: int
) -> None:
    """No start that the verdict speaks of may go on violating the goal."""
    goal = tomllib.loads(found.case.text)["goal"]
    section = claim.get("section") or {}
    if claim.get("starts") == "cells" and not file.exists():
        found.doubts.append("proved-on-cells without a certificate: the cells are not known")
        return
    thinned = claim.get("starts") in (None, "almost-every") or "thinning" in section
    thinned |= goal.get("reaches", {}).get("every_orbit") is False  # which speaks of almost every orbit
    least = min(int(section.get("throws") or 0) + 1, 20_000)
    least = max(least, min(int(section.get("jogs") or 0) + 2, 20_000))
    for each in within if not thinned else []:
        for at, on, period in cycles(each.facts):
            once = Orbits(each.facts.floats(), [at], [on])
            once.fly(2 * period)
            spoken = claimed(claim, file, np.array([at]), np.array([on]))
            if spoken[0] and wrong(goal, each.facts, once, 2 * period)[0]:
                found.fault(
                    f"goal {claim['verdict']} of {claim.get('starts')}: a cycle of {period} throws violates it,"
                    f" from {at!r} on side {on}"
                )
    for which, each in enumerate(within):
        x, i, even = starts(each.facts, rng, count // len(within))
        spoken = claimed(claim, file, x, i)
        if claim["verdict"] == "proved" and claim.get("starts") == "every" and not spoken.all():
            found.fault("every start, but not all")
        styles = ([0, 1, 2, 3] if thinned else [0, 2, 4]) if each.noisy else [-1]
        style = int(rng.choice(styles))
        for now in {style, styles[-1]}:
            if now == 4:  # five throws for each: fewer starts
                few = rng.choice(x.size, max(count // 20, 100))
                x, i, spoken = x[few], i[few], spoken[few]
            bad, code, at, side = settle(goal, each, x, i, rng, now, least)
            really = bad[spoken[bad]]
            if really.size:
                where = shown(each.facts, x, i, really)
                ends = shown(each.facts, at, side, really)
                found.fault(
                    f"goal {claim['verdict']} of {claim.get('starts')}: {really.size} of {spoken.sum()} starts"
                    f" go on violating it (variant {which}, noise {now}), e.g. {where} -> {ends},"
                    f" codes {sorted(set(code[really].tolist()))}"
                )
            if now == 4:
                continue
            shares(found, claim, each, (x, i), (bad, code, at, side), even)


def _lost(within: Range, kappa: float, x: Any, i: Any) -> float:
    orbits = Orbits(within.facts.floats(), x, i)
    orbits.fly(3000, np.full(3000, kappa), np.full(3000, -within.e))
    return float((orbits.code < 0).mean())


def shares(found: Verdict, claim: dict[str, Any], within: Range, starts: Any, ends: Any, even: int) -> None:
    """The shares that are claimed against those of evenly spread starts."""
    (x, i), (bad, code, at, side) = starts, ends
    room = 4 * np.sqrt(0.25 / even) + 1e-3
    good = 1 - (bad < even).sum() / even
    left = (code[:even] < 0).mean()
    if within.e > 0:  # with noise it is what can be lost: the landing always short, each kappa kept
        left = max(_lost(within, kappa, x[:even], i[:even]) for kappa in (within.lo, within.hi))
    said = {key: claim.get(key) for key in ("share", "leaves", "creeps", "open")}
    if said["share"] is not None and said["share"] > good + room:
        found.fault(f"share {said['share']} of starts is claimed, {good:.4f} of the samples hold it")
    if said["leaves"] is not None and said["leaves"] > left + room:
        found.fault(f"leaves {said['leaves']} is claimed, {left:.4f} of the samples leave")
    if said["creeps"]:
        numbers = within.facts.floats()
        near = (at - numbers[0][side] < 0.2 * (numbers[6] - numbers[0][side]))[:even].mean()
        if within.facts.h <= 0 or said["creeps"] > near + room:
            found.fault(f"creeps {said['creeps']} is claimed, {near:.4f} of the samples end near the joint")
    if all(isinstance(said[key], (int, float)) for key in ("share", "leaves", "open")):
        total = said["share"] + said["leaves"] + (said["creeps"] or 0) + said["open"]
        if not 1 - 1e-9 <= total <= 1 + 0.02:
            found.doubts.append(f"shares add up to {total}")
        whole = claim["verdict"] == "proved" and claim["starts"] in ("every", "almost-every")
        if whole and said["share"] < 1 - 1e-9:
            found.fault(f"proved of {claim['starts']} start with a share of {said['share']}")


def attraction(found: Verdict, claim: dict[str, Any], within: list[Range], rng: Any, count: int) -> None:
    """Every start has to come into the extents, as fast as it is said, and stay."""
    extents = claim["extents"]
    for which, each in enumerate(within):
        numbers = each.facts.floats()
        sides = numbers[0].size
        pieces = max([1, *(len(parts) for parts in extents.values())])
        ends = np.full((sides, pieces, 2), np.nan)
        for key, parts in extents.items():
            for k, (lo, hi) in enumerate(parts):
                ends[int(key), k] = lo[0], hi[1]
        x, i, _ = starts(each.facts, rng, count // len(within))
        points = claim.get("jog_fixed_points")
        beyond = np.ones(x.size, dtype=bool)
        if points:
            beyond = x > np.array([points[str(k)][1] for k in range(sides)])[i]
            below = x < np.array([points[str(k)][0] for k in range(sides)])[i]
            creep = Orbits(numbers, x[below], i[below])
            move(creep, each, 500, rng, 0 if each.noisy else -1)
            far = (creep.i != i[below]) | (creep.code == -2) | (creep.x > x[below])
            if far.any():
                found.fault(
                    "attracts-all: starts below R* do not creep: "
                    + shown(each.facts, x[below], i[below], np.flatnonzero(far))
                )
        of = claim.get("starts")
        if isinstance(of, dict):
            beyond &= claimed(claim, Path(), x, i)
        bound = claim.get("max_throws")
        sharp = np.zeros(x.size, dtype=bool)
        if bound:
            sharp = beyond & (x >= np.array([bound["beyond"][str(k)] for k in range(sides)])[i])
        for at, on, period in cycles(each.facts) if of in (None, "every") or isinstance(of, dict) else []:
            first = points[str(on)][1] if points else of["from"][str(on)] if isinstance(of, dict) else 0.0
            once = Orbits(numbers, [at], [on])
            wider = ends + 1e-6 * numbers[6] * np.array((-1, 1))
            if at > first + 1e-6 * numbers[6] and not _inside(once, wider)[0]:
                found.fault(
                    f"attracts-all proved: a cycle of {period} throws is outside the extents,"
                    f" from {at!r} on side {on}"
                )
        window = int(min(bound["throws"], 3000)) if bound else 2000
        for style in (0, 4) if each.noisy else (-1,):
            if style == 4:
                few = rng.choice(x.size, max(count // 20, 100))
                x, i, sharp, beyond = x[few], i[few], sharp[few], beyond[few]
            orbits = Orbits(numbers, x, i, ends)
            move(orbits, each, window, rng, style)
            out = sharp & ((orbits.code < 0) | ~_inside(orbits, ends))
            if bound and window == bound["throws"] and out.any():
                where = shown(each.facts, x, i, np.flatnonzero(out))
                found.fault(
                    f"attracts-all: not there after {window} throws (variant {which}, noise {style}): {where}"
                )
            every, orbits = np.flatnonzero(beyond), orbits.only(beyond)
            for more in (1, 4, 16):
                if more > 1:
                    move(orbits, each, more * min(window, 1000), rng, style)
                orbits.look()
                move(orbits, each, 200, rng, style)
                bad = (orbits.code < 0) | (orbits.last_out >= 0)
                every, orbits = every[bad], orbits.only(bad)
                if not every.size:
                    break
            if every.size:
                where = f"{shown(each.facts, x, i, every)} -> "
                where += shown(each.facts, orbits.x, orbits.i, range(every.size))
                found.fault(
                    f"attracts-all proved: {every.size} starts leave or stay outside"
                    f" (variant {which}, noise {style}): {where}"
                )


def _inside(orbits: Orbits, ends: Any) -> Any:
    own = ends[orbits.i]
    return ((own[:, :, 0] <= orbits.x[:, None]) & (orbits.x[:, None] <= own[:, :, 1])).any(axis=1)
