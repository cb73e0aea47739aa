"""Types as a user's checker sees them: the package says `py.typed`, and its public names have types."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import limitsets

ROOT = Path(__file__).resolve().parents[1]

# What a user writes, and the type that each name has to have.
USER = """
import limitsets as ls

scene = ls.load("paper-designed")
reveal_type(scene)  # limitsets.feeder.scene.scene.Scene
graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
found = ls.attractors(graph)
reveal_type(found)  # tuple[limitsets.systems.sets.attracting.Attractor, ...]
reveal_type(ls.basins(graph, found).exits)  # dict[str, float]
analysis = ls.analyse(scene)
reveal_type(analysis)  # limitsets.parameters.analysis.run.Analysis
reveal_type(ls.certify(scene).proved)  # bool
reveal_type(ls.margin(scene, "throw.speed"))  # tuple[limitsets.parameters.margins.margin_result.Margin, ...]
reveal_type(ls.plot.limit_set(scene, found))  # matplotlib.figure.Figure
reveal_type(ls.atlas(scene, "throw.speed=150:160:3"))  # limitsets.parameters.atlas.parameter_atlas.Atlas
reveal_type(ls.feed(scene))  # limitsets.cell.feeding.feeding_run.Feeding
reveal_type(ls.audit(scene).table().csv())  # str
reveal_type(ls.orbit(ls.maps.Henon(), (0.1, 0.1), 0, 10).stopped)  # str | None
reveal_type(ls.__version__)  # str
ls.no_such_name
"""


def test_the_marker_is_in_the_package():
    assert (Path(limitsets.__file__).parent / "py.typed").is_file()


def test_each_public_name_is_imported_for_checkers_of_types():
    text = (ROOT / "limitsets" / "__init__.py").read_text(encoding="utf-8")
    block = text.split("if TYPE_CHECKING:", 1)[1].split("\n\n", 1)[0]
    names = {name for line in re.findall(r"import .* as (.+)", block) for name in line.split(", ")}
    assert names == set(limitsets.__all__)


# Whoever writes a notebook does not ask of each answer whether it is None.
CONFIG = """
[mypy]
check_untyped_defs = True
ignore_missing_imports = True

[mypy-{notebooks}]
strict_optional = False
"""


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """What mypy says of the script and of the code of the notebooks: by file, the notes and the errors by line."""
    pytest.importorskip("mypy", reason="mypy checks types")
    nbformat = pytest.importorskip("nbformat", reason="notebooks")
    folder = tmp_path_factory.mktemp("types")
    (folder / "user.py").write_text(USER, encoding="utf-8")
    for book in sorted((ROOT / "notebooks").glob("*.ipynb")):
        cells = nbformat.read(book, as_version=4).cells
        code = "\n\n".join(cell.source for cell in cells if cell.cell_type == "code")
        name = re.sub(r"\W", "_", f"n{book.stem}") + "_book.py"
        (folder / name).write_text(re.sub(r"^[%!].*$", "", code, flags=re.M), encoding="utf-8")
    books = sorted(path.stem for path in folder.glob("*_book.py"))
    assert books
    (folder / "mypy.ini").write_text(CONFIG.format(notebooks=",".join(books)), encoding="utf-8")
    files = ["user.py", *(f"{book}.py" for book in books)]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", "mypy.ini", *files],
        capture_output=True,
        text=True,
        cwd=folder,
        env={"PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert done.stderr == ""
    lines = re.findall(r"^(\S+?):(\d+): (note|error): (.*)$", done.stdout, re.M)
    return [(name, int(number), kind, text) for name, number, kind, text in lines]


@pytest.mark.sweep
def test_the_names_of_a_users_script_have_types(said):
    lines = USER.splitlines()
    seen = {number: text for name, number, kind, text in said if (name, kind) == ("user.py", "note")}
    for number, line in enumerate(lines, start=1):
        if line.startswith("reveal_type"):
            assert seen[number] == f'Revealed type is "{line.partition("  # ")[2]}"', line


@pytest.mark.sweep
def test_a_name_that_is_not_there_is_the_only_error(said):
    """In the script, and in all of the notebooks."""
    errors = [(name, number) for name, number, kind, _ in said if kind == "error"]
    assert errors == [("user.py", len(USER.splitlines()))], said


@pytest.mark.parametrize(("line", "meant"), [("analize", "analyse"), ("plot.limitset", "limit_set")])
def test_a_misspelt_name_gets_a_proposal(line, meant):
    """Of Python's own, which knows names loaded when first used from the error alone."""
    ended = subprocess.run(
        [sys.executable, "-c", f"import limitsets as ls\nls.{line}"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert f"Did you mean: '{meant}'?" in ended.stderr
