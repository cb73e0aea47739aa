"""Figure of a policy: for every state the places at which the part may lie, the throw, and the next state by answer."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from limitsets.base import AnswerError, arguments_checked
from limitsets.face.plot import style
from limitsets.feeder.scene import BeyondSensor
from limitsets.proofs.policies import Policy, Synthesis

# Largest number of rows with names; largest height of a row, and of all rows [inches].
MOST, ROW, TALL = 60, 0.26, 16.0
COLOURS = (style.JOG, style.FLIP, style.ROLL, style.INK)
HATCHES = ("", "////", "....", "xxxx")
STOP: dict[str, Any] = {"facecolor": "white", "edgecolor": style.GOAL, "lw": 1.4}
SENSOR: dict[str, Any] = {"color": style.INK, "lw": 1.0, "ls": (0, (5, 2))}


@arguments_checked
def policy(found: Synthesis) -> Figure:
    """Draw a policy, one row for each state and one column for each side; up to 60 states are named.

    Parameters
    ----------
    found : Synthesis
        From `limitsets.feedback`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    AnswerError
        Where there is no policy.
    """
    table = found.found.policy
    if table is None:
        raise AnswerError("what to draw", found.found.verdict, "a policy", "more throws may do it")
    sides = found.grid.sides
    figure, panels = style.canvas(
        3.2 * sides + 2.4, min(ROW * table.states, TALL) + 1.9, 1, sides, sharey=True
    )
    beliefs, unit = found.beliefs(), found.scene.unit
    spans = [pair for belief in beliefs for parts in belief.values() for pair in parts]
    low, high = min(lo for lo, _ in spans), max(min(hi, found.scene.arm_length) for _, hi in spans)
    x, wanted = found.goal
    for side, axes in enumerate(panels):
        for k, belief in enumerate(beliefs):
            look = STOP if table.throw[k] < 0 else _look(int(table.throw[k])) | {"lw": 0.0}
            axes.axhline(k, color=style.FAINT, lw=0.4, zorder=0)
            style.bars(axes, belief.get(side, []), float(k), 0.28, **look)
        if side == wanted:
            axes.axvspan(x, max(high, x), color=style.GOAL, alpha=0.12, lw=0)
        if found.mode == "catch" or side == wanted:
            axes.axvline(x, **style.GOAL_LINE)
        if isinstance(found.sensor, BeyondSensor):
            axes.axvline(found.sensor.x, **SENSOR)
        style.panel(
            axes,
            f"side {side}",
            small_ticks=True,
            xlim=style.widened(low, high, 0.03),
            xlabel=f"x [{unit}]",
            ylabel="" if side or table.states <= MOST else "state",
        )
    if table.states <= MOST:
        panels[0].set_yticks(range(table.states), [_label(table, k) for k in range(table.states)])
    panels[0].set_ylim(table.states - 0.4, -0.6)
    words = f"{found.scene.name}: {found.question} {found.found.throws} throws are enough"
    return style.finished(figure, words, _keys(found), 4)


def _look(throw: int) -> dict[str, Any]:
    """Give the look of a throw by its number."""
    return {
        "facecolor": COLOURS[throw % len(COLOURS)],
        "edgecolor": "white",
        "hatch": HATCHES[throw % len(HATCHES)],
    }


def _label(table: Policy, k: int) -> str:
    """Name a row: its state, its throw, and the next states by the answer."""
    throw = "stop" if table.throw[k] < 0 else table.throws[int(table.throw[k])]
    after = ", ".join(
        f"{word} {at}".strip()
        for word, at in zip(table.answers, table.after[k].tolist(), strict=True)
        if at >= 0
    )
    return f"{k}: {throw}" + (f" → {after}" if after else "")


def _keys(synthesis: Synthesis) -> list[Any]:
    stops = synthesis.mode == "stop"
    words = "side {} from here on" if stops else "caught from here on: right on side {}"
    return [
        *(Patch(label=f"throw: {name}", **_look(k)) for k, name in enumerate(synthesis.throws)),
        Patch(label="stop: the part is there", **STOP) if stops else None,
        style.key(f"goal: {words.format(synthesis.goal[1])}", **style.GOAL_LINE),
        style.key("sensor", **SENSOR) if isinstance(synthesis.sensor, BeyondSensor) else None,
    ]
