"""Pages in the words of someone who builds a feeder: tables, goals as sentences, what a fit says, as Markdown and HTML.

The texts are in `templates`.  A paragraph of a template can have line breaks between its sentences: it becomes one line
of the page.  A paragraph without any sentence left is dropped.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any

from limitsets.base import AnswerError, proposed, rounded
from limitsets.feeder.goals import (
    Goal,
    OrientedBeyond,
    Reaches,
    StaysOnArm,
    laid_words,
    order_of,
    unknown_goal,
)
from limitsets.parameters.analysis import Analysis, GoalOutcome, in_limit_sets
from limitsets.parameters.fitting.misfit import MOST_MISREAD
from limitsets.proofs.prover.averages import outward
from limitsets.proofs.prover.parameters import simulated

if TYPE_CHECKING:
    from jinja2 import Environment

    from limitsets.feeder.scene import Scene
    from limitsets.parameters.fitting import Fit
    from limitsets.proofs.prover import Proof


# ---------------------------------------------------------------- Markdown: tables and numbers with units


Extents = Mapping[int, Sequence[tuple[float, float]]]


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Write a Markdown table.

    Examples
    --------
    >>> print(table(["side", "x"], [[0, 1.5]]))
    | side | x |
    |---|---|
    | 0 | 1.5 |
    """
    head, *lines = (f"| {' | '.join(map(str, cells))} |" for cells in (heads, *rows))
    return "\n".join([head, "|" + "---|" * len(heads), *lines])


def percent(share: float) -> str:
    """Write a share; 0 % and 100 % are written only if the share is exactly that.

    Examples
    --------
    >>> percent(1.0), percent(0.99999), percent(0.305)
    ('100 %', 'more than 99.9 %', '30.5 %')
    """
    if share >= 1 - 1e-9 or share == 0:
        return f"{100 * share:.0f} %"
    if share > 0.999 or share < 0.001:
        return "more than 99.9 %" if share > 0.5 else "less than 0.1 %"
    return f"{100 * share:.1f} %"


def count(least: int, most: int) -> str:
    """Write a range of whole numbers.

    Examples
    --------
    >>> count(3, 11), count(0, 0)
    ('3 to 11', '0')
    """
    return str(least) if least == most else f"{least} to {most}"


def in_time(throws: float | None, rate: float | None, *, parts: bool = False) -> str:
    """Write a number of throws in seconds, and as parts per minute one after the other; empty if no rate is known.

    Parameters
    ----------
    throws : float or None
        Number of throws.
    rate : float or None
        Throws per second (`world.throw_rate`).
    parts : bool
        Whether one part is fed after this number of throws.

    Examples
    --------
    >>> in_time(12.0, 2.0, parts=True), in_time(12.0, None)
    (' (6 s, 10 parts per minute)', '')
    """
    if throws is None or rate is None or not isfinite(throws) or throws <= 0.0:
        return ""
    minute = f", {60.0 * rate / throws:.3g} parts per minute" if parts else ""
    return f" ({throws / rate:.3g} s{minute})"


def intervals(parts: Iterable[tuple[float, float]], digits: int = 3) -> str:
    """Write intervals, rounded outward.

    Examples
    --------
    >>> intervals([(1.0, 2.0), (3.0, 4.51)], 1)
    '1.0 to 2.0, 3.0 to 4.6'
    """
    show = f".{digits}f"
    return ", ".join(f"{rounded(lo, show, up=False)} to {rounded(hi, show, up=True)}" for lo, hi in parts)


def bands(extents: Extents) -> list[tuple[float, float, tuple[int, ...]]]:
    """Cut the x axis at the ends of all intervals: ``(lo, hi, sides)``, ascending, without empty stretches.

    Examples
    --------
    >>> bands({0: [(1.0, 3.0)], 1: [(2.0, 4.0)]})
    [(1.0, 2.0, (0,)), (2.0, 3.0, (0, 1)), (3.0, 4.0, (1,))]
    """
    cuts = sorted({x for parts in extents.values() for pair in parts for x in pair})
    pieces = []
    for lo, hi in pairwise(cuts):
        middle = 0.5 * (lo + hi)
        sides = tuple(sorted(s for s, parts in extents.items() if any(a <= middle <= b for a, b in parts)))
        if sides:
            pieces.append((lo, hi, sides))
    return pieces


