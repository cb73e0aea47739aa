"""`limitsets design --robust`: the part for which the proved joint margin is large."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from limitsets.base.files import as_json, picked
from limitsets.face.cli.about import About
from limitsets.face.cli.arguments import bounds_of
from limitsets.face.cli.output import answer, opened, progress, save_scene, scene_file, show, show_scene

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limitsets.feeder.scene import Scene
    from limitsets.feeder.scene.laid import LaidLike
    from limitsets.parameters.design import RobustDesign
    from limitsets.parameters.design.for_margin import NoDesignError


def run_robust(
    name: str,
    vary: Sequence[str],
    bounds: list[str] | None,
    laid: LaidLike | None,
    evaluations: int,
    seconds: float,
    out: Path | None,
    form: str,
    csv: Path | None,
    *,
    json: bool,
    recheck: bool,
) -> int:
    """Search, prove, write and print; return the exit code."""
    with progress() as tell:
        from limitsets.parameters.design import robust_design
        from limitsets.parameters.design.for_margin import NoDesignError

        scene, _ = opened(name, None if out and out.suffix == ".toml" else out)
        so_far = None if out is None else out if out.suffix == ".toml" else out / f"{scene.name}-so-far.toml"
        try:
            design = robust_design(
                scene,
                vary=(dict.fromkeys(vary, (None, None)) | bounds_of(scene, bounds)) or None,
                laid=laid,
                evaluations=evaluations,
                prove=seconds,
                progress=tell,
                keep=None if so_far is None else lambda best: _kept(best, so_far),
            )
        except NoDesignError as none:
            if none.miss is None:
                raise
            return _missed(none, scene, none.miss, out, form, csv, json=json)
        design, files = (design, []) if out is None else _written(design, out, form, recheck=recheck)
        if so_far is not None and so_far != out:
            so_far.unlink(missing_ok=True)
    about = About(design.model, scene_file(design.scene, out), design.scene)
    answer(
        about.added(design) if json else design,
        json,
        lambda: _text(design, files, about),
        csv=(csv, design.table),
    )
    return 0 if seconds == 0.0 or all(one.proved > 0.0 for one in design.margins) else 1


def _kept(best: Scene, file: Path) -> None:
    """Write the best design so far, for the case that the search is interrupted."""
    file.parent.mkdir(parents=True, exist_ok=True)
    save_scene(best, file)


def _missed(
    none: NoDesignError,
    scene: Scene,
    miss: Scene,
    out: Path | None,
    form: str,
    csv: Path | None,
    *,
    json: bool,
) -> int:
    """Write and print the nearest miss, and the reasons for which designs were ruled out."""
    from limitsets.base.tables import Column, Table
    from limitsets.feeder.scene.scene import in_unit_of, unit_of

    values = {
        name: [in_unit_of(scene, name, one.value(name)) for one in (scene, miss)] for name in none.varied
    }
    rows = [(name, *pair, unit_of(scene, name)) for name, pair in values.items()]
    heads = ("quantity", Column("before", show=".6g"), Column("nearest miss", show=".6g"), "unit")
    table = Table(heads, rows, f"{scene.name}: no design that feeds")
    record = {"scene": miss.as_dict(), "message": str(none), **picked(none, "ruled_out", "evaluations")}
    if out is None:
        files = []
    elif out.suffix == ".toml":
        files = save_scene(miss, out)
    else:
        from limitsets.face import plot
        from limitsets.face.report.writing import laid
        from limitsets.feeder.scene import dump

        texts = {f"{miss.name}.toml": dump(miss), "design.json": as_json(record)}
        files = laid(out, [("part", plot.part(miss))], lambda _: texts, form)

    def text() -> None:
        show(table)
        typer.echo(str(none))
        show_scene(miss, files, None)

    answer(record, json, text, csv=(csv, lambda: table))
    return 1


def _written(design: RobustDesign, out: Path, form: str, *, recheck: bool) -> tuple[RobustDesign, list[Path]]:
    """Write the scene, or a folder with all files; return the design without the claims that the checker denies."""
    if out.suffix == ".toml":
        return design, save_scene(design.scene, out)
    from limitsets.face import plot
    from limitsets.face.report.writing import DPI, filled
    from limitsets.parameters.design.design_result import save

    with filled(out) as folder:
        design, paths = save(design, folder, recheck=recheck)
        record = About(design.model, str(out / paths[0].name), design.scene).added(design)
        (folder / "design.json").write_text(as_json(record), encoding="utf-8", newline="\n")
        names = [path.name for path in paths] + [f"part.{form}"]
        plot.part(design.scene).savefig(folder / names[-1], dpi=DPI)
        if design.front:
            names.append(f"front.{form}")
            plot.robust_design(design).savefig(folder / names[-1], dpi=DPI)
    return design, [out / name for name in names]


def _text(design: RobustDesign, files: list[Path], about: About) -> None:
    """Print the changed quantities, both margins, the throws, the lead weight, and the scene."""
    from limitsets.face.report.pages import in_time
    from limitsets.parameters.design.design_result import both

    unit, rate = design.scene.unit, design.scene.world.throw_rate
    show(design.table())
    for label, margins, sampled, feeding in (
        ("before", design.before_margins, design.before_sampled, design.before_feeding),
        ("design", design.margins, design.sampled, design.feeding),
    ):
        if sampled is None or not isfinite(sampled.x):
            typer.echo(f"{label}: fed at no X in spite of any deviation")
            continue
        margin = f"joint margin by floats {sampled.margin:.4g} times the tolerance"
        typer.echo(f"{label}: X = {sampled.x:.4g} {unit}, {margin}")
        for one in margins:
            fails = "" if one.refuted is None else f", shown to fail from {one.refuted:.4g}"
            typer.echo(f"  {one.goals[0].kind}: proved up to {one.proved:.4g}{fails}")
        if feeding is not None:
            typer.echo(
                f"  throws to feed (sampled): mean {feeding.mean:.3g}{in_time(feeding.mean, rate, parts=True)},"
                f" 95 % after {feeding.quantile_95:.3g}{in_time(feeding.quantile_95, rate)}"
            )
    asked = getattr(design.before.goal, "x", None)
    if asked is not None and asked != design.x:
        typer.echo(f"the goal's X has moved from {asked:g} to {design.x:g} {unit} (design --goal keeps it)")
    (fell, _), (least, _) = both(design.before_margins), both(design.margins)
    if fell is not None and least is not None and least < fell:
        typer.echo(
            f"careful: what is proved fell, from {fell:.4g} to {least:.4g} times the tolerance: the design is better"
            " by floats alone"
        )
    moved = any(name.startswith("part.") for name in design.varied)
    if moved and "center" in design.scene.text["part"]["mass"]:  # else the file has the masses, or they stay
        lead = design.lead
        typer.echo(
            f"lead weight: {100 * lead.share:.1f} % of the mass at x = {lead.x:.4g}, y = {lead.y:.4g} {unit}"
            " in the frame of the vertices"
        )
    show_scene(design.scene, files, about)
