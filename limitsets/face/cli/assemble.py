"""`limitsets assemble` and `tray`: pairs of parts thrown into a cavity, and depressions that fill."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import limitsets as ls
from limitsets.base.tables import Table
from limitsets.face import report
from limitsets.face.cli.arguments import scattering_of
from limitsets.face.cli.commands import Answer, Run, Scene, Seed, Words, command, limits

if TYPE_CHECKING:
    from limitsets.cell.assembly import Assembly
    from limitsets.cell.trays import TrayFill


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
    return Answer(assembly, lambda: _text(assembly), assembly.table)


def _text(assembly: Assembly) -> Iterator[str | Table]:
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
    return Answer(filling, lambda: _text_of_tray(filling), filling.table)


def _text_of_tray(filling: TrayFill) -> Iterator[str | Table]:
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
