"""The cache of compiled code that never lies.

Why a cache of our own.  Numba's disk cache looks at the file of the entry point alone: after an edit of a helper in
another file, an upgrade of the package or a swap of two fields of a NamedTuple it runs the old machine code and
says nothing.  Here the cache folder is named after a digest of every file of the package that can hold a kernel, and
for classes from outside the package the key also covers each file and constant their kernels reach; where one of
those cannot be read, that signature is not cached at all.  The hooks are numba internals, so they stay in this room,
numba is pinned to one minor release, and a test edits a copied helper and expects the new number.  If the internals
are gone, compiled code is simply not kept.
"""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import os
import pickle
import shutil
import sys
import types as python_types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba import types

PACKAGE = Path(__file__).resolve().parents[2]

# Rooms and files without kernels: editing a picture must not throw away every compiled loop.  An import contract keeps
# them from importing this file.
KERNEL_FREE = (
    "__init__.py",
    "__main__.py",
    "base/",
    "checker/",
    "systems/resilience/",
    "feeder/drawing/",
    "feeder/engine/",
    "feeder/goals/",
    "feeder/scattering.py",
    "feeder/scene/",
    "feeder/world.py",
    "proofs/auditing/",
    "proofs/chances/",
    "proofs/policies/",
    "parameters/",
    "cell/",
    "face/",
)

# Digests kept side by side; older ones are deleted when a new one appears.
KEPT_DIGESTS = 8


def _package_digest() -> str:
    """Digest of every source file of the package in which a kernel, or a class kernels are compiled for, may stand."""
    digest = hashlib.sha256(f"{numba.__version__} {np.__version__} {sys.version_info[:2]}".encode())
    for file in sorted(PACKAGE.rglob("*.py")):
        path = file.relative_to(PACKAGE).as_posix()
        if not path.startswith(KERNEL_FREE):
            digest.update(path.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:24]


