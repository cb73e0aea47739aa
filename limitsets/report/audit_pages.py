"""An audit in words: the lines of its table, a page, and its files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from limitsets import plot
from limitsets.files import as_json
from limitsets.report.pages import words
from limitsets.report.tables import percent
from limitsets.report.writing import laid

if TYPE_CHECKING:
    from limitsets.auditing import Audit, Finding

HEADS = ("effect", "assumed", "on the limit set", "worst there", "on the whole arm")


def _measured(finding: Finding, value: float | None, unit: str) -> str:
    if value is None:
        return "-"
    if finding.about.dimension == "angle":
        return f"{math.degrees(value):.1f} deg"
    return f"{value:.3g} {unit}" if finding.about.dimension == "length" else f"{value:.3g}"


def _share(finding: Finding) -> str:
    """Say which of the throws on the limit set are concerned."""
    parts = []
    kinds = (("jog", finding.jogs), ("flip", finding.flips), ("roll", finding.others))
    for name, (hit, of) in kinds:
        if hit:
            parts.append(f"every {name}" if hit == of else f"{percent(hit / of)} of {name}s")
    return " and ".join(parts)


def _verdict(finding: Finding) -> str:
    if finding.called_for is None:
        return f"cannot tell: {finding.missing}?" if finding.missing else "cannot tell: no throw known"
    if not finding.called_for:
        return f"holds ({finding.how})"
    if finding.place == "limit-set":
        return f"BREAKS: {_share(finding)}"
    return f"breaks on side {', '.join(map(str, finding.ranges))}"


def _worst(finding: Finding, unit: str) -> str:
    """Say what was found where it is worst; without a fact, which value of it would matter."""
    if finding.x is None:
        return "-"
    place = f"side {finding.side}, x = {finding.x:.2f}"
    if finding.worst is None:
        return f"no friction is enough ({place})"
    if finding.missing:
        return f"{_needed(finding, unit)} ({place})"
    value = _measured(finding, finding.worst, unit)
    if finding.threshold is None:
        return f"{value} ({place})"
    sign = "at most" if finding.about.below else "at least"
    return f"{value}, {sign} {_measured(finding, finding.threshold, unit)} ({place})"


def _needed(finding: Finding, unit: str) -> str:
    at = finding.threshold
    if finding.missing == "friction":
        return f"needs {finding.worst:.3g}"
    if at is None:
        fall = finding.missing == "restitution"
        return f"falls from {_measured(finding, finding.worst, unit)}" if fall else "never matters"
    if finding.missing == "stroke":
        return f"matters from {math.degrees(at):.2g} deg"
    if finding.missing == "scatter":
        return f"matters from {100 * at:.2g} % of the speed"
    return f"matters {'below' if finding.missing == 'bounce_threshold' else 'from'} {at:.2g}"


def lines_of(found: Audit) -> list[list[str]]:
    """Give the table, one line per assumption; columns as in `HEADS`."""
    unit = found.scene.unit
    return [
        [
            f"{here.effect} (on)" if here.simulated else here.effect,
            here.about.name,
            _verdict(here),
            _worst(here, unit),
            _verdict(everywhere),
        ]
        for here, everywhere in zip(found.on("limit-set"), found.on("domain"), strict=True)
    ]


def summary(found: Audit) -> list[str]:
    """Say in a few sentences what the scene calls for."""
    return words("audit_summary", found=found).split("\n\n")


def audit_page(found: Audit, figures: Mapping[str, str] | None = None) -> str:
    """Write the page.

    Parameters
    ----------
    found : Audit
        From `limitsets.audit`.
    figures : mapping of str to str, optional
        File names of the pictures by kind: "part", "audit".

    Returns
    -------
    str
        Markdown.

    Examples
    --------
    >>> import limitsets as ls
    >>> audit_page(ls.audit("paper-designed")).splitlines()[0]
    '# paper-designed: what the model leaves out'
    """
    told = {"summary": summary(found), "heads": HEADS, "rows": lines_of(found)}
    return words("audit", figures or {}, found=found, **told) + "\n"


def write_audit(found: Audit, folder: str | Path, form: str = "png") -> list[Path]:
    """Write audit.md, audit.json and the figures into a folder, all of them or none.

    Raises
    ------
    LimitsetsError
        The folder cannot be written.
    """
    return laid(
        folder,
        [("part", plot.part(found.scene)), ("audit", plot.audit(found))],
        lambda figures: {"audit.md": audit_page(found, figures), "audit.json": as_json(found)},
        form,
    )
