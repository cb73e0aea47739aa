"""`limitsets scenes`: what is built in."""

from __future__ import annotations

from limitsets.cli.output import Json, Out, answer, table

__all__ = ["scenes"]


def scenes(out: Out = None, json: Json = False) -> None:
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

    def text() -> None:
        rows = [
            [
                record["name"],
                record["sides"],
                f"{record['kappa']:.6g} {record['unit']}",
                f"{record['arm_length']:g} {record['unit']}",
                record["flight"],
                record["flip"],
                record["goal"] or "-",
            ]
            for record in records
        ]
        table(["scene", "sides", "kappa", "arm", "flight", "flip", "goal"], rows)

    answer(records, json, text, out)
