"""The site's pages: the index lists every page, and the reference every public name, room and command."""

import re
from pathlib import Path

import typer.main

import limitsets
from limitsets.face.cli.app import app

DOCS = Path(__file__).resolve().parents[2] / "docs"
INNER = {"arguments", "cli", "files", "progress", "proposals", "tables"}  # no public names


def text(page):
    return (DOCS / page).read_text(encoding="utf-8")


def test_the_index_lists_every_page_notebook_and_study_once():
    links = re.findall(r"^\* \[[^]]+\]\(([^)]+)\)", text("index.md"), re.M)
    top = DOCS.parent
    pages = [
        *DOCS.glob("*.md"),
        *top.glob("notebooks/*.ipynb"),
        *top.glob("studies/*/README.md"),
        *top.glob("*.md"),
    ]
    assert sorted((DOCS / link).resolve() for link in links) == sorted(set(pages) - {DOCS / "index.md"})


def test_the_reference_lists_every_public_name_and_room():
    listed = re.findall(r"^   limitsets\.(\w+)$", text("reference.md"), re.M)
    rooms = {name for name, place in limitsets._PUBLIC.items() if ":" not in place} - INNER | {
        "proofs",
        "checker",
    }
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
