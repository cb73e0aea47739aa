"""The throw map: from the place and side of rest before a throw to those after it.

The steps of one throw stand in `throw.py` in the order in which nature applies them: flight, impact, decision,
landing.  Each has a file; each model of flight (exact, small angle in two orders) and each criterion of the flip
(signed, energy) is a class, and kernels pick their method by it at compile time, so that a scene's machine code
contains only its own models.

Notation (all lengths in the scene's unit; rates divided by the throw's w, energies by m w^2): a part on side i has
its centre of mass a above the arm's axis direction from the left bottom vertex and d above the side; R = x is the
centre's distance along the arm, h the signed height of the arm's surface over the joint, kappa = g / w^2.
Source: Murphey, Bernheisel, Choi, Lynch, "An Example of Parts Handling and Self-Assembly Using Stable Limit Sets",
with the misprints corrected as listed in docs/model.md.
"""

from limitsets.feeder.thrower.params import Energy, Exact, Signed, SmallAngle, SmallAngle2, Throw, throw_map
from limitsets.feeder.thrower.traced import Flight, Trace, fly, impact_angles, trace

__all__ = [
    "Energy",
    "Exact",
    "Flight",
    "Signed",
    "SmallAngle",
    "SmallAngle2",
    "Throw",
    "Trace",
    "fly",
    "impact_angles",
    "throw_map",
    "trace",
]
