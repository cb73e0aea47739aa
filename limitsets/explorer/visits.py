"""Visitors: each has a page of his own, in a browser or in a notebook, and a beat that moves it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import panel as pn
from jinja2 import Template
from panel.io.callbacks import PeriodicCallback

from limitsets.cells import as_domain
from limitsets.errors import AnswerError, LimitsetsError, MapError
from limitsets.explorer.canvas import Canvas
from limitsets.explorer.look import PAGE
from limitsets.explorer.map_page import MapPage
from limitsets.explorer.outside import within_reach
from limitsets.explorer.page import ScenePage
from limitsets.explorer.serving import HERE, serve
from limitsets.maps import coerce, domain_of, kind_of
from limitsets.maps.contract import require_dimension
from limitsets.progress import Progress, bar, in_notebook
from limitsets.scene import Scene, load

COMPILING = "compiling, once: the throw, images of cells, attractors"
"""Short enough for the bar of a narrow terminal."""

BEAT = 15
"""Milliseconds from one beat to the next: a slider waits for half of them, and a page at rest costs 3 % of a core."""


def _say(address: str) -> None:
    print(f"explorer: {address} (Ctrl-C ends it)", flush=True)


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

    def __repr__(self) -> str:
        """Say how it is looked at."""
        return f"<explorer of {self.title}: .show() serves it, a notebook shows it>"

    def __panel__(self) -> pn.viewable.Viewable:
        """Make the page of one visitor, and let it beat as long as he stays."""
        page = self.page()
        document = pn.state.curdoc
        if document is not None and document.session_context is not None:
            document.template = Template(PAGE)
            _beating(page.beat)
            pn.state.on_session_destroyed(lambda _: page.close())
        elif in_notebook():
            return _UnderACell(page)
        return page.layout

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> Any:
        """Show it in a notebook, where Panel is not loaded yet with scripts that come from no other server."""
        if not in_notebook():
            return None
        if not pn.extension._loaded:  # noqa: SLF001 - Panel says it nowhere else
            pn.extension(inline=True)
        self._compile()
        return super()._repr_mimebundle_(include, exclude)

    def prepare(self, progress: Progress) -> None:
        """Make one page, so that what is not compiled yet is compiled before a visitor waits for it."""
        progress(COMPILING, 0, 1)
        self.page().close()
        self._prepared = True

    def _compile(self) -> None:
        if not self._prepared:
            with bar() as progress:
                self.prepare(progress)

    def show(
        self,
        *,
        address: str = HERE,
        port: int = 5006,
        origins: Sequence[str] = (),
        show: bool = True,
        ready: Callable[[str], None] = _say,
    ) -> None:
        """Serve it until Ctrl-C.

        Parameters
        ----------
        address : str
            Where it listens: by default for this machine alone.
        port : int
            0 for any that is free.
        origins : sequence of str
            Names, with ports, under which browsers may ask: needed for any other address.
        show : bool
            Whether to open a browser.
        ready : callable
            Told the page's address once it listens; prints it by default.

        Raises
        ------
        LimitsetsError
            The port is taken, or nobody is allowed to come.
        """
        self._compile()
        serve(self.__panel__, self.title, address=address, port=port, origins=origins, show=show, ready=ready)


def _beating(beat: Callable[[], None]) -> None:
    """Beat, in the background: nobody is told that the server is busy, at each beat."""
    PeriodicCallback(callback=beat, period=BEAT, background=True).start()


class _UnderACell(pn.Column):  # type: ignore[misc]  # panel is not followed
    """A page in a notebook, which beats once its pictures are on a screen.

    News that come before would put Panel's messages out of step for good.
    """

    def __init__(self, page: ScenePage | MapPage) -> None:
        super().__init__(page.layout, sizing_mode="stretch_width")
        self._page, self._loop = page, asyncio.get_running_loop()
        _beating(self._beat)

    def _on_msg(self, *message: Any) -> None:
        """Take what the browser says where the page beats; JupyterLab hands it over in a thread of its own."""
        self._loop.call_soon_threadsafe(super()._on_msg, *message)

    def _beat(self) -> None:
        if any(picture.seen for picture in self.select(Canvas)):
            self._page.beat()


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