def _cache_root() -> Path:
    """Where compiled code is kept: NUMBA_CACHE_DIR if set, else the user's cache folder."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen) / "limitsets"
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "limitsets"


def _open_cache() -> Path | None:
    """Make the folder of this very source, delete the oldest others; None where nothing can be written."""
    try:
        root = _cache_root()
        folder = root / _package_digest()
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            others = sorted(root.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
            for old in others[KEPT_DIGESTS:]:
                shutil.rmtree(old, ignore_errors=True)
        return folder if os.access(folder, os.W_OK) else None
    except OSError:
        return None


# ---------------------------------------------------------------- classes from outside the package

# Class of map parameters -> digest of everything its kernels reach, or None where that is not known.
FOREIGN: dict[type, str | None] = {}

# The same class -> classes named in those kernels: they may be registered as maps themselves (what `on_side` returns).
NAMED: dict[type, set[type]] = {}


# Packages that numba, or this file, compiles by itself.
COMPILED = {"numpy", "math", "numba", "limitsets"}


class _UnknownSourceError(Exception):
    """Something a kernel reaches has no source or no value that could be digested."""


def _reached(function: Callable[..., Any], seen: dict[str, bytes], named: set[type]) -> None:
    """Collect into `seen` the file of a function and of all it calls, and the constants they freeze."""
    function = getattr(function, "py_func", function)
    if not isinstance(function, python_types.FunctionType):
        raise _UnknownSourceError
    if is_known(function):
        return
    if hasattr(function, "methods"):  # a generic function: more methods may come
        raise _UnknownSourceError
    file = inspect.getsourcefile(function)
    mark = f"{function.__module__}.{function.__qualname__}"
    if file is None or not Path(file).is_file():
        raise _UnknownSourceError
    if mark in seen:
        return
    # the code too: the file may have been edited since it was imported
    seen[mark] = Path(file).read_bytes() + _code_of(function)
    names = names_in(function)
    scope = {name: function.__globals__[name] for name in names if name in function.__globals__}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        scope[name] = cell.cell_contents
    for name, value in sorted(scope.items()):
        _reached_value(f"{mark}:{name}", value, names, seen, named)


def names_in(function: Callable[..., Any]) -> set[str]:
    """Global names and attributes that a function names."""
    return {name for code in _codes_in(function) for name in code.co_names}


def _codes_in(function: Callable[..., Any]) -> list[python_types.CodeType]:
    """Code of a function and of those defined in it."""
    codes = [function.__code__]
    for code in codes:  # which grows meanwhile
        codes.extend(const for const in code.co_consts if isinstance(const, python_types.CodeType))
    return codes


def _code_of(function: Callable[..., Any]) -> bytes:
    """Write down what a function does, apart from the values of its globals."""
    return repr(
        [
            (
                code.co_code,
                code.co_names,
                [v for v in code.co_consts if not isinstance(v, python_types.CodeType)],
            )
            for code in _codes_in(function)
        ]
    ).encode()


def _reached_value(mark: str, value: Any, names: set[str], seen: dict[str, bytes], named: set[type]) -> None:
    """Collect what a kernel reaches through one global name."""
    if isinstance(value, (bool, int, float, complex, str, bytes, type(None), np.generic)):
        seen[mark] = repr(value).encode()
    elif isinstance(value, np.ndarray) and value.dtype != object:
        seen[mark] = repr((value.shape, value.dtype)).encode() + value.tobytes()
    elif isinstance(value, tuple):
        for k, entry in enumerate(value):
            _reached_value(f"{mark}[{k}]", entry, names, seen, named)
    elif isinstance(value, python_types.ModuleType):
        if value.__name__.split(".")[0] in COMPILED:
            return
        for name in sorted(names & set(vars(value))):
            _reached_value(f"{mark}.{name}", vars(value)[name], names, seen, named)
    elif isinstance(value, type):
        if value.__module__ == "builtins":
            return
        file = inspect.getsourcefile(value)
        if file is None or not Path(file).is_file():
            raise _UnknownSourceError
        seen[mark] = Path(file).read_bytes()
        named.add(value)
    elif getattr(value, "__module__", None) != "builtins" or not callable(value):
        _reached(value, seen, named)


def is_known(value: Any) -> bool:
    """Whether a value is of the package, or of one that numba knows."""
    return (getattr(value, "__module__", None) or "").split(".")[0] in COMPILED


def meaning(value: Any, alive: list[Any], names: frozenset[str] = frozenset()) -> Any:
    """Tell what compiled code would make of a value: equal for two values only if it is the same.

    `names` are those by which the function around reads attributes; `alive` collects what is told by its place in
    memory (functions that numba compiled, with options of their own), and functions met before, which may call
    themselves.
    """
    if isinstance(value, python_types.FunctionType) and not is_known(value):
        if any(value is each for each in alive):
            return "again", [each is value for each in alive].index(True)
        alive.append(value)
        used, scope = frozenset(names_in(value)), value.__globals__
        inside = tuple((name, meaning(scope[name], alive, used)) for name in sorted(used & scope.keys()))
        cells = tuple(meaning(cell.cell_contents, alive, used) for cell in value.__closure__ or ())
        defaults = value.__defaults__, tuple((value.__kwdefaults__ or {}).items())
        return value.__code__, meaning(defaults, alive, used), inside, cells
    if isinstance(value, python_types.ModuleType) and value.__name__.split(".")[0] not in COMPILED:
        own = vars(value)
        return value.__name__, tuple(
            (name, meaning(own[name], alive, names)) for name in sorted(names & own.keys())
        )
    if isinstance(value, bool | int | float | complex | str | bytes | None | np.generic):
        return type(value), repr(value)
    if isinstance(value, np.ndarray) and value.dtype != object:
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, tuple):
        return type(value), tuple(meaning(entry, alive, names) for entry in value)
    alive.append(value)
    return "at", id(value)


def cover_foreign_class(cls: type, functions: list[Callable[..., Any]]) -> None:
    """Make the cache key of every signature with `cls` cover the source that its kernels reach.

    Parameters
    ----------
    cls : type
        A NamedTuple class of map parameters.
    functions : list of callable
        The kernels compiled for it.

    Notes
    -----
    Classes of this package need nothing: its digest names the folder.  A class typed in at a prompt, or a kernel
    that reaches an object without source, gets no key and is compiled anew in each process.
    """
    inside = (cls.__module__ or "").split(".")[0] == "limitsets"
    if inside and all((f.__module__ or "").split(".")[0] == "limitsets" for f in functions):
        return
    seen: dict[str, bytes] = {}
    try:
        if not inside:
            if cls.__module__ == "__main__":  # pickled by value: the class of another run is another class
                raise _UnknownSourceError
            seen["class"] = Path(inspect.getsourcefile(cls) or "").read_bytes()
        for function in functions:
            _reached(function, seen, NAMED.setdefault(cls, set()))
    except (_UnknownSourceError, OSError, TypeError, ValueError):
        FOREIGN[cls] = None
        return
    digest = hashlib.sha256()
    for mark, content in sorted(seen.items()):
        digest.update(mark.encode() + b"\0" + content + b"\0")
    FOREIGN[cls] = digest.hexdigest()[:24]


def classes_in(signature: Any) -> set[type] | None:
    """Classes of NamedTuples in a signature; None where it holds a function."""
    classes: set[type] = set()
    waiting = list(signature)
    while waiting:
        item = waiting.pop()
        cls = getattr(item, "instance_class", None)
        if cls is not None:
            classes.add(cls)
        if isinstance(item, types.BaseTuple):
            waiting.extend(item)
        elif isinstance(item, types.Function | types.Dispatcher):
            return None
    return classes


def _signature_key(signature: Any) -> str | None:
    """Sub-folder for one signature: '' for the package's own classes, None where nothing may be cached."""
    classes = classes_in(signature)
    if classes is None:
        return None
    if any(cls not in FOREIGN and cls.__module__.split(".")[0] != "limitsets" for cls in classes):
        return None
    digests: set[str] = set()
    waiting, done = list(classes), set()
    while waiting:
        cls = waiting.pop()
        if cls in FOREIGN and cls not in done:
            digest = FOREIGN[cls]
            if digest is None:
                return None
            digests.add(digest)
            done.add(cls)
            waiting.extend(NAMED[cls])
    return hashlib.sha256("-".join(sorted(digests)).encode()).hexdigest()[:24] if digests else ""


