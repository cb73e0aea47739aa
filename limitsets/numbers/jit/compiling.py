"""The decorators of kernels: how they compile, helpers from outside, and what a user reads if one does not compile."""

from __future__ import annotations

import linecache
import re
import types as python_types
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, overload

import numba
from numba import extending, types
from numba.core import codegen, config
from numba.core.compiler import Compiler
from numba.core.errors import NumbaError
from numba.core.registry import cpu_target

from limitsets.base import LimitsetsError, MapError
from limitsets.numbers.jit.cache import (
    CACHE,
    COMPILED,
    FOREIGN,
    PACKAGE,
    classes_in,
    is_known,
    meaning,
    names_in,
)

# ----------------------------------------------------------------
# How kernels are compiled: with contraction or without, with the widest vectors.


def _use_widest_vectors() -> None:
    """Let LLVM use vectors of 512 bits where the processor has them; numbers stay the same to the bit.

    For Intel's processors LLVM prefers 256 bits (the first of them slowed down at wider ones): a throw takes 11.4 ns
    so, and 6.1 with 512, measured on one processor compiled for in both ways.  The option belongs to the target
    machine, one for the process: it has no effect where numba compiled something before this file was imported, and
    it is part of the key under which compiled code is kept.  ``NUMBA_CPU_FEATURES`` in the environment goes first.
    """
    features = codegen.get_host_cpu_features()
    if config.CPU_FEATURES is None and "+avx512vl" in features:
        config.CPU_FEATURES = f"{features},-prefer-256-bit"


_use_widest_vectors()

_COMMON = {"nopython": True, "error_model": "numpy", "no_cfunc_wrapper": True}
ESTIMATE = {**_COMMON, "fastmath": {"contract"}}
PROOF = {**_COMMON, "fastmath": False}


# ----------------------------------------------------------------
# Kernels within others: parts of the machine code of their callers, with none of their own.


class _Linked(codegen.JITCodeLibrary):  # type: ignore[misc]  # numba has no types
    """Code that hands on the loops it calls, to be linked where machine code is made.

    Numba links and optimises what is called in each caller, and so a loop again in each that leads to it: half the time
    in which the topology of a new map compiled.
    """

    _loops: dict[Any, None]

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._loops = {}

    def add_linking_library(self, library: Any) -> None:
        """Take what is called: into the code itself, or among the loops."""
        self._loops.update(getattr(library, "_loops", {}))
        if isinstance(library, _Loop):
            self._loops[library] = None
        else:
            super().add_linking_library(library)


class _Whole(_Linked):
    """Code with machine code of its own."""

    def finalize(self) -> None:
        """Link the loops too: from callers to what they call, for only what is called already is linked."""
        self._linking_libraries.extend(reversed(self._loops))
        super().finalize()


class _Part(_Linked):
    """Code that callers take into theirs.

    Numba makes machine code of it too, which nothing runs: a quarter of the time in which a map compiles.
    """

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def codegen(self) -> Any:
        """What numba asks to fill in a place of the machine code, of which there is none."""
        return python_types.SimpleNamespace(set_env=lambda name, env: None)

    def get_pointer_to_function(self, name: str) -> int:
        """Give no place of the machine code, as numba does of a function that Python does not call."""
        return 0


class _Loop(_Part):
    """Code that is called, not taken in."""


def _compiling_to(kind: type[_Linked]) -> type[Compiler]:
    """How numba compiles to code of a kind."""

    class Compiling(Compiler):  # type: ignore[misc]  # numba has no types
        def __init__(self, typing_context: Any, target_context: Any, library: Any, *rest: Any) -> None:
            super().__init__(typing_context, target_context, library, *rest)
            self.state.library = kind(target_context.codegen(), kind.__name__)
            self.state.library.enable_object_caching()

    return Compiling


_TO_WHOLE, _TO_PART, _TO_LOOP = map(_compiling_to, (_Whole, _Part, _Loop))


def overloaded(
    stub: Callable[..., Any], choose: Callable[..., Any], *, proof: bool = False, inlined: bool = True
) -> None:
    """Let compiled code run, in place of a function, what `choose` gives for the types of its arguments."""
    options = {**(PROOF if proof else ESTIMATE), "forceinline": inlined, "pipeline_class": _TO_PART}
    extending.overload(stub, jit_options=options, strict=False)(choose)


