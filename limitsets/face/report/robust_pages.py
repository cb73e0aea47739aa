"""The sheet of tolerances as a page: what is told of a margin, of margins against X and of noise, for its template."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limitsets.base.files import as_json
from limitsets.face import plot
from limitsets.face.report.pages import in_time, words
from limitsets.face.report.writing import laid
from limitsets.feeder.goals import Goal, OrientedBeyond, Reaches
from limitsets.feeder.scattering import Gaussian, Law, Uniform
from limitsets.feeder.scene.quantities import parsed_deviation
from limitsets.parameters.margins.margin_result import bound, failing, void_of
from limitsets.parameters.sheet.entries import Entry, in_unit_of, percent_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from limitsets.parameters.margins.single import MarginsBeyond
    from limitsets.parameters.noise.statistics import NoiseStatistics
    from limitsets.parameters.sheet.summary import Robustness


HEADS = ("quantity", "value", "deviates", "proved safe up to", "shown to fail from", "in % of the value")
READINGS = {"fixed": "fixed, but unknown", "per-throw": "at every throw", "tolerance": "together"}

# States of an orbit that are written: the last of them.
LAST = 8

# What the numbers of the noise are called, and whether they are shares, throws, or a rate per throw.
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

# Numbers whose change with the noise is shown.
MOVING = ("wrong beyond", "mean throws", "95 % throws", "escape")

# Less than this is what rounding leaves.
NOTHING = 1e-9

Table = tuple[Sequence[str], list[list[str]]]


def robustness_page(found: Robustness, figures: Mapping[str, str]) -> str:
    """Write the page.

    Parameters
    ----------
    found : Robustness
        From `limitsets.robustness`.
    figures : mapping of str to str
        File names of the pictures by kind: "part", "margins", "joint", "curve", "counterexample", and of noise.

    Returns
    -------
    str
        Markdown.
    """
    first, noise = shown(found), found.noise
    own = next((goal for goal in found.goals if isinstance(goal, OrientedBeyond | Reaches)), None)
    proofs = [name for entry in found.entries for name in (*entry.certificates, entry.against) if name]
    return (
        words(
            "robustness",
            figures,
            **_told(found),
            scene=found.scene,
            heads=HEADS,
            rows=lines_of(found),
            none_holds=none_holds,
            first=first,
            states=first and _states(first, found),
            violated_of=violated_of,
            deviation_of=deviation_of,
            parsed_deviation=parsed_deviation,
            own=own,
            beyond=own and OrientedBeyond(own.x, own.side),
            places=found.curve and _places(found.curve),
            laws=noise
            and [law_words(name, getattr(noise.scatter, name), noise.unit) for name in noise.scatter.given()],
            numbers=noise and _numbers(noise, len(found.scene.sides), found.scene.world.throw_rate),
            changes=noise and _changes(noise),
            files=list(dict.fromkeys(proofs)),
            proved_some=any(entry.holds for entry in found.entries),
        )
        + "\n"
    )


def answer(found: Robustness) -> str:
    """Say in a few sentences what was asked, whether it holds, and what has the least room."""
    return words("robust_answer", **_told(found))


def _told(found: Robustness) -> dict[str, Any]:
    return {
        "found": found,
        "void": void_of(found.goals, found.reach, found.scene.unit),
        "readings": READINGS,
        "bound": bound,
        "failing": failing,
        "tightest": tightest,
        "by_tolerance": _by_tolerance,
    }


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
                failing(entry.refuted, entry.unit, entry.direction),
                share,
            ]
        )
    return rows


def none_holds(found: Robustness) -> str:
    """Say of margins that are all nothing what a table of zeros would."""
    count = len({entry.quantity for entry in found.singles})
    whose = "1 quantity has" if count == 1 else f"{count} quantities have"
    why = "the goal fails already" if found.decided == "refuted" else "the goal is not proved of it"
    reason = next((entry.reason for entry in found.singles if entry.reason), why)
    return f"{whose} no margin about the scene as it is: {reason}."


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
    for name, told in ((entry.quantity, "at"), ("throw.kappa", "kappa =")):
        given = thrown.get(name)
        if given is not None and (name == entry.quantity or entry.quantity == "throw.speed"):
            value, unit = (given if isinstance(given, str) else given[0]).split()
            return f" ({told} {float(value):.6g} {unit})"
    return ""


def _states(entry: Entry, found: Robustness) -> Table:
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
    return heads, rows


def _kappa_off(thrown: Mapping[str, Any], found: Robustness) -> str:
    given = thrown.get("throw.kappa")
    if given is None:
        return ""
    text = given if isinstance(given, str) else given[0]
    return f"{100.0 * (float(text.split()[0]) / found.scene.kappa - 1.0):+.4f}"


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


def _value(value: float | None, kind: str) -> str:
    if value is None or not math.isfinite(value):
        return "-"
    if kind == "throws":
        return f"{value:.1f}"
    if value < NOTHING:
        return "0" if value == 0.0 else f"below {NOTHING:g}"
    return f"{value:.1e}" if kind == "rate" else f"{100.0 * value:.4g} %"


def _error(value: float | None, kind: str) -> str:
    """Write an error with the two digits that it has."""
    if value is None or not math.isfinite(value) or value < NOTHING:
        return _value(value, "share")
    return f"{value:.2g}" if kind != "share" else f"{100.0 * value:.2g} %"


def _change(value: float, kind: str) -> str:
    if not math.isfinite(value):
        return "-"
    if kind == "throws":
        return f"{value:+.2f}"
    if abs(value) < NOTHING:
        return "0"
    return f"{value:+.1e}" if kind == "rate" else f"{100.0 * value:+.2g} %"


def law_words(name: str, law: Law, unit: str) -> str:
    """Say a law as people give it.

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
    rows = [
        [
            told,
            _value(noise.numbers.get(name), kind)
            + (
                in_time(noise.numbers.get(name), rate, parts=name == "mean throws")
                if kind == "throws"
                else ""
            ),
            _error(noise.errors.get(name), kind),
        ]
        for name, (told, kind) in (rests | NUMBERS).items()
        if name in noise.numbers
    ]
    return ["number", "computed", "change on halving"], rows


