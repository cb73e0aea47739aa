"""Values of options (numbers, places, deviations, bounds), and certificates as files of the commands."""

from __future__ import annotations

import re
import time
from contextlib import suppress
from dataclasses import replace
from json import loads
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile, ZipFile

from limitsets.base import AnswerError, LimitsetsError, proposed
from limitsets.face.cli.output import refuse_other, saved, say_other, stem_of

if TYPE_CHECKING:
    from limitsets.feeder.goals import Goal
    from limitsets.feeder.scattering import Scattering
    from limitsets.feeder.scene import Scene
    from limitsets.parameters.margins.machines import Machines


_BARE = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")


def number(word: str) -> float | str:
    """Read a bare number in the scene's unit; text with a unit is read further on."""
    return float(word) if _BARE.fullmatch(word.strip()) else word.strip()


def place(scene: Scene, text: str, option: str = "--x") -> float:
    """Read a place: with a unit, or a bare number in the scene's unit."""
    from limitsets.feeder.scene.units import convert, parse

    word = number(text)
    return word if isinstance(word, float) else convert(parse(text, "length", key=option), scene.unit)


def places_of(scene: Scene, text: str, option: str) -> list[float]:
    """Read LO:HI:N, N lengths from LO to HI."""
    words = text.split(":")
    if len(words) != 3 or not words[2].strip().isdigit() or not 1 <= int(words[2]) <= 1000:
        raise LimitsetsError("the places", text, "LO:HI:N, N from 1 to 1000", "correct it", key=option)
    lo, hi, count = place(scene, words[0]), place(scene, words[1]), int(words[2])
    return [lo + (hi - lo) * k / max(count - 1, 1) for k in range(count)]


def position(scene: Scene, text: str) -> float:
    """Read --x, where a part is to rest.

    Raises
    ------
    LimitsetsError
        No number, a unit of something else, or a place before the joint or beyond the arm's end.
    """
    x = place(scene, text)
    if not 0.0 <= x <= scene.arm_length:
        allowed = f"a place on the arm, from 0 to {scene.arm_length:.9g} {scene.unit}"
        raise LimitsetsError("x", text, allowed, "start where a part can rest", key="--x")
    return x


def named(
    words: list[str] | None, option: str, thing: str, form: str, remedy: str, *, once: bool = True
) -> list[tuple[str, str]]:
    """Read the words of a repeatable option, of a form like NAME=TEXT or SIDE=LO:HI; the remedy is for a wrong form."""
    pairs: list[tuple[str, str]] = []
    for word in words or []:
        name, sign, text = (part.strip() for part in word.partition("="))
        again = once and name in dict(pairs)
        no_side = form.startswith("SIDE") and not (name.isascii() and name.isdigit())
        no_span = ":" in form and text.count(":") != 1
        if not sign or again or no_side or no_span:
            remedy = f"name each {form.partition('=')[0].lower()} once" if again else remedy
            raise LimitsetsError(thing, word, form, remedy, key=option)
        pairs.append((name, text))
    return pairs


def deviations(option: str, words: list[str] | None) -> dict[str, str]:
    """Read the words of a repeatable option, QUANTITY=DEVIATION each."""
    remedy = "put a sign of equality between them"
    return dict(named(words, option, option.lstrip("-"), form="QUANTITY=DEVIATION", remedy=remedy))


def scattering_of(scene: Scene, words: list[str] | None, law: str) -> Scattering | None:
    """Read --scatter and --law; None where nothing scatters by the command."""
    from limitsets.parameters.sheet.summary import scattering_from

    random = deviations("--scatter", words)
    return scattering_from(scene, random, law) if random else None


def machines_of(file: Path | None) -> Machines | None:
    """Read --fitted."""
    from limitsets.parameters.margins.machines import Machines

    return None if file is None else Machines.read(file)


def laid_ranges(
    words: list[str] | None, option: str = "--laid", thing: str = "where parts are laid down"
) -> dict[int, list[tuple[float | str, float | str]]] | None:
    """Read the words of --laid or another option, SIDE=LO:HI each; bare numbers are in the scene's unit.

    A unit behind one end holds for both.
    """
    ranges: dict[int, list[tuple[float | str, float | str]]] = {}
    remedy = "name a side, the sign =, and two places with : between them, like 0=8:20"
    for side, text in named(words, option, thing, form="SIDE=LO:HI", remedy=remedy, once=False):
        ends = [number(end.strip("'\" ")) for end in text.split(":")]
        units = [end.lstrip("+-.0123456789eE").strip() for end in ends if isinstance(end, str)]
        if len(units) == 1:
            ends = [f"{end!r} {units[0]}" if isinstance(end, float) else end for end in ends]
        ranges.setdefault(int(side), []).append((ends[0], ends[1]))
    return ranges or None


