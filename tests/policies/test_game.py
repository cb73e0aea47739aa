"""The game of beliefs: by hand, against its definition, on random systems."""

import re
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.proofs.policies import broken, game_of, image_of, search
from limitsets.proofs.policies import game as beliefs
from limitsets.systems.cells import Grid
from tests.maps_of_tests import Contraction
from tests.policies.recursion import as_number, least

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
    assert [images["left"](cells(k)).tolist() for k in range(3)] == [
        cells(0).tolist(),
        cells(0, 1).tolist(),
        cells(1).tolist(),
    ]
    assert [images["right"](cells(k)).tolist() for k in range(3)] == [
        cells(1).tolist(),
        cells(1, 2).tolist(),
        cells(2).tolist(),
    ]


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

    def forged(**parts):
        return type(good)(**{**vars(good), **parts})

    no = int(good.first[1])
    smaller, throw, left, first = (
        good.belief.copy(),
        good.throw.copy(),
        good.left.copy(),
        good.first.copy(),
    )
    smaller[no, 0], throw[no], left[no], first[1] = False, -1, 1, first[0]
    assert "begin" in broken(forged(belief=smaller), game, starts)
    assert "stops off" in broken(forged(throw=throw), game, starts)
    assert "does not fall" in broken(forged(left=left), game, starts)
    assert "begin" in broken(forged(first=first), game, starts)
    lost = good.after.copy()
    lost[no] = -1
    assert "does not hold" in broken(forged(after=lost), game, starts)


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
    numbers = [
        [None if leaves[k][cell] else as_number(relation[k][cell]) for cell in range(target.size)]
        for k in (0, 1)
    ]
    heard = [as_number(mask) for mask in (answers or {"": np.ones(target.size, dtype=bool)}).values()]
    plain = least(
        numbers, heard, as_number(target), None if lost is None else as_number(lost), as_number(starts), depth
    )
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


@pytest.mark.sweep
def test_many_random_systems_against_the_definition():
    assert {None, 0, 1, 2, 3, 4} <= set(compare(range(1000, 4000)))


def test_wrong_calls(images):
    with pytest.raises(AnswerError, match="the throws to choose from"):
        game_of({}, None, cells(1))
    with pytest.raises(AnswerError, match="without an answer"):
        game_of(images, {"yes": cells(2), "no": cells(0)}, cells(1))
    with pytest.raises(AnswerError, match="the number of cells"):
        game_of(images, None, np.ones(40_000, dtype=bool))


def test_the_example_of_the_page(capsys):
    """docs/feedback.md: another map, which needs the bit."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "feedback.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.S)
    names = {}
    exec(code, names)  # noqa: S102 - the page's own example
    assert capsys.readouterr().out == "solved 10\n"
    blind = search(game_of(names["images"], None, names["target"]), names["starts"], 12)
    assert blind.verdict == "not-solved"
    assert (
        broken(
            names["found"].policy,
            game_of(names["images"], names["answers"], names["target"]),
            names["starts"],
        )
        == ""
    )
