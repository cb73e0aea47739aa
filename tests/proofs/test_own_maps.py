"""Proofs of own maps: what is refused, of which functions a claim is, and claims that finer cells must not lose."""

import math
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, MapError
from limitsets.base.files import as_json, as_plain
from limitsets.numbers.interval import mul
from tests.maps_of_tests import Tent


class Growth(NamedTuple):
    r: float


def _growth(p, x, side):
    return x * math.exp(p.r - x), side, 0


class Growth2(NamedTuple):
    r: float


def _growth2(p, x, side):
    return x * math.exp(p.r * (1.0 - x)), side, 0


class Halves(NamedTuple):
    """x' = slope x + shift."""

    slope: float
    shift: float


def _halves(p, x, side):
    return p.slope * x + p.shift, side, 0


class Gains(NamedTuple):
    slope: float
    up: bool


class Sort(NamedTuple):
    gains: Gains
    shift: object
    upside: bool


def _sort(p, x, side):
    return p.gains.slope * x, side, 0


class PerSide(NamedTuple):
    slope: np.ndarray


def _per_side(p, x, side):
    return p.slope[side] * x, side, 0


class Boxed(NamedTuple):
    """A box by hand that is of the lower corner alone."""

    slope: float


def _boxed(p, x, side):
    return p.slope * x, side, 0


def _box_of_the_lower(low, high, lo, hi, side):
    after = mul((low.slope, low.slope), (lo, hi))
    slot = (after[0], after[1], side, 0)
    return 1, slot, slot, (0.0, 0.0)


class Ends(NamedTuple):
    """A box by hand that is of both corners, and of nothing between."""

    power: float


def _ends(p, x, side):
    return 0.4 * x + p.power * (1.0 - p.power), side, 0


def _box_of_ends(low, high, lo, hi, side):
    a, b = low.power * (1.0 - low.power), high.power * (1.0 - high.power)
    slot = (0.4 * lo + min(a, b) - 1e-9, 0.4 * hi + max(a, b) + 1e-9, side, 0)
    return 1, slot, slot, (0.0, 0.0)


class Gathered(NamedTuple):
    slope: float


class Wanders(NamedTuple):
    slope: float


def _gathered(p, side):
    return p


def _wanders(p, start, step):
    return p


def _slow(p, x, side):
    return p.slope * x, side, 0


ls.register(Growth, image=_growth)
ls.register(Growth2, image=_growth2)
ls.register(Halves, image=_halves)
ls.register(Sort, image=_sort)
ls.register(PerSide, image=_per_side)
ls.register(Boxed, image=_boxed, image_box=_box_of_the_lower)
ls.register(Ends, image=_ends, image_box=_box_of_ends)
ls.register(Gathered, image=_slow, on_side=_gathered)
ls.register(Wanders, image=_slow, scattered=_wanders)

LINE = ls.grid([(-1.0, 1.0)], cells=64)


# ---------------------------------------------------------------- refused


def _three(p, x, side):
    branch = 0 if x <= 0.0 else (1 if x <= 0.5 else 2)
    return p.slope * x - branch, side, branch


def _three_on(p, x, side, branch):
    return p.slope * x - branch, side


def _three_margin(p, x, side):
    return x


@pytest.mark.parametrize("branches", [("only",), ("low", "middle", "high")])
def test_a_margin_is_of_two_branches(branches):
    class Named(NamedTuple):
        slope: float

    with pytest.raises(MapError, match="number of branches of a map with margin") as caught:
        ls.register(Named, image=_three, image_on=_three_on, margin=_three_margin, branches=branches)
    assert f"margin is {len(branches)};" in str(caught.value)
    # the class is not half registered
    ls.register(Named, image=_three, image_on=_three_on, branches=("low", "middle", "high"))


def sort(slope=0.5, up=True, shift=None, upside=False):
    return Sort(Gains(slope, up), shift, upside)


@pytest.mark.parametrize(
    ("lower", "upper", "name"),
    [
        (sort(), sort(upside=True), "upside"),
        (sort(), sort(up=False), "gains.up"),
        (sort(), sort(shift=0.0), "shift"),
        (sort(shift=0.0), sort(), "shift"),
        (sort(0.5), sort(0.4), "gains.slope"),
        (sort(0.5), sort(math.nan), "gains.slope"),
        (sort(shift=0.1), sort(shift=0.0), "shift"),
        (PerSide(np.array([0.5, 0.4])), PerSide(np.array([0.6, 0.3])), "slope"),
        (PerSide(np.array([0.5])), PerSide(np.array([0.6, 0.7])), "slope"),
        (PerSide(np.array([0.5])), PerSide(0.6), "slope"),
        (Halves(0.5, 0.0), Growth(1.0), "the parameters"),
        (Halves(0.5, 0.0), 0.6, "the parameters"),
    ],
)
def test_corners_differ_in_numbers_alone(lower, upper, name):
    with pytest.raises(AnswerError, match=f"upper corner of {name}"):
        ls.certify(lower, LINE, ["invariant"], upper=upper)
    with pytest.raises(AnswerError, match=f"upper corner of {name}"):
        ls.transitions(lower, LINE, "boxes", upper=upper)


