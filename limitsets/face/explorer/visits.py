"""Visitors, with a page each in a browser or a notebook, and the server on this machine."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import panel as pn
from jinja2 import Template
from panel.io.callbacks import PeriodicCallback
from tornado.websocket import WebSocketClosedError

from limitsets.base import AnswerError, LimitsetsError, MapError, Progress, bar, in_notebook
from limitsets.face.explorer.canvas import PAGE, Canvas
from limitsets.face.explorer.page import MapPage, ScenePage
from limitsets.face.explorer.work import within_reach
from limitsets.feeder.scene import Scene, load
from limitsets.systems.cells import as_domain
from limitsets.systems.maps import coerce, domain_of
from limitsets.systems.maps.contract import compiled_kind_of, require_dimension

# ----------------------------------------------------------------
# A server for the page: on this machine alone, unless another address and its allowed visitors are given.


HERE = "127.0.0.1"

MOST_SENT = 1 << 20
"""Largest size of a message of a visitor [bytes]."""


def serve(
    page: Callable[[], Any],
    title: str,
    *,
    address: str,
    port: int,
    origins: Sequence[str],
    show: bool,
    ready: Callable[[str], None],
) -> None:
    """Serve the page until Ctrl-C; all that a browser asks for comes from this server.

    The other arguments are those of `limitsets.face.explorer.visits.Explorer.show`.

    Parameters
    ----------
    page : callable
        Makes the page of one visitor.
    title : str
        What is shown.

    Raises
    ------
    LimitsetsError
        The port is taken, or no visitor is allowed.
    """
    here = address in (HERE, "localhost")
    if not here and not origins:
        raise LimitsetsError(
            "the allowed origins",
            "missing",
            "named for any address but 127.0.0.1",
            "pass --allow-origin HOST:PORT, as it stands in the browser",
        )
    chosen = _free_port(address, port)
    names = [f"{HERE}:{chosen}", f"localhost:{chosen}"] if here else []
    server = pn.serve(
        page,
        port=chosen,
        address=address,
        websocket_origin=[*names, *origins],
        show=False,
        start=False,
        title=f"limitsets: {title}",
        verbose=False,  # `ready` prints the address
        websocket_max_message_size=MOST_SENT,
    )
    logging.getLogger("bokeh").setLevel(logging.ERROR)  # a visitor who leaves is no cause for a warning
    server.io_loop.asyncio_loop.set_exception_handler(_gone)
    server.start()
    ready(f"http://{address}:{chosen}")
    if show:
        server.io_loop.add_callback(server.show, "/")
    server.io_loop.start()


def _gone(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Ignore messages that could not be sent because a visitor has left."""
    if not isinstance(context.get("exception"), WebSocketClosedError):
        loop.default_exception_handler(context)


def _free_port(address: str, port: int) -> int:
    try:
        with socket.socket(socket.AF_INET6 if ":" in address else socket.AF_INET) as listening:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listening.bind((address, port))
            return int(listening.getsockname()[1])
    except OSError as error:
        raise LimitsetsError(
            "the address", f"{address}:{port}", "one that is free", f"{error.strerror}; pass --port 0 for any"
        ) from None


# ----------------------------------------------------------------
# Visitors: each has a separate page, in a browser or in a notebook, and a beat that moves it.


COMPILING = "compiling, once: the throw, images of cells, attractors"
"""Short enough for the bar of a narrow terminal."""

BEAT = 15
"""Milliseconds from one beat to the next: a slider waits for half of them, and a page at rest costs 3 % of a core."""


def _say(address: str) -> None:
    print(f"explorer: {address} (Ctrl-C ends it)", flush=True)


class Explorer(pn.viewable.Viewer):  # type: ignore[misc]  # panel is not followed
    """A scene or a map to look at: every visitor gets a separate page.

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
        compiled_kind_of(params, "the explorer")
        chosen = coerce(params)
        try:
            where = as_domain(domain_of(chosen) if domain is None else domain)
        except MapError:
            name = f"the domain of {type(chosen).__name__}"
            raise AnswerError(name, domain, "one (lo, hi) per axis", "pass domain=[(lo, hi), ...]") from None
        require_dimension(chosen, "domain", where.dimension)
        where.require_ends("the domain of the explorer")
        return cls(lambda: MapPage(chosen, where), type(chosen).__name__)

    def __repr__(self) -> str:
        """Say how to look at it."""
        return f"<explorer of {self.title}: .show() serves it, a notebook shows it>"

    def __panel__(self) -> pn.viewable.Viewable:
        """Make the page of one visitor, and let it beat until the visitor leaves."""
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
        """Show the page in a notebook; load Panel first if needed, with scripts that come from no other server."""
        if not in_notebook():
            return None
        if not pn.extension._loaded:  # noqa: SLF001 - Panel gives this nowhere else
            pn.extension(inline=True)
        self._compile()
        return super()._repr_mimebundle_(include, exclude)

    def prepare(self, progress: Progress) -> None:
        """Make one page, so that all kernels are compiled before the first visitor comes."""
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
            The address of the server: by default reachable from this machine alone.
        port : int
            The port; 0 for any free port.
        origins : sequence of str
            Names, with ports, by which browsers may address the server: needed for any other address.
        show : bool
            Whether to open a browser.
        ready : callable
            Called with the page's address once the server listens; prints it by default.

        Raises
        ------
        LimitsetsError
            The port is taken, or no visitor is allowed.
        """
        self._compile()
        serve(self.__panel__, self.title, address=address, port=port, origins=origins, show=show, ready=ready)


def _beating(beat: Callable[[], None]) -> None:
    """Beat in the background, without Panel's sign that the server is busy."""
    PeriodicCallback(callback=beat, period=BEAT, background=True).start()


class _UnderACell(pn.Column):  # type: ignore[misc]  # panel is not followed
    """A page in a notebook, which beats once its pictures are on a screen.

    Messages before that would put Panel's messages out of step for good.
    """

    def __init__(self, page: ScenePage | MapPage) -> None:
        super().__init__(page.layout, sizing_mode="stretch_width")
        self._page, self._loop = page, asyncio.get_running_loop()
        _beating(self._beat)

    def _on_msg(self, *message: Any) -> None:
        """Take a message of the browser in the thread of the page's beat; JupyterLab delivers it in another thread."""
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
    from limitsets.face.explorer.work import table_of
    from limitsets.parameters.atlas.parameter_atlas import opened

    if not (store / "zarr.json").is_file():
        raise LimitsetsError("the atlas", str(store), "a folder that limitsets atlas wrote", "name its store")
    data = opened(str(store))
    if "scene" not in data.attrs.get("plan", {}):
        raise LimitsetsError("the atlas", str(store), "one of a scene", "explore the map itself")
    return load(data.attrs["plan"]["scene"]), table_of(data)