# ---------------------------------------------------------------- Goals as sentences


# Factor on the number of cells that is proposed if starts are undecided, and the largest number of cells.
FINER, MOST_CELLS = 4, 1_000_000

# Rounding error of a sum of shares.
ROUNDING = 1e-9


def goal_sentence(goal: Goal, unit: str) -> str:
    """State a goal as a sentence.

    Examples
    --------
    >>> goal_sentence(OrientedBeyond(20.0, 2), "in")
    'every part at rest beyond x = 20 in lies on side 2 (asked of the limit set)'
    """
    if not isinstance(goal, Goal):
        raise unknown_goal(goal)
    laid = f"parts laid down at {laid_words(goal.laid, unit)}" if goal.laid else ""
    if goal.of_every_start:
        return f"{goal.question(unit)} (asked of {laid})" if laid else goal.question(unit)
    where = "every throw from every start" if goal.from_anywhere else "the limit set"
    if laid:
        where = f"every throw of {laid}" if goal.from_anywhere else f"where {laid} come to"
    return f"{goal.question(unit)} (asked of {where})"


def verdict_of(outcome: GoalOutcome, share: float) -> str:
    """Say whether a goal holds, on which limit sets, and for which share of the starts.

    Examples
    --------
    >>> from limitsets.analysis import GoalOutcome
    >>> verdict_of(GoalOutcome(OrientedBeyond(20.0, 2), True, 17.5, reach=(24.0,)), 0.965)
    'holds of the limit set, to which 96.5 % of all starts come'
    >>> verdict_of(GoalOutcome(OrientedBeyond(20.0, 2), True, 17.5, reach=(19.0,)), 0.965)
    'holds vacuously'
    """
    return verdict_words(outcome.goal, outcome.holds, share, len(outcome.reach), vacuous=outcome.vacuous)


def verdict_words(goal: Goal, holds: bool | None, share: float, sets: int, *, vacuous: bool) -> str:
    """Say the same of a verdict that comes from elsewhere, on a given number of limit sets."""
    if vacuous:
        return "holds vacuously"
    if holds and not (goal.from_anywhere or goal.of_every_start):
        come = "" if share >= 1.0 - ROUNDING else f", to which {percent(share)} of all starts come"
        return f"holds of {'the' if sets < 2 else 'each'} limit set{come}"
    return {True: "holds", False: "does not hold", None: "was not decided"}[holds]


def starts_words(starts: object, share: float | None) -> str:
    """Say for which starts a goal is proved, the share rounded down.

    Examples
    --------
    >>> starts_words("every", 1.0), starts_words("cells", 0.96459)
    ('for every start', 'for 96.4 % of all starts')
    """
    if starts in ("every", "almost-every"):
        return f"for {str(starts).replace('-', ' ')} start"
    return f"for {math.floor(1000.0 * (share or 0.0)) / 10.0:g} % of all starts"


def next_command(analysis: Analysis) -> str:
    """Name the next command after an analysis with a goal: a proof, a margin, or a design.

    Examples
    --------
    >>> import limitsets as ls
    >>> next_command(ls.analyse("paper-initial", 1024))
    'limitsets design paper-initial --goal (a scene that meets it: centre of mass, throw and surface moved)'
    """
    outcome, scene = analysis.goal, analysis.scene
    source = _source(scene)
    assert outcome is not None
    if analysis.choice.tipping:  # no other command switches `auto` on
        lines = " and ".join(f"{effect} = true" for effect in analysis.choice.tipping)
        return f"write {lines} under [effects] of {source}; {proposed('check', source)} says whether it is in order"
    audited = f"{proposed('audit', source)} (which assumptions it breaks)"
    if not can_be_proved(scene):
        return audited
    if outcome.holds and not outcome.goal.from_anywhere and any(analysis.basins.exits.values()):
        return f"{proposed('certify', source)} (a proof for the starts that stay; margins need all to stay)"
    if outcome.holds and not outcome.vacuous:
        proof, margins = proposed("certify", source), proposed("margin", source)
        return f"{proof} (a proof), {margins} (how much each quantity may deviate)"
    if outcome.holds is None and not analysis.attractors and (speeds := _speeds(scene)):
        return f"{proposed('atlas', source, *speeds)} (at which speeds of the throw parts stay)"
    if outcome.holds is None:
        return f"{proposed('certify', source)} (whether it can be proved)"
    return design_command(scene, [outcome.goal]) or audited


