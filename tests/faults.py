"""Break the package on purpose and see whether a test notices: ``python -m tests.faults LOG --seed 28 --count 60``.

Places are drawn by the seed: a file with the chance of its lines, then one of its places at random.  Each fault is made
in a copy of the checkout and tried first against the tests that name the room (until the first fails); only where these
notice nothing, against all tests.  LOG has a line for each fault, and a run that was broken off goes on from there.
"""

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from tests.lines import PACKAGE, lines_of_code

ROOT = PACKAGE.parent
OTHER = {
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.FloorDiv: "/",
    ast.Mod: "*",
    ast.And: "or",
    ast.Or: "and",
    ast.Is: "is not",
    ast.IsNot: "is",
    ast.In: "not in",
    ast.NotIn: "in",
}
Place = tuple[int, int, int, int, str]  # line and column, line and column of the end, what is put there


def places(source: str) -> list[Place]:
    """List every fault that one change of an operator, a number, a condition or a statement can make in a file."""
    tree = ast.parse(source)
    flags = {id(node.value) for node in ast.walk(tree) if _is_flag(node)}
    return sorted(
        place for node in ast.walk(tree) if id(node) not in flags for place in _places(node, source)
    )


def _is_flag(node: ast.AST) -> bool:
    """Whether an argument states what holds anyway: ``strict`` of zip, and those of dataclasses."""
    return isinstance(node, ast.keyword) and node.arg in ("strict", "frozen", "eq", "slots", "kw_only")


def _places(node: ast.AST, source: str) -> Iterator[Place]:
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        yield from _between(node.left, node.comparators[0], OTHER[type(node.ops[0])])
    elif isinstance(node, ast.BinOp) and type(node.op) in OTHER:
        yield from _between(node.left, node.right, OTHER[type(node.op)])
    elif isinstance(node, ast.BoolOp):
        yield from _between(node.values[0], node.values[1], OTHER[type(node.op)])
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float, bool):
        other = not node.value if isinstance(node.value, bool) else node.value + 1
        yield *_ends(node), repr(other)
    elif isinstance(node, ast.If | ast.While | ast.IfExp):
        yield *_ends(node.test), f"(not ({ast.get_source_segment(source, node.test)}))"
    elif isinstance(node, ast.AugAssign | ast.Raise) or (
        isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    ):
        yield *_ends(node), "pass"


def _ends(node: ast.AST) -> tuple[int, int, int, int]:
    return node.lineno, node.col_offset, node.end_lineno, node.end_col_offset


def _between(left: ast.AST, right: ast.AST, sign: str) -> Iterator[Place]:
    """Give the operator between two operands on one line, if no bracket stands there."""
    if left.end_lineno == right.lineno:
        yield left.end_lineno, left.end_col_offset, right.lineno, right.col_offset, f" {sign} "


def with_fault(source: str, place: Place) -> str:
    """Return a file's text with one fault; columns of the syntax tree count bytes."""
    line, column, last, end, put = place
    lines = [text.encode() for text in source.splitlines(keepends=True)]
    lines[line - 1 : last] = [lines[line - 1][:column] + put.encode() + lines[last - 1][end:]]
    return b"".join(lines).decode()


def drawn(seed: int, count: int) -> Iterator[tuple[Path, Place]]:
    """Draw faults that leave a file Python."""
    draws, files = random.Random(seed), sorted(PACKAGE.rglob("*.py"))
    sizes = [lines_of_code(file.read_text(encoding="utf-8")) for file in files]
    while count:
        (file,) = draws.choices(files, sizes)
        source = file.read_text(encoding="utf-8")
        if not (possible := places(source)):
            continue
        place = draws.choice(possible)
        try:
            compile(with_fault(source, place), str(file), "exec")
        except SyntaxError:
            continue  # a bracket stood between the operands
        count -= 1
        yield file.relative_to(ROOT), place


