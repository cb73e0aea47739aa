"""Whatever is read is a scene or one SceneError."""

import copy
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from limitsets.base.errors import SceneError
from limitsets.feeder.scene import dump, load

DESIGNED = load("paper-designed").as_dict()
UNITS = st.sampled_from(["in", "cm", "m", "deg", "rad", "deg/s", "%", "kg", "1/s", ""])
ODD = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=4)
    | st.builds("{} {}".format, st.floats() | st.integers(-40, 40), UNITS),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6) | st.integers(), inner, max_size=3)
    ),
    max_leaves=4,
)


def places(node: Any) -> list[tuple[Any, Any]]:
    """List every place of a structure that holds something, as its holder and its key."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [place for key, value in items for place in [(node, key), *places(value)]]


@settings(max_examples=150)
@given(st.data())
def test_spoilt_structures(data: st.DataObject) -> None:
    table = copy.deepcopy(DESIGNED)
    for _ in range(data.draw(st.integers(1, 3))):
        found = places(table)
        holder, key = found[data.draw(st.integers(0, len(found) - 1))]
        if data.draw(st.booleans()):
            holder[key] = data.draw(ODD)
        else:
            del holder[key]
        if not table:
            break
    try:
        scene = load(table)
    except SceneError:
        return
    assert load(dump(scene)) == scene


@given(st.dictionaries(st.text(max_size=6), ODD, max_size=4))
def test_random_structures(table: dict[str, Any]) -> None:
    try:
        load(table)
    except SceneError:
        return
    raise AssertionError(table)


TEXT = dump(load("paper-designed"))


@settings(max_examples=150)
@given(st.integers(0, len(TEXT)), st.integers(0, 12), st.text(max_size=12))
def test_spoilt_text(place: int, length: int, other: str) -> None:
    try:
        scene = load(TEXT[:place] + other + TEXT[place + length :] + "\n")
    except SceneError:
        return
    assert load(dump(scene)) == scene


LENGTHS = st.builds("{:.6f} {}".format, st.floats(4.0, 4.6), st.just("in")) | st.builds(
    "{:.4e} {}".format, st.floats(10.2, 11.6), st.just("cm")
)


@given(
    st.lists(LENGTHS, min_size=3, max_size=3),
    st.floats(0.4, 0.6),
    st.floats(-2, 2),
    st.sampled_from(["exact", "small-angle", "small-angle-2"]),
    st.dictionaries(st.sampled_from(["friction", "restitution"]), st.floats(0, 1) | st.integers(0, 1)),
    st.text(st.characters(categories=["L", "N"]), min_size=1, max_size=20),
)
def test_round_trip(
    sides: list[str], along: float, height: float, flight: str, world: dict[str, float], name: str
) -> None:
    table = {
        "name": name,
        "part": {
            "sides": sides,
            "mass": {
                "center": {"side": 0, "along": f"{along * 4!r} in", "above": "0.9 in"},
                "radius_of_gyration": "3 cm",
            },
        },
        "arm": {"surface_height": f"{height:.8f} in", "length": "2.5 ft"},
        "throw": {"kappa": "30 in"},
        "model": {"flight": flight},
        "world": world,
    }
    scene = load(table)
    again = load(dump(scene))
    assert again == scene
    assert again.as_dict() == table
    assert (again.sides.a == scene.sides.a).all()
    assert (again.sides.corner == scene.sides.corner).all()
