"""`limitsets feed`, `assemble` and `tray`: the cavity at the end of the arm, pairs of parts, depressions that fill."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import limitsets as ls
from limitsets.base import BETWEEN, Table
from limitsets.face import report
from limitsets.face.cli.arguments import (
    certified,
    deviations,
    laid_ranges,
    machines_of,
    said_of,
    scattering_of,
)
from limitsets.face.cli.commands import Answer, Run, Scene, Seed, Words, command, limits

if TYPE_CHECKING:
    from limitsets.cell.assembly import Assembly
    from limitsets.cell.feeding import Feeding
    from limitsets.cell.trays import TrayFill
    from limitsets.proofs.chances.absorption import AbsorptionBrackets


# ----------------------------------------------------------------
# `limitsets feed`: what falls into the cavity at the end of the arm, proved, under noise, and in trials.


# Fates of parts if none is fed.
UNFED = {"left": "leave the arm otherwise", "never": "stay on it"}

# Reasons why the throws of a part end without it being fed.
ENDED = {"left": "leaves the arm", "edge": "comes to lie where its throw acts beyond the end"}

# Where a seated part is after one more throw.
NEXT_THROW = {
    "seated": "lies there again after the next throw",
    "moved": "lies otherwise in the cavity after the next throw",
    "left": "is out of the cavity after the next throw",
}

# Smaller shares are rounding errors of 0.
NOTHING = 1e-9


@command(form=True)
def feed(
    run: Run,
    scene: Scene,
    *,
    fitted: Path | None = None,
    side: int | None = None,
    scatter: Words = None,
    law: str = "gaussian",
    noise: Words = None,
    laid: Words = None,
    trials: Annotated[int | None, limits(min=1)] = None,
    seed: Seed = 0,
    brackets: Annotated[int | None, limits(min=8, max=100_000)] = None,
    parts: Annotated[int | None, limits(min=1, max=1000)] = None,
    batches: Annotated[int, limits(min=1)] = 20,
    no_proof: bool = False,
    seconds: Annotated[float, limits(min=0.0)] = 60.0,
    no_level: bool = False,
    certificate: Path | None = None,
    no_recheck: bool = False,
) -> Answer:
    """Say which side is fed from the end of the arm, from which starts, how surely and how fast.

    Exit 1 where it is not proved that only the wanted side is fed, and that almost every start is.

    Parameters
    ----------
    side : I
        The side wanted. Default: the goal's.
    scatter : Q=DEV
        Random noise at every throw, like throw.speed='0.5 %'; repeatable. Default: the scene's [world]
        scatter where [effects] has spread, else none.
    noise : Q=DEV
        What may differ at every throw in the proofs, like throw.speed='0.3 %'; repeatable.
    trials : N
        Parts thrown from random starts. Default: 100 000, fewer where that takes over 5e7 throws.
    brackets : N
        Prove brackets of the probabilities, on N cells per side.
    parts : N
        Throw N parts at once, in the engine, that push each other.
    batches : N
        How often --parts are thrown.
    no_proof
        Probabilities and trials only.
    seconds : S
        For the proofs: finer cells and pieces of the noise are tried only if likely to be done by then.
    no_level
        Do not look for the noise at which 95 % are fed: most of the time that scattered trials take.
    certificate : FILE
        Write the proofs' certificate, NAME.proof.zip.
    out : DIR
        Write feeding.json and figures there.
    """
    chosen = run.opened(scene)
    feeding = ls.feed(
        chosen,
        scattering_of(chosen, scatter, law),
        fitted=machines_of(fitted),
        side=side,
        laid=laid_ranges(laid),
        noise=deviations("--noise", noise) if noise or fitted is None else None,
        prove=not no_proof,
        seconds=seconds,
        level=not no_level,
        trials=trials,
        seed=seed,
        brackets=brackets,
        parts=parts,
        batches=batches,
        progress=run.tell,
    )
    run.tell("recheck", 0, 1)
    feeding, written = certified(
        feeding, certificate, "feeds", proved=feeding.written, recheck=not no_recheck
    )
    said = said_of(written, "nothing is proved, or of a map with effects, which nothing rechecks")
    record = feeding.to_json() | {"certificate": written}
    about = run.about(feeding.model, chosen)
    if run.out is not None:
        drawn = [("part", ls.plot.part(chosen)), ("feeding", ls.plot.feeding(feeding))]
        run.write(drawn, {"feeding.json": about.added(record)})
    return Answer(
        record,
        lambda: [*_words_of_feeding(feeding), *said],
        feeding.table,
        code=0 if no_proof or feeding.proved else 1,
        about=about,
        notes=[note for note in [_unused(feeding)] if note and run.json],
    )


def _unused(feeding: Feeding) -> str:
    """Say that the scene's scatter is not used, and which option would use it."""
    scene = feeding.end.scene
    if scene.world.scatter is None or scene.effects.spread is not None or feeding.scatter.given():
        return ""
    return '[world] scatter is not used: --scatter Q=DEV is, or spread = "gaussian" or "bounded" in [effects]'