def _changes(noise: NoiseStatistics) -> Table:
    """Say what 10 % more noise of each quantity changes."""
    rows = []
    for quantity, slopes in noise.sensitivity.items():
        changes = [0.1 * slopes[name].slope if name in slopes else math.nan for name in MOVING]
        rows.append(
            [quantity, *(_change(each, NUMBERS[name][1]) for each, name in zip(changes, MOVING, strict=True))]
        )
    return ["with 10 % more noise of", *(NUMBERS[name][0] for name in MOVING)], rows


def violated_of(entry: Entry, goals: Sequence[Goal]) -> Goal | None:
    """Return the goal that the orbit of a margin violates."""
    return None if entry.violated is None else goals[entry.violated]


# ----------------------------------------------------------------
# Write the tolerance sheet: page, JSON and pictures, all or none; certificates exist already.


def _drawn(found: Robustness) -> Iterator[tuple[str, Figure]]:
    """Draw what there is to draw."""
    yield "part", plot.part(found.scene)
    single = [each for each in found.margins() if each.quantity != "joint"]
    if found.decided == "proved" and single:
        yield "margins", plot.tornado(single)
    if found.joint is not None and found.joint.holds:
        yield "joint", plot.tolerance_box(found.margins()[-1])
    if found.curve is not None:
        yield "curve", plot.margin_curve(found.curve)
    yield from _noise(found)
    first = shown(found)
    if first is not None:
        name = deviation_of(first).rstrip(",") if first.holds else "the scene as it is"
        yield (
            "counterexample",
            plot.counterexample(found.scene, first.counterexample, violated_of(first, found.goals), name),
        )


def _noise(found: Robustness) -> Iterator[tuple[str, Figure]]:
    """Draw the noise: where nothing stays there is no density, where nothing is fed no throws until then.

    Of a single level, where there was no time for others, there is nothing to see.
    """
    if found.noise is None or found.levels is None:
        return
    if found.noise.classes:
        yield "density", plot.noise_density(found.noise)
    if found.noise.feeding.mean is not None:
        yield "throws", plot.noise_arrivals(found.noise)
    if found.levels.factors.size > 1:
        yield "levels", plot.noise_levels(found.levels, {"level of the noise, as given = 1": 1.0})


def write_robustness(
    found: Robustness, folder: str | Path, form: str = "png", *, html: bool = False
) -> list[Path]:
    """Write report.md, robustness.json and the figures into a folder, all of them or none; report.html where asked for.

    Raises
    ------
    LimitsetsError
        The folder cannot be written.
    """
    return laid(
        folder,
        _drawn(found),
        lambda figures: {"report.md": robustness_page(found, figures), "robustness.json": as_json(found)},
        form,
        html=html,
    )
