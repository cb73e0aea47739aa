"""The map's effects against the physics engine, from random starts: a table, and a figure.

Run it as ``python studies/02_physics_engine/effects.py [--seed 0] [--throws 2000] [--out FOLDER]``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import limitsets as ls
from limitsets.face.plot import style
from limitsets.systems.maps import OUTSIDE_MODEL, images

HERE = Path(__file__).resolve().parent
THROWS = 2000
STEPS = (4e-3, 2e-3, 1e-3, 5e-4)
STROKE = 0.2  # rad
# Energy, as a share of what lifts the part by its size, up to which the engine's contact keeps its own law.
KEEPS = 1e-3
CONTACT = {"landing": True, "roll": True, "slip": True, "pivot": True}


@dataclass(frozen=True)
class Case:
    """Effects of a scene, and how the engine is to make the same throw."""

    scene: str
    effects: dict[str, Any]
    world: dict[str, Any] = field(default_factory=dict)
    how: dict[str, Any] = field(default_factory=dict)
    step: float = 1e-3
    share: float = 1.0  # of the throws

    def load(self) -> Any:
        """Return the scene with these effects."""
        words = ls.load(self.scene).as_dict()
        words.pop("goal", None)
        words["effects"], words["world"] = self.effects, self.world
        return ls.load(words)


def unilateral(friction: float) -> Case:
    """Return plastic contact with friction, no hinge anywhere."""
    how = {"contact": "unilateral", "friction": friction, "restitution": 0.0}
    return Case("paper-designed", CONTACT, {"friction": friction}, how, step=2e-3)


BOUNCES = {"landing": True, "roll": True, "bounce": True}
FACTS = {"restitution": 0.3, "bounce_threshold": "0.05 in"}
CASES = {
    "landing": Case("paper-designed", {"landing": True}),
    "landing, roll": Case("paper-initial", {"landing": True, "roll": True}, {}, {"rolls": True}),
    "landing, roll, bounce": Case(
        "paper-designed", BOUNCES, FACTS, {"rolls": True, "restitution": 0.3, "threshold": 0.05}
    ),
    "drive, landing": Case(
        "paper-designed",
        {"drive": True, "landing": True},
        {"stroke": f"{math.degrees(STROKE)!r} deg", "friction": 1.0},
        {"stroke": STROKE, "friction": 1.0},
    ),
    "contact, friction 0.5": unilateral(0.5),
    "contact, friction 1": unilateral(1.0),
    "contact, friction 5": unilateral(5.0),
    "contact, friction 0.5, bounce": Case(
        "paper-designed",
        {**CONTACT, "bounce": True},
        {**FACTS, "friction": 0.5},
        {"contact": "unilateral", "friction": 0.5, "restitution": 0.3},
        step=2e-3,
        share=0.1,
    ),
}
LOOK = {
    "landing": (style.JOG, "-"),
    "landing, roll": (style.ROLL, (0, (4.5, 1.8))),
    "landing, roll, bounce": (style.GOAL, (0, (4.5, 1.5, 1.0, 1.5))),
    "drive, landing": (style.FLIP, "-"),
    "contact, friction 0.5": (style.INK, "-"),
    "contact, friction 1": (style.INK, "--"),
    "contact, friction 5": (style.INK, ":"),
}
HEAD = (
    "| effects | throws | same law | of these same side | error of x' [in]: median | 95 % | worst "
    "| aside: map does not say | slides back | rocks | solver | of these same side | median [in] | worst |"
)
ERRORS = ("median", "95 %", "worst")
WHY = ("outside", "slides back", "rocks", "solver")


def random_throws(case: Case, seed: int, throws: int) -> Any:
    """Compare throws from starts drawn anywhere on the arm, on any side."""
    scene, random = case.load(), np.random.default_rng(seed)
    count = max(int(throws * case.share), 1)
    side = random.integers(len(scene.sides), size=count)
    x = random.uniform(scene.sides.a[side], scene.arm_length)
    return ls.engine.compare(scene, x, side, step=case.step, **case.how)


def reasons(seen: Any) -> dict[str, Any]:
    """Return, by name, in which throws map and engine do not follow the same law; a throw has the first that fits."""
    found, left = {}, np.ones(seen.x.size, dtype=bool)
    marks = (seen.code_map == OUTSIDE_MODEL, seen.reverses, seen.rocks, seen.residual > KEEPS)
    for name, mark in zip(WHY, marks, strict=True):
        found[name] = left & mark
        left = left & ~mark
    found["same law"] = left
    return found


def nearest_start(scene: Any, x: float, side: int, wanted: int) -> float:
    """How far a start has to be moved before the map gives the wanted side too; inf beyond 1 length unit."""
    moves = np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 400)])
    for sign in (1.0, -1.0):
        found = images(scene.map, x + sign * moves, side)
        good = np.flatnonzero((found.side == wanted) & (found.code != OUTSIDE_MODEL))
        if sign > 0:
            best = moves[good[0]] if good.size else np.inf
        else:
            best = min(best, moves[good[0]] if good.size else np.inf)
    return float(best)


def summary(size: Any) -> dict[str, float | None]:
    """Return the median, the 95 % quantile and the worst of some errors; None where there are no errors."""
    if not size.size:
        return dict.fromkeys(ERRORS)
    return dict(zip(ERRORS, (*np.quantile(size, (0.5, 0.95)).tolist(), float(size.max())), strict=True))


def agreement(case: Case, seen: Any) -> dict[str, Any]:
    """Sides and places of one case, apart for throws that follow the same law and for those that do not."""
    why, scene = reasons(seen), case.load()
    same = why["same law"]
    size = np.abs(seen.error[same & seen.agree])
    rows = np.flatnonzero(~seen.agree & (seen.code_map != OUTSIDE_MODEL))
    aside = np.abs(seen.error[~same & seen.agree])
    return {
        "throws": int(seen.x.size),
        "same_law": int(same.sum()),
        "same_side": int((same & seen.agree).sum()),
        "aside": {name: int(why[name].sum()) for name in WHY},
        "aside_same_side": int((~same & seen.agree).sum()),
        "aside_median": float(np.median(aside)) if aside.size else 0.0,
        "aside_worst": float(aside.max(initial=0.0)),
        "error": summary(size),
        "sides_that_differ": [
            {
                "x": float(seen.x[k]),
                "side": int(seen.side[k]),
                "map": int(seen.side_map[k]),
                "engine": int(seen.side_engine[k]),
                "status": str(seen.status[k]),
                "law": next(name for name, mask in why.items() if mask[k]),
                "from_agreement": nearest_start(
                    scene, float(seen.x[k]), int(seen.side[k]), int(seen.side_engine[k])
                ),
            }
            for k in rows
        ],
    }


def convergence(name: str, seen: Any, count: int = 10) -> dict[str, Any]:
    """Median error of a handful of throws, those that follow one law, against the engine's step."""
    case = CASES[name]
    rows = np.flatnonzero(reasons(seen)["same law"] & seen.agree)[:count]
    errors = []
    for step in STEPS:
        again = ls.engine.compare(case.load(), seen.x[rows], seen.side[rows], step=step, **case.how)
        errors.append(summary(np.abs(again.error[again.agree]))["median"])
    known = None not in errors
    rate = float(np.polyfit(np.log(STEPS), np.log(errors), 1)[0]) if known else None
    return {"step": list(STEPS), "error": errors, "order": rate}