def _words_of_feeding(feeding: Feeding) -> Iterator[str | Table]:
    end, in_time = feeding.end, report.pages.in_time
    yield from _arm_end(feeding)
    if feeding.safe is not None and feeding.fed is not None:
        yield from feeding.safe.lines(end.side, laid=bool(end.laid))
        yield from feeding.fed.lines(end.scene.unit)
    yield feeding.table()
    if edge := feeding.shares.shares["edge"]:
        yield (
            f"assumed: {100 * edge:.2f} % of the parts are thrown from so near the end of the arm that the throw acts"
            " beyond it; what that throw does is not simulated, and the proofs throw as if the arm went on"
        )
    if feeding.brackets is not None:
        yield from _proved(feeding.brackets)
    most = feeding.shares.quantile(0.95)
    throw_rate = end.scene.world.throw_rate
    until = "" if most is None else f", 95 % of the starts after {most}{in_time(most, throw_rate)}"
    mean = feeding.shares.mean_throws
    if feeding.vacuous:
        yield "no part comes beyond the end of the arm: limitsets analyse says how far they come"
    else:
        ended = [how for fate, how in ENDED.items() if feeding.shares.shares[fate] >= NOTHING]
        yield (
            f"throws until a part {' or '.join(['is fed', *ended])}: "
            f"{mean:.1f} in the mean{in_time(mean, throw_rate)}{until}"
        )
    if feeding.next_throw is not None:
        yield f"a part that lies in its seat {NEXT_THROW[feeding.next_throw]} (one throw in the engine, not proved)"
    rate = feeding.shares.per_minute(throw_rate)
    if rate is not None:
        yield f"{rate:.2f} parts per minute are fed on the wanted side, one after the other"
    series = feeding.trials.series()
    if series.size:
        yield f"{series[0]} right in the first series of 20 trials, {series.mean():.2f} in the mean"
    if feeding.drawn is not None:
        yield feeding.drawn.sentence()
        noise = " and ".join(f"{name} by up to {size}" for name, size in feeding.noise.items())
        yield f"the proofs are of the most likely machine, {noise} at every throw; margin --fitted proves all machines"
    if feeding.curve is not None:
        yield feeding.curve.line()
    for crowd in feeding.crowds:
        how = "push" if crowd.between else "pass through"
        each = ", ".join(f"{name} {met}" for name, met in crowd.counts.items() if met)
        once, error = crowd.right_per_throw
        yield (
            f"{crowd.parts} parts at once that {how} each other (arm: {crowd.contact}): {each};"
            f" {once:.4f} +- {error:.4f} right per throw"
        )


def _arm_end(feeding: Feeding) -> Iterator[str]:
    """Say where the arm ends, which side is wanted there, where parts start, and at which x they clear the wall."""
    end, unit = feeding.end, feeding.end.scene.unit
    scatter, law_words = feeding.scatter, report.robust_pages.law_words
    laws = (law_words(name, getattr(scatter, name), unit) for name in scatter.given())
    note = "".join(f"; {said}" for said in [_unused(feeding), *laws] if said)
    if feeding.vacuous:
        computed = feeding.shares.shares
        ways = ", ".join(
            f"{100 * computed[name]:.4g} % {how}" for name, how in UNFED.items() if computed[name]
        )
        yield (
            f"{end.scene.name}: nothing is fed, none of {feeding.trials.fate.size} parts thrown, and of all starts "
            f"{ways}"
        )
    yield f"{end.scene.name}: the arm ends at x = {end.x:g} {unit}, side {end.side} is wanted{note}"
    if end.laid:
        from limitsets.feeder.goals import laid_words

        yield (f"all starts, proved and random, are where parts are laid down: {laid_words(end.laid, unit)}")
    parts = ", ".join(f"{lo:.4g} to {hi:.4g} {unit}" for lo, hi in end.clear) or "nowhere"
    yield f"clear of the wall beyond the end: {parts}"


