"""`limitsets feed`: what falls into the cavity at the end of the arm, proved, under noise, and in trials."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.face.cli.about import About
from limitsets.face.cli.arguments import (
    HELP_LAID,
    HELP_NO_RECHECK,
    certified,
    deviations,
    laid_ranges,
    said_of,
)
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
    show,
)

if TYPE_CHECKING:
    from limitsets.cell.feeding import Feeding
    from limitsets.proofs.chances.absorption import AbsorptionBrackets


# Fates of parts if none is fed.
UNFED = {"left": "leave the arm otherwise", "never": "stay on it"}

# Reasons why the throws of a part end without it being fed.
ENDED = {"left": "leaves the arm", "edge": "comes to lie where its throw acts beyond the end"}

# Smaller shares are rounding errors of 0.
NOTHING = 1e-9

HELP_SCATTER = (
    "Random noise at every throw, like throw.speed='0.5 %'; repeatable. "
    "Default: the scene's [world] scatter where [effects] has spread, else none."
)
HELP_TRIALS = "Parts thrown from random starts. Default: 100 000, fewer where that takes over 5e7 throws."
HELP_SECONDS = (
    "For the proofs: finer cells and pieces of the noise are tried only if likely to be done by then."
)
HELP_NO_LEVEL = (
    "Do not look for the noise at which 95 % are fed: most of the time that scattered trials take."
)
HELP_NOISE = "What may differ at every throw in the proofs, like throw.speed='0.3 %'; repeatable."


def feed(
    scene: Scene,
    side: Annotated[int | None, option("--side", "I", "The side wanted. Default: the goal's.")] = None,
    scatter: Annotated[Words, option("--scatter", "Q=DEV", HELP_SCATTER)] = None,
    law: Annotated[
        str, option("--law", "LAW", "Of --scatter: gaussian (standard deviations) or bounded.")
    ] = "gaussian",
    noise: Annotated[Words, option("--noise", "Q=DEV", HELP_NOISE)] = None,
    laid: Annotated[Words, option("--laid", "SIDE=LO:HI", HELP_LAID)] = None,
    trials: Annotated[int | None, option("--trials", "N", HELP_TRIALS, min=1)] = None,
    seed: Annotated[int, option("--seed", "N", "Of the trials.", min=0)] = 0,
    brackets: Annotated[
        int | None,
        option(
            "--brackets", "N", "Prove brackets of the probabilities, on N cells per side.", min=8, max=100_000
        ),
    ] = None,
    parts: Annotated[
        int | None,
        option(
            "--parts", "N", "Throw N parts at once, in the engine, that push each other.", min=1, max=1000
        ),
    ] = None,
    batches: Annotated[int, option("--batches", "N", "How often --parts are thrown.", min=1)] = 20,
    no_proof: Annotated[bool, typer.Option("--no-proof", help="Probabilities and trials only.")] = False,
    seconds: Annotated[float, option("--seconds", "S", HELP_SECONDS, min=0.0)] = 60.0,
    no_level: Annotated[bool, typer.Option("--no-level", help=HELP_NO_LEVEL)] = False,
    out: Annotated[Path | None, option("--out -o", "DIR", "Write feeding.json and figures there.")] = None,
    certificate: Annotated[
        Path | None, option("--certificate", "FILE", "Write the proofs' certificate, NAME.proof.zip.")
    ] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
    no_recheck: Annotated[bool, typer.Option("--no-recheck", help=HELP_NO_RECHECK)] = False,
) -> None:
    """Say which side is fed from the end of the arm, from which starts, how surely and how fast.

    Exit 1 where it is not proved that only the wanted side is fed, and that almost every start is.
    """
    with progress() as tell:
        chosen, _ = opened(scene, out)
        from limitsets.cell.feeding import feed as run
        from limitsets.parameters.sheet.summary import scattering_from

        random = deviations("--scatter", scatter)
        feeding = run(
            chosen,
            scattering_from(chosen, random, law) if random else None,
            side=side,
            laid=laid_ranges(laid),
            noise=deviations("--noise", noise),
            prove=not no_proof,
            seconds=seconds,
            level=not no_level,
            trials=trials,
            seed=seed,
            brackets=brackets,
            parts=parts,
            batches=batches,
            progress=tell,
        )
        written = None
        if certificate is not None:
            tell("recheck", 0, 1)
            again = not no_recheck
            feeding, written = certified(feeding, certificate, "feeds", proved=feeding.written, recheck=again)
        record = feeding.to_json() | {"certificate": written}
        about = About(feeding.model, scene, chosen)
        files = []
        if out is not None:
            from limitsets.base.files import as_json
            from limitsets.face import plot
            from limitsets.face.report.writing import laid as files_laid

            drawn = [("part", plot.part(chosen)), ("feeding", plot.feeding(feeding))]
            files = files_laid(out, drawn, lambda _: {"feeding.json": as_json(about.added(record))}, form)
    if json and (note := _unused(feeding)):
        print(f"limitsets: {note}", file=sys.stderr, flush=True)
    answer(record, json, lambda: _text(feeding, files, written), csv=(csv, feeding.table), about=about)
    raise typer.Exit(0 if no_proof or feeding.proved else 1)


def _unused(feeding: Feeding) -> str:
    """Say that the scene's scatter is not used, and which option would use it."""
    scene = feeding.end.scene
    if scene.world.scatter is None or scene.effects.spread is not None or feeding.scatter.given():
        return ""
    return '[world] scatter is not used: --scatter Q=DEV is, or spread = "gaussian" or "bounded" in [effects]'


