"""The counts of lines and sizes, and the architecture."""

import ast
import importlib.util
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path
from pkgutil import iter_modules

import pytest

import limitsets
from tests import lines, sizes

# ----------------------------------------------------------------
# The count of lines of code and the sizes of the house, on files that are counted by hand.


SOURCE = '''"""A docstring
of two lines."""

import math  # code, with a comment

# a comment alone
TEXT = """
a string that is a value, of four lines
"""


def area(r):
    """One line."""
    return (
        math.pi
        # inside an expression
        * r**2
    )
'''


def test_code_is_neither_blank_nor_comment_nor_docstring():
    # the import, three of TEXT, def, and five within the brackets less the comment
    assert lines.lines_of_code(SOURCE) == 1 + 3 + 1 + 4


def test_the_table_has_a_row_for_each_room(tmp_path, capsys):
    for name, count in (("a/one.py", 1), ("a/two.py", 5), ("a/b/three.py", 3), ("top.py", 2)):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x = 1\n\n" * count)
    (tmp_path / "a" / "page.html").write_text("<p>\n</p>\n")
    lines.main(tmp_path)
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert rows[1:] == [
        ["a", "9", "3", "3", "5", "a/two.py"],
        [".", "2", "1", "2", "2", "top.py"],
        ["all", "11", "4", "2", "5", "a/two.py"],
        ["*.html", "2", "not", "counted"],
    ]


def test_this_very_package_is_counted():
    rooms = lines.counted(lines.PACKAGE)
    assert {"feeder", "checker", "."} <= rooms.keys()
    assert 10_000 < sum(sum(files.values()) for files in rooms.values()) < 100_000


# By hand: two definitions, four assignments, if, for and its body, return, two calls as statements.
HOUSE = '''
"""A docstring."""

@kernel
def compiled(a, b, c, d, e, f, g):
    found = compiled(a, b, c, d, e, f, g)

def plain(found, x):
    """Another."""
    y = [k for k in x if k and x or k]
    if found.found is None:
        for each in x:
            y = found
    compiled(1, 2, 3, 4, 5, 6, 7)
    plain(1, 2, 3, 4, 5, 6, 7, found=8)
    return y

z = 0
'''


def test_sizes_of_a_file_counted_by_hand(tmp_path):
    (tmp_path / "house.py").write_text(HOUSE)
    (tmp_path / "tests").mkdir()
    sizes_now = sizes.measured(tmp_path, tmp_path / "tests")
    assert sizes_now["statements"] == 2 + 4 + 1 + 1 + 1 + 2
    # a comprehension, `and`, `or`, if, for
    assert sizes_now["largest_complexity"] == 1 + 5
    # not the call of a kernel, nor the one within it
    assert sizes_now["calls_with_many_positional_arguments"] == 1
    # in `compiled` one, in `plain` the argument, found.found, its use, the keyword
    assert sizes_now["identifiers_found"] == 1 + 1 + 2 + 1 + 1
    assert sizes_now["entries"] == 2


def test_a_size_above_the_record_fails(tmp_path, monkeypatch, capsys):
    record = tmp_path / "sizes.toml"
    record.write_text("statements = 3\nfiles = 2\n")
    monkeypatch.setattr(sizes, "RECORD", record)
    monkeypatch.setattr(sizes, "measured", lambda: {"statements": 3, "files": 2})
    assert sizes.main([]) == 0
    monkeypatch.setattr(sizes, "measured", lambda: {"statements": 4, "files": 1})
    assert sizes.main([]) == 1
    assert "larger than tests/sizes.toml allows (3)" in capsys.readouterr().out
    assert sizes.main(["--write"]) == 0
    assert record.read_text() == "statements = 4\nfiles = 1\n"


def test_a_docstring_is_no_statement():
    assert sizes.statements(ast.parse('"""Text."""\nx = """Text."""\n')) == 1


# ----------------------------------------------------------------
# What the package promises about its own build: who imports whom, what an import costs, which names it shows.


ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "limitsets"
SOURCES = sorted(PACKAGE.rglob("*.py"))
LATE = ["numba", "scipy", "networkx", "matplotlib", "typer", "rich", "jinja2", "tomlkit"]
LATE += ["pymunk", "xarray", "zarr", "pandas", "pyarrow", "dask", "distributed", "panel", "bokeh"]


