"""An analysis as files: a page of Markdown, JSON, and pictures.

The reader of the page builds a feeder: places and sides of rest, reliability of the answer, and
assumptions.  Numbers are read from the analysis, never computed anew here.
"""

from limitsets.report.audit_pages import audit_page, write_audit
from limitsets.report.pages import page
from limitsets.report.robust_files import write_robustness
from limitsets.report.robust_pages import robustness_page
from limitsets.report.writing import write

__all__ = ["audit_page", "page", "robustness_page", "write", "write_audit", "write_robustness"]