def missing(numbers: dict[str, Any]) -> list[str]:
    """Say which cases drew too few throws for a number."""
    lines = [
        f"{name}: none of {numbers[name]['throws']} throws follows the same law and ends on the same side"
        for name in CASES
        if not numbers[name]["same_side"]
    ]
    lines += [
        f"{name}: no throw to show how the error falls with the step"
        for name, found in numbers["convergence"].items()
        if found["order"] is None
    ]
    return ["", *(f"{line}; take more --throws." for line in lines)] if lines else []


def table(numbers: dict[str, Any]) -> str:
    """Write the numbers as a Markdown table."""
    lines = [
        HEAD,
        "|---" * 14 + "|",
    ]
    for name in CASES:
        found = numbers[name]
        sizes = [found["error"][key] for key in ERRORS]
        error = " | ".join("none" if size is None else f"{size:.1e}" for size in sizes)
        aside = " | ".join(str(found["aside"][key]) for key in WHY)
        rest = f"{found['aside_same_side']} | {found['aside_median']:.2g} | {found['aside_worst']:.2g}"
        lines.append(
            f"| {name} | {found['throws']} | {found['same_law']} | {found['same_side']} | {error} | {aside} | {rest} |"
        )
    return "\n".join([*lines, *missing(numbers)])


