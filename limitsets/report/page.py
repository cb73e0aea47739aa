"""The page: an analysis in the words of someone who builds a feeder."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from limitsets.analysis import overlap
from limitsets.goals import AttractsAll, FlipOrder, OrientedBeyond, Reaches
from limitsets.report.tables import bands, intervals, number, percent, table
from limitsets.report.tables import count as count_of

if TYPE_CHECKING:
    from limitsets.analysis import Analysis
    from limitsets.scene import Scene

__all__ = ["page"]


def page(analysis: Analysis, figures: Mapping[str, str]) -> str:
    """Write the report.

    Parameters
    ----------
    analysis : Analysis
        From `limitsets.analyse`.
    figures : mapping of str to str
        File names of the pictures by kind: "limit-set", "map", "basins", "morse", "flight".

    Returns
    -------
    str
        Markdown.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.report import page
    >>> page(ls.analyse("paper-designed"), {}).splitlines()[0]
    '# paper-designed: where the throws lead'
    """
    parts = [
        f"# {analysis.scene.name}: where the throws lead",
        _summary(analysis),
        *(_attractor(analysis, k, figures) for k in range(len(analysis.attractors))),
        _goal(analysis),
        _starts(analysis, figures),
        _decisions(analysis, figures),
        _trust(analysis),
        _scene(analysis.scene, figures),
        _steps(analysis, figures),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _figure(figures: Mapping[str, str], kind: str, caption: str) -> str:
    return f"\n\n![{caption}]({figures[kind]})" if kind in figures else ""


def _order(order: tuple[int, ...]) -> str:
    return " → ".join(map(str, [*order, order[0]]))


def _summary(analysis: Analysis) -> str:
    basins, count = analysis.basins, len(analysis.attractors)
    if count == 0:
        leaving = ", ".join(f"{percent(share)} {name}" for name, share in basins.exits.items() if share)
        return f"Thrown again and again, **no start was found to stay on the arm** ({leaving or 'undecided'})."
    lines = [
        f"Thrown again and again, the part ends up in **{'one limit set' if count == 1 else f'{count} limit sets'}**, "
        f"reached from {' and '.join(percent(share) for share in basins.attractors)} of all starts."
    ]
    orders = {attractor.flip_order for attractor in analysis.attractors}
    if len(orders) == 1 and (order := orders.pop()) is not None:
        lines.append(
            f"Its sides come up in the order {_order(order)}."
            if len(order) > 1
            else f"It stays on side {order[0]}."
        )
    if analysis.goal is not None:
        verdict = {True: "holds", False: "does not hold", None: "was not decided"}[analysis.goal.holds]
        lines.append(f"The goal **{verdict}** ({analysis.goal.how}, not proved): see below.")
    broken = overlap(analysis.other_vertex_first, _everything(analysis))
    if broken:
        lines.append("**In part of the limit set another vertex lands first: the model does not describe those throws.**")
    return " ".join(lines)


def _everything(analysis: Analysis) -> dict[int, list[tuple[float, float]]]:
    union: dict[int, list[tuple[float, float]]] = {}
    for extents in analysis.extents:
        for side, parts in extents.items():
            union.setdefault(side, []).extend(parts)
    return union


def _attractor(analysis: Analysis, k: int, figures: Mapping[str, str]) -> str:
    found, extents, unit = analysis.attractors[k], analysis.extents[k], analysis.scene.unit
    name = "The limit set" if len(analysis.attractors) == 1 else f"Limit set {k}"
    rows = [
        [
            side,
            intervals(extents[side]) if side in extents else "never",
            "-" if side not in found.jogs_per_visit else count_of(*found.jogs_per_visit[side]),
        ]
        for side in range(len(analysis.scene.sides))
    ]
    lines = [
        f"## {name}",
        f"Where the centre of mass comes to rest, as distance from the joint [{unit}], and how many jogs in a row were "
        f"counted on one visit to the side ({found.throws} throws):",
        table(["on side", f"x [{unit}]", "jogs per visit"], rows),
        "What lies where along the arm:",
        table(
            [f"x [{unit}]", "the part lies on side"],
            [[f"{lo:.3f} to {hi:.3f}", " or ".join(map(str, sides))] for lo, hi, sides in bands(extents)],
        ),
        _numbers(analysis, k),
    ]
    text = "\n\n".join(lines)
    return text + (
        _figure(figures, "limit-set", "The limit set per side, with throws of one orbit as arrows") if k == 0 else ""
    )


def _numbers(analysis: Analysis, k: int) -> str:
    found, limit = analysis.attractors[k], analysis.limit_sets[k]
    source = (
        "The ends were computed as images of critical points, to about 1e-12."
        if analysis.extents_from[k] == "end points"
        else f"The ends are borders of cells, good to about a cell: {limit.advice}."
    )
    flips = f"{found.flips_per_throw:.4f} flips per throw"
    if found.lyapunov is None:
        return f"{source} {flips}."
    spread = (
        "two starts close together drift apart: the sequence of jogs never settles into a cycle"
        if found.lyapunov > 0
        else "starts close together come closer: the throws settle"
    )
    return f"{source} {flips}; Lyapunov exponent {found.lyapunov:.4f} per throw ({spread})."


def _goal(analysis: Analysis) -> str:
    asked, unit = analysis.goal, analysis.scene.unit
    if asked is None:
        return ""
    goal = asked.goal
    where = " (asked of every throw from every start)" if goal.from_anywhere else ""
    if isinstance(goal, OrientedBeyond):
        question = f"every part at rest beyond x = {goal.x:g} {unit} lies on side {goal.side}"
    elif isinstance(goal, Reaches):
        question = f"{'every' if goal.every_orbit else 'almost every'} orbit reaches x = {goal.x:g} {unit} on side {goal.side}"
    elif isinstance(goal, AttractsAll):
        question = "one limit set takes every start"
    elif isinstance(goal, FlipOrder):
        question = f"the sides follow each other as {_order(goal.order)}"
    else:
        question = "no throw carries the part off the arm or into the joint"
    verdict = {True: "It holds", False: "It does not hold", None: "This analysis cannot tell"}[asked.holds]
    lines = ["## The goal", f"Asked: {question}{where}. **{verdict}** ({asked.how}: no proof)."]
    if isinstance(goal, OrientedBeyond) and asked.threshold is not None:
        lines.append(f"The sentence is true from x = {asked.threshold:.3f} {unit} on.")
        reach = max((hi for parts in _everything(analysis).values() for _, hi in parts), default=-math.inf)
        if reach <= goal.x:
            lines.append(f"But no part gets there: the limit set ends at x = {reach:.3f} {unit}.")
    if isinstance(goal, Reaches) and asked.threshold is not None:
        lines.append(f"The farthest x reached on side {goal.side} is {asked.threshold:.3f} {unit}.")
    return "\n\n".join([lines[0], " ".join(lines[1:])])


def _starts(analysis: Analysis, figures: Mapping[str, str]) -> str:
    basins = analysis.basins
    rows = [[f"limit set {k}", percent(share)] for k, share in enumerate(basins.attractors)]
    rows += [[f"leave: {name}", percent(share)] for name, share in basins.exits.items()]
    rows.append(["undecided: cells whose paths end in different places", percent(basins.undecided_between)])
    return (
        "## From which starts\n\nShare of the starts (by length, over all sides, up to the arm's end):\n\n"
        + table(["where they end", "share"], rows)
        + _figure(figures, "basins", "Basins per side")
    )


def _decisions(analysis: Analysis, figures: Mapping[str, str]) -> str:
    unit = analysis.scene.unit
    rows = [
        [side, f"{point.x:.6f}", point.kind.replace("->", " → ")]
        for side, points in sorted(analysis.critical_points.items())
        for point in points
    ]
    text = f"## Where a throw changes what it does\n\nAt a critical point a part stops jogging and begins to flip, or the reverse [{unit}]:\n\n"
    return (
        text
        + (table(["side", f"x [{unit}]", "change"], rows) if rows else "There is none on the arm.")
        + _figure(figures, "map", "x after a throw against x before it, per side")
        + _figure(figures, "flight", "One throw of the orbit, in the air and to rest")
    )


def _trust(analysis: Analysis) -> str:
    unit, cells = analysis.scene.unit, [int(n) for n in analysis.grid.shape[:, 0]]
    inside = min((attractor.in_cells for attractor in analysis.attractors), default=1.0)
    lines = [
        "## How far to trust this",
        "**Sampled, not proved.** "
        f"The arm was cut into {cells[0]} cells per side, and the image of each was found from its ends. "
        f"{percent(inside)} of the states of a long orbit lay in the cells of its limit set. "
        f"{percent(analysis.second_pass)} of the throws needed the slow, sure search for the impact.",
    ]
    if analysis.spurious:
        lines.append(
            f"**Cells too coarse:** {len(analysis.spurious)} recurrent sets vanish when cells are cut finer. Ask for more cells."
        )
    parts = [f"side {side}: {intervals(found)} {unit}" for side, found in analysis.other_vertex_first.items() if found]
    if parts:
        broken = overlap(analysis.other_vertex_first, _everything(analysis))
        where = (
            "This touches the limit set: " + "; ".join(f"side {s}: {intervals(p)} {unit}" for s, p in broken.items())
            if broken
            else "No throw from the limit set is concerned"
        )
        lines.append(
            f"**Another vertex lands first** on throws from {'; '.join(parts)}. There the model's formulas speak of a landing "
            f"that does not take place. {where}."
        )
    lines.append(
        "**Assumed:** the throw is impulsive and does not tip the part; the left bottom vertex lands first, sticks without "
        "slipping or bouncing, and acts as a hinge until a side lies flat; the part then stays where it is until the next throw."
    )
    return "\n\n".join(lines)


def _scene(scene: Scene, figures: Mapping[str, str]) -> str:
    unit, sides = scene.unit, scene.sides
    throw = [f"kappa (gravity over the squared angular speed) {scene.kappa:.7g} {unit}"]
    if scene.gravity is not None:
        speed = math.degrees(math.sqrt(scene.gravity / scene.kappa))
        throw.append(f"that is {speed:.2f} deg/s with gravity {scene.gravity:.6g} {unit}/s^2")
    height = f"{abs(scene.surface_height):g} {unit} {'below' if scene.surface_height < 0 else 'above'} the joint"
    rows = [
        [side, number(float(sides.length[side])), number(float(sides.a[side])), number(float(sides.d[side]))]
        for side in range(len(sides))
    ]
    return "\n\n".join(
        [
            "## The scene",
            f"Arm: surface {height if scene.surface_height else 'at the joint'}, parts can rest up to x = {scene.arm_length:g} "
            f"{unit}. Throw: {', '.join(throw)}. Flight: {scene.flight}; flip criterion: {scene.flip}. "
            f"Radius of gyration {scene.radius_of_gyration:.6g} {unit}.",
            table(
                ["side", f"length [{unit}]", f"centre of mass from the left end [{unit}]", f"centre of mass above it [{unit}]"],
                rows,
            ),
        ]
    )


def _steps(analysis: Analysis, figures: Mapping[str, str]) -> str:
    sets = analysis.morse.number_of_nodes()
    text = f"## How it was computed\n\n{sets} recurrent set{'' if sets == 1 else 's'} of cells in the Morse graph."
    times = table(["step", "seconds"], [[step, f"{seconds:.3f}"] for step, seconds in analysis.timings.items()])
    return text + _figure(figures, "morse", "Morse graph: recurrent sets and their order") + "\n\n" + times
