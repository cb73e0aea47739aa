"""A policy for a controller: whole numbers in tables, as CSV, as a header of C and as structured text of IEC 61131-3.

Behind the states of the policy stand two more, in which nothing is thrown: the sensor gave no answer, or an answer that
the policy excludes.  So every state has a next one after whatever comes, and a program needs no other case.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.base import Table
from limitsets.base.arrays import Ints
from limitsets.proofs.policies.policy import NONE, Policy


@dataclass(frozen=True, eq=False)
class Controller:
    """The tables of a policy, complete.

    Attributes
    ----------
    about : tuple of str
        What it is of, a line each.
    answers : tuple of str
        What the sensor may say, by number; "any" without a sensor.
    throws : tuple of str
        Names of the throws, by number.
    first : ndarray of int, shape (answers + 1,)
        The state to begin in, by the answer before the first throw; the last entry is for no answer.
    throw : ndarray of int, shape (states + 2,)
        The throw of each state, -1 for none.
    after : ndarray of int, shape (states + 2, answers + 1)
        The next state by the answer, the last column for no answer.
    """

    about: tuple[str, ...]
    answers: tuple[str, ...]
    throws: tuple[str, ...]
    first: Ints
    throw: Ints
    after: Ints

    @property
    def no_answer(self) -> int:
        """The state after no answer."""
        return int(self.throw.size) - 2

    @property
    def excluded(self) -> int:
        """The state after an answer that cannot come, or, of a policy that catches, that means the part is caught."""
        return int(self.throw.size) - 1

    def table(self) -> Table:
        """Give the tables in one: a row for each state."""
        columns = ("state", "throw", "name", *(f"next_{word}" for word in self.answers), "next_none")
        rows = [
            (state, throw, self.throws[throw] if throw != NONE else self._stop(state), *after)
            for state, (throw, after) in enumerate(zip(self.throw.tolist(), self.after.tolist(), strict=True))
        ]
        begin = ("begin", None, None, *self.first.tolist())
        return Table(columns, [begin, *rows], "Controller")

    def _stop(self, state: int) -> str:
        return {self.no_answer: "stop: no answer", self.excluded: "stop: answer excluded"}.get(state, "stop")

    def c_header(self) -> str:
        """Write a header of C (C99): constant tables, and two functions that give the state and the next one.

        Any answer but the numbers of the enumeration counts as none.
        """
        answers, states = len(self.answers), self.throw.size
        names = [f"    POLICY_ANSWER_{k}_{_word(name)} = {k}," for k, name in enumerate(self.answers)]
        names += [f"    POLICY_THROW_{k}_{_word(name)} = {k}," for k, name in enumerate(self.throws)]
        bound = f"answer < 0 || answer > {answers - 1} ? {answers} : answer"
        lines = [
            *(f"/* {line.replace('*/', '* /')} */" for line in self.about),
            "#ifndef LIMITSETS_POLICY_H",
            "#define LIMITSETS_POLICY_H",
            "enum {",
            *names,
            "    POLICY_STOP = -1,",
            f"    POLICY_NO_ANSWER = {self.no_answer},",
            f"    POLICY_EXCLUDED = {self.excluded}",
            "};",
            f"static const short policy_first[{answers + 1}] = {_braces(self.first)};",
            f"static const short policy_throw[{states}] = {_braces(self.throw)};",
            f"static const short policy_next[{states}][{answers + 1}] = {{",
            *(f"    {_braces(row)}," for row in self.after),
            "};",
            f"static int policy_column(int answer) {{ return {bound}; }}",
            "/* The state to begin in, after the answer before the first throw. */",
            "static int policy_begin(int answer) { return policy_first[policy_column(answer)]; }",
            "/* The state after the throw of a state, and the answer to it. */",
            "static int policy_step(int state, int answer) { return policy_next[state][policy_column(answer)]; }",
            "#endif",
        ]
        return "\n".join(lines) + "\n"

    def structured_text(self) -> str:
        """Write a function block of structured text (IEC 61131-3): each call takes an answer and gives a throw."""
        answers, states = len(self.answers), int(self.throw.size)
        words = ", ".join(f"{k}: {name}" for k, name in enumerate(self.answers))
        throws = ", ".join(f"{k}: {name}" for k, name in enumerate(self.throws))
        flat = ", ".join(map(str, self.after.ravel().tolist()))
        lines = [
            *(f"(* {line.replace('*)', '* )')} *)" for line in self.about),
            "FUNCTION_BLOCK LimitsetsPolicy",
            "VAR_INPUT",
            "    Restart : BOOL; (* TRUE: the answer is the one before the first throw *)",
            f"    Answer : INT; (* {words}; any other number: no answer *)",
            "END_VAR",
            "VAR_OUTPUT",
            f"    State : INT := {self.no_answer}; (* {self.no_answer}: no answer, {self.excluded}: answer excluded *)",
            f"    Throw : INT := -1; (* {throws}; -1: stop *)",
            "END_VAR",
            "VAR",
            "    Column : INT;",
            f"    First : ARRAY[0..{answers}] OF INT := [{', '.join(map(str, self.first.tolist()))}];",
            f"    Throws : ARRAY[0..{states - 1}] OF INT := [{', '.join(map(str, self.throw.tolist()))}];",
            f"    After : ARRAY[0..{states * (answers + 1) - 1}] OF INT := [{flat}];",
            "END_VAR",
            "Column := Answer;",
            f"IF (Answer < 0) OR (Answer > {answers - 1}) THEN Column := {answers}; END_IF;",
            f"IF Restart THEN State := First[Column]; ELSE State := After[State * {answers + 1} + Column]; END_IF;",
            "Throw := Throws[State];",
            "END_FUNCTION_BLOCK",
        ]
        return "\n".join(lines) + "\n"

    def files(self) -> dict[str, str]:
        """Give the text of each form by the name of its file."""
        texts = self.table().csv(), self.c_header(), self.structured_text()
        return dict(zip(("controller.csv", "controller.h", "controller.st"), texts, strict=True))


def controller_of(policy: Policy, about: Sequence[str] = ()) -> Controller:
    """Complete the tables of a policy for a controller.

    Parameters
    ----------
    policy : Policy
        The answer of a search.
    about : sequence of str
        What it is of, for the head of the files.

    Returns
    -------
    Controller

    Examples
    --------
    >>> import numpy as np
    >>> none = np.zeros((2, 1), dtype=bool)
    >>> after, left = np.array([[1, -1], [-1, -1]]), np.array([1, 0])
    >>> policy = Policy(("yes", "no"), ("own",), np.array([1, 0]), none, np.array([0, -1]), after, left)
    >>> controller_of(policy).after.tolist()  # states 2 and 3: no answer, an answer excluded
    [[1, 3, 2], [3, 3, 2], [2, 2, 2], [3, 3, 3]]
    """
    count, answers = policy.states, len(policy.answers)
    no_answer, excluded = count, count + 1

    def complete(numbers: Any) -> Ints:
        shown = np.where(numbers == NONE, excluded, numbers)
        return np.concatenate([shown, np.full((*shown.shape[:-1], 1), no_answer)], axis=-1)

    after = np.concatenate(
        [complete(policy.after), np.full((1, answers + 1), no_answer), np.full((1, answers + 1), excluded)]
    )
    throw = np.concatenate([policy.throw, [NONE, NONE]])
    words = tuple(word or "any" for word in policy.answers)
    return Controller(tuple(about), words, policy.throws, complete(policy.first), throw, after)


def _word(name: str) -> str:
    """Make an identifier of a name."""
    return re.sub(r"\W", "_", name, flags=re.ASCII).upper()


def _braces(numbers: Any) -> str:
    return f"{{{', '.join(map(str, np.asarray(numbers).tolist()))}}}"
