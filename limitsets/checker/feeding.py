"""The end of the arm, and feeding: on which side parts come to rest at X or beyond, and that they do.

docs/certificates.md, "Feeding", and number 17.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .balls import Array, UnprovedError, about, exact, float_above, float_below, prove, reason_of
from .cells import Crew, Task, check_structure, extents, grown, leading_into, tasks_of
from .file import Cells, by_side, decimal, hex_float, read_side, require, table, whole_number
from .near_hinge import (
    check_all_jog,
    check_null,
    check_thinning,
    check_thrown_out,
    near_angle,
    near_landing,
    not_arriving,
)
from .refutations import is_laid_down, periodic, read_orbits, read_passing, thrown_again
from .scene import Scene
from .starts import (
    MOST_COUNTED,
    Span,
    cells_of_ranges,
    led_to,
    length_within,
    ranges_in_words,
    read_laid,
    share_of_ranges,
)

# ----------------------------------------------------------------
# The end of the arm: what can be reached on the cells before it, and from which cells.
#
# docs/certificates.md, number 17.


FAR = 1e300  # beyond all arms


class ArmEnd(NamedTuple):
    """The cells, with no throws from beyond X; `before`: those with places x < X, `fed`: those with x >= X only.

    A cell without a rank whose target cells come to the last border of a side may leave there: towards the joint the
    part may also come to rest before the first cell.  `inward` says so by side, `leaving` of all.
    """

    x: Fraction
    c: Cells
    before: Array
    fed: Array
    inward: list[Array]
    leaving: Array


def arm_end(c: Cells, scene: Scene) -> ArmEnd:
    """Find the cells before X and beyond, and those that may leave."""
    assert scene.end is not None
    x, n = scene.end, len(c.edges)
    before = np.array([Fraction(lo) < x for lo in c.lower().tolist()])
    jog, flip = (np.where(before[:, None], array, -1) for array in (c.jog, c.flip))
    inward = [np.zeros(len(before), dtype=bool) for _ in range(n)]
    leaving = np.zeros(len(before), dtype=bool)
    for array, turned in ((jog, 0), (flip, 1)):
        begins, ends = at_borders(c, array)
        for i in range(n):
            inward[i] |= begins & ((c.side + turned) % n == i)
        leaving |= begins | ends
    return ArmEnd(x, replace(c, jog=jog, flip=flip), before, ~before, inward, leaving)


def at_borders(c: Cells, array: Array) -> tuple[Array, Array]:
    """Find the cells without a rank whose targets begin with the first cell of a side, or end with the last."""
    free = (c.rank < 0) & (array[:, 0] >= 0)
    return free & np.isin(array[:, 0], c.start[:-1]), free & np.isin(array[:, 1] + 1, c.start[1:])


def with_open_borders(c: Cells, task: Task) -> Task:
    """Let images that may leave the cells be anywhere beyond their borders."""
    table = task.rows.copy()
    for column, array in ((4, c.jog), (6, c.flip)):
        begins, ends = at_borders(c, array)
        table[begins[task.cells], column] = -FAR
        table[ends[task.cells], column + 1] = FAR
    return task._replace(rows=table)


def unsafe_starts(end: ArmEnd, scene: Scene, side: int) -> tuple[Array, list[bool]]:
    """Find the cells from which the first rest at X or beyond may be on another side; and so before the first cells.

    A part that may come to rest in an unsafe place is unsafe: that is a cell of another side that reaches beyond X, a
    cell from which one may be thrown into an unsafe place, or before the first cell of a side from where it may be.
    """
    c, count = end.c, -1
    bad = (c.side != side) & (c.upper() > float_below(exact(end.x)))
    ahead = [cells_ahead(end, scene, i) for i in range(len(c.edges))]
    gaps = [True] * len(ahead)
    while count != int(bad.sum()):
        count = int(bad.sum())
        gaps = [some is None or bool(bad[some].any()) for some in ahead]
        bad |= thrown_into(end, bad, gaps)
    return thrown_into(end, bad, gaps), gaps


def cells_ahead(end: ArmEnd, scene: Scene, side: int) -> Array | None:
    """Find the cells to which throws from before the first cell of a side may lead; None if that is not known.

    Such a throw is a jog, and lands before some place or leaves towards the joint.
    """
    s, c = scene.sides[side], end.c
    edge = float(c.edges[side][0])
    bound = near_angle(s, scene.k_lo, scene.k_hi, edge)
    if not bound < 1 or reason_of(check_all_jog, s, scene.k_lo.union(scene.k_hi), arb(edge), bound):
        return None
    far = near_landing(s, scene.k_lo, scene.k_hi, edge)
    ahead: Array = (c.side == side) & (c.lower() <= (float_above(far) if far.is_finite() else math.inf))
    return ahead


def thrown_into(end: ArmEnd, places: Array, gaps: list[bool]) -> Array:
    """Find the cells from which a throw may lead to the places, or before the first cell of the sides in `gaps`."""
    hit = leading_into(end.c, places)
    for some, gap in zip(end.inward, gaps, strict=True):
        hit |= some & gap
    return hit


def late_within(end: ArmEnd, throws: int) -> Array:
    """Find the cells from which parts are not proved to come to rest at X or beyond within so many throws."""
    c = end.c
    late: Array = not_arriving([c.jog, c.flip], ~end.leaving, end.fed, throws) | end.leaving
    return late


def cells_that_may_leave(end: ArmEnd) -> Array:
    """Find the cells from which a part may come to one that may leave, and these."""
    return grown(end.leaving, lambda known: leading_into(end.c, known))


def share_of(end: ArmEnd, scene: Scene, some: Array) -> float:
    """Bound from below the share of the starts x < X in some cells."""
    x, claimed, length = exact(end.x), 0.0, 0.0
    for i, s in enumerate(scene.sides):
        claimed += length_within(end.c, some, i, -math.inf, float_below(x))
        length += float_above(x) - float_below(s.a)
    return claimed / length * (1 - 2.0**-30)  # against the rounding of these sums


# ----------------------------------------------------------------
# Feeding: on which side parts come to rest at X or beyond, where the arm ends, and that they do.


PARTS = "safety wrong progress almost never_fed"  # of the claim: a file has some of them
FEEDS_KEYS = f"{PARTS} laid"  # and where parts are laid down: all that is said is then of these starts


def read_feeds(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read the section of feeds."""
    feeds: dict[str, Any] = {"side": read_side(section["side"], n_sides)}
    require(bool(set(PARTS.split()) & set(section)), "feeds: nothing is claimed")
    feeds["laid"] = read_laid(section["laid"], n_sides) if "laid" in section else None
    if "safety" in section:
        feeds["safety"] = section["safety"]
        require(feeds["safety"] in ("every", "cells"), "feeds.safety is none of the starts that are known")
    for name, every, count in (("progress", "every", "throws"), ("almost", "almost-every", "thinning")):
        if name in section:
            part = table(section[name], f"feeds.{name}", f"starts {count}")
            starts = part["starts"]
            if isinstance(starts, dict):
                since = by_side(table(starts, "feeds: starts", "from")["from"], "from", n_sides)
                starts = [hex_float(x, "from") for x in since]
            known = starts == every or (isinstance(starts, list) and feeds["laid"] is None)
            require(known, f"feeds.{name}: starts that are not known")
            what = f"feeds.{name}.{count} is not a whole number as it should be"
            number = whole_number(part[count], 0, MOST_COUNTED - 1, what)
            feeds[name] = (None if starts == every else starts, number)
    if "wrong" in section:
        orbit = table(section["wrong"], "feeds.wrong", "start throws")
        feeds["wrong"] = read_passing(orbit, "once", n_sides) | {"why": "once"}
    if "never_fed" in section:
        cycles = {"cycles": [section["never_fed"]], "complete": False}
        (feeds["never_fed"],) = read_orbits(cycles, n_sides)["orbits"]
    return feeds


