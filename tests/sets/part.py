"""A throw of the paper's scenes at 40 digits, from the decimals of the scene, written apart from the package."""

from __future__ import annotations

from typing import Any

import mpmath

# A context of its own: other tests set the digits of the shared one.
mp = mpmath.MPContext()
mp.dps = 40

SIDES = [mp.mpf(text) for text in ("5.75", "3.6", "6.75")]
RADIUS_OF_GYRATION = mp.mpf("1.25")
# Height of the arm's surface, centre of mass along and above side 2 from its left end, kappa [in].
DATA = {
    "paper-initial-small-angle": ("-1.0", "3.2444722", "1.7898493", "85.2549144"),
    "paper-designed-small-angle": ("-1.0", "4.4179581", "0.5040259", "48.6228609"),
    "paper-initial": ("-0.2", "3.9867006", "1.8835981", "33.3605945"),
    "paper-designed": ("-0.2", "4.2255778", "0.7082490", "25.3778518"),
}


class Part:
    """The part of a scene and how it is thrown; docs/model.md, with its letters."""

    def __init__(self, name: str, data: Any = None) -> None:
        self.small = "small" in name
        self.lengths = SIDES
        self.h, along, above, self.kappa = (mp.mpf(text) for text in data or DATA[name])
        # Side 2 from (0, 0) to (6.75, 0); the apex joins side 0 (left) and side 1 (right).
        left, right = (mp.mpf(0), mp.mpf(0)), (SIDES[2], mp.mpf(0))
        apex_x = (SIDES[0] ** 2 - SIDES[1] ** 2 + SIDES[2] ** 2) / (2 * SIDES[2])
        apex = (apex_x, mp.sqrt(SIDES[0] ** 2 - apex_x**2))
        self.a, self.d = [], []
        for (px, py), (qx, qy) in ((apex, left), (right, apex), (left, right)):
            length = mp.hypot(qx - px, qy - py)
            ux, uy = (qx - px) / length, (qy - py) / length
            self.a.append((along - px) * ux + (above - py) * uy)
            self.d.append((above - py) * ux - (along - px) * uy)
        self.rho2 = RADIUS_OF_GYRATION**2

    def angle(self, R: Any, i: int) -> Any:
        """Angle turned in the air."""
        a, d, kappa = self.a[i], self.d[i], self.kappa
        if self.small:
            return 2 * (R - a) / kappa

        def height(p: Any) -> Any:
            return R - a * mp.sin(p) / p + d * (1 - mp.cos(p)) / p - kappa * p / 2

        return mp.findroot(height, 2 * (R - a) / (kappa - d))

    def margin(self, R: Any, i: int) -> Any:
        """K - V, or F* of the signed criterion: positive for a flip."""
        a, d, kappa, p = self.a[i], self.d[i], self.kappa, self.angle(R, i)
        M, ell = self.rho2 + a**2 + d**2, mp.hypot(a, d)
        if self.small:
            om = (self.rho2 - a * R + 2 * a**2 + d**2 + d * self.h) / M
            return M * om**2 / 2 - (kappa * (ell - d) - 2 * a * (R - a))
        X, H = a * mp.cos(p) - d * mp.sin(p), a * mp.sin(p) + d * mp.cos(p)
        om = (self.rho2 + X * (R - kappa * p) + H * (self.h + d)) / M
        return mp.sign(om) * M * om**2 / 2 - mp.sign(X) * kappa * (ell - H)

    def critical_point(self, i: int, near: float) -> Any:
        """R at which the margin is 0."""
        return mp.findroot(lambda R: self.margin(R, i), near)

    def throw(self, R: Any, i: int, branch: str) -> tuple[Any, int]:
        """Where a throw leads that jogs or flips as told."""
        a, d, p = self.a[i], self.d[i], self.angle(R, i)
        jog = R - self.h * p
        if not self.small:
            jog += a * (1 - mp.cos(p)) - d * (p - mp.sin(p))
        if branch == "jog":
            return jog, i
        k = (i + 1) % 3
        return jog - a - (self.lengths[k] - self.a[k]), k
