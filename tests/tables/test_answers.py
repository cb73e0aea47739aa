"""Tables of answers, and progress bars."""

import csv
import io
import math
import sys
import time
from dataclasses import replace
from decimal import Decimal
from html.parser import HTMLParser
from types import SimpleNamespace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, strategies as st

import limitsets as ls
from limitsets import progress
from limitsets.base.tables import Column, Table, Tabled, aligned, facts, joined
from limitsets.parameters.margins.single import Margin
from limitsets.proofs.prover.goals import sentence

# ----------------------------------------------------------------
# Every public answer is shown in a notebook: well-formed, labelled, with its numbers; and saved in full.


@pytest.fixture(scope="module")
def graph():
    scene = ls.load("paper-designed")
    return ls.transitions(scene.map, ls.grid(scene.domain, cells=512))


@pytest.fixture(scope="module")
def found(graph):
    return ls.attractors(graph, throws=2000)


def shown(answer):
    """Tables of an answer as texts, from its HTML; its name is a line."""
    assert "\n" not in repr(answer)
    assert len(repr(answer)) <= 250
    tree = ET.fromstring(f"<div>{answer._repr_html_()}</div>")
    tables = tree.findall("table")
    assert tables
    for table in tables:
        heads = len(table.findall("thead/tr/th"))
        assert heads >= 2
        assert all(len(row) == heads for row in table.findall("tbody/tr"))
    return [[[cell.text or "" for cell in row] for row in table.iter("tr")] for table in tables]


def captions(answer):
    return [caption.text for caption in ET.fromstring(f"<div>{answer._repr_html_()}</div>").iter("caption")]


def saved(answer):
    return list(csv.reader(io.StringIO(answer.table().csv())))


def test_scene_graph_and_sets(graph, found):
    assert shown(ls.load("paper-designed"))[0][0][1] == "length [in]"
    assert "sampled, not proved" in captions(graph)[0]
    assert "proved" in captions(ls.transitions(graph.map, graph.grid, "boxes"))[0]
    (attractor,) = found
    bands = [
        [str(side), *map(repr, part)] for side, parts in sorted(attractor.extents.items()) for part in parts
    ]
    assert [row[:3] for row in saved(attractor)[1:]] == bands
    basins = ls.basins(graph, found)
    shares = [*basins.attractors, *basins.exits.values(), basins.undecided_between]
    assert [float(row[1]) for row in saved(basins)[1:]] == shares
    assert len(shown(basins)[0]) == 1 + len(basins.attractors) + len(basins.exits) + 1
    limit = ls.limit_set(graph, attractor)
    assert [float(row[2]) for row in saved(limit)[1:]] == [end.x for end in limit.ends]
    assert shown(limit)
    path = ls.orbit(graph.map, 15.0, 2, 30)
    assert [float(row[1]) for row in saved(path)[1:]] == path.x.tolist()
    assert shown(path)


def test_cycles_of_a_plane_map():
    graph = ls.transitions(ls.maps.Henon(), ls.grid([(-1.5, 1.5), (-0.5, 0.5)], cells=(64, 64)))
    cycles = ls.cycles(graph, 2)
    assert shown(cycles)
    assert "not proved" in captions(cycles)[0]
    assert len(saved(cycles)) == 1 + sum(each.period for each in cycles)


def test_analysis_and_audit():
    analysis = ls.analyse("paper-designed", cells=512)
    assert "x [in]" in shown(analysis)[0][0]
    assert all("not proved" in caption for caption in captions(analysis))
    audit = ls.audit("paper-designed")
    assert {row[4] for row in saved(audit)[1:]} <= {"proved", "sampled"}
    assert len(shown(audit)[0]) == 1 + len(audit.findings)


def test_resilience(graph, found):
    r = ls.resilience
    stability, times = r.basin_stability(graph, found), r.convergence_times(graph, found, starts=200)
    for answer in (r.basin_entropy(graph, found), stability, times, r.uncertainty_exponent(graph, found)):
        assert shown(answer)
        assert "not proved" in captions(answer)[0]
    assert float(saved(stability)[1][1]) == stability.attractors[0].share


