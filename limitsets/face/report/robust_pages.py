"""The sheet of tolerances as a page and as files: margins, margins against X and noise, for its template."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limitsets.base import as_json
from limitsets.face import plot
from limitsets.face.report.pages import explained, in_time, words
from limitsets.face.report.writing import laid
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.feeder.scattering import Gaussian, Law, Uniform
from limitsets.feeder.scene.quantities import parsed_deviation
from limitsets.parameters.margins.margin_result import Margin, bound, failing, in_unit_of, percent_of, void_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from limitsets.parameters.margins.single import MarginsBeyond
    from limitsets.parameters.noise.statistics import NoiseStatistics
    from limitsets.parameters.sheet.summary import Robustness


HEADS = ("quantity", "value", "deviates", "proved safe up to", "shown to fail from", "in % of the value")
READINGS = {"fixed": "fixed, but unknown", "per-throw": "at every throw", "tolerance": "together"}

# Number of states of an orbit that are written: the last ones.
LAST = 8

# Names of the numbers of the noise, and whether they are shares, throws, or a rate per throw.
NUMBERS = {
    "time beyond": ("rests beyond X, of all", "share"),
    "wrong beyond": ("of these on a wrong side", "share"),
    "fed": ("random starts that come beyond X on the wanted side", "share"),
    "mean throws": ("throws until they do, mean", "throws"),
    "95 % throws": ("throws until 95 % of all starts have", "throws"),
    "first beyond is wrong": ("first rest beyond X is on a wrong side", "share"),
    "lost": ("starts that leave the arm before", "share"),
    "escape": ("chance to leave the limit set, per throw", "rate"),
}

# How each kind is written, and how its changes are.
FORMS = {"share": (".4g", "+.2g"), "throws": (".1f", "+.2f"), "rate": (".1e", "+.1e")}

# Numbers whose changes with the noise are shown.
MOVING = ("wrong beyond", "mean throws", "95 % throws", "escape")

# Smaller numbers are rounding errors.
NOTHING = 1e-9

Table = tuple[Sequence[str], list[list[str]]]


def robustness_page(sheet: Robustness, figures: Mapping[str, str]) -> str:
    """Write the page.

    Parameters
    ----------
    sheet : Robustness
        From `limitsets.robustness`.
    figures : mapping of str to str
        File names of the pictures by kind: "part", "margins", "joint", "curve", "counterexample", and of noise.

    Returns
    -------
    str
        Markdown.
    """
    first, noise = shown(sheet), sheet.noise
    own = next((goal for goal in sheet.goals if isinstance(goal, OrientedBeyond | Reaches)), None)
    page = words(
        "robustness",
        figures,
        **_told(sheet),
        scene=sheet.scene,
        heads=HEADS,
        rows=lines_of(sheet),
        none_holds=none_holds,
        first=first,
        states=first and _states(first, sheet),
        deviation_of=deviation_of,
        parsed_deviation=parsed_deviation,
        own=own,
        beyond=own and OrientedBeyond(own.x, own.side),
        places=sheet.curve and _places(sheet.curve),
        laws=noise
        and [law_words(name, getattr(noise.scatter, name), noise.unit) for name in noise.scatter.given()],
        numbers=noise and _numbers(noise, len(sheet.scene.sides), sheet.scene.world.throw_rate),
        changes=noise and _changes(noise),
        files=list(dict.fromkeys(name for margin in sheet.entries for name in margin.files)),
        proved_some=any(margin.holds for margin in sheet.entries),
    )
    return f"{explained(page)}\n"


def answer(sheet: Robustness) -> str:
    """Say in a few sentences which goals were asked, whether they hold, and which quantity has the least room."""
    return words("robust_answer", **_told(sheet))


def _told(sheet: Robustness) -> dict[str, Any]:
    return {
        "sheet": sheet,
        "void": void_of(sheet.goals, sheet.reach, sheet.scene.unit),
        "readings": READINGS,
        "bound": bound,
        "failing": failing,
        "tightest": tightest,
        "by_tolerance": _by_tolerance,
    }


def tightest(sheet: Robustness) -> Margin | None:
    """Return the smallest margin: in units of its tolerance if two or more quantities have one, else of its value.

    A landing place has no value: its margin is compared with the shortest side.
    """
    if _by_tolerance(sheet):
        return min(sheet.singles, key=lambda margin: _room(margin, sheet))
    return min(sheet.singles, key=lambda margin: _share(margin, sheet), default=None)


def _by_tolerance(sheet: Robustness) -> bool:
    """Whether margins are compared by their tolerances: if two or more quantities have one."""
    return sum(_room(margin, sheet)[0] == 0 for margin in sheet.singles) > 1


def _room(margin: Margin, sheet: Robustness) -> tuple[int, float]:
    text = sheet.tolerance.get(margin.quantity)
    # in a tolerance the landing place is noise, all other quantities are fixed but unknown
    if text is None or (margin.reading == "per-throw") != (margin.quantity == "landing.x"):
        return 1, math.inf
    given = parsed_deviation(text, margin.quantity)
    low = in_unit_of(margin, margin.proved, given.unit)
    return 0, math.inf if low is None else low / float(given.number)


def _share(margin: Margin, sheet: Robustness) -> float:
    share = percent_of(margin, margin.proved)
    return 100.0 * margin.proved / float(sheet.scene.sides.length.min()) if share is None else share


def lines_of(sheet: Robustness) -> list[list[str]]:
    """Give the table, one line per margin of a single quantity; columns as in `HEADS`."""
    rows = []
    for margin in sheet.singles:
        nominal, unit = margin.given
        value = "-" if nominal is None else f"{nominal:.7g} {unit}"
        low, high = (percent_of(margin, size) for size in (margin.proved, margin.refuted))
        share = "-" if low is None else f"{bound(low)} / {bound(high, up=True)}"
        rows.append(
            [
                margin.quantity,
                value,
                READINGS[margin.reading],
                bound(margin.proved, margin.unit),
                failing(margin.refuted, margin.unit, margin.direction),
                share,
            ]
        )
    return rows


def none_holds(sheet: Robustness) -> str:
    """Say in a sentence that all margins are 0, instead of a table of zeros."""
    count = len({margin.quantity for margin in sheet.singles})
    whose = "1 quantity has" if count == 1 else f"{count} quantities have"
    why = "the goal fails already" if sheet.decided == "refuted" else "the goal is not proved of it"
    reason = next((margin.reason for margin in sheet.singles if margin.reason), why)
    return f"{whose} no margin about the scene as it is: {reason}."


def shown(sheet: Robustness) -> Margin | None:
    """Return the margin whose orbit is shown: the tightest one, or the first with an orbit."""
    candidates = tightest(sheet), *sheet.entries
    return next((margin for margin in candidates if margin and margin.counterexample), None)


def deviation_of(margin: Margin) -> str:
    """Give the deviation of a quantity at the upper end of its margin, for use within a sentence."""
    if margin.quantity == "joint":
        return f"every quantity {bound(margin.refuted, up=True)} times its tolerance off at most"
    at = bound(margin.refuted, margin.unit, up=True)
    if margin.reading == "per-throw":
        return f"{margin.quantity} off by up to {at}, chosen anew at every throw,"
    return f"{margin.quantity} off by {at}{_value_at(margin)}, the same at every throw,"


def _value_at(margin: Margin) -> str:
    """Give the value at which the orbit violates the goal, which shows the direction of the deviation."""
    thrown = (margin.orbit[0]["parameters"] if margin.orbit else None) or {}
    for name, told in ((margin.quantity, "at"), ("throw.kappa", "kappa =")):
        given = thrown.get(name)
        if given is not None and (name == margin.quantity or margin.quantity == "throw.speed"):
            value, unit = (given if isinstance(given, str) else given[0]).split()
            return f" ({told} {float(value):.6g} {unit})"
    return ""


def _states(margin: Margin, sheet: Robustness) -> Table:
    """Give the last states of an orbit as a table."""
    orbit, unit = margin.orbit, sheet.scene.unit
    scattered = margin.reading == "per-throw" and margin.quantity != "landing.x"
    lands = any("landing.x" in (state["parameters"] or {}) for state in orbit)
    heads = ["throws", f"x [{unit}]", "side"]
    heads += ["kappa of the next throw [%]"] * scattered + [f"it lands off by [{unit}]"] * lands
    rows = []
    for number, state in list(enumerate(orbit))[-LAST:]:
        thrown: Mapping[str, Any] = state["parameters"] or {}
        row = [str(number), f"{state['x']:.6f}", str(state["side"])]
        if scattered:
            row.append(_kappa_off(thrown, sheet))
        if lands:
            row.append(f"{float(thrown['landing.x'].split()[0]):+.6f}" if "landing.x" in thrown else "")
        rows.append(row)
    return heads, rows


def _kappa_off(thrown: Mapping[str, Any], sheet: Robustness) -> str:
    given = thrown.get("throw.kappa")
    if given is None:
        return ""
    kappa = float((given if isinstance(given, str) else given[0]).split()[0])
    return f"{100.0 * (kappa / sheet.scene.kappa - 1.0):+.4f}"


def _places(curve: MarginsBeyond) -> Table:
    heads = [f"X [{curve.scene.unit}]"]
    for name, unit in zip(curve.names, curve.units, strict=True):
        heads += [f"{name} [{unit or 'times the tolerance'}]: proved safe up to", "shown to fail from"]
    rows = []
    for x, proved, refuted in zip(curve.x.tolist(), curve.proved, curve.refuted, strict=True):
        row = [f"{x:.4g}"]
        for low, high in zip(proved.tolist(), refuted.tolist(), strict=True):
            row += [bound(low), bound(high if math.isfinite(high) else None, up=True)]
        rows.append(row)
    return heads, rows


def _written(value: float | None, kind: str, form: str) -> str:
    """Write a number in a format, a share in percent; a difference has a sign."""
    if value is None or not math.isfinite(value):
        return "-"
    if kind != "throws" and abs(value) < NOTHING:
        return "0" if value == 0.0 or form.startswith("+") else f"below {NOTHING:g}"
    return f"{100.0 * value:{form}} %" if kind == "share" else f"{value:{form}}"


def law_words(name: str, law: Law, unit: str) -> str:
    """Describe a law of noise.

    Examples
    --------
    >>> from limitsets.robust import Gaussian
    >>> law_words("speed", Gaussian(0.005), "in")
    'speed: normal, standard deviation 0.5 %'
    """

    def size(value: float) -> str:
        if name == "speed":
            return f"{100.0 * value:.4g} %"
        return f"{math.degrees(value):.4g} deg" if name == "tilt" else f"{value:.4g} {unit}"

    if isinstance(law, Gaussian):
        return f"{name}: normal, standard deviation {size(law.sigma)}"
    if isinstance(law, Uniform):
        return f"{name}: anything within {size(law.bound)}, equally likely"
    return f"{name}: {law!r}"


def _numbers(noise: NoiseStatistics, sides: int, rate: float | None) -> Table:
    rests = {f"time on side {k}": (f"rests on side {k}", "share") for k in range(sides)}
    rows = []
    for name, (caption, kind) in (rests | NUMBERS).items():
        if name in noise.numbers:
            value = noise.numbers[name]
            time = in_time(value, rate, parts=name == "mean throws") if kind == "throws" else ""
            error = _written(noise.errors.get(name), kind, ".2g")
            rows.append([caption, _written(value, kind, FORMS[kind][0]) + time, error])
    return ["number", "computed", "change on halving"], rows


def _changes(noise: NoiseStatistics) -> Table:
    """Give the changes of the numbers with 10 % more noise of each quantity."""
    rows = []
    for quantity, slopes in noise.sensitivity.items():
        changes = {name: 0.1 * slopes[name].slope if name in slopes else math.nan for name in MOVING}
        kinds = {name: NUMBERS[name][1] for name in MOVING}
        rows.append(
            [quantity, *(_written(changes[name], kinds[name], FORMS[kinds[name]][1]) for name in MOVING)]
        )
    return ["with 10 % more noise of", *(NUMBERS[name][0] for name in MOVING)], rows


# ----------------------------------------------------------------
# Write the tolerance sheet: page, JSON and pictures, all or none; certificates exist already.


def _drawn(sheet: Robustness) -> Iterator[tuple[str, Figure]]:
    """Draw all figures of the sheet."""
    yield "part", plot.part(sheet.scene)
    if sheet.decided == "proved" and sheet.singles:
        yield "margins", plot.tornado(sheet.singles)
    if sheet.joint is not None and sheet.joint.holds:
        yield "joint", plot.tolerance_box(sheet.joint)
    if sheet.curve is not None:
        yield "curve", plot.margin_curve(sheet.curve)
    yield from _noise(sheet)
    first = shown(sheet)
    if first is not None:
        name = deviation_of(first).rstrip(",") if first.holds else "the scene as it is"
        yield (
            "counterexample",
            plot.counterexample(sheet.scene, first.orbit, first.violated, name),
        )


def _noise(sheet: Robustness) -> Iterator[tuple[str, Figure]]:
    """Draw the noise: there is no density if no part stays, and no number of throws if no part is fed.

    Of a single level, where there was no time for others, there is nothing to see.
    """
    if sheet.noise is None or sheet.levels is None:
        return
    if sheet.noise.classes:
        yield "density", plot.noise_density(sheet.noise)
    if sheet.noise.feeding.mean is not None:
        yield "throws", plot.noise_arrivals(sheet.noise)
    if sheet.levels.factors.size > 1:
        yield "levels", plot.noise_levels(sheet.levels, {"level of the noise, as given = 1": 1.0})


def write_robustness(
    sheet: Robustness, folder: str | Path, form: str = "png", *, html: bool = True
) -> list[Path]:
    """Write report.md, report.html, robustness.json and the figures into a folder, all of them or none.

    Raises
    ------
    LimitsetsError
        The folder cannot be written.
    """
    return laid(
        folder,
        _drawn(sheet),
        lambda figures: {"report.md": robustness_page(sheet, figures), "robustness.json": as_json(sheet)},
        form,
        html=html,
    )
