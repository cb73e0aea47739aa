"""`limitsets design --robust`: the part for which the proved joint margin is large."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from math import isfinite
from shlex import quote
from typing import TYPE_CHECKING, Any

import limitsets as ls
from limitsets.base.files import as_json, picked
from limitsets.base.tables import Column, Table
from limitsets.face import report
from limitsets.face.cli.commands import About, Answer, Run
from limitsets.face.cli.output import saved

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from limitsets.feeder.scene import Scene
    from limitsets.feeder.scene.laid import LaidLike
    from limitsets.parameters.design import RobustDesign
    from limitsets.parameters.design.for_margin import NoDesignError


# ----------------------------------------------------------------
# The scene of a design: its file, or the scene itself on stdout.


def is_scene_file(run: Run) -> bool:
    """Whether --out is a file for the scene alone, and no folder."""
    return run.out is not None and run.out.suffix == ".toml"


def scene_file(run: Run, scene: Scene) -> str:
    """Name the file of a design; empty if none is written."""
    return "" if run.out is None else str(run.out if is_scene_file(run) else run.out / f"{scene.name}.toml")


def save_scene(scene: Scene, file: Path) -> None:
    """Write a scene alone."""
    with saved(file) as draft:
        draft.write_text(ls.dump(scene), encoding="utf-8", newline="\n")


def write_design(
    run: Run,
    scene: Scene,
    record: Callable[[], Any],
    drawn: Callable[[], Iterable[tuple[str, Figure]]] = tuple,
) -> None:
    """Write where --out says: the scene alone, or a folder with it, the answer as JSON, the part and more figures."""
    if run.out is None:
        return
    if is_scene_file(run):
        save_scene(scene, run.out)
        return
    texts = {f"{scene.name}.toml": ls.dump(scene), "design.json": record()}
    run.write([("part", ls.plot.part(scene)), *drawn()], texts)


def scene_words(run: Run, scene: Scene, about: About | None) -> Iterator[str]:
    """Name the file of a design, or give the design if there is no file.

    Without `about` it is a near miss only, and nothing is printed that looks like an answer.
    """
    file, run.files = scene_file(run, scene), []
    if about is not None:
        yield about.line()
    elif not file:
        yield "the values above are the nearest miss, no answer; add -o FILE.toml to save that scene"
        return
    if file:
        yield f"scene: {file}" + ("" if about else " (the nearest miss, no answer)")
    else:
        name = quote(f"{scene.name}.toml")
        yield f"scene (add -o {name} to save it):\n\n{ls.dump(scene)}".rstrip("\n")


def designed(
    run: Run,
    solution: Any,
    words: Iterable[str | Table],
    *,
    reached: bool = True,
    good: bool,
    drawn: Callable[[], Iterable[tuple[str, Figure]]] | None = tuple,
) -> Answer:
    """Write a design, where its files are not there yet (`drawn`), and answer: `words`, then its scene."""
    about = About(solution.model, scene_file(run, solution.scene), solution.scene)
    if drawn is not None:
        write_design(run, solution.scene, lambda: about.added(solution), drawn)
    return Answer(
        lambda: about.added(solution),
        lambda: [*words, *scene_words(run, solution.scene, about if reached else None)],
        solution.table,
        code=0 if good else 1,
    )


# ----------------------------------------------------------------
# The search, its files and its words.


def of_margin(
    run: Run,
    scene: Scene,
    vary: Sequence[str],
    *,
    bounds: Any,
    laid: LaidLike | None,
    evaluations: int,
    seconds: float,
    recheck: bool,
) -> Answer:
    """Search and prove."""
    from limitsets.parameters.design.for_margin import NoDesignError

    so_far = run.out
    if run.out is not None and not is_scene_file(run):
        so_far = run.out / f"{scene.name}-so-far.toml"
    try:
        design = ls.robust_design(
            scene,
            vary=(dict.fromkeys(vary, (None, None)) | bounds) or None,
            laid=laid,
            evaluations=evaluations,
            prove=seconds,
            progress=run.tell,
            keep=None if so_far is None else lambda best: _kept(best, so_far),
        )
    except NoDesignError as none:
        if none.miss is None:
            raise
        return _missed(run, none, scene, none.miss)
    in_folder = run.out is not None and not is_scene_file(run)
    if in_folder:
        design = _written(run, design, recheck=recheck)
    if so_far is not None and so_far != run.out:
        so_far.unlink(missing_ok=True)
    proved = seconds == 0.0 or all(margin.proved > 0.0 for margin in design.margins)
    return designed(run, design, _text(design), good=proved, drawn=None if in_folder else tuple)


def _kept(best: Scene, file: Path) -> None:
    """Write the best design so far, for the case that the search is interrupted."""
    file.parent.mkdir(parents=True, exist_ok=True)
    save_scene(best, file)


def _missed(run: Run, none: NoDesignError, scene: Scene, miss: Scene) -> Answer:
    """Give the nearest miss, and the reasons for which designs were ruled out."""
    from limitsets.feeder.scene.scene import in_unit_of, unit_of

    rows = [
        (name, *(in_unit_of(scene, name, one.value(name)) for one in (scene, miss)), unit_of(scene, name))
        for name in none.varied
    ]
    heads = ("quantity", Column("before", show=".6g"), Column("nearest miss", show=".6g"), "unit")
    table = Table(heads, rows, f"{scene.name}: no design that feeds")
    record = {"scene": miss.as_dict(), "message": str(none), **picked(none, "ruled_out", "evaluations")}
    write_design(run, miss, lambda: record)
    return Answer(record, lambda: [table, str(none), *scene_words(run, miss, None)], lambda: table, code=1)


def _written(run: Run, design: RobustDesign, *, recheck: bool) -> RobustDesign:
    """Write a folder with all files; return the design without the claims that the checker denies."""
    from limitsets.parameters.design.design_result import save

    with report.writing.filled(run.folder) as folder:
        design, paths = save(design, folder, recheck=recheck)
        record = About(design.model, str(run.folder / paths[0].name), design.scene).added(design)
        (folder / "design.json").write_text(as_json(record), encoding="utf-8", newline="\n")
        drawn = {"part": ls.plot.part(design.scene)}
        if design.front:
            drawn["front"] = ls.plot.robust_design(design)
        for name, figure in drawn.items():
            figure.savefig(folder / f"{name}.{run.form}", dpi=report.writing.DPI)
    return design


def _text(design: RobustDesign) -> Iterator[str | Table]:
    """Print the changed quantities, both margins, the throws, the lead weight, and the scene."""
    from limitsets.parameters.design.design_result import both

    unit, rate, in_time = design.scene.unit, design.scene.world.throw_rate, report.pages.in_time
    yield design.table()
    for label, margins, sampled, feeding in (
        ("before", design.before_margins, design.before_sampled, design.before_feeding),
        ("design", design.margins, design.sampled, design.feeding),
    ):
        if sampled is None or not isfinite(sampled.x):
            yield f"{label}: fed at no X in spite of any deviation"
            continue
        margin = f"joint margin by floats {sampled.margin:.4g} times the tolerance"
        yield f"{label}: X = {sampled.x:.4g} {unit}, {margin}"
        for one in margins:
            fails = "" if one.refuted is None else f", shown to fail from {one.refuted:.4g}"
            yield f"  {one.goals[0].kind}: proved up to {one.proved:.4g}{fails}"
        if feeding is not None:
            yield (
                f"  throws to feed (sampled): mean {feeding.mean:.3g}{in_time(feeding.mean, rate, parts=True)},"
                f" 95 % after {feeding.quantile_95:.3g}{in_time(feeding.quantile_95, rate)}"
            )
    asked = getattr(design.before.goal, "x", None)
    if asked is not None and asked != design.x:
        yield f"the goal's X has moved from {asked:g} to {design.x:g} {unit} (design --goal keeps it)"
    (fell, _), (least, _) = both(design.before_margins), both(design.margins)
    if fell is not None and least is not None and least < fell:
        yield (
            f"careful: what is proved fell, from {fell:.4g} to {least:.4g} times the tolerance: the design is better"
            " by floats alone"
        )
    moved = any(name.startswith("part.") for name in design.varied)
    if moved and "center" in design.scene.text["part"]["mass"]:  # else the file has the masses, or they stay
        lead = design.lead
        yield (
            f"lead weight: {100 * lead.share:.1f} % of the mass at x = {lead.x:.4g}, y = {lead.y:.4g} {unit}"
            " in the frame of the vertices"
        )