# ----------------------------------------------------------------
# The decorators of kernels, plain helpers of kernels from outside, and what a user reads if one does not compile.


F = TypeVar("F", bound=Callable[..., Any])


# Plain functions that kernels from outside call: (meaning, whether for proofs) -> what is compiled in their place, and
# what the meaning tells by its place in memory.
_HELPERS: dict[tuple[Any, bool], tuple[Any, list[Any]]] = {}


def _is_plain(value: Any) -> bool:
    """Whether a value is a function that numba knows nothing of."""
    if not isinstance(value, python_types.FunctionType) or hasattr(value, "methods"):
        return False
    if is_known(value):
        return False
    cpu_target.typing_context.refresh()
    try:
        cpu_target.typing_context.resolve_value_type(value)
    except (NumbaError, ValueError):
        return True
    return False


def _compiled_helpers(function: Callable[..., Any], proof: bool) -> dict[str, Any]:
    """Names by which a function calls plain ones -> those compiled, and so for all that they call."""
    scope, names = function.__globals__, names_in(function)
    return _compiled_values({name: scope[name] for name in names & scope.keys()}, names, proof)


def _compiled_values(values: dict[str, Any], names: set[str], proof: bool) -> dict[str, Any]:
    """Those of the values in whose place another one has to stand."""
    compiled_values = {}
    for name, value in values.items():
        if _is_plain(value):
            compiled_values[name] = _helper(value, proof)
        elif isinstance(value, python_types.ModuleType) and value.__name__.split(".")[0] not in COMPILED:
            own = vars(value)
            inside = _compiled_values({key: own[key] for key in names & own.keys()}, names, proof)
            if inside:
                compiled_values[name] = python_types.ModuleType(value.__name__)
                vars(compiled_values[name]).update(own, **inside)
    return compiled_values


def _in_scope(function: Callable[..., Any], scope: dict[str, Any]) -> Any:
    """Return the function with other globals."""
    code, defaults, cells = function.__code__, function.__defaults__, function.__closure__
    copy = python_types.FunctionType(code, scope, function.__name__, defaults, cells)
    copy.__qualname__, copy.__kwdefaults__ = function.__qualname__, function.__kwdefaults__
    return copy


def _helper(function: Callable[..., Any], proof: bool) -> Any:
    alive: list[Any] = []
    key = meaning(function, alive), proof
    if key not in _HELPERS:
        scope = dict(function.__globals__)
        _HELPERS[key] = compiled(_in_scope(function, scope), PROOF if proof else ESTIMATE, False), alive
        scope.update(_compiled_helpers(function, proof))  # last: a helper may call itself
    return _HELPERS[key][0]


def with_helpers(function: Callable[..., Any], proof: bool) -> Callable[..., Any]:
    """Return a kernel whose plain helpers are compiled; itself where it has none, as all of the package."""
    if (function.__module__ or "").split(".")[0] == "limitsets":
        return function
    helpers = _compiled_helpers(function, proof)
    return _in_scope(function, {**function.__globals__, **helpers}) if helpers else function


# What numba says around the cause of a failure.
_AROUND = re.compile(
    r"Failed in nopython|No implementation of|>>>|There (is|are) |- Of which|Overload in|With argument|Rejected as"
    r"|TypingError: Failed|File |During:|raised from|def |<source elided>|\^|$"
)
_KERNEL = re.compile(
    r"\b(image|image_on|image_box|on_side|on_side_box|fallback_box|margin|displacement|scattered)\("
)

# Where an array or a list stands for a state: the kernel gave it as its new x.
_NO_STATE = re.compile(r"(?:>>> float\(|>>> setitem\(.*, |Cannot unify )(array|list|reflected list)\(")

# Where the new x has not as many coordinates as the map: a tuple for a number, or a number for a tuple.
_NO_COORDINATES = re.compile(
    r">>> setitem\(array.*, (UniTuple\(.*\))\)|>>> put\(UniTuple\(array.*, (float64)\)"
    r"|Cannot unify (.*) and .* for 'after"
)

# Lines of numba's message where a kernel takes entries of a number, as if it were a tuple.
_NO_ENTRIES = re.compile(r">>> getitem\(float64, |failed to unpack float64")

