"""Types, arguments and proposals that the package makes."""

import os
import re
import subprocess
import sys
import types
from pathlib import Path

import numpy as np
import pytest

import limitsets
from limitsets.base.arguments import arguments_checked
from limitsets.base.errors import AnswerError
from limitsets.base.proposals import proposed

# ----------------------------------------------------------------
# Types as a user's checker sees them: the package says `py.typed`, and its public names have types.


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
    names = set(re.findall(r" as (\w+)", block))
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


# ----------------------------------------------------------------
# Which values fit an annotation, and which are refused: the table is Python's and numpy's own idea of each kind.


class Scene:
    """Known to the check by its name."""


class Smaller(Scene):
    pass


def _one(value):
    return value


def _rest(*value):
    return value


def _by_keyword(*, value):
    return value


def _taking(annotation, function=_one):
    """A checked function of one argument with that annotation."""
    own = types.FunctionType(function.__code__, {}, "taken")
    own.__annotations__ = {"value": annotation}
    return arguments_checked(own)


FITS = [
    ("int", 3, True),
    ("int", np.int64(3), True),
    ("int", True, False),
    ("int", 3.0, False),
    ("float", 3, True),
    ("float", np.float32(0.5), True),
    ("float", float("inf"), True),
    ("float", float("nan"), False),
    ("float", True, False),
    ("bool", True, True),
    ("bool", np.bool_(True), True),
    ("bool", 1, False),
    ("Path", Path("x"), True),
    ("Path", "x", True),
    ("Path", 3, False),
    ("Sequence[float]", np.array([1.0, 2.0]), True),
    ("Sequence[float]", [1.0, "x"], False),
    ("Sequence[str]", "letters", False),
    ("Scene", Scene(), True),
    ("Scene", Smaller(), True),
    ("Scene", "a file", False),
    ("Scene | str", "a file", True),
    ("Scene | str", 3, True),  # the reader of scenes refuses the number, and says more
    ("Mapping[str, float]", {"a": 1.0}, True),
    ("Mapping[str, float]", {"a": "1.0"}, False),
    ("Mapping[str, float]", ["a"], False),
    ("tuple[float, int]", (1.0, 2), True),
    ("tuple[float, int]", [1.0, 2], True),
    ("tuple[float, int]", (1.0, 2.5), False),
    ("tuple[float, int]", (1.0, 2, 3), False),
    ("Callable[[str, int], None]", print, True),
    ("Callable[[str, int], None]", "print", False),
    ("float | None", None, True),
    ("float | None", "x", False),
    ("Unknown | None", "x", True),
]


@pytest.mark.parametrize(("annotation", "value", "fits"), FITS, ids=lambda each: repr(each)[:30])
def test_a_value_fits_or_is_refused(annotation, value, fits):
    taken = _taking(annotation)
    if fits:
        assert taken(value) is value
        assert taken(value=value) is value
        return
    for call in (lambda: taken(value), lambda: taken(value=value)):
        with pytest.raises(AnswerError, match="the argument value of taken"):
            call()


def test_each_of_the_rest_and_those_by_keyword_alone_are_asked():
    assert _taking("int", _rest)(1, 2) == (1, 2)
    with pytest.raises(AnswerError, match="'x'"):
        _taking("int", _rest)(1, "x")
    with pytest.raises(AnswerError, match="'x'"):
        _taking("int", _by_keyword)(value="x")
    with pytest.raises(
        TypeError, match="positional"
    ):  # Python's own: not held against the next parameter's kind
        _taking("int", _by_keyword)("x")


# ----------------------------------------------------------------
# Commands that answers propose, as they are typed into a shell.


@pytest.mark.parametrize(
    ("started", "program"),
    [
        (".venv/bin/limitsets", ".venv/bin/limitsets"),
        ("{here}/.venv/bin/limitsets", ".venv/bin/limitsets"),
        ("{here}/on path/limitsets", "limitsets"),
        ("/opt/my tools/limitsets", "'/opt/my tools/limitsets'"),
        ("/site/limitsets/__main__.py", "{python} -m limitsets"),
        ("/usr/bin/pytest", "limitsets"),
        ("", "limitsets"),
    ],
)
def test_the_program_is_the_one_that_was_started(started, program, tmp_path, monkeypatch):
    (tmp_path / "on path").mkdir()
    (tmp_path / "on path" / "limitsets").touch(mode=0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", os.fspath(tmp_path / "on path"))
    monkeypatch.setattr(sys, "executable", "/opt/python3")
    monkeypatch.setattr(sys, "argv", [started.format(here=tmp_path)])
    assert proposed("scenes") == program.format(here=tmp_path, python="/opt/python3") + " scenes"


def test_words_are_quoted_for_the_shell(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["limitsets"])
    assert proposed("check", Path("it's mine.toml")) == """limitsets check 'it'"'"'s mine.toml'"""