def check_feeds(scene: Scene, c: Cells, box: int, feeds: dict[str, Any], crew: Crew) -> None:
    """Check all parts of the claim.  Shares and intervals of starts are kept for the report."""
    if scene.end is None:
        raise UnprovedError("the scene has no cavity")
    check_structure(c, scene)
    for i, edges in enumerate(c.edges):
        around = float(edges[0]) < scene.end < float(edges[-1])
        prove(around, f"side {i}: the cells do not reach from before the end of the arm to beyond")
    feeds["x"] = f"{decimal(scene.end)} {scene.unit}"
    feeds["begin"] = None
    if feeds["laid"] is not None:
        feeds["begin"] = cells_of_ranges(c, scene, feeds["laid"])
        on = all(Fraction(hi) <= scene.end for ranges in feeds["laid"] for _, hi in ranges)
        prove(on, "starts are claimed that lie beyond the end of the arm")
    feeds["shares"] = {}
    end, used = arm_end(c, scene), np.zeros(len(c.side), dtype=bool)
    for part, check in (("safety", check_safety), ("progress", check_progress), ("almost", check_almost)):
        if part in feeds:
            used |= check(end, scene, feeds)
    with about("an orbit"):
        check_shown(end, scene, feeds)
    # the throws from the cells on which something rests
    tasks = tasks_of(end.c, scene, box, np.flatnonzero(used), None)
    crew.run(c.name, (with_open_borders(end.c, task) for task in tasks))


