"""The goals that a scene can name, as data, and their evaluation on extents.

A goal is a frozen dataclass with resolved units.  `evaluate` decides it on extents that were sampled or proved
elsewhere, without a map or a graph.
"""

from limitsets.feeder.goals.kinds import (
    GOALS,
    AttractsAll,
    FlipOrder,
    Found,
    Goal,
    Laid,
    OrientedBeyond,
    Place,
    Predicate,
    Reaches,
    Side,
    Sides,
    StaysOnArm,
    Verdict,
    as_written,
    by_side,
    declare,
    evaluate,
    laid_words,
    order_of,
    unknown_goal,
    words_of,
)

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
