"""A policy as the tables of a controller: compiled C, structured text read here, CSV; with real throws."""

import csv
import ctypes
import re
import shutil
import subprocess

import numpy as np
import pytest

import limitsets as ls
from limitsets.proofs.policies.policy import NONE
from tests.policies.test_feedback import with_throws

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no compiler of C is here")

STEPS = 10_000


@pytest.fixture(scope="module")
def synthesis():
    scene = with_throws(sensor={"beyond": "20 in"})
    answer = ls.feedback(scene, starts={2: (17.0, 18.0)}, cells=256)
    assert answer.solved
    return answer


@pytest.fixture(scope="module")
def compiled(synthesis, tmp_path_factory):
    folder = tmp_path_factory.mktemp("controller")
    (folder / "controller.h").write_text(synthesis.controller().c_header(), encoding="utf-8")
    lines = ['#include "controller.h"', "int begin(int answer) { return policy_begin(answer); }"]
    lines += ["int step(int state, int answer) { return policy_step(state, answer); }"]
    lines += [
        "int throw_of(int state) { return policy_throw[state]; }",
        "int silent(void) { return POLICY_NO_ANSWER; }",
    ]
    (folder / "machine.c").write_text("\n".join(lines), encoding="utf-8")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, "machine.c", "-o", "machine.so"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "machine.so"))


class Block:
    """The function block of structured text, its arrays read from the text and its statements as they stand."""

    def __init__(self, text: str) -> None:
        arrays = re.findall(r"(\w+) : ARRAY\[0\.\.(\d+)\] OF INT := \[(.*?)\];", text)
        self.arrays = {name: [int(word) for word in words.split(",")] for name, _, words in arrays}
        assert all(len(self.arrays[name]) == int(last) + 1 for name, last, _ in arrays)
        statements = text[text.index("Column := Answer;") :]
        self.columns = int(re.search(r"State \* (\d+) \+ Column", statements)[1])
        self.none = int(re.search(r"THEN Column := (\d+);", statements)[1])
        self.last = int(re.search(r"Answer > (\d+)\)", statements)[1])
        self.state = int(re.search(r"State : INT := (\d+);", text)[1])

    def call(self, answer: int, *, restart: bool = False) -> int:
        column = self.none if answer < 0 or answer > self.last else answer
        state = (
            self.arrays["First"][column]
            if restart
            else self.arrays["After"][self.state * self.columns + column]
        )
        self.state = state
        return self.arrays["Throws"][state]


def test_c_and_structured_text_do_what_the_policy_says_for_any_answers(synthesis, compiled):
    policy, rng = synthesis.found.policy, np.random.default_rng(3)
    block = Block(synthesis.controller().structured_text())
    silent, excluded, state, known = policy.states, policy.states + 1, None, None
    assert compiled.silent() == silent == block.state
    visited = set()
    for _ in range(STEPS):
        restart = known is None
        after = policy.first if restart else policy.after[known] if known < silent else None
        possible = [] if after is None else np.flatnonzero(after != NONE).tolist()
        answer = int(rng.choice(possible if possible and rng.random() < 0.9 else [0, 1, -1, 7]))
        if after is not None:
            known = silent if answer not in (0, 1) else int(after[answer])
            known = excluded if known == NONE else known
        throw = NONE if known >= silent else int(policy.throw[known])
        state = compiled.begin(answer) if restart else compiled.step(state, answer)
        assert (state, compiled.throw_of(state)) == (known, throw)
        assert block.call(answer, restart=restart) == throw
        assert block.state == known
        visited.add(known)
        if known >= silent and rng.random() < 0.5:
            known = None
    assert visited == set(range(policy.states + 2))


def test_the_compiled_policy_brings_parts_to_the_goal(synthesis, compiled):
    """10 000 throws of the map itself; the sensor is exact here, and every part stops on side 2 beyond 20 in."""
    scene, rng = synthesis.scene, np.random.default_rng(8)
    maps = [scene.with_values({each.quantity: each.text}).map for each in scene.feedback.throws]
    made = parts = 0
    while made < STEPS:
        x, side = rng.uniform(17.0, 18.0), 2
        state = compiled.begin(0 if x > 20.0 else 1)
        for _ in range(synthesis.found.throws + 1):
            throw = compiled.throw_of(state)
            if throw == NONE:
                break
            path = ls.orbit(maps[throw], x, side, 1)
            x, side = float(path.x[1]), int(path.side[1])
            state, made = compiled.step(state, 0 if x > 20.0 else 1), made + 1
        assert (side, x >= 20.0, state < synthesis.found.policy.states) == (2, True, True)
        parts += 1
    assert parts > 1000


def test_the_table_has_a_next_state_for_whatever_comes(synthesis):
    controller = synthesis.controller()
    rows = list(csv.reader(controller.table().csv().splitlines()))
    assert rows[0] == ["state", "throw", "name", "next_yes", "next_no", "next_none"]
    assert rows[1][0] == "begin"
    numbers = np.array([[int(cell) for cell in row[3:]] for row in rows[1:]])
    assert (numbers >= 0).all()
    assert (numbers < controller.throw.size).all()
    assert [row[2] for row in rows[-2:]] == ["stop: no answer", "stop: answer excluded"]
    assert (numbers[1:-2, -1] == controller.no_answer).all()
    names = {controller.throws[k] for k in controller.throw if k >= 0}
    assert {row[2] for row in rows[2:-2]} == names | {"stop"}
    head = controller.c_header()
    assert "throw 1, fast: throw.kappa = 27.57073926 in" in head
    assert f"after {synthesis.found.throws} throws at most" in head


def test_names_that_a_compiler_would_not_take(synthesis):
    scene = with_throws(sensor={"beyond": "20 in"}).as_dict()
    scene["feedback"]["throws"][0]["name"], scene["feedback"]["throws"][1]["name"] = (
        "half-way 2",
        "half.way 2",
    )
    answer = ls.feedback(ls.load(scene), starts={2: (17.0, 18.0)}, cells=256)
    head = answer.controller().c_header()
    assert "POLICY_THROW_0_HALF_WAY_2 = 0," in head
    assert "POLICY_THROW_1_HALF_WAY_2 = 1," in head
