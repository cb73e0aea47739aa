"""The only file that imports numba: the decorators of all compiled code, and the cache that never lies.

Three words are used elsewhere:

``kernel``
    Compiles a function for estimates: a multiplication and an addition may be contracted into one instruction.
    Plain ``@kernel`` is for small pieces, which are inlined where they are called (a call costs 80 ns and stops
    the loop from vectorising); ``@kernel(entry=True)`` is for a loop over whole arrays called from Python, the
    only kind that is kept on disk.
``proof_kernel``
    The same without contraction, for arithmetic whose rounding a proof relies on.
``generic``
    A function whose method is chosen by the class of its first argument, at compile time.

Why a cache of our own.  Numba's disk cache looks at the file of the entry point alone: after an edit of a helper in
another file, an upgrade of the package or a swap of two fields of a NamedTuple it runs the old machine code and
says nothing.  Here the cache folder is named after a digest of every file of the package that can hold a kernel, and
for classes from outside the package the key also covers each file and constant their kernels reach; where one of
those cannot be read, that signature is not cached at all.  The hooks are numba internals, so they stay in this file,
numba is pinned to one minor release, and a test edits a copied helper and expects the new number.  If the internals
are gone, compiled code is simply not kept.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import linecache
import os
import pickle
import re
import shutil
import sys
import types as python_types
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, Protocol, TypeVar, overload

import numba
import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.core.errors import NumbaError
from numba.core.registry import cpu_target

from limitsets.errors import LimitsetsError, MapError

__all__ = [
    "corners_as_numbers",
    "cover_foreign_class",
    "entries_of",
    "entry_of",
    "formula",
    "generic",
    "kernel",
    "mark_undefined",
    "named_tuple_class",
    "number",
    "of_entries",
    "operation",
    "proof_kernel",
    "take_mark",
    "with_entry",
]

F = TypeVar("F", bound=Callable[..., Any])
P = ParamSpec("P")
R = TypeVar("R", covariant=True)
T = TypeVar("T")

PACKAGE = Path(__file__).resolve().parent

# Rooms without kernels: editing a picture must not throw away every compiled loop.  An import contract keeps
# them from importing this file.
KERNEL_FREE = {
    "checker",
    "scene",
    "goals",
    "engine",
    "auditing",
    "analysis",
    "robust",
    "inverse",
    "plot",
    "report",
    "cli",
}

# Digests kept side by side; older ones are deleted when a new one appears.
KEPT_DIGESTS = 8

_COMMON = {"nopython": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_ESTIMATE = {**_COMMON, "fastmath": {"contract"}}
_PROOF = {**_COMMON, "fastmath": False}
_OVERLOAD = ("error_model", "fastmath")  # what an overload takes of these


def _package_digest() -> str:
    """Digest of every source file of the package in which a kernel, or a class kernels are compiled for, may stand."""
    digest = hashlib.sha256(f"{numba.__version__} {np.__version__} {sys.version_info[:2]}".encode())
    for file in sorted(PACKAGE.rglob("*.py")):
        path = file.relative_to(PACKAGE)
        if path.parts[0] not in KERNEL_FREE:
            digest.update(path.as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
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
_FOREIGN: dict[type, str | None] = {}

# The same class -> classes named in those kernels: they may be registered as maps themselves (what `on_side` returns).
_NAMED: dict[type, set[type]] = {}


# Packages that numba, or this file, compiles by itself.
_COMPILED = {"numpy", "math", "numba", "limitsets"}


class _UnknownSourceError(Exception):
    """Something a kernel reaches has no source or no value that could be digested."""


def _reached(function: Callable[..., Any], seen: dict[str, bytes], named: set[type]) -> None:
    """Collect into `seen` the file of a function and of all it calls, and the constants they freeze."""
    function = getattr(function, "py_func", function)
    if not isinstance(function, python_types.FunctionType):
        raise _UnknownSourceError
    module = function.__module__ or ""
    if module.split(".")[0] in _COMPILED:
        return
    if hasattr(function, "methods"):  # a generic function: more methods may come
        raise _UnknownSourceError
    file = inspect.getsourcefile(function)
    mark = f"{module}.{function.__qualname__}"
    if file is None or not Path(file).is_file():
        raise _UnknownSourceError
    if mark in seen:
        return
    seen[mark] = Path(file).read_bytes()
    names = _names_in(function)
    scope = {name: function.__globals__[name] for name in names if name in function.__globals__}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        scope[name] = cell.cell_contents
    for name, value in sorted(scope.items()):
        _reached_value(f"{mark}:{name}", value, names, seen, named)


def _names_in(function: Callable[..., Any]) -> set[str]:
    """Global names and attributes that a function names."""
    names: set[str] = set()
    codes = [function.__code__]
    while codes:
        code = codes.pop()
        names.update(code.co_names)
        codes.extend(const for const in code.co_consts if isinstance(const, python_types.CodeType))
    return names


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
        if value.__name__.split(".")[0] in _COMPILED:
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
            _reached(function, seen, _NAMED.setdefault(cls, set()))
    except (_UnknownSourceError, OSError, TypeError, ValueError):
        _FOREIGN[cls] = None
        return
    digest = hashlib.sha256()
    for mark, content in sorted(seen.items()):
        digest.update(mark.encode() + b"\0" + content + b"\0")
    _FOREIGN[cls] = digest.hexdigest()[:24]


# Plain functions that kernels from outside call, compiled: (function, whether for proofs) -> what stands in its place.
_HELPERS: dict[tuple[Any, bool], Any] = {}


def _is_plain(value: Any) -> bool:
    """Whether a value is a function that numba knows nothing of."""
    if not isinstance(value, python_types.FunctionType) or hasattr(value, "methods"):
        return False
    if (value.__module__ or "").split(".")[0] in _COMPILED:
        return False
    cpu_target.typing_context.refresh()
    try:
        cpu_target.typing_context.resolve_value_type(value)
    except (NumbaError, ValueError):
        return True
    return False


def _compiled_helpers(function: Callable[..., Any], proof: bool) -> dict[str, Any]:
    """Names by which a function calls plain ones -> those compiled, and so for all that they call."""
    scope, names = function.__globals__, _names_in(function)
    return _compiled_values({name: scope[name] for name in names & scope.keys()}, names, proof)


def _compiled_values(values: dict[str, Any], names: set[str], proof: bool) -> dict[str, Any]:
    """Those of the values in whose place another one has to stand."""
    found = {}
    for name, value in values.items():
        if _is_plain(value):
            found[name] = _helper(value, proof)
        elif isinstance(value, python_types.ModuleType) and value.__name__.split(".")[0] not in _COMPILED:
            own = vars(value)
            inside = _compiled_values({key: own[key] for key in names & own.keys()}, names, proof)
            if inside:
                found[name] = python_types.ModuleType(value.__name__)
                vars(found[name]).update(own, **inside)
    return found


def _in_scope(function: Callable[..., Any], scope: dict[str, Any]) -> Any:
    """Return the function with other globals."""
    code, defaults, cells = function.__code__, function.__defaults__, function.__closure__
    copy = python_types.FunctionType(code, scope, function.__name__, defaults, cells)
    copy.__qualname__, copy.__kwdefaults__ = function.__qualname__, function.__kwdefaults__
    return copy


def _helper(function: Callable[..., Any], proof: bool) -> Any:
    if (function, proof) not in _HELPERS:
        scope = dict(function.__globals__)
        _HELPERS[function, proof] = _compile(
            _in_scope(function, scope), _PROOF if proof else _ESTIMATE, False
        )
        scope.update(_compiled_helpers(function, proof))  # last: a helper may call itself
    return _HELPERS[function, proof]


def _with_helpers(function: Callable[..., Any], proof: bool) -> Callable[..., Any]:
    """Return a kernel whose plain helpers are compiled; itself where it has none, as all of the package."""
    if (function.__module__ or "").split(".")[0] == "limitsets":
        return function
    found = _compiled_helpers(function, proof)
    return _in_scope(function, {**function.__globals__, **found}) if found else function


def _classes(signature: Any) -> set[type] | None:
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
    classes = _classes(signature)
    if classes is None:
        return None
    if any(cls not in _FOREIGN and cls.__module__.split(".")[0] != "limitsets" for cls in classes):
        return None
    digests: set[str] = set()
    waiting, done = list(classes), set()
    while waiting:
        cls = waiting.pop()
        if cls in _FOREIGN and cls not in done:
            digest = _FOREIGN[cls]
            if digest is None:
                return None
            digests.add(digest)
            done.add(cls)
            waiting.extend(_NAMED[cls])
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


_folder = _open_cache()
_CACHE = _source_cache(_folder) if _folder is not None else None


# What numba says around the cause of a failure.
_AROUND = re.compile(
    r"Failed in nopython|No implementation of|>>>|There (is|are) |- Of which|Overload in|With argument|Rejected as"
    r"|TypingError: Failed|File |During:|raised from|def |<source elided>|\^|$"
)
_KERNEL = re.compile(
    r"\b(image|image_on|image_box|on_side|on_side_box|fallback_box|margin|displacement|scattered)\("
)

NUMBERS_DO = (
    "+ - * /, whole powers, abs, min and max of two, and of math or numpy sqrt exp log sin cos tan tanh atan2 floor; "
    "no comparison"
)


def _explained(error: Exception, cls: type) -> MapError:
    """Say in one line why the kernels of a class from outside do not compile."""
    lines = [line.strip() for line in str(error).splitlines()]
    cause = next((line for line in lines if not _AROUND.match(line)), type(error).__name__)
    cause = re.sub(r", defined at .*", "", cause.removeprefix("TypingError: "))
    named = next((found for line in lines if (found := _KERNEL.search(line))), None)
    kernel = f"the kernel {named[1]} of {cls.__name__}" if named else f"a kernel of {cls.__name__}"
    places = (re.match(r'File "(.*)", line (\d+)', line) for line in lines)
    spots = ((Path(at[1]).resolve(), int(at[2])) for at in places if at)
    own = (PACKAGE, Path(numba.__file__).parent)
    spot = next((at for at in spots if not any(folder in at[0].parents for folder in own)), None)
    place = f"{spot[0].name}, line {spot[1]}" if spot else ""
    where = f"correct {place}" if place else "correct the kernel"
    if spot and any("Interval(float64)" in line for line in lines):  # a box, of a kernel for plain numbers
        file, number = str(spot[0]), spot[1]
        above = (re.match(r"\s*def (\w+)", linecache.getline(file, k)) for k in range(number, 0, -1))
        name = next((found[1] for found in above if found), "the kernel")
        return MapError(
            f"what {name} of {cls.__name__} does with x or a parameter ({place})",
            linecache.getline(file, number).strip(),
            f"for boxes: {NUMBERS_DO}",
            "register image_on for each branch, with margin; or an image_box",
        )
    if field := re.match(r"Unknown attribute '(\w+)' of type", cause):
        fields = ", ".join(getattr(cls, "_fields", ()))
        return MapError(
            f"a field that {kernel} reads", field[1], f"a field of its parameters ({fields})", where
        )
    if count := re.search(r"wrong tuple length .*expected (\d+), got (\d+)", cause):
        return MapError(
            f"what {kernel} returns",
            f"{count[2]} values",
            f"{count[1]} values",
            f"see `limitsets.maps.contract`; {where}",
        )
    if single := re.match(r"failed to unpack (.*)", cause):
        return MapError(
            f"what {kernel} returns", single[1], "a tuple", f"see `limitsets.maps.contract`; {where}"
        )
    return MapError(kernel, cause, "what numba compiles", where)


# Loops over whole arrays run two vectors side by side: one throw is a chain of dependent operations several times
# longer than the processor looks ahead, and LLVM on its own sees no reason to interleave so long a loop.
INTERLEAVE = 2


def _interleaved(dispatcher: Any) -> None:
    """Set LLVM's interleaving for this dispatcher's compilations only: the option is the whole process's."""
    from llvmlite import binding

    plain = dispatcher._compiler.compile

    def compile_interleaved(*args: Any) -> Any:
        binding.set_option("limitsets", f"-force-vector-interleave={INTERLEAVE}")
        try:
            return plain(*args)
        except LimitsetsError:
            raise
        except Exception as error:
            cls = next((cls for cls in _classes(args[0]) or () if cls in _FOREIGN), None)
            if cls is None:
                raise
            raise _explained(error, cls) from None
        finally:
            binding.set_option("limitsets", "-force-vector-interleave=0")

    dispatcher._compiler.compile = compile_interleaved


