"""The cache on disk: an edit of anything a kernel reaches gives the new number; and the flags of the decorators."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import limitsets
from limitsets.numbers.jit import cache as jit_cache, compiling, generic, kernel, proof_kernel
from limitsets.systems.maps import drivers

FUSED = re.compile(r"\bv?fn?m(?:add|sub|la|ls)\w*")

# A small entry kernel, put into the copy of the package.
PROBE = """
from limitsets.jit import kernel
from limitsets.systems.maps.kernels import image, on_side

@kernel(entry=True)
def one(params, x):
    after, _, code = image(on_side(params, 0), x, 0)
    return after, code
"""

# What a user may write, one file or two per way to change a number. The script below runs them all.
USER_FILES = {
    "with_helper": """
from typing import NamedTuple
import limitsets as ls
from helper import push
class WithHelper(NamedTuple):
    size: float
def image(params, x, side):
    return push(params, x), side, 0
ls.register(WithHelper, image=image)
""",
    "helper": """
from limitsets.jit import kernel
@kernel
def push(params, x):
    return x + params.size
""",
    # Helpers without a decorator: one in this file, one elsewhere that calls two more in another file.
    "with_plain": """
from typing import NamedTuple
import limitsets as ls
from plain import push
class WithPlain(NamedTuple):
    size: float
def twice(x):
    return 2.0 * x
def image(params, x, side):
    return push(params, twice(x)), side, 0
ls.register(WithPlain, image=image)
""",
    "plain": """
import deeper
def push(params, x):
    return deeper.shift(x, params.size)
""",
    "deeper": """
STEP = 1.0
def scale(size):
    return 10.0 * size
def shift(x, size):
    return x + scale(size) if x > 0.0 else shift(x + STEP, size)
""",
    "with_constant": """
from typing import NamedTuple
import limitsets as ls
from constants import GAIN
class WithConstant(NamedTuple):
    size: float
def image(params, x, side):
    return GAIN * x + params.size, side, 0
ls.register(WithConstant, image=image)
""",
    "constants": "GAIN = 2.0",
    # Numbers of a small table stand in the machine code, of a large one its address.
    "with_tables": """
from typing import NamedTuple
import numpy as np
import limitsets as ls
from constants import GAIN
SMALL, LARGE = np.full(9, GAIN), np.full(300_000, GAIN)
class WithSmall(NamedTuple):
    size: float
class WithLarge(NamedTuple):
    size: float
def small(params, x, side):
    return SMALL[int(x)] * x + params.size, side, 0
def large(params, x, side):
    return LARGE[int(x)] * x + params.size, side, 0
ls.register(WithSmall, image=small)
ls.register(WithLarge, image=large)
""",
    "with_fields": """
from typing import NamedTuple
import limitsets as ls
from fields import WithFields
def image(params, x, side):
    return x + params.push, side, 0
ls.register(WithFields, image=image)
""",
    "fields": """
from typing import NamedTuple
class WithFields(NamedTuple):
    push: float
    pull: float
""",
    "with_part": """
from typing import NamedTuple
import limitsets as ls
from part import Part
import part_kernel
class WithPart(NamedTuple):
    size: float
def image(params, x, side):
    return x, side, 0
def gather(params, side):
    return Part(params.size)
ls.register(WithPart, image=image, on_side=gather)
""",
    "part": """
from typing import NamedTuple
class Part(NamedTuple):
    size: float
""",
    "part_kernel": """
import limitsets as ls
from part import Part
def image(params, x, side):
    return x * params.size, side, 0
ls.register(Part, image=image)
""",
    "with_generic": """
from typing import NamedTuple
import limitsets as ls
from limitsets.jit import generic
from method import method
class WithGeneric(NamedTuple):
    size: float
@generic
def move(params, x):
    pass
def image(params, x, side):
    return move(params, x), side, 0
ls.register(WithGeneric, image=image)
move.on(WithGeneric, method)
""",
    "method": """
def method(params, x):
    return x + params.size
""",
}

HEAD = """
import json
from typing import NamedTuple
import limitsets as ls
from limitsets import maps
from limitsets.maps.probe import one

def run(**cases):
    out = {}
    for name, (params, x) in cases.items():
        before = sum(one.stats.cache_hits.values())
        after, code = one(params, x)
        out[name] = [after, sum(one.stats.cache_hits.values()) - before]
    print(json.dumps(out))

leslie = maps.Leslie(young=1.0, old=2.0, crowding=0.0, survival=0.5), (2.0, 3.0)
henon = maps.Henon(a=0.5, b=4.0), (2.0, 10.0)
"""
PACKAGE_ALONE = HEAD + "run(leslie=leslie)"
EVERYTHING = (
    HEAD
    + """
