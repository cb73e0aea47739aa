"""From the answer wanted to the scene: critical points with their derivatives, design, and design for a margin.

`critical_jacobian` differentiates by the implicit function theorem, on dual numbers (`dual`, `seeded`, `decision`);
`design` finds roots with it (`unknowns`, `trials`, `solving`, `nearest`).  `robust_design` looks for a large margin by
floats (`trap`, `sharp`, `sound`, `lead`, `search`), counts throws (`feeding`, `front`), and has `limitsets.robust`
prove what it ends with.  Nothing here is compiled or proved.
"""

from limitsets.inverse.along import limit_sets_along
from limitsets.inverse.derivatives import CriticalJacobian, critical_jacobian
from limitsets.inverse.designing import Design, design
from limitsets.inverse.for_margin import RobustDesign, robust_design

__all__ = [
    "CriticalJacobian",
    "Design",
    "RobustDesign",
    "critical_jacobian",
    "design",
    "limit_sets_along",
    "robust_design",
]
