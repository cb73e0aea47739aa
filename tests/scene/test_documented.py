"""docs/scene.md: its example loads, and its table has the keys that there are."""

import re
import tomllib
from pathlib import Path

import limitsets as ls
from limitsets.feeder.scene.quantities import NAMES
from limitsets.feeder.scene.schema import scene_table
from limitsets.feeder.thrower.effects import EFFECTS

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "scene.md").read_text(encoding="utf-8")


TABLES = (
    "part",
    "part.mass",
    "arm",
    "throw",
    "gravity",
    "model",
    "goal",
    "cavity",
    "tray",
    "world",
    "effects",
    "feedback",
)


def keys(model, path=""):
    """Every key of the schema by its whole name; what is written in one line counts as one key."""
    for name, field in model.model_fields.items():
        kinds = (field.annotation, *getattr(field.annotation, "__args__", ()))
        if f"{path}{name}" in TABLES:
            (inner,) = (kind for kind in kinds if hasattr(kind, "model_fields"))
            yield from keys(inner, f"{path}{name}.")
        else:
            yield f"{path}{name}"


def test_the_example_loads_and_has_a_margin_of_its_own():
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE, re.S)
    scene = ls.load(tomllib.loads(text))
    assert (scene.unit, scene.sides.a.size) == ("mm", 4)
    path = ls.orbit(scene.map, 300.0, 0, 1000)
    assert len(path.x) > 1000  # none of these throws leaves the arm


def documented():
    """The keys in the first column of the table: a word that begins with a point is in the table of the first one."""
    for line in PAGE.splitlines():
        names = re.findall(r"`([^`]+)`", line.split("|")[1]) if line.startswith("| `") else []
        for name in names:
            yield names[0].rpartition(".")[0] + name if name.startswith(".") else name.partition('."')[0]


def test_the_table_has_the_keys_that_there_are():
    assert sorted(documented()) == sorted(keys(scene_table(with_effects=True)))


def test_the_model_s_table_has_every_effect_and_the_facts_that_it_needs():
    page = (Path(__file__).resolve().parents[2] / "docs" / "model.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \|([^|]*)\|", page.split("## Effects", 1)[1], re.M)
    told = {name: tuple(re.findall(r"`(\w+)`", facts)) for name, facts in rows}
    assert told == {name: effect.needs for name, effect in EFFECTS.items()}


def test_every_quantity_is_named():
    for name in NAMES:
        last = name.rpartition(".")[2]
        assert f"`{name}`" in PAGE or (f"`.{last}`" in PAGE and name.startswith("part."))
