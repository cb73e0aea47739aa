"""`limitsets certify` and `recheck`: what is proved of a scene, in words and as a certificate; a certificate anew."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.base.proposals import proposed
from limitsets.base.tables import Table
from limitsets.face.cli.about import About
from limitsets.face.cli.arguments import (
    HELP_LAID,
    HELP_NO_RECHECK,
    deviations,
    laid_ranges,
    own_file,
    say_replaced,
    with_ending,
)
from limitsets.face.cli.output import Csv, Json, Out, Scene, Words, answer, option, progress, saved, table

if TYPE_CHECKING:
    from limitsets.proofs.prover import Claim, Proof
    from limitsets.proofs.prover.goals import State


# States of a counterexample that are printed: the start, and the last of them.
LAST = 8

REFUTED = {
    "every": "The goal fails for some starts, perhaps for starts of total length zero only.",
    "almost-every": "The goal fails for starts of positive total length.",
}

HELP_CLAIM = (
    "What to prove: attracts-all, invariant, trapping, end-points, cycles, expanding or goal; repeatable."
)
HELP_TOLERANCE = "A quantity that is fixed but unknown, like throw.speed='0.7 %'; repeatable."
HELP_NOISE = (
    "What differs at every throw: throw.speed, gravity.tilt, landing.x, like throw.speed='0.3 %'; repeatable."
)


def certify(
    scene: Scene,
    claim: Annotated[Words, option("--claim", "C", HELP_CLAIM)] = None,
    tolerance: Annotated[Words, option("--tolerance", "Q=DEV", HELP_TOLERANCE)] = None,
    noise: Annotated[Words, option("--noise", "Q=DEV", HELP_NOISE)] = None,
    laid: Annotated[Words, option("--laid", "SIDE=LO:HI", HELP_LAID)] = None,
    out: Annotated[
        Path | None,
        option("--out -o", "FILE", "The certificate, NAME.proof.zip; ./ and the scene's name by default."),
    ] = None,
    csv: Csv = None,
    json: Json = False,
    no_recheck: Annotated[bool, typer.Option("--no-recheck", help=HELP_NO_RECHECK)] = False,
) -> None:
    """Prove where the throws lead, and write a certificate that `limitsets recheck` verifies; it is checked first.

    Exit 1 where a claim is not proved.
    """
    fixed, varying = deviations("--tolerance", tolerance), deviations("--noise", noise)
    begins = laid_ranges(laid)
    with progress() as tell:
        from limitsets.feeder.scene import load

        chosen = load(scene)
        file = own_file(chosen) if out is None else with_ending(out)
        from limitsets.proofs.prover import certify as run
        from limitsets.proofs.prover.certificate import DeniedError

        with saved(file) as draft:
            proof = run(chosen, claim or None, noise=varying, tolerance=fixed, laid=begins, progress=tell)
            written = any(each.written for each in proof.claims) and not proof.effects
            begin = time.perf_counter()
            kept = ""
            if written:
                tell("recheck", 0, 1)
                try:
                    proof.save(draft, recheck=not no_recheck, workers=None)
                except DeniedError as error:
                    proof, kept = proof.denied(error.claims), str(file.with_name(Path(error.file or "").name))
            say_replaced(file, draft)
            seconds = None if no_recheck or not written else time.perf_counter() - begin
    records = [each | {"timings": each["timings"] | {"recheck": seconds}} for each in proof.to_json()]
    place = file if written else None
    about = About(proof.model, scene, chosen)
    answer(records, json, lambda: _text(proof, place, kept, seconds), csv=(csv, proof.table), about=about)
    raise typer.Exit(0 if proof.proved else 1)


def _text(proof: Proof, file: Path | None, kept: str, seconds: float | None) -> None:
    from limitsets.face.report.pages import after_unproved

    cells = sum(attraction.cover.grid.n_cells for attraction in proof.attractions)
    typer.echo(f"{proof.scene.name}: {cells} cells, {proof.seconds:.2g} s")
    for name, (lo, hi) in proof.spans.items():
        typer.echo(f"for every {name} from {_short(lo)} to {_short(hi)}, the same at every throw")
    for name, text in proof.noise.items():
        value = "the model's place" if name == "landing.x" else "its value"
        typer.echo(f"for every sequence of throws, {name} within {text} of {value}, anew at every throw")
    if proof.laid:
        from limitsets.feeder.goals import laid_words as places

        typer.echo(f"for parts that are laid down at {places(proof.laid, proof.scene.unit)}")
    if proof.effects:
        typer.echo(f"with the effects {', '.join(proof.effects)}")
    for claim in proof.claims:
        typer.echo(f"\n{claim.claim}: {claim.verdict.upper().replace('-', ' ')}")
        for line in _words(proof, claim):
            typer.echo(f"  {line}")
        if claim.counterexample:
            _orbit(proof, claim)
    typer.echo("")
    if proof.effects and any(each.written for each in proof.claims):
        typer.echo("no certificate is written: nothing rechecks maps with effects")
    elif file is None:
        typer.echo("nothing is proved: no certificate is written")
    elif kept:
        typer.echo(
            f"the checker denies the certificate: it is kept as {kept}, and what it denies is undecided"
        )
    else:
        left = "" if proof.proved else ", of what is proved only"
        done = "not rechecked" if seconds is None else f"rechecked in {seconds:.2g} s"
        typer.echo(f"certificate: {file}{left}, {done} (check it: {proposed('recheck', file)})")

    if not proof.proved:
        typer.echo(f"next: {after_unproved(proof)}")


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
        entropy = "" if proof.noise else f"; topological entropy {_down(math.log(slope), 5)} at least"
        return [
            f"In the attracting cells each throw stretches distances by {_down(slope, 6)} at least{entropy}.",
            "So no repeating sequence of places attracts; each that exists is unstable.",
        ]
    if claim.claim == "end-points":
        ends = [(end["side"], end["which"], end["outer"], end["inner"]) for end in claim.section["ends"]]
        return [
            f"side {side}, {which} end: x = {float.fromhex(outer):.12f} {scene.unit},"
            f" within {abs(float.fromhex(outer) - float.fromhex(inner)):.1e}"
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
    extents = {
        side: ", ".join(f"{_down(lo, 3)} to {_up(hi, 3)}" for lo, hi in parts)
        for side, parts in proof.outer_extents().items()
    }
    growth = _down(bound["near_joint"], 6)
    starts = ", ".join(f"{_up(x, 6)} {unit} on side {side}" for side, x in bound["beyond"].items())
    first = "From every position on the arm and every side, a part comes into the attracting cells and stays there:"
    near = f"Nearer to the joint it takes more throws: each moves the part out, x - a by a factor of {growth} at least."
    if points is not None:
        first = "From every position on the arm beyond R*, a part comes into the attracting cells and stays there:"
        near = f"Nearer to R* it takes more throws: each moves the part out, x - R* by a factor of {growth} at least."
    return [
        *(_two_basins(proof, points) if points is not None else ()),
        first,
        *(f"side {side}: x = {parts} {unit}" for side, parts in extents.items()),
        f"It takes {bound['throws']} throws at most from x = {starts}, or beyond.",
        near,
    ]


def _two_basins(proof: Proof, points: dict[str, list[float]]) -> list[str]:
    """Say what becomes of parts near the joint if the arm's surface is above the joint."""
    unit = proof.scene.unit
    lines = [
        f"side {side}: R* between x = {_down(lo, 10)} and {_up(hi, 10)} {unit}"
        for side, (lo, hi) in points.items()
    ]
    between = ["Between the two ends nothing is claimed: it depends on the throws."] if proof.noise else []
    return [
        "The arm's surface is above the joint: jogs move a part out beyond R*, and in nearer than R*.",
        *lines,
        "From every position nearer than R*, jogs bring the part ever closer to x = a: it never leaves its side.",
        *between,
    ]