from with_helper import WithHelper
from with_plain import WithPlain
from with_constant import WithConstant
from with_tables import WithLarge, WithSmall
from with_fields import WithFields
from with_part import WithPart
from with_generic import WithGeneric

class InScript(NamedTuple):
    size: float
def image(params, x, side):
    return x + params.size, side, 0
ls.register(InScript, image=image)

run(
    leslie=leslie, henon=henon, helper=(WithHelper(1.0), 2.0), plain=(WithPlain(1.0), 2.0),
    constant=(WithConstant(1.0), 2.0), small=(WithSmall(1.0), 2.0), large=(WithLarge(1.0), 2.0),
    fields=(WithFields(push=1.0, pull=5.0), 2.0),
    part=(WithPart(5.0), 2.0), generic=(WithGeneric(1.0), 2.0),
    script=(InScript(1.0), 2.0),
)
"""
)
NOT_KEPT = {"generic", "script", "large"}
ANSWERS = {
    "leslie": [2.0 + 2.0 * 3.0, 1.0],  # exp 0 = 1
    "henon": [1.0 - 0.5 * 2.0**2 + 10.0, 8.0],
    "helper": 3.0,
    "plain": 2.0 * 2.0 + 10.0 * 1.0,
    "constant": 5.0,
    "small": 5.0,
    "large": 5.0,
    "fields": 3.0,
    "part": 10.0,
    "generic": 3.0,
    "script": 3.0,
}
# Edits (folder, file, old text, new text), and the answers after them.
EXP = "(1.0 + (r + r * r * tail))"
EDITS = [
    ("maps", "textbook/shared.py", EXP, EXP.replace("1.0", "3.0")),
    ("maps", "textbook/henon.py", "    a: float = 1.4\n    b: float", "    b: float = 1.4\n    a: float"),
    ("user", "helper.py", "x + params.size", "x - params.size"),
    ("user", "deeper.py", "10.0 * size", "20.0 * size"),
    ("user", "constants.py", "2.0", "3.0"),
    ("user", "fields.py", "    push: float\n    pull: float", "    pull: float\n    push: float"),
    ("user", "part_kernel.py", "x * params.size", "x + params.size"),
    ("user", "method.py", "x + params.size", "x - params.size"),
]
ANSWERS_AFTER = {
    **ANSWERS,  # swapped fields are no other map
    "leslie": [3.0 * 8.0, 1.0],
    "helper": 1.0,
    "plain": 2.0 * 2.0 + 20.0 * 1.0,
    "constant": 7.0,
    "small": 7.0,
    "large": 7.0,
    "part": 7.0,
    "generic": 1.0,
}


class Place:
    """A copy of the package, a folder of a user's files, and a cache."""

    def __init__(self, folder: Path) -> None:
        self.copy, self.user, self.cache = folder / "copy", folder / "user", folder / "cache"
        self.maps = self.copy / "limitsets" / "systems" / "maps"

    def fill(self) -> None:
        source, copy = Path(limitsets.__file__).parent, self.copy / "limitsets"
        # the box kernels of the maps stand on the wings below
        for part in ("base", "numbers", "systems/maps", "systems/cells"):
            shutil.copytree(source / part, copy / part, ignore=shutil.ignore_patterns("__pycache__"))
        (copy / "systems" / "__init__.py").touch()
        shutil.copy(source / "__init__.py", copy / "__init__.py")
        (self.maps / "probe.py").write_text(PROBE)
        self.user.mkdir()
        for name, text in USER_FILES.items():
            (self.user / f"{name}.py").write_text(text)

    def edit(self, back: bool = False) -> None:
        for folder, file, old, new in EDITS:
            path = (self.maps if folder == "maps" else self.user) / file
            text, (was, shall) = path.read_text(), (new, old) if back else (old, new)
            assert was in text
            path.write_text(text.replace(was, shall))

    def run(self, script: str) -> dict[str, Any]:
        """Run a script in a new process: name of the map -> [image, whether the code came from the disk]."""
        file = self.user / "script.py"
        file.write_text(script)
        # No bytecode: Python tells two versions of a file apart by second and size alone.
        env = {**os.environ, "PYTHONPATH": str(self.copy), "NUMBA_CACHE_DIR": str(self.cache)}
        how = {"env": env | {"PYTHONDONTWRITEBYTECODE": "1"}, "cwd": self.user, "text": True}
        done = subprocess.run([sys.executable, str(file)], capture_output=True, check=False, **how)
        assert done.returncode == 0, done.stderr
        found: dict[str, Any] = json.loads(done.stdout)
        return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache") / "place"