def can_be_proved(scene: Scene) -> bool:
    """Whether proofs about a scene are possible: not with effects without an enclosure."""
    try:
        simulated(scene)
    except AnswerError:
        return False
    return True


def _speeds(scene: Scene) -> tuple[str, ...]:
    """Write an axis of an atlas from half to twice the speed of a scene; empty if the scene gives none."""
    given = scene.text["throw"].get("speed")
    if given is None:
        return ()
    value = float(given.split()[0])
    return "--x", f"throw.speed={0.5 * value:g}:{2.0 * value:g}:100"


def after_undecided(analysis: Analysis) -> str:
    """Name the command that decides more starts; empty if none is undecided, or more cells do not help.

    Examples
    --------
    >>> import limitsets as ls
    >>> after_undecided(ls.analyse("paper-designed", 16))
    'limitsets analyse paper-designed --cells 64 (finer cells)'
    """
    cells = FINER * int(analysis.grid.shape[:, 0].max())
    creeping = analysis.scene.surface_height > 0.0  # to the joint, for ever
    if analysis.basins.undecided_between == 0.0 or cells > MOST_CELLS or creeping:
        return ""
    return f"{proposed('analyse', _source(analysis.scene), '--cells', cells)} (finer cells)"


def after_unproved(proof: Proof) -> str:
    """Name the next command after a proof in which a claim is not proved."""
    scene, goal = proof.scene, proof.scene.goal
    verdicts = {claim.verdict for claim in proof.claims if claim.claim == "goal"}
    if (proof.noise or proof.tolerance) and "proved-on-cells" not in verdicts:
        return f"{proposed('margin', _source(scene))} (how much each quantity may deviate)"
    if "refuted" in verdicts and goal is not None and (design := design_command(scene, [goal])):
        return design
    source = _source(scene)
    sampled, audited = proposed("analyse", source), proposed("audit", source)
    return f"{sampled} (what sampled throws say), {audited} (what the model leaves out)"


def without_margin(scene: Scene, goals: Sequence[Goal], *, fails: bool) -> str:
    """Name the next command for a scene without margins, whose goal fails or is not proved."""
    analysed = proposed("analyse", _source(scene))
    starts = f"{analysed} (which starts leave the arm: margins need a scene in which none does)"
    if can_be_proved(scene):
        starts = f"{proposed('certify', _source(scene))} (what is proved of it, and what is not), {starts}"
    return (design_command(scene, goals) if fails else "") or starts


def design_command(scene: Scene, goals: Sequence[Goal]) -> str:
    """Name the command that designs a scene for a goal; empty if there is no such command."""
    if scene.effects.on() or not any(isinstance(goal, OrientedBeyond | Reaches) for goal in goals):
        return ""
    words = "a scene that meets it: centre of mass, throw and surface moved"
    return f"{proposed('design', _source(scene), '--goal')} ({words})"


def _source(scene: Scene) -> str:
    return scene.file or f"{scene.name}.toml"


def void_of(outcome: GoalOutcome, unit: str, spread: str | None) -> str:
    """Say in which way a goal holds only vacuously; empty if it does not.

    With `spread` the scene scatters its throws; the limit set is then that of throws without scatter.

    Examples
    --------
    >>> from limitsets.analysis import GoalOutcome
    >>> void_of(GoalOutcome(OrientedBeyond(20.0, 2), True, 17.5, reach=(19.0,)), "in", None)
    'no part gets there: the limit set ends at x = 19.000 in, before x = 20 in'
    """
    goal = outcome.goal
    if isinstance(goal, StaysOnArm) and outcome.holds and not goal.from_anywhere:
        return "no throw leads out of any limit set; from_anywhere = true asks it of every start"
    if not isinstance(goal, OrientedBeyond) or not outcome.holds:
        return ""
    short = [k for k, x in enumerate(outcome.reach) if x <= goal.x]
    if goal.from_anywhere:
        ends = [f"the farthest landing is at x = {outcome.reach[k]:.3f} {unit}" for k in short]
    elif len(outcome.reach) == 1:
        ends = [f"the limit set ends at x = {outcome.reach[k]:.3f} {unit}" for k in short]
    else:
        ends = [f"limit set {k} ends at x = {outcome.reach[k]:.3f} {unit}" for k in short]
    who = "no part gets there" if outcome.vacuous else "not every part gets there"
    thrown = "without scatter " if spread else ""
    return f"{thrown}{who}: {', '.join(ends)}, before x = {goal.x:g} {unit}" if ends else ""


