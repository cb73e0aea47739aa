"""A robust design for others: plain tables for JSON, and a folder with the scene, the answer and the certificates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limitsets.files import as_json
from limitsets.robust.margins.answer import settled
from limitsets.scene import Scene, dump

if TYPE_CHECKING:
    from limitsets.inverse.margin.for_margin import RobustDesign
    from limitsets.inverse.margin.sharp import Sharp
    from limitsets.robust import Margin

__all__ = ["both", "ratio", "save", "to_json"]


def both(margins: Sequence[Margin]) -> tuple[float | None, float | None]:
    """Give the factor to which all goals are proved, and that at which one is refuted; None where not known."""
    refuted = [one.refuted for one in margins if one.refuted is not None]
    return min((one.proved for one in margins), default=None), min(refuted, default=None)


def ratio(found: RobustDesign) -> float | None:
    """Give what is proved of the design over what is refuted of the scene before: so often larger at least."""
    proved, refuted = both(found.margins)[0], both(found.before_margins)[1]
    return None if proved is None or not refuted else proved / refuted


def _sampled(found: Sharp | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "margin": found.margin,
        "x": None if found.x != found.x else found.x,
        "threshold": found.threshold,
        "reach": found.reach,
        "effects": {name: list(pair) for name, pair in found.effects.items()},
    }


def _quantities(scene: Scene, names: tuple[str, ...]) -> dict[str, float]:
    return {name: scene.value(name) for name in names}


def to_json(found: RobustDesign) -> dict[str, Any]:
    """Give a robust design as plain tables; every number is finite or null."""
    sides = tuple(
        f"part.sides[{k}]" for k in range(len(found.scene.sides)) if "sides" in found.scene.text["part"]
    )
    names = (*sides, *found.varied)
    lead = found.lead
    return {
        "scene": found.scene.as_dict(),
        "x": found.x,
        "side": found.side,
        "tolerance": found.tolerance,
        "values": _quantities(found.scene, names),
        "before": _quantities(found.before, names),
        "sampled": _sampled(found.sampled),
        "margins": [one.to_json() for one in found.margins],
        "before_sampled": _sampled(found.before_sampled),
        "before_margins": [one.to_json() for one in found.before_margins],
        "ratio": ratio(found),
        "lead": {"share": lead.share, "x": lead.x, "y": lead.y, "inside": lead.inside},
        "throws": found.feeding.to_json(),
        "before_throws": None if found.before_feeding is None else found.before_feeding.to_json(),
        "front": [option.to_json() for option in found.front],
        "evaluations": found.evaluations,
        "timings": {"search": found.seconds},
    }


def save(found: RobustDesign, folder: Path, *, recheck: bool = True) -> tuple[RobustDesign, tuple[Path, ...]]:
    """Write scene, answer, and what `limitsets.recheck` checks; return the design without what it denies, the files."""
    folder.mkdir(parents=True, exist_ok=True)
    scene, answer = folder / f"{found.scene.name}.toml", folder / "design.json"
    dump(found.scene, scene)
    margins = [settled(one, folder, recheck=recheck) for one in found.margins]
    left = replace(found, margins=tuple(one for one, _ in margins))
    answer.write_text(as_json(to_json(left)), encoding="utf-8", newline="\n")
    return left, (scene, answer, *(path for _, paths in margins for path in paths))