_OPERATION = re.compile(r">>> (add|sub|mul|truediv|pow|neg)\((.*)\)$")
_SIGNS = {"add": " + ", "sub": " - ", "mul": " * ", "truediv": " / ", "pow": " ** ", "neg": "-"}

NUMBERS_DO = (
    "+ - * /, powers, abs, min and max of two, and of math or numpy sqrt exp log sin cos tan tanh atan2 floor, "
    "cbrt of numpy; "
    "no comparison"
)


def _in_words(name: str, types: str) -> str:
    """Write an operation on numba's types as people read it.

    Examples
    --------
    >>> _in_words("mul", "UniTuple(float64 x 2), float64")
    'a tuple of 2 numbers * a number'
    """
    words = re.sub(r"UniTuple\(\w+ x (\d+)\)", r"a tuple of \1 numbers", types)
    words = re.sub(r"array\([^)]*\)", "an array", words)
    words = re.sub(r"\b(?:Literal\[int\]\([^)]*\)|(?:float|int)64)", "a number", words)
    sign = _SIGNS[name]
    return words.replace(", ", sign) if name != "neg" else sign + words


def _explained(error: Exception, cls: type) -> MapError:
    """Say in one line why the kernels of a class from outside do not compile."""
    lines = [line.strip() for line in str(error).splitlines()]
    cause = next((line for line in lines if not _AROUND.match(line)), type(error).__name__)
    cause = re.sub(r", defined at .*", "", cause.removeprefix("TypingError: "))
    call = next(filter(None, map(_KERNEL.search, lines)), None)
    kernel = f"the kernel {call[1]} of {cls.__name__}" if call else f"a kernel of {cls.__name__}"
    spot = _own_line(lines)
    place = f"{spot[0].name}, line {spot[1]}" if spot else ""
    where = f"correct {place}" if place else "correct the kernel"
    if spot and any("Interval(float64)" in line for line in lines):  # a box, of a kernel for plain numbers
        file, number = str(spot[0]), spot[1]
        above = (re.match(r"\s*def (\w+)", linecache.getline(file, k)) for k in range(number, 0, -1))
        name = next((head[1] for head in above if head), "the kernel")
        remedy = (
            "give each branch a number and a name (branches=), and register image_on, margin; or image_box"
        )
        if cls.__module__.split(".")[0] == "limitsets":  # made by `limitsets.map`
            remedy = "give each branch a function of its own: limitsets.map(pieces=(f, g), margin=m)"
        line = linecache.getline(file, number).strip()
        if re.search(r"\bint\(", line):
            remedy = f"write floor in place of int, which is another number below 0; or {remedy}"
        return MapError(
            f"what {name} of {cls.__name__} does with x or a parameter ({place})",
            line,
            f"for boxes: {NUMBERS_DO}",
            remedy,
        )
    if any(_NO_STATE.search(line) for line in lines):
        return MapError(
            f"the new x that the kernel image of {cls.__name__} gives",
            "an array or a list",
            "a number; in two and three dimensions a tuple of numbers",
            "return (y, z), side, code in place of np.array([y, z]), side, code",
        )
    if spot and any(_NO_ENTRIES.match(line) for line in lines):
        return MapError(
            f"what {kernel} takes entries of ({place})",
            "a number",
            "a tuple",
            "in one dimension write x, not x[0]; of a map of 2 or 3 pass dimension= to limitsets.register",
        )
    if state := next(filter(None, map(_NO_COORDINATES.match, lines)), None):
        return MapError(
            f"the new x that the kernel image of {cls.__name__} gives",
            _in_words("mul", next(filter(None, state.groups()))),
            "as many numbers as the map has dimensions: one as it is, two or three as a tuple",
            "correct what image returns, or pass dimension= to limitsets.register",
        )
    if operation := next(filter(None, map(_OPERATION.match, lines)), None):
        return MapError(
            f"an operation of {kernel}",
            _in_words(*operation.groups()),
            "one of numbers",
            (f"take the entries of a tuple one by one, as params.c[0] * x; {where}"),
        )
    return _explained_by_cause(cause, cls, kernel, where)


def _own_line(lines: list[str]) -> tuple[Path, int] | None:
    """Find the line of source that an error names and that is neither of this package nor of numba."""
    places = (re.match(r'File "(.*)", line (\d+)', line) for line in lines)
    spots = ((Path(at[1]).resolve(), int(at[2])) for at in places if at)
    own = (PACKAGE, Path(numba.__file__).parent)
    return next((at for at in spots if not any(folder in at[0].parents for folder in own)), None)


