"""A server for the page: on this machine alone, unless another address and who may come are named."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable, Sequence
from typing import Any

import panel as pn
from tornado.websocket import WebSocketClosedError

from limitsets.errors import LimitsetsError

HERE = "127.0.0.1"

MOST_SENT = 1 << 20
"""Bytes of one message of a visitor."""


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

    What the other arguments are says `limitsets.explorer.visits.Explorer.show`.

    Parameters
    ----------
    page : callable
        Makes the page of one visitor.
    title : str
        What is shown.

    Raises
    ------
    LimitsetsError
        The port is taken, or nobody is allowed to come.
    """
    here = address in (HERE, "localhost")
    if not here and not origins:
        allowed = "named for any address but 127.0.0.1"
        raise LimitsetsError(
            "the allowed origins",
            "missing",
            allowed,
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
        verbose=False,  # `ready` says where it listens
        websocket_max_message_size=MOST_SENT,
    )
    logging.getLogger("bokeh").setLevel(logging.ERROR)  # a visitor who leaves is no warning
    server.io_loop.asyncio_loop.set_exception_handler(_gone)
    server.start()
    ready(f"http://{address}:{chosen}")
    if show:
        server.io_loop.add_callback(server.show, "/")
    server.io_loop.start()


def _gone(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Pass over what could not be sent any more because a visitor has left."""
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