def test_corners_that_differ_in_numbers_are_taken():
    nested = ls.certify(sort(0.4, shift=0.1), LINE, ["invariant"], upper=sort(0.5, shift=0.2))
    assert nested.proved
    sides = ls.certify(PerSide(np.array([0.4])), LINE, ["invariant"], upper=PerSide(np.array([0.5])))
    assert sides.proved


@pytest.mark.parametrize(("params", "name"), [(Gathered(0.5), "on_side"), (Wanders(0.5), "scattered")])
def test_what_an_orbit_gathers_or_draws_is_not_proved(params, name):
    with pytest.raises(AnswerError, match=f"which has {name}.*register the map without {name}"):
        ls.certify(params, LINE, ["invariant"])


def test_the_throw_is_proved_as_a_scene():
    scene = ls.load("paper-designed")
    with pytest.raises(AnswerError, match=r"pass the scene: limitsets\.certify\(scene\)"):
        ls.certify(scene.map, ls.grid(scene.domain, cells=64), ["invariant"])


# ---------------------------------------------------------------- agreement


def test_a_box_is_held_against_images_at_both_corners():
    ls.transitions(Boxed(0.5), LINE, "boxes")
    with pytest.raises(MapError, match="proved box of the kernel image_box of Boxed"):
        ls.certify(Boxed(0.5), LINE, ["invariant"], upper=Boxed(0.6))


def test_a_box_is_held_against_images_between_the_corners():
    ls.transitions(Ends(0.2), LINE, "boxes", upper=Ends(0.2))
    # p (1 - p) is 0.16 at 0.2 and at 0.8, and 0.25 at 0.5
    with pytest.raises(MapError, match="proved box of the kernel image_box of Ends"):
        ls.certify(Ends(0.2), LINE, ["invariant"], upper=Ends(0.8))


# ---------------------------------------------------------------- of which functions


def test_a_proof_says_of_which_functions_it_is():
    tent = ls.certify(Tent(1.8), ls.grid([(0.15, 0.93)], cells=512), ["invariant", "expanding"])
    assert "of image_on and margin" in str(tent)
    assert "of image_on and margin" in tent.tables()[0].text()
    assert [row["of"] for row in as_plain(tent)] == ["image_on and margin"] * 2
    one = ls.certify(Halves(0.5, 0.0), LINE, ["invariant"])
    assert "of image\n" in str(one).replace(":", "\n")
    boxed = ls.certify(Boxed(0.5), LINE, ["invariant", "cycles"])
    assert "of image_box" in str(boxed)
    told = boxed.to_json()
    assert [row["of"] for row in told] == ["image_box", "image_box and image"]
    assert told[1]["cycles"][0]["attracts"] is True
    assert told[0]["parameters"] == [{"slope": 0.5}, {"slope": 0.5}]
    assert '"verdict": "proved"' in as_json(boxed)


# ---------------------------------------------------------------- claims


@pytest.mark.parametrize("cls", [Growth, Growth2])
@pytest.mark.parametrize("cells", [1024, 4096])
def test_finer_cells_do_not_lose_attracts_all(cls, cells):
    # both have one fixed point that attracts all, of slope 1 - r in -0.6 .. -0.5
    proof = ls.certify(cls(1.5), ls.grid([(0.01, 2.5)], cells=cells), ["attracts-all"], upper=cls(1.6))
    assert proof.claims[0].verdict == "proved", proof.claims[0].reason
    steps = proof.claims[0].section["max_rank"]
    random = np.random.default_rng(1)
    for r in (1.5, 1.6, *random.uniform(1.5, 1.6, 3)):
        x, _, _, made = ls.maps.advance(cls(float(r)), random.uniform(0.01, 2.5, 4000), 0, steps)
        assert (made == steps).all()
        assert proof.cells.mask[proof.graph.grid.index(x[:, None], 0)].all()


def test_a_repelling_fixed_point_is_not_passed():
    # r = 2.2: the fixed point repels, slope -1.2, so not every start comes to the cycle of period 2
    proof = ls.certify(Growth(2.2), ls.grid([(0.05, 4.0)], cells=4096), ["attracts-all"])
    assert proof.claims[0].verdict == "undecided"
    assert "do not attract" in proof.claims[0].reason


@pytest.mark.parametrize(
    ("slope", "verdict"), [(0.5, "refuted"), (-0.999, "refuted"), (1.0, "undecided"), (-1.0, "undecided")]
)
def test_a_slope_below_1_everywhere_refutes_expanding(slope, verdict):
    proof = ls.certify(Halves(slope, 0.0), LINE, ["expanding"])
    assert proof.claims[0].verdict == verdict
    assert not proof.proved
    if verdict == "refuted":
        assert f"at most {abs(slope):.6g}" in proof.claims[0].reason
        assert proof.claims[0].final
