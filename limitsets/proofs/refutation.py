"""Writing an orbit that refutes a goal, so that a stranger can throw it again.

A certificate with the one claim "refuted": the attracting cells, which are checked as for "invariant"; a start in them;
what each throw was like; and within which deviations of which nominal values the scene lies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from limitsets.goals import OrientedBeyond
from limitsets.proofs.asked import State
from limitsets.proofs.asked.oriented_beyond import section_of
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.certificate import write
from limitsets.scene import Scene
from limitsets.scene.quantities import text_at

__all__ = ["write_refutation"]


def _nominal(scene: Scene, name: str) -> str:
    by_kappa = name == "throw.speed" and "kappa" in scene.text["throw"]
    return str(text_at(scene.text, "throw.kappa" if by_kappa else name))


def write_refutation(
    path: str | Path,
    found: Attraction,
    goal: OrientedBeyond,
    states: Sequence[State],
    within: Mapping[str, str],
    scene: Scene,
    *,
    recheck: bool = True,
) -> None:
    """Write it, replacing an older file whole; it gets its name once the checker has confirmed it.

    Parameters
    ----------
    path : str or Path
        The file.
    found : Attraction
        The cells, of the scene that refutes and its noise.
    goal : OrientedBeyond
        What is refuted.
    states : sequence of State
        The orbit.
    within : mapping of str to str
        Deviations from the nominal scene that its own do not exceed, by quantity.
    scene : Scene
        The nominal scene.
    recheck : bool
        Whether to check it first.
    """
    box = found.cover.box
    section = {
        "goal": section_of(goal, scene),
        "start": {"x": float(states[0].lo).hex(), "side": states[0].side},
        "throws": [
            {
                "kappa": float(state.kappa).hex() if box.kappa_varies and state.kappa is not None else None,
                "landing": float(state.landing).hex() if state.landing else None,
            }
            for state in states[:-1]
        ],
        "nominal": {name: _nominal(scene, name) for name in within},
        "tolerance": dict(within),
    }
    write(
        path,
        [found],
        [{"claim": "refuted", "section": section, "verdict": "refuted"}],
        noise=box.noise or None,
        tolerance=None,
        unit=scene.unit,
        producer={},
        recheck=recheck,
    )
