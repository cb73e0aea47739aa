"""A margin, and what others get of it: plain tables for JSON, certificates, the orbit that refutes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from pathlib import Path
from typing import Any

from limitsets.base import AnswerError, Column, LimitsetsError, Table, Tabled, as_table, picked
from limitsets.feeder.goals import Goal, OrientedBeyond, Predicate, as_written, by_side
from limitsets.feeder.scene import Model, Scene
from limitsets.feeder.scene.units import exact_factor
from limitsets.parameters.margins.deviations import nominal_of
from limitsets.proofs.prover.certificate import DeniedError
from limitsets.proofs.prover.goals import State
from limitsets.proofs.prover.proof import KINDS, Proof, require_checkable, write_refutation
from limitsets.proofs.prover.query import Outcome, joined_claims

# ----------------------------------------------------------------
# A margin as text: a size with its unit, rounded to the safe side, and goals that hold vacuously.


NOT_FOUND = "it was not found"
"""How the reason begins where the search for a margin ends with an error."""

REFUTED = ".refuted.zip"
"""How the name ends of a file that refutes."""


def bound(value: float | None, unit: str = "", *, up: bool = False) -> str:
    """Write a size with four digits, rounded so that it claims no more than is known; a dash for none.

    Examples
    --------
    >>> bound(0.395408203, "%"), bound(0.397675781, "%", up=True), bound(None)
    ('0.3954 %', '0.3977 %', '-')
    """
    if value is None:
        return "-"
    if value == 0:
        return f"0 {unit}".rstrip()
    context = Context(prec=4, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return f"{context.create_decimal(Decimal(repr(value))):f} {unit}".rstrip()


def failing(value: float | None, unit: str, direction: str | None) -> str:
    """Write from where on a goal is shown to fail, and whether at a greater or a smaller value of the quantity.

    Examples
    --------
    >>> failing(0.733543, "%", "less"), failing(0.107, "in", None), failing(None, "in", None)
    ('0.7336 % less', '0.107 in', '-')
    """
    return f"{bound(value, unit, up=True)} {direction or ''}".rstrip()


def failure(error: Exception) -> str:
    """Say which error a search ended with.

    Examples
    --------
    >>> failure(ZeroDivisionError())
    'it was not found: this is a bug in limitsets: ZeroDivisionError'
    """
    if isinstance(error, LimitsetsError):
        return f"{NOT_FOUND}: {error}"
    words = ": ".join(filter(None, (type(error).__name__, str(error))))
    return f"{NOT_FOUND}: this is a bug in limitsets: {words}"


def bound_above(value: float) -> str:
    """Write what is refuted from here on, without its unit."""
    return bound(value, up=True)


def reach_of(pieces: Sequence[Outcome]) -> float | None:
    """Give the farthest x of the attracting cells of all proved pieces; None if no piece is proved."""
    cells = [piece.found.cells.extents() for piece in pieces if piece.found is not None]
    return max((hi for each in cells for parts in each.values() for _, hi in parts), default=None)


def void_of(goals: Sequence[Goal], reach: float | None, unit: str) -> str:
    """Say which goal holds only because no part gets to where it is asked; empty where none does.

    Examples
    --------
    >>> void_of([OrientedBeyond(25.0, 2)], 23.41, "in")
    'no part gets beyond x = 25 in: the attracting cells end at x = 23.41 in'
    """
    limits = [goal.x for goal in goals if isinstance(goal, OrientedBeyond) and not goal.from_anywhere]
    for x in limits:
        if reach is not None and reach <= x:
            return f"no part gets beyond x = {x:g} {unit}: the attracting cells end at x = {reach:.7g} {unit}"
    return ""


@dataclass(frozen=True, eq=False)
class Margin(Tabled):
    """How much one quantity of a scene, or all of its tolerance, may deviate.

    Attributes
    ----------
    quantity : str
        Its name; "joint" for all of the tolerance together.
    reading : str
        "fixed" (but unknown), "per-throw" (another one at every throw), or "tolerance" for joint.
    goals : tuple of Goal
        What has to hold: all of them.
    proved : float
        The goals are proved for every deviation up to this; 0 if for none.
    refuted : float or None
        At this deviation an orbit violates a goal; None if no such deviation is found.
    unit : str
        Of both: "%" of the value, a length or an angle; "" for joint, a factor on the tolerance.
    nominal : float or None
        The value about which it deviates; of a length or angle in its `unit`.
    reason : str
        Why there is no upper end, or why the two are farther apart than asked; empty if they are not.
    closed : bool
        Whether they are as close as was asked.
    seconds : float
        Time it took.
    scene : Scene
        The scene.
    tolerance : dict of str to str
        Of joint: the deviations of which `proved` and `refuted` are factors; empty otherwise.
    deviations, noise : dict of str to str
        What may be fixed but unknown and what differs at every throw, as it is proved, as `limitsets.certify` takes it.
    pieces : tuple of Outcome
        What proves it.
    against : Outcome or None
        What refutes it.
    direction : str or None
        "more" or "less": whether the value at which it is refuted is greater or smaller than the scene's; None where a
        deviation is no single value, or none is refuted.
    files : tuple of str
        Names of the files that prove it, and of the one that refutes it, where they are written.
    """

    quantity: str
    reading: str
    goals: tuple[Goal, ...]
    proved: float
    refuted: float | None
    unit: str
    nominal: float | None
    reason: str
    closed: bool
    seconds: float
    scene: Scene
    tolerance: dict[str, str]
    deviations: dict[str, str]
    noise: dict[str, str]
    pieces: tuple[Outcome, ...] = field(repr=False)
    against: Outcome | None = field(repr=False)
    direction: str | None = None
    files: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether the goals hold without any deviation."""
        return self.proved > 0.0

    @property
    def given(self) -> tuple[float | None, str]:
        """The value as the scene gives it, and its unit; None for what has none."""
        return nominal_of(self.scene, self.quantity)

    @property
    def counterexample(self) -> tuple[State, ...]:
        """The orbit that violates a goal, every state enclosed; empty if there is none."""
        return () if self.against is None else self.against.counterexample

    @property
    def violated(self) -> Goal | None:
        """The goal that the orbit violates."""
        return None if self.against is None else self.against.refuted

    @property
    def model(self) -> Model:
        """Of which model the margin is, and which facts of the scene that leaves out."""
        return Model.of(self.scene)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        shown = Column("proved safe up to", show=bound), Column("shown to fail from", show=bound_above)
        value = Column("value", show=".6g"), "value_unit"
        columns = ("quantity", "reading", *shown, "unit", *value, "direction", "not simulated")
        unit = self.unit or "times the tolerance"
        nominal, of = self.given
        about = nominal, None if nominal is None else of
        left_out = ", ".join(self.model.left_out) or None
        row = (self.quantity, self.reading, self.proved, self.refuted, unit, *about, self.direction, left_out)
        how = f"brackets: proved below, refuted above; {self.model.sentence}"
        return (Table(columns, [row], f"{self.scene.name}: margins", how),)

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON; every number is finite or null."""
        goals = [goal_table(goal, self.scene.unit) for goal in self.goals]
        return as_table(
            **picked(self, "quantity", "reading"),
            goal=goals[0] if len(goals) == 1 else goals,
            **picked(self, "proved", "refuted", "direction"),
            unit=self.unit or None,
            **picked(self, "nominal", "closed"),
            reason=self.reason or None,
            counterexample=self.orbit or None,
            certificate=self.files or None,
            **picked(self, "deviations", "noise"),
            pieces=len(self.pieces),
            model=self.model,
            timings={"margin": self.seconds},
        )

    @property
    def orbit(self) -> list[dict[str, Any]]:
        """The counterexample as plain tables: x, the interval that holds it, side, parameters of the throw."""
        against = self.against
        if against is None:
            return []
        fixed: dict[str, Any] = {} if against.piece is None else dict(against.piece.texts())
        return [_state(state, fixed, self.scene.unit) for state in against.counterexample]

    @property
    def stem(self) -> str:
        """Name of its files: scene, quantity, reading."""
        quantity = re.sub(r"[^A-Za-z0-9]+", "-", self.quantity).strip("-")
        return f"{self.scene.name}-{quantity}-{self.reading}".replace(" ", "-")

    def save(self, folder: str | Path, *, recheck: bool = True) -> tuple[Path, ...]:
        """Write what `limitsets.recheck` checks: a certificate for each goal, and the orbit that refutes one.

        Parameters
        ----------
        folder : str or Path
            Where; it is made.
        recheck : bool
            Whether to have each checked before it gets its name.

        Raises
        ------
        AnswerError
            Effects are on, which no recheck knows, or a goal is a function of the caller's.
        DeniedError
            The checker does not confirm one: it is kept as NAME.denied.zip.
        """
        effects = [name for name in self.scene.effects.on() if name != "spread"]
        require_checkable(effects, self.goals, "the margin stands")
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        stem, written = self.stem, []
        attractions = tuple(piece.found for piece in self.pieces if piece.found is not None)
        for goal, claim in zip(self.goals if attractions else (), joined_claims(self.pieces), strict=True):
            proof = Proof(self.scene, self.noise, self.deviations, attractions, (claim,), self.seconds)
            last = f"-{goal.kind.replace('_', '-')}" if len(self.goals) > 1 else ""
            written.append(proof.save(folder / f"{stem}{last}.proof.zip", recheck=recheck))
        against = self.against
        if against is not None and against.found is not None and against.refuted is not None:
            states, recurs = against.counterexample, against.answers[0].recurs
            if any(word in recurs for word in KINDS):
                path = folder / f"{stem}{REFUTED}"
                about = against.found, against.refuted, states, recurs, against.within, self.scene
                write_refutation(path, *about, recheck=recheck)
                written.append(path)
        return tuple(written)

    def without_cells(self) -> Margin:
        """Leave out the cells of the proofs: thousands of times as large as all else."""
        pieces = tuple(replace(piece, found=None, answers=()) for piece in self.pieces)
        against = None if self.against is None else replace(self.against, found=None, answers=())
        return replace(self, pieces=pieces, against=against)


def percent_of(margin: Margin, size: float | None) -> float | None:
    """Give a deviation in percent of the value; None where there is no value, or it is 0."""
    if size is None or margin.unit == "%":
        return size
    nominal, unit = margin.given
    if not nominal or margin.unit == "":
        return None
    return 100.0 * size * float(exact_factor(margin.unit, unit)) / abs(nominal)


def in_unit_of(margin: Margin, size: float, unit: str) -> float | None:
    """Give a deviation in another unit, percent included; None where a percentage has no value to be one of."""
    if margin.unit == unit:
        return size
    if unit == "%":
        return percent_of(margin, size)
    if margin.unit != "%":
        return size * float(exact_factor(margin.unit, unit))
    nominal, of = margin.given
    return None if nominal is None else 0.01 * size * abs(nominal) * float(exact_factor(of, unit))


def goal_table(goal: Goal, unit: str) -> dict[str, Any]:
    """Give a goal as a scene would name it; a function by its name."""
    if isinstance(goal, Predicate):
        laid = {"laid": by_side(goal.laid)} if goal.laid else {}
        return {"predicate": goal.name, "from_anywhere": goal.from_anywhere} | laid
    return as_written(goal, unit)


def _state(state: State, fixed: dict[str, Any], unit: str) -> dict[str, Any]:
    thrown = dict(fixed)
    if state.kappa is not None and "throw.kappa" not in thrown:
        thrown["throw.kappa"] = f"{state.kappa!r} {unit}"
    if state.landing is not None:
        thrown["landing.x"] = f"{state.landing!r} {unit}"
    return state.to_json() | {"parameters": thrown if state.kappa is not None else None}


def settled(margin: Margin, folder: Path, *, recheck: bool = True) -> Margin:
    """Write a margin's files; the margin with their names, without what the checker denies, for that is undecided.

    Where effects are on, or a goal is code, nothing rechecks it: the margin stands without files.
    """
    try:
        return replace(margin, files=tuple(path.name for path in margin.save(folder, recheck=recheck)))
    except DeniedError as error:
        reason = f"{error}"
        left = replace(margin, proved=0.0, pieces=(), closed=False, reason=reason)
        if "refuted" in error.claims:
            left = replace(margin, refuted=None, against=None, closed=False, reason=reason)
        return settled(left, folder, recheck=recheck)
    except AnswerError:
        return margin
