"""Links, without a network: to pages, to their headings and to files of the repository; and tables are whole.

`make linkcheck` asks other sites; it needs the internet and is no part of the tests.
"""

import re
from functools import cache
from pathlib import Path

import nbformat
import pytest

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
