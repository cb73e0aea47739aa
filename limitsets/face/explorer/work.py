"""Slow computations in a separate process, ``python -m limitsets.face.explorer.work``: proofs, margins, an atlas.

The process reads one question as JSON from standard input, and answers with lines of JSON as the answers come.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from limitsets.base import LimitsetsError, Progress, SceneError, silent
from limitsets.feeder.geometry import convex_polygon, plate_with_points
from limitsets.feeder.geometry.polygon import above_side
from limitsets.feeder.scene import Scene, load
from limitsets.feeder.scene.units import written

if TYPE_CHECKING:
    import xarray as xr


# ----------------------------------------------------------------
# Scenes from outside, typed, uploaded or drawn: text only, never a path, and small enough to follow a slider.


MOST_BYTES = 64 * 1024
"""Largest size of a scene's text [bytes]: the largest built-in scene has 2 kB."""

MOST_SIDES = 16
"""Largest number of a part's sides: the work for a picture grows with it."""


def scene_from(text: str) -> Scene:
    r"""Read a scene that a visitor typed or sent.

    Every text is read as TOML: names of files or of built-in scenes are not looked up.

    Raises
    ------
    SceneError
        The text is too large, no TOML, or no scene.

    Examples
    --------
    >>> scene_from("/etc/passwd")
    Traceback (most recent call last):
    limitsets.base.errors.SceneError: the text of the scene is 'not valid'; allowed: TOML; ...
    """
    size = len(text.encode("utf-8", "surrogatepass"))
    if size > MOST_BYTES:
        raise SceneError(
            "the size of the scene", f"{size} bytes", f"at most {MOST_BYTES} bytes", "send the scene alone"
        )
    return within_reach(load(text + "\n"))  # text with a line break is never taken for a path


def within_reach(scene: Scene) -> Scene:
    """Refuse a part with more sides than a picture can follow."""
    if len(scene.sides) > MOST_SIDES:
        raise SceneError(
            "the number of sides", len(scene.sides), f"at most {MOST_SIDES}", "analyse it on the command line"
        )
    return scene


def with_outline(scene: Scene, corners: npt.ArrayLike) -> Scene:
    """Give the scene with another part: a plate of one thickness, its corners in either sense [length].

    A goal that asks for a side which the part does not have is left out.

    Raises
    ------
    GeometryError
        No convex polygon, or one that cannot rest on a side.

    Examples
    --------
    >>> import limitsets as ls
    >>> with_outline(ls.load("paper-designed"), [(0, 0), (0, 3), (6, 3), (6, 0)]).centre
    (3.0, 1.5)
    """
    points = np.asarray(corners, dtype=np.float64)
    if len(points) >= 3:
        x, y = points.T
        area = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
        points = points if area >= 0.0 else points[::-1]
    vertices = convex_polygon(points)
    plate = plate_with_points(vertices, 1.0)
    along, above, _ = above_side(vertices[0], vertices[1], plate.centre)
    unit, tree = scene.unit, scene.as_dict()
    tree["name"] = "drawn"
    tree["part"] = {
        "vertices": [[written(x, unit), written(y, unit)] for x, y in vertices.tolist()],
        "mass": {
            "center": {"side": 0, "along": written(float(along), unit), "above": written(float(above), unit)},
            "radius_of_gyration": written(float(plate.radius_of_gyration), unit),
        },
    }
    for table in ("cavity", "tray", "feedback", "tolerance"):
        tree.pop(table, None)
    if any(side >= len(vertices) for side in _sides_in(tree.get("goal"))):
        tree.pop("goal")
    return within_reach(load(tree))


def _sides_in(goal: Any) -> list[int]:
    """List the sides that a goal names."""
    if isinstance(goal, dict):
        own = [goal["side"]] if isinstance(goal.get("side"), int) else []
        return own + [side for each in goal.values() for side in _sides_in(each)]
    return [each for each in goal if isinstance(each, int)] if isinstance(goal, list) else []


# Points along each axis of a stored atlas that are shown: more would be smaller than a finger.
MOST_SHOWN = 48


def answers(question: Mapping[str, Any], tell: Progress = silent) -> Iterator[dict[str, Any]]:
    """Answer a question, line by line; `tell` is told of the way to the next line.

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
            yield from _proofs(scene, question["margins"], tell)
        else:
            yield _atlas(scene, question["x"], question["y"], tell)
    except LimitsetsError as error:
        yield {"error": str(error)}


def _proofs(scene: Scene, margins: list[str], tell: Progress) -> Iterator[dict[str, Any]]:
    """Prove what `certify` proves, then the goal's margin in each quantity."""
    from limitsets.feeder.scene import WITHOUT_SCATTER
    from limitsets.parameters.margins.margin_result import bound
    from limitsets.parameters.margins.single import margin
    from limitsets.proofs.prover.certifying import certify

    proof = certify(scene, progress=tell)
    for claim in proof.claims:
        told = {"starts": claim.starts, "share": claim.shares.get("share"), "note": claim.note}
        yield {"claim": claim.claim, "verdict": claim.verdict, "reason": claim.reason, **told}
    if scene.goal is None or not proof.proved:
        return
    for number, name in enumerate(margins):

        def among(step: str, _: int, __: int, number: int = number) -> None:
            tell(step.replace(" fixed,", ","), number, len(margins))  # the only reading that is asked for

        try:
            (bracket,) = margin(scene, name, reading="fixed", progress=among)
        except LimitsetsError as error:
            yield {"margin": name, "error": str(error)}
            continue
        refuted = None if bracket.refuted is None else bound(bracket.refuted, bracket.unit, up=True)
        yield {
            "margin": name,
            "proved": bound(bracket.proved, bracket.unit)
            + (f" {WITHOUT_SCATTER}" if scene.effects.spread else ""),
            "refuted": refuted,
        }


def _atlas(scene: Scene, x: str, y: str, tell: Progress) -> dict[str, Any]:
    from limitsets.parameters.atlas import atlas

    return table_of(atlas(scene, x, y, variables=["class"], progress=tell).dataset)


def table_of(data: xr.Dataset) -> dict[str, Any]:
    """Give the classes of an atlas as plain lists: axes with units, numbers of classes, their words and looks.

    Raises
    ------
    LimitsetsError
        The atlas does not have two axes, or has no classes.
    """
    from limitsets.face.plot.atlas_maps import look_of
    from limitsets.parameters.atlas.classes import is_classified, legend, numbers_of

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


# Seconds between two lines that tell of progress: people read no faster.
TOLD = 0.2


def main() -> None:
    """Answer the question on standard input, with lines that tell of progress between the answers."""
    last = -TOLD

    def tell(step: str, done: int, of: int) -> None:
        nonlocal last
        if time.monotonic() - last >= TOLD:
            last = time.monotonic()
            print(json.dumps({"step": step, "number": min(done + 1, of), "of": of}), flush=True)

    for line in answers(json.load(sys.stdin), tell):
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
