"""The certificate of a policy: all that a recheck needs, and nothing that it has to trust.

The file is laid out as every certificate (docs/certificates.md).  Its scene names the throws and the sensor; places
that cells are cut at stand as the floats that they are, written in full.
"""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.policies.board import Board
from limitsets.policies.policy import NONE, Policy
from limitsets.proofs.certificate import brackets, pack, tidy
from limitsets.proofs.cover import Cover, targets
from limitsets.scene.sensing import Sensor, exact_text
from limitsets.scene.units import spelled_plainly

Arrays = dict[str, NDArray[Any]]


def write(
    path: str | Path,
    board: Board,
    sensor: Sensor | None,
    policy: Policy,
    *,
    recheck: bool,
    workers: int | None,
) -> Path:
    """Write it, replacing an older file whole."""
    if any(box.effects for box in board.throws.values()):
        raise AnswerError(
            "the certificate",
            "with effects",
            "the minimal model, and noise",
            "nothing rechecks other maps; the policy stands in .found and .to_json()",
        )
    model = {"flight": board.scene.flight, "flip": board.scene.flip}
    x, side = board.goal
    spans = [[side, lo.hex(), hi.hex()] for side, parts in board.starts.extents().items() for lo, hi in parts]
    section = {
        "scene": _scene(board, sensor) | {"model": model},
        "mode": board.mode,
        "goal": {"x": f"{exact_text(x)} {board.scene.unit}", "side": side},
        "starts": spans,
        "within": max((int(policy.left[k]) for k in policy.first if k != NONE), default=0),
        "first": policy.to_json()["first"],
    }
    try:
        producer = {"limitsets": version("limitsets")}
    except PackageNotFoundError:  # sources that are not installed
        producer = {}
    header = {
        "map": model,
        "noise": spelled_plainly(board.noise) if board.noise else None,
        "tolerance": None,
        "boxes": [],
        "claims": [{"claim": "policy", "section": spelled_plainly(section)}],
        "producer": producer,
    }
    held = _of_policy(policy) | _of_throws(board, policy)
    pack(path, header, held, board.scene.unit, {"policy": "proved"} if recheck else None, workers)
    return Path(path)


def _scene(board: Board, sensor: Sensor | None) -> dict[str, Any]:
    """Write the scene with the sensor that is asked; its own goal may be another one and is left out."""
    scene = board.scene
    text: dict[str, Any] = tidy(
        {word: each for word, each in scene.text.items() if word not in ("effects", "goal")}
    )
    text["feedback"].pop("sensor", None)
    if sensor is not None:
        text["feedback"]["sensor"] = dict(sensor.as_text(scene.unit))
    if board.mode == "catch" and scene.cavity is not None:
        text["cavity"]["position"] = f"{exact_text(board.goal[0])} {scene.unit}"
    if scene.effects.spread:
        text["effects"] = {"spread": scene.effects.spread}
    return text


def _of_policy(policy: Policy) -> Arrays:
    """Write the table: what is thrown in each state, what comes after, and where the part may lie (ranges of cells)."""
    edge = np.zeros((policy.states, 1), dtype=bool)
    steps = np.diff(np.concatenate([edge, policy.belief, edge], axis=1).astype(np.int8), axis=1)
    state, first = np.nonzero(steps == 1)
    _, past = np.nonzero(steps == -1)
    return {
        "throw": policy.throw.astype(np.int32),
        "left": policy.left.astype(np.int32),
        "after": policy.after.astype(np.int32).squeeze(axis=1 if len(policy.answers) == 1 else ()),
        "belief": np.stack([state, first, past - 1], axis=1).astype(np.int32),
    }


def _of_throws(board: Board, policy: Policy) -> Arrays:
    """Write the cells, and where each throw leads from those in which it is made; -1 and 0 for the others."""
    held: Arrays = {f"edges.{side}": edges for side, (edges,) in enumerate(board.starts.grid.edges)}
    for number, cover in enumerate(board.covers.values()):
        made = policy.belief[policy.throw == number].any(axis=0)
        for name, value in _images(cover).items():
            none = -1 if name != "phi" else 0.0
            held[f"{number}.{name}"] = np.where(made[:, None], value, none).astype(value.dtype)
    return held


def _images(cover: Cover) -> Arrays:
    return {"jog": targets(cover, 0), "flip": targets(cover, 1), "phi": brackets(cover)}
