"""The throw map against a rigid-body engine kept by others: scenes and a seed in, numbers and a figure out.

Run it as ``python studies/02_physics_engine/study.py [--seed 0] [--throws 2000] [--out FOLDER]``.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import limitsets as ls
from limitsets.face.plot import style

HERE = Path(__file__).resolve().parent
SCENES = ("paper-initial", "paper-designed")
THROWS = 2000
STEP = 1e-3
STEPS = (1.6e-2, 8e-3, 4e-3, 2e-3, 1e-3)
FRICTIONS = (0.3, 0.5, 1.0, 2.0, 5.0)
START = (15.0, 2)  # of the unilateral throws in paper-designed
LOOK = {"paper-initial": (style.FLIP, "s"), "paper-designed": (style.JOG, "o")}


def boundary(differs: Callable[[float], bool], lo: float, hi: float, width: float) -> float:
    """Bisect for the x from which on `differs` is true; nan where the ends do not bracket it."""
    if differs(lo) or not differs(hi):
        return math.nan
    while hi - lo > width:
        middle = 0.5 * (lo + hi)
        lo, hi = (lo, middle) if differs(middle) else (middle, hi)
    return 0.5 * (lo + hi)


def random_throws(name: str, seed: int, throws: int) -> Any:
    """Compare throws from starts drawn anywhere on the arm, on any side."""
    scene, random = ls.load(name), np.random.default_rng(seed)
    side = random.integers(len(scene.sides), size=throws)
    x = random.uniform(scene.sides.a[side], scene.arm_length)
    return ls.engine.compare(scene, x, side, step=STEP)


def critical_points(name: str) -> dict[int, float]:
    """First critical point of every side by the map."""
    scene = ls.load(name)
    return {side: points[0].x for side, points in ls.critical_points(scene.map, scene.domain).items()}


@cache
def critical_in_engine(name: str, step: float) -> dict[int, float]:
    """Where the engine's part begins to flip, on every side."""
    scene = ls.load(name)
    return {
        side: boundary(
            lambda x, side=side: ls.engine.throw(scene, x, side, step=step).side != side,
            r - 0.1,
            r + 0.1,
            1e-8,
        )
        for side, r in critical_points(name).items()
    }


def other_vertex_from(name: str) -> dict[str, float]:
    """From which x on another vertex lands before the left one, where that is so at the arm's end."""
    scene = ls.load(name)
    found = {}
    for side in range(len(scene.sides)):
        left = -side % len(scene.sides)
        x = boundary(
            lambda x, side=side, left=left: ls.engine.throw(scene, x, side, step=0.05).struck != left,
            0.5 * scene.arm_length,
            scene.arm_length,
            1e-6,
        )
        if math.isfinite(x):
            found[str(side)] = x
    return found


def agreement(name: str, seen: Any) -> dict[str, Any]:
    """Errors of x' and sides that differ, in one table of throws."""
    left, critical = ~seen.other_vertex, critical_points(name)
    size = np.abs(seen.error[left & seen.agree])
    rows = np.flatnonzero(~seen.agree)
    return {
        "throws": int(seen.x.size),
        "flips": int((seen.side_map != seen.side).sum()),
        "sides_that_differ": [
            {
                "x": float(seen.x[k]),
                "side": int(seen.side[k]),
                "map": int(seen.side_map[k]),
                "engine": int(seen.side_engine[k]),
                "status": str(seen.status[k]),
                "other_vertex": bool(seen.other_vertex[k]),
                "from_critical_point": abs(float(seen.x[k]) - critical[int(seen.side[k])]),
            }
            for k in rows
        ],
        "error": {
            "median": float(np.median(size)),
            "95 %": float(np.quantile(size, 0.95)),
            "worst": float(size.max()),
        },
        "other_vertex": {
            "throws": int((~left).sum()),
            "from": other_vertex_from(name),
            "worst": float(np.nanmax(np.abs(seen.error[~left]), initial=0.0)),
        },
        "critical_points": {str(side): x for side, x in critical_in_engine(name, STEP).items()},
    }


