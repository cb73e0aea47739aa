"""Films that were written down in another way: each is told from the others, with what to do."""

from dataclasses import replace

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import DataError
from limitsets.face.report.pages import lines_of
from tests.fitting.machines import film, machine
from tests.fitting.test_fit import aimed_at
from tests.fitting.test_misfit import spoiled_film


def seen(seed, corner):
    draw = np.random.default_rng(seed)
    return film(draw, machine(draw), corner=corner)


def moved(throws, place, unit=""):
    return replace(throws, x_before=place(throws.x_before), x_after=place(throws.x_after), unit=unit)


def counted(throws, side):
    return replace(throws, side_before=side(throws.side_before), side_after=side(throws.side_after))


def swapped(throws, *names):
    pairs = {f"{name}_{when}": getattr(throws, f"{name}_{other}") for name in names
             for when, other in (("before", "after"), ("after", "before"))}  # fmt: skip
    return replace(throws, **pairs)


PLAIN = {
    "before and after are exchanged": lambda t: swapped(t, "x", "side"),
    "_before and corner_after are exchanged": lambda t: swapped(t, "x"),
    "side_before and side_after are exchanged": lambda t: swapped(t, "side"),
    "counted from 1: subtract 1": lambda t: counted(t, lambda side: side + 1),
    "against the flip order, from side 0": lambda t: counted(t, lambda side: -side % 3),
    "write [cm] for [in]": lambda t: moved(t, lambda x: 2.54 * x),
    "write [in] for [cm]": lambda t: moved(t, lambda x: x / 2.54, "cm"),
    "those of the centre of mass": lambda t: replace(seen(71, False), corner=True),
    "measured from the arm's end": lambda t: moved(t, lambda x: 28.0 - x),
}


@pytest.mark.parametrize("said", [
    each if k in (0, 3, 5) else pytest.param(each, marks=pytest.mark.sweep) for k, each in enumerate(PLAIN)
])  # fmt: skip
def test_a_plain_mistake_is_named_with_its_remedy(said):
    with pytest.raises(DataError, match="no throws of this machine") as caught:
        ls.fit(aimed_at(), PLAIN[said](seen(71, True)))
    assert said in str(caught.value)


def verdict(throws):
    """What is said of the model where the film can be fitted as it stands."""
    (said,) = (line for line in lines_of(ls.fit(aimed_at(), throws)) if line.startswith("the model"))
    return said


@pytest.mark.parametrize("corner", [True, pytest.param(False, marks=pytest.mark.sweep)])
def test_another_origin_and_scale_are_told_with_their_size(corner):
    throws = seen(72, corner)
    farther, larger = (verdict(moved(throws, change)) for change in (lambda x: x + 1.5, lambda x: 0.92 * x))
    assert "too large" in farther
    assert "multiply each place by" in larger
    assert float(farther.split("seem to be ")[1].split(" in too large")[0]) == pytest.approx(1.5, abs=0.3)
    assert float(larger.split("multiply each place by ")[1].split(";")[0]) == pytest.approx(
        1.0 / 0.92, rel=0.02
    )


def test_a_film_that_fits_is_left_alone():
    assert verdict(seen(73, True)).startswith("the model fits")


@pytest.mark.sweep
def test_no_mistake_is_invented_for_a_part_that_rolls():
    draw = np.random.default_rng(74)
    for _ in range(3):
        found = ls.fit(*spoiled_film(draw, "roll"))
        assert any(
            "something that it leaves out, like rolling or slipping" in line for line in lines_of(found)
        )


@pytest.mark.sweep
def test_many_sides_recorded_wrong_are_said_to_be_that():
    draw = np.random.default_rng(75)
    throws = film(draw, machine(draw), corner=True, flipped=0.6)
    found = ls.fit(aimed_at(), throws)
    assert found.misread_rate[0] > 0.2
    assert any("the sides are recorded wrong, or the part is another one" in line for line in lines_of(found))


def test_one_number_off_the_arm_is_that_row_not_another_unit(tmp_path):
    path = tmp_path / "throws.csv"
    rows = ["254,2,256.54,2"] * 30 + ["2540,2,256,2"]
    path.write_text("\n".join(["x_before [mm],side_before,x_after [mm],side_after", *rows]), encoding="utf-8")
    with pytest.raises(DataError, match=r"row 32, column x_before \[mm\]: the place is '2540 mm'"):
        ls.fit("paper-designed", path)


def test_far_off_stands_in_the_text_as_in_the_figure():
    draw = np.random.default_rng(76)
    throws = film(draw, machine(draw), corner=True)
    after = throws.x_after.copy()
    after[6] += 0.17
    found = ls.fit(aimed_at(), replace(throws, x_after=after))
    assert found.misfit.strange
    told = [line for line in lines_of(found) if line.startswith("far off: the landings of row")]
    assert [line.partition("row")[2].lstrip("s ") for line in told] == [
        ", ".join(map(str, found.misfit.strange))
    ]
    crosses = [
        line for axes in ls.plot.fit_residuals(found).axes for line in axes.lines if line.get_marker() == "x"
    ]
    assert sum(line.get_xdata().size for line in crosses) == len(found.misfit.strange)
