"""Each verdict about a scene against orbits: what is proved must hold on thousands, what is refuted must replay.

A verdict is read from the JSON of `limitsets certify --json`, the cells of a `proved-on-cells` from the certificate's
arrays. Orbits, digits, units and geometry are the code of this folder.
"""

from __future__ import annotations

import contextlib
import io
import json
import time
import tomllib
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mpmath import mp, mpf

from limitsets.cli import main
from tests.attack import digits
from tests.attack import facts as model
from tests.attack.generate import Case
from tests.attack.throws import Orbits, changes

ORBITS = 10_000


@dataclass
class Verdict:
    """What was asked and answered, and where orbits say otherwise."""

    case: Case
    claims: list[dict[str, Any]] = field(default_factory=list)
    recheck: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)

    def fault(self, text: str) -> None:
        self.faults.append(text)


def command(*words: str) -> tuple[int, str, str]:
    """The command line, within this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(words)
    return code, out.getvalue(), err.getvalue()


def ask(case: Case, folder: Path, claims: tuple[str, ...]) -> tuple[int, list[dict[str, Any]], Path, str]:
    """Certify a scene; exit code, claims, certificate, what went to stderr."""
    scene, file = folder / "attacked.toml", folder / "attacked.proof.zip"
    scene.write_text(case.text)
    for old in folder.glob("attacked.proof*"):
        old.unlink()
    words = [word for claim in claims for word in ("--claim", claim)]
    words += [word for name, by in case.noise.items() for word in ("--noise", f"{name}={by}")]
    words += [word for name, by in case.tolerance.items() for word in ("--tolerance", f"{name}={by}")]
    code, out, err = command("certify", str(scene), *words, "--json", "--no-recheck", "-o", str(file))
    found = json.loads(out) if out else []
    for claim in found:
        claim.setdefault("starts", (claim.get("section") or {}).get("starts"))
    return code, found, file, err


@dataclass(frozen=True)
class Range:
    """A scene within a tolerance, with its noise."""

    facts: model.Facts
    lo: float
    hi: float
    e: float

    @property
    def noisy(self) -> bool:
        return self.hi > self.lo or self.e > 0


def ranges(case: Case, rng: Any) -> list[Range]:
    """The scene; with a tolerance its two ends, the middle and one in between."""
    scene = tomllib.loads(case.text)
    found = [scene]
    for quantity, by in case.tolerance.items():
        share = model.si(by)
        shifts = [mpf(1), 1 - share, 1 + share, 1 + share * mpf(float(rng.uniform(-1, 1)))]
        found = [model.moved(scene, quantity, mp.nstr(shift, 40)) for shift in shifts]
    every = []
    for each in found:
        facts = model.read(each)
        lo, hi = model.kappas(facts, scene, case.noise)
        every.append(Range(facts, float(lo), float(hi), float(model.landing(facts, case.noise))))
    return every


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
        x[mine] = np.clip(rng.choice(places, count) + off, np.nextafter(a[side], arm), arm)[mine]
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


def creeping(facts: model.Facts, orbits: Orbits) -> Any:
    """Which orbits are at the joint, or have crept to it as near as floats tell."""
    numbers = facts.floats()
    near = orbits.x - numbers[0][orbits.i] < 1e-5 * numbers[6]
    return near & (facts.h > 0) & (orbits.code != -2)


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
        weights = rng.normal(0, 1, (orbits.x.size, sides + 3)) * rng.choice((0, 1, 5), (orbits.x.size, sides + 3))
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
    windows = (200, 500, 2000) if many else (500, 1000, 4000, 16000)
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
    """The same orbits with what was seen of them."""
    found = orbits.only(which)
    found.most, found.least = orbits.most[which].copy(), orbits.least[which].copy()
    found.longest = np.zeros_like(found.longest) if False else found.run.copy()
    return found


def cells_of(file: Path) -> list[tuple[Any, list[Any]]]:
    """Per box the ranks and the borders of the cells of each side, from a certificate."""
    with zipfile.ZipFile(file) as whole:
        header = json.loads(whole.read("header.json"))
        arrays = np.load(io.BytesIO(whole.read("arrays.npz")))
        found = []
        for box in header["boxes"]:
            prefix = box["prefix"]
            sides = [arrays[f"{prefix}edges.{k}"] for k in range(sum(f"{prefix}edges." in key for key in arrays))]
            found.append((arrays[f"{prefix}rank"], sides))
    return found


def cycles(facts: model.Facts, grid: int = 4000, longest: int = 10) -> list[tuple[float, int, int]]:
    """Periodic orbits, repelling ones too: x, side and period, wherever neighbours of a grid of one itinerary change order."""
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
        k = np.flatnonzero(back[1:] & back[:-1] & (word[1:] == word[:-1]) & (i[1:] == i[:-1]) & (gap[1:] * gap[:-1] < 0))
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


def proved_goal(found: Verdict, claim: dict[str, Any], within: list[Range], file: Path, rng: Any, count: int) -> None:
    """No start that the verdict speaks of may go on violating the goal."""
    goal = tomllib.loads(found.case.text)["goal"]
    section = claim.get("section") or {}
    if claim.get("starts") == "cells" and not file.exists():
        found.doubts.append("proved-on-cells without a certificate: the cells are not known")
        return
    thinned = claim.get("starts") in (None, "almost-every") or "thinning" in section
    least = min(int(section.get("throws") or 0) + 1, 20_000)
    least = max(least, min(int(section.get("jogs") or 0) + 2, 20_000))
    for each in within if not thinned else []:
        for at, on, period in cycles(each.facts):
            once = Orbits(each.facts.floats(), [at], [on])
            once.fly(2 * period)
            if claimed(claim, file, np.array([at]), np.array([on]))[0] and wrong(goal, each.facts, once, 2 * period)[0]:
                found.fault(f"goal {claim['verdict']} of {claim.get('starts')}: a cycle of {period} throws from {at!r} on side {on} violates it")
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
                    f"goal {claim['verdict']} of {claim.get('starts')}: {really.size} of {spoken.sum()} starts go on violating"
                    f" it (variant {which}, noise {now}), e.g. {where} -> {ends}, codes {sorted(set(code[really].tolist()))}"
                )
            if now == 4:
                continue
            shares(found, claim, each, x, i, bad, code, at, side, even)


def _lost(within: Range, kappa: float, x: Any, i: Any) -> float:
    orbits = Orbits(within.facts.floats(), x, i)
    orbits.fly(3000, np.full(3000, kappa), np.full(3000, -within.e))
    return float((orbits.code < 0).mean())


def shares(
    found: Verdict, claim: dict[str, Any], within: Range, x: Any, i: Any, bad: Any, code: Any, at: Any, side: Any, even: int
) -> None:
    """The shares that are claimed against those of evenly spread starts."""
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
        if claim["verdict"] == "proved" and claim["starts"] in ("every", "almost-every") and said["share"] < 1 - 1e-9:
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
                found.fault(f"attracts-all: starts below R* do not creep: {shown(each.facts, x[below], i[below], np.flatnonzero(far))}")
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
            if at > first + 1e-6 * numbers[6] and not _inside(once, ends + 1e-6 * numbers[6] * np.array((-1, 1)))[0]:
                found.fault(f"attracts-all proved: a cycle of {period} throws from {at!r} on side {on} is outside the extents")
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
                found.fault(f"attracts-all: not there after {window} throws (variant {which}, noise {style}): {where}")
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
                where = f"{shown(each.facts, x, i, every)} -> {shown(each.facts, orbits.x, orbits.i, range(every.size))}"
                found.fault(f"attracts-all proved: {every.size} starts leave or stay outside (variant {which}, noise {style}): {where}")


def _inside(orbits: Orbits, ends: Any) -> Any:
    own = ends[orbits.i]
    return ((own[:, :, 0] <= orbits.x[:, None]) & (orbits.x[:, None] <= own[:, :, 1])).any(axis=1)


def thrown(case: Case, state: dict[str, Any]) -> tuple[model.Facts, mpf]:
    """The scene that a state of a counterexample is thrown in, and the shift of its landing."""
    scene = tomllib.loads(case.text)
    said = state["parameters"] or {}
    for name, value in said.items():
        if name in ("throw.kappa", "landing.x", "gravity.tilt"):
            continue
        if name == "throw.speed" and "kappa" in scene["throw"]:
            continue
        pair = [value, value] if isinstance(value, str) else value
        number = [mpf(each.split()[0]) for each in pair]
        scene = model.moved(scene, name, to=f"{mp.nstr((number[0] + number[1]) / 2, 45)} {pair[0].split()[1]}")
    facts = model.read(scene)
    if "throw.kappa" in said:
        stated = model.si(said["throw.kappa"]) / model.UNITS[facts.unit]
        if abs(stated / facts.kappa - 1) > mpf("1e-14"):
            facts = facts.with_kappa(stated)
    shift = model.si(said["landing.x"]) / model.UNITS[facts.unit] if "landing.x" in said else mpf(0)
    return facts, shift


def replayed(states: list[dict[str, Any]], case: Case, within: list[Range]) -> tuple[str, str, list[Any], mpf]:
    """Throw a counterexample's orbit again at 50 digits from its first state: what is false, what is doubtful, the last.

    Where it comes round to its first state again, the throws begin at a state that is told exactly, if there is one.
    """
    arm = within[0].facts.arm
    lo, hi, e = min(w.lo for w in within), max(w.hi for w in within), within[0].e
    round_again = states[0]["side"] == states[-1]["side"] and states[0]["between"] == states[-1]["between"]
    exact = [k for k, state in enumerate(states[:-1]) if state["between"][0] == state["between"][1]]
    if round_again and exact:
        states = [*states[exact[0] : -1], *states[: exact[0]], {**states[exact[0]], "parameters": None}]
    slack, doubt = arm * mpf("1e-13"), ""
    last: list[Any] = [mpf(states[0]["x"]), states[0]["side"], 0]
    for k, state in enumerate(states):
        at = [mpf(end) for end in state["between"]]
        closing = round_again and k == len(states) - 1
        if last[1] != state["side"] or not at[0] - slack <= last[0] <= at[1] + slack:
            if not closing and not doubt:
                doubt = f"from its start it lies at {mp.nstr(last[0], 20)} after {k} throws, outside {state['between']}"
        if k == len(states) - 1 and state["parameters"] is None:
            break
        facts, shift = thrown(case, state)
        if not lo * (1 - 1e-13) <= facts.kappa <= hi * (1 + 1e-13) or abs(shift) > e * (1 + 1e-13):
            return f"throw {k} is outside the noise: kappa {mp.nstr(facts.kappa, 17)} in [{lo}, {hi}], landing {mp.nstr(shift, 10)}", doubt, last, mpf(0)
        alone = digits.throw(facts, mpf(state["x"]), state["side"], shift)
        if k + 1 < len(states) and not (closing or round_again and k == len(states) - 2):
            then = states[k + 1]
            width = sum(mpf(each["between"][1]) - mpf(each["between"][0]) for each in (state, then))
            if alone[1] != then["side"] or abs(alone[0] - mpf(then["x"])) > 100 * width + arm * mpf("1e-10"):
                return f"throw {k} lands at {mp.nstr(alone[0], 20)} on side {alone[1]}, not {then['x']} on {then['side']}", doubt, last, mpf(0)
        last = list(digits.throw(facts, last[0], last[1], shift)) if not doubt else list(alone)
    return "", doubt, last, abs(last[0] - mpf(states[0]["x"])) if round_again and last[1] == states[0]["side"] else mp.inf


def refuted(found: Verdict, claim: dict[str, Any], within: list[Range]) -> None:
    """The counterexample replays at 50 digits, within the noise; it violates what it refutes, and recurs where it must."""
    states = claim["counterexample"]
    case, word = found.case, f"{claim['claim']} refuted of {claim.get('starts')}"
    if not states:
        found.fault(f"{word} without an orbit: {claim.get('reason')}")
        return
    fault, doubt, last, gap = replayed(states, case, within)
    if fault:
        found.fault(f"{word}: {fault}")
        return
    if doubt:
        found.doubts.append(f"{word}: {doubt}")
    goal = tomllib.loads(case.text).get("goal", {})
    kind = "attracts_all" if claim["claim"] == "attracts-all" else next(key for key in goal if key != "from_anywhere")
    if last[2] < 0:
        return
    if kind in ("attracts_all", "stays_on_arm"):
        found.fault(f"{word}: the orbit does not leave the arm")
        return
    facts = thrown(case, states[0])[0]
    recurs = claim.get("recurs") or {}
    points, flips = [(mpf(state["x"]), state["side"]) for state in states], 0
    flips = sum(p[1] != q[1] for p, q in zip(points, points[1:], strict=False))
    if "cycle" in recurs:
        points, flips = cycle(found, claim, recurs["cycle"], facts, word)
    elif "component" in recurs:
        component(found, goal, kind, points, within, word)
        return
    elif not goal.get("from_anywhere"):
        if claim.get("starts") == "almost-every":
            found.fault(f"{word}, but no cycle that attracts is named")
        if "closed" in recurs and "kappa" in recurs:
            ends = [float.fromhex(end) for end in recurs["kappa"]]
            before = _before(states)
            to = next(state for state in states if state["between"][0] == state["between"][1])
            both = [digits.throw(thrown(case, before)[0].with_kappa(mpf(end)), mpf(before["x"]), before["side"]) for end in ends]
            parted = (both[0][0] - mpf(to["x"])) * (both[1][0] - mpf(to["x"])) < 0
            if not parted or {both[0][1], both[1][1]} != {to["side"]} or not within[0].lo * (1 - 1e-13) <= min(ends) <= max(ends) <= within[0].hi * (1 + 1e-13):
                found.fault(f"{word}: it does not close between the two kappas {ends}")
        elif not gap <= within[0].e * (1 + 1e-9):
            found.fault(f"{word}: the orbit neither leaves nor returns ({len(states)} states, gap {mp.nstr(gap, 5)}, {recurs})")
    if not violates(goal, kind, points, flips, facts):
        found.fault(f"{word}: the orbit does not violate it")


def component(found: Verdict, goal: dict[str, Any], kind: str, points: list[Any], within: list[Range], word: str) -> None:
    """Refuted by cells that keep their orbits: none that begins there may do what is asked, whatever the noise."""
    rng = np.random.default_rng(found.case.seed)
    if kind != "reaches":
        found.fault(f"{word} by a component of cells, a goal of kind {kind}")
        return
    for style in (0, 1, 4) if within[0].noisy else (-1,):
        which = rng.integers(0, len(points), 500)
        x = np.array([float(points[k][0]) for k in which])
        orbits = Orbits(within[0].facts.floats(), x, np.array([points[k][1] for k in which]))
        move(orbits, within[0], 2000, rng, style)
        if not wrong(goal, within[0].facts, orbits, 2000).all():
            found.fault(f"{word}: orbits from the cells that never get there do get there (noise {style})")


def _before(states: list[dict[str, Any]]) -> dict[str, Any]:
    """The state from which a closed orbit is thrown back to the one that is told exactly."""
    k = next(k for k, state in enumerate(states) if state["between"][0] == state["between"][1])
    return states[k - 1] if k else states[-2]


def violates(goal: dict[str, Any], kind: str, points: list[Any], flips: int, facts: model.Facts) -> bool:
    """Whether an orbit, or a cycle gone round once, violates a goal."""
    if kind == "flip_order":
        order, n = goal[kind], len(facts.a)
        turning = len(order) == n and all((order[k - 1] + 1) % n == order[k] for k in range(n))
        return flips == 0 if turning else flips > 0 or any(on not in order for _, on in points)
    x, side = model.si(goal[kind]["x"]) / model.UNITS[facts.unit], goal[kind]["side"]
    if kind == "reaches":
        return not any(on == side and at >= x for at, on in points)
    return any(on != side and at > x for at, on in points[1 if goal.get("from_anywhere") else 0 :])


def cycle(found: Verdict, claim: dict[str, Any], told: dict[str, Any], facts: model.Facts, word: str) -> tuple[list[Any], int]:
    """Find the periodic orbit anew at 50 digits: its itinerary, its interval, whether it attracts."""

    def round_(x: mpf) -> tuple[mpf, list[Any], list[int]]:
        points, codes, at, on = [], [], x, told["side"]
        for _ in told["itinerary"]:
            points.append((at, on))
            at, on, code = digits.throw(facts, at, on)
            codes.append(code)
        return at, points, codes

    def number(value: Any) -> mpf:
        return mpf(float.fromhex(value)) if isinstance(value, str) else mpf(value)

    lo, hi = map(number, told["interval"])
    x, step, slope = (lo + hi) / 2, mpf("1e-22"), mpf(0)
    for _ in range(8):
        at, points, codes = round_(x)
        if codes != list(told["itinerary"]):
            found.fault(f"{word}: the cycle from {mp.nstr(x, 20)} on side {told['side']} throws {codes}, not {told['itinerary']}")
            return points, 1
        slope = (round_(x + step)[0] - at) / step
        gap = at - x
        x += gap / (1 - slope)
    if abs(gap) > mpf("1e-30") or not lo <= x <= hi:
        found.fault(f"{word}: no cycle in the interval {told['interval']}: {mp.nstr(x, 20)}, gap {mp.nstr(gap, 5)}")
    bounds = sorted(map(number, told["multiplier"]))
    if not bounds[0] - mpf("1e-6") * abs(slope) <= slope <= bounds[1] + mpf("1e-6") * abs(slope):
        found.fault(f"{word}: multiplier {mp.nstr(slope, 17)} is not in {told['multiplier']}")
    if bool(told.get("attracts")) != (abs(slope) < 1) or (claim.get("starts") == "almost-every") != (abs(slope) < 1):
        found.fault(f"{word}: multiplier {mp.nstr(slope, 10)}, attracts: {told.get('attracts')}")
    return points, sum(codes)


def contradictory(first: dict[str, Any], second: dict[str, Any]) -> bool:
    """Whether one is proved of a set of starts of which the other is refuted."""
    if {first["verdict"], second["verdict"]} != {"proved", "refuted"}:
        return False
    yes, no = (first, second) if first["verdict"] == "proved" else (second, first)
    strength = {"every": 2, "almost-every": 1, None: 0}
    return strength.get(yes.get("starts") if isinstance(yes.get("starts"), str) else None, 0) >= strength.get(no.get("starts"), 1)


def judge(case: Case, folder: Path, count: int = ORBITS, recheck: bool = True) -> Verdict:
    """Certify, recheck, and look."""
    found = Verdict(case)
    rng = np.random.default_rng([11, case.seed])
    clock = time.monotonic()
    code, found.claims, file, err = ask(case, folder, case.claims)
    found.seconds["certify"] = time.monotonic() - clock
    if not found.claims:
        found.fault(f"certify: exit {code}, no JSON: {err.strip().splitlines()[-1:]}")
        return found
    proved = all(claim["verdict"] == "proved" for claim in found.claims)
    if (code == 0) != proved:
        found.fault(f"exit {code} with {[claim['verdict'] for claim in found.claims]}")
    for denied in folder.glob("*denied*"):
        found.fault(f"the checker denied {denied.name}: {[c.get('reason') for c in found.claims]}")
        denied.unlink()
    if recheck and file.exists():
        checked, out, err = command("recheck", str(file), "--json")
        found.recheck = json.loads(out) if out else {}
        said = found.recheck.get("verdict")
        kept = {claim["verdict"] for claim in found.claims} & {"proved", "proved-on-cells"}
        wanted = ("proved-on-cells",) if "proved-on-cells" in kept else ("proved",)
        wanted += ("refuted",) if not kept else ()
        if said not in wanted or (checked == 0) != (said == "proved"):
            found.fault(f"recheck: exit {checked}, {said!r}: {found.recheck.get('reason')} {err.strip()[-300:]}")
    found.seconds["recheck"] = time.monotonic() - clock - found.seconds["certify"]
    within = ranges(case, rng)
    for claim in found.claims:
        if claim["verdict"] == "refuted":
            refuted(found, claim, within)
        elif claim["claim"] == "goal" and claim["verdict"] in ("proved", "proved-on-cells"):
            proved_goal(found, claim, within, file, rng, count)
        elif claim["claim"] == "attracts-all" and claim["verdict"] == "proved":
            attraction(found, claim, within, rng, count)
    found.seconds["orbits"] = time.monotonic() - clock - sum(found.seconds.values())
    again(found, folder)
    return found


def again(found: Verdict, folder: Path) -> None:
    """Asked together with other claims, and so on other cells, the goal must not have the opposite verdict."""
    case = found.case
    if case.seed % 8:
        return
    other = ("goal",) if len(case.claims) > 1 else ("attracts-all", "invariant", "goal")
    _, claims, _, _ = ask(case, folder, other)
    for claim in found.claims:
        for second in claims:
            if claim["claim"] == second["claim"] and contradictory(claim, second):
                found.fault(f"{claim['claim']} {claim['verdict']} of {claim.get('starts')}, and {second['verdict']} of {second.get('starts')}")
