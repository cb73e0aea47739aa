"""The minimal model against the machine: how far effects that a scene calls for move a landing, and what survives that.

`measuring` compares throws with and without effects, by enclosures and by samples.  `model_discrepancy` chooses the
effects and follows the landings on the cells that are proved invariant with that deviation; `discrepancy_result` states
the answer.
"""

from limitsets.parameters.discrepancy.discrepancy_result import Discrepancy
from limitsets.parameters.discrepancy.model_discrepancy import discrepancy

__all__ = ["Discrepancy", "discrepancy"]