def check_safety(end: ArmEnd, scene: Scene, feeds: dict[str, Any]) -> Array:
    """Check that from the starts named the first rest at X or beyond is on the wanted side; return the safe cells."""
    bad, gaps = unsafe_starts(end, scene, feeds["side"])
    safe, begin = end.before & ~bad, feeds["begin"]
    if feeds["safety"] == "every":
        what = f"a part may come to rest beyond the end of the arm on another side than {feeds['side']}"
        for i, gap in enumerate(gaps if begin is None else ()):
            prove(not gap, f"side {i}, before the first cell: {what}")
        named = end.before if begin is None else end.before & begin
        end.c.prove_all(safe | ~named, what)
        feeds["shares"]["safety"] = 1.0
        return safe
    feeds["shares"]["safety"] = share_of(end, scene, safe)
    if begin is not None:
        feeds["shares"]["safety"] = share_of_ranges(end.c, feeds["laid"], safe, math.inf)
    ahead = end.c.upper() <= float_below(exact(end.x))  # not the cell that X lies in
    feeds["safe"] = extents(end.c, safe & ahead, inward=True)
    return safe


def check_progress(end: ArmEnd, scene: Scene, feeds: dict[str, Any]) -> Array:
    """Check that every start that is named comes to rest at X or beyond within so many throws; return where from."""
    since, throws = feeds["progress"]
    late = late_within(end, throws)
    check_named(end, scene, since, late, f"{throws} throws are not proved to be enough", feeds["begin"])
    feeds["shares"]["progress"] = share_from(end, scene, since)
    return end.before & ~late


def check_almost(end: ArmEnd, scene: Scene, feeds: dict[str, Any]) -> Array:
    """Check that almost every start that is named comes to rest at X or beyond: the others thin out.

    Orbits from cells that cannot lead to one that may leave go on in such cells.  Those from which some number of
    throws is enough lead to cells of the same kind only; the starts that stay in the others for ever have length zero.
    """
    since, rounds = feeds["almost"]
    leaves = cells_that_may_leave(end)
    begin = feeds["begin"]
    check_named(end, scene, since, leaves, "a part may leave the arm", begin)
    stay = late_within(end, len(leaves)) & ~leaves
    if begin is not None:
        stay &= led_to(end.c, begin)
    elif since is None:  # before the first cells
        check_null(end.c, scene, np.zeros_like(leaves), True)
    check_thinning(end.c, scene, stay, rounds, np.zeros(len(leaves), dtype=np.int32))
    feeds["shares"]["almost"] = share_from(end, scene, since)
    return end.before & ~leaves


def check_named(
    end: ArmEnd, scene: Scene, since: list[float] | None, late: Array, what: str, begin: Array | None
) -> None:
    """Check that the starts that are named, beyond some x on each side or all, lie in no bad cell.

    Where parts are laid down these are the starts in the cells `begin`.
    """
    c = end.c
    if begin is not None:
        c.prove_all(~(begin & end.before & late), what)
        return
    for i, edges in enumerate(c.edges):
        needed = end.before & (c.side == i)
        if since is None:
            with about(f"side {i}, near the joint, x in (a, {float(edges[0])!r}]"):
                check_thrown_out(scene, i, float(edges[0]))
        else:
            prove(bool(since[i] >= edges[0]), f"side {i}: starts are claimed that lie before the cells")
            needed &= c.upper() > since[i]
        c.prove_all(~(needed & late), what)


def share_from(end: ArmEnd, scene: Scene, since: list[float] | None) -> float:
    """Bound from below the share of the starts x < X that lie beyond some x on each side, or of all."""
    if since is None:
        return 1.0
    some = np.concatenate([edges[:-1] >= x for edges, x in zip(end.c.edges, since, strict=True)])
    return share_of(end, scene, some)