@pytest.mark.sweep
def test_proofs_and_their_recheck(tmp_path):
    pytest.importorskip("flint", reason="the checker needs python-flint")
    proof = ls.certify("paper-designed")
    claims = [row[:2] for row in shown(proof)[0][1:]]
    assert claims == [[each.claim, each.verdict] for each in proof.claims]
    report = ls.recheck(proof.save(tmp_path / "a.proof.zip"))
    rows = shown(report)[0]
    assert [row[0] for row in rows[1:]] == [*(name for name, _, _ in report.claims), "certificate"]
    assert rows[-1][1] == "PROVED"


def test_what_is_proved_of_starts_is_not_rounded_up():
    proof = ls.certify("paper-designed", claims=["invariant"])
    shares = {"share": 0.99996, "leaves": 0.00006, "creeps": 0.00001, "open": 0.00001}
    for starts, words in (
        ({"from": {2: 1.23456712}}, "from x = 1.23457 on side 2"),
        ({"from_foot": {0: 0.00123456712}}, "from x - a_0 = 0.00123457 on side 0"),
        ({"within": {1: [(1.23456789, 2.0)]}}, "within x = 1.23457 to 2 on side 1"),
        ({"within": {1: [(1.23456123, 2.34567899)]}}, "within x = 1.23457 to 2.34567 on side 1"),
    ):
        claim = replace(proof.claims[0], starts=starts, shares=shares)
        row = replace(proof, claims=(claim,)).tables()[-2].shown()[0]
        assert row[2:7] == [words, "0.9999", "0.0000", "0.0000", "0.0001"]
    said = sentence({"kind": "stays_on_arm", "starts": {"from": {"2": (1.23456112).hex()}}})
    assert "x > 1.23457 on side 2" in said


@pytest.mark.sweep
def test_margins_designs_and_noise():
    (margin,) = ls.margin("paper-designed", "throw.speed", width=0.2)
    row = saved(margin)[1]
    assert [float(row[2]), float(row[3])] == [margin.proved, margin.refuted]
    how = "brackets: proved below, refuted above; of the minimal model: no fact of [world] is left out"
    assert captions(margin)[0].endswith(f"({how})")
    assert shown(margin)
    design = ls.design("paper-initial", critical_points=[10, 10, 20], vary=["throw.kappa"])
    assert shown(design)
    assert [float(each[2]) for each in saved(design)[1:2]] == [design.scene.kappa]
    scene = ls.load("paper-designed")
    law = ls.robust.Scattering(speed=ls.robust.Gaussian(0.005))
    noise = ls.noise_statistics(scene, law, cells=64, strata=4, sensitivity=False)
    numbers = {name: value for name, value in noise.numbers.items() if value == value}
    assert {row[0]: float(row[1]) for row in saved(noise)[1:] if row[1]} == numbers


def test_continuation_and_atlas(tmp_path):
    pytest.importorskip("xarray", reason="the extra atlas")
    task = "limitsets.parameters.atlas.examples:critical_points"
    found = ls.atlas("paper-designed", "throw.kappa=25:26:2", task=task)
    assert shown(found)
    assert len(saved(found)) == 3
    assert saved(found)[0][0] == "throw.kappa [in]"


def test_every_answer_of_a_public_function_is_tabled():
    from limitsets.parameters.atlas import Atlas
    from limitsets.parameters.continuation.snapshot import Continuation
    from limitsets.parameters.sheet.summary import Robustness
    from limitsets.proofs.prover import Proof

    answers = [
        ls.analysis.Analysis,
        ls.assembly.Assembly,
        ls.auditing.Audit,
        ls.feeding.Feeding,
        ls.fitting.Fit,
    ]
    answers += [ls.graph.TransitionGraph, ls.inverse.Design, ls.inverse.RobustDesign, ls.policies.Synthesis]
    answers += [ls.robust.AbsorptionBrackets, ls.robust.Margin, ls.trays.TrayFill]
    for each in [*answers, Atlas, Continuation, Proof, Robustness]:
        assert issubclass(each, Tabled), each
        assert each.tables is not Tabled.tables, each


def test_a_margin_is_rounded_to_the_safe_side():
    scene = ls.load("paper-designed")
    ends = 0.7331966, 0.7337001
    found = Margin("throw.speed", "fixed", (), *ends, "%", 2.7, "", True, 1.0, scene, {}, {}, {}, (), None)
    assert found.table().shown()[0][2:4] == ["0.7331", "0.7338"]  # at six digits 0.733197 would be claimed
    assert found.table().csv().splitlines()[1].split(",")[2:4] == ["0.7331966", "0.7337001"]


