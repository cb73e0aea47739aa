"""Write the tolerance sheet: page, JSON and pictures, all or none; certificates exist already."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from limitsets import plot
from limitsets.files import as_json
from limitsets.report.robust_pages import deviation_of, robustness_page, shown, violated_of
from limitsets.report.writing import laid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from limitsets.robust.sheet.summary import Robustness


def _drawn(found: Robustness) -> Iterator[tuple[str, Figure]]:
    """Draw what there is to draw."""
    yield "part", plot.part(found.scene)
    single = [each for each in found.margins() if each.quantity != "joint"]
    if found.decided == "proved" and single:
        yield "margins", plot.tornado(single)
    if found.joint is not None and found.joint.holds:
        yield "joint", plot.tolerance_box(found.margins()[-1])
    if found.curve is not None:
        yield "curve", plot.margin_curve(found.curve)
    yield from _noise(found)
    first = shown(found)
    if first is not None:
        name = deviation_of(first).rstrip(",") if first.holds else "the scene as it is"
        yield (
            "counterexample",
            plot.counterexample(found.scene, first.counterexample, violated_of(first, found.goals), name),
        )


def _noise(found: Robustness) -> Iterator[tuple[str, Figure]]:
    """Draw the noise: where nothing stays there is no density, where nothing is fed no throws until then.

    Of a single level, where there was no time for others, there is nothing to see.
    """
    if found.noise is None or found.levels is None:
        return
    if found.noise.classes:
        yield "density", plot.noise_density(found.noise)
    if found.noise.feeding.mean is not None:
        yield "throws", plot.noise_arrivals(found.noise)
    if found.levels.factors.size > 1:
        yield "levels", plot.noise_levels(found.levels, {"level of the noise, as given = 1": 1.0})


def write_robustness(
    found: Robustness, folder: str | Path, form: str = "png", *, html: bool = False
) -> list[Path]:
    """Write report.md, robustness.json and the figures into a folder, all of them or none; report.html where asked for.

    Raises
    ------
    LimitsetsError
        The folder cannot be written.
    """
    return laid(
        folder,
        _drawn(found),
        lambda figures: {"report.md": robustness_page(found, figures), "robustness.json": as_json(found)},
        form,
        html=html,
    )
