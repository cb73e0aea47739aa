"""Run all parts of a tolerance sheet one after the other."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limitsets.base import AnswerError, Progress, arguments_checked, as_json, replaced, shown_in_notebooks
from limitsets.feeder.goals import Goal, OrientedBeyond, Predicate, Reaches, by_side
from limitsets.feeder.scattering import Scattering
from limitsets.feeder.scene import WITHOUT_SCATTER, LaidLike, Scene, load
from limitsets.parameters.margins.deviations import (
    DeviationScale,
    Tolerance,
    deviation_scale,
    deviation_scales,
)
from limitsets.parameters.margins.joint import joint_margin
from limitsets.parameters.margins.margin_result import Margin, failure, reach_of, settled
from limitsets.parameters.margins.single import GoalLike, MarginsBeyond, goals_of, margin
from limitsets.parameters.noise.statistics import (
    CELLS,
    FACTORS,
    Levels,
    NoiseStatistics,
    noise_levels,
    noise_statistics,
)
from limitsets.parameters.sheet.summary import PARTS, Robustness, curve, noise_of, row_of, still
from limitsets.proofs.prover.query import Query

if TYPE_CHECKING:
    from limitsets.proofs.auditing import Audit


NO_TOLERANCE = (
    "the scene has no [tolerance]; give it one, a deviation for each quantity that deviates together with others: "
    '"throw.speed" = "1 %"'
)
NO_NOISE = (
    'no noise is given; add scatter = { speed = "0.5 %" } to [world], '
    "or pass it: --scatter throw.speed='0.5 %'"
)
NO_PLACE = "it is asked for goals with an x and a side, oriented_beyond or reaches"

# Files of a report's folder: what is known of the sheet, and what proves it.
RECORD, CERTIFICATES = "robustness.json", "certificates"

# For the proofs; of what is left the share for the joint margin; how many times as many for the noise.
SECONDS, FOR_JOINT, FOR_NOISE = 12.0, 0.5, 5.0


class _SheetRun:
    """One sheet while it is put together."""

    def __init__(
        self,
        scene: Scene,
        goals: tuple[Goal, ...],
        todo: Sequence[DeviationScale],
        tolerance: dict[str, str],
        folder: Path | None,
        recheck: bool,
        progress: Progress,
        seconds: float,
        executor: Executor | None,
    ) -> None:
        self.seconds, self.executor = seconds, executor
        self.end: float | None = None
        self.scene, self.goals, self.todo, self.tolerance = scene, goals, todo, tolerance
        self.folder, self.recheck, self.progress = folder, recheck, progress
        self.margins: list[Margin] = []
        self.left_out: dict[str, str] = {}
        self.done, self.steps = 0, 1

    def tell(self, step: str, share: float = 0.0) -> None:
        """Say what is being done."""
        self.progress(step if not share else f"{step}, {100 * share:.0f} %", self.done, self.steps)

    @contextmanager
    def step(self, words: str) -> Iterator[None]:
        """One of the steps: said when it begins, counted when it is done."""
        self.tell(words)
        yield
        self.done += 1

    def left(self) -> float:
        """Seconds that are left for the joint margin and the curve; they count from the first question on."""
        if self.end is None:
            self.end = time.perf_counter() + self.seconds
        return max(self.end - time.perf_counter(), 0.0)

    def keep(self, margin: Margin) -> None:
        """Take a margin into the sheet, whose files are written."""
        self.margins.append(margin)
        self.write()

    def write(self, places: MarginsBeyond | None = None) -> None:
        """Write the margins that are known into the folder, so that an interruption loses none of them."""
        if self.folder is None:
            return
        rows = [row_of(margin) for margin in self.margins]
        record = {"complete": False, "scene": self.scene.as_dict(), "margins": rows, "curve": places}
        with replaced(self.folder) as draft:
            (draft / RECORD).write_text(as_json(record), encoding="utf-8", newline="\n")

    def singles(self, width: float, verdict: str) -> None:
        """Find the margins of single quantities."""
        answers = self._answers(width, verdict)
        for one in self.todo:
            label = f"margin of {one.quantity}, {one.reading}"
            with self.step(label):
                answer = next(answers)
                if isinstance(answer, str):
                    self.left_out[label] = answer
                else:
                    self.keep(answer)

    def _answers(self, width: float, verdict: str) -> Iterator[Margin | str]:
        """Ask for margins, one after the other, or on the executor; it is not handed goals that are code.

        A search that ends with an error answers with the text of the error.
        """
        ask = partial(_single, self.scene, self.goals, width, self.folder, self.recheck)
        tried = partial(_tried, ask)
        if verdict != "proved":  # no deviation is small enough, whatever the quantity
            first = ask(self.todo[0], self.tell)
            for one in self.todo:
                own = replace(first, quantity=one.quantity, reading=one.reading, unit=one.unit)
                yield replace(own, nominal=one.about, seconds=0.0)
        elif (
            self.executor is None
            or len(self.todo) < 2
            or any(isinstance(goal, Predicate) for goal in self.goals)
        ):
            yield from (tried(one, self.tell) for one in self.todo)
        else:
            yield from self.executor.map(tried, self.todo)

    def joint(self, width: float) -> None:
        """Find the factor on the tolerance."""
        label = "margin of all together"
        with self.step(label):
            seconds = FOR_JOINT * self.left()
            try:
                factor = joint_margin(
                    self.scene,
                    self.goals,
                    self.tolerance,
                    width=width,
                    seconds=seconds,
                    tell=lambda share: self.tell(label, share),
                )
                self.keep(_written(factor, self.folder, self.recheck))
            except Exception as error:  # noqa: BLE001 - it is told, the rest goes on
                self.left_out["joint"] = failure(error)

    def curve(self, side: int) -> MarginsBeyond | None:
        """Find margins against X; None where the part gets farther out on another side."""
        seconds = self.left()
        laid: Any = {int(on): pairs for on, pairs in by_side(self.goals[0].laid).items()}
        with self.step("margins against X"):
            try:
                margins, left = curve(
                    self.scene,
                    side,
                    self.tolerance,
                    laid=laid or None,
                    seconds=seconds,
                    executor=self.executor,
                    tell=self.tell,
                    keep=self.write,
                )
            except Exception as error:  # noqa: BLE001 - it is told, the rest goes on
                self.left_out["curve"] = str(error) if isinstance(error, AnswerError) else failure(error)
                return None
        if left:
            words = f"there was no time for {left} more places; more seconds take them along"
            self.left_out["rest of the curve"] = words
        return margins

    def audit(self) -> Audit:
        """Ask which assumptions of the model the scene breaks."""
        from limitsets.proofs.auditing import audit

        with self.step("assumptions"):
            return audit(self.scene)

    def chance(
        self, scene: Scene, noise: Scattering, place: tuple[float, int], cells: int
    ) -> tuple[NoiseStatistics, Levels]:
        """Find what noise does, at its level and at others."""

        def told(_: str, done: int, of: int) -> None:
            self.tell("noise", done / of)

        with self.step("noise"):
            seconds = FOR_NOISE * self.seconds
            end = time.perf_counter() + seconds
            statistics = noise_statistics(
                scene, noise, goal=place, cells=cells, seconds=seconds, progress=told
            )
        with self.step("noise at other levels"):
            seconds = max(end - time.perf_counter(), 0.0)
            levels = noise_levels(scene, noise, goal=place, cells=max(cells // 2, 1), seconds=seconds)
        late = [] if statistics.errors else ["how its numbers change on halving"]
        late += [
            f"what more noise of {name} changes"
            for name in noise.given()
            if name not in statistics.sensitivity
        ]
        if beyond := FACTORS[levels.factors.size :]:
            late.append(f"noise {' and '.join(f'{factor:g}' for factor in beyond)} times as large")
        if late:
            words = f"there was no time for {', '.join(late)}; more seconds take them along"
            self.left_out["rest of the noise"] = words
        return statistics, levels


def _single(
    scene: Scene,
    goals: tuple[Goal, ...],
    width: float,
    folder: Path | None,
    recheck: bool,
    one: DeviationScale,
    tell: Callable[[str], None] | None = None,
) -> Margin:
    """Find the margin of one quantity and write its files; called in other processes, too."""
    told = None if tell is None else lambda step, _, __: tell(step)
    (answer,) = margin(scene, one.quantity, reading=one.reading, goal=goals, width=width, progress=told)
    return _written(answer, folder, recheck)


def _written(margin: Margin, folder: Path | None, recheck: bool) -> Margin:
    """Write a margin's proof and counterexample into a report's folder, and leave their cells there."""
    if folder is not None:
        margin = settled(margin, folder / CERTIFICATES, recheck=recheck)
        margin = replace(margin, files=tuple(f"{CERTIFICATES}/{name}" for name in margin.files))
    return margin.without_cells()


def _tried(ask: Callable[..., Margin], *about: Any) -> Margin | str:
    """Ask for a margin; where that ends with an error, say which, so that the others are not lost."""
    try:
        return ask(*about)
    except Exception as error:  # noqa: BLE001 - it is told, the rest goes on
        return failure(error)


def _goals(
    scene: Scene, goal: GoalLike | Sequence[GoalLike] | None, laid: LaidLike | None
) -> tuple[Goal, ...]:
    if goal is None and scene.goal is None:
        x, last = 0.7 * scene.arm_length, len(scene.sides) - 1
        example = f'oriented_beyond = {{ x = "{x:.4g} {scene.unit}", side = {last} }}'
        remedy = f"say what has to hold: add [goal] with, for instance, {example}"
        raise AnswerError("the goal", None, "a scene with [goal]", remedy, key="goal", file=scene.file)
    return goals_of(scene, goal, laid)


def _todo(scene: Scene, quantities: Sequence[str], reading: str | None) -> list[DeviationScale]:
    """List what is asked of single quantities; refuse what the scene does not give."""
    every = deviation_scales(scene, reading)
    chosen: list[DeviationScale] = []
    for name in dict.fromkeys(quantities):
        least = deviation_scale(scene, name, reading)
        chosen += [one for one in every if one.quantity == name] or [least]
    return chosen or list(every)


@shown_in_notebooks
@arguments_checked
def robustness(
    scene: Scene | str | Path,
    *quantities: str,
    goal: GoalLike | Sequence[GoalLike] | None = None,
    laid: LaidLike | None = None,
    reading: str | None = None,
    tolerance: Mapping[str, str] | None = None,
    scatter: Scattering | None = None,
    width: float = 0.01,
    cells: int = CELLS,
    leave_out: Sequence[str] = (),
    seconds: float = SECONDS,
    folder: str | Path | None = None,
    recheck: bool = True,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Robustness:
    """Say how far a scene may drift before its goal fails, and what noise does to it.

    Parameters
    ----------
    scene : Scene, str or Path
        A scene, or what `limitsets.load` takes.
    *quantities : str
        Names of quantities; default all that the scene gives.
    goal : Goal, callable, or a sequence of them, optional
        What has to hold, all of it; default the scene's goal.
    laid : mapping of int to sequence of (float, float), optional
        By side the ranges of x where parts are laid down, as for `limitsets.certify`: the goal's starts are these.
        Default: the whole arm.  The noise keeps the whole arm.
    reading : str, optional
        "fixed" or "per-throw"; default both, of each quantity those that it has.
    tolerance : mapping of str to str, optional
        Deviations that the joint margin is a factor on, ``{"throw.speed": "1 %"}``; default the scene's.
    scatter : Scattering, optional
        Noise at every throw with its laws; default that of the scene's world, normal unless the scene says "bounded".
    width : float
        How close the two ends of a bracket have to be, as a share of the upper one.
    cells : int
        Cells per side for the noise.
    leave_out : sequence of str
        Which of "margins", "joint", "curve", "noise" and "audit" not to do.
    seconds : float
        Shared by the proof of the joint margin and those of the curve: what they prove by then counts.  The noise has
        five times as many: no solution but its first is begun that is likely to end later, and `left_out` says which
        were not.  The margins of single quantities and the audit take what they take.
    folder : str or Path, optional
        Margins are written there as they are found, with their certificates, so that an interrupted run leaves them.
        Another run begins anew and replaces the files.
    recheck : bool
        Whether certificates are checked before they get their names.
    executor : Executor, optional
        Where the margins of single quantities and those against X are searched for; default, here.  Goals that are
        functions stay here.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Returns
    -------
    Robustness
        Margins are proved and refuted, statistics of noise computed, an audit as it says.

    Raises
    ------
    AnswerError
        No goal, a scene of which nothing can be proved, a quantity that it does not give.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.robustness("paper-designed", "throw.speed", reading="fixed", leave_out=["curve", "audit"])
    >>> found.entries[0].proved < 0.733 < found.entries[0].refuted, found.entries[0].unit
    (True, '%')
    """
    begin = time.perf_counter()
    if not seconds >= 0.0:
        raise AnswerError("the seconds", seconds, "0 or more", "allow for some time")
    for part in leave_out:
        if part not in PARTS:
            raise AnswerError("what to leave out", part, ", ".join(PARTS), "correct the word")
    given = load(scene)
    goals, quiet = _goals(given, goal, laid), still(given)
    query = Query.of(quiet, goals)
    query.box(None, {})  # refuses a scene of which nothing can be proved
    todo = _todo(query.scene, quantities, reading)
    vector = dict(tolerance if tolerance is not None else given.text.get("tolerance", {}))
    if vector:
        Tolerance.of(query.scene, vector)  # refuses what the scene does not give
    noise, law = noise_of(given, scatter)
    told = progress or (lambda step, done, of: None)
    sheet = _SheetRun(
        quiet,
        goals,
        todo,
        tolerance=vector,
        folder=None if folder is None else Path(folder),
        recheck=recheck,
        progress=told,
        seconds=seconds,
        executor=executor,
    )
    try:
        return _filled(
            sheet,
            given,
            noise,
            law=law,
            width=width,
            cells=cells,
            leave_out=frozenset(leave_out),
            begin=begin,
        )
    except KeyboardInterrupt as error:
        if folder is not None:
            error.add_note(f"the margins found so far are in {Path(folder) / RECORD}")
        raise


def _filled(
    sheet: _SheetRun,
    given: Scene,
    noise: Scattering | None,
    law: str,
    width: float,
    cells: int,
    leave_out: frozenset[str],
    begin: float,
) -> Robustness:
    """Compute the sheet part by part; for each part left out, say why."""
    scene, goals = sheet.scene, sheet.goals
    # x and side of the rests that count as fed
    place = next(((goal.x, goal.side) for goal in goals if isinstance(goal, OrientedBeyond | Reaches)), None)
    missing = sheet.left_out
    missing |= {part: "it was not asked for" for part in PARTS if part in leave_out}
    if not sheet.tolerance:
        missing.setdefault("joint", NO_TOLERANCE)
    if noise is None:
        missing.setdefault("noise", NO_NOISE)
    if place is None:
        missing |= {part: NO_PLACE for part in ("curve", "noise") if part not in leave_out}
    sheet.steps = (len(sheet.todo) if "margins" not in missing else 0) + 1
    sheet.steps += sum(part not in missing for part in ("joint", "curve", "audit")) + 2 * (
        "noise" not in missing
    )
    with sheet.step("the goal in the scene as it is"):
        query = Query.of(scene, goals)
        nominal = query.prove()
        verdict = nominal.verdict if nominal.verdict == "proved" else query.refute().verdict
    if "margins" not in missing:
        sheet.singles(width, verdict)
    if "joint" not in missing:
        sheet.joint(width)
    against = None if "curve" in missing or place is None else sheet.curve(place[1])
    statistics, levels = None, None
    if "noise" not in missing and noise is not None and place is not None:
        statistics, levels = sheet.chance(given, noise, place, cells)
    flagged = None if "audit" in missing else sheet.audit()
    return Robustness(
        scene=scene,
        goals=goals,
        verdict=verdict if scene == given else f"{verdict} {WITHOUT_SCATTER}",
        reach=reach_of([nominal]) if verdict == "proved" else None,
        entries=tuple(sheet.margins),
        tolerance=sheet.tolerance,
        curve=against,
        noise=statistics,
        levels=levels,
        law=law,
        audit=flagged,
        left_out=missing,
        width=width,
        seconds=time.perf_counter() - begin,
    )
