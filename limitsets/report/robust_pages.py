"""The sheet of tolerances as a page: the answer first, then what limits it, all together, and where X is best."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from limitsets.goals import Goal, OrientedBeyond, Reaches
from limitsets.report.background import figure_line, scene_of
from limitsets.report.questions import question_of
from limitsets.report.robust_trust import called_for, checked_again, noise_of, trusted
from limitsets.report.tables import table
from limitsets.robust.margins.words import bound, void_of
from limitsets.robust.sheet.entries import Entry, in_unit_of, percent_of
from limitsets.scene.quantities import parsed_deviation

if TYPE_CHECKING:
    from limitsets.robust.margins.beyond import MarginsBeyond
    from limitsets.robust.sheet.summary import Robustness

__all__ = [
    "HEADS",
    "answer",
    "deviation_of",
    "lines_of",
    "robustness_page",
    "shown",
    "tightest",
    "violated_of",
]

HEADS = ("quantity", "value", "deviates", "proved safe up to", "shown to fail from", "in % of the value")
READINGS = {"fixed": "fixed, but unknown", "per-throw": "at every throw", "tolerance": "together"}

# States of an orbit that are written: the last of them.
LAST = 8


def robustness_page(found: Robustness, figures: Mapping[str, str]) -> str:
    """Write the page.

    Parameters
    ----------
    found : Robustness
        From `limitsets.robustness`.
    figures : mapping of str to str
        File names of the pictures by kind: "margins", "joint", "curve", "counterexample", and those of the noise.

    Returns
    -------
    str
        Markdown.
    """
    parts = [
        f"# {found.scene.name}: how far it may drift",
        answer(found),
        _margins(found, figures),
        _limits(found, figures),
        _joint(found, figures),
        _curve(found, figures),
        noise_of(found, figures),
        trusted(found),
        checked_again(found),
        scene_of(found.scene),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def answer(found: Robustness) -> str:
    """Say in a few sentences what was asked, whether it holds, and what has the least room."""
    goals = " and ".join(question_of(goal, found.scene.unit) for goal in found.goals)
    verdict = {
        "proved": "In the scene as it is this **holds, proved**.",
        "refuted": "In the scene as it is this **fails**: an orbit shows it. No deviation is small enough.",
        "undecided": "Of the scene as it is this is **neither proved nor refuted**, so no deviation is proved safe.",
    }[found.verdict]
    lines = [f"**Asked:** {goals}. {verdict}"]
    void = void_of(found.goals, found.reach, found.scene.unit)
    if void:
        lines.append(f"But it holds vacuously: {void}.")
    first = tightest(found)
    if first is not None and first.holds:
        by = ", for its tolerance" if _by_tolerance(found) else ""
        lines.append(f"Least room{by} is left to {_named(first)}: {_bracket(first)}.")
    joint = found.joint
    if joint is not None:
        lines.append(_met(joint))
    effects = called_for(found)
    if effects:
        lines.append(
            f"All of it is about the model's throws: on the limit set {', '.join(effects)} would act as well "
            "(`limitsets audit` says where)."
        )
    if found.curve is not None and found.verdict != "proved":
        lines.append(_best(found.curve))
    return " ".join(lines)


def _named(entry: Entry) -> str:
    return f"{entry.quantity} ({READINGS[entry.reading]})"


def _bracket(entry: Entry) -> str:
    low, high = bound(entry.proved, entry.unit), bound(entry.refuted, entry.unit, up=True)
    if entry.refuted is None:
        return f"proved safe up to {low}; no deviation is shown to fail"
    return f"proved safe up to {low}, shown to fail from {high} on"


def tightest(found: Robustness) -> Entry | None:
    """Return the margin that is smallest: against its tolerance where there are several, else against its value.

    A landing place has no value: it is compared with the shortest side.
    """
    if _by_tolerance(found):
        return min(found.singles, key=lambda entry: _room(entry, found))
    return min(found.singles, key=lambda entry: _share(entry, found), default=None)


def _by_tolerance(found: Robustness) -> bool:
    """Whether margins are compared by their tolerances: where two or more have one."""
    return sum(_room(entry, found)[0] == 0 for entry in found.singles) > 1


def _room(entry: Entry, found: Robustness) -> tuple[int, float]:
    text = found.tolerance.get(entry.quantity)
    # the landing place is noise in a tolerance, all else fixed but unknown
    if text is None or (entry.reading == "per-throw") != (entry.quantity == "landing.x"):
        return 1, math.inf
    given = parsed_deviation(text, entry.quantity)
    low = in_unit_of(entry, entry.proved, given.unit)
    return 0, math.inf if low is None else low / float(given.number)


def _share(entry: Entry, found: Robustness) -> float:
    share = percent_of(entry, entry.proved)
    if share is None:
        return 100.0 * entry.proved / float(found.scene.sides.length.min())
    return share


def lines_of(found: Robustness) -> list[list[str]]:
    """Give the table, one line per margin of a single quantity; columns as in `HEADS`."""
    rows = []
    for entry in found.singles:
        value = "-" if entry.nominal is None else f"{entry.nominal:.7g} {entry.nominal_unit}"
        low, high = (percent_of(entry, size) for size in (entry.proved, entry.refuted))
        share = "-" if low is None else f"{bound(low)} / {bound(high, up=True)}"
        rows.append(
            [
                entry.quantity,
                value,
                READINGS[entry.reading],
                bound(entry.proved, entry.unit),
                bound(entry.refuted, entry.unit, up=True),
                share,
            ]
        )
    return rows


def _margins(found: Robustness, figures: Mapping[str, str]) -> str:
    if not found.singles:
        return ""
    lines = [
        "## One quantity at a time",
        "How far each quantity may be off to either side, all others being as the scene says:",
        table(HEADS, lines_of(found)),
    ]
    notes = [
        f"* {_named(entry)}: {_why(entry)}"
        for entry in found.singles
        if entry.holds and entry.reason and not entry.closed
    ]
    if notes:
        lines += ["Where the two columns are apart, or one is empty:", "\n".join(notes)]
    return "\n\n".join(lines) + figure_line(figures, "margins", "How far each quantity may be off")


def _why(entry: Entry) -> str:
    """Say why a bracket is open."""
    if entry.refuted is None:
        return (
            f"no deviation is found at which an orbit violates the goal; the proof ends with: {entry.reason}"
        )
    return f"in between nothing is known; the proof ends with: {entry.reason}"


def _limits(found: Robustness, figures: Mapping[str, str]) -> str:
    """Show the orbit at the upper end of the tightest margin."""
    first = shown(found)
    if first is None:
        return ""
    goal = None if first.violated is None else found.goals[first.violated]
    rows, heads = _states(first, found)
    begin = (
        "Already in the scene as it is, an orbit violates the goal"
        if not first.holds
        else f"With {deviation_of(first)} an orbit violates the goal"
    )
    last = first.counterexample[-1]
    how = ""
    if isinstance(goal, OrientedBeyond):
        how = (
            f": after {len(first.counterexample) - 1} throws the part lies on side {last['side']}, "
            f"{last['x'] - goal.x:.2g} {found.scene.unit} beyond {goal.x:g} {found.scene.unit}"
        )
    lines = ["## What limits it", f"{begin}{how}.", table(heads, rows)]
    others = sum(entry is not first and bool(entry.counterexample) for entry in found.entries)
    if others and first.holds:
        lines.append(f"The orbits at the upper ends of the {others} other margins are in robustness.json.")
    return "\n\n".join(lines) + figure_line(figures, "counterexample", "The orbit, throw by throw")


def shown(found: Robustness) -> Entry | None:
    """Return the margin whose orbit is shown: the tightest that has one."""
    first = tightest(found)
    candidates = [] if first is None else [first]
    return next((entry for entry in [*candidates, *found.entries] if entry.counterexample), None)


def deviation_of(entry: Entry) -> str:
    """Say by how much a quantity is off at the upper end of its margin, for use within a sentence."""
    if entry.quantity == "joint":
        return f"every quantity {bound(entry.refuted, up=True)} times its tolerance off at most"
    at = bound(entry.refuted, entry.unit, up=True)
    if entry.reading == "per-throw":
        return f"{entry.quantity} off by up to {at}, chosen anew at every throw,"
    return f"{entry.quantity} off by {at}{_value_at(entry)}, the same at every throw,"


def _value_at(entry: Entry) -> str:
    """Give the value itself at which the orbit violates the goal: it says to which side."""
    thrown = (entry.counterexample[0]["parameters"] if entry.counterexample else None) or {}
    for name, words in ((entry.quantity, "at"), ("throw.kappa", "kappa =")):
        given = thrown.get(name)
        if given is not None and (name == entry.quantity or entry.quantity == "throw.speed"):
            value, unit = (given if isinstance(given, str) else given[0]).split()
            return f" ({words} {float(value):.6g} {unit})"
    return ""


def _states(entry: Entry, found: Robustness) -> tuple[list[list[str]], list[str]]:
    """Give the last states of an orbit as a table."""
    orbit, unit = entry.counterexample, found.scene.unit
    scattered = entry.reading == "per-throw" and entry.quantity != "landing.x"
    lands = any("landing.x" in (state["parameters"] or {}) for state in orbit)
    heads = ["throws", f"x [{unit}]", "side"]
    heads += ["kappa of the next throw [%]"] * scattered + [f"it lands off by [{unit}]"] * lands
    rows = []
    first = max(len(orbit) - LAST, 0)
    for number, state in enumerate(orbit[first:], first):
        thrown: Mapping[str, Any] = state["parameters"] or {}
        row = [str(number), f"{state['x']:.6f}", str(state["side"])]
        if scattered:
            row.append(_kappa_off(thrown, found))
        if lands:
            row.append(f"{float(thrown['landing.x'].split()[0]):+.6f}" if "landing.x" in thrown else "")
        rows.append(row)
    return rows, heads


def _kappa_off(thrown: Mapping[str, Any], found: Robustness) -> str:
    given = thrown.get("throw.kappa")
    if given is None:
        return ""
    text = given if isinstance(given, str) else given[0]
    return f"{100.0 * (float(text.split()[0]) / found.scene.kappa - 1.0):+.4f}"


def _met(joint: Entry) -> str:
    """Say whether the tolerance is met."""
    if joint.counterexample and not joint.holds:
        return "The tolerance is **not met**: the scene as it is fails already."
    if joint.proved >= 1.0:
        return f"The tolerance is **met, proved**: up to {bound(joint.proved)} times all of it together."
    if joint.refuted is not None and joint.refuted <= 1.0:
        low, high = bound(joint.proved), bound(joint.refuted, up=True)
        return f"The tolerance is **not met**: safe up to {low} of it, all together, and {high} of it fails."
    return (
        f"Whether the tolerance is met is **not known**: proved is {bound(joint.proved)} of it, all together."
    )


def _joint(found: Robustness, figures: Mapping[str, str]) -> str:
    head = "## All together"
    joint = found.joint
    if joint is None:
        return f"{head}\n\nNo joint margin: {found.left_out.get('joint', 'not asked for')}."
    if joint.counterexample and not joint.holds:
        return f"{head}\n\nNothing is left for deviations: the scene as it is fails already."
    rows = []
    for name, text in found.tolerance.items():
        given = parsed_deviation(text, name)
        size, unit = float(given.number), given.unit
        how = READINGS["per-throw" if name == "landing.x" else "fixed"]
        high = None if joint.refuted is None else joint.refuted * size
        rows.append([name, how, text, bound(joint.proved * size, unit), bound(high, unit, up=True)])
    lines = [
        head,
        "Every quantity may be anywhere within its own deviation, whatever the others are:",
        table(["quantity", "deviates", "tolerance", "proved safe up to", "fails somewhere within"], rows),
    ]
    if joint.reason and not joint.closed:
        lines.append(f"The two are farther apart than asked: {joint.reason}.")
    return "\n\n".join(lines) + figure_line(figures, "joint", "The box of all quantities together")


def _best(curve: MarginsBeyond) -> str:
    best, size = curve.best()
    unit, name = curve.scene.unit, curve.names[0]
    if not size > 0.0:
        return "Of no X that was tried it is proved."
    others = [
        f"{x:.4g}"
        for x, high in zip(curve.x.tolist(), curve.refuted[:, 0].tolist(), strict=True)
        if x != best and not high <= size
    ]
    doubt = (
        f" Whether there is more at {', '.join(others)} is not shown: those brackets reach higher."
        if others
        else ""
    )
    return (
        f"Most room is proved at **X = {best:.4g} {unit}**, of the places that were tried: {name} is safe up to "
        f"{bound(size, curve.units[0] or 'times the tolerance')} there.{doubt}"
    )


def _curve(found: Robustness, figures: Mapping[str, str]) -> str:
    head, curve = "## Where to put X", found.curve
    if curve is None:
        reason = found.left_out.get("curve", "")
        return "" if not reason or reason == "it was not asked for" else f"{head}\n\nNot asked: {reason}."
    heads = [f"X [{found.scene.unit}]"]
    for name, unit in zip(curve.names, curve.units, strict=True):
        what = f"{name} [{unit}]" if unit else f"{name} [times the tolerance]"
        heads += [f"{what}: proved safe up to", "shown to fail from"]
    rows: list[Sequence[str]] = []
    for x, proved, refuted in zip(curve.x.tolist(), curve.proved, curve.refuted, strict=True):
        row = [f"{x:.4g}"]
        for low, high in zip(proved.tolist(), refuted.tolist(), strict=True):
            row += [bound(low), bound(high if math.isfinite(high) else None, up=True)]
        rows.append(row)
    text = (
        f"Asked of each X, on the limit set: beyond it the part lies on side {curve.side} only, and almost every orbit "
        f"comes to rest there. {_best(curve)}"
    )
    joint, best = found.joint, curve.best()[1]
    if joint is not None and joint.proved > best and curve.names[0] == "joint":
        own = next(goal for goal in found.goals if isinstance(goal, OrientedBeyond | Reaches))
        asks = (
            "That asks more than the scene's goal, which"
            if found.goals == (OrientedBeyond(own.x, own.side),)
            else "The scene's goal"
        )
        text += (
            f" {asks} at its own X = {own.x:g} {found.scene.unit} is proved up to "
            f"{bound(joint.proved, 'times the tolerance')}, against {bound(best)} here."
        )
    rest = found.left_out.get("rest of the curve")
    text += f" ({rest[0].upper()}{rest[1:]}.)" if rest else ""
    return "\n\n".join([head, text, table(heads, rows)]) + figure_line(figures, "curve", "Margins against X")


def violated_of(entry: Entry, goals: Sequence[Goal]) -> Goal | None:
    """Return the goal that the orbit of a margin violates."""
    return None if entry.violated is None else goals[entry.violated]
