"""A policy for a sensor of one bit: how its file is read, and what it says in words.

docs/certificates.md, "Policies" and "Arrays of a policy".
"""

import re
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from .balls import Array
from .file import Cells, read_array
from .scene import Scene, read_scene
from .texts import LENGTHS, Quantity, hex_float, plain, quantity, read_side, require, rounded, rows, table

STOP = NO_STATE = -1  # no throw; no state: the answer cannot come, or the part is caught
MOST_STATES = 100_000
MOST_CHOICES = 16  # throws to choose from
MODES = ("stop", "catch")
IMAGES = (("jog", "<i4"), ("flip", "<i4"), ("phi", "<f8"))
NAME_OF_THROW = r"[^\x00-\x1f\x7f]{1,64}"


class Sensor(NamedTuple):
    """A question: about a side, or whether the part is beyond a place, told to within an error; both None: nothing."""

    side: int | None
    place: Quantity | None
    error: Quantity | None


class Choice(NamedTuple):
    """A throw to choose: its name, the quantity that is given, and the scene in which it is made."""

    name: str
    given: str
    scene: Scene


class Policy(NamedTuple):
    """The content of a file: read, and not yet believed."""

    raw: dict[str, Any]
    noise: object
    choices: list[Choice]
    sensor: Sensor
    mode: str
    x: Quantity
    side: int
    starts: list[tuple[int, float, float]]
    within: int
    first: list[int]  # by answer the state to begin in
    cells: list[Cells]  # of each throw: the same borders, other images
    throw: Array
    left: Array
    after: Array
    belief: Array  # state, first and last cell

    def at(self, where: Quantity) -> Fraction:
        """Give a place in the unit of the arm's length."""
        return where.lo / LENGTHS[self.choices[0].scene.unit]


def holds_policy(header: dict[str, Any]) -> bool:
    """Whether a file claims a policy."""
    claims = header.get("claims")
    return isinstance(claims, list) and any(
        isinstance(c, dict) and c.get("claim") == "policy" for c in claims
    )


def read_policy(header: dict[str, Any], entries: dict[str, memoryview]) -> Policy:
    """Read a file; raises BadFileError."""
    (claim,) = rows(header["claims"], "claims of a policy", 1, 1)
    table(claim, "a claim", "claim section")
    section = table(claim["section"], "section of policy", "scene mode goal starts within first")
    alone = header["boxes"] == [] and header["tolerance"] is None
    require(alone, "a policy has no boxes and no tolerance")
    raw, noise = section["scene"], header["noise"]
    require(isinstance(raw, dict) and "feedback" in raw, "the scene has no feedback")
    require("goal" not in raw, "the scene has a goal of its own")
    has = table(raw["feedback"], "feedback", "throws", "sensor")
    choices = [read_choice(each, raw, noise) for each in rows(has["throws"], "throws", 1, MOST_CHOICES)]
    require(len({each.name for each in choices}) == len(choices), "two throws have one name")
    n_sides = len(choices[0].scene.sides)
    sensor = read_sensor(has.get("sensor"), n_sides)
    goal = table(section["goal"], "goal of policy", "x side")
    x, side = one_length(goal["x"], "goal.x"), read_side(goal["side"], n_sides)
    mode = section["mode"]
    require(mode in MODES, "mode is neither stop nor catch")
    check_cavity(raw, mode, x)
    within = section["within"]
    require(type(within) is int and within >= 0, "within is not a number of throws")
    words = answers_of_sensor(sensor)
    begin = table(section["first"], "first", " ".join(words))
    first = [NO_STATE if begin[word] is None else begin[word] for word in words]
    require(all(type(k) is int for k in first), "first holds no number of a state")
    cells, own = read_arrays(header["arrays"], entries, len(choices), n_sides, len(words))
    starts = [read_start(row, n_sides) for row in rows(section["starts"], "starts", 1, MOST_STATES)]
    return Policy(raw, noise, choices, sensor, mode, x, side, starts, within, first, cells, *own)


def read_choice(value: object, raw: dict[str, Any], noise: object) -> Choice:
    """Read a throw: it stands in the place of the scene's own."""
    one = table(value, "a throw to choose", "name", "kappa speed")
    name = one["name"]
    require(isinstance(name, str) and re.fullmatch(NAME_OF_THROW, name) is not None, "a throw has no name")
    given = {key: text for key, text in one.items() if key != "name"}
    require(len(given) == 1, "a throw to choose: either kappa or speed")
    ((key, text),) = given.items()
    value = quantity(text, "length" if key == "kappa" else "speed", f"{plain(name)}.{key}")
    require(value.lo == value.hi, "a throw to choose is not one number")
    # no name reads like another throw of the list in which it is printed
    return Choice(
        re.sub("[:;=]", "?", plain(name)), f"{key} = {value}", read_scene({**raw, "throw": given}, noise)
    )


