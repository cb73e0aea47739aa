"""Goals as sentences."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from limitsets.errors import AnswerError
from limitsets.goals import Goal, OrientedBeyond, Reaches, StaysOnArm, laid_words, unknown_goal
from limitsets.proofs.simulated import simulated
from limitsets.proposals import proposed
from limitsets.report.tables import percent

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limitsets.analysis import Analysis, GoalOutcome
    from limitsets.proofs import Proof
    from limitsets.scene import Scene

# So many times as many cells are proposed where starts are undecided, up to the last.
FINER, MOST_CELLS = 4, 1_000_000

# Of a sum of shares.
ROUNDING = 1e-9


def goal_sentence(goal: Goal, unit: str) -> str:
    """Say what a goal asks, and of what.

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
    """Say what became of a goal: where it holds, of what, and which share of the starts comes there.

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
    """Say the same of a goal that was judged otherwise, on so many limit sets."""
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
    """Name the command that goes on from an analysis with a goal: prove it, find what can deviate, or a design.

    Examples
    --------
    >>> import limitsets as ls
    >>> next_command(ls.analyse("paper-initial", 1024))
    'limitsets design paper-initial --goal (a scene that meets it: centre of mass, throw and surface moved)'
    """
    outcome, scene = analysis.goal, analysis.scene
    source = _source(scene)
    assert outcome is not None
    if analysis.choice.tipping:  # which no other command switches on
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
    """Whether there are proofs about a scene: not with effects that nothing encloses."""
    try:
        simulated(scene)
    except AnswerError:
        return False
    return True


def _speeds(scene: Scene) -> tuple[str, ...]:
    """Write an axis of an atlas from half to twice the speed that a scene gives; empty where it gives none."""
    given = scene.text["throw"].get("speed")
    if given is None:
        return ()
    value = float(given.split()[0])
    return "--x", f"throw.speed={0.5 * value:g}:{2.0 * value:g}:100"


def after_undecided(analysis: Analysis) -> str:
    """Name the command that decides more starts; empty where none is undecided, or more cells do not help.

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
    """Name the command that goes on from a proof in which a claim is not proved."""
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
    """Name the command that goes on from a scene without margins: its goal fails, or is not proved of it."""
    analysed = proposed("analyse", _source(scene))
    starts = f"{analysed} (which starts leave the arm: margins need a scene in which none does)"
    if can_be_proved(scene):
        starts = f"{proposed('certify', _source(scene))} (what is proved of it, and what is not), {starts}"
    return (design_command(scene, goals) if fails else "") or starts


def design_command(scene: Scene, goals: Sequence[Goal]) -> str:
    """Name the command that looks for a scene that meets a goal; empty where there is none for it."""
    if scene.effects.on() or not any(isinstance(goal, OrientedBeyond | Reaches) for goal in goals):
        return ""
    words = "a scene that meets it: centre of mass, throw and surface moved"
    return f"{proposed('design', _source(scene), '--goal')} ({words})"


def _source(scene: Scene) -> str:
    return scene.file or f"{scene.name}.toml"


def void_of(outcome: GoalOutcome, unit: str, spread: str | None) -> str:
    """Say where a goal that holds speaks of nothing; empty where it does not.

    With `spread` the scene scatters its throws, and the limit set is that without scatter.

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
