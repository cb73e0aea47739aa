"""Count the lines of code of the package: physical lines of *.py less blank, comment and docstring lines.

Run it as ``python -m tests.lines [FOLDER]``; the folder is that of `limitsets` in this checkout if none is named.  A
line that holds code and a comment is code; a string that stands alone as a statement is a docstring.  Lines of other
files (scenes, templates) are told apart: what moved there was not saved.
"""

import ast
import io
import statistics
import sys
import tokenize
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "limitsets"

NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


def lines_of_code(source: str) -> int:
    """Count the lines of one file's source."""
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in NO_CODE:
            code.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(source)):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            code.difference_update(range(node.lineno, node.end_lineno + 1))
    return len(code)


def counted(folder: Path) -> dict[str, dict[Path, int]]:
    """Lines of code of each file, room by room; files beside the rooms are the room '.'."""
    rooms: dict[str, dict[Path, int]] = {}
    for file in sorted(folder.rglob("*.py")):
        path = file.relative_to(folder)
        room = path.parts[0] if len(path.parts) > 1 else "."
        rooms.setdefault(room, {})[path] = lines_of_code(file.read_text(encoding="utf-8"))
    return rooms


def other_lines(folder: Path) -> dict[str, int]:
    """Lines of the files that are not Python, by their suffix."""
    lines: dict[str, int] = {}
    for file in sorted(folder.rglob("*")):
        if file.is_file() and file.suffix not in (".py", ".pyc"):
            lines[file.suffix] = lines.get(file.suffix, 0) + len(file.read_bytes().splitlines())
    return lines


def row(name: str, files: dict[Path, int]) -> str:
    """Line of the table for some files."""
    largest = max(files, key=lambda path: files[path])
    numbers = f"{sum(files.values()):6} {len(files):6} {statistics.median(files.values()):7.0f}"
    return f"{name:<12} {numbers} {files[largest]:8}  {largest}"


def main(folder: Path) -> None:
    """Print the table."""
    rooms = counted(folder)
    print(f"{'room':<12} {'lines':>6} {'files':>6} {'median':>7} {'largest':>8}")
    for room in sorted(rooms, key=lambda room: -sum(rooms[room].values())):
        print(row(room, rooms[room]))
    print(row("all", {path: lines for files in rooms.values() for path, lines in files.items()}))
    for suffix, lines in other_lines(folder).items():
        print(f"{'*' + suffix:<12} {lines:6}  not counted")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else PACKAGE)
