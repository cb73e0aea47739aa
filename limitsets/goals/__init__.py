"""The goals that a scene can name, as data, and their evaluation on extents.

A goal is a frozen dataclass with resolved units.  `evaluate` decides it on extents that were sampled or proved
elsewhere, without a map or a graph.
"""

from limitsets.goals.goal import (
    GOALS,
    Found,
    Goal,
    Laid,
    Place,
    Side,
    Sides,
    Verdict,
    as_written,
    by_side,
    declare,
    laid_words,
    words_of,
)
from limitsets.goals.kinds import (
    AttractsAll,
    FlipOrder,
    OrientedBeyond,
    Predicate,
    Reaches,
    StaysOnArm,
    order_of,
    unknown_goal,
)
from limitsets.goals.verdicts import evaluate

__all__ = [
    "GOALS",
    "AttractsAll",
    "FlipOrder",
    "Found",
    "Goal",
    "Laid",
    "OrientedBeyond",
    "Place",
    "Predicate",
    "Reaches",
    "Side",
    "Sides",
    "StaysOnArm",
    "Verdict",
    "as_written",
    "by_side",
    "declare",
    "evaluate",
    "laid_words",
    "order_of",
    "unknown_goal",
    "words_of",
]
