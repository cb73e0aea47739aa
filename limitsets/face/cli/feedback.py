"""`limitsets feedback`: which throw on which answer of a sensor of one bit brings the part to the goal."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import limitsets as ls
from limitsets.base import BETWEEN, LimitsetsError, Table
from limitsets.face import report
from limitsets.face.cli.arguments import (
    certified,
    deviations,
    goal_at,
    named,
    place,
    places_of,
    said_of,
)
from limitsets.face.cli.commands import Answer, Run, Scene, Words, command, limits

if TYPE_CHECKING:
    from limitsets.proofs.policies import PolicyChances, Synthesis


@command(form=True)
def feedback(
    run: Run,
    scene: Scene,
    *,
    mode: str = "stop",
    x: str | None = None,
    beyond: str | None = None,
    error: str = "0",
    side: int | None = None,
    blind: bool = False,
    sweep: str | None = None,
    starts: Words = None,
    from_: str | None = None,
    throws: Annotated[int, limits(min=0, max=100)] = 30,
    cells: Annotated[int, limits(min=8, max=10_000)] = 1024,
    noise: Words = None,
    seconds: Annotated[float, limits(min=0.0)] = 60.0,
    parts: Annotated[int, limits(min=1)] = 10_000,
    brackets: Annotated[int | None, limits(min=8, max=100_000)] = None,
    certificate: Path | None = None,
    no_recheck: bool = False,
) -> Answer:
    """Find a policy for a sensor that answers one question, and throw it.

    Exit 1 where none is found: there is none within so many throws on these cells, or it is not decided.

    Parameters
    ----------
    mode : MODE
        stop (the controller knows) or catch (a cavity).
    x : X
        Of the goal region; default that of the goal.
    beyond : X
        Ask instead: is the part beyond X?
    error : E
        Of the sensor at --beyond or --sweep.
    side : I
        Ask instead: does the part lie on side I?
    blind
        Ask nothing.
    sweep : LO:HI:N
        Try N places of the sensor.
    starts : SIDE=LO:HI
        Where the part may lie at first, like 2=16:18; repeatable. Default: the limit sets of [throw].
    from_ : X
        Every start from X on, on all sides.
    throws : N
        The most throws.
    cells : N
        Cells per side.
    noise : Q=DEV
        At every throw, like throw.speed='0.3 %'.
    seconds : S
        The most time of a search.
    parts : N
        Parts thrown by the policy.
    brackets : N
        Prove the mean number of throws and how many come, where deviations are even, on N cells per side.
    certificate : FILE
        Write the policy's certificate, NAME.proof.zip.
    out : DIR
        Write feedback.json, policy.csv, a figure, and the tables of a controller there: controller.csv, .h (C) and .st
        (structured text).
    """
    from limitsets.proofs.policies import places, policy_chances
    from limitsets.proofs.policies.simulation import simulate

    chosen = run.opened(scene)
    goal: Any = None if x is None else goal_at(chosen, x)
    options: dict[str, Any] = {
        "mode": mode,
        "goal": None if goal is None else (goal.x, goal.side),
        "starts": _starts(chosen, starts, from_),
        "throws": throws,
        "cells": cells,
        "noise": deviations("--noise", noise),
        "seconds": seconds,
        "progress": run.tell,
    }
    tried: list[tuple[float, Synthesis]] = []
    if sweep is None:
        synthesis = ls.feedback(chosen, _sensor(chosen, beyond, error, side, blind=blind), **options)
    else:
        at = places_of(chosen, sweep, "--sweep")
        tried = list(zip(at, places(chosen, at, error=place(chosen, error), **options), strict=True))
        synthesis = min((each for _, each in tried), key=lambda each: (not each.solved, each.found.throws))
    run.tell("recheck", 0, 1)
    synthesis, written = certified(
        synthesis, certificate, "policy", proved=synthesis.solved, recheck=not no_recheck
    )
    thrown = simulate(synthesis, parts) if synthesis.solved else None
    proved = None
    if brackets is not None and synthesis.solved:
        proved = policy_chances(synthesis, cells=brackets, progress=run.tell)
    record = synthesis.to_json() | {
        "certificate": written,
        "simulated": thrown,
        "brackets": proved,
        "places": [{"x": x, "verdict": each.found.verdict, "within": each.found.throws} for x, each in tried],
    }
    solved = synthesis.found.policy is not None
    if run.out is not None:
        drawn = [("policy", ls.plot.policy(synthesis))] if solved else []
        rows = {"policy.csv": synthesis.table().csv(), **synthesis.controller().files()} if solved else {}
        run.write(drawn, {"feedback.json": record, **rows})
    return Answer(
        record,
        lambda: [
            *_question(synthesis, tried),
            *said_of(written, "there is no policy"),
            *_policy(synthesis, thrown),
            *_proved(proved),
        ],
        synthesis.table if synthesis.solved else None,
        code=0 if synthesis.solved else 1,
        about=run.about(synthesis.model),
    )


def _sensor(scene: Any, beyond: str | None, error: str, side: int | None, *, blind: bool) -> Any:
    from limitsets.feeder.scene import BeyondSensor, SideSensor

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
    remedy = "name each side once, and two places with : between"
    spans = named(words, "--starts", "the starts", form="SIDE=LO:HI", remedy=remedy)
    return {int(side): tuple(place(scene, end) for end in span.split(":")) for side, span in spans} or None


def _question(synthesis: Synthesis, tried: list[tuple[float, Synthesis]]) -> Iterator[str | Table]:
    """Say what is wanted, from which starts, and what becomes of it."""
    unit = synthesis.scene.unit
    x, side = synthesis.goal
    wanted = {"stop": "known to lie", "catch": "to be caught"}[synthesis.mode]
    yield f"{synthesis.scene.name}: the part is {wanted} on side {side} at x = {x:.9g} {unit} or beyond"
    yield f"starts: {synthesis.starts_are}: {_spans(synthesis.starts.extents())}"
    if tried:
        yield Table(("sensor at", ""), [(f"{at:.6g} {unit}", _verdict(each)) for at, each in tried])
    yield f"question: {synthesis.question}"
    yield _verdict(synthesis)
    if synthesis.found.verdict == "not-solved":
        yield (
            "next: more --throws or --cells, --sweep LO:HI:N for another place of the sensor, or another throw in"
            " [[feedback.throws]]"
        )


def _policy(synthesis: Synthesis, thrown: Any) -> Iterator[str | Table]:
    """Show the policy, and how parts thrown by it come."""
    policy = synthesis.found.policy
    if policy is None:
        return
    record, rows = policy.to_json(), []
    for state, belief in zip(record["states"], synthesis.beliefs(), strict=True):
        after = _named_states(state["after"], "")
        rows.append((state["state"], _spans(belief), state["throw"] or "stop", after, state["left"]))
    yield Table(("state", "the part lies on", "throw", "next", "throws left"), rows)
    yield f"begin: {_named_states(record['first'], 'state ')}"
    if thrown is not None:
        timed = report.pages.in_time(thrown.mean, synthesis.scene.world.throw_rate, parts=True)
        more = "".join(f", {count} {what}" for what, count in thrown.failures.items())
        yield (
            f"thrown: {thrown.reached} of {thrown.parts} came, in {thrown.mean:.3g} throws on average{timed}{more}"
        )


def _proved(proved: PolicyChances | None) -> Iterator[str]:
    """Put proved brackets in words, rounded outward."""
    if proved is not None:
        scattered = proved.scatter.given()
        laws = "deviations equally likely within the noise, independent" if scattered else "no noise"
        mean, come = map(BETWEEN.text, (proved.mean, proved.come))
        yield f"PROVED ({laws}; starts equally likely per length): {mean} throws on average,"
        yield f"    and the part comes with a probability of {come}"


def _named_states(after: dict[str, int | None], word: str) -> str:
    return ", ".join(f"{answer}: {word}{at}" for answer, at in after.items() if at is not None)


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
