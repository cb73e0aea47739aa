"""What a figure is of: a scene, or a map of one's own with its domain, as a transition graph carries them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.analysis import other_vertex_first
from limitsets.errors import AnswerError
from limitsets.graph import TransitionGraph
from limitsets.maps.contract import kind_of
from limitsets.scene import Scene

if TYPE_CHECKING:
    from limitsets.cells import Domain
    from limitsets.goals import Goal


class Subject(NamedTuple):
    """A map in one dimension, and how to speak of it.

    Parameters
    ----------
    name : str
        Whose figure it is.
    unit : str
        Of x; empty for a map of one's own.
    map : NamedTuple
        The parameters of the map.
    domain : Domain
        Where its states lie.
    least, most : ndarray of shape (sides,), float
        Where a state can be on each side, and on any: of a scene a_i and the arm's end.
    goal : Goal or None
        Of a scene.
    branches : tuple of str
        Names of the codes from 0.
    flags : dict
        Where another vertex lands first, per side.
    thrown : bool
        Whether it is a scene.
    """

    name: str
    unit: str
    map: Any
    domain: Domain
    least: NDArray[np.float64]
    most: float
    goal: Goal | None
    branches: tuple[str, ...]
    flags: Mapping[int, Sequence[tuple[float, float]]]
    thrown: bool

    @property
    def in_brackets(self) -> str:
        """The unit behind the name of a quantity."""
        return f" [{self.unit}]" if self.unit else ""

    @property
    def sides(self) -> int:
        """How many there are."""
        return len(self.least)


def subject_of(source: Scene | TransitionGraph) -> Subject:
    """Read a scene or a transition graph.

    Raises
    ------
    AnswerError
        A map in more than one dimension.
    """
    if isinstance(source, Scene):
        branches, flags = kind_of(source.map).branches, other_vertex_first(source)
        ends = (source.sides.a, source.arm_length)
        return Subject(
            source.name, source.unit, source.map, source.domain, *ends, source.goal, branches, flags, True
        )  # fmt: skip
    domain = source.grid.domain
    if source.grid.dimension > 1:
        remedy = "draw its basins, or a section of it"
        raise AnswerError("the dimension of the map", source.grid.dimension, "1", remedy)
    kind = kind_of(source.map)
    ends = (domain.lo[:, 0], float(domain.hi.max()))
    return Subject(type(source.map).__name__, "", source.map, domain, *ends, None, kind.branches, {}, False)