def _compile(function: F, options: dict[str, Any], entry: bool) -> F:
    dispatcher = numba.jit(**options, forceinline=not entry)(function)
    if entry and hasattr(dispatcher, "_compiler"):
        _interleaved(dispatcher)
    # The folder's name vouches for the package's own files only: a loop defined elsewhere is not kept.
    inside = PACKAGE in Path(function.__code__.co_filename).resolve().parents
    if entry and inside and _CACHE is not None and hasattr(dispatcher, "_cache"):
        dispatcher._cache = _CACHE(function)
    return dispatcher  # type: ignore[no-any-return]  # a dispatcher is called like the function


@overload
def kernel(function: F) -> F: ...
@overload
def kernel(*, entry: bool) -> Callable[[F], F]: ...
def kernel(function: Any = None, *, entry: bool = False) -> Any:
    """Compile for estimates (contraction allowed); ``entry=True`` for a loop called from Python.

    Parameters
    ----------
    function : callable
        A module-level function of numbers, arrays and NamedTuples.
    entry : bool
        True for a loop over whole arrays: kept on disk, not inlined.

    Examples
    --------
    >>> from limitsets.jit import kernel
    >>> @kernel
    ... def half(x):
    ...     return 0.5 * x
    >>> half(3.0)
    1.5
    """
    if function is None:
        return lambda f: _compile(f, _ESTIMATE, entry)
    return _compile(function, _ESTIMATE, entry)


