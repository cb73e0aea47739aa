"""The page "will it work on my machine?": the minimal model and the model with effects side by side, alarms first."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from limitsets.base import as_json
from limitsets.face import plot
from limitsets.face.report.pages import percent, words
from limitsets.face.report.writing import laid
from limitsets.parameters.discrepancy import Discrepancy
from limitsets.parameters.discrepancy.measuring import SETTLED, WATCHED, Arrivals
from limitsets.parameters.discrepancy.model_discrepancy import STARTS
from limitsets.parameters.margins.margin_result import bound


def alarms_of(compared: Discrepancy) -> list[str]:
    """Say what speaks against the machine, or is not known.

    Examples
    --------
    >>> import limitsets as ls
    >>> text = ls.load("paper-designed").as_dict() | {"world": {"friction": 1.3}}
    >>> alarms_of(ls.discrepancy(text, ["slip"]))[0]
    'no: with these effects 72.4 % of the starts arrive, without them 100 %'
    """
    lines = []
    if compared.effects and compared.arrive["effects"].share < compared.arrive["minimal"].share:
        with_them, without = (percent(compared.arrive[name].share) for name in ("effects", "minimal"))
        lines.append(f"no: with these effects {with_them} of the starts arrive, without them {without}")
    if compared.effects and "limit-set" not in compared.covered:
        lines.append("what is proved of the minimal model does not cover these effects")
    elif compared.effects and "starts" not in compared.covered:
        lines.append("the limit set is covered; starts elsewhere on the arm are not")
    if any(row is not None and row.throws for row in map(compared.row, compared.covered)):
        lines.append("the effects are covered by samples, which prove nothing")
    if compared.enough is False and compared.margin is not None:
        proved = bound(compared.margin.proved, compared.margin.unit)
        lines.append(f"landings are moved farther than the goal is proved to survive, {proved}")
    if compared.left_out:
        lines.append(f"not simulated: {', '.join(compared.left_out)} (reasons below)")
    return lines


def machine_page(compared: Discrepancy, figures: Mapping[str, str] | None = None) -> str:
    """Write the page.

    Parameters
    ----------
    compared : Discrepancy
        From `limitsets.discrepancy`.
    figures : mapping of str to str, optional
        File names of the pictures by kind: "discrepancy".

    Returns
    -------
    str
        Markdown.
    """
    unit, rate = compared.scene.unit, compared.scene.world.throw_rate
    names = {"minimal": "minimal model (hinge, no rebound)", "effects": f"with {', '.join(compared.effects)}"}
    columns = [(names[each], compared.arrive[each]) for each in names if each in compared.arrive]
    survives = "-" if compared.margin is None else bound(compared.margin.proved, compared.margin.unit)
    rows: list[list[str]] = [
        ["starts that arrive (simulated)", *(percent(each.share) for _, each in columns)],
        ["throws until a part is there (simulated)", *(_number(each.throws) for _, each in columns)],
        ["parts per minute", *(_per_minute(each, rate) for _, each in columns)],
        ["the goal survives, of landing.x at every throw (proved)", survives, *("-" for _ in columns[1:])],
    ]
    places = (
        "place",
        "of the arm",
        "how",
        f"moved by [{unit}]",
        "another side",
        "nothing known",
        f"covered to [{unit}]",
    )
    moved = [
        (
            each.place,
            percent(each.share),
            f"sampled, {each.throws} throws" if each.throws else each.how,
            f"{each.lo:.4g} to {each.hi:.4g}" if each.lo <= each.hi else "-",
            percent(each.changed),
            percent(each.unknown),
            _number(compared.covered.get(each.place)),
        )
        for each in compared.rows
    ]
    told = {
        "compared": compared,
        "lines": alarms_of(compared),
        "heads": ["", *(name for name, _ in columns)],
        "rows": rows if columns else [],
        "places": places,
        "moved": moved,
        "starts": STARTS,
        "settled": SETTLED,
        "watched": WATCHED,
    }
    return words("machine", figures, **told) + "\n"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _per_minute(arrivals: Arrivals, rate: float | None) -> str:
    """Write how many parts a minute arrive, one after the other: a share of them after so many throws each."""
    if rate is None:
        return "give throw_rate in [world]"
    return "0" if arrivals.throws is None else f"{60.0 * rate * arrivals.share / arrivals.throws:.3g}"


def write_machine(
    compared: Discrepancy, folder: str | Path, form: str = "png", *, html: bool = False
) -> list[Path]:
    """Write report.md, discrepancy.json and the figure into a folder, all of them or none."""
    drawn = [("discrepancy", plot.discrepancy(compared))] if compared.effects else []
    return laid(
        folder,
        drawn,
        lambda figures: {"report.md": machine_page(compared, figures), "discrepancy.json": as_json(compared)},
        form,
        html=html,
    )