def choice_of(analysis: Analysis) -> list[str]:
    """Say which X a goal could ask for; empty if the goal asks of every start, or holds and is no empty promise.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed").as_dict() | {"goal": {"oriented_beyond": {"x": "24 in", "side": 2}}}
    >>> choice_of(ls.analyse(scene, 512))[0][:41]
    'choose X between 19.753 and 23.383 in for'
    """
    outcome, unit = analysis.goal, analysis.scene.unit
    if outcome is not None and (outcome.goal.from_anywhere or not isinstance(outcome.goal, OrientedBeyond)):
        return []
    if not analysis.attractors or (outcome is not None and outcome.holds and not outcome.vacuous):
        return []
    wanted = outcome.goal.side if outcome is not None and isinstance(outcome.goal, OrientedBeyond) else None
    choices = sorted(analysis.choices, key=lambda choice: (choice[0] != wanted, choice[1] - choice[2]))
    lines = [
        f"choose X between {rounded(lo, '.3f', up=True)} and {rounded(hi, '.3f', up=False)} {unit} for side {side}:"
        f" every limit set gets beyond X, and parts beyond X lie on side {side} alone (sampled, not proved)"
        for side, lo, hi in choices
    ]
    return lines or ["no X is right: of no side do all limit sets get farther than on the others"]


def choice_for(scene: Scene, goals: Sequence[Goal]) -> list[str]:
    """Say the same for goals that another answer shows to fail, or to hold vacuously; the scene is analysed for it."""
    from limitsets.parameters.analysis import analyse  # imported here, because only empty promises need it

    goal = next((goal for goal in goals if isinstance(goal, OrientedBeyond)), None)
    return [] if goal is None else choice_of(analyse(replace(scene, goal=goal)))


def cavity_for(analysis: Analysis) -> list[str]:
    """Propose a cavity, as lines of TOML, where the goal holds and the scene has none; else empty.

    Examples
    --------
    >>> import limitsets as ls
    >>> cavity_for(ls.analyse("paper-designed", 1024))[:2]
    ['[cavity]', 'position = "20 in"']
    """
    from limitsets.cell.feeding import proposed_cavity  # imported here, because only some reports need it

    scene, outcome = analysis.scene, analysis.goal
    fails = outcome is None or not outcome.holds or outcome.vacuous
    if fails or scene.cavity is not None or not scene.sides.rests.all():
        return []
    return proposed_cavity(scene).splitlines()


# ----------------------------------------------------------------
# The pages: an answer in the words of someone who builds a feeder.


# Blocks that begin with these signs keep their line breaks: headings, tables, commands; lists those between entries.
LINES = ("#", "|", "    ")

# Lines without sentences, which explain no word; the contents are one of them.
CONTENTS = "**Contents:** "
NO_SENTENCES = (*LINES, "!", "[", CONTENTS)

# Sentences that explain words of a page, by patterns of these words.
EXPLAINED = {
    r"[Pp]roved|[Ss]ampled": (
        "Proved is what enclosures of all throws show for the model; sampled is what some computed throws show."
    ),
    "limit sets?": "A limit set is the places and sides to which a part comes back for ever: an attractor.",
    "basins?": "The basin of a limit set is all starts from which parts come to it.",
    "jogs?": "After a jog the part lies on the same side as before, after a flip on another one.",
    "critical points?": "At a critical point a part stops jogging and begins to flip, or the reverse.",
    "[Cc]ells?": "A cell is a short interval of x on one side.",
    "Morse graph": (
        "A set of cells is recurrent if throws lead from each of its cells back to it; the Morse graph shows which of"
        " these sets lead to which."
    ),
    "[Mm]argins?|Least room": "A margin is how far a quantity may be off before the goal fails.",
}


