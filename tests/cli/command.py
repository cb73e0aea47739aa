"""The command line called within the process of the tests."""

import re
from pathlib import Path

from limitsets.face.cli import main

DOCS = Path(__file__).resolve().parents[2] / "docs"

PROGRESS = re.compile(r" \([0-9]+ of [0-9]+\)$")  # of what takes over two seconds


def run(capfd, *words):
    """Exit code, and what goes to each stream: to the second only lines that name the command."""
    code = main(words)
    out, err = capfd.readouterr()
    assert "Traceback" not in err
    assert all(line.startswith("limitsets: ") for line in err.splitlines())
    return code, out, err


def documented(section, page="json.md"):
    """Keys of a section of the page on JSON: those in the first column of its table, or in its one sentence."""
    text = (DOCS / page).read_text(encoding="utf-8").split(f"## {section}\n", 1)[1].split("\n## ", 1)[0]
    cells = re.findall(r"^\| (`[^|]*`) \|", text, re.M) or re.findall(r"(`\{.*?\}`)", text)
    return {name for cell in cells for name in re.findall(r"\b[a-z_]+\b", cell)}