def figure(seen: dict[str, Any], numbers: dict[str, Any]) -> Figure:
    """Sorted errors of every case, errors by law with friction 0.5, and errors by step."""
    drawn, (sizes, laws, steps) = style.canvas(15.5, 5.4, 1, 3)
    _draw_sizes(sizes, seen)
    _draw_laws(laws, seen["contact, friction 0.5"])
    _draw_steps(steps, numbers["convergence"])
    for axes in (sizes, laws, steps):
        axes.grid(color="#dddddd", lw=0.6)
        axes.set_axisbelow(True)
    return drawn


def _draw_sizes(axes: Any, seen: dict[str, Any]) -> None:
    for name, (colour, line) in LOOK.items():
        found = seen[name]
        size = np.sort(np.abs(found.error[reasons(found)["same law"] & found.agree]))
        share = (np.arange(size.size) + 0.5) / size.size
        axes.plot(np.maximum(size, 1e-8), 100.0 * share, color=colour, ls=line, lw=1.6, label=name)
    axes.set_xscale("log")
    axes.set_xlim(1e-7, 1e3)  # room for the legend
    axes.set_xlabel("|x' in the engine - x' by the map| [in]")
    axes.set_ylabel("throws with at most this error [%]")
    axes.set_title("Throws that follow the same law", loc="left", fontsize=style.TEXT)
    axes.legend(fontsize=style.SMALL, loc="lower right")


def _draw_laws(axes: Any, found: Any) -> None:
    looks = {
        "same law": (style.JOG, "o", "same law"),
        "slides back": (style.FLIP, "s", "the vertex slides back within an impact"),
        "rocks": (style.ROLL, "^", "the part rocks before it lies still"),
        "solver": (style.INK, "x", "the engine's solver fails"),
    }
    why = reasons(found)
    for name, (colour, mark, text) in looks.items():
        here = why[name] & found.agree
        if here.any():
            axes.plot(
                found.x[here],
                np.abs(found.error[here]),
                mark,
                ms=3,
                color=colour,
                alpha=0.6,
                label=text,
                mew=0.6,
            )
    axes.set_yscale("log")
    axes.set_ylim(1e-5, 3e1)
    axes.set_xlabel("x before the throw [in]")
    axes.set_ylabel("|x' in the engine - x' by the map| [in]")
    axes.set_title("Contact without a hinge, friction 0.5", loc="left", fontsize=style.TEXT)
    axes.legend(fontsize=style.SMALL, loc="upper left")


def _draw_steps(axes: Any, found: dict[str, Any]) -> None:
    marks = iter("osD^")
    for name, rows in found.items():
        if rows["order"] is None:
            continue
        colour, line = LOOK[name]
        label = f"{name}: order {rows['order']:.2f}"
        axes.loglog(rows["step"], rows["error"], color=colour, ls=line, marker=next(marks), ms=4, label=label)
    axes.set_xlabel("step of the engine [rad]")
    axes.set_ylabel("median error of ten throws [in]")
    axes.set_title("Errors of the engine against its step", loc="left", fontsize=style.TEXT)
    axes.set_xticks(STEPS, [f"{step:g}" for step in STEPS])
    axes.minorticks_off()
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * 30.0)
    axes.legend(fontsize=style.SMALL, loc="upper left")


def main(seed: int = 0, out: Path = HERE, throws: int = THROWS) -> dict[str, Any]:
    """Run the study, write its figure, and return its numbers."""
    seen = {name: random_throws(case, seed, throws) for name, case in CASES.items()}
    numbers: dict[str, Any] = {name: agreement(case, seen[name]) for name, case in CASES.items()}
    shown = ("landing, roll, bounce", "drive, landing", "contact, friction 0.5", "contact, friction 1")
    numbers["convergence"] = {name: convergence(name, seen[name]) for name in shown}
    out.mkdir(parents=True, exist_ok=True)
    figure(seen, numbers).savefig(out / "effects.png", dpi=90)
    return numbers


if __name__ == "__main__":
    from study import ask  # beside this file, which is the first place looked in when it is run

    ask("The map's effects against a rigid-body engine.", main, table)
