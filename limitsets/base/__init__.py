"""What every room may use: errors, checks of arguments, files, progress, tables, and runs of many trials.

The commands' help loads this face; `arrays` and `campaign`, which take longer to load, stand beside it.
"""

from limitsets.base.arguments import arguments_checked, arguments_checked_as
from limitsets.base.errors import (
    LONGEST,
    AnswerError,
    DataError,
    GeometryError,
    GridError,
    LimitsetsError,
    MapError,
    SceneError,
    TipsError,
    shown,
)
from limitsets.base.files import as_json, as_plain, as_table, code_digest, locked, picked, replaced
from limitsets.base.progress import (
    GOES_ON,
    InterruptedRun,
    Progress,
    added_up,
    bar,
    in_notebook,
    one_by_one,
    shown_in_notebooks,
    silent,
)
from limitsets.base.proposals import proposed
from limitsets.base.tables import (
    BETWEEN,
    Column,
    Table,
    Tabled,
    aligned,
    bands_of,
    facts,
    how_found,
    joined,
    rounded,
)

__all__ = [
    "BETWEEN",
    "GOES_ON",
    "LONGEST",
    "AnswerError",
    "Column",
    "DataError",
    "GeometryError",
    "GridError",
    "InterruptedRun",
    "LimitsetsError",
    "MapError",
    "Progress",
    "SceneError",
    "Table",
    "Tabled",
    "TipsError",
    "added_up",
    "aligned",
    "arguments_checked",
    "arguments_checked_as",
    "as_json",
    "as_plain",
    "as_table",
    "bands_of",
    "bar",
    "code_digest",
    "facts",
    "how_found",
    "in_notebook",
    "joined",
    "locked",
    "one_by_one",
    "picked",
    "proposed",
    "replaced",
    "rounded",
    "shown",
    "shown_in_notebooks",
    "silent",
]
