"""Robust design: the part with a large proved joint margin, and its cost in throws; the last steps included.

There are two goals: every part at rest beyond X lies on the side, and almost every orbit comes to rest there, so that
an X that no orbit reaches does not count.  Search by floats (`search`), round to manufacturable values, prove
(`limitsets.robust`).
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import permutations
from pathlib import Path

import numpy as np

from limitsets.base import AnswerError, Progress, arguments_checked, shown_in_notebooks, silent
from limitsets.base.arrays import Array
from limitsets.feeder.geometry import triangle
from limitsets.feeder.goals import Goal, Laid, OrientedBeyond, Reaches
from limitsets.feeder.scene import LaidLike, Scene, load, read_laid
from limitsets.parameters.design.design_result import Option, RobustDesign, front_of, throws_to_feed
from limitsets.parameters.design.search import (
    POINT,
    POPULATION,
    Candidate,
    DesignSearch,
    Ends,
    bounds_of,
    counterweight_of,
    require_searchable,
    said,
)
from limitsets.parameters.margins.deviations import Signs, Tolerance
from limitsets.parameters.margins.estimate import FINE, FINELY, Estimate, estimated, failing, on_all_corners
from limitsets.parameters.margins.joint import joint_margin
from limitsets.parameters.margins.margin_result import Margin

# ----------------------------------------------------------------
# The last steps of a robust design: designs near the best one, rated on every corner of the tolerance.
#
# The search knows some corners only and therefore overrates its best design.  Here a design counts as better only if it
# is better on all corners.  The margin is the minimum of many smooth numbers, one per corner, so its maximum is a
# ridge: scipy's simplex method climbs it, restarted each time with a smaller simplex.


# Edges of the simplex at its starts, in shares of the bounds.
EDGES = (0.02, 0.007, 0.0025)


class _Best:
    """The best design so far, and the corners at which others failed."""

    def __init__(self, search: DesignSearch, made: Callable[[Scene], Scene], tell: Progress, of: int) -> None:
        self.search, self.made, self.tell, self.of = search, made, tell, of
        self.hard: list[Signs] = list(search.hard)
        self.unknowns: list[float] = []
        self.design: tuple[Scene, Estimate] | None = None
        self.margin = 0.0
        self.tried = 0

    def rate(self, unknowns: Sequence[float]) -> float:
        """Rate a design as it would be made: exactly where it is the best, from above where it is not."""
        self.tried += 1
        self.tell("designs near the best", min(self.tried, self.of), self.of)
        drawn = self.search.scene_of(unknowns)
        scene = None if drawn is None else self.made(drawn)
        rating, estimate = self.search.rated(scene, self._estimate)
        if scene is not None and estimate is not None and estimate.margin > self.margin:
            self.unknowns, self.margin = [float(u) for u in unknowns], estimate.margin
            self.design = scene, estimate
        return rating

    def _estimate(self, scene: Scene) -> Estimate | None:
        """Estimate a margin; where it may be the best, on all corners."""
        about = scene, self.search.tolerance, self.search.side
        estimate = estimated(*about, hard=self.hard, steps=FINE, close=FINELY)
        if estimate is None or not estimate.margin > self.margin:
            return estimate
        new = [signs for signs in failing(*about, estimate, estimate.margin) if signs not in self.hard]
        self.hard[:0] = new
        return on_all_corners(*about, self.hard) if new else estimate


def polished(
    search: DesignSearch,
    unknowns: Sequence[Sequence[float]],
    made: Callable[[Scene], Scene],
    evaluations: int,
    tell: Progress,
) -> tuple[Scene, Estimate] | None:
    """Improve the best of a few designs, rated as they would be made and on all corners.

    Parameters
    ----------
    search : DesignSearch
        Whose quantities, tolerance and conditions.
    unknowns : sequence of sequence of float
        Where to begin: scaled unknowns, at least one.
    made : callable
        Gives a scene as it would be made: rounded.
    evaluations : int
        Designs to look at.
    tell : callable
        Progress.

    Returns
    -------
    (Scene, Estimate) or None
        The design and its margin, which holds on all corners; None if none of the first ones feeds.
    """
    from scipy.optimize import minimize

    best = _Best(search, made, tell, evaluations)
    for row in unknowns:
        best.rate(row)
    for number, edge in enumerate(EDGES):
        share = (evaluations - best.tried) // (len(EDGES) - number)
        if best.design is None or share < 1:
            break
        minimize(
            lambda row: -best.rate(row),
            best.unknowns,
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * len(best.unknowns),
            options={"initial_simplex": _simplex(best.unknowns, edge), "maxfev": share, "adaptive": True},
        )
    search.evaluations += best.tried
    return best.design


def _simplex(corner: Sequence[float], edge: float) -> Array:
    """Give a simplex at a place: a step along each axis, towards the middle of its bounds."""
    place = np.array(corner)
    return np.vstack([place, place + edge * np.diag(np.where(place < 0.5, 1.0, -1.0))])


# ----------------------------------------------------------------
# Robust design: the part with a large proved joint margin, and its cost in throws.


TOLERANCE = {
    "throw.speed": "1 %",
    "part.sides": "1 %",
    "part.mass.radius_of_gyration": "1 %",
    "part.mass.center.along": "0.01 in",
    "part.mass.center.above": "0.01 in",
    "arm.surface_height": "0.01 in",
    "landing.x": "0.01 in",
}
"""The tolerance of a scene that gives none; part.sides stands for every side, places and masses of points as these."""

# Decimals to which a design is rounded, X more coarsely: a workshop has no more.
DECIMALS, DECIMALS_OF_X = 4, 3
# Designs drawn for each order of the sides, and how many orders go on.
DRAWN, ORDERS_KEPT = 120, 2
# Designs of the search that are rated on all corners, and the share of its evaluations spent on improving the best.
POLISHED, POLISH = 3, 8
# Seconds for the proof of a box.
SECONDS = 240.0


def fed_at(x: float, side: int, laid: Laid = ()) -> tuple[Goal, Goal]:
    """Give both goals of feeding at x: nothing else gets there, and the part does."""
    return OrientedBeyond(x, side, laid=laid), Reaches(x, side, laid=laid)


def tolerance_of(scene: Scene, tolerance: Mapping[str, str] | None) -> dict[str, str]:
    """Give a tolerance by quantity: the one asked for, the scene's, or `TOLERANCE`."""
    given = tolerance or scene.text.get("tolerance")
    texts = dict(given or TOLERANCE)
    share = texts.pop("part.sides", None)
    if share is not None and "sides" in scene.text["part"]:
        texts |= {f"part.sides[{k}]": share for k in range(len(scene.sides))}
    mass = scene.text["part"]["mass"]
    if not given and "center" not in mass:  # its points instead
        sizes = zip(POINT, ("0.01 in", "0.01 in", "1 %"), strict=True)
        texts = {name: text for name, text in texts.items() if not name.startswith("part.mass")}
        points = range(len(mass.get("points", ())))
        texts |= {f"part.mass.points[{k}].{word}": text for word, text in sizes for k in points}
    return texts


