"""`limitsets absorption`: where orbits of a noisy map end, how surely and when, proved, with a certificate."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import limitsets as ls
from limitsets.base import BETWEEN, AnswerError, Table, rounded
from limitsets.face.cli.arguments import certified, named, said_of, with_ending
from limitsets.face.cli.average import noise_of_words
from limitsets.face.cli.commands import Answer, Run, Words, command, limits
from limitsets.face.cli.output import saved
from limitsets.face.cli.subjects import MapOfFile, domain_of, spans, subject

# Cells of the domain; what stands in the name of a certificate; what is named where places are read.
CELLS, KIND, ABSORBING, STARTS = 4000, ".absorption", "--absorbing", "--starts"
# Shares of the starts of which it is said within how many steps they end.
SHARES = (0.5, 0.95, 0.99)


@command(out="--save")
def absorption(
    run: Run,
    map_: str,
    *,
    noise: Words = None,
    absorbing: Words = None,
    starts: Words = None,
    set_: Words = None,
    domain: str | None = None,
    cells: Annotated[int, limits(min=8, max=1_000_000)] = CELLS,
    steps: Annotated[int, limits(min=0, max=2000)] = 200,
    no_recheck: bool = False,
) -> Answer:
    """Prove how surely orbits of a noisy map end at places, and how soon, and write a certificate.

    Orbits also end where they leave the domain.  `limitsets feed` has this of a scene.

    Parameters
    ----------
    map_ : FILE.py:NAME
        A map of a line; the Python file is run.
    noise : NAME=BOUND
        Each step lands evenly within this distance of the image (landing=BOUND, or BOUND alone), or this parameter
        deviates so far at every step; repeatable.
    absorbing : NAME=LO:HI
        Where orbits end, by a name of yours; repeatable, also for one name.
    starts : LO:HI
        All x of the range are equally likely; repeatable; by default the domain.
    set_ : NAME=NUMBER
        The value of a parameter, like a=1.4, or its range, like a=1.4:1.41: bounds then hold for all of it, also where
        it is another at every step; repeatable.
    domain : LO:HI
        A range; orbits that leave it have ended.
    cells : N
        Cells of the domain: the bounds come nearer as 1/N^2.
    steps : N
        Probabilities of having ended are of up to so many steps, and of any number.
    out : FILE
        The certificate, NAME.proof.zip; ./ and the name of the map with .absorption by default.
    """
    from limitsets.proofs.chances.absorption import absorption_brackets

    chosen = subject(map_, set_)
    if not isinstance(chosen, MapOfFile):
        raise AnswerError("the map", map_, "FILE.py:NAME", "of a scene: limitsets feed SCENE --brackets N")
    file = with_ending(run.out or Path(f"{chosen.name}{KIND}.proof.zip"))
    places: dict[str, Any] = {}
    form, remedy = "NAME=LO:HI", "name a place, the sign =, and two numbers with : between them"
    for name, text in named(absorbing, ABSORBING, "where orbits end", form, remedy, once=False):
        places.setdefault(name, []).extend(_ranges([text], ABSORBING))
    with saved(file):  # a place that cannot be written is refused before anything is proved
        pass
    brackets = absorption_brackets(
        chosen.lower,
        ls.grid(domain_of(chosen, domain), cells=cells),
        upper=chosen.upper,
        noise=noise_of_words(noise),
        absorbing=places,
        starts=_ranges(starts, STARTS) or None,
        throws=steps,
        progress=run.tell,
    )
    run.tell("recheck", 0, 1)
    brackets, written = certified(brackets, file, proved=True, recheck=not no_recheck)

    def words() -> Iterator[str | Table]:
        yield f"{chosen.name}: proved where {brackets.scatter.words()}"
        yield brackets.table()
        least, most = brackets.mean
        bounds = f"at least {rounded(least, '.6f', up=False)}; nothing is proved from above"
        if most < math.inf:
            bounds = BETWEEN.text(brackets.mean)
        yield f"the mean number of steps until an orbit ends: {bounds}"
        for share in SHARES:
            first, last = brackets.quantile(share)
            if first is not None and last is not None:
                count = f"{first}" if first == last else f"{first} to {last}"
                yield f"the least number of steps within which {100 * share:.0f} % have ended: {count}"
        yield from said_of(written, "")

    return Answer(brackets.to_json() | {"certificate": written}, words, brackets.table)


def _ranges(words: list[str] | None, option: str) -> list[tuple[int, float, float]]:
    """Read ranges of the line."""
    return [(0, lo, hi) for word in words or [] for lo, hi in spans(word, option)]
