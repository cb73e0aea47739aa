"""Feedback: the game on cells, and policies from it."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.feeder.scene.surroundings import BeyondSensor, SideSensor
from limitsets.proofs.policies import broken, game as beliefs, game_of, image_of, places, search
from limitsets.proofs.policies.game import cells_of
from limitsets.proofs.policies.simulation import not_within, simulate
from limitsets.systems.cells import Grid
from tests.maps_of_tests import Contraction
from tests.policies.recursion import as_number, least

# ----------------------------------------------------------------
# `ls.feedback` on scenes: against the definition on coarse cells, against throws, and what it refuses.


def with_throws(name="paper-initial", sensor=None, fast="27.57073926 in"):
    """A built-in scene with its own throw and one at 110 % of its speed: kappa over 1.21."""
    tree = ls.load(name).as_dict()
    tree["feedback"] = {"throws": [{"name": "own", **tree["throw"]}, {"name": "fast", "kappa": fast}]}
    if sensor is not None:
        tree["feedback"]["sensor"] = sensor
    return ls.load(tree)


def by_definition(image, answers, target, lost, starts, depth):
    """Fewest throws, by recursion on whole numbers; `image` of a throw and a cell."""
    numbers = [[image(k, cell) for cell in range(target.size)] for k in (0, 1)]
    heard = [as_number(mask) for mask in answers.values()]
    losing = None if lost is None else as_number(lost)
    return least(numbers, heard, as_number(target), losing, as_number(starts), depth)


@pytest.fixture(scope="module")
def scene():
    return with_throws(sensor={"beyond": "20 in"})


@pytest.mark.parametrize(
    ("mode", "starts", "sensor"),
    [
        ("stop", {2: (17.0, 18.0)}, None),
        ("stop", {1: (19.0, 19.9)}, SideSensor(2)),
        ("stop", None, None),
        ("stop", {2: (16.3, 21.0)}, BeyondSensor(18.0, 0.2)),
        ("catch", {2: (16.3, 19.0)}, None),
        ("catch", {0: (13.5, 15.0)}, SideSensor(0)),
        ("catch", {0: (18.0, 19.0)}, "none"),
    ],
)
def test_coarse_cells_against_the_definition(scene, mode, starts, sensor):
    """13 cells a side, the borders at places that matter added; depth 6."""
    found = ls.feedback(scene, sensor, mode=mode, starts=starts, throws=6, cells=13)
    game = found.game
    plain = by_definition(
        lambda k, cell: None if game.leaves[k, cell] else sum(1 << int(c) for c in cells_of(game.images[k, cell])),
        game.answers, game.target, game.lost, found.starts.mask, 6,
    )  # fmt: skip
    assert found.found.verdict == ("not-solved" if plain is None else "solved")
    assert plain is None or found.found.throws == plain


@pytest.fixture(scope="module")
def known(scene):
    """From the limit set of the part's own throw to side 2 beyond 20 in, asked whether it is beyond 20 in."""
    return ls.feedback(scene, cells=512)


def test_the_initial_part_is_brought_to_its_goal_with_one_bit(scene, known):
    """Its goal fails without a sensor: thrown by itself the part lies on every side beyond 20 in."""
    assert max(hi for side in (0, 1) for _, hi in known.starts.extents()[side]) > 20.5
    assert known.solved
    assert broken(known.found.policy, known.game, known.starts.mask) == ""
    blind = ls.feedback(scene, "none", cells=512)
    assert (blind.found.verdict, blind.found.policy) == ("not-solved", None)


def test_the_part_is_caught_on_its_side_and_never_on_another(scene):
    found = ls.feedback(scene, SideSensor(2), mode="catch", cells=512)
    assert found.solved
    assert broken(found.found.policy, found.game, found.starts.mask) == ""
    thrown = simulate(found, 10_000, seed=1)
    assert (thrown.reached, thrown.failures, int(thrown.throws.sum())) == (10_000, {}, 10_000)


@pytest.mark.parametrize(
    ("noise", "error"),
    [({}, 0.0), ({"throw.speed": "0.1 %"}, 0.0), ({}, 0.05), ({"landing.x": "0.005 in"}, 0.0)],
)
def test_a_policy_that_is_thrown_never_fails(scene, noise, error):
    """Random starts, and noise and errors of the sensor anywhere within their bounds."""
    found = ls.feedback(scene, BeyondSensor(20.0, error), noise=noise, cells=1024, starts={2: (16.5, 17.5)})
    assert found.solved
    thrown = simulate(found, 10_000, seed=2)
    assert (thrown.reached, thrown.failures) == (10_000, {})
    assert 0 < thrown.mean <= found.found.throws


