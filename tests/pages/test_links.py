"""The pages: their links, examples, the reference and the docstrings."""

import inspect
import re
import shlex
import subprocess
import sys
import tomllib
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from pathlib import Path

import nbformat
import pytest
import typer.main

import limitsets
import limitsets as ls
from limitsets.face.cli.app import app

# ----------------------------------------------------------------
# Links, without a network: to pages, to their headings and to files of the repository; and tables are whole.
# `make linkcheck` asks other sites; it needs the internet and is no part of the tests.


ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    *sorted(ROOT.glob("*.md")),
    *sorted(ROOT.glob("docs/*.md")),
    *sorted(ROOT.glob("studies/*/README.md")),
    *sorted(ROOT.glob("notebooks/*.ipynb")),
]
# A folder or a file: of the repository, or of the package, as words.md and CONTRIBUTING.md write it.
PATH = re.compile(r"`((?:[\w.-]+/)+(?:[\w.-]+\.(?:py|md|toml|txt|json|ipynb))?)`")
FOLDERS = (ROOT, ROOT / "limitsets")
OTHERS = ("build/", "dist/", "paper-designed-analysis/", "studies/NN_name/")  # built, or a pattern


@cache
def prose(page: Path) -> str:
    """Text of a page without its blocks of code; of a notebook that of its cells of words."""
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        cells = nbformat.reads(text, as_version=4).cells
        text = "\n\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    return re.sub(r"^ *```.*?^ *```$", "", text, flags=re.M | re.S)


@cache
def anchors(page: Path) -> set[str]:
    """Name the headings of a page as code hosts and the site do."""
    titles = re.findall(r"^#+ (.*)$", prose(page), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"https?://", target):
            continue
        path, _, anchor = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), target
        assert there.is_relative_to(ROOT), target
        assert not anchor or anchor in anchors(there), target


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_paths_in_sentences_are_there(page):
    for path in PATH.findall(prose(page)):
        if page.name != "CHANGELOG.md" and not path.startswith(OTHERS):
            folders = (*FOLDERS, page.parent, ROOT / "studies")
            assert any((folder / path).exists() for folder in folders), path


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_tables_are_whole(page):
    """A blank line within a table makes text of its lower half; a row has as many cells as the head."""
    blocks = re.findall(r"(?:^ *\|.*\n?)+", prose(page), re.M)
    for block in blocks:
        rows = [len(re.findall(r"(?<!\\)\|", re.sub(r"`[^`]*`", "", row))) for row in block.splitlines()]
        assert re.match(r" *\|.*\n *\|[-:| ]+\|", block), block[:80]
        assert set(rows) == {rows[0]}, block[:80]


# ----------------------------------------------------------------
# Every block of code in README and docs: python runs, commands parse, TOML loads as a scene or onto one.


PAGES_BLOCKS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SHORT = {
    "README",
    "audit",
    "choosing",
    "design",
    "feedback",
    "tables",
}  # the others' programs belong to the sweep
LANGUAGES = {"python", "console", "toml", "text", "{eval-rst}"}


