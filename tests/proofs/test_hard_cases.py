"""Proofs where they are hardest: ends of the limit set on a critical point, corners under the centre, several roots.

The references are 40-digit throws of `tests/sets/part.py`, from the decimals of the scene.
"""

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import GeometryError
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.graph.images.enclosed import enclosures
from tests.sets.part import Part, mp

# ---------------------------------------------------------------- an end of the limit set on a critical point

# Scene; h, centre of mass along and above side 2, kappa [in]: there the image of the critical point of one side by
# the branches given is the critical point of another (or the same) side, to 38 digits.  kappa by the secant method.
TOUCHING = {
    "paper-designed": (
        ("-0.907", "4.287", "1.446", "18.907916692945527529471649225543654092"),
        ((2, 13.9), ["flip"], (0, 8.625)),
    ),
    "paper-designed-small-angle": (
        ("-1.512", "3.721", "0.4244", "49.278241525380701932804082683620863643"),
        ((2, 18.6), ["flip"], (0, 12.45)),
    ),
    "paper-initial": (
        ("-0.3916", "3.987", "1.994", "34.747742634044033212377316988202441649"),
        ((0, 21.8), ["jog", "flip", "flip", "jog"], (2, 20.41)),
    ),
}
ASKED = ["end-points", "attracts-all"]


def touching(name, share):
    """Scene and part with kappa times 1 + share; decimals of one are those of the other."""
    (h, along, above, kappa), _ = TOUCHING[name]
    kappa = mp.nstr(mp.mpf(kappa) * (1 + mp.mpf(share)), 38)
    names = ("arm.surface_height", "part.mass.center.along", "part.mass.center.above", "throw.kappa")
    texts = zip(names, (h, along, above, kappa), strict=True)
    scene = ls.load(name).with_values({key: f"{text} in" for key, text in texts})
    return scene, Part(name, (h, along, above, kappa))


def critical_points(scene, part):
    """The one of each side, near where floats see it."""
    near = ls.critical_points(scene.map, scene.domain)
    return [part.critical_point(side, near[side][0].x) for side in range(3)]


def joined(intervals):
    """Union of intervals as disjoint ones, ascending; what is between numbers equal to 36 digits is no gap."""
    done = []
    for lo, hi in sorted(intervals):
        if done and lo <= done[-1][1] + mp.mpf(10) ** -36:
            done[-1] = (done[-1][0], max(hi, done[-1][1]))
        else:
            done.append((lo, hi))
    return done


def limit_set(scene, part):
    """Images of nearly the whole arm until they rest: each branch grows with x, so ends go to ends."""
    critical = critical_points(scene, part)
    now = [[(part.a[side] + 1, mp.mpf(scene.arm_length))] for side in range(3)]
    thrown = {}

    def end(x, side, branch):
        if (x, side, branch) not in thrown:
            thrown[x, side, branch] = part.throw(x, side, branch)
        return thrown[x, side, branch]

    for _ in range(500):
        after = [[], [], []]
        for side, parts in enumerate(now):
            cut = critical[side]
            for lo, hi in parts:
                for a, b, branch in ((lo, min(hi, cut), "jog"), (max(lo, cut), hi, "flip")):
                    if a < b:
                        (first, to), (last, _) = end(a, side, branch), end(b, side, branch)
                        after[to].append((first, last))
        after = [joined(parts) for parts in after]
        if after == now:
            return now
        now = after
    return pytest.fail("the images do not come to rest")


@pytest.mark.parametrize("share", ["-1e-6", "0", "1e-6"])
@pytest.mark.parametrize("name", TOUCHING)
def test_an_end_of_the_limit_set_that_touches_a_critical_point(name, share):
    """Proved on both sides of the touch; at it proved and right, or undecided and told where."""
    scene, part = touching(name, share)
    proof = ls.certify(scene, ASKED)
    ends, attracts = proof.claims
    assert (ends.claim, attracts.claim, attracts.verdict) == (*ASKED, "proved")
    if ends.verdict != "proved":
        # beyond the touch the limit set of this scene has a part more (its size jumps): both are limits
        assert (name, share, ends.verdict) == ("paper-initial", "0", "undecided")
        assert "side 0, [14.00" in ends.reason
        return
    found = sorted(
        (one["side"], *sorted(float.fromhex(one[key]) for key in ("outer", "inner")), one["which"])
        for one in ends.section["ends"]
    )
    expected = limit_set(scene, part)
    pairs = [(side, pair) for side, parts in enumerate(expected) for pair in parts]
    flat = [(side, *end) for side, pair in pairs for end in zip(pair, ("lo", "hi"), strict=True)]
    assert [(side, which) for side, *_, which in found] == [(side, which) for side, _, which in flat]
    for (_, lo, hi, _), (_, x, _) in zip(found, flat, strict=True):
        assert lo <= x <= hi
        assert hi - lo < 1e-10


# ---------------------------------------------------------------- the centre of mass nearly above a corner

# A triangle that is obtuse between sides 0 and 1: only there may the foot of the centre come near a corner.
OBTUSE = ("5", "3", "7")
# Side, along it from its left end, above it [in]: a_0 or L_1 - a_1 is 1e-6, 1e-12 or less than a rounding.
CORNERS = [
    (0, "1e-6", "1"),
    pytest.param(0, "1e-12", "1", marks=pytest.mark.repeats),
    (0, "1e-17", "1"),
    pytest.param(1, "2.999999", "0.8", marks=pytest.mark.repeats),
    (1, "2.999999999999", "0.8"),
]


