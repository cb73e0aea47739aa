"""How far the effects that a scene calls for move a landing, and whether the goal survives that.

Let F be the throw without effects and G the throw with them.  If G comes to the side to which F comes, and within e of
its place, from every cell of a set that F with a landing noise of e does not leave, then every orbit of G from these
cells is an orbit of F with that noise: what is proved of F with the noise e holds for G.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from limitsets.base import (
    AnswerError,
    Progress,
    arguments_checked,
)
from limitsets.feeder.scene import Scene, load
from limitsets.parameters.discrepancy.discrepancy_result import BY, Discrepancy, best_of
from limitsets.parameters.discrepancy.measuring import ENCLOSED, Moved, arrivals, enclosed, sampled
from limitsets.parameters.margins.single import margin
from limitsets.proofs.auditing import Audit, audit
from limitsets.proofs.auditing.findings import NO_EFFECT, hindrance, with_effects
from limitsets.proofs.prover.attraction import Attraction, attraction
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.cells import CellSet

# Cells per side.
CELLS = 4096
# Starts that are simulated to the end.
STARTS = 4000
# Attempts to find a deviation e such that no landing on the cells that are invariant under e is moved farther.
ROUNDS = 8
# Later attempts take so much more than was measured: the cells grow with e, and e with the cells.
MORE = 1.02


def _called_for(scene: Scene, judged: Audit) -> tuple[tuple[str, ...], dict[str, str]]:
    """Find the effects that a scene calls for anywhere and whose facts are given; and the others, with the reason.

    A side that comes down may slide on where the landing has not: with `friction` given, `slip` is followed.
    """
    wanted = ["slip"] if scene.world.friction is not None else []
    left: dict[str, str] = {}
    for finding in judged.findings:
        effect = finding.effect
        if finding.called_for is False or effect in (*NO_EFFECT, "spread", *wanted):
            continue
        reason = hindrance(scene, finding, tuple(wanted))
        if reason:
            left[effect] = left.get(effect) or reason
        else:
            wanted.append(effect)
    return tuple(wanted), {effect: why for effect, why in left.items() if effect not in wanted}


class _Comparison:
    """The throws of a scene without effects, compared with those with effects."""

    def __init__(self, plain: Scene, effects: tuple[str, ...], throws: int, seed: int) -> None:
        self.plain, self.effects, self.throws, self.seed = plain, effects, throws, seed
        self.full = with_effects(plain, effects)
        proves = set(effects) <= set(ENCLOSED)
        self.box = parameter_box(with_effects(plain, ("landing", "roll"))) if proves else None

    def on(self, place: str, cells: CellSet) -> list[Moved]:
        """Compare the throws from some cells: the samples last; before them what is enclosed, if anything can be."""
        rows = [sampled(place, cells, (self.plain, self.full), self.effects, self.throws, self.seed)]
        if self.box is not None:
            rows.insert(0, enclosed(place, cells, self.box, self.full, self.effects))
        return rows

    def attraction(self, deviation: float) -> Attraction:
        """Find the attracting cells of the minimal model whose landings deviate by so much at every throw."""
        noise = {"landing.x": f"{deviation!r} {self.plain.unit}"} if deviation > 0.0 else {}
        return attraction(cover(parameter_box(self.plain, noise=noise), CELLS))

    def compare(
        self, place: str, cells_of: Callable[[Attraction], CellSet]
    ) -> tuple[list[Moved], float | None]:
        """Find a deviation that holds all throws from the cells that there are with it as noise; None for none.

        The noise leaves fewer starts: what is not known of starts near the joint does not end the search at once.
        """
        deviation = 0.0
        rows: list[Moved] = []
        for _ in range(ROUNDS):
            cells = cells_of(self.attraction(deviation))
            if not len(cells):
                break
            rows = self.on(place, cells)
            best = best_of(rows)
            if best.same_sides and best.most <= deviation:
                return rows, deviation
            if not best.same_sides and (deviation or not best.most):
                break
            deviation = best.most * (MORE if deviation else 1.0)
        return rows, None


def _ranked(attracting: Attraction) -> CellSet:
    """Return the cells all of whose starts come to the attracting cells.

    If only almost every start does, for a given sequence of deviations, these are the attracting cells alone: the
    deviations by effects depend on the start.
    """
    basin = attracting.basin
    return CellSet(attracting.cover.grid, basin.rank == 0 if basin.thin.any() else basin.rank >= 0)


@arguments_checked
def discrepancy(
    scene: str | Path | Mapping[str, Any] | Scene,
    effects: Sequence[str] | None = None,
    *,
    throws: int = 100_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> Discrepancy:
    """Measure how far the effects that a scene calls for move a landing, and whether its goal survives that.

    Parameters
    ----------
    scene : str, Path, mapping or Scene
        A scene, or what `limitsets.load` reads.
    effects : sequence of str, optional
        Effects to compare with.  Default: those that the audit finds called for anywhere on the arm and whose facts
        ``[world]`` states, and `slip` where it states `friction`.
    throws : int
        How many throws are simulated in each place.
    seed : int
        Of their starts.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Returns
    -------
    Discrepancy
        Deviations on the limit set, and on the cells of the starts that come there in spite of them; proved where the
        effects are `landing`, `roll` and `slip` at most, else sampled.

    Raises
    ------
    SceneError
        For a scene that cannot be read, or effects that it cannot have.
    AnswerError
        For a scene of whose minimal model nothing can be proved.

    Notes
    -----
    A deviation covers a place if the part comes to the same side from every cell of it, and the minimal model is proved
    to stay there with that deviation as landing noise at every throw.  Then each orbit with the effects is an orbit of
    the minimal model with that noise.  As margins, all is of the scene without its scatter.  Source:
    docs/audit.md, "Will it work on my machine?".

    Examples
    --------
    >>> import limitsets as ls
    >>> text = ls.load("paper-designed").as_dict() | {"world": {"friction": 1.3}}
    >>> compared = ls.discrepancy(text, ["slip"])
    >>> compared.row("limit-set").how, compared.row("limit-set").most, compared.covered["limit-set"]
    ('proved', 0.0, 0.0)
    """
    loaded = load(scene)
    if not loaded.sides.rests.all():
        raise AnswerError(
            "the part", loaded.name, "one that rests on every side", "the minimal model has no other"
        )
    for effect in effects or ():
        if effect not in BY:
            raise AnswerError("the effect", effect, ", ".join(BY), "name some of these")
    plain = load({**loaded.as_dict(), "effects": {}})
    judged = audit(plain)
    asked = _called_for(plain, judged)
    if effects is not None:
        others = dict.fromkeys(set(asked[0]) - set(effects), "called for, but not asked for")
        asked = tuple(dict.fromkeys(effects)), {**asked[1], **others}
    steps = ("the effects", "the limit set", "the starts", "the margin", "the simulation")

    def tell(number: int) -> None:
        if progress is not None:
            progress(steps[number], number, len(steps))

    if not asked[0]:
        return Discrepancy(
            loaded, *asked, rows=(), covered={}, margin=None, arrive={}, audit=judged, scenes=(plain,)
        )
    comparison = _Comparison(plain, asked[0], throws, seed)
    rows: list[Moved] = []
    covered = {}
    places = {"limit-set": lambda attracting: attracting.cells, "starts": _ranked}
    for number, (place, cells_of) in enumerate(places.items()):
        tell(1 + number)
        seen, deviation = comparison.compare(place, cells_of)
        rows += seen
        if deviation is not None:
            covered[place] = deviation
    tell(3)
    survives = None
    if loaded.goal is not None:
        (survives,) = margin(plain, "landing.x", reading="per-throw")
    tell(4)
    scenes = plain, comparison.full
    simulated = (arrivals(each, loaded.goal, STARTS, seed) for each in scenes)
    arrive = dict(zip(("minimal", "effects"), simulated, strict=True))
    return Discrepancy(
        loaded,
        *asked,
        rows=tuple(rows),
        covered=covered,
        margin=survives,
        arrive=arrive,
        audit=judged,
        scenes=scenes,
    )
