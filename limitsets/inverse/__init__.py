"""From the answer wanted to the scene: critical points with their derivatives, design, and design for a margin."""

from limitsets.inverse.derivatives import CriticalJacobian, critical_jacobian

__all__ = ["CriticalJacobian", "critical_jacobian"]