def obtuse(side, along, above):
    tree = ls.load("paper-designed").as_dict()
    tree.pop("goal")
    center = {"side": side, "along": f"{along} in", "above": f"{above} in"}
    mass = {"center": center, "radius_of_gyration": "1.25 in"}
    return ls.load({**tree, "part": {"sides": [f"{length} in" for length in OBTUSE], "mass": mass}})


def obtuse_part(side, along, above):
    """The same at 40 digits, from the corners of the triangle."""
    part = Part("paper-designed")
    part.lengths = low, left, right = [mp.mpf(text) for text in (OBTUSE[2], OBTUSE[0], OBTUSE[1])]
    x = (low**2 + left**2 - right**2) / (2 * low)
    apex, zero, far = mp.mpc(x, mp.sqrt(left**2 - x**2)), mp.mpc(0), mp.mpc(low)
    sides = [(apex, zero), (far, apex), (zero, far)]
    part.lengths = [abs(q - p) for p, q in sides]
    along_it = [(q - p) / abs(q - p) for p, q in sides]
    center = sides[side][0] + along_it[side] * mp.mpc(along, above)
    frames = [(center - p) / u for (p, _), u in zip(sides, along_it, strict=True)]
    part.a, part.d = [z.real for z in frames], [z.imag for z in frames]
    return part


@pytest.mark.parametrize(("side", "along", "above"), CORNERS)
def test_images_of_cells_hold_exact_throws_beside_a_corner(side, along, above):
    part, box = obtuse_part(side, along, above), parameter_box(obtuse(side, along, above))
    rng = np.random.default_rng(3)
    held = 0
    for start in range(3):
        a = float(box.hi.a[start])
        edges = np.concatenate([a + np.geomspace(1e-9, 1e-2, 40), np.linspace(a + 0.0101, 28.0, 300)])
        found = enclosures(box.lo, box.hi, edges, start)
        assert not found.lost.any()
        for cell in rng.integers(0, edges.size - 1, 120):
            x = mp.mpf(float(rng.uniform(edges[cell], edges[cell + 1])))
            flips = part.margin(x, start) > 0
            image, to = part.throw(x, start, "flip" if flips else "jog")
            lo, hi = found.hulls[to, int(flips)]
            assert lo[cell] <= image <= hi[cell], (start, cell)
            held += 1
    assert held == 360


@pytest.mark.parametrize(("side", "along", "above"), CORNERS)
def test_what_is_not_proved_beside_a_corner_is_not_true(side, along, above):
    """A flip lands some starts inward of the next vertex or beyond the arm: it is told where."""
    scene, part = obtuse(side, along, above), obtuse_part(side, along, above)
    ends, attracts = ls.certify(scene, ASKED).claims
    assert ends.verdict == "proved"
    assert attracts.verdict in ("undecided", "refuted")
    for last in attracts.counterexample[-1:]:
        assert last.hi <= part.a[last.side] or last.lo > 28
    assert "side 0, x in [" in attracts.reason
    assert "may leave the cells" in attracts.reason
    lo, hi = (mp.mpf(text) for text in attracts.reason.split("[")[1].split("]")[0].split(","))
    thrown = [part.throw(x, 0, "flip") for x in (lo, hi) if part.margin(x, 0) > 0]
    assert any(image <= part.a[to] or image > 28 for image, to in thrown)
    (extents,) = ls.analyse(scene, cells=1024).extents
    assert all(part.a[int(k)] < x < 28 for k, parts in extents.items() for pair in parts for x in pair)


@pytest.mark.parametrize(
    ("side", "along", "above"), [(0, "0", "1"), (0, "-1e-12", "1"), (1, "3", "0.8"), (1, "3.000001", "0.8")]
)
def test_a_centre_over_the_corner_or_beyond_cannot_rest(side, along, above):
    with pytest.raises(GeometryError, match="cannot rest on side"):
        obtuse(side, along, above)


# ---------------------------------------------------------------- several roots


def test_what_is_not_proved_where_a_flight_may_meet_the_arm_twice_is_not_true():
    """kappa < ell of side 2; enclosures there, and where an impact grazes, are tested in `tests/thrower`."""
    tree = ls.load("paper-designed").as_dict()
    tree.pop("goal")
    scene = ls.load({**tree, "throw": {"kappa": "4 in"}, "arm": {**tree["arm"], "length": "7 in"}})
    part = Part("paper-designed", ("-0.2", "4.2255778", "0.7082490", "4"))
    assert part.kappa < mp.hypot(part.a[2], part.d[2])
    ends, attracts = ls.certify(scene, ASKED).claims
    assert (ends.verdict, ends.reason) == ("undecided", "there are no attracting cells")
    assert attracts.verdict == "refuted"
    last = attracts.counterexample[-1]
    assert last.hi <= part.a[last.side] or last.lo > 7
    assert "the image of side 0, x in [1.79777, 1.79777] may leave the cells" in attracts.reason
    x = mp.mpf("1.79777")
    assert part.margin(x, 0) > 0
    image, to = part.throw(x, 0, "flip")
    assert image <= part.a[to] or image > 7
