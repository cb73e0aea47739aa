"""All answers about a scene at once, as `limitsets analyse` shows them.

The answers are computed in `limitsets.sets` and below; this room calls for them in turn, times them, evaluates the
scene's goal and writes JSON.
"""

from limitsets.parameters.analysis.accuracy import Accuracy, Plan, plan_for
from limitsets.parameters.analysis.checks import (
    GoalOutcome,
    Starts,
    in_limit_sets,
    other_vertex_first,
    proved_averages,
)
from limitsets.parameters.analysis.run import Analysis, analyse

__all__ = [
    "Accuracy",
    "Analysis",
    "GoalOutcome",
    "Plan",
    "Starts",
    "analyse",
    "in_limit_sets",
    "other_vertex_first",
    "plan_for",
    "proved_averages",
]