def _proved(brackets: AbsorptionBrackets) -> Iterator[str]:
    """Put proved brackets in words, rounded outward."""
    from limitsets.cell.feeding.feeding_run import FED

    last = brackets.within["any"].shape[1] - 1
    for name in ("right", "wrong", "wall"):
        if name in brackets.within:
            low, high = brackets.within[name][:, -1].tolist()
            yield f"PROVED: {FED[name]} within {last} throws: {BETWEEN.text((low, high))}"
        if name in brackets.ever:
            yield f"PROVED: {FED[name]} after any number of throws: {BETWEEN.text(brackets.ever[name])}"
    first, by = brackets.quantile(0.95)
    if first is not None and by is not None:
        count = f"{first}" if first == by else f"{first} to {by}"
        yield f"PROVED: the least number of throws within which 95 % have ended: {count}"


# ----------------------------------------------------------------
# `limitsets assemble`: pairs of parts thrown into a cavity.


@command(form=True)
def assemble(
    run: Run,
    scene: Scene,
    scene2: str,
    *,
    scatter: Words = None,
    law: str = "gaussian",
    contact: str | None = None,
    standing: bool = False,
    trials: Annotated[int, limits(min=1)] = 2000,
    seed: Seed = 0,
    workers: Annotated[int | None, limits(min=1)] = None,
    cluster: str | None = None,
    file: Path | None = None,
) -> Answer:
    """Count how often two parts, thrown together, come to lie in the cavity as they should, and how they fail.

    Exit 0 whatever the rate.

    Parameters
    ----------
    scene2 : SCENE2
        The part that is to lie on top of the first, with the same arm, throw and cavity.
    scatter : Q=DEV
        Random noise at every throw, like throw.speed='0.5 %'; repeatable. Default: the scenes', if any.
    contact : HOW
        With contact in the scenes: hinge (a struck corner is held, the default) or unilateral.
    standing
        With contact: the cavity stands in the room. Default: it is part of the arm, and thrown with it.
    trials : N
        Pairs thrown from random starts.
    workers : N
        Processes that throw.
    cluster : ADDRESS
        Of a Dask scheduler, instead.
    file : FILE
        Keep finished trials there; the same command goes on with what is left.
    out : DIR
        Write assembly.json and a figure there.
    """
    chosen = run.opened(scene)
    assembly = ls.assemble(
        chosen,
        scene2,
        scattering_of(chosen, scatter, law),
        contact=contact,
        carried=not standing,
        trials=trials,
        seed=seed,
        file=file,
        workers=workers,
        cluster=cluster,
        progress=run.tell,
    )
    if run.out is not None:
        run.tell("figure", 0, 1)
        run.write([("assembly", ls.plot.assembly(assembly))], {"assembly.json": assembly})
    return Answer(assembly, lambda: _words_of_pairs(assembly), assembly.table)


def _words_of_pairs(assembly: Assembly) -> Iterator[str | Table]:
    one, two = assembly.pair.scenes
    joint, first, spans = assembly.joint, assembly.first_series, report.pages.intervals
    meet = "pass through each other"
    if assembly.contact != "none":
        how = "the cavity is thrown too" if assembly.series.carried else "the cavity stands"
        meet = f"push each other, {assembly.contact}, {how}"
    yield f"{one.name} below, {two.name} on top: {len(assembly.rows)} trials, the parts {meet}"
    if assembly.misfit is not None:
        yield (
            f"THEY DO NOT FIT: {assembly.misfit}; 'assembled' says only that both were fed rightly, one after the other"
        )
    if assembly.overlaps is not None:
        ever, flying = assembly.overlaps.ever, assembly.overlaps.in_flight
        low, high = ever.interval
        yield (
            f"the outlines overlap in {100 * ever.share:.1f} % of the trials ({100 * low:.1f} to "
            f"{100 * high:.1f} %), in flight in {100 * flying.share:.1f} %: of these the rates say nothing"
        )
    yield assembly.table()
    if joint is not None:
        rates = " and ".join(f"{rate.share:.4f}" for rate in joint.rates)
        yield f"fed rightly: {rates}; both {joint.both.share:.4f}"
        low, high = joint.error_interval
        yield f"multiplying gives {joint.product:.4f}, off by {joint.error:+.4f} ({low:+.4f} to {high:+.4f})"
        yield f"one part after the other, or two arms: the product, {spans([joint.serial], 4)}"
    for name, rate in assembly.survived.items():
        what = "the cavity standing" if name == "standing" else "the cavity thrown too"
        yield f"whole after the next throw, {what}: {rate.count} of {rate.of} ({spans([rate.interval])})"
    yield f"{first.count} assembled in the first {first.of} trials"