@cache
def environment() -> Environment:
    """Give the environment of the templates, with their filters and functions."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    templates = Environment(
        loader=PackageLoader("limitsets.face.report"),
        trim_blocks=True,
        undefined=StrictUndefined,
        autoescape=False,  # Markdown, no HTML
    )
    templates.filters |= {
        "bands": bands,
        "count_of": lambda pair: count(*pair),
        "degrees": math.degrees,
        "f": format,
        "first_up": lambda text: text[:1].upper() + text[1:],
        "intervals": intervals,
        "percent": percent,
        "proved": _proved,
    }
    templates.globals |= {
        "next_command": next_command,
        "order_of": order_of,
        "proposed": proposed,
        "question_of": goal_sentence,
        "table": table,
        "verdict_of": verdict_of,
        "void_of": void_of,
        "choice_of": choice_of,
        "after_undecided": after_undecided,
        "cavity_for": cavity_for,
        "contents": contents,
    }
    return templates


def _proved(bounds: Mapping[str, tuple[float, float]], name: str) -> str:
    """Write the bounds of an average behind the number that was counted; nothing where there are none."""
    return " (proved: {!r} to {!r})".format(*outward(*bounds[name])) if name in bounds else ""


def words(template: str, figures: Mapping[str, str] | None = None, **answers: Any) -> str:
    """Fill in a template of `templates`: paragraphs are separated by an empty line, without a line break at the end.

    Parameters
    ----------
    template : str
        Its name, without endings.
    figures : mapping of str to str, optional
        File names of the pictures by kind; missing pictures are left out.
    **answers
        Variables of the template.
    """

    def figure(kind: str, caption: str) -> str:
        if not figures or kind not in figures:
            return ""
        link = f"[{caption}]({figures[kind]})"
        return link if figures[kind].endswith(".pdf") else f"!{link}"  # no page shows PDF in its text

    text = environment().get_template(f"{template}.md.j2").render(figure=figure, **answers)
    blocks = [block.strip("\n") for block in re.split(r"\n\s*\n", text)]
    return "\n\n".join(
        block if block.startswith(LINES) else re.sub(r"\s*\n(?!\* )\s*", " ", block)
        for block in blocks
        if block
    )


def anchor(heading: str) -> str:
    """Name a heading in links, as code hosts do.

    Examples
    --------
    >>> anchor("Limit set 0, and more")
    'limit-set-0-and-more'
    """
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def contents(text: str) -> str:
    r"""Link to the sections of a page.

    Examples
    --------
    >>> contents("## The goal\n\n## Noise")
    '**Contents:** [The goal](#the-goal) · [Noise](#noise)'
    """
    heads = (line[3:].strip() for line in text.splitlines() if line.startswith("## "))
    return CONTENTS + " · ".join(f"[{head}](#{anchor(head)})" for head in heads)


def explained(text: str) -> str:
    """Explain words where they first stand in a page: at the end of the line, before it where a table follows.

    Examples
    --------
    >>> explained("It has two basins.")
    'It has two basins. *The basin of a limit set is all starts from which parts come to it.*'
    """
    lines, left = [], dict(EXPLAINED)
    for line in text.split("\n"):
        prose = "" if line.startswith(NO_SENTENCES) else line
        new = [word for word in left if re.search(rf"(?<![-\w])(?:{word})\b", prose)]
        notes = [f"*{' '.join(left.pop(word) for word in new)}*"] if new else []
        lines.append(" ".join([*notes, line] if line.endswith(":") else [line, *notes]))
    return "\n".join(lines)


def page(
    analysis: Analysis,
    figures: Mapping[str, str],
    averages: Sequence[Mapping[str, tuple[float, float]]] = (),
) -> str:
    """Write the report.

    Parameters
    ----------
    analysis : Analysis
        From `limitsets.analyse`.
    figures : mapping of str to str
        File names of the pictures by kind: "part", "limit-set", "map", "basins", "morse", "flight".
    averages : sequence of mapping of str to (float, float), optional
        Per limit set the bounds that `limitsets.analysis.proved_averages` gives.

    Returns
    -------
    str
        Markdown.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.face.report.pages import page
    >>> page(ls.analyse("paper-designed"), {}).splitlines()[0]
    '# paper-designed: where the throws lead'
    """
    from limitsets.feeder.thrower.effects import EFFECTS  # imported here, because it loads numba

    effects = analysis.scene.effects
    assumed = [each.lifts for name, each in EFFECTS.items() if name not in effects.words]
    # an assumption about the throw; no effect lifts it
    assumed.insert(0 if effects.drive else 1, "it does not tip the part")
    broken = in_limit_sets(analysis.other_vertex_first, analysis.extents)
    told = {"analysis": analysis, "broken": broken, "assumed": assumed, "averages": averages}
    return explained(words("report", figures, **told)) + "\n"


# ----------------------------------------------------------------
# A page as one file of HTML that stands alone: the Markdown of the report, with its figures inside.


def as_html(text: str, images: Mapping[str, str]) -> str:
    """Write a page of Markdown as HTML.

    Parameters
    ----------
    text : str
        The page, which begins with its title.
    images : mapping of str to str
        Addresses of its figures, by their names in the page.

    Examples
    --------
    >>> ">Throws &amp; flips</h1>" in as_html("# Throws & flips", {})
    True
    """
    from markdown_it import MarkdownIt  # imported here, because only this page needs it

    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    blocks = reader.parse(text)
    for image in (each for block in blocks for each in block.children or () if each.type == "image"):
        source = str(image.attrs["src"])
        image.attrs["src"] = images.get(source, source)
    for opening, heading in pairwise(blocks):
        if opening.type == "heading_open":
            opening.attrs["id"] = anchor(heading.content)
    body = reader.renderer.render(blocks, reader.options, {})
    title = text.split("\n", 1)[0].lstrip("# ")
    return environment().get_template("page.html.j2").render(title=title, body=body) + "\n"


# ----------------------------------------------------------------
# A fit in words: quantities that the throws do not determine, rows to look at, whether the model fits, and what
# to film next.


def lines_of(fit: Fit) -> list[str]:
    """Write the sentences, one a line."""
    unit = fit.scene.unit
    lines = [f"{name} is kept as it was: {why}" for name, why in fit.held.items()]
    lines += [
        f"{name} is not determined by these throws: its value goes with that of {others}, which they do not tell"
        for name, others in fit.undetermined.items()
    ]
    if fit.error is None:
        lines.append(
            "no measurement error is given: the scatter is an upper bound (give --error or a column error)"
        )
    else:
        lines.append(f"measurement error: {fit.error:.3g} {unit} (standard deviation of a measured place)")
    for row, column, recorded, fits in fit.misread:
        lines.append(f"row {row}: {column} is recorded as {recorded}, but the part landed as on side {fits}")
    if fit.misread_rate[0] > MOST_MISREAD:
        lines.append(
            f"{100.0 * fit.misread_rate[0]:.0f} % of the sides do not fit where parts landed, and no other reading of"
            " the columns explains it: the sides are recorded wrong, or the part is another one"
        )
    test = fit.misfit
    if test.lacking:
        why = "the throws do something that it leaves out, like rolling or slipping, or a number is wrong"
        lines.append(
            f"the model does not fit (p = {test.p:.2g}): {fit.explained or why}; do not trust the values"
        )
    else:
        lines.append(f"the model fits: such residuals or larger ones have probability {test.p:.2g}")
    if test.strange:
        lines.append(
            f"far off: the landings of row{'s' * (len(test.strange) > 1)} {', '.join(map(str, test.strange))}"
        )
    for each in fit.further[:1]:
        name, factor = max(each.shrinks.items(), key=lambda pair: pair[1])
        gain = f"ten of them shorten the interval of {name} {factor:.2g} times"
        if not fit[name].bounded:
            gain = f"they tell most of {name}, which these throws do not bound"
        where = "the left corner at" if fit.rows.throws.corner else "x ="
        lines.append(f"film next: throws from {where} {each.x:.3g} {unit} on side {each.side}; {gain}")
    return lines
