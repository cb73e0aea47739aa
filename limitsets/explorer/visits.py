"""Visitors: each has a page of his own, in a browser or in a notebook, and a beat that moves it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import panel as pn
from jinja2 import Template
from panel.io.callbacks import PeriodicCallback

from limitsets.cells import as_domain
from limitsets.errors import AnswerError, LimitsetsError, MapError
from limitsets.explorer.look import PAGE
from limitsets.explorer.map_page import MapPage
from limitsets.explorer.outside import within_reach
from limitsets.explorer.page import ScenePage
from limitsets.explorer.serving import serve
from limitsets.maps import coerce, domain_of, kind_of
from limitsets.maps.contract import require_dimension
from limitsets.progress import Progress, bar
from limitsets.scene import Scene, load

__all__ = ["Explorer", "stored_atlas"]

COMPILING = "compiling, once: the throw, images of cells, attractors"
"""Short enough for the bar of a narrow terminal."""

BEAT = 30
"""Milliseconds from one beat to the next."""


class Explorer(pn.viewable.Viewer):  # type: ignore[misc]  # panel is not followed
    """A scene or a map that can be looked at: whoever looks gets a page of his own.

    Attributes
    ----------
    page : callable
        Makes a new page without showing it: `ScenePage` or `MapPage`.
    title : str
        What it is called.
    """

    def __init__(self, page: Callable[[], ScenePage | MapPage], title: str) -> None:
        super().__init__()
        self.page, self.title, self._prepared = page, title, False

    @classmethod
    def of_scene(cls, scene: Scene, atlas: Path | None) -> Explorer:
        """Look at a scene."""
        within_reach(scene)
        table = None if atlas is None else stored_atlas(atlas)[1]
        return cls(lambda: ScenePage(scene, table), scene.name)

    @classmethod
    def of_map(cls, params: Any, domain: Any) -> Explorer:
        """Look at a map."""
        kind_of(params)
        chosen = coerce(params)
        try:
            where = as_domain(domain_of(chosen) if domain is None else domain)
        except MapError:
            name = f"the domain of {type(chosen).__name__}"
            raise AnswerError(name, domain, "one (lo, hi) per axis", "pass domain=[(lo, hi), ...]") from None
        require_dimension(chosen, "domain", where.dimension)
        return cls(lambda: MapPage(chosen, where), type(chosen).__name__)

    def __panel__(self) -> pn.viewable.Viewable:
        """Make the page of one visitor, and let it beat as long as he stays."""
        page = self.page()
        document = pn.state.curdoc
        if document is not None and document.session_context is not None:
            document.template = Template(PAGE)
            # in the background: nobody is told that the server is busy, at each beat
            PeriodicCallback(callback=page.beat, period=BEAT, background=True).start()
            pn.state.on_session_destroyed(lambda _: page.close())
        elif _in_a_loop():  # a notebook
            pn.state.add_periodic_callback(page.beat, BEAT)
        return page.layout

    def prepare(self, progress: Progress) -> None:
        """Make one page, so that what is not compiled yet is compiled before a visitor waits for it."""
        progress(COMPILING, 0, 1)
        self.page().close()
        self._prepared = True

    def show(self, **options: Any) -> None:
        """Serve it until Ctrl-C; options of `limitsets.explorer.serving.serve`: port, address, origins, show."""
        if not self._prepared:
            with bar() as progress:
                self.prepare(progress)
        serve(self.__panel__, self.title, **options)


def _in_a_loop() -> bool:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def stored_atlas(store: Path) -> tuple[Scene, dict[str, Any]]:
    """Read a stored atlas: its scene, and its classes as plain lists.

    Raises
    ------
    LimitsetsError
        There is none, or one of a map.
    """
    from limitsets.explorer.work import table_of
    from limitsets.sweep.parameter_atlas import opened

    if not (store / "zarr.json").is_file():
        raise LimitsetsError("the atlas", str(store), "a folder that limitsets atlas wrote", "name its store")
    data = opened(str(store))
    if "scene" not in data.attrs.get("plan", {}):
        raise LimitsetsError("the atlas", str(store), "one of a scene", "explore the map itself")
    return load(data.attrs["plan"]["scene"]), table_of(data)
