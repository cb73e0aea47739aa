"""An analysis as files: a page of Markdown, JSON, and pictures.

The reader of the page builds a feeder: places and sides of rest, reliability of the answer, and
assumptions.  Numbers are read from the analysis, never computed anew here.

A file is imported at its first use, so that the commands' help loads none.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from limitsets.face.report import (
        machine_page as machine_page,
        pages as pages,
        robust_pages as robust_pages,
        writing as writing,
    )
else:

    def __getattr__(name: str) -> Any:
        if name not in ("machine_page", "pages", "robust_pages", "writing"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return import_module(f"{__name__}.{name}")
