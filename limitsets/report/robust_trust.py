"""The second half of the sheet of tolerances: the noise, how far to trust it all, and how to check it again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from limitsets.report.background import figure_line
from limitsets.report.tables import table
from limitsets.robust.noise.laws import Gaussian, Law, Uniform

if TYPE_CHECKING:
    from limitsets.robust.sheet.summary import Robustness

__all__ = ["called_for", "checked_again", "noise_of", "trusted"]

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


def _law(name: str, law: Law, unit: str) -> str:
    """Say a law as people give it.

    Examples
    --------
    >>> from limitsets.robust import Gaussian
    >>> _law("speed", Gaussian(0.005), "in")
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


def noise_of(found: Robustness, figures: Mapping[str, str]) -> str:
    """Say what noise does."""
    head, noise = "## Noise", found.noise
    if noise is None:
        return f"{head}\n\nNothing is said about noise: {found.left_out.get('noise', 'not asked for')}."
    x, side = noise.goal
    sides = [[f"rests on side {k}", f"time on side {k}", "share"] for k in range(len(found.scene.sides))]
    rows = [
        [words, _value(noise.numbers.get(name), kind), _error(noise.errors.get(name), kind)]
        for words, name, kind in [*sides, *([words, name, kind] for name, (words, kind) in NUMBERS.items())]
        if name in noise.numbers
    ]
    laws = "; ".join(_law(name, getattr(noise.scatter, name), noise.unit) for name in noise.scatter.given())
    lines = [
        head,
        (
            f"Computed, not proved. Every throw scatters on its own. "
            f"{laws[0].upper()}{laws[1:]} ({found.law}). Fed is a part at rest "
            f"beyond X = {x:g} {noise.unit} on side {side}. Random starts lie evenly on all sides, from "
            f"{', '.join(f'{a:.4g}' for a in noise.starts)} {noise.unit} on sides 0, 1, ... up to X."
        ),
        table(["number", "computed", "error, about"], rows),
        _sensitivity(found),
    ]
    text = "\n\n".join(line for line in lines if line)
    captions = {
        "density": "Where the part lies, in the long run",
        "throws": "Throws from random starts until the part is fed",
        "levels": "The same numbers at other levels of the noise",
    }
    return text + "".join(figure_line(figures, kind, words) for kind, words in captions.items())


def _sensitivity(found: Robustness) -> str:
    """Say what 10 % more noise of each quantity changes."""
    noise = found.noise
    if noise is None or not noise.sensitivity:
        return ""
    heads = ["with 10 % more noise of", *(NUMBERS[name][0] for name in MOVING)]
    rows = [
        [
            quantity,
            *(
                _change(0.1 * slopes[name].slope if name in slopes else math.nan, NUMBERS[name][1])
                for name in MOVING
            ),
        ]
        for quantity, slopes in noise.sensitivity.items()
    ]
    return "What changes, shares in percentage points:\n\n" + table(heads, rows)


def trusted(found: Robustness) -> str:
    """Say what is proved, what computed, what assumed."""
    lines = ["## How far to trust this"]
    if found.entries:
        lines.append(
            "**Proved:** both columns, for the scene's decimals and the model's formulas, by interval arithmetic. "
            '"Proved safe" holds for every value up to the bound, and "fixed" means the same unknown value at every '
            'throw, "at every throw" any sequence of values. "Shown to fail" is an orbit, every state of it enclosed. '
            "Between the two columns nothing is claimed."
        )
    if found.noise is not None:
        cut = found.noise.cut
        off = f" Laws without bounds are cut off where {cut:.0e} of a throw's chance is left." if cut else ""
        lines.append(
            f"**Computed, not proved:** the noise, as a Markov chain between {found.noise.grid.n_cells} cells. The "
            f"error given is the change from half as many cells.{off}"
        )
    effects = found.scene.effects.on()
    model = f"the minimal model with {', '.join(effects)}" if effects else "the minimal model"
    lines.append(f"**Assumed:** {model}, and that what is not listed does not deviate. {_flags(found)}")
    return "\n\n".join(lines)


def called_for(found: Robustness) -> list[str]:
    """Name the effects that the limit set calls for and that are not simulated."""
    limit = found.audit.on("limit-set") if found.audit is not None else ()
    return list(dict.fromkeys(each.effect for each in limit if each.called_for and not each.simulated))


def _flags(found: Robustness) -> str:
    """Say which assumptions an audit flags, in one line."""
    command = f"`limitsets audit {_scene(found)}`"
    if found.audit is None:
        return f"{command} says which assumptions of the model the scene breaks."
    limit, called = found.audit.on("limit-set"), called_for(found)
    unknown = dict.fromkeys(each.missing for each in limit if each.missing and each.called_for is None)
    words = f"flagged: {', '.join(called)}" if called else "none is seen to break"
    rest = f"; cannot be told without {', '.join(unknown)} in [world]" if unknown else ""
    return f"Assumptions of the model on the limit set: {words}{rest} (see {command})."


def _scene(found: Robustness) -> str:
    return found.scene.file or found.scene.name


def checked_again(found: Robustness) -> str:
    """Give the command lines that check the proofs, and that make the page again."""
    files = [
        name
        for entry in found.entries
        for name in [*entry.certificates, *([entry.against] if entry.against else [])]
    ]
    lines = ["## Checking it again"]
    if files:
        lines.append(
            "Each proof and each counterexample is checked by other code in other arithmetic (python-flint), from this "
            "folder:"
        )
        lines.append("\n".join(f"    limitsets recheck {name}" for name in dict.fromkeys(files)))
    elif found.entries:
        lines.append(
            "There are no certificates: nothing rechecks maps with effects, and none is written without a folder."
        )
    lines.append(
        f"The page is made by `limitsets robustness {_scene(found)}` and its options; with the same ones, margins "
        "that are in this folder are found again and not computed anew."
    )
    return "\n\n".join(lines)