# ----------------------------------------------------------------
# `limitsets tray`: how depressions fill over which parts wash again and again.


@command(form=True)
def tray(
    run: Run,
    scene: Scene,
    *,
    side: int | None = None,
    passes: Annotated[int, limits(min=1, max=10_000)] = 200,
    drops: Annotated[int, limits(min=1)] = 4000,
    kicks: Annotated[int | None, limits(min=1)] = None,
    histories: Annotated[int, limits(min=0)] = 0,
    seed: Seed = 0,
    parts: Annotated[int | None, limits(min=1, max=1000)] = None,
    depressions: Annotated[int | None, limits(min=1, max=1000)] = None,
    batches: Annotated[int, limits(min=1)] = 10,
    workers: Annotated[int | None, limits(min=1)] = None,
    file: Path | None = None,
) -> Answer:
    """Say how a tray's depressions fill: captures and releases counted in the engine, then the chain.

    Parameters
    ----------
    side : I
        The side wanted. Default: the goal's.
    passes : N
        Passes of parts over the tray.
    drops : N
        Parts that come by an empty depression.
    kicks : N
        Kicks in each state. Default: half the drops.
    histories : N
        Depressions followed pass by pass in the engine, with new parts and with parts that return.
    parts : N
        Let N parts come by at once in each pass, in the engine, that push each other.
    depressions : N
        Of the tray, for --parts. Default: one a part.
    batches : N
        How often --parts are tried.
    workers : N
        Processes that run the batches.
    file : FILE
        Keep finished batches of --parts there; the same command goes on with what is left.
    out : DIR
        Write tray.json and a figure there.
    """
    filling = ls.tray(
        run.opened(scene),
        passes=passes,
        drops=drops,
        kicks=kicks,
        histories=histories,
        seed=seed,
        side=side,
        parts=parts,
        depressions=depressions,
        batches=batches,
        file=file,
        workers=workers,
        progress=run.tell,
    )
    if run.out is not None:
        run.write([("tray", ls.plot.tray(filling))], {"tray.json": filling})
    return Answer(filling, lambda: _words_of_tray(filling), filling.table)


def _words_of_tray(filling: TrayFill) -> Iterator[str | Table]:
    filled, counts, unit = filling.filled, filling.counts, filling.scene.unit
    sizes, plate, spans = filling.passes.tray, filling.passes.plate, report.pages.intervals
    yield (
        f"{filling.scene.name}: depressions {sizes.depression_width:g} {unit} wide and {sizes.depression_depth:g} "
        f"{unit} deep, side {filling.passes.side} is right; unilateral contact, friction {plate.friction:g}, "
        f"restitution {plate.restitution:g}"
    )
    yield filling.tables()[0]
    for n in sorted({1, 10, len(filled.right) - 1} & set(range(len(filled.right)))):
        passes = f"{n} pass{'es' if n > 1 else ''}"
        yield f"filled rightly after {passes}: {filled.right[n]:.4f} ({spans([filled.interval[n]], 4)})"
    rest = filled.unfilled
    yield (
        f"the rest after endless passes: {rest['empty']:.4f} empty, {rest['wrong']:.4f} with a wrong part; "
        f"without wrong parts p_release/(p_capture + p_release) = {filled.rest:.4f}"
    )
    for each in filling.histories:
        words = "parts that return" if each.returning else "new parts"
        ends = spans([each.interval(each.filled.size - 1)], 4)
        yield f"{len(each.after_pass)} histories with {words}: {each.filled[-1]:.4f} ({ends})"
    for at_once in filling.tables()[2:]:
        yield from (at_once.caption, at_once)
    chain = filling.crowd_chain
    if chain is not None:
        ends = spans([chain.interval[-1]], 4)
        yield f"by the chain, of as many parts one by one: right {chain.right[-1]:.4f} ({ends})"
    if counts.unfinished:
        yield f"{counts.unfinished} parts did not come to rest; they are left out"