def orders_of(scene: Scene) -> list[Scene]:
    """Give a triangle's other orders of sides, the scene's own first; mirrored parts are among them."""
    sides = scene.text["part"].get("sides")
    if sides is None or len(sides) != 3:
        return [scene]
    scenes = []
    for order in permutations(range(3)):
        tree = scene.as_dict()
        tree["part"]["sides"] = [sides[k] for k in order]
        # the old centre of mass may lie outside the new triangle: the search begins at another one
        left, right = (float(scene.sides.length[order[k]]) for k in (2, 0))
        mass = tree["part"]["mass"]
        if order != (0, 1, 2) and "center" in mass:
            mass["center"]["along"] = f"{0.6 * left:.4f} {scene.unit}"
            mass["center"]["above"] = f"{0.15 * min(left, right):.4f} {scene.unit}"
        elif order != (0, 1, 2):
            # the same shares along each edge: a point on the part stays on the part
            other = triangle(scene.sides.length[list(order)])
            moved = np.linalg.solve(scene.vertices[1:] - scene.vertices[0], other[1:] - other[0])
            for k, point in enumerate(mass.get("points", ())):
                own = np.array([scene.value(f"part.mass.points[{k}].{word}") for word in "xy"])
                x, y = (own - scene.vertices[0]) @ moved
                point["x"], point["y"] = f"{x:.6f} {scene.unit}", f"{y:.6f} {scene.unit}"
        scenes.append(load(tree))
    return scenes


