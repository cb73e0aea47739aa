"""A throw as a rigid body among contacts, in plain coordinates: what the effects are compared with.

Written apart from the kernels.  The part is a list of points about its centre of mass, its motion is integrated in
(x, y, theta) by scipy's DOP853, contact forces come from 2 x 2 systems, impulses from `routh`, flights are searched for
their first contact on a fine grid, and a mode of contact is found by trying them all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.thrower.effects.routh import routh

TIGHT: dict[str, Any] = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-15}


class OutsideError(Exception):
    """The model does not say what happens."""


@dataclass(frozen=True)
class Body:
    """A part: its corners counterclockwise about the centre of mass, and its radius of gyration."""

    corners: np.ndarray
    rho: float

    def edge(self, side: int) -> tuple[int, int]:
        """Left and right corner of a side; flipping counterclockwise puts the edge before on the arm."""
        n = len(self.corners)
        return -side % n, (1 - side) % n

    def numbers(self) -> dict[str, Any]:
        """Keyword arguments of `throw_map` that say what the part is."""
        rows = []
        for side in range(len(self.corners)):
            left, right = (self.corners[k] for k in self.edge(side))
            before = self.corners[self.edge(side)[0] - 1]
            along = (right - left) / np.hypot(*(right - left))
            back = (left - before) / np.hypot(*(left - before))
            d = along[0] * -left[1] - along[1] * -left[0]
            rows.append(
                (-left @ along, d, np.hypot(*(right - left)), np.arccos(np.clip(back @ along, -1, 1)))
            )
        a, d, length, corner = np.transpose(rows)
        return {"a": a, "d": d, "length": length, "corner": corner, "radius_of_gyration": self.rho}

    def lying(self, side: int) -> float:
        """Angle by which the part is turned when it lies on a side."""
        left, right = (self.corners[k] for k in self.edge(side))
        return -float(np.arctan2(right[1] - left[1], right[0] - left[0]))

    def reach(self, theta: float) -> np.ndarray:
        """Corners relative to the centre of mass, turned by theta."""
        c, s = np.cos(theta), np.sin(theta)
        return self.corners @ np.array([[c, s], [-s, c]])


def random_body(rng: np.random.Generator) -> Body:
    """A convex part that can lie on each of its sides."""
    while True:
        n = int(rng.integers(3, 6))
        angles = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
        size, flat = rng.uniform(1.5, 3.0), rng.uniform(0.5, 1.0)
        corners = size * np.stack([np.cos(angles), flat * np.sin(angles)], 1)
        corners -= rng.uniform(-0.4, 0.4, 2)
        body = Body(corners, rng.uniform(0.5, 0.9) * float(np.hypot(*corners.T).mean()))
        facts = body.numbers()
        a, d = facts["a"], facts["d"]
        if (a > 0.15).all() and (facts["length"] - a > 0.15).all() and (d > 0.15).all():
            return body


@dataclass
class Law:
    """What happens at a contact; None: it sticks, or is a hinge, or does not bounce, or lies still."""

    slip: float | None = None
    pivot: float | None = None
    restitution: float | None = None
    threshold: float = 0.0
    roll: bool = False


class Simulation:
    """One throw; `run` gives the place and the side it ends on.  State: x, y, theta and their rates."""

    def __init__(self, body: Body, kappa: float, height: float, law: Law) -> None:
        self.body, self.kappa, self.height, self.law = body, kappa, height, law
        self.inverse = np.diag([1.0, 1.0, 1.0 / body.rho**2])
        self.rubbed = 0.0  # energy lost by friction while sliding
        self.modes: list[str] = []

    # -------------------------------------------------------------- bodies and contacts

    def energy(self, y: np.ndarray) -> float:
        return float(0.5 * (y[3] ** 2 + y[4] ** 2 + (self.body.rho * y[5]) ** 2) + self.kappa * y[1])

    def lever(self, y: np.ndarray, corner: int) -> np.ndarray:
        """Velocity of a corner = lever @ rates."""
        rx, ry = self.body.reach(y[2])[corner]
        return np.array([[1.0, 0.0, -ry], [0.0, 1.0, rx]])

    def heights(self, y: np.ndarray) -> np.ndarray:
        return y[1] + self.body.reach(y[2])[:, 1]

    def loaded(self, y: np.ndarray, corner: int, force: np.ndarray) -> np.ndarray:
        """Derivative of the state under gravity and a force on one corner."""
        rates = np.array([0.0, -self.kappa, 0.0]) + self.inverse @ self.lever(y, corner).T @ force
        return np.concatenate([y[3:6], rates])

    def forces(self, y: np.ndarray, corner: int) -> dict[str, np.ndarray]:
        """The force on a corner in each mode; nan where there is none."""
        lever = self.lever(y, corner)
        compliance = lever @ self.inverse @ lever.T
        r = self.body.reach(y[2])[corner]
        free = np.array([0.0, -self.kappa]) - y[5] ** 2 * r
        mu = self.law.pivot if self.law.pivot is not None else self.law.slip
        found = {"stick": np.linalg.solve(compliance, -free), "off": np.zeros(2)}
        for name, way in (("right", 1.0), ("left", -1.0)):
            cone = np.array([-way * (mu or 0.0), 1.0])
            stiffness = compliance[1] @ cone
            found[name] = cone * (-free[1] / stiffness) if stiffness > 0 else np.full(2, np.nan)
        return found

    # -------------------------------------------------------------- flight

    def flight(self, y: np.ndarray) -> tuple[np.ndarray, int]:
        """Fly to the first corner that strikes."""
        radius = float(np.hypot(*self.body.corners.T).max())
        end = (y[4] + np.sqrt(y[4] ** 2 + 2 * self.kappa * max(y[1] + radius, 0))) / self.kappa

        def at(t: float) -> np.ndarray:
            there = y[:3] + y[3:6] * t - (0.0, 0.5 * self.kappa * t**2, 0.0)
            return np.append(there, y[3:6] - (0.0, self.kappa * t, 0.0))

        for corner in np.flatnonzero(self.heights(y) < 1e-9):
            if (self.lever(y, corner) @ y[3:6])[1] < -1e-9:
                return y, int(corner)
        times = np.concatenate([np.geomspace(1e-5, 1e-3, 200)[:-1], np.linspace(1e-3, 1.0, 20_000)]) * end
        theta = y[2] + y[5] * times
        tall = np.stack([np.sin(theta), np.cos(theta)], 1) @ self.body.corners.T
        over = (y[1] + y[4] * times - 0.5 * self.kappa * times**2)[:, None] + tall
        if (over[0] < -1e-12).any():
            raise OutsideError
        below = np.flatnonzero((over[1:] <= 0).any(1))
        k = int(below[0]) + 1
        roots = {
            corner: brentq(lambda t, c=corner: self.heights(at(t))[c], times[k - 1], times[k], xtol=1e-16)
            for corner in np.flatnonzero(over[k] <= 0)
        }
        first = min(roots, key=lambda corner: roots[corner])
        return at(roots[first]), int(first)

    # -------------------------------------------------------------- impacts

    def impact(self, y: np.ndarray, corner: int) -> np.ndarray:
        """Strike: a corner that sticks whatever that takes, or Routh's law."""
        plastic = self._impact(y, corner, 0.0)
        after = plastic
        if self.law.restitution is not None:
            thrown = self._impact(y, corner, self.law.restitution)
            lift = (self.lever(y, corner) @ thrown[3:6])[1]
            after = thrown if lift > 0 and lift**2 / (2 * self.kappa) > self.law.threshold else plastic
        return after

    def _impact(self, y: np.ndarray, corner: int, restitution: float) -> np.ndarray:
        lever, after = self.lever(y, corner), y.copy()
        gain = self.inverse @ lever.T
        if self.law.slip is not None:
            after[3:6], push = routh(gain, lever, y[3:6], self.law.slip)
            after[3:6], _ = routh(gain, lever, after[3:6], self.law.slip, restitution * push)
            return after
        compliance = lever @ gain
        stop = np.linalg.solve(compliance, -lever @ y[3:6])
        held = np.array([-compliance[0, 1] / compliance[0, 0], 1.0])
        after[3:6] += gain @ (stop + restitution * max(stop[1], 0.0) * held)
        return after

    # -------------------------------------------------------------- contact

    def integrate(
        self, y: np.ndarray, corner: int, force: Callable[[np.ndarray], np.ndarray], events: list[Any]
    ) -> tuple[np.ndarray, int]:
        """Move under a contact force to the first event: one of `events`, or (the last) another corner touching."""
        others = np.array([k for k in range(len(self.body.corners)) if k != corner])

        def down(y: np.ndarray) -> float:
            return float(self.heights(y)[others].min() - self.heights(y)[corner])

        settling = down(y) < 1e-9
        marks = [lambda t, y, e=e: e(y) for e in (*events, down)]
        for mark in marks:
            mark.terminal, mark.direction = True, -1.0

        def rates(_: float, y: np.ndarray) -> np.ndarray:
            pull = force(y)
            return np.append(self.loaded(y, corner, pull), -pull @ (self.lever(y, corner) @ y[3:6]))

        start = np.append(y, 0.0)
        if settling:
            late = solve_ivp(rates, (0, 1e-6), start, **TIGHT)
            if down(late.y[:6, -1]) < down(y):
                return y, len(events)
            start = late.y[:, -1]
        run = solve_ivp(rates, (0, 1e3), start, events=marks, max_step=0.02, **TIGHT)
        if not any(len(hits) for hits in run.t_events):
            raise OutsideError
        self.rubbed += float(run.y[6, -1])
        return run.y[:6, -1], next(k for k, hits in enumerate(run.t_events) if len(hits))

    def hinge(self, y: np.ndarray, corner: int) -> np.ndarray:
        self.modes.append("hinge")
        return self.integrate(y, corner, lambda y: self.forces(y, corner)["stick"], [])[0]

    def on_corner(self, y: np.ndarray, corner: int) -> tuple[np.ndarray, bool]:
        """From just after a plastic impact on; the state, and whether the part is down on a side."""
        slid = False
        for _ in range(50):
            along = (self.lever(y, corner) @ y[3:6])[0]
            if abs(along) < 1e-11 and self.law.pivot is None and not slid:
                return self.hinge(y, corner), True
            mode = self.mode(y, corner) if abs(along) < 1e-11 else ("right" if along > 0 else "left")
            if mode == "stick" and self.law.pivot is None:
                return self.hinge(y, corner), True
            self.modes.append(mode)
            if mode == "off":
                return y, False
            mu = self.law.pivot if self.law.pivot is not None else self.law.slip
            assert mu is not None

            def force(y: np.ndarray, mode: str = mode) -> np.ndarray:
                return self.forces(y, corner)[mode]

            def cone(y: np.ndarray, mu: float = mu) -> float:
                pull = self.forces(y, corner)["stick"]
                return float(mu * pull[1] - abs(pull[0]))

            def sliding(y: np.ndarray, way: float = 1.0 if mode == "right" else -1.0) -> float:
                return float(way * (self.lever(y, corner) @ y[3:6])[0])

            def pushed(y: np.ndarray) -> float:
                return float(self.kappa + y[5] ** 2 * self.body.reach(y[2])[corner][1])

            if mode != "stick" and not np.isfinite(force(y)).all():
                raise OutsideError
            if mode != "stick" and pushed(y) < 0:
                self.modes.append("off")
                return y, False
            y, event = self.integrate(y, corner, force, [cone] if mode == "stick" else [sliding, pushed])
            slid = True
            if event == (1 if mode == "stick" else 2):
                return y, True
            if mode != "stick" and event == 1:
                return y, False
        raise OutsideError

    def mode(self, y: np.ndarray, corner: int) -> str:
        """Which mode a corner at rest goes over to: the one, of four, that its own force allows."""
        mu = self.law.pivot if self.law.pivot is not None else self.law.slip
        assert mu is not None
        forces = self.forces(y, corner)
        free = -(y[5] ** 2) * self.body.reach(y[2])[corner]
        allowed = []
        for name, pull in forces.items():
            lever = self.lever(y, corner)
            change = free + np.array([0.0, -self.kappa]) + (lever @ self.inverse @ lever.T @ pull)
            fits = {
                # just past the edge of the cone counts as past it: the event has been found there
                "stick": pull[1] > 0 and abs(pull[0]) <= mu * pull[1] * (1 - 1e-11),
                "off": change[1] >= 0,
                "right": pull[1] > 0 and change[0] > -1e-10,
                "left": pull[1] > 0 and change[0] < 1e-10,
            }
            if fits[name]:
                allowed.append(name)
        if not allowed:
            raise OutsideError
        return allowed[0]

    # -------------------------------------------------------------- a whole throw

    def run(self, x: float, side: int) -> tuple[float, int]:
        """Throw a part that rests on a side with its centre of mass at x; where it ends."""
        theta = self.body.lying(side)
        d = float(-self.body.reach(theta)[self.body.edge(side)[0], 1])
        y = np.array([x, d, theta, -(self.height + d), x, 1.0])
        y, corner = self.flight(y)
        for _ in range(200):
            y = self.impact(y, corner)
            lift = (self.lever(y, corner) @ y[3:6])[1]
            down = False
            if lift < 1e-12:
                y, down = self.on_corner(y, corner)
            if not down:
                y, corner = self.flight(y)
                continue
            low = np.argsort(self.heights(y))[:2]
            other = int(low[0] if low[1] == corner else low[1])
            if not self.moves(y, other, corner):
                return self.stop(y, corner, other)
            corner = other
        raise OutsideError

    def moves(self, y: np.ndarray, other: int, corner: int) -> bool:
        """Whether anything moves after the other end of a side has struck."""
        if self.law.restitution is None and not self.law.roll:
            return False
        after = self.impact(y, other)
        if (self.lever(y, other) @ after[3:6])[1] > 1e-12:
            return True
        if not self.law.roll or (self.lever(y, corner) @ after[3:6])[1] <= 0:
            return False
        reach = self.body.reach(y[2])
        left, right = sorted((corner, other), key=lambda k: reach[k, 0])
        if not reach[left, 0] < 0.0 < reach[right, 0]:
            self.modes.append("tips")  # nothing holds it there
            return True
        lift = min(self.lift(reach, left, left - 1, 1.0), self.lift(reach, right, right + 1, -1.0))
        turning = self.body.rho**2 * after[5] ** 2 + after[4] ** 2
        return bool(turning + after[3] ** 2 > 2 * self.kappa * lift and turning > 2e-12 * self.kappa * lift)

    def lift(self, reach: np.ndarray, foot: int, after: int, way: float) -> float:
        """How far the centre of mass rises at most while the part turns about a foot until the next corner is down."""
        along, up = reach[after % len(reach)] - reach[foot]
        free = np.arctan2(up, -way * along)  # until that corner is down
        ell, top = np.hypot(*reach[foot]), np.arctan2(-way * reach[foot, 0], -reach[foot, 1])
        return float(ell * (np.cos(top - min(top, free)) - np.cos(top)))

    def stop(self, y: np.ndarray, corner: int, other: int) -> tuple[float, int]:
        """Come to rest on a side: one impact of both ends, then sliding."""
        reach = self.body.reach(y[2])
        left, right = sorted((corner, other), key=lambda k: reach[k, 0])
        side = next(s for s in range(len(reach)) if self.body.edge(s) == (left, right))
        place = float(y[0])
        if self.law.slip is not None:
            # the part's velocity along the arm, while its fall and rotation end together
            push, d, mu = -y[4], -reach[corner, 1], self.law.slip
            gain = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, -y[5] / push]])
            lever = np.array([[1.0, 0.0, d], [0.0, 1.0, 0.0]])
            velocity, _ = routh(gain, lever, y[3:6], mu, push)
            if abs(velocity[0]) > 1e-12:
                ahead = reach[right, 0] if velocity[0] > 0 else -reach[left, 0]
                if mu == 0 or mu * d > ahead:
                    raise OutsideError
                place += velocity[0] * abs(velocity[0]) / (2 * mu * self.kappa)
        return place, side