def read_sensor(value: object, n_sides: int) -> Sensor:
    """Read what is asked."""
    if value is None:
        return Sensor(None, None, None)
    asked = table(value, "sensor", "", "beyond error side")
    if "side" in asked:
        require(len(asked) == 1, "the sensor asks two questions, or a side has an error")
        return Sensor(read_side(asked["side"], n_sides), None, None)
    require("beyond" in asked, "the sensor asks nothing")
    place = one_length(asked["beyond"], "sensor.beyond")
    none = place._replace(lo=Fraction(0), hi=Fraction(0))
    error = one_length(asked["error"], "sensor.error") if "error" in asked else none
    require(error.lo >= 0, "the sensor's error is negative")
    return Sensor(None, place, error)


def answers_of_sensor(sensor: Sensor) -> list[str]:
    """Name the answers, in the order of the arrays."""
    return ["any"] if sensor.side is None and sensor.place is None else ["yes", "no"]


def one_length(value: object, where: str) -> Quantity:
    """Read a length that is no interval."""
    length = quantity(value, "length", where)
    require(length.lo == length.hi, f"{where} is not one number")
    return length


def check_cavity(raw: dict[str, Any], mode: str, x: Quantity) -> None:
    """Require that parts are caught where the scene has its cavity."""
    cavity = raw.get("cavity")
    if mode == "catch" and cavity is not None:
        require(isinstance(cavity, dict) and "position" in cavity, "the cavity has no position")
        at = one_length(cavity["position"], "cavity.position")
        require(at.lo == x.lo, "parts are caught elsewhere than where the cavity begins")


def read_start(value: object, n_sides: int) -> tuple[int, float, float]:
    """Read an interval of starts."""
    side, lo, hi = rows(value, "starts", 3, 3)
    ends = hex_float(lo, "starts"), hex_float(hi, "starts")
    require(ends[0] <= ends[1], "an interval of starts is empty")
    return read_side(side, n_sides), *ends


def read_arrays(
    said: object, entries: dict[str, memoryview], throws: int, n_sides: int, answers: int
) -> tuple[list[Cells], tuple[Array, Array, Array, Array]]:
    """Read the cells with the images under every throw, and the table."""
    require(isinstance(said, dict), "arrays is not an object")
    assert isinstance(said, dict)
    read = set[str]()

    def array(name: str, dtype: str, columns: int = 1) -> Array:
        require(f"{name}.npy" in entries, f"array {name} is missing")
        read.add(name)
        return read_array(entries[f"{name}.npy"], name, dtype, columns, said.get(name))

    edges = [array(f"edges.{i}", "<f8") for i in range(n_sides)]
    require(all(len(e) >= 2 and bool((np.diff(e) > 0).all()) for e in edges), "the borders do not ascend")
    n = sum(len(e) - 1 for e in edges)
    cells = []
    for k in range(throws):
        jog, flip, phi = (array(f"{k}.{name}", dtype, 2) for name, dtype in IMAGES)
        require(len(jog) == len(flip) == len(phi) == n, "the images do not fit the cells")
        nothing = np.zeros(n, dtype=np.int64)
        cells.append(
            Cells(edges, jog.astype(np.int64), flip.astype(np.int64), nothing, nothing, nothing, phi)
        )
    throw, left, after = array("throw", "<i4"), array("left", "<i4"), array("after", "<i4", answers)
    belief = array("belief", "<i4", 3)
    require(0 < len(throw) <= MOST_STATES, "there are no states, or too many")
    require(len(throw) == len(left) == len(after), "the table does not have one row for each state")
    named = read == set(said) and {f"{name}.npy" for name in read} == set(entries)
    require(named, "there are other arrays too")
    return cells, (throw, left, after.reshape(len(throw), answers), belief)


def policy_in_words(policy: Policy) -> list[str]:
    """Say what is claimed."""
    there = f"on side {policy.side} at x >= {policy.x}"
    ends = {
        "stop": f"is brought to lie {there}, and the controller, which stops then, knows it",
        "catch": f"comes to rest {there}, where it is caught, and nowhere before at x >= {policy.x} on another side",
    }[policy.mode]
    noisy = "for every sequence of throws, " if policy.noise is not None else ""
    starts = "; ".join(
        f"side {side}: [{rounded(lo, up=True)}, {rounded(hi, up=False)}]"
        for side, lo, hi in policy.starts[:12]
    )
    caught = f" (those at x < {policy.x}: the others are caught at once)" if policy.mode == "catch" else ""
    more = " ..." if len(policy.starts) > 12 else ""
    return [
        f"policy: {noisy}from every start named the part {ends}, after {policy.within} throws at most (an upper bound)",
        f"starts{caught}: {starts}{more}",
        "throws to choose from: " + "; ".join(f"{each.name}: {each.given}" for each in policy.choices),
        f"asked before the first throw and after each: {question_in_words(policy)}",
        f"states of the policy: {len(policy.throw)}",
    ]


def question_in_words(policy: Policy) -> str:
    """Say what the sensor is asked, and how well it answers."""
    sensor = policy.sensor
    if sensor.place is not None and sensor.error is not None:
        told = (
            f", where it is farther from there than {sensor.error}; nearer any answer"
            if sensor.error.lo
            else ""
        )
        return f"is the part beyond {sensor.place}?{told}"
    return "nothing" if sensor.side is None else f"does the part lie on side {sensor.side}?"
