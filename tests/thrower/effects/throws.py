"""Random parts and throws with effects, and what the simulation and the map make of them."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from limitsets.feeder.thrower import Throw, throw_map
from limitsets.feeder.thrower.full import with_effects
from limitsets.feeder.thrower.motion import FullThrow
from limitsets.systems.maps.drivers import images
from tests.thrower.effects.simulation import Body, Law, OutsideError, Simulation, random_body


@dataclass(frozen=True)
class Case:
    """A random part, throw and world."""

    body: Body
    kappa: float
    height: float
    x: float
    side: int
    world: SimpleNamespace

    @property
    def bare(self) -> Throw:
        return throw_map(**self.body.numbers(), kappa=self.kappa, surface_height=self.height, arm_length=1e3)

    def full(self, names: tuple[str, ...]) -> FullThrow:
        return with_effects(self.bare, dict.fromkeys(names, True), self.world)

    def simulation(self, names: tuple[str, ...]) -> Simulation:
        mu = self.world.friction
        law = Law(
            slip=mu if "slip" in names else None,
            pivot=mu if "pivot" in names else None,
            restitution=self.world.restitution if "bounce" in names else None,
            threshold=self.world.bounce_threshold,
            roll="roll" in names,
        )
        return Simulation(self.body, self.kappa, self.height, law)

    def simulated(self, names: tuple[str, ...]) -> tuple[float, int] | None:
        """Where the simulation sees the throw end; None outside the model."""
        try:
            return self.simulation(names).run(self.x, self.side)
        except OutsideError:
            return None

    def mapped(self, names: tuple[str, ...]) -> tuple[float, int] | None:
        """Where the map sees it end."""
        image = images(self.full(names) if names else self.bare, np.array([self.x]), self.side)
        return (float(image.x[0]), int(image.side[0])) if image.code[0] != -3 else None


def cases(count: int, seed: int, **world: Any) -> list[Case]:
    """Random cases; what `world` does not fix is drawn."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        body = random_body(rng)
        facts = body.numbers()
        side = int(rng.integers(len(facts["a"])))
        kappa = float(np.hypot(facts["a"], facts["d"]).max() * np.exp(rng.uniform(0.1, 2.5)))
        drawn = {
            "friction": float(10 ** rng.uniform(-1.2, 0.5)),
            "restitution": float(rng.uniform(0.0, 0.7)),
            "bounce_threshold": float(10 ** rng.uniform(-3.0, -1.0)),
        }
        x = float(facts["a"][side] + kappa * 10 ** rng.uniform(-2.0, 0.2))
        height = float(rng.uniform(-1.0, 0.5))
        found.append(Case(body, kappa, height, x, side, SimpleNamespace(**{**drawn, **world})))
    return found


def same_end(one: tuple[float, int] | None, other: tuple[float, int] | None, within: float = 1e-12) -> bool:
    """Whether two throws end on one side and at one place, relative to its distance, or both outside the model."""
    if one is None or other is None:
        return one is other
    return one[1] == other[1] and abs(one[0] - other[0]) <= within * max(abs(one[0]), 1.0)


def agree(case: Case, names: tuple[str, ...]) -> bool:
    """Whether map and simulation see the same end; to 1e-8: bounces magnify what the simulation leaves."""
    return same_end(case.mapped(names), case.simulated(names), 1e-8)
