"""Many parts on a tray at once: beside single parts and their chain; what lies where; batches by number."""

import json
from concurrent.futures import Executor, ThreadPoolExecutor
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import binomtest, ttest_1samp

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.cell.trays.filling import Chain
from limitsets.cell.trays.passing import passes_of, random_of
from limitsets.cell.trays.pouring import CROWD, Pouring, TrayCrowd, _Strewn, crowds_of
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.engine.depression import EMPTY
from tests.trays.scenes import with_tray

pytest.importorskip("pymunk")

FEW = {"drops": 60, "kicks": 20, "passes": 4, "step": 8e-3}


@pytest.fixture(scope="module")
def asked():
    return passes_of(with_tray(), None, 8e-3)


def alone(asked, seed, number, count):
    """Follow one depression in the engine that has one, with the draws of a batch: whether it is filled rightly."""
    state, pose, rows = EMPTY, None, []
    for k in range(count):
        random = random_of(seed, CROWD, number, k)
        random.integers(1)
        came = asked.arrival(random)
        if state != EMPTY:
            pose, state, *_ = asked.plate.settle(pose, asked.kick(random))
        if state == EMPTY:
            pose, state, *_ = asked.plate.settle(*came)
        rows.append((state == asked.right, state not in (EMPTY, asked.right)))
    return rows


def test_parts_that_pass_through_each_other_fill_a_depression_as_single_ones_do(asked):
    pouring = Pouring(asked, 1, 1, 6, 5)
    same = 0
    for number in range(20):
        seen = pouring.row(number)["passing"]["states"]
        assert seen[0] == [0, 0, 0]
        same += [(right, wrong) for right, _, wrong in seen[1:]] == alone(asked, 5, number, 6)
    assert same >= 18  # the plates lie at different x, and rounding decides some bounces


@pytest.mark.parametrize("each", [1.0, 3.0, 0.25, 2.5])
def test_the_chain_of_many_parts_is_a_product_of_passes(each):
    random = np.random.default_rng(4)
    captured, kicked = random.dirichlet(np.ones(4)), random.dirichlet(np.ones(4), 4)
    kicked[0] = [1.0, 0.0, 0.0, 0.0]
    comes = np.eye(4)
    comes[0] = captured
    whole, more = divmod(each, 1.0)
    by = np.linalg.matrix_power(comes, int(whole)) @ ((1.0 - more) * np.eye(4) + more * comes)
    assert Chain(captured, kicked, 2).of_many(each).passed == pytest.approx(kicked @ by, abs=1e-14)


def test_of_a_depression_that_catches_nothing_many_parts_catch_nothing():
    found = Chain(np.array([1.0, 0.0]), np.eye(2), 1).of_many(2.5)
    assert found.captured.tolist() == [1.0, 0.0]


def test_no_two_parts_lie_in_one_place_nor_does_one_lie_in_the_plate(asked):
    tray = Pouring(asked, 9, 3, 3, 1)._shaken(0, True)
    members = [tray.crowd.members[number] for number in tray.lies]
    assert len(members) > 3
    for one, two in combinations([member.world() for member in members], 2):
        assert depth_of_overlap(one, two) < 5e-3 * asked.plate.size
    sizes = asked.tray
    for number, (depression, _) in tray.lies.items():
        corners = tray.crowd.members[number].world()
        x, y = min(corners, key=lambda corner: corner[1])
        assert y < 0.0
        assert abs(x - tray.middle(depression)) < 0.5 * sizes.depression_width + 1e-2
        assert y > -sizes.depression_depth - 1e-2
    assert set(tray.lies) == {each.number for each in tray.crowd.members if each.mode != "out"}


def test_parts_that_pass_through_each_other_lie_alone(asked):
    tray = Pouring(asked, 12, 3, 3, 1)._shaken(0, False)
    taken = [depression for depression, _ in tray.lies.values()]
    assert len(taken) == len(set(taken)) > 0
    assert not tray.crowd.overlapped


def test_a_depression_is_right_covered_or_wrong(asked):
    tray = _Strewn(Pouring(asked, 1, 5, 1, 0), True)
    right, wrong = asked.right, asked.right - 1
    tray.lies = {0: (0, right), 1: (1, right), 2: (1, wrong), 3: (2, wrong), 4: (3, wrong), 5: (3, wrong)}
    assert tray.states() == [1, 1, 2]  # the last one is empty


@pytest.mark.parametrize("depressions", [1, 3])
def test_parts_that_come_by_begin_above_what_is_in_the_way_and_no_higher(asked, depressions):
    """Three over one depression stand one above the other; over one each, at the height at which they come."""
    tray = _Strewn(Pouring(asked, 3, depressions, 1, 0), True)
    came = [asked.arrival(random_of(2, k)) for k in range(3)]
    begun = []
    tray._settle = lambda: begun.extend(member.world() for member in tray.crowd.members[:3])
    tray.pour(0, [(pose._replace(x=0.0), motion) for pose, motion in came])
    heights = [[y for _, y in corners] for corners in begun]
    below = [0.5, *(max(ys) for ys in heights[:2])] if depressions == 1 else [0.5] * 3  # the agitation
    assert [min(ys) for ys in heights] == pytest.approx(below)