# ----------------------------------------------------------------
# Tables: what people see, what spreadsheets get, what notebooks show.


THIRD = 1.0 / 3.0


def made(rows, caption="", how=""):
    columns = ("side", Column("x", "in", ".2f", ends=True), Column("share", show=".1f"), "settled")
    return Table(columns, rows, caption, how)


def read(text):
    return list(csv.reader(io.StringIO(text)))


def test_csv_has_units_in_the_head_and_every_digit():
    found = read(made([(0, (THIRD, np.float64(2.0) / 3.0), 0.1 + 0.2, True)]).csv())
    assert found[0] == ["side", "x low [in]", "x high [in]", "share", "settled"]
    assert [float(word) for word in found[1][1:4]] == [THIRD, 2.0 / 3.0, 0.1 + 0.2]
    assert found[1][4] == "true"
    assert "np." not in made([(np.int64(3), np.array([1.5, 2.5]), np.float64(0.5), np.bool_(False))]).csv()


def test_what_is_missing_is_empty_and_what_is_open_is_infinite():
    found = read(made([(1, None, math.nan, None), (2, (-math.inf, math.inf), 0.0, False)]).csv())
    assert found[1] == ["1", "", "", "", ""]
    assert found[2] == ["2", "-inf", "inf", "0.0", "false"]


def test_words_with_commas_quotes_and_line_breaks_come_back():
    word = 'a, "b"\nµ'
    assert read(Table(["what"], [[word]]).csv())[1] == [word]


def test_people_see_rounded_numbers():
    table = made([(0, (1.004, 2.006), 0.25, True), (1, (3.0, 3.0), None, False)])
    assert table.shown() == [["0", "1.00 to 2.01", "0.2", "yes"], ["1", "3.00", "-", "no"]]
    assert table.heads == ["side", "x [in]", "share", "settled"]


@given(
    st.floats(-1e6, 1e6),
    st.floats(-1e6, 1e6),
    st.sampled_from([".6f", ".2f", ".6g", ".3g", ".10g", ".1e"]),
)
def test_an_interval_that_people_see_holds_the_other(one, other, show):
    ends = sorted((one, other))
    for inward in (False, True):
        texts = Column("x", show=show, ends=True, inward=inward).text(ends).split(" to ")
        for text, end, up in zip((texts[0], texts[-1]), ends, (inward, not inward), strict=True):
            seen, exact = Decimal(text), Decimal(repr(end))
            if one == other:
                assert text == format(end, show)
            else:
                assert seen >= exact if up else seen <= exact
            unit = Decimal(f"1e-{show[1:-1]}") * (1 if show[-1] == "f" else 10 * abs(exact))
            assert abs(seen - exact) <= unit


def test_ends_that_are_none_are_dashes_and_no_shown_interval_is_turned_round():
    x, inside = Column("x", show=".6f", ends=True), Column("x", show=".6g", ends=True, inward=True)
    assert [x.text(ends) for ends in ((math.nan, math.nan), (None, None), (None, 3.0))] == [
        "-",
        "-",
        "- to 3.000000",
    ]
    assert (
        inside.text((1.2345671, 1.2345672)) == "1.2345671 to 1.2345672"
    )  # no number of six digits lies between


def test_a_number_with_few_digits_keeps_them():
    # 1.2 and 0.1 are no floats: 1.2 as a float is less, 0.1 is more
    assert Column("x", show=".6f", ends=True).text((0.1, 1.2)) == "0.100000 to 1.200000"
    assert Column("x", show=".6g", ends=True, inward=True).text((0.1, 1.2)) == "0.1 to 1.2"
    assert Column("x", show=".6f", ends=True).text((-1e-9, math.inf)) == "-0.000001 to inf"
    assert Column("x", show=".6f", ends=True, inward=True).text((-1e-9, 3e300))[:11] == "0.000000 to"


