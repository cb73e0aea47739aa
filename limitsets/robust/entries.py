"""One line of a tolerance sheet: a margin as plain data, which a file can hold and give back.

A `Margin` has the cells of its proof with it; a sheet has thousands of times less: the bracket, the orbit at its upper
end, and the names of the files that prove both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from limitsets.goals import Goal
from limitsets.proofs.asked import State
from limitsets.robust.margins import Margin
from limitsets.scene import Scene

__all__ = ["Entry", "goal_record", "nominal_of", "percent_of"]


@dataclass(frozen=True)
class Entry:
    """How much one quantity of a scene, or all of its tolerance, may deviate.

    Attributes
    ----------
    quantity : str
        Its name; "joint" for all of the tolerance together.
    reading : str
        "fixed" (but unknown), "per-throw" (another one at every throw), or "tolerance" for joint.
    goal : tuple of dict
        What has to hold, all of it.
    proved : float
        Proved for every deviation up to this; 0 if for none.
    refuted : float or None
        At this deviation an orbit violates the goal; None if no such deviation is found.
    unit : str
        Of both; "" for joint, a factor on the tolerance.
    nominal : float or None
        The value about which it deviates, in `nominal_unit`.
    nominal_unit : str
        Its unit.
    closed : bool
        Whether the two ends are as close as was asked.
    reason : str
        Why there is no upper end, or why the ends are farther apart; empty otherwise.
    violated : dict or None
        Which goal the orbit violates.
    counterexample : tuple of dict
        The orbit: x, the interval that holds it, side, parameters of the throw; empty without one.
    certificate, against : str or None
        Names of the files of the proof and of the counterexample; None where there is none.
    seconds : float
        Time it took.
    """

    quantity: str
    reading: str
    goal: tuple[dict[str, Any], ...]
    proved: float
    refuted: float | None
    unit: str
    nominal: float | None
    nominal_unit: str
    closed: bool
    reason: str
    violated: dict[str, Any] | None
    counterexample: tuple[dict[str, Any], ...]
    certificate: str | None
    against: str | None
    seconds: float

    @property
    def key(self) -> str:
        """What tells it from the other lines of a sheet."""
        return f"{self.quantity} {self.reading}"

    @classmethod
    def of(cls, margin: Margin, files: Sequence[str | None] = (None, None)) -> Entry:
        """Write a margin down, with the names of its two files."""
        against = margin.against
        nominal, unit = nominal_of(margin.scene, margin.quantity)
        found = against is not None and against.refuted is not None
        return cls(
            margin.quantity,
            margin.reading,
            tuple(goal_record(goal) for goal in margin.goals),
            margin.proved,
            margin.refuted,
            margin.unit,
            nominal,
            unit,
            margin.closed,
            margin.reason,
            goal_record(against.refuted) if found else None,  # type: ignore[union-attr, arg-type]  # found says so
            _orbit(margin),
            files[0],
            files[1],
            margin.seconds,
        )

    @classmethod
    def read(cls, record: Mapping[str, Any]) -> Entry:
        """Read what `to_json` wrote."""
        found = cls(**record)
        return replace(found, goal=tuple(found.goal), counterexample=tuple(found.counterexample or ()))

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON."""
        record = asdict(self)
        return record | {
            "goal": list(self.goal),
            "counterexample": list(self.counterexample) or None,
        }


def goal_record(goal: Goal) -> dict[str, Any]:
    """Write a goal as a table of plain values: kind, and what it says; of a predicate its name.

    Examples
    --------
    >>> from limitsets.goals import OrientedBeyond
    >>> goal_record(OrientedBeyond(20.0, 2))
    {'kind': 'oriented_beyond', 'x': 20.0, 'side': 2, 'from_anywhere': False}
    """
    plain = {name: value for name, value in vars(goal).items() if not callable(value)}
    return {"kind": goal.kind} | {
        name: list(value) if isinstance(value, tuple) else value for name, value in plain.items()
    }


def nominal_of(scene: Scene, quantity: str) -> tuple[float | None, str]:
    """Find the value of a quantity as people say it, and its unit; None for what has none."""
    from limitsets.scene.quantities import find
    from limitsets.scene.units import parse

    if quantity in ("joint", "landing.x"):
        return None, scene.unit
    place = find(quantity)
    node: Any = scene.text
    for word in place.path:
        known = word in node if isinstance(node, Mapping) else isinstance(word, int) and word < len(node)
        if not known:
            break
        node = node[word]
    else:
        given = parse(node, place.dimension)
        return float(given.number), given.unit
    if quantity == "throw.speed" and scene.gravity is not None:
        return math.degrees(math.sqrt(scene.gravity / scene.kappa)), "deg/s"
    return None, scene.unit


def percent_of(entry: Entry, size: float | None) -> float | None:
    """Give a deviation in percent of the value; None where there is no value, or it is 0."""
    if size is None or entry.unit == "%":
        return size
    if not entry.nominal or entry.unit == "":
        return None
    if entry.unit != entry.nominal_unit:
        from limitsets.scene.units import exact_factor

        size *= float(exact_factor(entry.unit, entry.nominal_unit))
    return 100.0 * size / abs(entry.nominal)


def _orbit(margin: Margin) -> tuple[dict[str, Any], ...]:
    """Write the orbit that refutes, as `limitsets.certify` writes its own."""
    against = margin.against
    if against is None:
        return ()
    fixed: dict[str, Any] = {} if against.piece is None else dict(against.piece.texts())
    return tuple(
        {
            "x": state.lo if state.lo == state.hi else 0.5 * (state.lo + state.hi),
            "between": [state.lo, state.hi],
            "side": state.side,
            "parameters": None if state.kappa is None else fixed | _thrown(state, margin.scene.unit),
        }
        for state in against.counterexample
    )


def _thrown(state: State, unit: str) -> dict[str, str]:
    found = {"throw.kappa": f"{state.kappa!r} {unit}"}
    if state.landing is not None:
        found["landing.x"] = f"{state.landing!r} {unit}"
    return found