def _text(feeding: Feeding, files: list[Path], written: dict[str, Any] | None) -> None:
    from limitsets.face.report.pages import in_time

    end = feeding.end
    _print_arm_end(feeding)
    if feeding.safe is not None and feeding.fed is not None:
        for line in (*feeding.safe.lines(end.side, laid=bool(end.laid)), *feeding.fed.lines(end.scene.unit)):
            typer.echo(line)
    show(feeding.table())
    if edge := feeding.shares.shares["edge"]:
        typer.echo(
            f"assumed: {100 * edge:.2f} % of the parts are thrown from so near the end of the arm that the throw acts"
            " beyond it; what that throw does is not simulated, and the proofs throw as if the arm went on"
        )
    if feeding.brackets is not None:
        for line in _proved(feeding.brackets):
            typer.echo(line)
    most = feeding.shares.quantile(0.95)
    throw_rate = end.scene.world.throw_rate
    until = "" if most is None else f", 95 % of the starts after {most}{in_time(most, throw_rate)}"
    mean = feeding.shares.mean_throws
    if feeding.vacuous:
        typer.echo("no part comes beyond the end of the arm: limitsets analyse says how far they come")
    else:
        ended = [how for fate, how in ENDED.items() if feeding.shares.shares[fate] >= NOTHING]
        typer.echo(
            f"throws until a part {' or '.join(['is fed', *ended])}: "
            f"{mean:.1f} in the mean{in_time(mean, throw_rate)}{until}"
        )
    rate = feeding.shares.per_minute(throw_rate)
    if rate is not None:
        typer.echo(f"{rate:.2f} parts per minute are fed on the wanted side, one after the other")
    series = feeding.trials.series()
    if series.size:
        typer.echo(f"{series[0]} right in the first series of 20 trials, {series.mean():.2f} in the mean")
    if feeding.curve is not None:
        typer.echo(feeding.curve.line())
    for crowd in feeding.crowds:
        how = "push" if crowd.between else "pass through"
        each = ", ".join(f"{name} {met}" for name, met in crowd.counts.items() if met)
        once, error = crowd.right_per_throw
        typer.echo(
            f"{crowd.parts} parts at once that {how} each other (arm: {crowd.contact}): {each};"
            f" {once:.4f} +- {error:.4f} right per throw"
        )
    if written is not None:
        typer.echo(said_of(written, "nothing is proved, or of a map with effects, which nothing rechecks"))
    if files:
        typer.echo(f"written: {', '.join(map(str, files))}")


def _print_arm_end(feeding: Feeding) -> None:
    """Print where the arm ends, which side is wanted there, where parts start, and at which x they clear the wall."""
    from limitsets.face.report.robust_pages import law_words

    end, unit = feeding.end, feeding.end.scene.unit
    laws = (law_words(name, getattr(feeding.scatter, name), unit) for name in feeding.scatter.given())
    note = "".join(f"; {said}" for said in [_unused(feeding), *laws] if said)
    if feeding.vacuous:
        computed = feeding.shares.shares
        ways = ", ".join(
            f"{100 * computed[name]:.4g} % {how}" for name, how in UNFED.items() if computed[name]
        )
        typer.echo(
            f"{end.scene.name}: nothing is fed, none of {feeding.trials.fate.size} parts thrown, and of all starts "
            f"{ways}"
        )
    typer.echo(f"{end.scene.name}: the arm ends at x = {end.x:g} {unit}, side {end.side} is wanted{note}")
    if end.laid:
        from limitsets.feeder.goals import laid_words

        typer.echo(
            f"all starts, proved and random, are where parts are laid down: {laid_words(end.laid, unit)}"
        )
    parts = ", ".join(f"{lo:.4g} to {hi:.4g} {unit}" for lo, hi in end.clear) or "nowhere"
    typer.echo(f"clear of the wall beyond the end: {parts}")


def _proved(brackets: AbsorptionBrackets) -> list[str]:
    """Put proved brackets in words, rounded outward."""
    from limitsets.cell.feeding.feeding_run import FED

    last = brackets.within["any"].shape[1] - 1
    lines = []
    for name in ("right", "wrong", "wall"):
        if name in brackets.within:
            low, high = (float(end) for end in brackets.within[name][:, -1])
            lo, hi = math.floor(low * 1e6) / 1e6, math.ceil(high * 1e6) / 1e6
            lines.append(f"PROVED: {FED[name]} within {last} throws: {lo:.6f} to {hi:.6f}")
    first, by = brackets.quantile(0.95)
    if first is not None and by is not None:
        count = f"{first}" if first == by else f"{first} to {by}"
        lines.append(f"PROVED: the least number of throws within which 95 % have ended: {count}")
    return lines
