"""Inverse problems: critical points with their derivatives, design for critical points, and design for a margin.

`derivatives` differentiates critical points by the implicit function theorem, on dual numbers; `solving` and
`for_critical` find roots with that (`design`).  `search` looks for a large margin by the floats of
`limitsets.parameters.margins`; `for_margin` and `for_goal` have the result proved there (`robust_design`).  Nothing in
this room is compiled or proved.
"""

from limitsets.parameters.design.derivatives import CriticalJacobian, critical_jacobian
from limitsets.parameters.design.design_result import RobustDesign
from limitsets.parameters.design.for_critical import Design, design, limit_sets_along
from limitsets.parameters.design.for_margin import robust_design

__all__ = [
    "CriticalJacobian",
    "Design",
    "RobustDesign",
    "critical_jacobian",
    "design",
    "limit_sets_along",
    "robust_design",
]