def test_a_forged_policy_fails_when_it_is_thrown(known):
    """Stopping at once, wherever the part is; and a throw too many."""
    policy = known.found.policy
    throw = policy.throw.copy()
    throw[policy.first[1]] = -1

    def thrown_by(**parts):
        forged = replace(known, found=replace(known.found, policy=replace(policy, **parts)))
        return simulate(forged, 1000).failures

    assert thrown_by(throw=throw).keys() == {"stopped elsewhere"}
    after = policy.after.copy()
    after[policy.first[1]] = policy.first[1]
    assert thrown_by(after=after)


def test_the_place_of_the_sensor_matters(scene):
    found = places(scene, [10.0, 18.0, 20.0], cells=512)
    assert [each.sensor.x for each in found] == [10.0, 18.0, 20.0]
    assert [each.solved for each in found] == [False, True, True]


def test_more_noise_than_a_policy_can_bear(scene):
    found = ls.feedback(scene, noise={"throw.speed": "3 %"}, cells=512)
    assert found.found.verdict == "not-solved"
    assert found.to_json()["policy"] is None


def test_time_and_memory_end_a_search(scene):
    side = SideSensor(2)
    found = ls.feedback(scene, side, cells=512, beliefs=500)
    assert (found.found.verdict, found.found.policy) == ("not-decided", None)
    assert "500 beliefs" in found.found.reason
    assert 0 <= found.found.throws < 30
    found = ls.feedback(scene, side, cells=512, seconds=0.0)
    assert (found.found.verdict, found.found.reason) == ("not-decided", "the time is used up")


def test_cells_hold_the_images_of_their_points(scene):
    """Random states and throws: where they come to rest is in the image of their cell."""
    found = ls.feedback(scene, cells=128, starts={2: (17.0, 18.0)}, throws=1)
    random = np.random.default_rng(0)
    for throw, box in enumerate(found.throws.values()):
        for side in range(3):
            x = random.uniform(12.0, 27.9, 500)
            landed = ls.maps.images(box.lo, x, side)
            begin = found.grid.index(x, side)
            for k in np.flatnonzero(landed.code >= 0):
                end = found.grid.index([landed.x[k]], int(landed.side[k]))[0]
                held = cells_of(found.game.images[throw, begin[k]])
                assert found.game.leaves[throw, begin[k]] or end in held


def test_a_certificate_of_a_scene_with_feedback_is_about_its_own_throw(scene, tmp_path):
    pytest.importorskip("flint", reason="the checker needs python-flint")
    proof = ls.certify(scene, ["invariant", "end-points"])
    assert proof.proved
    proof.save(tmp_path / "own.proof.zip")
    assert ls.recheck(tmp_path / "own.proof.zip").verdict == "proved"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mode": "hold"}, "the mode is 'hold'"),
        ({"sensor": "some"}, "the sensor is 'some'"),
        ({"goal": (30.0, 2)}, "the goal is"),
        ({"goal": (20.0, 3)}, "the goal is"),
        ({"starts": {2: (1.0, 18.0)}}, "the starts is"),
        ({"starts": {5: (17.0, 18.0)}}, "the starts is"),
        ({"starts": {1: (21.0, 22.0)}, "mode": "catch"}, "the starts is"),
        ({"noise": {"arm.length": "1 %"}}, "the noise is"),
    ],
)
def test_wrong_calls(scene, options, words):
    with pytest.raises(AnswerError, match=re.escape(words)):
        ls.feedback(scene, cells=64, **options)


def test_scenes_without_what_it_needs():
    with pytest.raises(AnswerError, match="the throws to choose from"):
        ls.feedback("paper-initial")
    with pytest.raises(AnswerError, match="the sensor"):
        ls.feedback(with_throws())
    tree = with_throws().as_dict()
    tree["goal"] = {"attracts_all": True}
    with pytest.raises(AnswerError, match="the goal is 'attracts_all'"):
        ls.feedback(tree_scene := ls.load(tree), "none", cells=64)
    assert ls.feedback(tree_scene, "none", goal=(20.0, 2), cells=64, throws=1).goal == (20.0, 2)


def test_a_side_without_a_throw_that_stays_is_told_apart():
    """Small cases with answers from the map itself: one jog from 19.5 on side 2 lands beyond 20, and no flip does."""
    scene = with_throws(sensor={"side": 2})
    after = [float(ls.orbit(scene.map, x, 2, 1).x[1]) for x in (19.4, 19.5)]
    assert min(after) > 20.0
    found = ls.feedback(scene, starts={2: (19.4, 19.5)}, cells=128)
    assert (found.found.verdict, found.found.throws) == ("solved", 1)
    assert found.found.policy.throws[found.found.policy.throw[found.found.policy.first[0]]] == "own"
    found = ls.feedback(scene, "none", starts={2: (19.4, 19.5)}, cells=128)  # enough whatever a sensor says
    assert (found.found.verdict, found.found.throws, found.question) == ("solved", 1, "nothing is asked")
    assert simulate(found, 500).throws.tolist() == [0, 500]
    assert found.to_json()["sensor"] is None


