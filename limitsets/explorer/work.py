"""What takes seconds, in a process of its own: proofs, margins, a small atlas.  ``python -m limitsets.explorer.work``.

It reads one question as JSON from standard input, and answers with lines of JSON as the answers come.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from limitsets.errors import LimitsetsError
from limitsets.explorer.outside import scene_from

if TYPE_CHECKING:
    import xarray as xr

    from limitsets.scene import Scene

# Points along each axis of a stored atlas that are shown; the rest would be smaller than a finger.
MOST_SHOWN = 48


def answers(question: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Answer a question, line by line.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = answers({"what": "proof", "scene": ls.dump(ls.load("paper-designed")), "margins": []})
    >>> [(line["claim"], line["verdict"]) for line in found]
    [('attracts-all', 'proved'), ('goal', 'proved')]
    """
    scene = scene_from(question["scene"])
    try:
        if question["what"] == "proof":
            yield from _proofs(scene, question["margins"])
        else:
            yield _atlas(scene, question["x"], question["y"])
    except LimitsetsError as error:
        yield {"error": str(error)}


def _proofs(scene: Scene, margins: list[str]) -> Iterator[dict[str, Any]]:
    """Prove what `certify` proves, then the goal's margin in each quantity."""
    from limitsets.proofs.certify import certify
    from limitsets.robust.margins.finding import margin
    from limitsets.robust.margins.margin_texts import bound
    from limitsets.scene.left_out import WITHOUT_SCATTER

    proof = certify(scene)
    for claim in proof.claims:
        told = {"starts": claim.starts, "share": claim.shares.get("share"), "note": claim.note}
        yield {"claim": claim.claim, "verdict": claim.verdict, "reason": claim.reason, **told}
    if scene.goal is None or not proof.proved:
        return
    for name in margins:
        try:
            (found,) = margin(scene, name, reading="fixed")
        except LimitsetsError as error:
            yield {"margin": name, "error": str(error)}
            continue
        refuted = None if found.refuted is None else bound(found.refuted, found.unit, up=True)
        yield {
            "margin": name,
            "proved": bound(found.proved, found.unit)
            + (f" {WITHOUT_SCATTER}" if scene.effects.spread else ""),
            "refuted": refuted,
        }


def _atlas(scene: Scene, x: str, y: str) -> dict[str, Any]:
    from limitsets.sweep import atlas

    return table_of(atlas(scene, x, y, variables=["class"]).dataset)


def table_of(data: xr.Dataset) -> dict[str, Any]:
    """Give the classes of an atlas as plain lists: axes with units, numbers of classes, their words and looks.

    Raises
    ------
    LimitsetsError
        It has not two axes, or says nothing of classes.
    """
    from limitsets.plot.atlas_maps import look_of
    from limitsets.sweep.classes import is_classified, legend, numbers_of

    names = [axis["name"] for axis in data.attrs["plan"]["axes"]]
    if len(names) != 2 or not is_classified(data):
        allowed = "an atlas of two quantities with the variable class"
        raise LimitsetsError("the atlas", f"of {', '.join(names)}", allowed, "compute such a one")
    data = data.isel({name: slice(None, None, -(-data.sizes[name] // MOST_SHOWN)) for name in names})
    numbers, _ = numbers_of(data)
    axes = [
        {"name": name, "unit": data[name].attrs.get("units", ""), "values": data[name].values.tolist()}
        for name in reversed(names)  # x first
    ]
    entries = [
        {"number": each.number, "words": each.words, "share": each.share, **look_of(each.number, each.name)}
        for each in legend(data)
    ]
    return {"axes": axes, "numbers": numbers.tolist(), "classes": entries}


def main() -> None:
    """Answer the question on standard input."""
    for line in answers(json.load(sys.stdin)):
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
