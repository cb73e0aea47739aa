"""The second half of the page: how far to trust the answers, the scene they are about, how they were computed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from limitsets.analysis import overlap
from limitsets.report.tables import intervals, percent, table

if TYPE_CHECKING:
    from limitsets.analysis import Accuracy, Analysis
    from limitsets.scene import Scene

__all__ = ["everything", "figure_line", "scene_of", "steps", "trust"]


def figure_line(figures: Mapping[str, str], kind: str, caption: str) -> str:
    """Show a figure if it is there."""
    return f"\n\n![{caption}]({figures[kind]})" if kind in figures else ""


def everything(analysis: Analysis) -> dict[int, list[tuple[float, float]]]:
    """Put the intervals of all limit sets together, per side."""
    union: dict[int, list[tuple[float, float]]] = {}
    for extents in analysis.extents:
        for side, parts in extents.items():
            union.setdefault(side, []).extend(parts)
    return union


def trust(analysis: Analysis) -> str:
    """Say what is sampled, what is flagged, what is assumed."""
    unit, cells = analysis.scene.unit, [int(n) for n in analysis.grid.shape[:, 0]]
    inside = [attractor.in_cells for attractor in analysis.attractors]
    lines = [
        "## How far to trust this",
        " ".join(
            (
                "**Sampled, not proved.**",
                f"The arm was cut into {cells[0]} cells per side, and the image of each was found from its ends.",
                *(
                    f"{percent(min(inside))} of the states of a long orbit lay in the cells of its limit set."
                    for _ in inside[:1]
                ),
                f"{percent(analysis.second_pass)} of the throws needed the slow, sure search for the impact.",
            )
        ),
    ]
    if analysis.starts is not None and not analysis.starts.missed:
        lines.append(
            f"{analysis.starts.count} random starts, thrown up to {analysis.starts.throws} times, ended where their "
            "cells say, or in a limit set shown here."
        )
    lines += [f"**Not settled:** {text}." for text in analysis.advice]
    if analysis.accuracy is not None:
        lines.append(_accuracy(analysis.accuracy))
    if analysis.spurious:
        lines.append(
            f"**Cells too coarse:** {len(analysis.spurious)} recurrent sets vanish when cells are cut finer. "
            "Ask for more cells."
        )
    for k, attractor in enumerate(analysis.attractors):
        if attractor.stopped is not None:
            why = (
                "came to a throw that moves the part by less than the spacing of numbers; in the model it moves on, "
                "and what is shown may be no limit set"
                if attractor.stopped == "stalled"
                else f"left the arm ({attractor.stopped})"
            )
            lines.append(f"**Stopped:** after {attractor.throws} throws the orbit of limit set {k} {why}.")
    parts = [
        f"side {side}: {intervals(found)} {unit}"
        for side, found in analysis.other_vertex_first.items()
        if found
    ]
    if parts:
        broken = overlap(analysis.other_vertex_first, everything(analysis))
        where = (
            "This touches the limit set: "
            + "; ".join(f"side {s}: {intervals(p)} {unit}" for s, p in broken.items())
            if broken
            else "No throw from the limit set is concerned"
        )
        lines.append(
            f"**Another vertex lands first** on throws from {'; '.join(parts)}. "
            f"There the model's formulas speak of a landing that does not take place. {where}."
        )
    return "\n\n".join([*lines, *_effects(analysis), _assumed(analysis.scene)])


def _effects(analysis: Analysis) -> list[str]:
    """Say what is simulated beyond the minimal model, and who asked for it."""
    choice, lines = analysis.choice, []
    names = analysis.scene.effects.on()
    if names:
        asked = f" The audit of the limit set switched on: {', '.join(choice.switched_on)}." * bool(
            choice.switched_on
        )
        lines.append(f"**Simulated** beyond the minimal model: {', '.join(names)}.{asked}")
    if analysis.scene.effects.spread:
        lines.append(
            "**Only orbits scatter.** Cells, and with them the limit set, basins and critical points, are those of "
            "throws without scatter; the numbers of jogs and flips are from an orbit with it, which may leave them."
        )
    if choice.left_out:
        reasons = "; ".join(f"{effect}: {reason}" for effect, reason in choice.left_out.items())
        lines.append(f"**Not simulated**, though it may be called for: {reasons}.")
    return lines


def _assumed(scene: Scene) -> str:
    """Say what is still assumed with the effects that are on."""
    from limitsets.thrower.effects import EFFECTS

    kept = [each.lifts for name, each in EFFECTS.items() if name not in scene.effects.words]
    kept.insert(
        0 if scene.effects.drive else 1, "it does not tip the part"
    )  # of the throw; no effect lifts this
    words = "; ".join(kept)
    return f"**Assumed:** {words}. `limitsets audit` says which of this the scene breaks."


HOW = {
    "proved": "every end lies between two proved numbers, and this is the farther of them",
    "rounding": "an estimate, from the slopes and the rounding of each step",
    "orbit": "how far a point of the cells can be from the throws of a long orbit",
}


def _accuracy(found: Accuracy) -> str:
    """Say what error of the ends was asked for, how it was gone about, and what was reached."""
    unit = found.plan.unit
    lines = [f"**Accuracy of the ends:** {found.plan}. It took {found.seconds:.2g} s."]
    if found.reached is not None:
        lines.append(f"Error reached: {found.reached:.2g} {unit} ({HOW[found.how]}).")
    if not found.met:
        lines.append(f"**The error asked for was not met**: {found.advice}.")
    return " ".join(lines)


def scene_of(scene: Scene) -> str:
    """Give the scene in one paragraph and a table."""
    unit, sides = scene.unit, scene.sides
    throw = [f"kappa (gravity over the squared angular speed) {scene.kappa:.7g} {unit}"]
    if scene.gravity is not None:
        speed = math.degrees(math.sqrt(scene.gravity / scene.kappa))
        throw.append(f"that is {speed:.2f} deg/s with gravity {scene.gravity:.6g} {unit}/s^2")
    height = (
        f"{abs(scene.surface_height):g} {unit} {'below' if scene.surface_height < 0 else 'above'} the joint"
    )
    rows = [
        [side, *(f"{float(each[side]):.5g}" for each in (sides.length, sides.a, sides.d))]
        for side in range(len(sides))
    ]
    return "\n\n".join(
        [
            "## The scene",
            " ".join(
                (
                    f"Arm: surface {height}, parts can rest up to x = {scene.arm_length:g} {unit}.",
                    f"Throw: {', '.join(throw)}.",
                    f"Flight: {scene.flight}; flip criterion: {scene.flip}.",
                    f"Radius of gyration {scene.radius_of_gyration:.6g} {unit}.",
                )
            ),
            table(
                [
                    "side",
                    f"length [{unit}]",
                    f"centre of mass from the left end [{unit}]",
                    f"centre of mass above it [{unit}]",
                ],
                rows,
            ),
        ]
    )


def steps(analysis: Analysis, figures: Mapping[str, str]) -> str:
    """Give the Morse graph and how long each step took."""
    sets = analysis.morse.number_of_nodes()
    text = f"## How it was computed\n\n{sets} recurrent set{'' if sets == 1 else 's'} of cells in the Morse graph."
    times = table(
        ["step", "seconds"], [[step, f"{seconds:.3f}"] for step, seconds in analysis.timings.items()]
    )
    return (
        text + figure_line(figures, "morse", "Morse graph: recurrent sets and their order") + "\n\n" + times
    )