def run_python(code: str, cwd: Path = ROOT) -> str:
    """Run code in a new interpreter, as a user's first lines would be, and return what it prints."""
    command = [sys.executable, "-W", "error", "-c", textwrap.dedent(code)]
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def imported_names(source: Path) -> set[str]:
    """Top-level names that a file imports, in whichever way and however late."""
    names = set()
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names.add(node.module.split(".")[0])
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called in ("import_module", "__import__"):
                names.add(str(node.args[0].value).split(".")[0])
    return names


def test_only_jit_imports_numba_and_only_the_engine_pymunk():
    for source in SOURCES:
        imported = imported_names(source)
        assert not {"numba", "llvmlite"} & imported or source.parent == PACKAGE / "numbers" / "jit", source
        assert "pymunk" not in imported or source.parent == PACKAGE / "feeder" / "engine", source


def test_the_checker_imports_nothing_of_ours():
    """So that it can be copied, shares no error with the prover, and cannot reach compiled code."""
    for source in (PACKAGE / "checker").glob("*.py"):
        assert imported_names(source) <= {*sys.stdlib_module_names, "numpy", "flint"}


def test_the_checker_tells_of_each_of_its_files():
    folder = lines.PACKAGE / "checker"
    told = set(
        re.findall(r"^    (\w+)  +\w", (folder / "__init__.py").read_text(encoding="utf-8"), re.MULTILINE)
    )
    files = {path.stem for path in folder.glob("*.py")}
    assert told == files - {"__init__", "__main__", "build"}


