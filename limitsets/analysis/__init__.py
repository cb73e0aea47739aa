"""From a scene to all answers at once: what `limitsets analyse` shows.

The answers themselves are made in `limitsets.sets` and below; here they are asked for in turn, timed, held against the
scene's goal and written as JSON.
"""

from limitsets.analysis.accuracy import Accuracy, Plan, plan_for
from limitsets.analysis.asked import Answered
from limitsets.analysis.flags import other_vertex_first, overlap
from limitsets.analysis.run import Analysis, analyse
from limitsets.analysis.starts import Starts

__all__ = [
    "Accuracy",
    "Analysis",
    "Answered",
    "Plan",
    "Starts",
    "analyse",
    "other_vertex_first",
    "overlap",
    "plan_for",
]