def blocks(page: Path, language: str) -> list[str]:
    """Take a page's fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S)


def pages_with(language: str) -> list:
    """List the pages that have such blocks; long programs belong to the sweep."""
    found = [page for page in PAGES_BLOCKS if blocks(page, language)]
    long = [page for page in found if language == "python" and page.stem not in SHORT]
    return [pytest.param(page, marks=[pytest.mark.sweep] * (page in long), id=page.stem) for page in found]


@pytest.mark.parametrize("page", PAGES_BLOCKS, ids=lambda page: page.stem)
def test_every_block_says_what_it_is(page):
    """So that none is left out here: our code, commands, scenes, and the text of others."""
    fences = re.findall(r"^ *```(.*)$", page.read_text(encoding="utf-8"), re.M)
    assert len(fences) % 2 == 0
    assert set(fences[::2]) <= LANGUAGES
    assert set(fences[1::2]) <= {""}


@pytest.mark.parametrize("page", pages_with("python"))
def test_python_runs(page, tmp_path):
    """Page by page, from top to bottom, as a reader would paste it."""
    program = tmp_path / "page.py"
    body = "\n".join(blocks(page, "python"))
    program.write_text(body, encoding="utf-8")
    how = {"cwd": tmp_path, "capture_output": True, "text": True, "check": False}
    done = subprocess.run([sys.executable, program.name], **how)
    assert done.returncode == 0, done.stderr


GROUP = typer.main.get_command(app)


def written(page: Path) -> list[list[str]]:
    """Take the commands that stand on lines of their own, as words."""
    lines = "".join(blocks(page, "console")).replace("\\\n", " ").splitlines()
    words = [shlex.split(line.removeprefix(".venv/bin/"), comments=True) for line in lines]
    return [each[1:] for each in words if each[:1] == ["limitsets"]]


def mentioned(page: Path) -> list[list[str]]:
    """Take the commands within sentences, as words: `limitsets feed SCENE [--parts N]`."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    spans = re.findall(r"`limitsets ([a-z][^`]+)`", text)
    return [shlex.split(re.sub(r"[\[\]|]", " ", span)) for span in spans]


@pytest.mark.parametrize("page", [page for page in PAGES_BLOCKS if written(page)], ids=lambda page: page.stem)
def test_commands_parse(page):
    """By the parser of the command line itself: names, options, numbers."""
    for name, *arguments in written(page):
        GROUP.commands[name].make_context(name, arguments).close()


@pytest.mark.parametrize(
    "page", [page for page in PAGES_BLOCKS if mentioned(page)], ids=lambda page: page.stem
)
def test_options_are_there(page):
    for name, *words in mentioned(page):
        options = {option for each in GROUP.commands[name].params for option in each.opts} | {"-h", "--help"}
        given = {word.split("=")[0] for word in words if re.match("--?[a-z]", word)}
        assert given <= options, (name, *words)


def merged(below: dict, above: dict) -> dict:
    inner = [key for key in below.keys() & above.keys() if isinstance(above[key], dict)]
    both = {key: merged(below[key], above[key]) for key in inner}
    return {**below, **above, **both}


@pytest.mark.parametrize("page", pages_with("toml"))
def test_scenes_load(page):
    """A whole scene as it stands; some tables of one in place of, or beside, those of a built-in scene."""
    for text in blocks(page, "toml"):
        tables = tomllib.loads(text)
        scene = ls.load(tables if "part" in tables else merged(ls.load("paper-initial").as_dict(), tables))
        assert scene.as_dict()


# ----------------------------------------------------------------
# The site's pages: the index lists every page, and the reference every public name, room and command.


DOCS = Path(__file__).resolve().parents[2] / "docs"
INNER = {"arguments", "cli", "files", "progress", "proposals", "tables"}  # no public names


def text(page):
    return (DOCS / page).read_text(encoding="utf-8")


def test_the_index_lists_every_page_notebook_and_study_once():
    links = re.findall(r"^\* \[[^]]+\]\(([^)]+)\)", text("index.md"), re.M)
    top = DOCS.parent
    places = ("docs/*.md", "notebooks/*.ipynb", "studies/*/README.md", "*.md")
    pages = [page for place in places for page in top.glob(place)]
    assert sorted((DOCS / link).resolve() for link in links) == sorted(set(pages) - {DOCS / "index.md"})


def test_the_reference_lists_every_public_name_and_room():
    listed = re.findall(r"^   limitsets\.(\w+)$", text("reference.md"), re.M)
    rooms = {name for name, place in limitsets._PUBLIC.items() if ":" not in place} - INNER
    rooms |= {"proofs", "checker"}
    assert sorted(listed) == sorted({*limitsets.__all__} | rooms)


def test_the_page_of_commands_lists_every_command():
    rows = re.findall(r"^\| (`.*?) \|", text("commands.md"), re.M)
    listed = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert sorted(listed) == sorted(typer.main.get_command(app).commands)
    assert len(listed) == len(set(listed))


def test_the_gallery_draws_every_figure():
    drawn = re.findall(r"^ls\.plot\.(\w+)\(.*\.savefig\(\"(\w+)\.png\"\)$", text("gallery.md"), re.M)
    shown = re.findall(r"^!\[[^]]+\]\(gallery/(\w+)\.png\)$", text("gallery.md"), re.M)
    assert sorted(drawn) == sorted((name, name) for name in limitsets.plot.__all__)
    assert sorted(shown) == sorted(limitsets.plot.__all__)
    assert {path.stem for path in (DOCS / "gallery").glob("*.png")} == set(shown)


# ----------------------------------------------------------------
# Public names: each says what it takes and gives, with shapes, what it raises, and has an example that runs.
# The examples are run by pytest (``--doctest-modules``), those of figures by the page of the gallery as well.  The
# kernels of `interval` on pairs of numbers are one sentence each: the room's docstring is their contract,
# `Interval` has the examples.


GALLERY = (Path(__file__).resolve().parents[2] / "docs" / "gallery.md").read_text(encoding="utf-8")
NAMESPACES = ("plot", "maps", "resilience", "engine")
INNER_DOCSTRINGS = {"cli", "files", "progress", "tables"}  # no public names


def names_of(module, short):
    """The public names of a module that are no modules themselves, with what they stand for."""
    things = ((name, getattr(module, name)) for name in module.__all__)
    return {f"{short}.{name}": thing for name, thing in things if not inspect.ismodule(thing)}


TOP = names_of(limitsets, "ls")
for space in NAMESPACES:
    TOP |= names_of(import_module(f"limitsets.{space}"), f"ls.{space}")
ROOMS = dict(TOP)
for room, place in limitsets._PUBLIC.items():
    if ":" in place or room in INNER_DOCSTRINGS:
        continue
    if hasattr(import_module(f"limitsets.{place}"), "__all__"):
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
    lines = [line for title in titles for line in section(thing, title) or ()]
    named = (line.partition(" : ") for line in lines if line and not line[0].isspace())
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
    own = [each.name for each in fields(thing)] if is_dataclass(thing) else getattr(thing, "_fields", ())
    told = set().union(*(entries(each, "Attributes", "Parameters") for each in thing.__mro__))
    assert not {each for each in own if not each.startswith("_")} - told


@pytest.mark.parametrize("name", sorted({**FUNCTIONS, **CLASSES}))
def test_arrays_have_shapes(name):
    thing = ROOMS[name]
    """In the type, or for a table of arrays in the sentence below."""
    kinds = entries(thing, "Attributes", "Parameters")
    assert not [each for each, kind in kinds.items() if kind.startswith("ndarray") and "shape" not in kind]