def test_not_within_by_enclosed_starts():
    """Starts from which one throw ends below x are not served by one, and by two where two jogs get there."""
    scene = with_throws(sensor={"side": 2})
    path = ls.orbit(scene.map, 16.5, 2, 4).x
    needed = int(np.argmax(path >= 20.0))
    assert needed > 1
    found = ls.feedback(scene, starts={2: (16.4, 16.6)}, cells=128, throws=1)
    assert found.found.verdict == "not-solved"
    assert not_within(found, [(16.5, 2)], needed - 1).throws >= 1
    shown = not_within(found, [(16.5, 2)], needed)
    assert (shown.throws < needed, shown.decided) == (True, False)
    with pytest.raises(AnswerError, match="one of the starts"):
        not_within(found, [(19.0, 2)])


# ----------------------------------------------------------------
# The game of beliefs: by hand, against its definition, on random systems.


POSITIONS = Grid(ls.grid([(0.0, 3.0)], cells=3).domain, ls.grid([(0.0, 3.0)], cells=3).edges)
# left: [0, 1] to [0.1, 0.6], [1, 2] to [0.6, 1.1], [2, 3] to [1.1, 1.6]
# right: to [1.45, 1.95], [1.95, 2.45], [2.45, 2.95]
LEFT, RIGHT = Contraction(0.5, 0.1), Contraction(0.5, 1.45)


def cells(*numbers, n=3):
    mask = np.zeros(n, dtype=bool)
    mask[list(numbers)] = True
    return mask


@pytest.fixture(scope="module")
def images():
    return {
        name: image_of(ls.transitions(params, POSITIONS, "boxes"))
        for name, params in (("left", LEFT), ("right", RIGHT))
    }


def test_the_images_are_those_on_paper(images):
    for name, wanted in (("left", ((0,), (0, 1), (1,))), ("right", ((1,), (1, 2), (2,)))):
        for k, numbers in enumerate(wanted):
            assert images[name](cells(k)).tolist() == cells(*numbers).tolist()


def test_three_positions_and_two_throws_solved_by_hand(images):
    """To the middle from anywhere, asked whether the part is in the last position.

    Yes: it is in 2, and left leads to the middle.  No: it is in 0 or 1; left leads there again, so right, to 1 or 2; if
    the answer then is no it is in the middle, if yes, left once more.  Two throws, and one is too few.
    """
    game = game_of(images, {"yes": cells(2), "no": cells(0, 1)}, cells(1))
    found = search(game, cells(0, 1, 2), 5)
    assert (found.verdict, found.throws) == ("solved", 2)
    policy = found.policy
    yes, no = (policy.first[list(policy.answers).index(word)] for word in ("yes", "no"))
    names = [*policy.throws, "stop"]
    assert names[policy.throw[yes]] == "left"
    assert names[policy.throw[no]] == "right"
    after = dict(zip(policy.answers, policy.after[no].tolist(), strict=True))
    assert names[policy.throw[after["yes"]]] == "left"
    assert names[policy.throw[after["no"]]] == "stop"
    assert policy.belief[no].tolist() == cells(0, 1).tolist()
    assert policy.left[[yes, no]].tolist() == [1, 2]
    assert broken(policy, game, cells(0, 1, 2)) == ""


def test_what_the_bit_buys(images):
    """Without it the belief is {0, 1} or {1, 2} from the first throw on, whatever is thrown."""
    game = game_of(images, None, cells(1))
    found = search(game, cells(0, 1, 2), 9)
    assert (found.verdict, found.throws) == ("not-solved", 9)
    last = search(game, cells(2), 9)
    assert last.throws == 1
    assert last.policy.table().csv() == "state,begin,throw,next_any,left\n0,any,left,1,1\n1,,stop,,0\n"
    assert last.policy.to_json()["first"] == {"any": 0}


def test_caught_on_entry_by_hand(images):
    """The middle catches, the last position loses: from 0 right is the only way, one throw; left stays for ever."""
    game = game_of(images, {"yes": cells(2), "no": cells(0, 1)}, cells(1), cells(2))
    found = search(game, cells(0, 1), 5)  # a part in the middle is caught already
    assert (found.verdict, found.throws) == ("solved", 1)
    assert [found.policy.throws[k] for k in found.policy.throw] == ["right"]
    assert (found.policy.after == -1).all()
    game = game_of({"left": images["left"]}, None, cells(1), cells(2))
    assert search(game, cells(0), 9).verdict == "not-solved"


