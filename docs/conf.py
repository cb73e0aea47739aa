"""How Sphinx builds the site: `make docs` (see CONTRIBUTING.md).

The source folder is the checkout itself, so that the pages link to each other, to the studies and to the notebooks by
the paths that a code host follows too.  Nothing is fetched, and no notebook is run: their outputs are committed, and
tests run them.
"""

import re
from importlib.util import find_spec
from pathlib import Path

from sphinx.application import Sphinx

import limitsets

HERE = Path(__file__).parent

project = "limitsets"
author = "The limitsets authors"
copyright = author  # noqa: A001  # Sphinx's name
release = version = limitsets.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
root_doc = "docs/index"
include_patterns = ["*.md", "docs/*.md", "docs/api/*.rst", "notebooks/*.ipynb", "studies/*/README.md"]
exclude_patterns = [".*", "build", "dist", "limitsets", "tests"]
templates_path = [str(HERE / "templates")]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "off"
nb_merge_streams = True

autodoc_typehints = "none"  # the docstrings give types in words, with shapes
autodoc_preserve_defaults = True
autosummary_ignore_module_all = False
default_role = "code"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
# `x` in "array of x" is a word, and many answers have a field of that name.
suppress_warnings = ["ref.python"]

# Formulas without a network: the KaTeX that comes with panel writes MathML, which browsers draw by themselves.
KATEX = next(Path(find_spec("panel").origin).parent.glob("dist/bundled/katex/*/dist"))
html_static_path = [str(HERE / "static"), str(KATEX)]
html_css_files = ["site.css"]
html_js_files = ["katex.min.js"]
mathjax_path = "math.js"

html_theme = "furo"
html_title = f"limitsets {release}"
html_copy_source = False
html_show_sphinx = False


def listed(page: str) -> str:
    """Write a contents tree under each heading of the index, of the pages that the list under it links to."""
    whole = []
    for section in re.split(r"^(?=## )", page, flags=re.M):
        links = re.findall(r"^\* \[([^]]+)\]\(([^)#]+)\.(?:md|ipynb)\)", section, re.M)
        title = re.match(r"## (.*)", section)
        rows = "\n".join(f"{name} <{path}>" for name, path in links)
        tree = f"\n```{{toctree}}\n:hidden:\n:caption: {title[1]}\n\n{rows}\n```\n" if title and links else ""
        whole.append(section + tree)
    return "\n".join(whole)


def helped(page: str) -> str:
    """Append the help of every command."""
    import typer.main

    from limitsets.face.cli.app import app

    group = typer.main.get_command(app)
    texts = [page, "\n## The help of each command\n"]
    for name, command in group.commands.items():
        context = typer.Context(
            command, info_name=f"limitsets {name}", max_content_width=88, terminal_width=88
        )
        texts.append(f"\n### {name}\n\n```text\n{command.get_help(context)}\n```\n")
    return "".join(texts)


CHANGED = {"docs/index": listed, "docs/commands": helped}


def change_page(app: object, name: str, source: list[str]) -> None:
    """Give the pages of `CHANGED` what is written for the site alone."""
    if name in CHANGED:
        source[0] = CHANGED[name](source[0])


def mend_docstring(
    app: object, kind: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Write |x| as text: docutils would look for a substitution of this name."""
    lines[:] = [line if ">>>" in line else re.sub(r"\|([^|`]+)\|", r"\\|\1\\|", line) for line in lines]


def leave_out(app: object, kind: str, name: str, thing: object, skip: bool, options: object) -> bool | None:
    """Leave out what namedtuple writes on each field: the class's docstring says what it is."""
    return True if (getattr(thing, "__doc__", None) or "").startswith("Alias for field") else None


def redirect(app: Sphinx, failed: Exception | None) -> None:
    """Lead from the folder of the site to its index."""
    Path(app.outdir, "index.html").write_text(
        '<!doctype html><meta http-equiv="refresh" content="0; url=docs/index.html">\n', encoding="utf-8"
    )


def setup(app: Sphinx) -> None:
    """Connect what is written above."""
    for event, what in {
        "source-read": change_page,
        "autodoc-process-docstring": mend_docstring,
        "autodoc-skip-member": leave_out,
        "build-finished": redirect,
    }.items():
        app.connect(event, what)