@overload
def proof_kernel(function: F) -> F: ...
@overload
def proof_kernel(*, entry: bool) -> Callable[[F], F]: ...
def proof_kernel(function: Any = None, *, entry: bool = False) -> Any:
    """Compile without contraction: every operation rounds as written.  Arguments as for `kernel`.

    Examples
    --------
    >>> from limitsets.jit import proof_kernel
    >>> @proof_kernel
    ... def residual(a, b, c):
    ...     return a * b - c
    >>> residual(1.0 + 2.0**-30, 1.0 - 2.0**-30, 1.0)  # contracted it would be -2^-60
    0.0
    """
    if function is None:
        return lambda f: _compile(f, _PROOF, entry)
    return _compile(function, _PROOF, entry)


# ---------------------------------------------------------------- the mark of what is not defined

# Compiled code notes here that a function was asked beyond where it is defined.  A proof kernel gives back bare
# intervals, which cannot say it: the loop that asked it takes the mark afterwards.
_MARK, _BYTE = "limitsets_mark", ir.IntType(8)


def _mark_of(builder: Any) -> Any:
    """Return the byte of the mark, one for all that is linked together."""
    found = builder.module.globals.get(_MARK)
    if found is None:
        found = ir.GlobalVariable(builder.module, _BYTE, _MARK)
        found.linkage, found.initializer = "linkonce_odr", ir.Constant(_BYTE, 0)
    return found