def test_html_is_well_formed_and_escaped():
    table = Table([Column("<i>", "&")], [['<script>alert("1")</script>']], "a < b", "proved")
    tree = ET.fromstring(table.html())
    assert tree.findtext("caption") == "a < b (proved)"
    assert tree.findtext("thead/tr/th") == "<i> [&]"
    assert tree.findtext("tbody/tr/td") == '<script>alert("1")</script>'
    seen = []
    reader = HTMLParser()
    reader.handle_starttag = lambda tag, _: seen.append(tag)
    reader.feed(table.html())
    assert set(seen) == {"table", "caption", "thead", "tr", "th", "tbody", "td"}


def test_of_many_rows_a_notebook_shows_the_ends_and_csv_all():
    table = Table(["k"], [[k] for k in range(1000)])
    cells = [cell.text for cell in ET.fromstring(table.html()).iter("td")]
    assert (cells[0], cells[-1]) == ("0", "999")
    assert "..." in cells
    assert len(cells) < 50
    assert len(read(table.csv())) == 1001


class Answer(Tabled):
    def __init__(self, x):
        self.x = x

    def tables(self):
        table = Table([Column("x", "mm", ".1f")], [[self.x]], "An answer", "sampled, not proved")
        return table, facts("f", {"a": 1})


def test_an_answer_is_shown_saved_and_given_to_pandas(tmp_path):
    answer = Answer(THIRD)
    assert answer._repr_html_().count("<table>") == 2
    file = answer.to_csv(tmp_path / "a.csv")
    assert file.read_bytes() == f"x [mm]\n{THIRD!r}\n".encode()
    answer.to_csv(file)
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
    assert answer.to_dataframe()["x [mm]"].tolist() == [THIRD]
    assert read(joined([answer, Answer(2.0)]).csv())[2] == ["2.0"]


def test_without_pandas_one_line_names_the_extra(monkeypatch):
    from limitsets.base.errors import AnswerError

    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(AnswerError, match=r"pip install 'limitsets\[atlas\]'"):
        Answer(1.0).to_dataframe()


def test_columns_of_text_stand_under_each_other():
    lines = aligned(["a", "long head"], [["wide cell", "b"], ["c", "d"]])
    assert {line.index(word) for line, word in zip(lines, ("long", "b", "d"), strict=True)} == {11}


# ----------------------------------------------------------------
# Progress: counted right, in one place, shown where it lasts, under the cell of a notebook.


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
    told = lines(monkeypatch, *(("designs", k, 100) for k in (0, 99, 100)), ("done", 0, 0))
    steps = ["designs (1 of 100)", "designs (100 of 100)", "designs (100 of 100)", "done (1 of 1)"]
    assert told == [f"limitsets: {step}" for step in steps]


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

        def add_task(self, description, total, number, left):
            task = SimpleNamespace(description=description, total=total, completed=0, number=number)
            self.tasks.append(task)
            return len(self.tasks) - 1

        def update(self, task, **now):
            vars(self.tasks[task]).update(now)

        def stop_task(self, task):
            pass

    monkeypatch.setattr("rich.progress.Progress", Bars)
    with progress._on_terminal() as tell:
        for step, done, of in (("a", 0, 2), ("b", 1, 2), ("cells", 0, 9), ("cells", 5, 9)):
            tell(step, done, of)
    tasks = [(each.description, each.completed, each.total) for each in shown[0].tasks]
    assert tasks == [("b", 2, 2), ("cells", 5, 9)]


def test_the_time_left_goes_with_the_share_that_is_done(monkeypatch):
    """A quarter in 20 s: 60 s are left; a count that begins anew is timed anew; below 10 s nothing is said."""
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    clock = progress._Clock()
    said = []
    for after, done, of in ((0, 0, 8), (20, 2, 8), (580, 3, 8), (10, 7, 8), (5, 0, 4), (4, 1, 4), (1, 3, 4)):
        now[0] += after
        said.append(clock.left(done, of))
    assert said == [
        "",
        ", about 60 s left",
        ", about 17 min left",
        ", about 87 s left",
        "",
        ", about 12 s left",
        "",
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
    texts = [each["data"].get("text/html", "7") for each in outputs[2]]
    assert texts == ["", "7"]  # the bar is gone at the end
    assert outputs[3][0]["text"] == "('<steps>', 0, 4, '') True\n"
    assert "<td>3</td>" in outputs[4][0]["data"]["text/html"]
