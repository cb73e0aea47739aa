"""What is refuted against 50 digits: the orbit replays within the noise, violates the goal, and comes back."""

from __future__ import annotations

import tomllib
from itertools import pairwise
from typing import Any

import numpy as np
from mpmath import mp, mpf

from tests.attack import digits, facts as model
from tests.attack.generate import Case
from tests.attack.goals import Range, Verdict
from tests.attack.proved import move, wrong
from tests.attack.throws import Orbits


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
        middle = mp.nstr((number[0] + number[1]) / 2, 45)
        scene = model.moved(scene, name, to=f"{middle} {pair[0].split()[1]}")
    facts = model.read(scene)
    if "throw.kappa" in said:
        stated = model.si(said["throw.kappa"]) / model.UNITS[facts.unit]
        if abs(stated / facts.kappa - 1) > mpf("1e-14"):
            facts = facts.with_kappa(stated)
    shift = model.si(said["landing.x"]) / model.UNITS[facts.unit] if "landing.x" in said else mpf(0)
    return facts, shift


def replayed(states: list[Any], case: Case, within: list[Range]) -> tuple[str, str, list[Any], mpf]:
    """Throw a counterexample's orbit again at 50 digits from its first state: what is false, doubtful, the last.

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
        there = last[1] == state["side"] and at[0] - slack <= last[0] <= at[1] + slack
        if not (there or closing or doubt):
            doubt = f"from its start it lies at {mp.nstr(last[0], 20)} after {k} throws, outside {state['between']}"
        if k == len(states) - 1 and state["parameters"] is None:
            break
        facts, shift = thrown(case, state)
        if not lo * (1 - 1e-13) <= facts.kappa <= hi * (1 + 1e-13) or abs(shift) > e * (1 + 1e-13):
            text = f"throw {k} is outside the noise: kappa {mp.nstr(facts.kappa, 17)} in [{lo}, {hi}]"
            return f"{text}, landing {mp.nstr(shift, 10)}", doubt, last, mpf(0)
        alone = digits.throw(facts, mpf(state["x"]), state["side"], shift)
        if k + 1 < len(states) and not (closing or (round_again and k == len(states) - 2)):
            then = states[k + 1]
            width = sum(mpf(each["between"][1]) - mpf(each["between"][0]) for each in (state, then))
            if alone[1] != then["side"] or abs(alone[0] - mpf(then["x"])) > 100 * width + arm * mpf("1e-10"):
                text = f"throw {k} lands at {mp.nstr(alone[0], 20)} on side {alone[1]}"
                return f"{text}, not {then['x']} on {then['side']}", doubt, last, mpf(0)
        last = list(digits.throw(facts, last[0], last[1], shift)) if not doubt else list(alone)
    closes = round_again and last[1] == states[0]["side"]
    return "", doubt, last, abs(last[0] - mpf(states[0]["x"])) if closes else mp.inf


def refuted(found: Verdict, claim: dict[str, Any], within: list[Range]) -> None:
    """The counterexample replays at 50 digits, within the noise; it violates the goal, and recurs where it must."""
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
    kind = next((key for key in goal if key != "from_anywhere"), "")
    kind = "attracts_all" if claim["claim"] == "attracts-all" else kind
    if last[2] < 0:
        return
    if kind == "attracts_all" and claim.get("starts") == "almost-every":
        two_basins(found, mpf(states[0]["x"]), states[0]["side"], within, word)
        return
    if kind in ("attracts_all", "stays_on_arm"):
        found.fault(f"{word}: the orbit does not leave the arm")
        return
    facts = thrown(case, states[0])[0]
    recurs = claim.get("recurs") or {}
    points = [(mpf(state["x"]), state["side"]) for state in states]
    flips = sum(p[1] != q[1] for p, q in pairwise(points))
    if "thinning" in recurs:
        again_and_again(found, goal, within, word)
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
            both = [
                digits.throw(thrown(case, before)[0].with_kappa(mpf(end)), mpf(before["x"]), before["side"])
                for end in ends
            ]
            parted = (both[0][0] - mpf(to["x"])) * (both[1][0] - mpf(to["x"])) < 0
            lo, hi = within[0].lo * (1 - 1e-13), within[0].hi * (1 + 1e-13)
            there = parted and {both[0][1], both[1][1]} == {to["side"]}
            if not (there and lo <= min(ends) <= max(ends) <= hi):
                found.fault(f"{word}: it does not close between the two kappas {ends}")
        elif not gap <= within[0].e * (1 + 1e-9):
            found.fault(
                f"{word}: the orbit neither leaves nor returns"
                f" ({len(states)} states, gap {mp.nstr(gap, 5)}, {recurs})"
            )
    if not violates(goal, kind, points, flips, facts):
        found.fault(f"{word}: the orbit does not violate it")


def component(
    found: Verdict, goal: dict[str, Any], kind: str, points: list[Any], within: list[Range], word: str
) -> None:
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


def again_and_again(found: Verdict, goal: dict[str, Any], within: list[Range], word: str) -> None:
    """Refuted by almost every orbit of some cells: of starts spread over the arm some must go on violating the goal."""
    rng = np.random.default_rng(found.case.seed)
    numbers = within[0].facts.floats()
    i = rng.integers(0, numbers[0].size, 500)
    x = numbers[0][i] + (numbers[6] - numbers[0][i]) * rng.random(500)
    for style in (0, 1, 4) if within[0].noisy else (-1,):
        orbits = Orbits(numbers, x, i)
        move(orbits, within[0], 2000, rng, style)
        orbits.look()
        move(orbits, within[0], 2000, rng, style)
        if not (wrong(goal, within[0].facts, orbits, 2000) & (orbits.code >= 0)).any():
            found.fault(
                f"{word} by almost every orbit of a component, but no orbit is seen to (noise {style})"
            )


def two_basins(found: Verdict, x: mpf, side: int, within: list[Range], word: str) -> None:
    """A start below the fixed point of the jog creeps to the joint; others must be seen to go elsewhere."""
    facts = within[0].facts
    numbers = facts.floats()
    creeping = Orbits(numbers, [float(x)], [side])
    creeping.fly(20_000)
    a, arm = numbers[0], numbers[6]
    nearer = creeping.x[0] - a[side] < 0.5 * (float(x) - a[side])
    if creeping.code[0] < 0 or creeping.i[0] != side or not nearer:
        found.fault(f"{word}: the start at {mp.nstr(x, 17)} on side {side} does not creep to the joint")
    i = np.repeat(np.arange(a.size), 200)
    others = Orbits(numbers, a[i] + (arm - a[i]) * np.tile((np.arange(200) + 0.5) / 200, a.size), i)
    others.fly(2000)
    if not ((others.code < 0) | (others.x - a[others.i] > 0.01 * (arm - a[others.i]))).any():
        found.fault(f"{word}: all starts creep to the joint")


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


def cycle(
    found: Verdict, claim: dict[str, Any], told: dict[str, Any], facts: model.Facts, word: str
) -> tuple[list[Any], int]:
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
            found.fault(
                f"{word}: the cycle from {mp.nstr(x, 20)} on side {told['side']} throws {codes},"
                f" not {told['itinerary']}"
            )
            return points, 1
        slope = (round_(x + step)[0] - at) / step
        gap = at - x
        x += gap / (1 - slope)
    if abs(gap) > mpf("1e-30") or not lo <= x <= hi:
        found.fault(
            f"{word}: no cycle in the interval {told['interval']}: {mp.nstr(x, 20)}, gap {mp.nstr(gap, 5)}"
        )
    bounds = sorted(map(number, told["multiplier"]))
    if not bounds[0] - mpf("1e-6") * abs(slope) <= slope <= bounds[1] + mpf("1e-6") * abs(slope):
        found.fault(f"{word}: multiplier {mp.nstr(slope, 17)} is not in {told['multiplier']}")
    almost = claim.get("starts") == "almost-every" and "thinning" not in claim["recurs"]
    if bool(told.get("attracts")) != (abs(slope) < 1) or almost > (abs(slope) < 1):
        found.fault(f"{word}: multiplier {mp.nstr(slope, 10)}, attracts: {told.get('attracts')}")
    return points, sum(codes)
