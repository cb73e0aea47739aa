"""What a fit says in words: what the throws do not tell, rows to look at, whether the model fits, what to film next."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limitsets.fitting.explaining import MOST_MISREAD

if TYPE_CHECKING:
    from limitsets.fitting import Fit


def lines_of(found: Fit) -> list[str]:
    """Write the sentences, one a line."""
    unit = found.scene.unit
    lines = [f"{name} is kept as it was: {why}" for name, why in found.held.items()]
    lines += [
        f"{name} is not determined by these throws: its value goes with that of {others}, which they do not tell"
        for name, others in found.undetermined.items()
    ]
    if found.error is None:
        lines.append(
            "no measurement error is given: the scatter is an upper bound (give --error or a column error)"
        )
    else:
        lines.append(f"measurement error: {found.error:.3g} {unit} (standard deviation of a measured place)")
    for row, column, recorded, fits in found.misread:
        lines.append(f"row {row}: {column} is recorded as {recorded}, but the part landed as on side {fits}")
    if found.misread_rate[0] > MOST_MISREAD:
        lines.append(
            f"{100.0 * found.misread_rate[0]:.0f} % of the sides do not fit where parts landed, and no other reading of"
            " the columns explains it: the sides are recorded wrong, or the part is another one"
        )
    test = found.misfit
    if test.lacking:
        why = "the throws do something that it leaves out, like rolling or slipping, or a number is wrong"
        lines.append(
            f"the model does not fit (p = {test.p:.2g}): {found.explained or why}; do not trust the values"
        )
    else:
        lines.append(f"the model fits: such residuals or larger ones have probability {test.p:.2g}")
    if test.strange:
        lines.append(
            f"far off: the landings of row{'s' * (len(test.strange) > 1)} {', '.join(map(str, test.strange))}"
        )
    for each in found.further[:1]:
        name, factor = max(each.shrinks.items(), key=lambda pair: pair[1])
        gain = f"ten of them shorten the interval of {name} {factor:.2g} times"
        if not found[name].bounded:
            gain = f"they tell most of {name}, which these throws do not bound"
        where = "the left corner at" if found.rows.throws.corner else "x ="
        lines.append(f"film next: throws from {where} {each.x:.3g} {unit} on side {each.side}; {gain}")
    return lines
