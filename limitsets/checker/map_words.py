"""What is proved of a map, in words: each sentence is written from what was checked."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .any_map import Shape, parameter_in_words
from .balls import Array, Pair
from .claims import entropy_of
from .entropy import entropy_in_words
from .file import plain
from .map_cells import MapCells
from .map_chances import chances_of_map_in_words
from .map_cycles import Cycle, interval_in_words
from .map_file import CLAIMS_OF_MAP, OF_ORBITS, Goal, Part, Regions
from .map_long_run import long_run_of_map_in_words
from .observable import average_in_words
from .program import named

MOST_NAMED = 6


class Outcome(NamedTuple):
    """What became of a box of parameters."""

    parameters: list[str]
    holds_for: str  # whether its parameters are fixed, or may change at every step; "" without a range
    verdict: str  # "proved", "refuted", "failed", or "" where nothing is claimed
    claims: list[tuple[str, str, str]]  # claim, a word, and what is proved or why not


def outcome_of(
    part: Part, shape: Shape, goal: Goal | None, failed: dict[str, str], cycles: list[Cycle]
) -> Outcome:
    """Put in words what became of a box of parameters; `failed` has the reasons of the claims that fail."""
    claims = []
    for name in [name for name in CLAIMS_OF_MAP if name in part.claims]:
        word = "failed" if name in failed else "refuted" if name == "refuted" else "proved"
        claims.append((name, word, failed.get(name) or SENTENCES[name](Proved(part, shape, goal, cycles))))
    claims += [
        (plain(name), "not rechecked", "this checker does not know the claim") for name in part.unknown
    ]
    words = {word for _, word, _ in claims}
    worst = "failed" if words & {"failed", "not rechecked"} else "refuted" if "refuted" in words else "proved"
    parameters = [parameter_in_words(name, ends) for name, ends in part.parameters.items()]
    return Outcome(parameters, holds_for(part), worst if claims else "", claims)


def holds_for(part: Part) -> str:
    """Say which claims hold for parameters that are fixed, and which also where they change at every step."""
    wide = [named(name) for name, (lo, hi) in part.parameters.items() if lo != hi]
    names = [name for name in CLAIMS_OF_MAP if name in part.claims]
    # who ends in the ball of a cycle tends to it, and stays, for one value only
    fixed = {
        *OF_ORBITS,
        "average",
        "entropy",
        "long-run",
        *(("attracts-all", "ends-in") if part.drawn else ()),
    }
    groups = (
        ("fixed in time", [name for name in names if name in fixed]),
        ("changed at every step too", [name for name in names if name not in fixed]),
    )
    said = "; ".join(f"{how}: {', '.join(group)}" for how, group in groups if group)
    return f"for every {', '.join(wide)} in the range, {said}" if wide and said else ""


def box_in_words(box: list[Pair]) -> str:
    """Write a box, its ends as shortest decimals of the doubles."""
    return " x ".join(f"[{lo!r}, {hi!r}]" for lo, hi in box)


def regions_in_words(regions: Regions, sides: int) -> str:
    """Write boxes with their sides."""
    said = [
        box_in_words(box) + (f" on side {side}" if sides > 1 else "") for side, box in regions[:MOST_NAMED]
    ]
    more = len(regions) - MOST_NAMED
    return " or ".join(said) + (f" or {more} more boxes" if more > 0 else "")


class Proved:
    """What is proved for a box of parameters."""

    def __init__(self, part: Part, shape: Shape, goal: Goal | None, cycles: list[Cycle]):
        self.part, self.shape, self.goal, self.cycles = part, shape, goal, cycles

    @property
    def cells(self) -> MapCells:
        """The cells, which every claim but those about orbits alone has."""
        assert self.part.cells is not None
        return self.part.cells

    def attracting(self) -> list[int]:
        """Return the components that are no final cells."""
        c, final = self.cells.component, {component for component, _ in self.part.drawn}
        return [k for k in np.unique(c[c >= 0]).tolist() if k not in final]

    def components(self) -> str:
        """Name these components."""
        own = self.attracting()
        more = [f"{len(own) - MOST_NAMED} more"] if len(own) > MOST_NAMED else []
        return "; ".join([*(component_in_words(self.cells, k) for k in own[:MOST_NAMED]), *more])

    def sets(self) -> list[str]:
        """Say where orbits come."""
        sets = ["into the attracting cells and stays"] if self.attracting() else []
        return sets + (["into cells that tend to a cycle"] if self.part.drawn else [])

    def comes(self, most: int) -> str:
        """Say where orbits come, and when."""
        return f"comes within {most} step{'' if most == 1 else 's'} {', or '.join(self.sets())}"

    def cycle_list(self) -> str:
        """List the orbits."""
        count = len(self.cycles)
        more = [f"{count - MOST_NAMED} more"] if count > MOST_NAMED else []
        listed = "; ".join([*(cycle.in_words() for cycle in self.cycles[:MOST_NAMED]), *more])
        return f"{count} periodic orbit{'' if count == 1 else 's'}: {listed}"

    def every_cycle(self) -> str:
        """Say that the orbits are all."""
        every, listed = self.part.every, "these are" if self.cycles else "there is no orbit, hence"
        assert every is not None
        domain = regions_in_words(list(enumerate(every.domain)), self.shape.sides)
        return f"{listed} all periodic orbits of periods up to {every.period} whose points lie in {domain}"

    def converging(self) -> str:
        """Say which cells tend to which cycle."""
        drawn = self.part.drawn[:MOST_NAMED]
        return "; ".join(
            f"every orbit in {component_in_words(self.cells, c)} tends to cycle {k}" for c, k in drawn
        )

    def growth(self) -> str:
        """Say what follows from slopes."""
        least = self.part.least
        entropy = f"of fixed parameters the entropy (growth of laps) is at least {entropy_of(least)}"
        return f"|dx'/dx| >= {least!r} on {self.components()}; no periodic orbit there attracts; {entropy}"

    def of_goal(self) -> str:
        """Put the goal in words."""
        assert self.goal is not None
        starts, sides = self.goal.starts, self.shape.sides
        whence = "the cells with a rank" if starts is None else regions_in_words(starts, sides)
        return f"every start in {whence} ends in {regions_in_words(self.goal.ends, sides)} and stays"

    def covered(self) -> str:
        """Say from which starts orbits come into the attracting cells."""
        share = share_in_words(self.cells, self.shape, self.cells.rank >= 0)
        return f"every start in cells that cover {share} {self.comes(int(self.cells.rank.max(initial=0)))}"

    def leaving(self) -> str:
        """Say from which starts orbits leave the domain."""
        share = share_in_words(self.cells, self.shape, self.cells.exit >= 0)
        steps = int(self.cells.exit.max()) + 1
        return f"every start in cells that cover {share} leaves it within {steps} step{'' if steps == 1 else 's'}"

    def almost(self) -> str:
        """Say where almost every start comes."""
        leaves = ["leaves it"] if self.cells.thin_may_leave() else []
        ways = ", or ".join([*(f"comes {where}" for where in self.sets()), *leaves])
        domain = domain_in_words(self.cells, self.shape)
        return f"almost every start in {domain} (all but a set of length 0) {ways}"

    def averaged(self) -> str:
        """Say what the average of a function is."""
        average = self.part.of_line["average"]
        names = {k: component_in_words(self.cells, k) for k in average.components()}
        return average_in_words(average, names, ["take branch 0", "take branch 1"])

    def entropic(self) -> str:
        """Say what the entropy is."""
        return entropy_in_words(self.part.of_line["entropy"])

    def scattered(self) -> str:
        """Say between which numbers averages lie where steps scatter."""
        return "\n".join(long_run_of_map_in_words(self.part.of_line["long-run"]))


SENTENCES: dict[str, Callable[[Proved], str]] = {
    "cycles": Proved.cycle_list,
    "all-cycles": Proved.every_cycle,
    "converges": Proved.converging,
    "invariant": lambda proved: f"each component is mapped into itself: {proved.components()}",
    "trapping": lambda proved: f"each component is mapped into its interior: {proved.components()}",
    "basin": Proved.covered,
    "attracts-all": lambda proved: (
        f"every start in the domain, which no orbit leaves, {proved.comes(proved.part.max_rank)}"
    ),
    "ends-in": Proved.of_goal,
    "expanding": Proved.growth,
    "escapes": Proved.leaving,
    "almost-every": Proved.almost,
    "average": Proved.averaged,
    "entropy": Proved.entropic,
    "long-run": Proved.scattered,
    "probabilities": lambda proved: "\n".join(chances_of_map_in_words(proved.part.of_line["probabilities"])),
    "refuted": lambda proved: (
        f"an open set of starts, around a point of a cycle, violates: {proved.of_goal()}"
    ),
}


def component_in_words(c: MapCells, component: int) -> str:
    """Name a component, with the least box around it on its first side."""
    cells = np.flatnonzero(c.component == component)
    side = int(c.side_of(cells[:1])[0])
    ends = c.ends(cells[c.side_of(cells) == side], side)
    hull = [
        (float(lo), float(hi))
        for lo, hi in zip(ends[:, ::2].min(axis=0), ends[:, 1::2].max(axis=0), strict=True)
    ]
    where = " x ".join(map(interval_in_words, hull)) + (f" on side {side}" if len(c.edges) > 1 else "")
    elsewhere = " and on other sides" if len(np.unique(c.side_of(cells))) > 1 else ""
    return f"component {component} ({len(cells)} cells in {where}{elsewhere})"


def domain_in_words(c: MapCells, shape: Shape) -> str:
    """Write the domain, by its box where it has one side."""
    first = [(float(e[0]), float(e[-1])) for e in c.edges[0]]
    return box_in_words(first) if shape.sides == 1 else "the domain"


def share_in_words(c: MapCells, shape: Shape, chosen: Array) -> str:
    """Write the share of the domain that lies in the chosen cells, rounded down."""
    domain = domain_in_words(c, shape)
    if chosen.all():
        return f"all of {domain}"
    held = whole = 0.0
    with np.errstate(all="ignore"):
        for side, axes in enumerate(c.edges):
            volume = np.diff(axes[0])
            for e in axes[1:]:
                volume = np.multiply.outer(volume, np.diff(e))
            own = chosen[c.start[side] : c.start[side + 1]].reshape(volume.shape)
            held, whole = held + float(volume[own].sum()), whole + float(volume.sum())
    # sums of at most 2^31 terms are right to 1e-6; where they leave the range of doubles nothing is said
    fits = 1e-290 < whole < math.inf
    return f"{math.floor(held / whole * (1 - 1e-6) * 1000) / 10 if fits else 0.0} % of {domain}"
