"""The count of lines of code and the sizes of the house, on files that are counted by hand."""

import ast

from tests import lines, sizes

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
