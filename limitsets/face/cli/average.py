"""`limitsets average`: between which numbers averages along almost every orbit lie, proved, with a certificate."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import limitsets as ls
from limitsets.base import LimitsetsError, Table
from limitsets.face.cli.arguments import (
    certified_claims,
    laid_ranges,
    named,
    number,
    own_file,
    said_of,
    with_ending,
)
from limitsets.face.cli.certify import records_of
from limitsets.face.cli.commands import Answer, Run, Scene, Words, command, limits
from limitsets.face.cli.output import saved
from limitsets.face.cli.subjects import MapOfFile, domain_of, of_scene_alone, subject

# Cells of a map's domain; what stands in the name of a certificate, beside that of a goal.
CELLS, KIND = 10_000, ".averages"


@command(out="--save")
def average(
    run: Run,
    scene: Scene,
    *,
    of: Words = None,
    set_: Words = None,
    domain: str | None = None,
    periodic: bool = False,
    noise: Words = None,
    cells: Annotated[int | None, limits(min=1)] = None,
    no_recheck: bool = False,
) -> Answer:
    """Prove between which numbers averages along almost every orbit lie, and write a certificate.

    Exit 1 where they are not proved.

    Parameters
    ----------
    scene : SCENE
        A built-in name, a TOML file, or a map of a line FILE.py:NAME; the Python file is run.
    of : WORD,WORD
        What is averaged: lyapunov, the mean of ln |dx'/dx|; LO:HI, the share of steps from there on all sides, and
        SIDE=LO:HI on one; of a scene also flips_per_throw, side_shares (of throws from each side) and jogs_per_visit
        (the mean number before the part flips); repeatable; by default all words.
    set_ : NAME=NUMBER
        Of a map: the value of a parameter, like a=1.4, or its range, like a=1.4:1.41; repeatable.
    domain : LO:HI
        Of a map: a range.
    periodic
        Of a map: it is taken modulo the width of the domain.
    noise : NAME=BOUND
        Of a map: each step lands evenly within this distance of the image (landing=BOUND, or BOUND alone), or this
        parameter deviates so far at every step; then bounds hold from every start, almost surely, and the map need not
        stretch; repeatable.
    cells : N
        Cells, 8192 by default, of a map 10 000: the bounds come nearer as 1/N.
    out : FILE
        The certificate, NAME.proof.zip; ./ and the name of the scene or map with .averages by default.
    """
    functions = [_function(word.strip()) for each in of or [] for word in each.split(",")] or None
    chosen = subject(scene, set_)
    if isinstance(chosen, MapOfFile):
        line = ls.grid(domain_of(chosen, domain), cells=cells or CELLS, periodic=periodic)
        how: dict[str, Any] = {
            "map": chosen.lower,
            "grid": line,
            "upper": chosen.upper,
            "noise": noise_of_words(noise),
        }
        file = with_ending(run.out or Path(f"{chosen.name}{KIND}.proof.zip"))
    else:
        of_scene_alone(chosen, {"--domain": domain, "--periodic": periodic or None, "--noise": noise or None})
        how = {"map": chosen, "cells": cells}
        file = own_file(chosen, KIND) if run.out is None else with_ending(run.out)
    with saved(file):  # refuses a place that cannot be written before anything is proved
        proof = ls.average(of=functions, progress=run.tell, **how)
    run.tell("recheck", 0, 1)
    proof, written, missing = certified_claims(proof, file, recheck=not no_recheck)

    def words() -> Iterator[str | Table]:
        if proof.average is None:
            yield f"{chosen.name}: nothing is proved: {proof.claims[-1].reason}"
        else:
            table = proof.average.table()
            yield f"{chosen.name}: {table.how}"
            yield table
        yield from said_of(written, missing)

    about = None if isinstance(chosen, MapOfFile) else run.about(proof.model, chosen)
    shown = proof.table if proof.average is None else proof.average.table
    return Answer(records_of(proof, written), words, shown, code=0 if proof.average else 1, about=about)


def noise_of_words(words: list[str] | None) -> dict[str, float] | None:
    """Read what deviates; a number alone is of the landing."""
    given = [word if "=" in word else f"landing={word}" for word in words or []]
    noise = dict[str, float]()
    for name, text in named(given, "--noise", "the noise", "NAME=BOUND", "write a number, or NAME=NUMBER"):
        bound = number(text)
        if isinstance(bound, str):
            raise LimitsetsError(
                f"the noise of {name}", bound, "a number", "leave the unit out", key="--noise"
            )
        noise[name] = bound
    return noise or None


def _function(word: str) -> Any:
    """Read a word, or a range with a side before it."""
    if ":" not in word:
        return word
    thing = "the range to average over"
    ranges = laid_ranges([word if "=" in word else f"0={word}"], "--of", thing) or {}
    return ranges if "=" in word else ranges[0]
