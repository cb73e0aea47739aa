"""What may be asked of an answer: the goals a scene can name, as data, and how extents decide them.

A goal is a frozen dataclass with its units resolved.  `evaluate` reads it off extents that were sampled or proved
elsewhere; it knows no map and no graph.
"""

from limitsets.goals.ask import Verdict, evaluate
from limitsets.goals.kinds import (
    AttractsAll,
    FlipOrder,
    Goal,
    OrientedBeyond,
    Predicate,
    Reaches,
    StaysOnArm,
    unknown_goal,
)

__all__ = [
    "AttractsAll",
    "FlipOrder",
    "Goal",
    "OrientedBeyond",
    "Predicate",
    "Reaches",
    "StaysOnArm",
    "Verdict",
    "evaluate",
    "unknown_goal",
]
