"""`limitsets atlas`: one or two quantities of a scene, varied, and what is asked at every point."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.face.cli.about import About
from limitsets.face.cli.output import (
    Csv,
    Form,
    Format,
    Json,
    Scene,
    answer,
    opened,
    option,
    processes,
    progress,
    saved,
    show,
    stem_of,
)

if TYPE_CHECKING:
    from limitsets.base.progress import Progress
    from limitsets.parameters.atlas import Atlas


HELP_X = "What varies: throw.speed=120:180:1000, or with units throw.speed='120 deg/s:180 deg/s:1000'."
HELP_TASK = "What is asked: a function of a scene; by default the topology of the attractors."
HELP_MARGIN = "Find the goal's margin at every point, by floats: throw.speed, or joint."
HELP_CERTIFY = "Prove what holds in each cell of the window; writes NAME-regions.proof.zip."
HELP_OUT = "The store (Zarr), ./NAME-atlas.zarr by default; one that was begun is continued."
HELP_CLUSTER = "Compute on a Dask cluster, by its scheduler's address: tcp://10.0.0.1:8786."
HELP_REFINE = "Compute a coarse grid, then only points near boundaries of classes; fill the rest."
HELP_COARSE = "With --refine: the coarse grid has every N-th point of each axis."


def atlas(
    scene: Scene,
    x: Annotated[str, option("--x", "Q=LO:HI:N", HELP_X)],
    y: Annotated[str | None, option("--y", "Q=LO:HI:N", "A second one; without it a line of points.")] = None,
    variables: Annotated[
        list[str] | None, option("--variables", "V,V", "Which answers; default: what the task gives.")
    ] = None,
    task: Annotated[str | None, option("--task", "MODULE:FUNCTION", HELP_TASK)] = None,
    margin: Annotated[str | None, option("--margin", "Q", HELP_MARGIN)] = None,
    reading: Annotated[
        str, option("--reading", "R", "Of --margin: fixed (but unknown) or per-throw.")
    ] = "fixed",
    certify: Annotated[bool, typer.Option("--certify", help=HELP_CERTIFY)] = False,
    out: Annotated[Path | None, option("--out -o", "STORE", HELP_OUT)] = None,
    workers: Annotated[int | None, option("--workers", "N", "Processes; default: one a core.", min=1)] = None,
    cluster: Annotated[str | None, option("--cluster", "URL", HELP_CLUSTER)] = None,
    refine: Annotated[bool, typer.Option("--refine", help=HELP_REFINE)] = False,
    coarse: Annotated[int, option("--coarse", "N", HELP_COARSE, min=2)] = 8,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
) -> None:
    """Vary one or two quantities of a scene, and keep what a task says at every point.

    A run that was interrupted goes on when the same command is given again.
    """
    with progress() as tell:
        from limitsets.parameters.atlas import atlas as run

        if task is not None:  # a file in the current folder can be imported, as with `python -m`
            sys.path.insert(0, str(Path.cwd()))
        chosen, _ = opened(scene, None)
        store = out or Path(f"{stem_of(chosen)}-atlas.zarr")
        wanted = [name.strip() for words in variables or [] for name in words.split(",")]
        answers = run(
            chosen,
            x,
            y,
            task=task,
            variables=wanted or None,
            options=None if margin is None else {"margin": margin, "reading": reading},
            refine=refine,
            coarse=coarse,
            store=store,
            workers=workers,
            cluster=cluster,
            progress=tell,
        )
        picture = store.with_name(f"{store.name.removesuffix('.zarr')}.{form}")
        drawn = _draw(answers, picture)
        proof = Path(f"{stem_of(chosen)}-regions.proof.zip") if certify else None
        shares = _certified(answers, proof, workers, tell) if proof is not None else {}
    place = picture if drawn else None
    answer(answers if json else None, json, lambda: _text(answers, csv, place), csv=(csv, answers.table))
    if answers.model is not None and not json:
        typer.echo(About(answers.model, scene).line())
    if proof is not None and not json:
        said = ", ".join(f"{100 * share:.2f} % {word}" for word, share in shares.items())
        typer.echo(f"regions: {said}: {proof}")


def _certified(answers: Atlas, file: Path, workers: int | None, tell: Progress) -> dict[str, float]:
    """Prove the cells in several processes, write the certificate, and return the share of the window by verdict."""
    with processes(workers) as pool:
        regions = answers.certify(executor=pool, progress=tell)
    tell("certificate", 0, 1)
    regions.save(file, workers=workers)
    return regions.shares()


def _draw(answers: Atlas, file: Path) -> bool:
    """Draw the classes, if the answers have any; return whether they have."""
    from limitsets.face.plot.atlas_maps import atlas as figure
    from limitsets.face.report.writing import DPI
    from limitsets.parameters.atlas.classes import is_classified

    if not is_classified(answers.dataset):
        return False
    drawn = figure(answers)
    with saved(file) as draft:
        drawn.savefig(draft, dpi=DPI)
    return True


def _text(answers: Atlas, csv: Path | None, picture: Path | None) -> None:
    """Print the classes, the ranges of the answers, and the store."""
    from limitsets.parameters.atlas.classes import is_classified, legend

    for each in legend(answers.dataset) if is_classified(answers.dataset) else ():
        typer.echo(f"{100 * each.share:6.2f} %  {each.words}")
    show(answers.tables()[0])
    points = answers.dataset["status"].size
    again = (
        f", {answers.kept} of its {answers.kept + answers.new} chunks by earlier runs" if answers.kept else ""
    )
    typer.echo(f"{points} points{again}: {answers.store}")
    if csv is not None:
        typer.echo(f"table: {csv}")
    if picture is not None:
        typer.echo(f"figure: {picture}")
