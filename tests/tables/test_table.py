"""Tables: what people see, what spreadsheets get, what notebooks show."""

import csv
import io
import math
from html.parser import HTMLParser
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from limitsets.base.tables import Column, Table, Tabled, aligned, facts, joined

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
        return Table([Column("x", "mm", ".1f")], [[self.x]], "An answer", "sampled, not proved"), facts(
            "f", {"a": 1}
        )


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