def test_forged_policies_are_found_out(images):
    """Each part of what a policy promises, broken once."""
    game = game_of(images, {"yes": cells(2), "no": cells(0, 1)}, cells(1))
    starts = cells(0, 1, 2)
    good = search(game, starts, 5).policy

    no = int(good.first[1])
    for name, at, value, said in (
        ("belief", (no, 0), False, "begin"),
        ("throw", no, -1, "stops off"),
        ("left", no, 1, "does not fall"),
        ("first", 1, good.first[0], "begin"),
        ("after", no, -1, "does not hold"),
    ):
        array = getattr(good, name).copy()
        array[at] = value
        assert said in broken(replace(good, **{name: array}), game, starts)


def random_game(random, n, catching):
    """Images of one to three cells, some that leave; answers that overlap; a target, and cells that lose."""
    relation = random.random((2, n, n)) < random.choice([0.0, 0.1, 0.4]) / n
    for throw, cell in np.ndindex(2, n):
        relation[throw, cell, random.integers(n)] = True
    leaves = random.random((2, n)) < 0.02
    yes = random.random(n) < 0.5
    answers = {"yes": yes, "no": ~yes | (random.random(n) < 0.1)}
    target = random.random(n) < random.choice([0.1, 0.3])
    lost = (random.random(n) < 0.05) & ~target if catching else None
    return relation, leaves, answers, target, lost, random.random(n) < random.choice([0.03, 0.1])


def both_ways(relation, leaves, answers, target, lost, starts, depth):
    """What the search finds, and what the recursion does."""

    def image(throw):
        def of(mask):
            return None if leaves[throw][mask].any() else relation[throw][mask].any(axis=0)

        return of

    game = game_of({"a": image(0), "b": image(1)}, answers, target, lost)
    plain = by_definition(
        lambda k, cell: None if leaves[k][cell] else as_number(relation[k][cell]),
        answers or {"": np.ones(target.size, dtype=bool)}, target, lost, starts, depth,
    )  # fmt: skip
    return game, search(game, starts, depth), plain


def compare(seeds):
    ends = []
    for seed in seeds:
        random = np.random.default_rng(seed)
        relation, leaves, answers, target, lost, starts = random_game(random, 40, bool(seed % 2))
        asked = None if seed % 5 == 0 else answers
        game, found, plain = both_ways(relation, leaves, asked, target, lost, starts, 6)
        ends.append(plain)
        assert found.verdict == ("not-solved" if plain is None else "solved"), seed
        if plain is not None:
            assert found.throws == plain, seed
            assert broken(found.policy, game, starts) == "", seed
            assert int(found.policy.left.max(initial=0)) <= plain, seed
    return ends


def test_random_systems_against_the_definition():
    ends = compare(range(200))
    assert {None, 0, 1, 2, 3, 4} <= set(ends)  # the examples are of all kinds


def test_what_is_not_compared_changes_no_answer(monkeypatch):
    """Only the last of the beliefs that were not solved are looked through."""
    monkeypatch.setattr(beliefs, "COMPARED", 1)
    compare(range(200, 300))


@pytest.mark.repeats
def test_many_random_systems_against_the_definition():
    assert {None, 0, 1, 2, 3, 4} <= set(compare(range(1000, 4000)))


def test_wrong_calls_of_game(images):
    with pytest.raises(AnswerError, match="the throws to choose from"):
        game_of({}, None, cells(1))
    with pytest.raises(AnswerError, match="without an answer"):
        game_of(images, {"yes": cells(2), "no": cells(0)}, cells(1))
    with pytest.raises(AnswerError, match="the number of cells"):
        game_of(images, None, np.ones(40_000, dtype=bool))


def test_the_example_of_the_page(capsys):
    """docs/feedback.md: another map, which needs the bit."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "feedback.md").read_text(encoding="utf-8")
    (code,) = [each for each in re.findall(r"```python\n(.*?)```", page, re.S) if "game_of" in each]
    names = {}
    exec(code, names)  # noqa: S102 - the page's own example
    assert capsys.readouterr().out == "solved 10\n"
    blind = search(game_of(names["images"], None, names["target"]), names["starts"], 12)
    assert blind.verdict == "not-solved"
    game = game_of(names["images"], names["answers"], names["target"])
    assert broken(names["found"].policy, game, names["starts"]) == ""