def _explained_by_cause(cause: str, cls: type, kernel: str, where: str) -> MapError:
    """Explain an error by its cause, in the compiler's words where they are of no known kind."""
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
            f"see `limitsets.systems.maps.contract`; {where}",
        )
    if single := re.match(r"failed to unpack (.*)", cause):
        return MapError(
            f"what {kernel} returns", single[1], "a tuple", f"see `limitsets.systems.maps.contract`; {where}"
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
            cls = next((cls for cls in classes_in(args[0]) or () if cls in FOREIGN), None)
            if cls is None:
                raise
            raise _explained(error, cls) from None
        finally:
            binding.set_option("limitsets", "-force-vector-interleave=0")

    dispatcher._compiler.compile = compile_interleaved


def _of_variables(template: Callable[..., Any]) -> Callable[..., Any]:
    """Let a call by a kernel compile for whole numbers and flags, and not again for each constant."""

    def variable(kind: Any) -> Any:
        return (
            types.unliteral(kind) if isinstance(kind, types.IntegerLiteral | types.BooleanLiteral) else kind
        )

    def template_of_variables(args: Any, kws: Any) -> Any:
        return template(tuple(map(variable, args)), {name: variable(kind) for name, kind in kws.items()})

    return template_of_variables


def compiled(
    function: F, options: dict[str, Any], entry: bool, counting: bool = True, inlined: bool = True
) -> F:
    """Make the dispatcher of a kernel: for other kernels, or an entry that is kept on disk."""
    flags = {**options, "forceinline": inlined and not entry, "_nrt": counting}
    dispatcher = numba.jit(**flags, pipeline_class=_TO_WHOLE)(function)
    if entry and hasattr(dispatcher, "_compiler"):
        _interleaved(dispatcher)
    elif hasattr(dispatcher, "_compiler"):  # for Python; compiled code is given a part
        how = {"no_cpython_wrapper": True, "pipeline_class": _TO_PART if inlined else _TO_LOOP}
        part = numba.jit(**flags, **how)(function)
        dispatcher.get_call_template, dispatcher.get_overload = part.get_call_template, part.get_overload
        dispatcher._compiling_counter = part._compiling_counter  # by which numba sees that it calls itself
    # The folder's name vouches for the package's own files only: a loop defined elsewhere is not kept.
    inside = PACKAGE in Path(function.__code__.co_filename).resolve().parents
    # A helper of a user's map may take an entry of a tuple whose entries differ, which needs the constant.
    if inside and hasattr(dispatcher, "get_call_template"):
        dispatcher.get_call_template = _of_variables(dispatcher.get_call_template)
    if entry and inside and CACHE is not None and hasattr(dispatcher, "_cache"):
        dispatcher._cache = CACHE(function)
    return dispatcher  # type: ignore[no-any-return]  # a dispatcher is called like the function


@overload
def kernel(function: F) -> F: ...
@overload
def kernel(*, entry: bool = False, counting: bool = True, inlined: bool = True) -> Callable[[F], F]: ...
def kernel(function: Any = None, *, entry: bool = False, counting: bool = True, inlined: bool = True) -> Any:
    """Compile for estimates (contraction allowed); ``entry=True`` for a loop called from Python.

    Parameters
    ----------
    function : callable
        A module-level function of numbers, arrays and NamedTuples.
    entry : bool
        True for a loop over whole arrays: kept on disk, not inlined.
    counting : bool
        False where no array is made or given back: references are not counted.
    inlined : bool
        False for a loop that kernels call: compiled once, however many lead to it.

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
        return lambda f: compiled(f, ESTIMATE, entry, counting, inlined)
    return compiled(function, ESTIMATE, entry, counting, inlined)


@overload
def proof_kernel(function: F) -> F: ...
@overload
def proof_kernel(*, entry: bool = False, counting: bool = True) -> Callable[[F], F]: ...
def proof_kernel(function: Any = None, *, entry: bool = False, counting: bool = True) -> Any:
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
        return lambda f: compiled(f, PROOF, entry, counting)
    return compiled(function, PROOF, entry, counting)
