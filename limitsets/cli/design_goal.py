"""`limitsets design --goal`: a scene that meets its own goal, at the X that it asks for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from limitsets.cli.about import About
from limitsets.cli.arguments import bounds_of
from limitsets.cli.output import answer, opened, progress, save_scene, scene_file, show, show_scene
from limitsets.proposals import proposed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limitsets.inverse.margin.for_goal import GoalDesign
    from limitsets.scene.laid import LaidLike


def run_goal(
    name: str,
    vary: Sequence[str],
    bounds: list[str] | None,
    laid: LaidLike | None,
    evaluations: int,
    out: Path | None,
    form: str,
    csv: Path | None,
    *,
    json: bool,
) -> int:
    """Search, prove, write and print; the exit code."""
    with progress() as tell:
        from limitsets.inverse.margin.for_goal import design_for_goal

        scene, _ = opened(name, None if out and out.suffix == ".toml" else out)
        given = bounds_of(scene, bounds)
        found = design_for_goal(
            scene, vary=vary, bounds=given, laid=laid, evaluations=evaluations, progress=tell
        )
        about = About(found.model, scene_file(found.scene, out), found.scene)
        files = [] if out is None else _written(found, out, form, about)
    answer(
        about.added(found) if json else found,
        json,
        lambda: _text(found, files, about, evaluations),
        csv=(csv, found.table),
    )
    return 0 if found.verdict == "proved" else 1


def _written(found: GoalDesign, out: Path, form: str, about: About) -> list[Path]:
    """Write the scene, or a folder with the scene, the answer as JSON and the part."""
    if out.suffix == ".toml":
        return save_scene(found.scene, out)
    from limitsets import plot
    from limitsets.files import as_json
    from limitsets.report.writing import laid
    from limitsets.scene import dump

    texts = {f"{found.scene.name}.toml": dump(found.scene), "design.json": as_json(about.added(found))}
    return laid(out, [("part", plot.part(found.scene))], lambda _: texts, form)


def _text(found: GoalDesign, files: list[Path], about: About, asked: int) -> None:
    from limitsets.inverse.margin.for_goal import POPULATION

    show(found.table())
    typer.echo(found.message[:1].upper() + found.message[1:] + ".")
    typer.echo(found.itself)
    if found.room > 0.0 and not any(name.startswith("part.") for name in found.varied):
        typer.echo("arm and throw are enough: the part stays as it is")
    elif found.evaluations < asked:
        whole = asked - found.evaluations < POPULATION
        why = f"only whole generations of {POPULATION} are" if whole else "all designs came to rate alike"
        typer.echo(f"{found.evaluations} of {asked} designs were looked at: {why}")
    met = found.room > 0.0
    if met and found.ruled_out:
        from limitsets.inverse.margin.search import said

        typer.echo(
            f"{sum(found.ruled_out.values())} of {found.evaluations} designs were ruled out: {said(found.ruled_out)}"
        )
    if met and found.leaving is not None:
        from limitsets.report.tables import percent

        typer.echo(
            f"careful: from {percent(found.leaving)} of all starts (sampled) parts leave the arm; no design was found"
            " that meets the goal and that no part leaves, and margins of this one may be 0 by that"
        )
    if met and found.verdict != "proved":
        file = next((str(path) for path in files if path.suffix == ".toml"), None)
        save = "" if file else "add -o design.toml to this command, then "
        command = proposed("certify", file or "design.toml")
        typer.echo(f"next: {save}{command} (what keeps the design from a proof)")
    show_scene(found.scene, files, about if met else None)