@extending.intrinsic  # type: ignore[untyped-decorator]  # numba has no types
def mark_undefined(typing: Any, wrong: Any) -> Any:
    """Set the mark where `wrong` is true, in compiled code."""

    def store(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        mark = _mark_of(builder)
        builder.store(builder.or_(builder.load(mark), builder.zext(args[0], _BYTE)), mark)
        return context.get_dummy_value()

    return types.none(types.boolean), store


@extending.intrinsic  # type: ignore[untyped-decorator]  # numba has no types
def take_mark(typing: Any) -> Any:
    """Whether the mark was set since it was taken last, in compiled code; it no longer is."""

    def take(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        mark = _mark_of(builder)
        was = builder.icmp_unsigned("!=", builder.load(mark), _BYTE(0))
        builder.store(_BYTE(0), mark)
        return was

    return types.boolean(), take


# ---------------------------------------------------------------- numbers that are not floats


class _NumberType(types.Type):  # type: ignore[misc]  # numba has no types
    """How numba sees a number of two entries of one type: floats, numbers, or arrays with an entry for each side."""

    def __init__(self, cls: type, entry: Any) -> None:
        self.cls, self.entry = cls, entry
        super().__init__(name=f"{cls.__qualname__}({entry})")

    def unify(self, context: Any, other: Any) -> Any:
        """Return the type of a variable that is this number on one path and a plainer one on another: this."""
        return self if isinstance(other, types.Number) or other == self.entry else None

    def can_convert_from(self, context: Any, other: Any) -> Any:
        fits = isinstance(other, types.Number) or other == self.entry
        return numba.core.typeconv.Conversion.safe if fits else None


def number(*, twice: bool) -> Callable[[type[T]], type[T]]:
    """Make a class of two entries a number in compiled code: constructed by its name, its fields read by theirs.

    The entries are two floats, two numbers of one type, or two arrays.  What the number can do is added by `operation`.

    Parameters
    ----------
    twice : bool
        Whether a plainer number has both entries equal to itself; else the second is 0.
    """

    def made(cls: type[T]) -> type[T]:
        if twice:
            _TWICE.add(cls)
        return _number(cls)

    return made


def _number(cls: type[T]) -> type[T]:
    first, _ = _FIELDS[cls] = tuple(cls.__annotations__)

    def typer(context: Any) -> Any:
        def typed(one: Any, two: Any) -> Any:
            plain = all(isinstance(each, types.Number) for each in (one, two))
            entry = types.float64 if plain else one
            fits = plain or (one == two and isinstance(one, _NumberType | types.Array))
            return numba.core.typing.signature(_NumberType(cls, entry), entry, entry) if fits else None

        return typed

    def made(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        found = _structure(context, builder, signature.return_type, *args)
        return numba.core.imputils.impl_ret_borrowed(context, builder, signature.return_type, found)

    extending.type_callable(cls)(typer)
    extending.typeof_impl.register(cls)(
        lambda value, c: _NumberType(cls, extending.typeof_impl(getattr(value, first), c))
    )
    extending.lower_builtin(cls, types.Any, types.Any)(made)
    return cls


_FIELDS: dict[type, tuple[str, ...]] = {}
_TWICE: set[type] = set()


def _structure(context: Any, builder: Any, kind: _NumberType, one: Any, two: Any) -> Any:
    """Put two values together, while code is generated."""
    found = cgutils.create_struct_proxy(kind)(context, builder)
    for name, value in zip(_FIELDS[kind.cls], (one, two), strict=True):
        setattr(found, name, value)
    return found._getvalue()


@extending.register_model(_NumberType)
class _NumberModel(extending.models.StructModel):  # type: ignore[misc]  # numba has no types
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [(name, kind.entry) for name in _FIELDS[kind.cls]])


@extending.lower_cast(types.Number, _NumberType)  # type: ignore[untyped-decorator]  # numba has no types
@extending.lower_cast(_NumberType, _NumberType)  # type: ignore[untyped-decorator]  # numba has no types
def _from_plainer(context: Any, builder: Any, plain: Any, kind: Any, value: Any) -> Any:
    """Lift a plainer number where code asks for this one on another path."""
    one = context.cast(builder, value, plain, kind.entry)
    zero = context.get_constant(types.float64, 0.0)
    two = one if kind.cls in _TWICE else context.cast(builder, zero, types.float64, kind.entry)
    return _structure(context, builder, kind, one, two)


@extending.infer_getattr
class _NumberFields(numba.core.typing.templates.AttributeTemplate):  # type: ignore[misc]  # numba has no types
    key = _NumberType

    def generic_resolve(self, kind: Any, name: str) -> Any:
        return kind.entry if name in _FIELDS[kind.cls] else None


@extending.lower_getattr_generic(_NumberType)  # type: ignore[untyped-decorator]  # numba has no types
def _read_field(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    field = getattr(cgutils.create_struct_proxy(kind)(context, builder, value=value), name)
    return numba.core.imputils.impl_ret_borrowed(context, builder, kind.entry, field)


@extending.box(_NumberType)  # type: ignore[untyped-decorator]  # numba has no types
def _to_python(kind: Any, value: Any, c: Any) -> Any:
    found = cgutils.create_struct_proxy(kind)(c.context, c.builder, value=value)
    fields = [c.box(kind.entry, getattr(found, name)) for name in _FIELDS[kind.cls]]
    cls = c.pyapi.unserialize(c.pyapi.serialize_object(kind.cls))
    made = c.pyapi.call_function_objargs(cls, fields)
    for each in (*fields, cls):
        c.pyapi.decref(each)
    return made


@extending.unbox(_NumberType)  # type: ignore[untyped-decorator]  # numba has no types
def _from_python(kind: Any, instance: Any, c: Any) -> Any:
    made = cgutils.create_struct_proxy(kind)(c.context, c.builder)
    for name in _FIELDS[kind.cls]:
        field = c.pyapi.object_getattr_string(instance, name)
        setattr(made, name, c.unbox(kind.entry, field).value)
        c.pyapi.decref(field)
    return extending.NativeValue(
        made._getvalue(), is_error=cgutils.is_not_null(c.builder, c.pyapi.err_occurred())
    )


def operation(
    stub: Callable[..., Any],
    cls: type,
    method: Callable[..., Any],
    *,
    left: Callable[..., Any] | None = None,
    right: Callable[..., Any] | None = None,
    beside: tuple[type, ...] = (),
) -> None:
    """Give a number a method of an operator, or of any function of Python, in compiled code.

    Parameters
    ----------
    stub : callable
        The operator of the module `operator`, or the function.
    cls : type
        The class of the number; the other arguments may be plain numbers.  `float` stands for plain numbers alone:
        their methods may be contracted, all others are not.
    method : callable
        A module-level function.
    left, right : callable, optional
        The methods where only the first of two arguments is of the class, and where only the second is; as `method`.
    beside : tuple of type
        Classes of numbers that may stand beside this one as plain ones may.
    """

    def choose(*args: Any) -> Callable[..., Any] | None:
        mine = [number_class(each) is cls for each in args]
        plain = [isinstance(each, types.Number) or number_class(each) in beside for each in args]
        if cls is float:
            return method if all(plain) else None
        if not (any(mine) and all(np.logical_or(mine, plain))):
            return None
        return (left or method) if not mine[-1] else (right or method) if not mine[0] else method

    given = _ESTIMATE if cls is float else _PROOF
    options = {**{key: given[key] for key in _OVERLOAD}, "forceinline": True}
    extending.overload(stub, jit_options=options, strict=False)(choose)


def corners_as_numbers(number: type, array: type) -> Callable[[Any, Any], Any]:
    """Make the function, for compiled code, that puts two NamedTuples of one class together, entry by entry.

    Parameters
    ----------
    number, array : type
        What two floats become, and what two arrays become.

    Returns
    -------
    callable
        ``f(lo, hi)``: a NamedTuple of the same class.  What is no float, array or NamedTuple is taken from `lo`.
    """

    def joined(kind: Any) -> Any:
        if isinstance(kind, types.BaseNamedTuple):
            return types.BaseTuple.from_types([joined(each) for each in kind], kind.instance_class)
        if isinstance(kind, types.Float):
            return _NumberType(number, kind)
        return _NumberType(array, kind) if isinstance(kind, types.Array) else kind

    def value(context: Any, builder: Any, kind: Any, lo: Any, hi: Any) -> Any:
        made = joined(kind)
        if isinstance(kind, types.BaseNamedTuple):
            entries = [
                value(context, builder, each, *(builder.extract_value(end, k) for end in (lo, hi)))
                for k, each in enumerate(kind)
            ]
            return context.make_tuple(builder, made, entries)
        return _structure(context, builder, made, lo, hi) if isinstance(made, _NumberType) else lo

    @extending.intrinsic  # type: ignore[untyped-decorator]  # numba has no types
    def together(typing: Any, lo: Any, hi: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            found = value(context, builder, lo, *args)
            return numba.core.imputils.impl_ret_borrowed(context, builder, signature.return_type, found)

        return (joined(lo)(lo, hi), code) if lo == hi else None

    return together  # type: ignore[no-any-return]  # numba has no types


def of_entries(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a kernel of one entry a kernel of a tuple: ``f(entries, *more)`` is that of ``function(entry, k, *more)``.

    The entries may be of several types; the answer is a tuple of as many.  For proofs, in compiled code.
    """
    compiled = _compile(function, _PROOF, False)

    @functools.wraps(function)
    def each(entries: Any, *more: Any) -> Any:
        return tuple(function(entry, k, *more) for k, entry in enumerate(entries))

    def choose(entries: Any, *more: Any) -> Callable[..., Any] | None:
        if not isinstance(entries, types.BaseTuple):
            return None
        # Compiled code makes a tuple of a length that is written down.
        calls = "".join(f"of(entries[{k}], {k}, *more), " for k in range(len(entries)))
        scope: dict[str, Any] = {"of": compiled}
        exec(f"def method(entries, *more):\n    return ({calls})", scope)  # noqa: S102  # our own text
        return scope["method"]  # type: ignore[no-any-return]

    options = {**{key: _PROOF[key] for key in _OVERLOAD}, "forceinline": True}
    extending.overload(each, jit_options=options, strict=False)(choose)
    return each


def formula(function: F) -> F:
    """Let compiled code run a plain function, inlined, on whatever numbers it is given; Python runs it as it stands.

    Operations on floats may be contracted; those of other numbers are their own.
    """
    options = {**{key: _ESTIMATE[key] for key in _OVERLOAD}, "forceinline": True}
    extending.overload(function, jit_options=options, strict=False)(lambda *args: function)
    return function


entries_of = numba.literal_unroll
"""Loop over the entries of a tuple of several classes, in compiled code."""


def number_class(numba_type: Any) -> type | None:
    """Class of a number that `number` made, as numba sees it; None for any other type."""
    return numba_type.cls if isinstance(numba_type, _NumberType) else None


def named_tuple_class(numba_type: Any) -> type | None:
    """Class of a NamedTuple as numba sees it, None for any other type."""
    return getattr(numba_type, "instance_class", None) if isinstance(numba_type, types.BaseTuple) else None


class Generic(Protocol[P, R]):
    """A function whose method is chosen by the class of its first argument: what `generic` makes of a stub."""

    methods: dict[Any, Callable[..., Any]]

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R: ...

    def on(self, key: type | int, method: Callable[..., Any]) -> None:
        """Add the method of a class, or of plain tuples of a length: a module-level function."""


def entry_of(entries: Any, cls: type) -> Any:
    """Return the entry of a class in a tuple of several classes, None where there is none; chosen at compile time."""
    return next((entry for entry in entries if type(entry) is cls), None)


def with_entry(entries: Any, entry: Any) -> Any:
    """Return a tuple with its entry of the same class replaced."""
    return tuple(entry if type(each) is type(entry) else each for each in entries)


def _place_of(entries: Any, cls: type | None) -> int | None:
    """Where a tuple has its entry of a class, as numba sees it."""
    return next((k for k, each in enumerate(entries) if named_tuple_class(each) is cls), None)


def _choose_entry(entries: Any, cls: Any) -> Callable[..., Any]:
    at = _place_of(entries, cls.instance_class)
    return (lambda entries, cls: None) if at is None else (lambda entries, cls: entries[at])


def _choose_with(entries: Any, entry: Any) -> Callable[..., Any] | None:
    at = _place_of(entries, named_tuple_class(entry))
    if at is None:
        return None
    after = at + 1
    return lambda entries, entry: entries[:at] + (entry,) + entries[after:]  # noqa: RUF005 - numba has no unpacking


for _stub, _choose in ((entry_of, _choose_entry), (with_entry, _choose_with)):
    extending.overload(_stub, jit_options={"forceinline": True}, strict=False)(_choose)


@overload
def generic(stub: Callable[P, R]) -> Generic[P, R]: ...
@overload
def generic(
    *,
    proof: bool = False,
    inlined: bool = True,
    default: Callable[..., Any] | None = None,
    chained: bool = False,
) -> Callable[[Callable[P, R]], Generic[P, R]]: ...
def generic(
    stub: Any = None,
    *,
    proof: bool = False,
    inlined: bool = True,
    default: Callable[..., Any] | None = None,
    chained: bool = False,
) -> Any:
    """Make a function whose method is chosen by the class of its first argument.

    Parameters
    ----------
    stub : callable
        A module-level function that names the arguments; its body is never compiled.
    proof : bool
        Compile the methods without contraction.
    inlined : bool
        False for a method that is rarely called: it then costs the loops around it no compile time.
    default : callable, optional
        The method of every class that has none of its own.
    chained : bool
        The arguments are an entry and a value, which the method gives back changed.  Called with a tuple of several
        classes the function runs the methods of its entries in their order, each on the value that the last one gave;
        an entry without one is not in the machine code.

    Returns
    -------
    callable
        The stub, a `Generic`: ``stub.on(Class, method)`` adds a module-level method.  For a plain tuple
        the key is its length instead.  In compiled code the choice is made at compile time.

    Notes
    -----
    The table is read by one numba overload per generic function.  A method is never passed as an argument nor kept
    in a closure: numba does not cache such code (numba issues 2065, 2952, 6264).
    """
    if stub is None:
        return lambda f: _generic(f, proof, inlined, default, chained)
    return _generic(stub, proof, inlined, default, chained)


def _handed_on(entry: Any, value: Any, *rest: Any) -> Any:
    return value


def _generic(stub: Any, proof: bool, inlined: bool, default: Callable[..., Any] | None, chained: bool) -> Any:
    """Make the table of methods and the overload that reads it."""
    default = _handed_on if chained else default
    methods: dict[Any, Callable[..., Any]] = {}
    given = _PROOF if proof else _ESTIMATE
    options = {**{key: given[key] for key in _OVERLOAD}, "forceinline": inlined}

    def one_after_another(entries: Any, value: Any, *rest: Any) -> Any:
        return chosen(entries[1:], chosen(entries[0], value, *rest), *rest)

    def of_tuple(first: Any) -> Callable[..., Any] | None:
        plain = type(first) is tuple or (isinstance(first, types.BaseTuple) and not named_tuple_class(first))
        return None if not (chained and plain) else one_after_another if len(first) else _handed_on

    def choose(first: Any, *rest: Any) -> Callable[..., Any] | None:
        if (method := of_tuple(first)) is not None:
            return method
        key: Any = type(None) if isinstance(first, types.NoneType) else named_tuple_class(first)
        if key is None and isinstance(first, types.BaseTuple):
            key = len(first)
        return methods.get(key, default)

    @functools.wraps(stub)
    def chosen(first: Any, *rest: Any) -> Any:
        """Run the method in Python, on the numbers of Python: a method made of formulas alone knows no others."""
        method = of_tuple(first) or methods.get(type(first), default)
        if method is None:
            raise MapError("the argument", type(first).__name__, "a class with a method", "add one")
        return method(first, *rest)

    extending.overload(chosen, jit_options=options, strict=False)(choose)

    def on(key: type | int, method: Callable[..., Any]) -> None:
        methods[key] = _with_helpers(getattr(method, "py_func", method), proof)

    made: Any = chosen
    made.on, made.methods = on, methods
    return made
