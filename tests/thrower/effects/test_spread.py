"""The effect `spread`: what is drawn, that it depends on nothing else, and what a throw makes of it."""

import numpy as np
import pytest
from scipy import stats

import limitsets as ls
from limitsets.feeder.scene import Scene
from limitsets.feeder.thrower import trace
from limitsets.feeder.thrower.effects.spread import Spread
from limitsets.numbers.jit import entry_of, kernel
from limitsets.systems.maps import advance, codes, images, orbit
from limitsets.systems.maps.drivers import normal_pair, philox, uniform_pair
from tests.kept import kept

DESIGNED = ls.load("paper-designed")


def scene(word: str, speed: str | None = None, landing: str | None = None) -> Scene:
    tree = DESIGNED.as_dict()
    scatter = {name: text for name, text in (("speed", speed), ("landing", landing)) if text is not None}
    tree |= {"effects": {"spread": word}, "world": {"scatter": scatter}}
    return ls.load(tree)


@kept
@kernel(entry=True)
def words(seed: np.uint64, a: np.uint64, b: np.uint64) -> tuple[int, int, int, int]:
    return philox(seed, a, b)


@kept
@kernel(entry=True)
def pairs(normal: bool, n: int, out: np.ndarray) -> None:
    for k in range(n):
        out[k] = normal_pair(7, k, 3) if normal else uniform_pair(7, k, 3)


@pytest.mark.parametrize(
    ("seed", "a", "b", "expected"),
    [
        (0, 0, 0, "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        (2**64 - 1, 2**64 - 1, 2**64 - 1, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
        (0x299F31D0A4093822, 0x85A308D3243F6A88, 0x0370734413198A2E, "d16cfe09 94fdcceb 5001e420 24126ea1"),
    ],
)
def test_philox_gives_the_known_answers_of_its_authors(seed: int, a: int, b: int, expected: str) -> None:
    """Known answers for philox4x32-10 from the Random123 library (kat_vectors)."""
    found = words(np.uint64(seed), np.uint64(a), np.uint64(b))
    assert " ".join(f"{int(word):08x}" for word in found) == expected


def test_what_is_drawn_is_uniform_and_normal() -> None:
    drawn = np.empty((100_000, 2))
    pairs(False, len(drawn), drawn)
    assert drawn.min() > 0.0
    assert drawn.max() < 1.0
    for k in (0, 1):
        assert stats.kstest(drawn[:, k], "uniform").pvalue > 1e-3
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 4 / np.sqrt(len(drawn))
    pairs(True, len(drawn), drawn)
    for k in (0, 1):
        assert stats.kstest(drawn[:, k], "norm").pvalue > 1e-3


def test_no_width_is_no_effect() -> None:
    still = scene("bounded", speed="0 %", landing="0 in")
    noisy, plain = orbit(still.map, 15.0, 2, 5000), orbit(DESIGNED.map, 15.0, 2, 5000)
    # with effects the arithmetic is ordered otherwise: the same to rounding, until chaos has made that large
    assert np.array_equal(noisy.side[:60], plain.side[:60])
    assert noisy.x[:60] == pytest.approx(plain.x[:60], abs=1e-9)


def test_a_throw_uses_its_own_speed_and_its_own_shift() -> None:
    case = scene("bounded", speed="0.4 %", landing="0.05 in")
    path = orbit(case.map, 15.0, 2, 200)
    deviations = np.empty((200, 2))
    for k in range(200):
        w = words(np.uint64(0), np.uint64(0), np.uint64(k))
        first, second = (int(w[0]) << 32 | int(w[1])) >> 12, (int(w[2]) << 32 | int(w[3])) >> 12
        deviations[k] = 2 * (np.array([first, second]) + 0.5) / 2**52 - 1
    for k, (speed, landing) in enumerate(deviations):
        kappa = DESIGNED.kappa / (1 + 0.004 * speed) ** 2
        alone = images(DESIGNED.map._replace(kappa=kappa), [path.x[k]], int(path.side[k]))
        assert path.side[k + 1] == alone.side[0]
        assert path.x[k + 1] == pytest.approx(alone.x[0] + 0.05 * landing, abs=1e-12)


def test_batches_and_order_do_not_matter() -> None:
    case = scene("gaussian", speed="0.3 %", landing="0.02 in")
    starts = np.linspace(9.0, 23.0, 50)
    whole = advance(case.map, starts, 2, 300)[0]
    parts = [advance(case.map, starts[k : k + 10], 2, 300, first=k)[0] for k in range(0, 50, 10)]
    assert np.array_equal(whole, np.concatenate(parts))
    assert not np.array_equal(whole, advance(case.map, starts, 2, 300, first=1)[0])


def test_landing_places_scatter_as_stated() -> None:
    """Many starts at one place, one throw each: the spread of the landing place, to five standard errors."""
    case = scene("gaussian", landing="0.02 in")
    x, _, code, _ = advance(case.map, np.full(20_000, 12.0), 2, 1)
    alone = images(DESIGNED.map, [12.0], 2).x[0]
    assert (code == codes.JOG).all()
    assert x.mean() == pytest.approx(alone, abs=5 * 0.02 / np.sqrt(20_000))
    assert x.std() == pytest.approx(0.02, rel=5 / np.sqrt(2 * 20_000))


def test_a_scatter_in_degrees_per_second_is_one_in_percent() -> None:
    tree = DESIGNED.as_dict() | {
        "gravity": {"acceleration": "193.045 in/s^2"},
        "effects": {"spread": "bounded"},
    }
    speed = np.degrees(np.sqrt(193.045 / DESIGNED.kappa))
    tree["world"] = {"scatter": {"speed": f"{float(0.004 * speed)!r} deg/s"}}
    assert entry_of(ls.load(tree).map.effects, Spread).speed == pytest.approx(0.004, rel=1e-12)
    del tree["gravity"]
    with pytest.raises(ls.errors.SceneError, match="gravity"):
        _ = ls.load(tree).map


@pytest.mark.parametrize("word", ["bounded", "gaussian"])
def test_what_is_told_of_a_throw_is_that_of_the_throw_made(word: str) -> None:
    """On a side R' = R + displacement; a throw by w' turns the part by another angle than one by w."""
    scattered = trace(scene(word, "1 %", "0.05 in").map, 12.0, 2, 200)
    same = scattered.code == codes.JOG
    assert same.sum() > 50
    moved = np.diff(scattered.x)[same]
    assert np.allclose(scattered.displacement[same], moved, rtol=0, atol=1e-13)
    bare = trace(DESIGNED.map, 12.0, 2, 1)
    assert 1e-6 < abs(scattered.phi[0] - bare.phi[0]) < 0.05 * bare.phi[0]
