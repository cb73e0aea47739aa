"""What holds for every effect, and what an absent effect costs: nothing."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from limitsets.feeder.thrower import impact_angles
from limitsets.feeder.thrower.contact import fly_on
from limitsets.feeder.thrower.effects.bounce import Bounce, struck
from limitsets.feeder.thrower.effects.landing import Landing, first_arrival
from limitsets.feeder.thrower.effects.pivot import Pivot, turned_down
from limitsets.feeder.thrower.effects.roll import Roll, next_arrival
from limitsets.feeder.thrower.effects.slip import Slip
from limitsets.feeder.thrower.full import gather_full
from limitsets.feeder.thrower.motion import DOWN, LOST, above, right_of
from limitsets.numbers.jit import entry_of, kernel
from limitsets.systems.maps.drivers import images
from tests.kept import kept
from tests.thrower.effects.copies import environment_of_copy
from tests.thrower.effects.simulation import Law, OutsideError, Simulation
from tests.thrower.effects.throws import Case, cases, same_end

# ----------------------------------------------------------------
# What every effect has to pass, as a table: a row for each effect.
# Absent it changes nothing; in a limit it changes nothing; the energy of a throw is accounted for.  Worked numbers
# and the simulation written apart have their places in the files of the effects.


def _modes(case: Case, law: Law) -> set[str]:
    """Which modes of contact the simulation sees in a throw."""
    simulation = Simulation(case.body, case.kappa, case.height, law)
    try:
        simulation.run(case.x, case.side)
    except OutsideError:
        return {"outside"}
    return set(simulation.modes)


@dataclass(frozen=True)
class Row:
    """An effect: the facts in whose limit it changes nothing, and for which throws that is said."""

    effect: str
    limit: dict[str, float] = field(default_factory=dict)
    applies: Callable[[Case], bool] = lambda case: True


def _left_vertex_lowest(case: Case) -> bool:
    """Whether the part has turned by less than the angle at its left vertex when that lands."""
    (phi,) = impact_angles(case.bare, [case.x], case.side)
    return bool(phi < case.bare.corner[case.side] - 1e-9)


def _no_energy_left(case: Case) -> bool:
    """Whether the simulation sees the same end with and without rolling on."""
    still, rolling = case.simulated(("landing",)), case.simulated(("landing", "roll"))
    return still is not None and rolling is not None and same_end(still, rolling)


def _does_not_tip(case: Case) -> bool:
    """Whether the impulse of the throw acts within the side: (rho^2 + d (h + d))/R at most L - a from the foot."""
    a, d, length = (case.body.numbers()[name][case.side] for name in ("a", "d", "length"))
    acts = (case.body.rho**2 + d * (case.height + d)) / case.x
    return bool(-0.99 * a < acts < 0.99 * (length - a))


ROWS = [
    Row("landing", applies=_left_vertex_lowest),
    Row("roll", applies=_no_energy_left),
    Row("drive", {"stroke": 1e-13, "friction": 1e9}, _does_not_tip),
    Row("slip", {"friction": 1e9}, lambda case: _modes(case, Law(slip=1e9)) == {"hinge"}),
    Row("pivot", {"friction": 1e9}, lambda case: _modes(case, Law(pivot=1e9)) == {"stick"}),
    Row("bounce", {"restitution": 0.0}),
]


def test_absent_effects_are_the_bare_map() -> None:
    for case in cases(20, 20):
        xs = np.linspace(case.x, 2 * case.x, 50)
        full, bare = images(case.full(()), xs, case.side), images(case.bare, xs, case.side)
        inside = bare.code != -3
        assert (full.side[inside] == bare.side[inside]).all()
        assert ((full.code == -3) == ~inside).all()
        np.testing.assert_allclose(full.x[inside], bare.x[inside], rtol=1e-12)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.effect)
def test_in_its_limit_it_changes_nothing(row: Row) -> None:
    seen = 0
    for case in cases(30, 21, **row.limit):
        if row.applies(case):
            seen += 1
            without = () if row.effect == "landing" else ("landing",)
            assert same_end(case.mapped((*without, row.effect)), case.mapped(without))
            if row.effect == "bounce":
                assert same_end(case.mapped(("landing", "roll", "bounce")), case.mapped(("landing", "roll")))
    assert seen > 5


IMPACT, TURN, FLIGHT = range(3)


@kernel
def _note(book: Any, line: int, column: int, one: float, two: float, three: float, four: float) -> None:
    book[line, column] = one
    book[line, column + 1] = two
    book[line, column + 2] = three
    book[line, column + 3] = four


@kept
@kernel(entry=True)
def ledger(params: Any, x: float, side: int, book: Any) -> int:
    """Fill a book with the steps of a throw: kind, X and H, then height, velocities and rate before and after."""
    part = gather_full(params, side)
    on = part.effects
    roll, bounce = entry_of(on, Roll), entry_of(on, Bounce)
    pivot, slip = entry_of(on, Pivot), entry_of(on, Slip)
    hit, moving = first_arrival(entry_of(on, Landing), part, x)
    line = 0
    while moving and line + 3 < book.shape[0]:
        right, high = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi)
        start = struck(bounce, slip, part, hit)
        # the height, fourth, is written again by the next line
        _note(book, line, 0, IMPACT, right, high, high)
        _note(book, line, 3, high, hit.vx, hit.vy, hit.omega)
        vx, vy = start.slide - start.omega * high, start.lift + start.omega * right
        _note(book, line, 7, high, vx, vy, start.omega)
        contact, face, ends = turned_down(pivot, slip, roll, part, start)
        if ends == LOST:
            return -1
        book[line + 1, 0] = TURN
        _note(book, line + 1, 3, high, vx, vy, start.omega)
        if ends == DOWN:
            hit, moving = next_arrival(roll, bounce, slip, part, face)
            d = above(part, hit.vertex, hit.psi)
            _note(book, line + 1, 7, d, hit.vx, hit.vy, hit.omega)
            line += 2
        else:
            right, high = (
                right_of(part, contact.vertex, contact.psi),
                above(part, contact.vertex, contact.psi),
            )
            vx, vy = contact.slide - contact.omega * high, contact.lift + contact.omega * right
            _note(book, line + 1, 7, high, vx, vy, contact.omega)
            hit, moving = fly_on(pivot, slip, bounce, part, contact, hit)
            book[line + 2, 0] = FLIGHT
            _note(book, line + 2, 3, high, vx, vy, contact.omega)
            _note(book, line + 2, 7, above(part, hit.vertex, hit.psi), hit.vx, hit.vy, hit.omega)
            line += 3
    return line


ALL = ("landing", "roll", "slip", "pivot", "bounce")


@pytest.mark.sweep
def test_the_energy_of_a_throw_is_accounted_for() -> None:
    kinds = {IMPACT: 0, TURN: 0, FLIGHT: 0}
    rubbing = 0
    for case in cases(40, 22):
        book = np.zeros((4000, 11))
        lines = ledger(case.full(ALL), case.x, case.side, book)
        simulation = case.simulation(ALL)
        try:
            simulation.run(case.x, case.side)
        except OutsideError:
            continue
        rho2, kappa = case.body.rho**2, case.kappa
        d = case.body.numbers()["d"][case.side]
        # thrown with the arm: the velocity of rotation about the joint
        started = 0.5 * ((case.height + d) ** 2 + case.x**2 + rho2) + kappa * d
        ended, lost = 0.0, 0.0
        for kind, right, high, *states in book[:lines]:
            before, after = np.reshape(states, (2, 4))
            kinds[int(kind)] += 1
            energy = [
                0.5 * (vx**2 + vy**2 + rho2 * rate**2) + kappa * height
                for height, vx, vy, rate in (before, after)
            ]
            ended = energy[1]
            if kind == FLIGHT:
                assert energy[1] == pytest.approx(energy[0], rel=1e-12)
            if kind == IMPACT:
                drag, push = after[1:3] - before[1:3]
                # the impulse acts at the vertex, and its work is its product with the vertex's mean velocity
                assert rho2 * (after[3] - before[3]) == pytest.approx(
                    high * drag - right * push, abs=1e-12 * started
                )
                along = before[1] + after[1] + high * (before[3] + after[3])
                off = before[2] + after[2] - right * (before[3] + after[3])
                lost -= 0.5 * (drag * along + push * off)
                assert energy[1] <= energy[0] * (1 + 1e-13)
        rubbing += simulation.rubbed > 1e-6 * started
        assert started == pytest.approx(ended + lost + simulation.rubbed, rel=1e-12)
    assert min(kinds.values()) > 20
    assert rubbing > 13


# ----------------------------------------------------------------
# What a scene does not ask for is not in its machine code: the bare map's is the same with the effects deleted.


# Prints a digest of the machine code of one compiled loop over throws; symbols carry counters, so they are left out.
SCRIPT = """
import hashlib, re, sys
import numpy as np
import limitsets as ls
from limitsets.maps import drivers, images
if sys.argv[1] == "with":
    import limitsets.feeder.thrower.effects
images(ls.load("paper-designed").map, np.linspace(9.0, 20.0, 8), 2)
(signature,) = drivers.fill_images.signatures
code = drivers.fill_images.inspect_asm(signature)
lines = [line for line in code.splitlines() if not line.lstrip().startswith((".", "#"))]
symbol = r"[A-Za-z0-9_.$]*_ZN?[A-Za-z0-9_.$]*|\\.?numba[A-Za-z0-9_.$]*|NRT[A-Za-z0-9_]*"
body = re.sub(symbol, "symbol", "\\n".join(lines))
print(len(lines), hashlib.sha256(body.encode()).hexdigest())
"""


def machine_code(folder: Path, word: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, word],
        capture_output=True,
        text=True,
        check=False,
        env=environment_of_copy(folder, word),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.sweep
def test_the_bare_map_has_the_same_machine_code_without_the_effects(tmp_path: Path) -> None:
    whole, bare = machine_code(tmp_path, "with"), machine_code(tmp_path, "without")
    assert whole == bare
    assert int(whole.split()[0]) > 500  # there is a loop in it