@pytest.fixture(scope="module")
def life(folder: Path) -> dict[str, dict[str, Any]]:
    """Everything in four processes: first, again, edited, and edited back."""
    place = Place(folder)
    place.fill()
    runs = {"first": place.run(EVERYTHING)}
    # a room without kernels is no reason to compile
    room = place.maps.parents[1] / "face" / "plot"
    room.mkdir(parents=True)
    (room / "colours.py").write_text("RED = 1\n")
    runs["again"] = place.run(EVERYTHING)
    place.edit()
    runs["edited"] = place.run(EVERYTHING)
    place.edit(back=True)
    runs["back"] = place.run(EVERYTHING)
    return runs


@pytest.mark.parametrize("name", ANSWERS)
def test_a_first_process_compiles_a_second_loads_and_an_edit_gives_the_new_number(
    life: dict[str, Any], name: str
) -> None:
    assert life["first"][name] == [ANSWERS[name], 0]
    assert life["again"][name] == [ANSWERS[name], 0 if name in NOT_KEPT else 1]
    assert life["edited"][name] == [ANSWERS_AFTER[name], 0]
    assert life["back"][name] == life["again"][name]  # undone, from the disk


@pytest.fixture
def place(folder: Path, life: dict[str, Any], tmp_path: Path) -> Place:
    """A copy of the place after all that; its code is found because the digest of the same text is the same."""
    shutil.copytree(folder, tmp_path / "place")
    return Place(tmp_path / "place")


@pytest.mark.parametrize("when", ["before the import", "after the import"])
def test_a_cache_that_cannot_be_written(place: Place, when: str) -> None:
    # A file stands where the folder should be; rights would not stop root.
    cache = str(place.cache)
    replace = f"import shutil\nshutil.rmtree({cache!r})\nopen({cache!r}, 'w').close()\n"
    early, late = (replace, "") if when == "before the import" else ("", replace)
    found = place.run(early + HEAD + late + "run(leslie=leslie)")
    assert found["leslie"] == [ANSWERS["leslie"], 0]


@pytest.mark.sweep
def test_a_file_cut_short_is_written_anew(place: Place) -> None:
    for ending in (".nbi", ".nbc"):
        for file in place.cache.rglob("*" + ending):
            file.write_bytes(file.read_bytes()[:-20])
        assert place.run(PACKAGE_ALONE)["leslie"] == [ANSWERS["leslie"], 0]
    assert place.run(PACKAGE_ALONE)["leslie"] == [ANSWERS["leslie"], 1]


def test_each_signature_has_its_own_files_and_old_digests_go(place: Place) -> None:
    for k in range(12):
        old = place.cache / "limitsets" / f"digest{k}"
        old.mkdir(parents=True)
        os.utime(old, (1000 + k, 1000 + k))
    (place.maps / "codes.py").write_text((place.maps / "codes.py").read_text() + "\n")
    place.run(HEAD + "run(leslie=leslie, henon=henon)")
    # Two processes that write one index at once could file the code of one signature under the other.
    newest = max((place.cache / "limitsets").iterdir(), key=lambda path: path.stat().st_mtime)
    assert len(list(newest.glob("*.nbi"))) == len(list(newest.glob("*.nbc"))) == 2
    kept = {path.name for path in (place.cache / "limitsets").iterdir()}
    assert len(kept) == jit_cache.KEPT_DIGESTS
    assert "digest11" in kept
    assert "digest0" not in kept


# ---------------------------------------------------------------- the flags


def multiply_add(a: Any, b: Any, c: Any, out: Any) -> None:
    for k in range(out.size):
        out[k] = a[k] * b[k] + c[k]


class Weight(NamedTuple):
    size: float


@generic
def weigh(params: Any, x: float, y: float) -> Any:
    """Stub of a generic function."""


def _weigh(params: Weight, x: float, y: float) -> float:
    return params.size * x + y


@generic(proof=True)
def weigh_for_proofs(params: Any, x: float, y: float) -> Any:
    """Stub of a generic function."""


weigh.on(Weight, _weigh)
weigh_for_proofs.on(Weight, _weigh)


def weigh_all(params: Weight, x: Any, out: Any) -> None:
    for k in range(out.size):
        out[k] = weigh(params, x[k], x[k])


def weigh_all_for_proofs(params: Weight, x: Any, out: Any) -> None:
    for k in range(out.size):
        out[k] = weigh_for_proofs(params, x[k], x[k])


def machine_code(compiled: Any) -> str:
    return "\n".join(compiled.inspect_asm().values())


def test_only_estimates_are_contracted() -> None:
    # (1 + e)(1 - e) - 1 = -e^2, which only one rounding keeps.
    e = 2.0**-30
    a, b, c, out = np.full(9, 1.0 + e), np.full(9, 1.0 - e), np.full(9, -1.0), np.empty(9)
    exact, estimate = proof_kernel(multiply_add), kernel(multiply_add)
    exact(a, b, c, out)
    assert (out == 0.0).all()
    estimate(a, b, c, out)
    assert not FUSED.search(machine_code(exact))
    if FUSED.search(machine_code(estimate)):
        assert (out == -(e**2)).all()


