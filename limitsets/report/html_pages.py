"""A page as one file of HTML that stands alone: the Markdown of the report, with its figures inside."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from typing import TYPE_CHECKING

from limitsets.report.pages import environment

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def as_uri(figure: Figure) -> str:
    """Write a figure as SVG into a `data:` address."""
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(stream.getvalue()).decode("ascii")


def as_html(text: str, images: Mapping[str, str]) -> str:
    """Write a page of Markdown as HTML.

    Parameters
    ----------
    text : str
        The page, which begins with its title.
    images : mapping of str to str
        Addresses of its figures, by their names in the page.

    Examples
    --------
    >>> "<h1>Throws &amp; flips</h1>" in as_html("# Throws & flips", {})
    True
    """
    from markdown_it import MarkdownIt  # lazily: only this page needs it

    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    blocks = reader.parse(text)
    for image in (each for block in blocks for each in block.children or () if each.type == "image"):
        source = str(image.attrs["src"])
        image.attrs["src"] = images.get(source, source)
    body = reader.renderer.render(blocks, reader.options, {})
    title = text.split("\n", 1)[0].lstrip("# ")
    return environment().get_template("page.html.j2").render(title=title, body=body) + "\n"
