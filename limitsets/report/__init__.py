"""An analysis as files: a page of Markdown, JSON, and pictures.

The page is for someone who builds a feeder: what comes to rest where, how far the answer can be trusted, and what was
assumed.  Numbers are read from the analysis, never computed anew here.
"""

from limitsets.report.page import page
from limitsets.report.write import write

__all__ = ["page", "write"]