def test_a_generic_for_proofs_stays_uncontracted_inside_an_estimate() -> None:
    x, out = np.linspace(0.0, 1.0, 9), np.empty(9)
    exact, estimate = kernel(weigh_all_for_proofs), kernel(weigh_all)
    exact(Weight(0.1), x, out)
    expected = np.float64(0.1) * x + x
    assert (out == expected).all()
    estimate(Weight(0.1), x, out)
    assert not FUSED.search(machine_code(exact))
    fused = FUSED.search(machine_code(_compiled_estimate()))
    assert bool(FUSED.search(machine_code(estimate))) == bool(fused)


def _plain_sum(a: float, b: float, c: float) -> float:
    return a * b + c


def _calls_a_plain_one(params: Weight, x: float, y: float) -> float:
    return _plain_sum(x, y, params.size)


def test_a_plain_helper_is_compiled_as_its_kernel_is() -> None:
    # As above: one rounding keeps what two lose.
    e = 2.0**-30
    exact, estimate = (compiling._helper(_plain_sum, proof) for proof in (True, False))
    assert exact is not estimate
    assert compiling._helper(_plain_sum, True) is exact
    assert compiling._compiled_helpers(_calls_a_plain_one, True) == {"_plain_sum": exact}
    assert exact(1.0 + e, 1.0 - e, -1.0) == 0.0
    assert estimate(2.0, 3.0, 4.0) == 10.0


def _compiled_estimate() -> Any:
    """An estimate that is contracted wherever this processor can."""
    compiled = kernel(multiply_add)
    numbers = np.ones(9)
    compiled(numbers, numbers, numbers, numbers.copy())
    return compiled


def test_only_entries_of_the_package_are_kept() -> None:
    compiled: list[Any] = [kernel(entry=True)(multiply_add), drivers.step, drivers.fill_images]
    caches = [type(one._cache) for one in compiled]
    assert [cache.__name__ for cache in caches[:2]] == ["NullCache", "NullCache"]
    if jit_cache.CACHE is not None:
        assert caches[2] is jit_cache.CACHE


def _steps_to(x: int, target: int) -> int:
    steps = 0
    while x != target:
        x = x // 2 if x % 2 == 0 else 3 * x + 1
        steps += 1
    return steps


def test_a_loop_that_several_kernels_lead_to_is_optimised_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []
    plain = compiling._Loop._finalize_final_module
    monkeypatch.setattr(compiling._Loop, "_finalize_final_module", lambda own: (made.append(own), plain(own)))
    loop = kernel(inlined=False)(_steps_to)
    down = kernel(inlined=False)(lambda x, end: loop(x, 4 * end))
    on = kernel(inlined=False)(lambda x, end: loop(x, end) - down(x, end))
    # 27 comes to 1 in 111 steps of Collatz's map (OEIS A006577), the last of them from 4 over 2
    assert kernel(entry=True)(lambda x, end: (down(x, end), on(x, end)))(27, 1) == (109, 2)
    of_loop = [
        each for library in made for each in library._final_module.functions if "_steps_to" in each.name
    ]
    assert (len(made), sorted(each.is_declaration for each in of_loop)) == (3, [False, True, True])
    assert (down(27, 1), loop(27, 1)) == (109, 111)  # Python calls them too


def _entry_of_pair(pair: Any, at: int) -> Any:
    return pair[at]


def _plus(x: int, more: int) -> int:
    return x + more


@pytest.mark.parametrize(("own", "compilations"), [(True, 1), (False, 2)])
def test_a_kernel_of_the_package_compiles_once_for_all_constants(
    own: bool, compilations: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = compiling.PACKAGE
    monkeypatch.setattr(compiling, "PACKAGE", Path(__file__).resolve().parent if own else whole)
    plus = kernel(_plus)
    monkeypatch.setattr(compiling, "PACKAGE", whole)
    assert kernel(entry=True)(lambda x: plus(x, 1) + plus(x, 2))(5) == 13
    assert len(plus.get_overload.__self__.overloads) == compilations


def test_a_helper_from_outside_keeps_its_constants() -> None:
    # the entries of the pair are a number and a whole number: which of them is meant has to be known
    entry = kernel(_entry_of_pair)
    assert kernel(entry=True)(lambda x: entry((0.5, x), 0) * entry((0.5, x), 1))(3) == 1.5


def test_numba_still_has_the_internals_the_cache_overrides() -> None:
    assert jit_cache._source_cache(Path("anywhere")) is not None