def check_shown(end: ArmEnd, scene: Scene, feeds: dict[str, Any]) -> None:
    """Check the orbit that comes to rest on another side, and the one that never comes to X."""
    x, laid = exact(end.x), feeds["laid"]
    if "wrong" in feeds:
        *states, (side, lo, hi) = thrown_again(scene, feeds["wrong"])
        prove(is_laid_down(laid, states[:1]), "no part is laid down where it starts")
        earlier = "it may come to rest beyond the end of the arm earlier"
        prove(all(each[2] < x for each in states), earlier)
        beyond = side != feeds["side"] and bool(lo > x) and bool(hi <= scene.sides[side].arm)
        prove(beyond, "it is not proved to come to rest beyond the end of the arm on another side")
    if "never_fed" in feeds:
        states = periodic(scene, feeds["never_fed"])
        prove(is_laid_down(laid, states), "no part is laid down at a place of the periodic orbit")
        prove(all(each[2] < x for each in states), "the periodic orbit may come to the end of the arm")


def verdict_of_feeds(feeds: dict[str, Any], most_open: float) -> tuple[str, str]:
    """Say what became of a claim that is confirmed: "proved", "refuted" or "proved-on-cells", and what is open."""
    if "wrong" in feeds or ("never_fed" in feeds and "almost" not in feeds):
        return "refuted", ""
    shares, open_parts = feeds["shares"], []
    most_open = most_open if feeds["laid"] is None else 0.0
    progress = max(shares.get("progress", 0.0), shares.get("almost", 0.0))
    for name, share in (("safety", shares.get("safety", 0.0)), ("progress", progress)):
        if share < 1 - most_open:
            of = (
                f"proved for {100 * math.floor(share * 1e6) / 1e6:.4g} % of the starts"
                if share
                else "not claimed"
            )
            open_parts.append(f"{name} is {of}")
    return ("proved-on-cells", "; ".join(open_parts)) if open_parts else ("proved", "")


def feeds_statement(feeds: dict[str, Any], noisy: bool) -> str:
    """Put the claim in words, one line for each of its parts."""
    x = feeds.get("x", "the end of the arm")
    return "\n    ".join([f"feeds: the arm ends at x = {x}", *parts_in_words(feeds, x, noisy)])


def parts_in_words(feeds: dict[str, Any], x: str, noisy: bool) -> Iterator[str]:
    """Put each part in words."""
    side, there, laid = feeds["side"], f"comes to rest at x >= {x}", feeds["laid"]
    if "safety" in feeds:
        some = (
            named_in_words(None, x, laid)
            if feeds["safety"] == "every"
            else f"the starts {feeds.get('safe', '')}"
        )
        some += f", of those with {ranges_in_words(laid)}" if laid and feeds["safety"] == "cells" else ""
        yield f"safety: from {some}, the first rest at x >= {x}, if there is one, is on side {side}"
    if "wrong" in feeds:
        orbit = feeds["wrong"]
        number = f"{len(orbit['throws'])} throws" if len(orbit["throws"]) > 1 else "1 throw"
        start = f"x = {orbit['x']!r} on side {orbit['side']}"
        yield f"safety is refuted: the start {start} {there} after {number}, on another side than {side}"
    if "progress" in feeds:
        since, throws = feeds["progress"]
        near = " where x is in the cells; nearer to the joint x - a_i grows with every throw"
        within = f"within {throws} throws{near if since is None and not laid else ''}"
        yield f"progress: {named_in_words(since, x, laid)} {there}, {within}"
    if "almost" in feeds:
        others = ", others for other throws" if noisy else ""
        but = f", but for starts of total length zero{others},"
        yield f"progress: {named_in_words(feeds['almost'][0], x, laid)}{but} {there}"
    if "never_fed" in feeds:
        o = feeds["never_fed"]
        place = f"with a place x in [{o.lo!r}, {o.hi!r}] on side {o.side}"
        what = f"a periodic orbit, of {len(o.word)} throws, {place}, stays at x < {x}"
        yield f"progress from every start is refuted: {what}"
    yield "whether a part that comes to rest there clears the wall of the cavity is not claimed"


def named_in_words(since: list[float] | None, x: str, laid: list[list[Span]] | None) -> str:
    """Name the starts."""
    if laid is not None:
        return f"every start with {ranges_in_words(laid)}"
    if since is None:
        return f"every start a_i < x < {x} on every side i"
    return "every start with " + ", or ".join(f"{lo!r} < x < {x} on side {i}" for i, lo in enumerate(since))
