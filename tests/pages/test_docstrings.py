"""Public names: each says what it takes and gives, with shapes, what it raises, and has an example that runs.

The examples are run by pytest (``--doctest-modules``), those of figures by the page of the gallery as well.  The
kernels of `interval` on pairs of numbers are one sentence each: the room's docstring is their contract, `Interval` has
the examples.
"""

import inspect
import re
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path

import pytest

import limitsets

GALLERY = (Path(__file__).resolve().parents[2] / "docs" / "gallery.md").read_text(encoding="utf-8")
NAMESPACES = ("plot", "maps", "resilience", "engine")
INNER = {"cli", "files", "progress", "tables"}  # no public names


def names_of(module, short):
    """The public names of a module that are no modules themselves, with what they stand for."""
    things = ((name, getattr(module, name)) for name in module.__all__)
    return {f"{short}.{name}": thing for name, thing in things if not inspect.ismodule(thing)}


TOP = names_of(limitsets, "ls")
for space in NAMESPACES:
    TOP |= names_of(import_module(f"limitsets.{space}"), f"ls.{space}")
ROOMS = dict(TOP)
for room, place in limitsets._PUBLIC.items():
    if ":" not in place and room not in INNER and hasattr(import_module(f"limitsets.{place}"), "__all__"):
        ROOMS |= names_of(import_module(f"limitsets.{place}"), f"ls.{room}")
CLASSES = {name: thing for name, thing in ROOMS.items() if inspect.isclass(thing)}
FUNCTIONS = {name: thing for name, thing in TOP.items() if inspect.isfunction(inspect.unwrap(thing))}


# Made by a call: a string below the assignment says what they are.
MADE = {"ls.interval.intervals_between", "ls.jit.entries_of"}


def section(thing, title):
    """Lines of a section of a docstring, None where there is none."""
    text = inspect.getdoc(thing) or ""
    found = re.search(rf"^{title}\n-+\n(.*?)(?=^\w[\w ]*\n-+$|\Z)", text, re.M | re.S)
    return None if found is None else found[1].splitlines()


def entries(thing, *titles):
    """What sections describe, by name: what stands behind the colon."""
    lines = [
        line for title in titles for line in section(thing, title) or () if line and not line[0].isspace()
    ]
    named = (line.partition(" : ") for line in lines)
    return {name.strip().lstrip("*"): kind for names, _, kind in named for name in names.split(",")}


@pytest.mark.parametrize("name", sorted(ROOMS))
def test_every_name_and_method_says_what_it_is(name):
    thing = ROOMS[name]
    if name in MADE or not callable(thing):
        return  # a table or a number: what it is stands beside it
    assert inspect.getdoc(thing), name
    for method, value in vars(thing).items() if name in CLASSES else ():
        plain = getattr(value, "__func__", getattr(value, "fget", value))
        if not method.startswith("_") and inspect.isfunction(plain):
            assert inspect.getdoc(plain), f"{name}.{method}"


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_functions_describe_what_they_take_give_and_raise(name):
    thing = inspect.unwrap(FUNCTIONS[name])
    signature = inspect.signature(thing)
    assert set(entries(thing, "Parameters", "Other Parameters")) == set(signature.parameters)
    given = section(thing, "Returns") or section(thing, "Yields")
    assert given is not None or signature.return_annotation in (None, "None")
    raises = re.search(r"^    +raise [A-Z]", inspect.getsource(thing), re.M)
    assert section(thing, "Raises") or not raises


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_functions_have_an_example(name):
    figure = re.fullmatch(r"ls\.plot\.\w+", name) and f"{name}(" in GALLERY
    assert figure or ">>>" in (inspect.getdoc(FUNCTIONS[name]) or "")


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_classes_describe_their_fields(name):
    thing = CLASSES[name]
    own = (
        [each.name for each in fields(thing)] if is_dataclass(thing) else list(getattr(thing, "_fields", ()))
    )
    told = set().union(*(entries(each, "Attributes", "Parameters") for each in thing.__mro__))
    assert not {each for each in own if not each.startswith("_")} - told


@pytest.mark.parametrize("name", sorted({**FUNCTIONS, **CLASSES}))
def test_arrays_have_shapes(name):
    thing = ROOMS[name]
    """In the type, or for a table of arrays in the sentence below."""
    kinds = entries(thing, "Attributes", "Parameters")
    assert not [each for each, kind in kinds.items() if kind.startswith("ndarray") and "shape" not in kind]
