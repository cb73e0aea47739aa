"""`limitsets certify` and `recheck`: what is proved of a scene, in words and as a certificate; a certificate anew."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import limitsets as ls
from limitsets.base import AnswerError, LimitsetsError, Table, rounded
from limitsets.face import report
from limitsets.face.cli.arguments import (
    certified_claims,
    deviations,
    laid_ranges,
    own_file,
    said_of,
    with_ending,
)
from limitsets.face.cli.commands import Answer, Run, Scene, Words, command, limits
from limitsets.face.cli.output import saved
from limitsets.face.cli.subjects import (
    MapOfFile,
    domain_of,
    of_map_alone,
    of_scene_alone,
    spans,
    subject,
)

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene as SceneOf
    from limitsets.proofs.prover import Claim, Proof
    from limitsets.proofs.prover.goals import State
    from limitsets.systems.cells import Grid


# States of a counterexample that are printed: the start, and the last of them.
LAST = 8

REFUTED = {
    "every": "The goal fails for some starts, perhaps for starts of total length zero only.",
    "almost-every": "The goal fails for starts of positive total length.",
}


# A proved number in words stays a bound.
_down, _up = partial(rounded, up=False), partial(rounded, up=True)

# Cells along each axis of a map's domain.
CELLS = 512


@command(out="--save")
def certify(
    run: Run,
    scene: Scene,
    *,
    claim: Words = None,
    tolerance: Words = None,
    noise: Words = None,
    laid: Words = None,
    set_: Words = None,
    domain: str | None = None,
    cells: Annotated[int | None, limits(min=1)] = None,
    ends: Words = None,
    starts: Words = None,
    no_recheck: bool = False,
) -> Answer:
    """Prove where orbits lead, and write a certificate that `limitsets recheck` verifies; it is checked first.

    Exit 1 where a claim is not proved.

    Parameters
    ----------
    scene : SCENE
        A built-in name, a TOML file, or a map FILE.py:NAME; the Python file is run.
    claim : C,C
        What to prove: attracts-all, invariant, trapping, cycles, expanding; of a scene also end-points, goal; of a map
        also basin, escapes, almost-every and, with --ends, ends-in; repeatable.
    tolerance : Q=DEV
        Of a scene: a quantity that is fixed but unknown, like throw.speed='0.7 %'; repeatable.
    noise : Q=DEV
        Of a scene: what differs at every throw: throw.speed, gravity.tilt, landing.x, like throw.speed='0.3 %';
        repeatable.
    set_ : NAME=NUMBER
        Of a map: the value of a parameter, like a=1.4, or its range, like a=1.4:1.41; repeatable.
    domain : LO:HI,LO:HI
        Of a map: a range for each coordinate.
    cells : N
        Of a map: cells along each axis, 512 by default; finer ones prove more.
    ends : LO:HI,LO:HI
        Of a map: a box in which orbits have to end; repeatable.
    starts : LO:HI,LO:HI
        Of a map, with --ends: a box of starts; repeatable; by default all that are proved to end there.
    out : FILE
        The certificate, NAME.proof.zip; ./ and the name of the scene or map by default.
    """
    words = [word.strip() for each in claim or [] for word in each.split(",")]
    chosen = subject(scene, set_)
    if isinstance(chosen, MapOfFile):
        of_map_alone({"--tolerance": tolerance, "--noise": noise, "--laid": laid})
        if starts and not ends:
            remedy = "name with --ends where these have to end"
            raise LimitsetsError("the option --starts", " ".join(starts), "beside --ends", remedy)
        boxes = {
            name: [spans(box, f"--{name}") for box in given] if given else None
            for name, given in (("ends", ends), ("starts", starts))
        }
        return _of_map(
            run,
            chosen,
            ls.grid(domain_of(chosen, domain), cells=cells or CELLS),
            words,
            boxes=boxes,
            recheck=not no_recheck,
        )
    of_scene_alone(chosen, {"--domain": domain, "--cells": cells, "--ends": ends, "--starts": starts})
    return _of_scene(run, chosen, words, tolerance, noise, laid=laid, recheck=not no_recheck)


def _of_scene(
    run: Run,
    chosen: SceneOf,
    claims: list[str],
    tolerance: Words,
    noise: Words,
    *,
    laid: Words,
    recheck: bool,
) -> Answer:
    """Prove claims about a scene."""
    fixed, varying = deviations("--tolerance", tolerance), deviations("--noise", noise)
    begins = laid_ranges(laid)
    file = own_file(chosen) if run.out is None else with_ending(run.out)
    with saved(file):  # refuses a place that cannot be written before anything is proved
        proof = ls.certify(
            chosen, claims or None, noise=varying, tolerance=fixed, laid=begins, progress=run.tell
        )
    run.tell("recheck", 0, 1)
    proof, written, missing = certified_claims(proof, file, recheck=recheck)

    def words() -> Iterator[str | Table]:
        yield from _text(proof)
        yield from said_of(written, missing, partly=not proof.proved)
        if not proof.proved:
            yield f"next: {report.pages.after_unproved(proof)}"
        if any(claim.claim == "goal" and claim.note for claim in proof.claims):  # it holds vacuously
            yield from report.pages.choice_for(chosen, [proof.scene.goal])

    code, about = 0 if proof.proved else 1, run.about(proof.model, chosen)
    return Answer(records_of(proof, written), words, proof.table, code=code, about=about)


def _of_map(
    run: Run, chosen: MapOfFile, grid: Grid, claims: list[str], boxes: dict[str, Any], *, recheck: bool
) -> Answer:
    """Prove claims about a map of a file."""
    file = with_ending(run.out or Path(f"{chosen.name}.proof.zip"))
    with saved(file):  # refuses a place that cannot be written before anything is proved
        proof = ls.certify(chosen.lower, grid, claims or None, upper=chosen.upper, **boxes, progress=run.tell)
    run.tell("recheck", 0, 1)
    proof, written, missing = certified_claims(proof, file, recheck=recheck)

    def words() -> Iterator[str | Table]:
        yield f"{chosen.name}: {proof.graph.n_cells} cells, {proof.seconds:.2g} s"
        for name, lo, hi in zip(proof.map._fields, proof.map, proof.upper, strict=True):
            if lo is not hi and lo != hi:
                yield f"for every {name} from {lo} to {hi}, also if it changes at every step"
        for table in proof.tables():
            yield f"\n{table.caption}" + (f" ({table.how})" if table.how else "")
            yield table
        yield from said_of(written, missing, partly=not proof.proved)

    return Answer(records_of(proof, written), words, proof.table, code=0 if proof.proved else 1)


def records_of(proof: Any, written: dict[str, Any] | None) -> list[dict[str, Any]]:
    """Give the claims as JSON, each with the time that the recheck took."""
    again = {"recheck": written and written["recheck"]}
    return [each | {"timings": each["timings"] | again} for each in proof.to_json()]


def _text(proof: Proof) -> Iterator[str | Table]:
    cells = sum(attraction.cover.grid.n_cells for attraction in proof.attractions)
    yield f"{proof.scene.name}: {cells} cells, {proof.seconds:.2g} s"
    for name, (lo, hi) in proof.spans.items():
        yield f"for every {name} from {_short(lo)} to {_short(hi)}, the same at every throw"
    for name, text in proof.noise.items():
        value = "the model's place" if name == "landing.x" else "its value"
        yield f"for every sequence of throws, {name} within {text} of {value}, anew at every throw"
    if proof.laid:
        from limitsets.feeder.goals import laid_words

        yield f"for parts that are laid down at {laid_words(proof.laid, proof.scene.unit)}"
    if proof.effects:
        yield f"with the effects {', '.join(proof.effects)}"
    for claim in proof.claims:
        yield f"\n{claim.claim}: {claim.verdict.upper().replace('-', ' ')}"
        yield from (f"  {line}" for line in _words(proof, claim))
        if claim.counterexample:
            yield from _orbit(proof, claim)
    yield ""


def _short(text: str) -> str:
    """Write a quantity with few digits."""
    number, _, unit = text.partition(" ")
    return f"{float(number):.7g} {unit}"


def _words(proof: Proof, claim: Claim) -> list[str]:
    """Put a claim into sentences."""
    if not claim.written:
        of = REFUTED.get(claim.starts or "") if claim.verdict == "refuted" else None
        return [*([of] if of else []), *([_sentence(claim.reason)] if claim.reason else [])]
    scene = proof.scene
    if claim.claim == "attracts-all":
        return _attraction(proof, claim)
    if claim.claim == "goal":
        return _goal(proof, claim)
    if claim.claim == "expanding":
        slope = float.fromhex(claim.section["least_slope"])
        entropy = "" if proof.noise else f"; topological entropy {_down(math.log(slope), '.5f')} at least"
        return [
            f"In the attracting cells each throw stretches distances by {_down(slope, '.6f')} at least{entropy}.",
            "So no repeating sequence of places attracts; each that exists is unstable.",
        ]
    if claim.claim == "end-points":
        ends = [(end["side"], end["which"], end["outer"], end["inner"]) for end in claim.section["ends"]]
        return [
            f"side {side}, {which} end: x = {float.fromhex(outer):.12f} {scene.unit},"
            f" within {_up(abs(float.fromhex(outer) - float.fromhex(inner)), '.1e')}"
            for side, which, outer, inner in ends
        ]
    if claim.claim == "cycles":
        cycles = claim.section["cycles"]
        return [
            f"period {len(each['itinerary'])}, {'attracts' if each['attracts'] else 'repels'}: from"
            f" x = {float.fromhex(each['interval'][0]):.9f} {scene.unit} on side {each['side']}"
            for each in cycles
        ]
    if claim.claim == "trapping":
        return ["The attracting cells are thrown into their interior: small errors do not carry a part out."]
    return ["No throw leads out of the attracting cells."]


def _goal(proof: Proof, claim: Claim) -> list[str]:
    """State a goal that is proved, the starts for which it holds, and what becomes of the other starts."""
    from limitsets.parameters.margins.margin_result import bound
    from limitsets.proofs.prover.goals import sentence

    shares = claim.shares
    lines = [sentence(claim.section)]
    if claim.note:
        lines.append(_sentence(claim.note))
    if shares["share"] < 1.0:
        worst = " under the worst noise" if "landing.x" in proof.noise else ""
        others = [
            (f"{bound(100.0 * shares['leaves'], '%')} are proved to leave the arm{worst}", shares["leaves"]),
            (
                f"{bound(100.0 * shares['creeps'], '%')} are proved to creep to the joint, and stay on the arm",
                shares["creeps"],
            ),
            (f"of {bound(100.0 * shares['open'], '%', up=True)} nothing is proved", shares["open"]),
        ]
        of = "that are laid down" if proof.laid else "on the arm"
        told = "; ".join(text for text, share in others if share > 0.0)
        lines.append(f"It is proved for {bound(100.0 * shares['share'], '%')} of all starts {of}; {told}.")
    if "starts" in claim.section and proof.noise and "thinning" in claim.section:
        lines.append("Which starts are excepted may depend on the sequence of the noise.")
    if claim.verdict != "proved":
        lines.append(f"Missing for all of them: {claim.reason}.")
    return lines


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _attraction(proof: Proof, claim: Claim) -> list[str]:
    unit, bound, points = proof.scene.unit, proof.max_throws(), claim.jog_fixed_points
    extents = {side: report.pages.intervals(parts) for side, parts in proof.outer_extents().items()}
    growth = _down(bound["near_joint"], ".6f")
    starts = ", ".join(f"{_up(x, '.6f')} {unit} on side {side}" for side, x in bound["beyond"].items())
    where, edge, foot = "and every side", "the joint", "a"
    if points is not None:
        where, edge, foot = "beyond R*", "R*", "R*"
    return [
        *(_two_basins(proof, points) if points is not None else ()),
        f"From every position on the arm {where}, a part comes into the attracting cells and stays there:",
        *(f"side {side}: x = {parts} {unit}" for side, parts in extents.items()),
        f"It takes {bound['throws']} throws at most from x = {starts}, or beyond.",
        f"Nearer to {edge} it takes more throws: each moves the part out, x - {foot} by a factor of {growth} at least.",
    ]


def _two_basins(proof: Proof, points: dict[str, list[float]]) -> list[str]:
    """Say what becomes of parts near the joint if the arm's surface is above the joint."""
    unit = proof.scene.unit
    lines = [
        f"side {side}: R* between x = {_down(lo, '.10f')} and {_up(hi, '.10f')} {unit}"
        for side, (lo, hi) in points.items()
    ]
    between = ["Between the two ends nothing is claimed: it depends on the throws."] if proof.noise else []
    return [
        "The arm's surface is above the joint: jogs move a part out beyond R*, and in nearer than R*.",
        *lines,
        "From every position nearer than R*, jogs bring the part ever closer to x = a: it never leaves its side.",
        *between,
    ]


