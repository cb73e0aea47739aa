"""`limitsets fit`: the model fitted to filmed throws, and whether the goal's margin is larger than what was found."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.cli.arguments import number
from limitsets.cli.output import Csv, Form, Format, Json, Scene, answer, opened, option, progress, show

if TYPE_CHECKING:
    from limitsets.fitting import Enough, Fit

HELP_FILE = (
    "Throws: x_before [mm], side_before, x_after [mm], side_after, and, if known, error [mm], run; corner_before [mm], "
    "corner_after [mm] for x where the film shows the left corner."
)
HELP_ERROR = "Standard deviation of a measured place: '0.5 mm', or a number in the scene's unit."
HELP_OUT = "Write fitted.toml, fit.json and figures."
HELP_NO_MARGIN = "Do not ask whether the goal's margin is large enough (proofs: a minute)."


def fit(
    scene: Scene,
    file: Annotated[Path, typer.Argument(metavar="FILE.csv", help=HELP_FILE)],
    error: Annotated[str | None, option("--error", "E", HELP_ERROR)] = None,
    out: Annotated[Path | None, option("--out -o", "DIR", HELP_OUT)] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
    no_margin: Annotated[bool, typer.Option("--no-margin", help=HELP_NO_MARGIN)] = False,
) -> None:
    """Fit speed, centre of mass, surface height and radius of gyration to filmed throws.

    Exit 1 where the goal is not proved for every machine that the film leaves possible, with its scatter.
    """
    with progress() as tell:
        chosen, _ = opened(scene, out)
        from limitsets.fitting import enough
        from limitsets.fitting import fit as run

        found = run(chosen, file, error=None if error is None else number(error), progress=tell)
        judged = None if no_margin or chosen.goal is None else enough(found, progress=tell)
        record = found.to_json() | {"enough": None if judged is None else judged.to_json()}
        files = _write(found, record, out, form) if out is not None else []
    answer(record, json, lambda: _text(found, judged, files), csv=(csv, found.table))
    raise typer.Exit(0 if judged is None or judged.verdict == "enough" else 1)


def _write(found: Fit, record: dict[str, Any], out: Path, form: str) -> list[Path]:
    from limitsets.files import as_json
    from limitsets.plot.parts import part
    from limitsets.plot.residuals import fit_residuals
    from limitsets.report.writing import laid
    from limitsets.scene import dump

    texts = {"fitted.toml": dump(found.scene), "fit.json": as_json(record)}
    drawn = [("part", part(found.scene)), ("residuals", fit_residuals(found))]
    return laid(out, drawn, lambda _: texts, form)


def _text(found: Fit, judged: Enough | None, files: list[Path]) -> None:
    from limitsets.report.fits import lines_of

    show(found.table())
    for line in lines_of(found):
        typer.echo(line)
    for line in judged.sentences if judged is not None else ():
        typer.echo(line)
    if files:
        typer.echo(f"written to {files[0].parent}: {', '.join(path.name for path in files)}")
