"""Maps with known answers, and their certificates by the second writer: what each proves is known from theory."""

import functools

import numpy as np

from tests.checker.maps_in_files import (
    Example,
    MapCertificate,
    arrays_of,
    cycle,
    ends_of,
    frames_of,
    hexed,
    region,
    uniform,
)

GAP = Example(
    1, "s", lambda x, p, _, branch: p.s * x[0] - 1.0 if branch else p.s * x[0] + 0.9, lambda x, *_: x[0] + 0.0
)
HENON = Example(2, "a b", lambda x, p, *_: (1.0 - p.a * x[0] ** 2 + x[1], p.b * x[0]))
DELAYED = Example(2, "alpha", lambda x, p, *_: (x[1], x[1] * np.exp(p.alpha - x[0])))
RICKER = Example(1, "r", lambda x, p, *_: x[0] * np.exp(p.r * (1.0 - x[0])))


def leslie(x, p, *_):
    return (p.a * x[0] + p.b * x[1]) * np.exp(-0.1 * (x[0] + x[1])), 0.7 * x[0]


LESLIE = Example(2, "a b", leslie)


def pendulum(x, p, *_):
    """One step of Runge and Kutta's method for a damped pendulum that is pushed by a constant torque."""

    def field(angle, speed):
        return speed, p.push - np.sin(angle) - p.damping * speed

    h = 0.1
    (a1, s1) = field(x[0], x[1])
    (a2, s2) = field(x[0] + 0.5 * h * a1, x[1] + 0.5 * h * s1)
    (a3, s3) = field(x[0] + 0.5 * h * a2, x[1] + 0.5 * h * s2)
    (a4, s4) = field(x[0] + h * a3, x[1] + h * s3)
    return x[0] + (h / 6.0) * (a1 + 2.0 * (a2 + a3) + a4), x[1] + (h / 6.0) * (s1 + 2.0 * (s2 + s3) + s4)


PENDULUM = Example(2, "damping push", pendulum)


def slopes_along(points, slope):
    return [np.atleast_2d(slope(*np.atleast_1d(point))) for point in points]


def refined(step, point, times=200):
    """A point of an attracting cycle, by iteration."""
    for _ in range(times):
        point = step(point)
    return point


@functools.cache
def gap():
    """x' = 1.4 x + 0.9 up to 0, 1.4 x - 1 beyond: expanding, with a repelling 2-cycle through (1 - 1.26)/0.96."""
    cells = arrays_of(GAP, uniform((-1.3, 1.2), cells=1000), {"s": [1.4]})
    x = (1.0 - 1.4 * 0.9) / (1.4**2 - 1.0)
    claims = {
        "invariant": {},
        "trapping": {},
        "basin": {},
        "attracts-all": {"max_rank": int(cells["rank"].max())},
        "expanding": {"least": hexed(1.399999)},
        "cycles": {"cycles": [cycle([x, 1.4 * x + 0.9], branches=[0, 1])]},
    }
    return MapCertificate(GAP, [({"s": "1.4"}, claims, cells)])


@functools.cache
def seven(a="1.24", width=1e-9):
    """The attracting 7-cycle of Henon's map at a = 1.24 (a range: the boxes are wider)."""

    def step(z):
        return np.array([1.0 - 1.24 * z[0] ** 2 + z[1], 0.3 * z[0]])

    points = [refined(step, np.array([0.1, 0.1]), 20_000)]
    for _ in range(6):
        points.append(step(points[-1]))
    slopes = slopes_along(points, lambda x, y: [[-2.48 * x, 1.0], [0.3, 0.0]])
    listed = cycle(points, width=width, frames=frames_of(slopes))
    a = list(a) if isinstance(a, tuple) else a
    return MapCertificate(HENON, [({"a": a, "b": "0.3"}, {"cycles": {"cycles": [listed]}}, None)])


def graded(centre, lo, hi, least, growth):
    """Edges of cells that grow with the distance from the centre."""
    edges = [centre]
    for sign, end in ((1.0, hi), (-1.0, lo)):
        x = centre
        while sign * (end - x) > 0:
            x += sign * max(least, growth * abs(x - centre))
            edges.append(x if sign * (end - x) > 0 else end)
    return np.unique(edges)


@functools.cache
def delayed(radius=0.06, least=0.005, growth=0.04):
    """Two-generation Ricker's map: every orbit of the block around (alpha, alpha) tends to it."""
    lo, hi = 0.6, 0.601
    edges = [[graded(0.6005, 0.02, 2.6, least, growth)] * 2]
    slope = np.array([[0.0, 1.0], [-0.6005, 1.0]])
    _, vectors = np.linalg.eig(slope)
    frame = np.column_stack([vectors[:, 0].real, vectors[:, 0].imag])
    frame = frame / np.linalg.norm(frame, 2)
    corners = ends_of(edges[0])
    inverse, far = np.linalg.inv(frame), np.zeros(len(corners[0]))
    for i in (0, 1):
        for j in (0, 1):
            off = np.column_stack([corners[i][:, 0], corners[j][:, 1]]) - 0.6005
            far = np.maximum(far, np.linalg.norm(off @ inverse.T, axis=1))
    arrays = arrays_of(DELAYED, edges, {"alpha": [lo, hi]}, final=far < radius - 0.003)
    listed = cycle([(0.6005, 0.6005)], width=0.002, frames=[frame], radius=radius)
    claims = {"cycles": {"cycles": [listed]}, "converges": {"components": [0], "cycles": [0]}, "basin": {}}
    return MapCertificate(DELAYED, [({"alpha": ["0.6", "0.601"]}, claims, arrays)])


@functools.cache
def ricker(cells=3000):
    """A margin: orbits end in [0.35, 1.65] for r in [2.3, 2.35], and an open set of starts does not at r = 2.5."""
    inner = arrays_of(RICKER, uniform((0.02, 2.6), cells=cells), {"r": [2.3, 2.325, 2.35]}, whole=True)

    def step(x):
        return x * np.exp(2.5 * (1.0 - x))

    low = refined(step, 0.3, 20_000)
    points = [low, step(low)]
    slopes = slopes_along(points, lambda x: [[np.exp(2.5 * (1.0 - x)) * (1.0 - 2.5 * x)]])
    refuting = {"cycles": {"cycles": [cycle(points, frames=frames_of(slopes))]}, "refuted": {}}
    goal = {"starts": [region((0.02, 2.6))], "ends": [region((0.35, 1.65))]}
    boxes = [({"r": ["2.3", "2.35"]}, {"basin": {}, "ends-in": {}}, inner), ({"r": "2.5"}, refuting, None)]
    return MapCertificate(RICKER, boxes, goal)


@functools.cache
def two_ages(cells=256):
    arrays = arrays_of(LESLIE, uniform((0.0, 90.0), (0.0, 70.0), cells=cells), {"a": [19.6], "b": [23.68]})
    return MapCertificate(LESLIE, [({"a": "19.6", "b": "23.68"}, {"trapping": {}, "basin": {}}, arrays)])


@functools.cache
def pushed(cells=48):
    box = uniform((-0.6, 1.2), (-0.9, 0.9), cells=cells)
    arrays = arrays_of(PENDULUM, box, {"damping": [1.2], "push": [0.3]}, count=3)
    return MapCertificate(
        PENDULUM, [({"damping": "1.2", "push": "0.3"}, {"trapping": {}, "basin": {}}, arrays)]
    )
