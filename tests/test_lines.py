"""The count of lines of code, on files that are counted by hand."""

from tests import lines

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
    assert {"thrower", "checker", "."} <= rooms.keys()
    assert 10_000 < sum(sum(files.values()) for files in rooms.values()) < 100_000