def _orbit(proof: Proof, claim: Claim) -> Iterator[str | Table]:
    """Show the orbit that refutes a claim: its first and its last states."""
    states, scene = claim.counterexample, proof.scene
    yield "  This orbit shows it:"
    for name, (lo, hi) in claim.fixed.items():
        value = _short(lo) if _short(lo) == _short(hi) else f"any value from {_short(lo)} to {_short(hi)}"
        yield f"  {name} = {value}"
    thrown = _thrown(proof)
    rows = [
        [str(k), f"{0.5 * (state.lo + state.hi):.6f}", str(state.side)]
        + ["" if state.kappa is None else text(state) for text in thrown.values()]
        for k, state in enumerate(states)
    ]
    if len(states) > LAST + 1:
        rows[1:-LAST] = [["...", *[""] * (len(thrown) + 2)]]
    yield Table(("throws", f"x [{scene.unit}]", "side", *thrown), rows)
    shape = {name: lo for name, (lo, _) in claim.fixed.items() if name.startswith(("part.", "arm."))}
    last, own = states[-1], scene.with_values(shape)
    nearest, farthest = float(own.sides.a[last.side]), own.arm_length
    if not (nearest < last.hi and last.lo <= farthest):
        ends = f"on side {last.side} it rests from x = {nearest:.6g} to {farthest:.6g} {scene.unit}"
        yield f"  There the part has left the arm: {ends}."