def convergence(seed: int) -> dict[str, list[float]]:
    """Errors against the step: of x' the median over 24 starts a scene, of r_i the worst of all sides and scenes."""
    random = np.random.default_rng(seed)
    places, points = [], []
    starts = {}
    for name in SCENES:
        scene = ls.load(name)
        side = np.arange(24) % len(scene.sides)
        starts[name] = random.uniform(scene.sides.a[side] + 1.0, 19.0), side
    for step in STEPS:
        errors, off = [], []
        for name in SCENES:
            seen = ls.engine.compare(ls.load(name), *starts[name], step=step)
            errors.extend(np.abs(seen.error[seen.agree]))
            by_map, in_engine = critical_points(name), critical_in_engine(name, step)
            off.extend(abs(in_engine[side] - by_map[side]) for side in by_map)
        places.append(float(np.median(errors)))
        points.append(max(off))
    return {"step": list(STEPS), "place": places, "critical_point": points}


def order(steps: list[float], errors: list[float]) -> float:
    """Slope of the errors in a picture with logarithmic axes."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def unilateral() -> dict[str, Any]:
    """Throw from one start with the engine's own contact, by friction; and hinged."""
    scene = ls.load("paper-designed")
    rests = [ls.engine.throw(scene, *START, contact="unilateral", friction=mu) for mu in FRICTIONS]
    return {
        "hinge": ls.engine.throw(scene, *START).x,
        "by_friction": {str(mu): rest.x for mu, rest in zip(FRICTIONS, rests, strict=True)},
        "sides": sorted({rest.side for rest in rests}),
    }


