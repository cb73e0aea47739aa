"""The study of the atlas: classes of feeders over speed and surface height, and what refinement sees of them.

Run it as ``python studies/08_atlas/study.py [--points N] [--out FOLDER]``: N x N points of each map.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

import limitsets as ls
from limitsets.parameters.atlas.classes import legend, named_class

HERE = Path(__file__).resolve().parent
SPEED, HEIGHT = "throw.speed=120:180", "arm.surface_height=-1:0.2"
# Off the seams 0 and 1/2 of the circle, where a cycle may lie on the ends of the domain.
OMEGA, COUPLING = "omega=0.005:0.495", "coupling=0.02:0.98"
CIRCLE = ls.maps.Circle()
# Steps of the coarse grid.
STEPS = (4, 8, 16)
# "nearly every start" and "most starts"
NEARLY, MOST = 0.95, 0.5
THROWS = 2000


def compared(full: Any, *what: Any, **options: Any) -> dict[str, Any]:
    """Compare refined atlases with the full grid: points computed, pixels of another class, what was missed."""
    classes, found = full["class"].values, {}
    for step in STEPS:
        data = ls.atlas(*what, refine=True, coarse=step, variables=["class"], **options).dataset
        wrong = data["class"].values != classes
        computed = data["level"].values >= 0
        found[str(step)] = {
            "computed": round(float(computed.mean()), 4),
            "differ": round(float(wrong.mean()), 6),
            "widest missed": int(widths(classes)[wrong].max(initial=0)),
        }
    return found


def widths(classes: Any) -> Any:
    """Count, for each pixel, those of its row that are beside it without a gap and have its class."""
    found = np.empty(classes.shape, dtype=int)
    for row, here in zip(classes, found, strict=True):
        starts = np.flatnonzero(np.r_[True, row[1:] != row[:-1], True])
        here[:] = np.repeat(np.diff(starts), np.diff(starts))
    return found


def classes_of(data: Any) -> list[dict[str, Any]]:
    """List the legend."""
    return [{"class": each.name, "share": round(each.share, 5)} for each in legend(data)]


def feeders(points: int, out: Path) -> dict[str, Any]:
    """Map the feeders of the window, draw them, and count what becomes of the starts."""
    what = ("paper-designed", f"{SPEED}:{points}", f"{HEIGHT}:{points}")
    found = ls.atlas(*what)
    ls.plot.atlas(found).savefig(out / "feeders.png", dpi=110)
    data = found.dataset
    decided = data["undecided"].values == 0
    kept = np.nansum(data["share"].values, axis=-1)[decided]
    leaves, collapses = (data[name].values[decided] for name in ("leaves", "collapses"))
    starts = {
        "all kept": kept >= 1.0 - 1e-9,
        "nearly all kept": kept >= NEARLY,
        "most leave": leaves > MOST,
        "most collapse": collapses > MOST,
    }
    return {
        "classes": classes_of(data),
        "starts": {words: round(float(here.mean()), 4) for words, here in starts.items()},
        "refined": compared(data, *what),
    }


def surfaces(points: int, out: Path) -> dict[str, Any]:
    """Draw what varies within the classes."""
    what = ("paper-designed", f"{SPEED}:{points}", f"{HEIGHT}:{points}")
    wanted = ["class", "share", "lyapunov", "flips_per_throw", "threshold", "jogs_max"]
    found = ls.atlas(*what, variables=wanted, options={"throws": THROWS})
    for name in ("threshold", "lyapunov", "flips_per_throw"):
        ls.plot.atlas_surface(found, name).savefig(out / f"{name.replace('_', '-')}.png", dpi=90)
    data, ranges = found.dataset, {}
    margins = ls.atlas(
        "paper-designed", f"{SPEED}:{points // 2}", f"{HEIGHT}:{points // 2}", options={"margin": "throw.speed"},
        variables=["class", "margin"],
    )  # fmt: skip
    ls.plot.atlas_surface(margins, "margin").savefig(out / "margin.png", dpi=90)
    best = margins.dataset["margin"].max()
    ranges["largest margin"] = {
        "value": round(float(best), 3),
        "unit": margins.dataset["margin"].attrs["units"],
    }
    for name in ("threshold", "lyapunov", "flips_per_throw"):
        values = data[name].values
        ranges[name] = [round(float(each), 3) for each in (np.nanmin(values), np.nanmax(values))]
    return ranges


def logistic(points: int, out: Path) -> dict[str, Any]:
    """Find windows of the logistic map: the first with each short cycle, its first and its last r."""
    found = ls.atlas(ls.maps.Logistic(3.83), f"r=2.9:4:{points}", domain=[(0, 1)])
    ls.plot.atlas(found).savefig(out / "logistic.png", dpi=110)
    data, windows = found.dataset, {}
    r = data["r"].values
    for period in (1, 2, 4, 3):
        here = data["period"].values[:, 0] == period
        first = int(np.argmax(here))
        window = r[first:][np.logical_and.accumulate(here[first:])]
        windows[str(period)] = [round(float(each), 6) for each in (window[0], window[-1])]
    undecided = float((data["undecided"].values > 0).mean())
    return {"windows": windows, "step": float(r[1] - r[0]), "undecided": round(undecided, 4)}


def circle(points: int, out: Path) -> dict[str, Any]:
    """Map the tongues of the circle map, and compare the main one with its closed form."""
    what = (CIRCLE, f"{OMEGA}:{points}", f"{COUPLING}:{points}")
    found = ls.atlas(*what, domain=[(0, 1)])
    ls.plot.atlas(found).savefig(out / "circle.png", dpi=110)
    data = found.dataset
    omega, coupling = data["omega"].values, data["coupling"].values
    inside = omega[None, :] < coupling[:, None] / (2 * math.pi)
    main = data["period"].values[..., 0] == 1
    decided = data["undecided"].values == 0
    cycles = {
        kind.period for each in legend(data) if each.number for kind in named_class(each.name).attractors
    }
    return {
        "main tongue differs": int((main != inside)[decided].sum()),
        "undecided": round(float(1.0 - decided.mean()), 5),
        "periods": sorted(cycles - {0}),
        "refined": compared(data, *what, domain=[(0, 1)]),
    }


def main(points: int = 256, out: Path = HERE) -> dict[str, Any]:
    """Answer the study's question, and draw the figures."""
    return {
        "points": points,
        "feeders": feeders(points, out),
        "surfaces": surfaces(max(points // 4, 8), out),
        "logistic": logistic(4 * points, out),
        "circle": circle(points, out),
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=256)
    parser.add_argument("--out", type=Path, default=HERE)
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    print(json.dumps(main(chosen.points, chosen.out), indent=1))