def bounds_of(scene: Scene, words: list[str] | None) -> dict[str, tuple[float | None, float | None]]:
    """Read --bounds in the units of a scene; a bare number is in the unit in which the quantity is displayed."""
    from limitsets.feeder.scene.quantities import in_units, unit_read

    bounds: dict[str, tuple[float | None, float | None]] = {}
    thing, remedy = "the bounds", "put = after the quantity, : between the bounds"
    for name, text in named(words, "--bounds", thing, form="QUANTITY=LOWEST:HIGHEST", remedy=remedy):
        ends: list[float | None] = []
        for end in text.split(":", 1):
            word = number(end.strip("'\" "))
            if isinstance(word, float):
                word = f"{word!r} {unit_read(scene.text, scene.unit, name)}".strip()
            ends.append(in_units(scene.unit, name, word, key="--bounds") if word else None)
        lo, hi = ends
        if lo is not None and hi is not None and not lo < hi:
            allowed = "a lower and a higher one"
            raise LimitsetsError(thing, f"{name}={text}", allowed, "turn them round", key="--bounds")
        bounds[name] = (lo, hi)
    return bounds


def goal_at(scene: Scene, text: str) -> Goal:
    """Ask the scene's goal at the X of --x.

    Raises
    ------
    LimitsetsError
        The goal has no X, or it is not on the arm.
    """
    from limitsets.feeder.goals import OrientedBeyond, Reaches

    if not isinstance(scene.goal, OrientedBeyond | Reaches):
        kind = None if scene.goal is None else scene.goal.kind
        raise LimitsetsError("the goal", kind, "one that has an x", "leave --x out", key="--x")
    x = place(scene, text)
    if not 0 <= x < scene.arm_length:
        allowed = f"from 0 to below the arm's length, {scene.arm_length:.9g} {scene.unit}"
        raise LimitsetsError("the position", text, allowed, "correct it", key="--x")
    return replace(scene.goal, x=x)


# ----------------------------------------------------------------
# Certificates as files of the commands: their names, and `--certificate FILE`, checked before it gets its name.


def own_file(scene: Scene, kind: str = "") -> Path:
    """Name a certificate after the scene's file; a certificate of another scene that has this name stays."""
    file = Path(f"{stem_of(scene)}{kind}.proof.zip")
    if question := _question_of(file):
        refuse_other("the certificate", file, question[0]["name"], scene)
    return file


def _question_of(file: Path) -> tuple[Any, ...]:
    """Read of which scene and of which deviations a certificate is; empty where there is none that says so."""
    with suppress(OSError, BadZipFile, ValueError, TypeError, LookupError), ZipFile(file) as zipped:
        header = loads(zipped.read("header.json"))
        scene = header["boxes"][0]["scene"]
        return scene | {"name": str(scene["name"])}, header.get("noise"), header.get("tolerance")
    return ()


def with_ending(file: Path) -> Path:
    """Add the ending of certificates to a name without one; an existing folder or device keeps its name."""
    return file if file.suffix or file.exists() else file.with_name(f"{file.name}.proof.zip")


def certified(
    answer: Any, file: Path | None, claim: str | None = None, *, proved: bool, recheck: bool
) -> tuple[Any, dict[str, Any] | None]:
    """Write the certificate; return the answer without claims that the checker denies, and a record of the file.

    An answer of one claim is denied by the reason for that one.  Without a file nothing is written.
    """
    if file is None:
        return answer, None
    from limitsets.proofs.prover.certificate import DeniedError

    written = {"file": None, "denied": False, "recheck": None}
    if not proved:
        return answer, written
    begin, file = time.perf_counter(), with_ending(file)
    denied = None
    with saved(file) as draft:
        try:
            answer.save(draft, recheck=recheck, workers=None)
        except DeniedError as error:
            denied = error
        else:
            # A certificate of other values gives way: it may be the last that knows them, but not to replace it would
            # be in the way of everyone who edits a scene and proves again.  What differs is known: both have one form.
            before, after = _question_of(file), _question_of(draft)
            if before and after and before != after:
                say_other("the certificate", file, before[0]["name"])
    if denied is not None:
        kept = file.with_name(Path(denied.file or "").name)
        if not hasattr(answer, "denied"):  # it is that claim, and nothing else
            raise DeniedError.of(kept, denied.claims)
        answer = answer.denied(denied.claims if claim is None else denied.claims[claim])
        return answer, written | {"file": str(kept), "denied": True, "recheck": time.perf_counter() - begin}
    return answer, written | {"file": str(file), "recheck": time.perf_counter() - begin if recheck else None}


def certified_claims(proof: Any, file: Path, *, recheck: bool) -> tuple[Any, dict[str, Any] | None, str]:
    """Write the certificate of the claims that are proved, if one can hold them; and say why there is none."""
    some = any(claim.written for claim in proof.claims)
    try:
        return *certified(proof, file, proved=some, recheck=recheck), "nothing is proved"
    except AnswerError as error:  # effects, a goal, or a function of which no certificate can be made
        return *certified(proof, file, proved=False, recheck=recheck), str(error)


def said_of(written: dict[str, Any] | None, missing: str, *, partly: bool = False) -> list[str]:
    """Say in a line what became of the certificate, if one was wanted; `missing` is the reason for having none."""
    if written is None:
        return []
    file, seconds = written["file"], written["recheck"]
    if file is None:
        return [f"no certificate is written: {missing}"]
    if written["denied"]:
        return [f"the checker denies the certificate: it is kept as {file}, and what it denies is undecided"]
    left = ", of what is proved only" if partly else ""
    done = "not rechecked" if seconds is None else f"rechecked in {seconds:.2g} s"
    return [f"certificate: {file}{left}, {done} (check it: {proposed('recheck', file)})"]
