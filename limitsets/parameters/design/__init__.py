"""Inverse problems: critical points with their derivatives, design for critical points, and design for a margin.

`critical` differentiates critical points by the implicit function theorem, on dual numbers, and finds roots with that
(`design`); `margin` looks for a large margin by the floats of `limitsets.robust`, counts throws to feed, and has what
it ends with proved there (`robust_design`).  Nothing here is compiled or proved.
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
