"""Progress: counted right, in one place, shown where it lasts, under the cell of a notebook."""

import io
import sys
import time
from types import SimpleNamespace

import pytest

from limitsets import progress


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE", 0.05)


def lines(monkeypatch, *told):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    with progress.bar() as tell:
        for step in told:
            tell(*step)
            time.sleep(0.15)
    return stream.getvalue().splitlines()


def test_the_last_of_a_hundred_is_the_hundredth(impatient, monkeypatch):
    told = lines(
        monkeypatch, ("designs", 0, 100), ("designs", 99, 100), ("designs", 100, 100), ("done", 0, 0)
    )
    assert told == [
        "limitsets: designs (1 of 100)",
        "limitsets: designs (100 of 100)",
        "limitsets: designs (100 of 100)",
        "limitsets: done (1 of 1)",
    ]


def test_what_is_quick_says_nothing(monkeypatch):
    assert lines(monkeypatch, ("designs", 0, 100)) == []


def test_a_terminal_has_a_bar_with_the_same_count(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with progress.bar() as tell:
        tell("designs [x]", 100, 100)
        time.sleep(0.3)
    assert "designs [x]" in stream.getvalue()
    assert "100 of 100" in stream.getvalue()
    assert "101" not in stream.getvalue()


def test_a_step_that_counts_anew_has_a_bar_of_its_own(monkeypatch):
    shown = []

    class Bars:
        def __init__(self, *columns, **how):
            self.tasks = []

        def __enter__(self):
            shown.append(self)
            return self

        def __exit__(self, *_):
            pass

        def add_task(self, description, total, number):
            self.tasks.append(
                SimpleNamespace(description=description, total=total, completed=0, number=number)
            )
            return len(self.tasks) - 1

        def update(self, task, **now):
            vars(self.tasks[task]).update(now)

        def stop_task(self, task):
            pass

    monkeypatch.setattr("rich.progress.Progress", Bars)
    with progress._on_terminal() as tell:
        for step, done, of in (("a", 0, 2), ("b", 1, 2), ("cells", 0, 9), ("cells", 5, 9)):
            tell(step, done, of)
    assert [(each.description, each.completed, each.total) for each in shown[0].tasks] == [
        ("b", 2, 2),
        ("cells", 5, 9),
    ]


def test_outside_of_a_notebook_a_function_is_as_silent_as_it_was(impatient, capfd):
    told = []

    @progress.shown_in_notebooks
    def work(*, progress=None):
        if progress is not None:
            progress("work", 0, 1)
        time.sleep(0.1)
        return told

    assert work() is told
    assert capfd.readouterr() == ("", "")
    work(progress=lambda *step: told.append(step))
    assert told == [("work", 0, 1)]


SLOW = """
kept = []
paint = p._Notebook._paint
p._Notebook._paint = lambda self: (kept.append(self.state), paint(self))

@p.shown_in_notebooks
def inner(*, progress=None):
    return progress

@p.shown_in_notebooks
def slow(*, progress=None):
    assert inner() is None  # the outermost alone shows a bar
    for k in range(4):
        progress('<steps>', k, 4)
        time.sleep(0.3)
    return 7

slow()
"""


@pytest.mark.sweep
def test_a_notebook_shows_a_bar_and_tables():
    nbformat = pytest.importorskip("nbformat", reason="notebooks")
    nbclient = pytest.importorskip("nbclient", reason="notebooks")
    pytest.importorskip("ipykernel", reason="notebooks")
    cells = [
        "import time, limitsets as ls, limitsets.progress as p\np.PATIENCE = 0.1",
        "scene = ls.load('paper-designed')\nscene",
        SLOW,
        "print(kept[0], len(kept) > 1)",
        "ls.orbit(scene.map, 15.0, 2, 3)",
    ]
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    nbclient.NotebookClient(book, timeout=300, kernel_name="python3").execute()
    outputs = [cell.outputs for cell in book.cells]
    assert "<table>" in outputs[1][0]["data"]["text/html"]
    assert "centre of mass" in outputs[1][0]["data"]["text/plain"]
    assert [each["data"].get("text/html", "7") for each in outputs[2]] == [
        "",
        "7",
    ]  # the bar is gone at the end
    assert outputs[3][0]["text"] == "('<steps>', 0, 4) True\n"
    assert "<td>3</td>" in outputs[4][0]["data"]["text/html"]
