"""What may be asked of an answer: the goals a scene can name, as data, and how extents decide them.

A goal is a frozen dataclass with its units resolved.  `evaluate` reads it off extents that were sampled or proved
elsewhere; it knows no map and no graph.
"""

from limitsets.goals.ask import evaluate
from limitsets.goals.goal import (
    GOALS,
    Found,
    Goal,
    Place,
    Side,
    Sides,
    Verdict,
    as_written,
    declare,
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

__all__ = [
    "GOALS",
    "AttractsAll",
    "FlipOrder",
    "Found",
    "Goal",
    "OrientedBeyond",
    "Place",
    "Predicate",
    "Reaches",
    "Side",
    "Sides",
    "StaysOnArm",
    "Verdict",
    "as_written",
    "declare",
    "evaluate",
    "order_of",
    "unknown_goal",
    "words_of",
]