def _down(value: float, digits: int) -> str:
    """Write a proved number, rounded down."""
    return f"{math.floor(value * 10**digits) / 10**digits:.{digits}f}"


def _up(value: float, digits: int) -> str:
    """Write a proved number, rounded up."""
    return f"{math.ceil(value * 10**digits) / 10**digits:.{digits}f}"


def _orbit(proof: Proof, claim: Claim) -> None:
    """Print the orbit that refutes a claim."""
    states, scene = claim.counterexample, proof.scene
    typer.echo("  This orbit shows it:")
    for name, (lo, hi) in claim.fixed.items():
        value = _short(lo) if _short(lo) == _short(hi) else f"any value from {_short(lo)} to {_short(hi)}"
        typer.echo(f"  {name} = {value}")
    heads = ["throws", f"x [{scene.unit}]", "side", *_heads(proof)]
    rows: list[list[str]] = []
    for k, state in enumerate(states):
        if 0 < k < len(states) - LAST:
            if k == 1:
                rows.append(["..."] + [""] * (len(heads) - 1))
            continue
        row = [str(k), f"{0.5 * (state.lo + state.hi):.6f}", str(state.side)]
        rows.append(row + (_thrown(proof, state) if state.kappa is not None else [""] * (len(heads) - 3)))
    table(heads, rows)
    shape = {name: lo for name, (lo, _) in claim.fixed.items() if name.startswith(("part.", "arm."))}
    last, thrown = states[-1], scene.with_values(shape)
    nearest, farthest = float(thrown.sides.a[last.side]), thrown.arm_length
    if not (nearest < last.hi and last.lo <= farthest):
        ends = f"on side {last.side} it rests from x = {nearest:.6g} to {farthest:.6g} {scene.unit}"
        typer.echo(f"  There the part has left the arm: {ends}.")


