"""Critical points at 40 digits, from the model's formulas alone (docs/model.md): nothing of the package is used.

A part is a triangle with sides (L0, L1, L2) and its centre of mass measured on side 2; quantities are a dict by the
scene's names.  Derivatives are differences at 40 digits, of steps so small that their error is below 1e-15.
"""

from mpmath import mp, mpf

mp.dps = 40
STEP = mpf(10) ** -12

ALONG, ABOVE = "part.mass.center.along", "part.mass.center.above"
RHO, H, KAPPA, SPEED = "part.mass.radius_of_gyration", "arm.surface_height", "throw.kappa", "throw.speed"
SIDES = [f"part.sides[{k}]" for k in range(3)]


def feet(q):
    """a and d on each side: side 2 on the real axis from 0, side 0 ends and side 1 begins in the third corner."""
    lengths = [mpf(q[name]) for name in SIDES]
    right, centre = mp.mpc(lengths[2]), mp.mpc(q[ALONG], q[ABOVE])
    x = (lengths[0] ** 2 - lengths[1] ** 2 + lengths[2] ** 2) / (2 * lengths[2])
    third = mp.mpc(x, mp.sqrt(lengths[0] ** 2 - x**2))
    found = []
    for left, to in ((third, mp.mpc(0)), (right, third), (mp.mpc(0), right)):
        foot = (centre - left) * mp.conj((to - left) / abs(to - left))
        found.append((foot.real, foot.imag))
    return found


def kappa(q):
    return q["gravity"] / mpf(q[SPEED]) ** 2 if SPEED in q else mpf(q[KAPPA])


def closed_form(q, side):
    """First critical point of the small-angle energy model."""
    (a, d), rho, h, k = feet(q)[side], mpf(q[RHO]), mpf(q[H]), kappa(q)
    ell, m = mp.hypot(a, d), rho**2 + a**2 + d**2
    big = rho**2 + 2 * a**2 + d**2 + d * h
    z = 2 - mp.sqrt(4 - 2 / m * (2 * big - 2 * a**2 - k * (ell - d)))
    return (big - m * z) / a


def margin(q, side, flight, flip, R, near):
    """Positive where the part flips; the impact is the root of the height near an angle."""
    (a, d), rho, h, k = feet(q)[side], mpf(q[RHO]), mpf(q[H]), kappa(q)
    ell, m = mp.hypot(a, d), rho**2 + a**2 + d**2
    if flight == "exact":
        phi = mp.findroot(
            lambda p: R * p - a * mp.sin(p) + d * (1 - mp.cos(p)) - k / 2 * p**2,
            (mpf(near) * mpf("0.9999"), mpf(near) * mpf("1.0001")),
            tol=mpf(10) ** -70,
        )
        X, up = a * mp.cos(phi) - d * mp.sin(phi), a * mp.sin(phi) + d * mp.cos(phi)
        omega, V = (rho**2 + X * (R - k * phi) + up * (h + d)) / m, k * (ell - up) * mp.sign(X)
    else:
        omega = (rho**2 - a * R + 2 * a**2 + d**2 + d * h) / m
        V = k * (ell - d) - 2 * a * (R - a)
    K = m * omega**2 / 2
    return (mp.sign(omega) if flip == "signed" else 1) * K - V


def critical_point(q, side, flight, flip, near):
    """The root of the margin near (x, phi)."""
    x, phi = near
    return mp.findroot(
        lambda R: margin(q, side, flight, flip, R, phi),
        (mpf(x) * (1 - mpf(10) ** -9), mpf(x) * (1 + mpf(10) ** -9)),
        tol=mpf(10) ** -60,
    )


def slope(f, q, name):
    """df/dq by a central difference."""
    up, down = ({**q, name: mpf(q[name]) + sign * STEP} for sign in (1, -1))
    return (f(up) - f(down)) / (2 * STEP)
