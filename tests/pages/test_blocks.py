"""Every block of code in README and docs: python runs, commands parse, TOML loads as a scene or onto one."""

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typer.main

import limitsets as ls
from limitsets.face.cli.app import app

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
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
    return [
        pytest.param(
            page,
            marks=[pytest.mark.sweep] if language == "python" and page.stem not in SHORT else [],
            id=page.stem,
        )
        for page in PAGES
        if blocks(page, language)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
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
    done = subprocess.run(
        [sys.executable, program.name], cwd=tmp_path, capture_output=True, text=True, check=False
    )
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


@pytest.mark.parametrize("page", [page for page in PAGES if written(page)], ids=lambda page: page.stem)
def test_commands_parse(page):
    """By the parser of the command line itself: names, options, numbers."""
    for name, *arguments in written(page):
        GROUP.commands[name].make_context(name, arguments).close()


@pytest.mark.parametrize("page", [page for page in PAGES if mentioned(page)], ids=lambda page: page.stem)
def test_options_are_there(page):
    for name, *words in mentioned(page):
        options = {option for each in GROUP.commands[name].params for option in each.opts} | {"-h", "--help"}
        given = {word.split("=")[0] for word in words if re.match("--?[a-z]", word)}
        assert given <= options, (name, *words)


def merged(below: dict, above: dict) -> dict:
    both = {
        key: merged(below[key], above[key])
        for key in below.keys() & above.keys()
        if isinstance(above[key], dict)
    }
    return {**below, **above, **both}


@pytest.mark.parametrize("page", pages_with("toml"))
def test_scenes_load(page):
    """A whole scene as it stands; some tables of one in place of, or beside, those of a built-in scene."""
    for text in blocks(page, "toml"):
        tables = tomllib.loads(text)
        scene = ls.load(tables if "part" in tables else merged(ls.load("paper-initial").as_dict(), tables))
        assert scene.as_dict()
