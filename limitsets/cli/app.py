"""The commands and the options they share."""

from __future__ import annotations

from typing import Annotated

import typer

from limitsets.cli.analyse import analyse
from limitsets.cli.animate import animate
from limitsets.cli.assemble import assemble
from limitsets.cli.atlas import atlas
from limitsets.cli.audit import audit
from limitsets.cli.certify import certify
from limitsets.cli.check import check
from limitsets.cli.design import design
from limitsets.cli.doctor import doctor
from limitsets.cli.explore import explore
from limitsets.cli.feed import feed
from limitsets.cli.feedback import feedback
from limitsets.cli.fit import fit
from limitsets.cli.margin import margin
from limitsets.cli.new import new
from limitsets.cli.plot import plot
from limitsets.cli.recheck import recheck
from limitsets.cli.robustness import robustness
from limitsets.cli.scenes import scenes
from limitsets.cli.throw import throw
from limitsets.cli.tray import tray

app = typer.Typer(
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
)


def _version(wanted: bool) -> None:
    if wanted:
        from limitsets import __version__

        typer.echo(f"limitsets {__version__}")
        raise typer.Exit


@app.callback()
def limitsets(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    """Where do the throws lead?  Limit sets, attractors and basins of a throw-and-catch parts feeder.

    SCENE is the name of a built-in scene or the path of a TOML file.
    """


for command in (
    scenes,
    analyse,
    throw,
    plot,
    animate,
    certify,
    recheck,
    audit,
    margin,
    robustness,
    design,
    atlas,
    feed,
    feedback,
    assemble,
    fit,
    tray,
    new,
    check,
    doctor,
    explore,
):
    # click would cut the summary where a line ends
    app.command(short_help=(command.__doc__ or "").partition("\n")[0])(command)