def _searched(
    searches: Sequence[DesignSearch], evaluations: int, seed: int, tell: Progress
) -> tuple[DesignSearch, list[list[float]]]:
    """Draw in every order, go on in the best, and give the best search with the unknowns of its best design."""
    rng = np.random.default_rng(seed)
    drawn: list[tuple[float, int, Array]] = []
    for strict in (False, True):
        if drawn and drawn[0][0] > 0.0:
            break
        drawn = []
        for number, search in enumerate(searches):
            tell("orders of the sides", number, len(searches))
            search.strict = strict  # once nothing that is drawn feeds
            unknowns, ratings = search.drawn(rng, max(POPULATION, min(DRAWN, evaluations)))
            best = np.argsort(-ratings)[:POPULATION]
            drawn.append((float(ratings[best[0]]), number, unknowns[best]))
        drawn.sort(key=lambda row: -row[0])
    share, first = evaluations // (2 * min(ORDERS_KEPT, len(drawn))), []
    for _, number, population in drawn[:ORDERS_KEPT]:
        population, ratings = searches[number].improved(population, share, seed, tell)
        first.append((float(ratings[0]), number, population))
    _, number, population = max(first, key=lambda row: row[0])
    population, _ = searches[number].improved(population, evaluations // 2, seed + 1000, tell)
    return searches[number], population.tolist()


def _with_purpose(scene: Scene, x: float, side: int, tolerance: Mapping[str, str], name: str) -> Scene:
    tree = scene.as_dict()
    tree["name"] = name
    place = f"{x:.{DECIMALS_OF_X}f} {scene.unit}"
    tree["goal"] = {"oriented_beyond": {"x": place, "side": side}}
    # the cavity and the sensor belong to the place where parts are wanted
    if "cavity" in tree:
        tree["cavity"]["position"] = place
    sensor = tree.get("feedback", {}).get("sensor", {})
    if "beyond" in sensor:
        sensor["beyond"] = place
    tree["tolerance"] = {name: text for name, text in tolerance.items() if name != "landing.x"}
    return load(tree)


class NoDesignError(AnswerError):
    """No design that feeds: with the nearest miss, if one can be built, what was varied, and what ruled designs out."""

    def __init__(
        self, evaluations: int, ruled_out: Mapping[str, int], miss: Scene | None, varied: Iterable[str]
    ) -> None:
        super().__init__(
            "the design",
            f"none that feeds among {evaluations}",
            "one at least",
            f"{said(ruled_out)}; {'widen the bounds, look at more designs, or ask the goal of another side'}",
        )
        self.evaluations, self.ruled_out, self.miss, self.varied = evaluations, ruled_out, miss, tuple(varied)


def _none_feeds(
    searches: Sequence[DesignSearch], search: DesignSearch, nearest: Sequence[float], name: str
) -> NoDesignError:
    """Give the error of searches without a design, with the nearest miss if its part can be built."""
    ruled_out = sum((each.ruled_out for each in searches), Counter[str]())
    count, miss = sum(each.evaluations for each in searches), search.scene_of(nearest)
    if miss is not None:
        miss = load(search.rounded(miss, DECIMALS).as_dict() | {"name": name})
    return NoDesignError(count, ruled_out, miss, search.bounds)


@shown_in_notebooks
@arguments_checked
def robust_design(
    scene: Scene | str | Path,
    *,
    side: int | None = None,
    vary: Mapping[str, Ends] | Sequence[str] | None = None,
    tolerance: Mapping[str, str] | None = None,
    orders: bool = True,
    everywhere: bool = True,
    laid: LaidLike | None = None,
    evaluations: int = 1200,
    seed: int = 0,
    prove: float = SECONDS,
    progress: Progress | None = None,
    keep: Callable[[Scene], None] | None = None,
) -> RobustDesign:
    """Choose a part, a throw and an arm for which parts are fed in spite of large deviations.

    Parameters
    ----------
    scene : Scene, str or Path
        Where to begin: what is not varied is kept, in the minimal model.
    side : int, optional
        The side on which parts are to be fed; default that of the scene's goal, else the last.
    vary : mapping of str to (float or None, float or None), or sequence of str, optional
        Quantities, with bounds in the scene's units or without; default the mass, the throw and the surface's height,
        as the scene gives them.  Bounds left out are usual ones, which hold the scene's own value.
    tolerance : mapping of str to str, optional
        What the margin multiplies, ``{"throw.speed": "1 %", "landing.x": "0.01 in"}``; default the scene's, or
        `TOLERANCE`.  landing.x is noise at every throw, all else fixed but unknown.
    orders : bool
        Whether a triangle's sides may be put in another order.
    everywhere : bool
        Whether no start on the arm may be lost, in the scene as it is.  The goals ask about the limit set only.
    laid : mapping of int to sequence of (float, float), optional
        Where parts are laid down, as for `limitsets.certify`: the proofs are of these starts, `everywhere` and `orders`
        are then off.  Default: the whole arm.
    evaluations : int
        Designs to look at, besides those drawn at first.
    seed : int
        Of the search; the same seed, the same answer.
    prove : float
        Seconds for the proofs of the design, and as many for those of the scene before; 0 for none.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.
    keep : callable, optional
        Called with the best design so far, as often as there is a better one: what is left of a search that is ended.

    Returns
    -------
    RobustDesign

    Raises
    ------
    AnswerError
        A scene with effects, a side that it does not have, or no design that feeds at all.

    Examples
    --------
    >>> import limitsets as ls
    >>> speed, along = {"throw.speed": "1 %"}, ["part.mass.center.along"]
    >>> found = ls.robust_design(
    ...     "paper-designed", vary=along, tolerance=speed, orders=False, evaluations=4, prove=0.0
    ... )
    >>> found.scene.name, found.side
    ('paper-designed-robust', 2)
    """
    start = load(scene)
    require_searchable(start, evaluations)
    on = _side(start, side)
    ranges = read_laid(start, laid)
    orders, everywhere = orders and not ranges, everywhere and not ranges
    tell = progress or silent
    texts, begin = tolerance_of(start, tolerance), time.perf_counter()
    vector = Tolerance.of(start, texts)
    names, given = (None, vary) if isinstance(vary, Mapping) else (vary, None)
    # a part whose masses are given is made as it is written
    lead = "center" in start.text["part"]["mass"]
    searches = [
        DesignSearch(
            scene=one,
            tolerance=vector,
            side=on,
            bounds=bounds_of(one, names, given),
            order=number,
            lead=lead,
            everywhere=everywhere,
        )
        for number, one in enumerate(orders_of(start) if orders else [start])
    ]
    if keep is not None:
        best_yet = [0.0]

        def better(scene: Scene, estimate: Estimate) -> None:
            if estimate.margin > best_yet[0] and math.isfinite(estimate.x):
                best_yet[0] = estimate.margin
                keep(_with_purpose(scene, estimate.x, on, texts, f"{start.name}-robust"))

        for one in searches:
            one.better = better
    search, population = _searched(searches, evaluations, seed, tell)
    made_so = partial(search.rounded, decimals=DECIMALS)
    best = polished(search, population[:POLISHED], made_so, max(evaluations // POLISH, 1), tell)
    if best is None:
        raise _none_feeds(searches, search, population[0], f"{start.name}-robust")
    made, estimate = best
    x = round(estimate.x, DECIMALS_OF_X)
    design = _with_purpose(made, x, on, texts, f"{start.name}-robust")
    before = on_all_corners(start, vector, on)
    history = tuple(candidate for each in searches for candidate in each.history)
    feeding = throws_to_feed(design, x, on, seed=seed)
    values = {name: design.value(name) for name in search.bounds}
    own_option = Option(Candidate(values, estimate, search.order), feeding)
    front = front_of(searches, history, own_option, on, seed, tell)
    seconds = time.perf_counter() - begin
    margins = _proved(design, fed_at(x, on, ranges), texts, prove, tell, "the design")
    fed, own = None, tuple[Margin, ...]()
    if before is not None and before.margin > 0.0:
        fed = throws_to_feed(start, before.x, on, seed=seed)
        goals = fed_at(round(before.x, DECIMALS_OF_X), on, ranges)
        own = _proved(start, goals, texts, prove, tell, "the scene before")
    return RobustDesign(
        scene=design,
        goals=fed_at(x, on, ranges),
        x=x,
        side=on,
        varied=tuple(search.bounds),
        tolerance=texts,
        sampled=estimate,
        margins=margins,
        lead=counterweight_of(design),
        feeding=feeding,
        front=front,
        history=history,
        before=start,
        before_sampled=before,
        before_margins=own,
        before_feeding=fed,
        evaluations=sum(each.evaluations for each in searches),
        seconds=seconds,
    )


def _proved(
    scene: Scene, goals: Sequence[Goal], texts: Mapping[str, str], seconds: float, tell: Progress, whose: str
) -> tuple[Margin, ...]:
    """Bracket the joint margin of each goal by itself: one may be proved much farther than the other.

    Without time for it there are no margins.
    """

    def bracketed(goal: Goal) -> Margin:
        def told(share: float) -> None:
            tell(f"margin of {whose}, {goal.kind}", math.floor(100 * share), 100)

        return joint_margin(scene, (goal,), texts, seconds=seconds / len(goals), tell=told)

    return tuple(map(bracketed, goals if seconds > 0.0 else ()))


def _side(scene: Scene, side: int | None) -> int:
    asked = side if side is not None else getattr(scene.goal, "side", len(scene.sides) - 1)
    if not 0 <= asked < len(scene.sides):
        raise AnswerError("the side", asked, f"0 to {len(scene.sides) - 1}", "name a side of this part")
    return int(asked)
