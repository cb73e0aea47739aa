"""Figure of a policy: for every state the places at which the part may lie, the throw, and the next state by answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from limitsets.base.arguments import arguments_checked
from limitsets.base.errors import AnswerError
from limitsets.face.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.proofs.policies import Synthesis


# Largest number of rows with names; largest height of a row, and of all rows [inches].
MOST, ROW, TALL = 60, 0.26, 16.0
COLOURS = (style.JOG, style.FLIP, style.ROLL, style.INK)
HATCHES = ("", "////", "....", "xxxx")


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
            _row(axes, k, belief.get(side, []), int(table.throw[k]))
        if side == wanted:
            axes.axvspan(x, max(high, x), color=style.GOAL, alpha=0.12, lw=0)
        if found.mode == "catch" or side == wanted:
            axes.axvline(x, **style.GOAL_LINE)
        place = getattr(found.sensor, "x", None)
        if place is not None:
            axes.axvline(place, color=style.INK, lw=1.0, ls=(0, (5, 2)))
        axes.set_xlim(low - 0.03 * (high - low), high + 0.03 * (high - low))
        axes.set_title(f"side {side}", loc="left", fontsize=style.TEXT)
        axes.set_xlabel(f"x [{unit}]", fontsize=style.SMALL)
        axes.tick_params(labelsize=style.SMALL)
        style.open_frame(axes)
    if table.states <= MOST:
        panels[0].set_yticks(range(table.states), [_label(table, k) for k in range(table.states)])
    else:
        panels[0].set_ylabel("state", fontsize=style.SMALL)
    panels[0].set_ylim(table.states - 0.4, -0.6)
    style.title(figure, f"{found.scene.name}: {found.question} {found.found.throws} throws are enough")
    style.legend(figure, _keys(found), 4)
    return figure


def _row(axes: Axes, k: int, parts: Any, throw: int) -> None:
    axes.axhline(k, color=style.FAINT, lw=0.4, zorder=0)
    for lo, hi in parts:
        if throw < 0:
            look = {"facecolor": "white", "edgecolor": style.GOAL, "lw": 1.4}
        else:
            look = {
                "facecolor": COLOURS[throw % len(COLOURS)],
                "edgecolor": "white",
                "hatch": HATCHES[throw % len(HATCHES)],
                "lw": 0.0,
            }
        style.bar(axes, lo, hi, float(k), 0.28, **look)


def _label(table: Any, k: int) -> str:
    """Name a row: its state, its throw, and the next states by the answer."""
    throw = "stop" if table.throw[k] < 0 else table.throws[int(table.throw[k])]
    after = ", ".join(
        f"{word} {at}".strip()
        for word, at in zip(table.answers, table.after[k].tolist(), strict=True)
        if at >= 0
    )
    return f"{k}: {throw}" + (f" → {after}" if after else "")


def _keys(synthesis: Synthesis) -> list[Any]:
    from matplotlib.patches import Patch

    keys: list[Any] = [
        Patch(facecolor=COLOURS[k % 4], edgecolor="white", hatch=HATCHES[k % 4], label=f"throw: {name}")
        for k, name in enumerate(synthesis.throws)
    ]
    if synthesis.mode == "stop":
        keys.append(Patch(facecolor="white", edgecolor=style.GOAL, lw=1.4, label="stop: the part is there"))
    words = "side {} from here on" if synthesis.mode == "stop" else "caught from here on: right on side {}"
    keys.append(style.key(f"goal: {words.format(synthesis.goal[1])}", **style.GOAL_LINE))
    if hasattr(synthesis.sensor, "x"):
        keys.append(style.key("sensor", color=style.INK, lw=1.0, ls=(0, (5, 2))))
    return keys
