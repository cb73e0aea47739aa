"""Feeding without the package's throw: the equations of docs/model.md in numpy, for parts that scatter one by one."""

import numpy as np

FATES = ("right", "wrong", "wall", "edge", "left", "never")


def thrown(scene, kappa, x, side):
    """Next x and side of parts at x on their sides, each with a kappa of its own; nan where no impact is found."""
    a, d, length = scene.sides.a, scene.sides.d, scene.sides.length
    a_i, d_i, h, rho = a[side], d[side], scene.surface_height, scene.radius_of_gyration
    # beyond the only root where kappa exceeds the distance of the struck corner: from there Newton comes down to it
    phi = (x + np.sqrt(x * x + 2.0 * kappa * (a_i + 2.0 * d_i))) / kappa
    for _ in range(40):
        height = x * phi - a_i * np.sin(phi) + d_i * (1.0 - np.cos(phi)) - 0.5 * kappa * phi**2
        step = height / (x - a_i * np.cos(phi) + d_i * np.sin(phi) - kappa * phi)
        phi = phi - step
        if np.abs(step).max() < 1e-12:
            break
    right, above = a_i * np.cos(phi) - d_i * np.sin(phi), a_i * np.sin(phi) + d_i * np.cos(phi)
    inertia = rho**2 + a_i**2 + d_i**2
    omega = (rho**2 + right * (x - kappa * phi) + above * (h + d_i)) / inertia
    barrier = kappa * (np.hypot(a_i, d_i) - above)
    flips = np.sign(omega) * 0.5 * inertia * omega**2 > np.sign(right) * barrier
    corner = x - (h + d_i) * phi - a_i * np.cos(phi) + d_i * np.sin(phi)
    after = np.where(flips, (side + 1) % a.size, side)
    landed = np.where(flips, corner - (length[after] - a[after]), corner + a_i)
    return np.where((x > a_i) & (phi > 0.0) & (phi <= 2.0 * np.pi), landed, np.nan), after


def shares(end, count, seed, speed=lambda random, n: np.zeros(n), landing=None, most=20_000):
    """Shares of the fates of parts from random starts; `speed` and `landing` draw deviations."""
    random, scene = np.random.default_rng(seed), end.scene
    lengths = np.maximum(end.x - end.starts, 0.0)
    side = random.choice(lengths.size, count, p=lengths / lengths.sum())
    x, met = random.uniform(end.starts[side], end.x), np.zeros(6)
    d, over = scene.sides.d, scene.sides.length - scene.sides.a
    for _ in range(most):
        # the impulse acts (rho^2 + d (h + d)) / x right of the foot of the centre of mass
        acts = x + (scene.radius_of_gyration**2 + d[side] * (scene.surface_height + d[side])) / x
        edge = (acts > end.x) & (x + over[side] > end.x)
        met[3] += edge.sum()
        x, side = x[~edge], side[~edge]
        if not x.size:
            break
        x, side = thrown(scene, scene.kappa / (1.0 + speed(random, x.size)) ** 2, x, side)
        x = x if landing is None else x + landing(random, x.size)
        beyond = x - end.x
        clear = np.zeros(x.size, dtype=bool)
        for lo, hi in end.clear:
            clear |= (beyond >= lo) & (beyond <= hi)
        left = ~((x > scene.sides.a[side]) & (x <= scene.arm_length))
        fed, wanted = ~left & (beyond >= 0.0), side == end.side
        fates = fed & wanted & clear, fed & ~wanted, fed & wanted & ~clear
        met[[0, 1, 2, 4]] += [fate.sum() for fate in (*fates, left)]
        x, side = x[~left & ~fed], side[~left & ~fed]
        if not x.size:
            break
    met[5] = x.size
    return dict(zip(FATES, met / count, strict=True))
