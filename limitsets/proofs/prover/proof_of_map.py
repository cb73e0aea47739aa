"""What was proved of a map: claims, attracting cells, orbits; its tables and its certificate."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import (
    Column,
    Table,
    as_table,
    bands_of,
    picked,
)
from limitsets.base.arrays import Array, Arrays
from limitsets.proofs.prover.averages import Average, rows_of
from limitsets.proofs.prover.certificate import Saved, require_proved
from limitsets.proofs.prover.certificate_of_map import (
    Numbers,
    Part,
    Targets,
    cells_of,
    hexed,
    targets_of,
    widened,
    write_map,
)
from limitsets.proofs.prover.converging import attracting_frames
from limitsets.proofs.prover.entropies import Entropy
from limitsets.proofs.prover.goal_of_map import GoalOfMap
from limitsets.proofs.prover.leaving_of_map import exits_of, targets_beyond, weights_of
from limitsets.proofs.prover.orbits_of_map import CycleOfMap, is_unstable_in_file, slopes_of, slopes_on
from limitsets.proofs.prover.programs import begins_of
from limitsets.proofs.prover.proof import Claim, left_of, without
from limitsets.systems.cells import CellSet
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.maps import kind_of
from limitsets.systems.sets.basin import passing

# Claims about slopes: slopes are derived automatically even where the map gives its own boxes.
OF_SLOPES = ("all-cycles", "almost-every", "average", "converges", "cycles", "entropy", "expanding")


@dataclass(frozen=True, eq=False)
class ProofOfMap(Saved):
    """What was proved of a map on a grid.

    Attributes
    ----------
    map, upper : NamedTuple
        The corners of the parameters.
    graph : TransitionGraph
        Cells and enclosed images.
    component : ndarray of int32, shape (n_cells,)
        Number of the attracting component of each cell, -1 outside.
    claims : tuple of Claim
        One per claim asked for.
    cycles : tuple of CycleOfMap
        The periodic orbits that are proved, if "cycles" was asked for.
    seconds : float
        Time it took.
    goal : GoalOfMap or None
        What "ends-in" says, if boxes were given.
    final : ndarray of int32, shape (n_cells,), or None
        If "converges" was asked for: the cells whose orbits tend to the first cycle with a ball (0), the second (1)
        and so on, -1 elsewhere.
    average : Average or None
        If `limitsets.average` was asked: the bounds, and the numbers that prove them.
    entropy : Entropy or None
        If `limitsets.entropy` was asked: likewise, and the sampled number.
    """

    map: Any
    upper: Any
    graph: TransitionGraph
    component: NDArray[np.int32]
    claims: tuple[Claim, ...]
    cycles: tuple[CycleOfMap, ...]
    seconds: float
    goal: GoalOfMap | None = None
    final: NDArray[np.int32] | None = None
    average: Average | None = None
    entropy: Entropy | None = None

    @property
    def proved(self) -> bool:
        """Whether every claim is proved."""
        return all(claim.verdict == "proved" for claim in self.claims)

    @property
    def cells(self) -> CellSet:
        """The attracting cells: proved to be positively invariant, or that their orbits tend to a cycle."""
        if self.final is not None:
            return CellSet(self.graph.grid, self.arrays["component"] >= 0)
        return CellSet(self.graph.grid, self.component >= 0)

    @property
    def enters(self) -> CellSet:
        """The cells all of whose points are proved to enter the attracting cells."""
        if self.final is not None:
            return CellSet(self.graph.grid, self.arrays["rank"] >= 0)
        return CellSet(self.graph.grid, self.graph.condensation().destinations(passing(self.graph)) >= 0)

    @functools.cached_property
    def _images(self) -> Targets:
        return targets_of(self.map, self.upper, self.graph.grid)

    @functools.cached_property
    def arrays(self) -> Arrays:
        """The arrays of a certificate: target cells, ranks, components (docs/certificates.md)."""
        grid = self.graph.grid
        ends = None if self.goal is None else self.goal.within(*grid.corners(np.arange(grid.n_cells)))
        return cells_of(self._images, grid, ends, self.final)

    @functools.cached_property
    def exits(self) -> Numbers:
        """One less than the steps within which all starts of a cell leave the domain, -1: not proved; (n_cells,)."""
        return exits_of(self._images, self.graph.grid)

    @functools.cached_property
    def weights(self) -> Array | str:
        """Weights of the cells, by which almost every start leaves those without a rank; or what is missing."""
        return weights_of(self.map, self.upper, self.graph.grid, self._images, self.arrays["rank"] < 0)

    def _write(self, path: str | Path, **how: Any) -> None:
        """Write the claims that are proved, of the formulas that `limitsets.formulas` shows."""
        part = self.part()
        require_proved(part.claims)
        needs_goal = {"ends-in", "refuted"} & set(part.claims)
        write_map(
            path,
            self.graph.grid.domain,
            [part],
            goal=self.goal.in_file() if self.goal and needs_goal else None,
            **how,
        )

    def denied(self, claims: Mapping[str, str]) -> ProofOfMap:
        """Return the proof where the checker denies some claims: these are undecided."""
        cycles = () if "cycles" in claims else self.cycles
        return replace(self, claims=left_of(self.claims, claims), cycles=cycles, **without(self, claims))

    def part(self) -> Part:
        """Give what a certificate holds of this box of parameters; a refuted goal stands by itself."""
        cycles: dict[str, Any] = {"cycles": [_cycle_section(self, cycle) for cycle in self.cycles]}
        if self.graph.grid.domain.closes:
            cycles["begins"] = begins_of(self.graph.grid.domain)
        if any(each.claim == "ends-in" and each.verdict == "refuted" for each in self.claims):
            return Part((self.map, self.upper), {"cycles": cycles, "refuted": {}}, {})
        claims = {each.claim: dict(each.section) for each in self.claims if each.verdict == "proved"}
        if "converges" in claims:
            drawn = [k for k, cycle in enumerate(self.cycles) if cycle.ball is not None]
            claims["converges"] = {"components": [*range(len(drawn))], "cycles": drawn}
        if claims and self.cycles:
            claims["cycles"] = cycles
        arrays = self.arrays if set(claims) - {"cycles", "all-cycles"} else {}
        if "escapes" in claims:
            arrays = arrays | {"exit": self.exits} | targets_beyond(arrays, self._images, self.exits >= 0)
        if "almost-every" in claims:
            thin = arrays["rank"] < 0
            arrays = (
                arrays | {"weight": np.asarray(self.weights)} | targets_beyond(arrays, self._images, thin)
            )
        for word, numbers in (("average", self.average), ("entropy", self.entropy)):
            if word in claims and numbers is not None:
                arrays = arrays | numbers.arrays
        return Part((self.map, self.upper), claims, arrays)

    def functions(self, claim: str) -> str:
        """Name the functions of the map that a claim is proved of: `image` may be another, but for a sample."""
        kind = kind_of(self.map)
        names: tuple[str, ...] = ("image_box",) if kind.own_box else ()
        if not kind.own_box or claim in OF_SLOPES:
            names += kind.formulas
        return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))

    def to_json(self) -> list[dict[str, Any]]:
        """Give it as plain tables for JSON, one per claim."""
        return [
            as_table(
                **picked(claim, "claim", "verdict"),
                of=self.functions(claim.claim),
                reason=claim.reason or None,
                map=type(self.map).__name__,
                parameters=[end._asdict() for end in (self.map, self.upper)],
                cells=self.graph.n_cells,
                attracting=len(self.cells),
                section=claim.section or None,
                averages=rows_of(self.average) if claim.claim == "average" else None,
                bounds=self.entropy.to_json() if self.entropy and claim.claim == "entropy" else None,
                cycles=self.cycles if claim.claim in ("all-cycles", "cycles", "converges") else None,
                timings={"certify": self.seconds},
            )
            for claim in self.claims
        ]

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            (each.claim, each.verdict, self.functions(each.claim), _missing(each)) for each in self.claims
        ]
        caption = f"Proofs of {type(self.map).__name__}, of {self.functions('invariant')}"
        claims = Table(("claim", "verdict", "of", "missing"), rows, caption)
        tables = [claims]
        if self.cycles:
            tables.append(_cycle_table(self.cycles))
        for each in self.claims:
            if each.claim == "escapes" and each.verdict == "proved":
                within = f"every start leaves the domain within {each.section['steps']} steps"
                share = f"{math.floor(1000 * each.section['share']) / 10} % of it"
                out = CellSet(self.graph.grid, self.exits >= 0)
                tables.append(_region(out, "Leaving cells", f"{within}; {share}"))
        tables += [each.table() for each in (self.average, self.entropy) if each is not None]
        if not len(self.cells):
            return tuple(tables)
        kind = "no image leads out" if self.final is None else "no image leads out, or orbits tend to a cycle"
        kept = _region(self.cells, "Attracting cells", kind)
        held = _region(self.enters, "Basin", "every point of its cells enters them", self._ranked())
        return *tables, kept, held

    def _ranked(self) -> str:
        """Say of how many cells a certificate shows that they lead to the attracting cells, if not of all."""
        if self.final is not None or self.goal is not None or not passing(self.graph).any():
            return ""
        ranked, count = int((self.arrays["rank"] >= 0).sum()), len(self.enters)
        if ranked == count:
            return ""
        return (
            f"; a certificate can show {ranked} of them, for its ranks do not pass through cells that recur: finer "
            "cells, or ends= with boxes around the attracting cells, show more"
        )

    def __str__(self) -> str:
        return "\n\n".join(table.text() for table in self.tables())


def _cycle_table(cycles: tuple[CycleOfMap, ...]) -> Table:
    """Say of which period orbits are, through which box their first points lie, and whether they attract."""
    names = ["x"] if cycles[0].lo.shape[1] == 1 else [f"x[{axis}]" for axis in range(cycles[0].lo.shape[1])]
    rows = [
        (cycle.period, int(cycle.side[0]), *zip(cycle.lo[0], cycle.hi[0], strict=True), cycle.kind)
        for cycle in cycles
    ]
    spans = [Column(name, show=".6g", ends=True) for name in names]
    return Table(
        ("period", "side", *spans, "kind"), rows, "Periodic orbits", "proved: each by one of its points"
    )


def _region(cells: CellSet, caption: str, proved: str, note: str = "") -> Table:
    """Say where cells are: which intervals on a line, else by boxes around their connected pieces."""
    rows: list[tuple[Any, ...]]
    if cells.grid.dimension == 1:
        names, rows = ["x"], [(side, band) for side, band in bands_of(cells.extents())]
    else:
        names = [f"x[{axis}]" for axis in range(cells.grid.dimension)]
        rows = [(side, *box) for side, boxes in cells.pieces().items() for box in boxes]
    spans = [Column(name, show=".6g", ends=True) for name in names]
    caption += ": boxes around its pieces" if cells.grid.dimension > 1 else ""
    how = f"proved: {proved}; {len(cells)} of {cells.grid.n_cells} cells{note}"
    return Table(("side", *spans), rows, caption, how)


def _missing(claim: Claim) -> str | None:
    """Say what is not proved, also of the cycles where only some are proved."""
    rest = claim.section.get("missing", [])
    more = f"; and {len(rest) - 1} more" if len(rest) > 1 else ""
    return claim.reason or (f"{rest[0]}{more}" if rest else None)


def frames_of(corners: tuple[Any, Any], cycle: CycleOfMap) -> Array | None:
    """Choose frames by which the checker sees that an orbit attracts; None where its boxes are too wide for any."""
    slopes = slopes_on(corners, *widened(cycle.lo, cycle.hi), cycle)
    return attracting_frames(slopes_of(corners, cycle), slopes)


def _cycle_section(proof: ProofOfMap, cycle: CycleOfMap) -> dict[str, Any]:
    """Write a proved orbit as a certificate has it."""
    corners, ball = (proof.map, proof.upper), cycle.ball
    # branches that are names alone are one in the file
    branches = cycle.branches if kind_of(proof.map).has_margin else np.zeros_like(cycle.branches)
    frames = None if ball is None else ball.frames
    if ball is None and cycle.attracts:
        frames = frames_of(corners, cycle)
    unstable = ball is None and cycle.attracts is False and is_unstable_in_file(corners, cycle)
    listed: dict[str, Any] = {
        "boxes": hexed(np.stack(widened(cycle.lo, cycle.hi), axis=-1)),
        "side": cycle.side.tolist(),
        "branch": branches.tolist(),
        "attracts": frames is not None,
        "frames": None if frames is None else hexed(frames),
        "radius": None if ball is None else ball.radius.hex(),
    }
    listed |= {"unstable": True} if unstable else {}
    return listed | ({} if cycle.turns is None else {"turns": cycle.turns.tolist()})