def table(numbers: dict[str, Any]) -> str:
    """Write the numbers as Markdown tables."""
    lines = [
        "| scene | throws | flips | sides that differ | error of x' [in]: median | 95 % | worst | other vertex first |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in SCENES:
        found = numbers[name]
        error = " | ".join(f"{found['error'][key]:.1e}" for key in ("median", "95 %", "worst"))
        lines.append(
            f"| {name} | {found['throws']} | {found['flips']} | {len(found['sides_that_differ'])} | {error} "
            f"| {found['other_vertex']['throws']} |"
        )
    lines += [
        "",
        "| scene | side | flips from, in the engine [in] | other vertex first from [in] |",
        "|---|---|---|---|",
    ]
    for name in SCENES:
        others = numbers[name]["other_vertex"]["from"]
        for side, x in numbers[name]["critical_points"].items():
            other = f"{others[side]:.4f}" if side in others else "never"
            lines.append(f"| {name} | {side} | {x:.5f} | {other} |")
    rests = numbers["unilateral"]
    lines += ["", "| contact | x' [in] |", "|---|---|", f"| hinge | {rests['hinge']:.3f} |"]
    lines += [f"| unilateral, friction {mu} | {x:.2f} |" for mu, x in rests["by_friction"].items()]
    return "\n".join(lines)


def figure(seen: dict[str, Any], numbers: dict[str, Any]) -> Figure:
    """Errors by start, errors by step, and where unilateral contact leads."""
    drawn, (errors, steps, places) = style.canvas(15.5, 5.4, 1, 3)
    _draw_errors(errors, seen)
    _draw_steps(steps, numbers["convergence"])
    _draw_places(places)
    for axes in (errors, steps, places):
        axes.grid(color="#dddddd", lw=0.6)
        axes.set_axisbelow(True)
    return drawn


def _draw_errors(axes: Any, seen: dict[str, Any]) -> None:
    for name, found in seen.items():
        colour, mark = LOOK[name]
        size, left = np.maximum(np.abs(found.error), 1e-8), ~found.other_vertex
        axes.plot(found.x[left], size[left], mark, ms=2.2, color=colour, mec="none", alpha=0.5)
        axes.plot(found.x[~left], size[~left], mark, ms=4.5, mfc="none", mec=colour, mew=0.8)
        axes.plot([], [], mark, ms=4.5, color=colour, label=name)
        axes.plot([], [], mark, ms=4.5, mfc="none", mec=colour, label=f"{name}, another vertex first")
    axes.set_yscale("log")
    axes.set_ylim(1e-8, 5.0)
    axes.set_xlabel("x before the throw [in]")
    axes.set_ylabel("|x' in the engine - x' by the map| [in]")
    axes.set_title(
        f"Hinged, step {STEP:g} rad: where the part comes to rest", loc="left", fontsize=style.TEXT
    )
    axes.legend(fontsize=style.SMALL, loc="upper left")


def _draw_steps(axes: Any, found: dict[str, list[float]]) -> None:
    kinds = (
        ("place", "x', median", style.JOG, "o", "-"),
        ("critical_point", "r_i, worst of six", style.FLIP, "s", "--"),
    )
    for key, text, colour, mark, line in kinds:
        rate = order(found["step"], found[key])
        axes.loglog(
            found["step"], found[key], color=colour, marker=mark, ls=line, label=f"{text}: order {rate:.2f}"
        )
    axes.set_xlabel("step of the engine [rad]")
    axes.set_ylabel("error [in]")
    axes.set_title("Hinged: errors of the engine against its step", loc="left", fontsize=style.TEXT)
    axes.legend(fontsize=style.SMALL)


def _draw_places(axes: Any) -> None:
    scene, side = ls.load("paper-designed"), START[1]
    x = np.linspace(9.0, 19.75, 44)
    looks = (
        (0.3, style.FAINT, "^", ":"),
        (0.5, style.FLIP, "s", "--"),
        (1.0, style.GOAL, "D", "-."),
        (5.0, style.INK, "o", "-"),
    )
    axes.axhline(0.0, color=style.JOG, lw=2.0, label="hinge (the map)")
    for friction, colour, mark, line in looks:
        seen = ls.engine.compare(scene, x, side, contact="unilateral", friction=friction)
        axes.plot(
            x, seen.error, color=colour, marker=mark, ms=3, lw=1.0, ls=line, label=f"friction {friction:g}"
        )
    axes.set_xlabel("x before the throw [in]")
    axes.set_ylabel("x' unilateral - x' hinged [in]")
    axes.set_title("Unilateral contact, jogs on side 2 of paper-designed", loc="left", fontsize=style.TEXT)
    axes.set_ylim(-1.9, 0.95)
    axes.legend(fontsize=style.SMALL, loc="upper left", ncols=2)


def main(seed: int = 0, out: Path = HERE, throws: int = THROWS) -> dict[str, Any]:
    """Run the study, write its figure, and return its numbers."""
    seen = {name: random_throws(name, seed, throws) for name in SCENES}
    numbers: dict[str, Any] = {name: agreement(name, seen[name]) for name in SCENES}
    numbers["convergence"] = convergence(seed)
    numbers["unilateral"] = unilateral()
    out.mkdir(parents=True, exist_ok=True)
    figure(seen, numbers).savefig(out / "engine.png", dpi=90)
    return numbers


def ask(about: str, study: Callable[..., Any], as_table: Callable[[Any], str]) -> None:
    """Run a study as the command line says, and print its table or all its numbers."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--seed", type=int, default=0, help="of the starts")
    parser.add_argument("--throws", type=int, default=THROWS, help="in each scene or case")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of the figure")
    parser.add_argument("--json", action="store_true", help="print all numbers as JSON")
    words = parser.parse_args()
    answer = study(words.seed, words.out, words.throws)
    print(json.dumps(answer, indent=2) if words.json else as_table(answer))


if __name__ == "__main__":
    ask("The throw map against a rigid-body engine.", main, table)
