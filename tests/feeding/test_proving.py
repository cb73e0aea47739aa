"""Safety and progress: the figures of the theory, and that no orbit contradicts what is proved."""

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeding.falling import arm_end_of
from limitsets.feeding.proving import proved_feeding
from tests.feeding.scenes import with_cavity


def ends(scene, x_end, starts, most=3000):
    """Where orbits end: side beyond the end of the arm, -1 for those that never get there; and the throws it takes."""
    x, side = starts
    found, throws = np.full(x.size, -1), np.zeros(x.size, dtype=int)
    waiting = np.arange(x.size)
    for number in range(1, most + 1):
        x, side, code, _ = ls.maps.drivers.advance(scene.map, x, side, 1)
        assert (code >= 0).all()
        beyond = x > x_end
        found[waiting[beyond]], throws[waiting[beyond]] = side[beyond], number
        x, side, waiting = x[~beyond], side[~beyond], waiting[~beyond]
        if not waiting.size:
            break
    return found, throws


def random_starts(scene, x_end, count=4000, seed=5):
    random = np.random.default_rng(seed)
    side = random.integers(3, size=count)
    a = scene.sides.a[side]
    return a + (x_end - a) * random.uniform(1e-3, 1.0, count), side


def test_at_20_in_every_start_is_fed_on_side_2():
    """786 throws from the cells on, as `reaches` has it; the only side beyond 20 in is 2, for r_2 = 20."""
    scene = with_cavity()
    safe, fed = proved_feeding(arm_end_of(scene))
    assert safe.verdict == "proved"
    assert set(safe.possible) == {2}
    assert safe.leaving == 0.0
    assert (fed.verdict, fed.throws, fed.share) == ("proved", 786, 1.0)
    found, throws = ends(scene, 20.0, random_starts(scene, 20.0))
    assert (found == 2).all()
    assert throws.max() <= fed.throws


def test_at_20_5_in_an_orbit_is_never_fed():
    """A periodic orbit never exceeds 20.103 in; almost every start is fed all the same."""
    safe, fed = proved_feeding(arm_end_of(with_cavity(position="20.5 in")))
    assert fed.verdict == "refuted"
    assert fed.almost_every == "proved"
    assert max(state.hi for state in fed.never_fed) < 20.5
    first, last = fed.never_fed[0], fed.never_fed[-1]
    assert first.side == last.side
    assert min(first.hi, last.hi) >= max(first.lo, last.lo)
    assert "never fed" in fed.lines("in")[0]
    assert safe.verdict == "proved"


def test_where_two_sides_can_be_fed():
    """paper-initial: all three r_i are 20 in, so that jogs beyond it are possible on each side."""
    scene = with_cavity("paper-initial")
    end = arm_end_of(scene)
    safe, fed = proved_feeding(end)
    assert safe.verdict == "refuted"
    assert safe.counterexample[0].hi < 20.0
    landing = safe.counterexample[-1]
    assert landing.lo > 20.0
    assert landing.side != end.side
    x, side = random_starts(scene, 20.0)
    found, _ = ends(scene, 20.0, (x, side))
    assert set(found.tolist()) - {-1} <= set(safe.possible)
    only = np.zeros(x.size, dtype=bool)
    for number, parts in safe.only_wanted.items():
        for lo, hi in parts:
            only |= (side == number) & (x >= lo) & (x <= hi)
    assert ((found == end.side) | (found == -1))[only].all()
    assert fed.verdict in ("proved", "refuted", "undecided", "proved-on-cells")


@pytest.mark.sweep  # half a minute: nothing is proved of progress, on the finest cells
def test_a_throw_that_scatters_by_10_percent_feeds_side_2_only():
    safe, _ = proved_feeding(arm_end_of(with_cavity()), {"throw.speed": "10 %"})
    assert safe.verdict == "proved"
    assert set(safe.possible) == {2}


def test_scattered_landings_are_fed_from_some_x_on():
    """Nearer to the joint than this some throw of 0.005 in too short loses more than it gains."""
    scene = with_cavity()
    safe, fed = proved_feeding(arm_end_of(scene), {"landing.x": "0.005 in"})
    assert (safe.verdict, set(safe.possible)) == ("proved", {2})
    assert 0.99 < safe.share < 1.0
    assert fed.almost_every in ("proved", "proved-on-cells")
    assert fed.almost_share > 0.97
    for side, x in fed.almost_from["from"].items():
        # the jog from there gains what the noise may take
        a = scene.sides.a[int(side)]
        assert abs(ls.orbit(scene.map, x, int(side), 1).x[1] - x) == pytest.approx(0.005, rel=0.1)
        assert a < x < a + 1.0


def test_a_part_with_too_many_sides_is_told_so():
    corners = [[f"{10 * np.cos(t):.4f} cm", f"{10 * np.sin(t):.4f} cm"] for t in 2 * np.pi * np.arange(8) / 8]
    scene = ls.load(
        {
            "part": {"vertices": corners, "mass": {"plate_density": "1 kg/m^2"}},
            "arm": {"surface_height": "-1 cm", "length": "100 cm"},
            "throw": {"kappa": "90 cm"},
            "goal": {"reaches": {"x": "60 cm", "side": 0}},
            "cavity": {"position": "60 cm", "width": "20 cm", "depth": "5 cm", "angle": "30 deg"},
        }
    )
    with pytest.raises(ls.feeding.proving.AnswerError, match="up to 7"):
        proved_feeding(arm_end_of(scene))


def test_a_certificate_of_a_scene_with_a_cavity_is_rechecked(tmp_path):
    """The checker knows the words, and that the claims do not speak of them."""
    scene = with_cavity(rate="2 Hz")
    file = ls.certify(scene, ["goal"]).save(tmp_path / "fed.proof.zip")
    assert ls.recheck(file).verdict == "proved"