def test_every_name_of_the_checker_is_defined_once():
    """In one of its files, once: a second definition would silently change what the first one's readers see."""
    defined = []
    for source in (PACKAGE / "checker").glob("*.py"):
        for node in ast.parse(source.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                defined.append(node.name)
            elif isinstance(node, ast.Assign | ast.AnnAssign):
                stored = (each for each in ast.walk(node) if isinstance(each, ast.Name))
                defined += [each.id for each in stored if isinstance(each.ctx, ast.Store)]
    assert {name for name in defined if defined.count(name) > 1} == set()
    assert "PRECISION" in defined


def test_no_result_of_a_run_is_kept_at_the_top():
    """Figures and reports of a trial were committed once, by `git add` in the checkout."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("git says what is kept: this is no checkout, or there is no git")
    kept = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    top = {line.split("/")[0] for line in kept.splitlines() if not line.startswith(".")}
    pages = {"README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE", "CITATION.cff"}
    files, folders = "Makefile constraints.txt pyproject.toml", "docs limitsets notebooks studies tests"
    assert top == {*pages, *files.split(), *folders.split()}


def test_the_names_of_a_room_are_listed_by_its_face_alone():
    """A list in an inner file repeats its definitions: nobody imports a star from an inner file."""
    inner = [path for path in SOURCES if path.name != "__init__.py" and path.parent != PACKAGE]
    assert inner
    assert not [path for path in inner if "__all__" in path.read_text(encoding="utf-8")]


def test_import_loads_none_of_the_late_packages():
    loaded = run_python("import sys, limitsets; print(*sys.modules)").split()
    assert "limitsets" in loaded
    assert not set(LATE) & set(loaded)


def test_networkx_finds_the_backend_without_importing_it():
    loaded = run_python("""
        import sys, networkx
        assert "limitsets" in networkx.utils.backends.backends, "not installed: run make test"
        print(*sys.modules)
    """).split()
    assert "limitsets" not in loaded


def test_import_contracts_hold():
    code = "from importlinter.cli import lint_imports_command; lint_imports_command(['--no-cache'])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_at_most_40_public_names():
    assert len(limitsets.__all__) == len(set(limitsets.__all__)) <= 40
    assert set(limitsets.__all__) <= set(dir(limitsets))


# A lazy name that is spelt like a module is replaced by that module as soon as something imports it: `limitsets.x` is
# then one thing at the first touch and another at the second.
@pytest.mark.parametrize("order", ["limitsets.__all__", "limitsets.__all__[::-1]"])
def test_public_names_stay_what_they_are(order):
    run_python(f"""
        import importlib, pkgutil, limitsets

        first = {{name: getattr(limitsets, name) for name in {order}}}
        second = {{name: getattr(limitsets, name) for name in {order}}}
        for module in pkgutil.walk_packages(limitsets.__path__, "limitsets."):
            if module.name != "limitsets.__main__":
                importlib.import_module(module.name)
        for name in first:
            assert first[name] is second[name] is getattr(limitsets, name), name
    """)


def test_the_listing_of_the_package_is_its_nine_wings():
    listed = {path.name for path in PACKAGE.iterdir() if path.name != "__pycache__"}
    wings = {"base", "numbers", "systems", "feeder", "proofs", "checker", "parameters", "cell", "face"}
    assert listed == wings | {"__init__.py", "__main__.py", "py.typed"}


@pytest.mark.parametrize(
    "room", sorted(name for name, place in limitsets._PUBLIC.items() if ":" not in place)
)
def test_a_room_under_its_public_name_is_that_room(room):
    """The same object, also of what is in it: a second import would register its kernels a second time."""
    place = importlib.import_module(f"limitsets.{limitsets._PUBLIC[room]}")
    assert importlib.import_module(f"limitsets.{room}") is place is getattr(limitsets, room)
    assert place.__name__ == place.__spec__.name == f"limitsets.{limitsets._PUBLIC[room]}"
    for file in iter_modules(getattr(place, "__path__", ())):
        if not file.ispkg and file.name != "__main__":
            inner = importlib.import_module(f"limitsets.{room}.{file.name}")
            assert inner is importlib.import_module(f"{place.__name__}.{file.name}")


def test_answers_of_other_code_are_told_from_ours_by_a_digest_without_the_face(tmp_path):
    """A store says which code wrote it; a picture that is drawn otherwise changes no answer."""
    copy = tmp_path / "limitsets"
    for name in ("base", "face", "proofs"):
        (copy / name).mkdir(parents=True)
    shutil.copy(PACKAGE / "base" / "files.py", copy / "base")
    spec = importlib.util.spec_from_file_location("files_of_a_copy", copy / "base" / "files.py")
    files = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(files)
    digest = files.code_digest.__wrapped__  # it is asked once in a process
    bare = digest()
    (copy / "face" / "picture.py").write_text("WIDTH = 3\n")
    assert digest() == bare
    (copy / "proofs" / "claim.py").write_text("LEAST = 3\n")
    proved = digest()
    (copy / "proofs" / "claim.py").write_text("LEAST = 4\n")
    assert len({bare, proved, digest()}) == 3


# What README, the docs and the studies import from a room, under the name that the room has in public.
IN_ROOMS = {
    "animation": "animate film_of",
    "assembly": "assemble",
    "cells": "CellSet Grid grid",
    "cli": "main",
    "engine": "Crowd off_seat seat_of",
    "errors": "AnswerError",
    "fitting": "bootstrap enough fit simulated_throws",
    "geometry": "mass_of resting_sides",
    "goals": "OrientedBeyond declare",
    "graph": "morse_graph transitions",
    "interval": "Dual Interval hull sin",
    "inverse": "critical_jacobian design robust_design",
    "maps": "Circle Leslie OUTSIDE_MODEL images",
    "plot": "limit_set noise_levels style",
    "policies": "game_of image_of places search",
    "regions": "certified evenly roomiest",
    "resilience": "basin_stability",
    "robust": "Gaussian Scattering Uniform absorption_brackets noise_levels noise_statistics",
    "scene": "Scatter Scene load",
    "sets": "Measure invariant_measures",
    "sweep": "Variable block_task",
    "thrower": "Energy SmallAngle throw_map",
    "topology": "topologies",
    "trays": "Pouring TrayCrowd TrayFill",
}


@pytest.mark.parametrize("room", IN_ROOMS)
def test_a_room_has_what_users_import_from_it(room):
    place = importlib.import_module(f"limitsets.{room}")
    assert [name for name in IN_ROOMS[room].split() if not hasattr(place, name)] == []


def test_a_room_that_is_not_there_is_missed_by_the_name_that_was_asked_for():
    with pytest.raises(ModuleNotFoundError, match=r"limitsets\.rooms"):
        importlib.import_module("limitsets.rooms")
    with pytest.raises(AttributeError, match="has no attribute 'rooms'"):
        limitsets.rooms  # noqa: B018


def test_files_that_the_glossary_names_are_there():
    """docs/words.md says for each word where in the package it stands."""
    words = (ROOT / "docs" / "words.md").read_text(encoding="utf-8")
    named = re.findall(r"`([a-z_]+/[a-z_/]+(?:\.py)?)`", words)
    assert len(named) > 40
    assert [name for name in named if not (PACKAGE / name).exists()] == []


def test_the_citation_and_the_changelog_name_this_version():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {limitsets.__version__}\n" in text
    released = re.search(r"\ndate-released: (\S+)\n", text)
    assert released
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"\n## [{limitsets.__version__}] - {released[1]}\n" in changes
