"""`limitsets scenes`: what is built in."""

from __future__ import annotations

from limitsets.cli.output import Csv, Json, Out, answer, show
from limitsets.tables import Column, Table


def scenes(out: Out = None, csv: Csv = None, json: Json = False) -> None:
    """List the built-in scenes."""
    from limitsets.scene import load
    from limitsets.scene import scenes as names

    records = [
        {
            "name": scene.name,
            "sides": len(scene.sides),
            "unit": scene.unit,
            "kappa": scene.kappa,
            "arm_length": scene.arm_length,
            "flight": scene.flight,
            "flip": scene.flip,
            "goal": None if scene.goal is None else scene.goal.kind,
        }
        for scene in map(load, names())
    ]

    columns = (
        "scene",
        "sides",
        Column("kappa", show=".6g"),
        Column("arm", show="g"),
        "unit",
        "flight",
        "flip",
        "goal",
    )
    words = ("name", "sides", "kappa", "arm_length", "unit", "flight", "flip", "goal")
    found = Table(columns, [[record[word] for word in words] for record in records], "Built-in scenes")
    answer(records, json, lambda: show(found), out, (csv, lambda: found))
