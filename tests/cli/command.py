"""The command line called within the process of the tests."""

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path
from unittest import mock

import limitsets as ls
from limitsets.face.cli import commands, main

DOCS = Path(__file__).resolve().parents[2] / "docs"

PROGRESS = re.compile(r" \([0-9]+ of [0-9]+\)$")  # of what takes over two seconds


def run(capfd, line="", *words):
    """Exit code, and what goes to each stream: to the second only lines that name the command.

    The line is split as a shell does it; each of the words behind it stays whole.
    """
    code = main([*shlex.split(line), *words])
    out, err = capfd.readouterr()
    assert "Traceback" not in err
    assert all(line.startswith("limitsets: ") for line in err.splitlines())
    return code, out, err


def prints(capfd, *words, code=0):
    """What a command prints that ends with this code."""
    ended, out, err = run(capfd, *words)
    assert ended == code, err
    return out


def json_of(capfd, *words, code=0):
    """What it prints with --json."""
    return json.loads(prints(capfd, *words, "--json", code=code))


def both(capfd, *words, code=0):
    """What it prints as text, and what it prints with --json, of an answer that is computed once; code None is any."""
    give, between = commands._give, "-" * 72

    def twice(asked, answer, file):
        give(asked, answer, file)
        print(between, flush=True)
        give(replace(asked, json=True), answer, file)

    with mock.patch.object(commands, "_give", twice):
        ended, out, err = run(capfd, *words)
    assert code in (ended, None), err
    text, _, record = out.partition(between)
    return text, json.loads(record)


def refusal(capfd, *words):
    """The one line that a command refuses bad input with; nothing goes to the first stream."""
    code, out, err = run(capfd, *words)
    assert (code, out) == (2, "")
    assert len([line for line in err.splitlines() if not PROGRESS.search(line)]) == 1
    assert "bug" not in err
    return err


def written(scene="paper-designed", file="mine.toml", values=None, **tables):
    """Write a scene, with other tables and other values; the file's name."""
    found = ls.load(ls.load(scene).as_dict() | tables)
    ls.dump(found.with_values(values) if values else found, file)
    return file


def names_in(folder="."):
    """Names of what lies in a folder."""
    return {path.name for path in Path(folder).iterdir()}


def documented(section, page="json.md"):
    """Keys of a section of the page on JSON: those in the first column of its table, or in its one sentence."""
    text = (DOCS / page).read_text(encoding="utf-8").split(f"## {section}\n", 1)[1].split("\n## ", 1)[0]
    cells = re.findall(r"^\| (`[^|]*`) \|", text, re.M) or re.findall(r"(`\{.*?\}`)", text)
    return {name for cell in cells for name in re.findall(r"\b[a-z_]+\b", cell)}
