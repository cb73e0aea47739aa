"""`limitsets atlas`: one or two quantities of a scene, varied, and what is asked at every point."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import limitsets as ls
from limitsets.base.tables import Table
from limitsets.face import report
from limitsets.face.cli.commands import Answer, Run, Scene, command, limits
from limitsets.face.cli.output import processes, saved, stem_of

if TYPE_CHECKING:
    from limitsets.parameters.atlas import Atlas


@command(form=True)
def atlas(
    run: Run,
    scene: Scene,
    *,
    x: str,
    y: str | None = None,
    variables: list[str] | None = None,
    task: str | None = None,
    margin: str | None = None,
    reading: str = "fixed",
    certify: bool = False,
    workers: Annotated[int | None, limits(min=1)] = None,
    cluster: str | None = None,
    refine: bool = False,
    coarse: Annotated[int, limits(min=2)] = 8,
) -> Answer:
    """Vary one or two quantities of a scene, and keep what a task says at every point.

    A run that was interrupted goes on when the same command is given again.

    Parameters
    ----------
    x : Q=LO:HI:N
        What varies: throw.speed=120:180:1000, or with units throw.speed='120 deg/s:180 deg/s:1000'.
    y : Q=LO:HI:N
        A second one; without it a line of points.
    variables : V,V
        Which answers; default: what the task gives.
    task : MODULE:FUNCTION
        What is asked: a function of a scene; by default the topology of the attractors.
    margin : Q
        Find the goal's margin at every point, by floats: throw.speed, or joint.
    reading : R
        Of --margin: fixed (but unknown) or per-throw.
    certify
        Prove what holds in each cell of the window; writes NAME-regions.proof.zip.
    workers : N
        Processes; default: one a core.
    cluster : URL
        Compute on a Dask cluster, by its scheduler's address: tcp://10.0.0.1:8786.
    refine
        Compute a coarse grid, then only points near boundaries of classes; fill the rest.
    coarse : N
        With --refine: the coarse grid has every N-th point of each axis.
    out : STORE
        The store (Zarr), ./NAME-atlas.zarr by default; one that was begun is continued.
    """
    from limitsets.parameters.atlas.classes import is_classified

    if task is not None:  # a file in the current folder can be imported, as with `python -m`
        sys.path.insert(0, str(Path.cwd()))
    chosen = ls.load(scene)
    store = run.out or Path(f"{stem_of(chosen)}-atlas.zarr")
    wanted = [name.strip() for words in variables or [] for name in words.split(",")]
    answers = ls.atlas(
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
        progress=run.tell,
    )
    last = [f"table: {run.csv}"] if run.csv is not None else []
    if is_classified(answers.dataset):
        picture = store.with_name(f"{store.name.removesuffix('.zarr')}.{run.form}")
        with saved(picture) as draft:
            ls.plot.atlas(answers).savefig(draft, dpi=report.writing.DPI)
        last.append(f"figure: {picture}")
    if answers.model is not None:
        last.append(run.about(answers.model).line())
    if certify:
        proof = Path(f"{stem_of(chosen)}-regions.proof.zip")
        with processes(workers) as pool:
            regions = answers.certify(executor=pool, progress=run.tell)
        run.tell("certificate", 0, 1)
        regions.save(proof, workers=workers)
        shares = ", ".join(f"{100 * share:.2f} % {word}" for word, share in regions.shares().items())
        last.append(f"regions: {shares}: {proof}")
    return Answer(answers, lambda: [*_text(answers), *last], answers.table)


def _text(answers: Atlas) -> Iterator[str | Table]:
    """Show the classes, the ranges of the answers, and the store."""
    from limitsets.parameters.atlas.classes import is_classified, legend

    for each in legend(answers.dataset) if is_classified(answers.dataset) else ():
        yield f"{100 * each.share:6.2f} %  {each.words}"
    yield answers.tables()[0]
    chunks = f", {answers.kept} of its {answers.kept + answers.new} chunks by earlier runs"
    yield f"{answers.dataset['status'].size} points{chunks if answers.kept else ''}: {answers.store}"