def tests_of(file: Path, checkout: Path) -> list[str]:
    """List the tests in the folder of a room's name, those that name the room or their command, and its doctests."""
    room = file.parent
    word, public = ".".join(room.parts), f"ls.{room.name}"
    texts = {
        path.relative_to(checkout): path.read_text(encoding="utf-8")
        for path in (checkout / "tests").rglob("test_*.py")
        if "bench" not in path.parts
    }
    named = [
        path
        for path, text in texts.items()
        if room.name in path.parts or f"{word}." in text or f"{word} " in text or public in text
    ]
    # those that import the file first, then those in the folder of the room's name
    imports = f"{word}.{file.stem} "
    named.sort(key=lambda path: (imports not in texts[path], path.parent.name not in room.parts, path))
    return [*map(str, named), str(room)]


def first_failure(checkout: Path, tests: list[str], workers: str, seconds: float | None = None) -> str:
    """Run tests until one fails and name that one; an empty text where all pass, or the time is over."""
    words = [
        "-m",
        "pytest",
        "-x",
        "-q",
        "-n",
        workers,
        "--dist",
        "worksteal",
        "-p",
        "no:cacheprovider",
        *tests,
    ]
    environment = os.environ | {"PYTHONPATH": str(checkout), "CI": "1"}
    try:
        run = subprocess.run(
            [sys.executable, *words],
            cwd=checkout,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=seconds,
        )
    except subprocess.TimeoutExpired:
        return ""
    if run.returncode in (0, 5):  # all passed, or there were none
        return ""
    failed = [line for line in run.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return failed[0] if failed else (run.stdout + run.stderr)[-300:]


def fails_anyway(checkout: Path, noticed: str) -> bool:
    """Whether the test that noticed a fault fails without the fault too."""
    test = noticed.removeprefix("FAILED ").partition(" - ")[0]
    return noticed.startswith("FAILED ") and bool(first_failure(checkout, [test], "0"))


def main() -> int:
    """Try the faults that the log does not have; 1 if some are noticed by no test."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("log", type=Path)
    parser.add_argument("--seed", type=int, default=28)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--workers", default="2")
    parser.add_argument("--seconds", type=float, help="most time for the tests of one room")
    parser.add_argument("--rooms-only", action="store_true", help="leave out the run of all tests")
    words = parser.parse_args()
    log = [json.loads(line) for line in words.log.read_text().splitlines()] if words.log.exists() else []
    known = {(entry["file"], *entry["place"]) for entry in log}
    with tempfile.TemporaryDirectory() as scratch:
        checkout = Path(scratch) / "checkout"
        shutil.copytree(
            ROOT, checkout, ignore=shutil.ignore_patterns(".venv", "__pycache__", "build", ".git")
        )
        if (beside := ROOT.parent / "shared").exists():  # tables that some tests read
            (Path(scratch) / "shared").symlink_to(beside.resolve())
        for number, (file, place) in enumerate(drawn(words.seed, words.count)):
            if (str(file), *place) in known:
                continue
            source, begin = (ROOT / file).read_text(encoding="utf-8"), time.perf_counter()
            (checkout / file).write_text(with_fault(source, place), encoding="utf-8")
            noticed = first_failure(checkout, tests_of(file, checkout), words.workers, words.seconds)
            if not noticed and not words.rooms_only:
                noticed = first_failure(checkout, ["tests", "limitsets"], words.workers)
            (checkout / file).write_text(source, encoding="utf-8")
            if fails_anyway(checkout, noticed):
                parser.error(f"{noticed}\n  fails without the fault too: mend that test first")
            entry = {"file": str(file), "place": place, "line": source.splitlines()[place[0] - 1].strip()}
            entry |= {"noticed": noticed, "seconds": round(time.perf_counter() - begin)}
            log.append(entry)
            with words.log.open("a") as file_of_log:
                file_of_log.write(json.dumps(entry) + "\n")
            print(f"{number:3} {file}:{place[0]} {'noticed' if noticed else 'NOT NOTICED'}", flush=True)
    missed = [entry for entry in log if not entry["noticed"]]
    print(f"{len(log) - len(missed)} of {len(log)} faults noticed")
    return int(bool(missed))


if __name__ == "__main__":
    sys.exit(main())
