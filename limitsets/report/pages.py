"""The page: an analysis in the words of someone who builds a feeder."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from limitsets.analysis import overlap
from limitsets.goals import order_of
from limitsets.report.background import everything, figure_line, scene_of, steps, trust
from limitsets.report.questions import question_of, verdict_of, void_of
from limitsets.report.tables import bands, intervals, percent, table
from limitsets.report.tables import count as count_of

if TYPE_CHECKING:
    from limitsets.analysis import Analysis

__all__ = ["page"]

OUTSIDE = "a throw after which the part has not landed within a full turn, or a start at x <= a"


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
        trust(analysis),
        scene_of(analysis.scene),
        steps(analysis, figures),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _summary(analysis: Analysis) -> str:
    basins, count = analysis.basins, len(analysis.attractors)
    if count == 0:
        leaving = ", ".join(f"{percent(share)} {name}" for name, share in basins.exits.items() if share)
        if basins.undecided_between:
            leaving = ", ".join(filter(None, [f"{percent(basins.undecided_between)} undecided", leaving]))
            return (
                f"Thrown again and again, **no limit set was found**, and not all starts leave ({leaving})."
            )
        return f"Thrown again and again, **no start was found to stay on the arm** ({leaving})."
    where = "one limit set" if count == 1 else f"{count} limit sets"
    shares = " and ".join(percent(share) for share in basins.attractors)
    lines = [f"Thrown again and again, the part ends up in **{where}**, reached from {shares} of all starts."]
    orders = {attractor.flip_order for attractor in analysis.attractors}
    if len(orders) == 1 and (order := orders.pop()) is not None:
        lines.append(
            f"Its sides come up in the order {order_of(order)}."
            if len(order) > 1
            else f"It stays on side {order[0]}."
        )
    if analysis.goal is not None:
        lines.append(
            f"The goal **{verdict_of(analysis.goal)}** ({analysis.goal.how}, not proved): see below."
        )
    broken = overlap(analysis.other_vertex_first, everything(analysis))
    if broken:
        lines.append(
            "**In part of the limit set another vertex lands first: the model does not describe those throws.**"
        )
    return " ".join(lines)


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
        (
            f"Where the centre of mass comes to rest, as distance from the joint [{unit}], and how many jogs in a row "
            f"a visit to the side was seen to have ({found.throws} throws):"
        ),
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
        figure_line(figures, "limit-set", "The limit set per side, with throws of one orbit as arrows")
        if k == 0
        else ""
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
    verdict = "This analysis cannot tell" if asked.holds is None else f"It {verdict_of(asked)}"
    lines = ["## The goal", f"Asked: {question_of(goal, unit)}. **{verdict}** ({asked.how}: no proof)."]
    if asked.threshold is not None and (explained := goal.explained(asked.threshold, unit)):
        lines.append(explained)
    void = void_of(asked, unit)
    if void:
        lines.append(f"But {void}.")
    return "\n\n".join([lines[0], " ".join(lines[1:])])


def _starts(analysis: Analysis, figures: Mapping[str, str]) -> str:
    basins = analysis.basins
    rows = [[f"limit set {k}", percent(share)] for k, share in enumerate(basins.attractors)]
    rows += [[f"leave: {name}", percent(share)] for name, share in basins.exits.items()]
    rows.append(
        ["undecided: paths end in different places, or may stay elsewhere", percent(basins.undecided_between)]
    )
    beyond = basins.exits.get("outside-model", 0.0) > 0.0
    return (
        "## From which starts\n\nShare of the starts (by length, over all sides, up to the arm's end):\n\n"
        + table(["where they end", "share"], rows)
        + f"\n\nOutside the model: {OUTSIDE}." * beyond
        + figure_line(figures, "basins", "Basins per side")
    )


def _decisions(analysis: Analysis, figures: Mapping[str, str]) -> str:
    unit = analysis.scene.unit
    rows = [
        [side, f"{point.x:.6f}", point.kind.replace("->", " → ")]
        for side, points in sorted(analysis.critical_points.items())
        for point in points
    ]
    return (
        "## Where a throw changes what it does\n\n"
        f"At a critical point a part stops jogging and begins to flip, or the reverse [{unit}]:\n\n"
        + (table(["side", f"x [{unit}]", "change"], rows) if rows else "There is none on the arm.")
        + figure_line(figures, "map", "x after a throw against x before it, per side")
        + figure_line(figures, "flight", "One throw of the orbit, in the air and to rest")
    )