# ---------------------------------------------------------------- the cache


def _source_cache(folder: Path) -> type | None:
    """Subclass numba's function cache so that it lives in `folder`; None if this numba has other internals."""
    try:
        from numba.core import caching

        class SourceImpl(caching.CompileResultCacheImpl):  # type: ignore[misc]  # numba has no types
            def __init__(self, py_func: Callable[..., Any]) -> None:
                abi = getattr(sys, "abiflags", "")
                line = py_func.__code__.co_firstlineno
                self._lineno = line
                name = f"{py_func.__module__}.{py_func.__qualname__}"
                self._filename_base = f"{name}-{line}.py{sys.version_info[0]}{sys.version_info[1]}{abi}"

            def check_cachable(self, cres: Any) -> bool:
                """Whether machine code can be kept: not where it holds the address of a large table."""
                return not cres.library.has_dynamic_globals

        class SourceCache(caching.FunctionCache):  # type: ignore[misc]  # numba has no types
            _impl_class = SourceImpl

            def __init__(self, py_func: Callable[..., Any]) -> None:
                self._name, self._py_func = repr(py_func), py_func
                self._impl = SourceImpl(py_func)
                self._cache_path = str(folder)
                self._files: dict[tuple[str, str], Any] = {}
                self.enable()

            def _file(self, signature: Any, codegen: Any) -> Any:
                """One pair of files per signature, for numba's index is no safer than its last writer.

                Two processes that compile two signatures at once would take the same file name.
                """
                key = _signature_key(signature)
                if key is None:
                    return None
                word = hashlib.sha256(f"{signature} {codegen.magic_tuple()}".encode()).hexdigest()[:16]
                if (key, word) not in self._files:
                    base = f"{self._impl.filename_base}-{word}"
                    file = caching.IndexDataCacheFile(str(folder / key), base, "named by digest")
                    self._files[key, word] = file
                return self._files[key, word]

            def flush(self) -> None:
                for file in self._files.values():
                    file.flush()

            def _load_overload(self, sig: Any, target_context: Any) -> Any:
                codegen = target_context.codegen()
                file = self._file(sig, codegen)
                if not self._enabled or file is None:
                    return None
                try:
                    data = file.load(self._index_key(sig, codegen))
                except (EOFError, pickle.UnpicklingError):  # cut short: compiled anew
                    with contextlib.suppress(OSError):
                        file.flush()
                    return None
                except OSError:
                    return None
                return None if data is None else self._impl.rebuild(target_context, data)

            def _save_overload(self, sig: Any, data: Any) -> None:
                file = self._file(sig, data.codegen)
                if not self._enabled or file is None or not self._impl.check_cachable(data):
                    return
                try:
                    Path(file._cache_path).mkdir(parents=True, exist_ok=True)
                    file.save(self._index_key(sig, data.codegen), self._impl.reduce(data))
                except OSError:  # a full disk, or a folder just deleted
                    self.disable()

        needed = ("_index_key", "_guard_against_spurious_io_errors", "load_overload", "save_overload")
        return SourceCache if all(hasattr(SourceCache, name) for name in needed) else None
    except (ImportError, AttributeError):
        return None


FOLDER = _open_cache()
CACHE = _source_cache(FOLDER) if FOLDER is not None else None
