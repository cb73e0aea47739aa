"""`limitsets feedback`: which throw on which answer of a sensor of one bit brings the part to the goal."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.base.errors import LimitsetsError
from limitsets.face.cli.about import About
from limitsets.face.cli.arguments import HELP_NO_RECHECK, certified, deviations, place, places_of, said_of
from limitsets.face.cli.output import (
    Csv,
    Form,
    Format,
    Json,
    Scene,
    Words,
    answer,
    opened,
    option,
    progress,
    table,
)

if TYPE_CHECKING:
    from limitsets.proofs.policies import Synthesis


HELP_STARTS = "Where the part may lie at first, like 2=16:18; repeatable. Default: the limit sets of [throw]."


def feedback(
    scene: Scene,
    mode: Annotated[
        str, option("--mode", "MODE", "stop (the controller knows) or catch (a cavity).")
    ] = "stop",
    x: Annotated[str | None, option("--x", "X", "Of the goal region; default that of the goal.")] = None,
    beyond: Annotated[str | None, option("--beyond", "X", "Ask instead: is the part beyond X?")] = None,
    error: Annotated[str, option("--error", "E", "Of the sensor at --beyond or --sweep.")] = "0",
    side: Annotated[int | None, option("--side", "I", "Ask instead: does the part lie on side I?")] = None,
    blind: Annotated[bool, typer.Option("--blind", help="Ask nothing.")] = False,
    sweep: Annotated[str | None, option("--sweep", "LO:HI:N", "Try N places of the sensor.")] = None,
    start: Annotated[Words, option("--starts", "SIDE=LO:HI", HELP_STARTS)] = None,
    begin: Annotated[str | None, option("--from", "X", "Every start from X on, on all sides.")] = None,
    throws: Annotated[int, option("--throws", "N", "The most throws.", min=0, max=100)] = 30,
    cells: Annotated[int, option("--cells", "N", "Cells per side.", min=8, max=10_000)] = 1024,
    noise: Annotated[Words, option("--noise", "Q=DEV", "At every throw, like throw.speed='0.3 %'.")] = None,
    seconds: Annotated[float, option("--seconds", "S", "The most time of a search.", min=0.0)] = 60.0,
    parts: Annotated[int, option("--parts", "N", "Parts thrown by the policy.", min=1)] = 10_000,
    form: Format = Form.PNG,
    csv: Csv = None,
    out: Annotated[
        Path | None, option("--out -o", "DIR", "Write feedback.json, policy.csv and a figure there.")
    ] = None,
    certificate: Annotated[
        Path | None, option("--certificate", "FILE", "Write the policy's certificate, NAME.proof.zip.")
    ] = None,
    json: Json = False,
    no_recheck: Annotated[bool, typer.Option("--no-recheck", help=HELP_NO_RECHECK)] = False,
) -> None:
    """Find a policy for a sensor that answers one question, and throw it.

    Exit 1 where none is found: there is none within so many throws on these cells, or it is not decided.
    """
    with progress() as tell:
        chosen, _ = opened(scene, out)
        from limitsets.proofs.policies import feedback as run
        from limitsets.proofs.policies import places
        from limitsets.proofs.policies.simulation import simulate

        goal = None if x is None else _goal_at(chosen, place(chosen, x))
        options: dict[str, Any] = {
            "mode": mode,
            "goal": goal,
            "starts": _starts(chosen, start, begin),
            "throws": throws,
            "cells": cells,
            "noise": deviations("--noise", noise),
            "seconds": seconds,
            "progress": tell,
        }
        tried: list[tuple[float, Synthesis]] = []
        if sweep is None:
            synthesis = run(chosen, _sensor(chosen, beyond, error, side, blind=blind), **options)
        else:
            at = places_of(chosen, sweep, "--sweep")
            tried = list(zip(at, places(chosen, at, error=place(chosen, error), **options), strict=True))
            synthesis = min(
                (each for _, each in tried), key=lambda each: (not each.solved, each.found.throws)
            )
        written = None
        if certificate is not None:
            tell("recheck", 0, 1)
            again = not no_recheck
            synthesis, written = certified(
                synthesis, certificate, "policy", proved=synthesis.solved, recheck=again
            )
        thrown = simulate(synthesis, parts) if synthesis.solved else None
        record = synthesis.to_json() | {
            "certificate": written,
            "simulated": thrown,
            "places": [
                {"x": x, "verdict": each.found.verdict, "within": each.found.throws} for x, each in tried
            ],
        }
        if out is not None:
            _write(synthesis, record, out, form)
    answer(
        record,
        json,
        lambda: _text(synthesis, tried, thrown, out, written),
        csv=(csv if synthesis.solved else None, synthesis.table),
        about=About(synthesis.model, scene),
    )
    raise typer.Exit(0 if synthesis.solved else 1)


def _goal_at(scene: Any, x: float) -> tuple[float, int]:
    from limitsets.feeder.goals import OrientedBeyond, Reaches

    if not isinstance(scene.goal, OrientedBeyond | Reaches):
        kind = None if scene.goal is None else scene.goal.kind
        raise LimitsetsError("the goal", kind, "one with x and side", "leave --x out", key="--x")
    return x, scene.goal.side


def _sensor(scene: Any, beyond: str | None, error: str, side: int | None, *, blind: bool) -> Any:
    from limitsets.feeder.scene.surroundings import BeyondSensor, SideSensor

    if (beyond is not None) + (side is not None) + blind > 1:
        raise LimitsetsError("the sensor", "several", "one question", "give one of --beyond, --side, --blind")
    if blind:
        return "none"
    if side is not None:
        if not 0 <= side < len(scene.sides):
            allowed = f"0 to {len(scene.sides) - 1}"
            raise LimitsetsError("the side", side, allowed, "name a side of this part", key="--side")
        return SideSensor(side)
    return None if beyond is None else BeyondSensor(place(scene, beyond), place(scene, error))


def _starts(scene: Any, words: list[str] | None, begin: str | None) -> Any:
    if begin is not None:
        if words:
            raise LimitsetsError("the starts", "--from and --starts", "one of them", "leave one out")
        return place(scene, begin)
    starts = {}
    for word in words or []:
        side, sign, span = word.partition("=")
        lo, colon, hi = span.partition(":")
        if not (sign and colon and side.strip().isdigit()) or int(side) in starts:
            remedy = "name each side once, and two places with : between"
            raise LimitsetsError("the starts", word, "SIDE=LO:HI", remedy, key="--starts")
        starts[int(side)] = (place(scene, lo), place(scene, hi))
    return starts or None


def _write(synthesis: Synthesis, record: dict[str, Any], out: Path, form: str) -> None:
    from limitsets.base.files import as_json
    from limitsets.face.report.writing import laid

    policy = synthesis.found.policy
    drawn = []
    if policy is not None:
        from limitsets.face.plot.policies import policy as draw

        drawn = [("policy", draw(synthesis))]
    text = {"feedback.json": as_json(record)}
    if policy is not None:
        text["policy.csv"] = synthesis.table().csv()
    laid(out, drawn, lambda _: text, form)


def _text(
    synthesis: Synthesis,
    tried: list[tuple[float, Synthesis]],
    thrown: Any,
    out: Path | None,
    written: dict[str, Any] | None,
) -> None:
    from limitsets.face.report.pages import in_time

    unit = synthesis.scene.unit
    x, side = synthesis.goal
    wanted = {"stop": "known to lie", "catch": "to be caught"}[synthesis.mode]
    typer.echo(f"{synthesis.scene.name}: the part is {wanted} on side {side} at x = {x:.9g} {unit} or beyond")
    typer.echo(f"starts: {synthesis.starts_are}: {_spans(synthesis.starts.extents())}")
    if tried:
        table(
            ("sensor at", ""),
            [(f"{place:.6g} {unit}", _verdict(each)) for place, each in tried],
        )
    typer.echo(f"question: {synthesis.question}")
    typer.echo(_verdict(synthesis))
    if synthesis.found.verdict == "not-solved":
        typer.echo(
            "next: more --throws or --cells, --sweep LO:HI:N for another place of the sensor, or another throw in"
            " [[feedback.throws]]"
        )
    policy = synthesis.found.policy
    if written is not None:
        typer.echo(said_of(written, "there is no policy"))
    if out is not None:
        typer.echo(f"written to {out}: feedback.json" + ("" if policy is None else ", policy.csv, figure"))
    if policy is None:
        return
    rows = []
    for state, belief in zip(policy.to_json()["states"], synthesis.beliefs(), strict=True):
        after = ", ".join(f"{word}: {at}" for word, at in state["after"].items() if at is not None)
        rows.append([state["state"], _spans(belief), state["throw"] or "stop", after, state["left"]])
    table(("state", "the part lies on", "throw", "next", "throws left"), rows)
    first = policy.to_json()["first"]
    typer.echo("begin: " + ", ".join(f"{word}: state {at}" for word, at in first.items() if at is not None))
    if thrown is not None:
        timed = in_time(thrown.mean, synthesis.scene.world.throw_rate, parts=True)
        more = "".join(f", {count} {what}" for what, count in thrown.failures.items())
        typer.echo(
            f"thrown: {thrown.reached} of {thrown.parts} came, in {thrown.mean:.3g} throws on average{timed}{more}"
        )


def _verdict(synthesis: Synthesis) -> str:
    what = synthesis.found
    if synthesis.solved:
        return f"solved: {what.throws} throws are enough (proved, for every start and every noise named)"
    least = f"no policy of {what.throws} throws" if what.throws >= 0 else "nothing shown"
    if what.verdict == "not-solved":
        return f"not with {what.throws} throws on these cells ({what.beliefs} beliefs)"
    return (
        f"not decided: {what.reason} ({what.beliefs} beliefs, {what.seconds:.3g} s); {least} on these cells"
    )


def _spans(extents: Any) -> str:
    return "; ".join(
        f"side {side}: " + ", ".join(f"{lo:.4g} to {hi:.4g}" for lo, hi in parts)
        for side, parts in extents.items()
    )
