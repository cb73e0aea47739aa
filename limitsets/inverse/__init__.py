"""From the answer wanted to the scene: critical points with their derivatives, design, and design for a margin.

`critical_jacobian` differentiates by the implicit function theorem, on dual numbers (`dual`, `seeded`, `decision`);
`design` finds roots with it (`unknowns`, `trials`, `solving`, `nearest`).  Nothing here is compiled or proved.
"""

from limitsets.inverse.along import limit_sets_along
from limitsets.inverse.derivatives import CriticalJacobian, critical_jacobian
from limitsets.inverse.designing import Design, design

__all__ = ["CriticalJacobian", "Design", "critical_jacobian", "design", "limit_sets_along"]