def test_intervals_are_the_wider_of_batches_and_depressions():
    counts = np.array([[0, 1, 9], [0, 8, 9], [0, 2, 10]])
    none = np.zeros_like(counts)
    found = TrayCrowd(10, 10, True, counts, none, none, np.ones(3, bool), 0, 1, 0.0, 0)
    share, ends = found.share(counts)
    assert share == pytest.approx([0.0, 11 / 30, 28 / 30])
    exact = binomtest(0, 30).proportion_ci(0.95, method="exact")
    assert ends[0] == pytest.approx([exact.low, exact.high])
    between = ttest_1samp(counts[:, 1] / 10, 0.0).confidence_interval(0.95)
    assert ends[1] == pytest.approx(np.clip([between.low, between.high], 0.0, 1.0))
    exact = binomtest(28, 30).proportion_ci(0.95, method="exact")
    assert ends[2, 0] == pytest.approx(exact.low)
    one = TrayCrowd(10, 10, True, counts[:1], none[:1], none[:1], np.ones(1, bool), 0, 1, 0.0, 0)
    exact = binomtest(9, 10).proportion_ci(0.95, method="exact")
    assert one.share(counts[:1])[1][2] == pytest.approx([exact.low, exact.high])


def counted(found):
    return [(*(each.tolist() for each in (c.right, c.covered, c.wrong)), c.moved) for c in found.crowds]


class Refuses(Executor):
    """Makes nothing."""

    def submit(self, function, /, *arguments):
        raise AssertionError(function)


def test_batches_are_the_same_whoever_makes_them_and_are_kept(tmp_path):
    how = {"parts": 3, "depressions": 2, "batches": 3, "seed": 6}
    here = ls.tray(with_tray(), **FEW, **how)
    assert [each.between for each in here.crowds] == [True, False]
    assert here.crowds[0].right.shape == (3, 5)
    assert here.crowds[0].met.any()
    assert not here.crowds[1].met.any()
    file = tmp_path / "batches.json"
    with ThreadPoolExecutor(2) as threads:
        spread = ls.tray(with_tray(), **FEW, **how, file=file, executor=threads)
    assert counted(spread) == counted(here)
    assert sorted(json.loads(file.read_text())["trials"]) == ["0", "1", "2"]
    # what is kept is not made again, and more batches go on from it
    pouring = Pouring(here.passes, 3, 2, 4, 6)
    again = ls.tray(with_tray(), **FEW, **{**how, "batches": 2}, file=file)
    assert counted(again) == [
        (right[:2], covered[:2], wrong[:2], each.moved)
        for (right, covered, wrong, _), each in zip(
            counted(here), crowds_of(pouring, [pouring.row(k) for k in range(2)]), strict=True
        )
    ]
    with pytest.raises(AnswerError, match="depressions differs"):
        ls.tray(with_tray(), **FEW, **{**how, "depressions": 1}, file=file)


def test_one_part_a_depression_has_the_chain_of_single_parts():
    found = ls.tray(with_tray(), **FEW, parts=2, batches=1)
    assert found.crowds[0].depressions == 2
    assert found.crowd_chain.right == pytest.approx(found.filled.right, abs=1e-15)
    assert found.filled.wrong[1] == pytest.approx(1.0 - found.counts.captured[[0, 3]].sum() / 60)
    record = found.to_json()["crowds"][0]
    assert record["right"]["value"][0] == 0.0
    assert len(record["wrong"]["interval"]) == 5


def test_a_film_shows_the_last_passes(asked):
    kept = Pouring(asked, 3, 2, 3, 4).film(1, last=2)
    assert np.all(np.diff(kept.times) >= 0.0)  # where parts are put on or taken out there are two frames
    shown = ~np.isnan(kept.poses[..., 0])
    assert shown.any()
    assert kept.poses[..., 0][shown].min() > -2 * asked.tray.pitch
    assert kept.poses[..., 0][shown].max() < 5 * asked.tray.pitch
    assert "thrown" in {word for _, _, word in kept.marks}


def test_what_cannot_be_is_refused():
    for asking, said in (
        ({"parts": 0}, "parts"),
        ({"parts": 2, "depressions": -1}, "depressions"),
        ({"parts": 2, "depressions": 0}, "depressions"),
        ({"depressions": 2}, "how many parts come by"),
        ({"file": "kept.json"}, "how many parts come by"),
        ({"parts": 2, "batches": 0}, "batches"),
    ):
        with pytest.raises(AnswerError, match=said):
            ls.tray(with_tray(), **FEW, **asking)


@pytest.mark.sweep
def test_parts_that_pass_through_each_other_agree_with_the_chain():
    many = {"parts": 40, "depressions": 20, "batches": 2}
    found = ls.tray(with_tray(), drops=600, kicks=250, passes=12, step=8e-3, **many)
    _, passing = found.crowds
    for after in (1, 3, 12):
        for counts, chain in (
            (passing.right, found.crowd_chain.interval),
            (passing.wrong, found.crowd_chain.wrong_interval),
        ):
            exact = binomtest(int(counts[:, after].sum()), 40).proportion_ci(0.999, method="exact")
            assert exact.low <= chain[after, 1]
            assert chain[after, 0] <= exact.high


@pytest.mark.sweep
def test_hundreds_of_parts_end(asked):
    row = Pouring(asked, 150, 50, 2, 0).row(0)
    for each in row.values():
        assert sum(each["states"][-1]) > 40
        assert each["moved"] >= 300
