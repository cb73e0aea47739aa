"""The pages: an answer in the words of someone who builds a feeder.

The words stand in `templates`.  A paragraph there may be broken into lines as its sentences come: it is one line in the
page, and one whose sentences are all left out is none.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from limitsets.analysis import in_limit_sets
from limitsets.goals import order_of
from limitsets.proposals import proposed
from limitsets.report.goals import goal_sentence, next_command, verdict_of, void_of
from limitsets.report.tables import bands, count, intervals, percent, table

if TYPE_CHECKING:
    from jinja2 import Environment

    from limitsets.analysis import Analysis

# Blocks of these signs keep their lines: headings, tables, lists, commands.
LINES = ("#", "|", "* ", "    ")


@cache
def environment() -> Environment:
    """Give the templates, with what they call."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    found = Environment(
        loader=PackageLoader("limitsets.report"),
        trim_blocks=True,
        undefined=StrictUndefined,
        autoescape=False,  # Markdown, no HTML
    )
    found.filters |= {
        "bands": bands,
        "count_of": lambda pair: count(*pair),
        "degrees": math.degrees,
        "f": format,
        "first_up": lambda text: text[:1].upper() + text[1:],
        "intervals": intervals,
        "percent": percent,
    }
    found.globals |= {
        "next_command": next_command,
        "order_of": order_of,
        "proposed": proposed,
        "question_of": goal_sentence,
        "table": table,
        "verdict_of": verdict_of,
        "void_of": void_of,
    }
    return found


def words(template: str, figures: Mapping[str, str] | None = None, **answers: Any) -> str:
    """Fill in a template of `templates`: paragraphs with an empty line between, without a break at the end.

    Parameters
    ----------
    template : str
        Its name, without endings.
    figures : mapping of str to str, optional
        File names of the pictures by kind; a picture that is not there is left out.
    **answers
        What the template speaks of.
    """

    def figure(kind: str, caption: str) -> str:
        if not figures or kind not in figures:
            return ""
        link = f"[{caption}]({figures[kind]})"
        return link if figures[kind].endswith(".pdf") else f"!{link}"  # no page shows PDF in its text

    text = environment().get_template(f"{template}.md.j2").render(figure=figure, **answers)
    blocks = [block.strip("\n") for block in re.split(r"\n\s*\n", text)]
    return "\n\n".join(
        block if block.startswith(LINES) else re.sub(r"\s*\n\s*", " ", block) for block in blocks if block
    )


def page(analysis: Analysis, figures: Mapping[str, str]) -> str:
    """Write the report.

    Parameters
    ----------
    analysis : Analysis
        From `limitsets.analyse`.
    figures : mapping of str to str
        File names of the pictures by kind: "part", "limit-set", "map", "basins", "morse", "flight".

    Returns
    -------
    str
        Markdown.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.report.pages import page
    >>> page(ls.analyse("paper-designed"), {}).splitlines()[0]
    '# paper-designed: where the throws lead'
    """
    from limitsets.thrower.effects import EFFECTS  # lazily: it loads numba

    effects = analysis.scene.effects
    assumed = [each.lifts for name, each in EFFECTS.items() if name not in effects.words]
    # of the throw; no effect lifts this
    assumed.insert(0 if effects.drive else 1, "it does not tip the part")
    broken = in_limit_sets(analysis.other_vertex_first, analysis.extents)
    return words("report", figures, analysis=analysis, broken=broken, assumed=assumed) + "\n"
