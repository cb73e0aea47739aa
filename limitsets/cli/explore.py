"""`limitsets explore`: a page in the browser where sliders move a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from limitsets.cli.output import option, progress

FIRST = "paper-designed"
HELP_ADDRESS = "Where the page listens; any other than 127.0.0.1 needs --allow-origin."
HELP_ORIGIN = "A name with its port under which browsers may ask for the page."
HELP_ATLAS = "The store of an atlas of the scene, shown beside it; without SCENE its scene is opened."


def explore(
    scene: Annotated[
        str | None,
        typer.Argument(metavar="[SCENE]", help=f"A built-in name or a TOML file; {FIRST} by default."),
    ] = None,
    atlas: Annotated[Path | None, option("--atlas", "STORE", HELP_ATLAS)] = None,
    port: Annotated[int, option("--port", "N", "0 for any that is free.", min=0, max=65535)] = 5006,
    address: Annotated[str, option("--address", "HOST", HELP_ADDRESS)] = "127.0.0.1",
    allow_origin: Annotated[list[str] | None, option("--allow-origin", "HOST:PORT", HELP_ORIGIN)] = None,
    no_show: Annotated[bool, typer.Option("--no-show", help="Do not open a browser.")] = False,
) -> None:
    """Open a page where sliders move a scene, and its limit sets, basins and goal follow."""
    from limitsets.explorer import explore as open_page
    from limitsets.explorer.exploring import required

    required()
    from limitsets.explorer.visits import stored_atlas

    with progress() as tell:
        chosen = scene if scene is not None else FIRST if atlas is None else stored_atlas(atlas)[0]
        explorer = open_page(chosen, atlas=atlas)
        explorer.prepare(tell)
    explorer.show(
        address=address,
        port=port,
        origins=allow_origin or (),
        show=not no_show,
    )