def _heads(proof: Proof) -> list[str]:
    """Name the quantities that differ from throw to throw."""
    unit = proof.scene.unit
    both = "throw.speed" in proof.noise and "gravity.tilt" in proof.noise
    words = {
        "throw.speed": f"kappa of the next throw [{unit}]" if both else "speed of the next throw",
        "gravity.tilt": "tilt of the next throw",
        "landing.x": f"lands off by [{unit}]",
    }
    return [
        word for name, word in words.items() if name in proof.noise and not (both and name == "gravity.tilt")
    ]


def _thrown(proof: Proof, state: State) -> list[str]:
    """Give the values of a throw, one for each of `_heads`."""
    said, noise, row = proof.thrown(state), proof.noise, []
    if "throw.speed" in noise and "gravity.tilt" in noise:
        row.append(f"{state.kappa:.6f}")
    elif "throw.speed" in noise and state.kappa is not None:
        row.append(f"{100.0 * (math.sqrt(proof.scene.kappa / state.kappa) - 1.0):+.4f} %")
    elif "gravity.tilt" in noise:
        row.append(_short(said["gravity.tilt"]))
    return row + ([f"{state.landing:+.6f}"] if "landing.x" in noise and state.landing is not None else [])


# ----------------------------------------------------------------
# `limitsets recheck`: check a certificate again.


def recheck(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A certificate, NAME.proof.zip.")],
    out: Out = None,
    csv: Csv = None,
    json: Json = False,
) -> None:
    """Check a certificate by other code and in other arithmetic than those that made it.

    Exit 0 where every claim is proved; 1 where one fails or is proved of some starts only, or is a refutation.
    """
    with progress() as tell:
        from limitsets.proofs.prover.certificate import recheck as check

        report = check(file, workers=None, progress=lambda done, of: tell("cells checked", done - 1, of))
    if report.verdict == "bad file":
        from limitsets.base.errors import AnswerError

        raise AnswerError("the certificate", str(file), "one that limitsets certify wrote", report.reason)

    from limitsets.checker import EXITS, show

    claims = Table(("claim", "verdict", "reason"), report.claims, str(file))
    answer(report, json, lambda: show(report, str(file)), out, (csv, lambda: claims))
    raise typer.Exit(EXITS[report.verdict])