def _thrown(proof: Proof) -> dict[str, Callable[[State], str]]:
    """Name the quantities that differ from throw to throw, and how each is read off a throw."""
    noise, unit, kappa = proof.noise, proof.scene.unit, proof.scene.kappa
    speed, tilt = "throw.speed" in noise, "gravity.tilt" in noise
    columns: dict[str, Callable[[State], str]] = {}
    if speed and tilt:
        columns[f"kappa of the next throw [{unit}]"] = lambda state: f"{state.kappa:.6f}"
    elif speed:
        columns["speed of the next throw"] = lambda state: (
            f"{100.0 * (math.sqrt(kappa / (state.kappa or kappa)) - 1.0):+.4f} %"
        )
    elif tilt:
        columns["tilt of the next throw"] = lambda state: _short(proof.thrown(state)["gravity.tilt"])
    if "landing.x" in noise:
        columns[f"lands off by [{unit}]"] = lambda state: (
            "" if state.landing is None else f"{state.landing:+.6f}"
        )
    return columns


# ----------------------------------------------------------------
# `limitsets recheck`: check a certificate again.


@command()
def recheck(run: Run, file: Path, *, formulas: bool = False) -> Answer:
    """Check a certificate by other code and in other arithmetic than those that made it.

    Exit 0 where every claim is proved; 1 where one fails or is proved of some starts only, or is a refutation.

    Parameters
    ----------
    file : FILE
        A certificate, NAME.proof.zip.
    formulas
        Of a certificate of a map: print all lines of its formulas.
    """
    verdicts = ls.recheck(
        file, workers=None, progress=lambda done, of: run.tell("cells checked", done - 1, of)
    )
    if verdicts.verdict == "bad file":
        raise AnswerError("the certificate", str(file), "one that limitsets certify wrote", verdicts.reason)
    from limitsets.checker import EXITS, show

    def words() -> tuple[str, ...]:
        show(verdicts, str(file), formulas=formulas)
        return ()

    claims = Table(("claim", "verdict", "reason"), verdicts.claims, str(file))
    return Answer(verdicts, words, lambda: claims, code=EXITS[verdicts.verdict])
