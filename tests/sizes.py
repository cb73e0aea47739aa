"""The sizes of the house, measured and held against `tests/sizes.toml`: ``python -m tests.sizes``.

Who adds to the house changes the number there and says why in the same commit; who takes away lowers the number
(``--write`` puts in what is measured).  A statement is a node `ast.stmt` that is no docstring.  The complexity of a
function is 1 and 1 for each branch, loop, handler, condition of a comprehension and further operand of `and` and `or`.
Calls in and of compiled kernels are left out of the calls with many positional arguments: numba takes no keywords.
"""

import ast
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

from tests.lines import PACKAGE, lines_of_code

RECORD = Path(__file__).with_name("sizes.toml")
BRANCHES = (ast.If, ast.IfExp, ast.For, ast.While, ast.ExceptHandler, ast.comprehension, ast.Assert)
COMPILERS = ("kernel", "generic", "formula", "of_entries", "operation")
MOST_COMPLEX = 20
MOST_POSITIONAL = 6


def is_docstring(node: ast.AST) -> bool:
    """Whether a statement is a string that stands alone."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def statements(tree: ast.AST) -> int:
    """Count the statements of a file."""
    return sum(isinstance(node, ast.stmt) and not is_docstring(node) for node in ast.walk(tree))


def complexity(function: ast.FunctionDef) -> int:
    """Cyclomatic complexity of a function, of functions within it too."""
    nodes = list(ast.walk(function))
    operands = sum(len(node.values) - 1 for node in nodes if isinstance(node, ast.BoolOp))
    return 1 + sum(isinstance(node, BRANCHES) for node in nodes) + operands


def is_compiled(function: ast.FunctionDef) -> bool:
    """Whether a decorator compiles the function."""
    decorators = (ast.unparse(each) for each in function.decorator_list)
    return any(word in text for text in decorators for word in COMPILERS) or any(
        ".on(" in ast.unparse(each) for each in function.decorator_list
    )


def compiled_names(trees: list[ast.Module]) -> set[str]:
    """Names of functions that are compiled: those decorated, and those assigned from a compiler."""
    names = set()
    for node in (node for tree in trees for node in ast.walk(tree)):
        if isinstance(node, ast.FunctionDef) and is_compiled(node):
            names.add(node.name)
        elif isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
            compiles = any(word in ast.unparse(node.value.func) for word in COMPILERS)
            names |= {target.id for target in node.targets if compiles and isinstance(target, ast.Name)}
    return names


def calls_of_python(tree: ast.AST, compiled: set[str]) -> Iterator[ast.Call]:
    """Yield the calls outside compiled functions of what is not compiled."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef) and is_compiled(node):
            continue
        if isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] not in compiled:
            yield node
        yield from calls_of_python(node, compiled)


def names_in(tree: ast.AST) -> Iterator[str]:
    """Yield identifiers: names, arguments, keywords, attributes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.arg) or (isinstance(node, ast.keyword) and node.arg):
            yield node.arg
        elif isinstance(node, ast.Attribute):
            yield node.attr


def measured(package: Path = PACKAGE, tests: Path = RECORD.parent) -> dict[str, int]:
    """Measure the package and the tests."""
    sources = {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}
    of_tests = [path.read_text(encoding="utf-8") for path in sorted(tests.rglob("*.py"))]
    trees = [ast.parse(source) for source in sources.values()]
    complexities = [
        complexity(node) for tree in trees for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)
    ]
    compiled = compiled_names(trees)
    calls = (call for tree in trees for call in calls_of_python(tree, compiled))
    return {
        "statements": sum(map(statements, trees)),
        "lines": sum(map(lines_of_code, sources.values())),
        "files": len(sources),
        "entries": sum(path.name != "__pycache__" for path in package.iterdir()),
        "files_of_tests": len(of_tests),
        "lines_of_tests": sum(map(lines_of_code, of_tests)),
        "largest_complexity": max(complexities),
        "complex_functions": sum(each > MOST_COMPLEX for each in complexities),
        "calls_with_many_positional_arguments": sum(len(call.args) > MOST_POSITIONAL for call in calls),
        "identifiers_found": sum(name == "found" for tree in trees for name in names_in(tree)),
    }


def main(words: list[str]) -> int:
    """Print the sizes beside those on record; 1 where one is larger."""
    sizes, record = measured(), tomllib.loads(RECORD.read_text(encoding="utf-8"))
    for name, size in sizes.items():
        note = f"  larger than tests/sizes.toml allows ({record[name]})" if size > record[name] else ""
        print(f"{name.replace('_', ' '):<37} {size:6}{note}")
    if "--write" in words:
        lines = RECORD.read_text(encoding="utf-8").splitlines()
        for k, line in enumerate(lines):
            name = line.partition(" ")[0]
            lines[k] = f"{name} = {sizes[name]}" if name in sizes else line
        RECORD.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return 0
    return int(any(size > record[name] for name, size in sizes.items()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
