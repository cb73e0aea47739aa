"""The file: a zip of a header and arrays (docs/certificates.md, "The file"), its texts, quantities and JSON.

Sizes, depths and hashes are checked before anything is believed, and nothing is unpickled or evaluated.
"""

import functools
import hashlib
import itertools
import json
import math
import mmap
import os
import re
import struct
import zlib
from dataclasses import dataclass, field
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .balls import Arb, Array, Pair, exact, span
from .labels import Labelled, Way, range_max

# ----------------------------------------------------------------
# Texts, quantities with units, and JSON: how the checker reads and writes them.
#
# docs/certificates.md, "Checking one": numbers are written from the exact values that were checked.


class BadFileError(Exception):
    """The file is not a certificate that can be read."""


def require(condition: bool, message: str) -> None:
    """Raise BadFileError unless the condition holds."""
    if not condition:
        raise BadFileError(message)


def plain(text: object, most: int = 80) -> str:
    """Clean the text of a stranger for printing: replace control characters, and mark where a long text is cut."""
    whole = str(text)
    clean = "".join(c if c.isprintable() and c.isascii() else "?" for c in whole[:most])
    return clean + ("... (cut)" if len(whole) > most else "")


DECIMAL = r"[+-]?(?:[0-9]{1,100}(?:\.[0-9]{0,100})?|\.[0-9]{1,100})(?:[eE][+-]?[0-9]{1,3})?"
NUMBER = re.compile(rf" *({DECIMAL})(?: +|(?=%))([a-zH%/^0-9]{{1,8}}) *")  # as a scene writes a quantity
INCH = Fraction(254, 10_000)
METRIC = {"m": Fraction(1), "cm": Fraction(1, 100), "mm": Fraction(1, 1000), "um": Fraction(1, 10**6)}
LENGTHS = {**METRIC, "in": INCH, "ft": 12 * INCH}
POUND = Fraction(45359237, 10**8)
UNITS: dict[str, dict[str, Fraction]] = {
    "length": LENGTHS,
    "angle": {"rad": Fraction(1), "deg": Fraction(1, 180)},  # degrees as multiples of pi
    "speed": {"rad/s": Fraction(1), "deg/s": Fraction(1, 180), "rpm": Fraction(1, 30)},
    "acceleration": {f"{unit}/s^2": factor for unit, factor in LENGTHS.items()},
    "mass": {
        "t": Fraction(1000),
        "kg": Fraction(1),
        "g": Fraction(1, 1000),
        "mg": Fraction(1, 10**6),
        "lb": POUND,
    },
    "density": {"kg/m^2": Fraction(1), "g/cm^2": Fraction(10)},  # mass per area of a plate
    "bulk": {"kg/m^3": Fraction(1), "g/cm^3": Fraction(1000)},  # mass per volume
    "frequency": {"Hz": Fraction(1)},
    "share": {"%": Fraction(1, 100)},
}
KINDS = " ".join(UNITS)
BY_PI = ("deg", "deg/s", "rpm")
LONGEST_TEXT = 64  # signs of a quantity: a longer text is refused, so that `plain` cuts no quantity


def decimal(value: Fraction) -> str:
    """Write a rational number exactly: as a decimal where it is one, else as a fraction."""
    over, twos, fives = value.denominator, 0, 0
    while over % 2 == 0:
        over, twos = over // 2, twos + 1
    while over % 5 == 0:
        over, fives = over // 5, fives + 1
    if over != 1:
        return f"{value.numerator}/{value.denominator}"
    places = max(twos, fives)
    digits = str(abs(value.numerator) * 2 ** (places - twos) * 5 ** (places - fives))
    sign, kept = "-" if value < 0 else "", digits.rstrip("0")
    if not kept:
        return "0"
    exponent = len(digits) - 1 - places  # of the first digit
    if -7 < exponent < 16:
        digits = digits.rjust(places + 1, "0")
        whole, rest = digits[: len(digits) - places], digits[len(digits) - places :]
        return sign + whole + (f".{rest}" if rest else "")
    return f"{sign}{kept[0]}{'.' + kept[1:] if kept[1:] else ''}e{exponent}"


def rounded(value: float, *, up: bool, digits: int = 9) -> str:
    """Write a float with few digits, rounded up or down."""
    return str(Context(digits, ROUND_CEILING if up else ROUND_FLOOR).create_decimal(value))


class Quantity(NamedTuple):
    """An interval in basic units (metre, radian, second, kilogram), exact; in multiples of pi where `pi` says so."""

    lo: Fraction
    hi: Fraction
    pi: bool
    unit: str

    def ball(self) -> Arb:
        """Enclose the interval in a ball."""
        return span(self.lo, self.hi) * (arb.pi() if self.pi else 1)

    def ends(self) -> list[Arb]:
        """Enclose the two ends of the interval."""
        return [exact(end) * (arb.pi() if self.pi else 1) for end in (self.lo, self.hi)]

    def __str__(self) -> str:
        """Write the interval from its numbers, not from the text in the file."""
        factor = next(kind[self.unit] for kind in UNITS.values() if self.unit in kind)
        lo, hi = (f"{decimal(end / factor)} {self.unit}" for end in (self.lo, self.hi))
        return lo if self.lo == self.hi else f"every value in [{lo}, {hi}]"


@functools.lru_cache(maxsize=4096)  # a scene is read again for each half of a tolerance
def number_and_unit(text: str, kinds: str, where: str) -> tuple[Fraction, str]:
    """Read a text like `"5.75 in"`: the number in the basic unit of its kind, and the unit written."""
    words = text if len(text) <= LONGEST_TEXT else ""
    tidy = words == " ".join(words.split()) != ""
    require(tidy, f"{where}: {plain(text)} is not text of at most {LONGEST_TEXT} signs, with single blanks")
    parts = NUMBER.fullmatch(words)
    require(parts is not None, f"{where}: {plain(text)} is not a decimal number and a unit")
    assert parts is not None
    size = abs(Fraction(parts[1]))
    ordinary = size == 0 or Fraction(1, 10**300) <= size <= 10**12
    require(ordinary, f"{where}: {plain(text)} is not 0 or of a size from 1e-300 to 1e12")
    factors = [UNITS[kind][parts[2]] for kind in kinds.split() if parts[2] in UNITS[kind]]
    require(len(factors) == 1, f"{where}: {plain(parts[2])} is not a unit of {kinds}")
    return Fraction(parts[1]) * factors[0], parts[2]


def quantity(value: object, kinds: str, where: str) -> Quantity:
    """Read a quantity of one of the kinds named: a text like `"5.75 in"`, or a pair of such texts for an interval."""
    if isinstance(value, Quantity):  # `Scene.halves` put it there: JSON holds no such object
        return value
    pair = value if isinstance(value, list) else [value, value]
    require(len(pair) == 2, f"{where}: an interval has two ends")
    read = [number_and_unit(text if isinstance(text, str) else plain(text), kinds, where) for text in pair]
    (lo, unit), (hi, other) = read
    require((unit in BY_PI) == (other in BY_PI), f"{where}: mixes degrees and radians")
    require(lo <= hi, f"{where}: the interval is empty")
    return Quantity(lo, hi, unit in BY_PI, unit)


def table(value: object, where: str, needed: str, optional: str = "") -> dict[str, Any]:
    """Return a JSON object that has all keys needed, and no others than these and the optional ones."""
    require(isinstance(value, dict), f"{where} is not an object")
    assert isinstance(value, dict)
    missing = [key for key in needed.split() if key not in value]
    require(not missing, f"{where}: {', '.join(missing)} missing")
    odd = [key for key in value if key not in needed.split() + optional.split()]
    require(not odd, f"{where}: unknown key {plain(' '.join(odd))}")
    return value


def rows(value: object, where: str, least: int, most: int) -> list[Any]:
    """Return a JSON array of a fitting length."""
    fits = isinstance(value, list) and least <= len(value) <= most
    require(fits, f"{where} is not a list of a fitting length")
    assert isinstance(value, list)
    return value


def by_side(value: object, where: str, n_sides: int) -> list[Any]:
    """Read an object with one entry for each side."""
    names = [str(i) for i in range(n_sides)]
    known = table(value, where, " ".join(names))
    return [known[name] for name in names]


def is_whole(value: object, least: int, most: int) -> bool:
    """Whether a value of a header is an integer, not true or false, from `least` to `most`."""
    return type(value) is int and least <= int(str(value)) <= most


def whole_number(value: object, least: int, most: int, what: str) -> int:
    """Read an integer from `least` to `most`; `what` says what a value is not that is none."""
    require(is_whole(value, least, most), what)
    return int(str(value))


def read_side(value: object, n_sides: int) -> int:
    """Read the number of a side."""
    return whole_number(value, 0, n_sides - 1, "a side is not a number of one")


def one_length(value: object, where: str) -> Quantity:
    """Read a length that is no interval."""
    length = quantity(value, "length", where)
    require(length.lo == length.hi, f"{where} is not one number")
    return length


def hex_float(text: object, where: str) -> float:
    """Read a float in Python's hexadecimal form."""
    form = r"-?0x[01]\.[0-9a-f]{1,13}p[+-][0-9]{1,4}"
    fits = isinstance(text, str) and re.fullmatch(form, text) is not None
    require(fits, f"{where} is not a hexadecimal number")
    try:
        return float.fromhex(str(text))
    except OverflowError:
        raise BadFileError(f"{where} is too large") from None


def read_box(raw: object, dimension: int, where: str) -> list[Pair]:
    """Read the ends of a box."""
    pairs = [rows(pair, where, 2, 2) for pair in rows(raw, where, dimension, dimension)]
    box = [(hex_float(lo, where), hex_float(hi, where)) for lo, hi in pairs]
    require(all(lo < hi for lo, hi in box), f"{where}: its ends do not ascend")
    return box


def model_in_words(model: dict[str, Any]) -> str:
    """Say of which model a verdict is."""
    kind = f"model with {' and '.join(model['simulated'])}" if model["simulated"] else "minimal model"
    facts = model["left_out"]
    if not facts:
        return f"of the {kind}: no fact of [world] is left out; not audited"
    also = ", of the scene without its scatter" if "scatter" in facts else ""
    said = " and ".join(part for part in (", ".join(facts[:-1]), facts[-1]) if part)
    return (
        f"of the {kind}{also}: {said} of [world] {'is' if len(facts) == 1 else 'are'} not in it; not audited"
    )


# ----------------------------------------------------------------
# The file: a zip of a header and arrays.  docs/certificates.md, "The file".


def stored_entries(data: memoryview, most: int, what: str) -> dict[str, memoryview]:
    """Find the entries of an uncompressed zip, as views of its bytes; refuse every unusual zip."""

    def ordinary(condition: bool, message: str) -> None:
        require(condition, f"{what}: {message}")

    end = len(data) - 22
    ordinary(end >= 0 and bytes(data[end : end + 4]) == b"PK\5\6", "not a complete zip file")
    disk, first, here, count, size, start, comment = struct.unpack("<4H2LH", data[end + 4 :])
    ordinary(disk == first == comment == 0 and here == count, "an unusual zip end record")
    ordinary(count <= most, f"{count} entries, at most {most} expected")
    ordinary(start + size == end, "its directory is not where it should be")
    entries: dict[str, memoryview] = {}
    spans = []
    at = start
    for _ in range(count):
        ordinary(at + 46 <= end and bytes(data[at : at + 4]) == b"PK\1\2", "damaged directory")
        fields = struct.unpack("<6H3L5H2L", data[at + 4 : at + 46])
        _, _, flags, method, _, _, crc, packed, full, n, extra, note, _, _, _, offset = fields
        name = bytes(data[at + 46 : at + 46 + n])
        at += 46 + n + extra + note
        entry = plain(name.decode("latin-1"))
        ordinary(method == 0 and packed == full, f"entry {entry} is compressed; only stored ones are read")
        ordinary(flags & ~0x0800 == 0 and name.isascii(), f"entry {entry} has unusual flags or an odd name")
        ordinary(entry not in entries, f"entry {entry} occurs twice")
        local = bytes(data[offset : offset + 30])  # the header in front of the entry
        ordinary(offset + 30 <= start and local[:4] == b"PK\3\4", f"entry {entry} is damaged")
        n_local, extra_local = struct.unpack("<2H", local[26:])
        begin = offset + 30 + n_local + extra_local
        same = local[8:10] == b"\0\0" and bytes(data[offset + 30 : offset + 30 + n_local]) == name
        ordinary(same and begin + full <= start, f"entry {entry} is damaged")
        entries[entry] = data[begin : begin + full]
        spans.append((offset, begin + full))
        if full <= 4 << 20:  # larger ones are covered by the hashes of the arrays
            ordinary(zlib.crc32(entries[entry]) == crc, f"entry {entry} is damaged (checksum)")
    ordinary(at == end, "damaged directory")
    ordinary(all(a[1] <= b[0] for a, b in itertools.pairwise(sorted(spans))), "entries overlap")
    return entries


def parse_json(raw: bytes) -> dict[str, Any]:
    """Parse the header, with limits on its depth and its numbers; a repeated key is refused."""
    # possessive repetition ("*+") never goes back: ten times as fast on a file of nothing but quotes
    bare = np.frombuffer(re.sub(rb'"[^"\\]*+(?:\\.[^"\\]*+)*+"?', b"", raw, flags=re.DOTALL), dtype=np.uint8)
    opened = np.isin(bare, (0x5B, 0x7B)).astype(np.int32) - np.isin(bare, (0x5D, 0x7D))
    require(int(np.cumsum(opened).max(initial=0)) <= 24, "header.json is nested too deeply")

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        require(len({key for key, _ in pairs}) == len(pairs), "header.json repeats a key")
        return dict(pairs)

    def number(text: str) -> int | float:
        form = r"-?[0-9]{1,17}(\.[0-9]{1,20})?([eE][+-]?[0-9]{1,2})?"
        require(re.fullmatch(form, text) is not None, f"header.json holds the odd number {plain(text)}")
        return int(text) if re.fullmatch(r"-?[0-9]+", text) else float(text)

    def constant(text: str) -> Any:
        raise BadFileError(f"header.json holds {text}")

    hooks: dict[str, Any] = {"object_pairs_hook": unique, "parse_int": number, "parse_float": number}
    try:
        header = json.loads(raw.decode("utf-8"), parse_constant=constant, **hooks)
    except (ValueError, RecursionError) as error:
        raise BadFileError(f"header.json cannot be read: {plain(error)}") from None
    require(isinstance(header, dict), "header.json is not an object")
    return dict(header)


NPY = re.compile(
    rb"\{'descr': '([<|][fi][1248])', 'fortran_order': False, 'shape': \(([0-9]{1,10}),(?: ([0-9]{1,2}))?\), \} *\n"
)


def read_array(entry: memoryview, name: str, dtype: str, columns: int, said: object) -> Array:
    """Read one array from the bytes of a .npy file; type, shape and hash must be those in the header."""
    require(
        len(entry) >= 10 and bytes(entry[:8]) == b"\x93NUMPY\1\0", f"array {name} is not a .npy, version 1"
    )
    (length,) = struct.unpack("<H", entry[8:10])
    body = entry[10 + length :]
    form = NPY.fullmatch(bytes(entry[10 : 10 + length]))
    require(form is not None, f"array {name} has an odd .npy header")
    assert form is not None
    shape = [int(n) for n in form.groups()[1:] if n is not None]
    fits = form[1].decode() == dtype and shape[1:] == [columns][: columns - 1]
    require(fits, f"array {name} is not of type {dtype} or has the wrong shape")
    require(len(body) == math.prod(shape) * int(dtype[2]), f"array {name} is not as long as its shape says")
    described = said == {"sha256": hashlib.sha256(body).hexdigest(), "dtype": dtype, "shape": shape}
    require(described, f"array {name} is not the one the header describes (hash, type or shape)")
    array = np.frombuffer(body, dtype=dtype).reshape(shape).copy()
    require(
        dtype != "<f8" or bool(np.isfinite(array).all()), f"array {name} holds a value that is not finite"
    )
    return array


def open_certificate(path: str | os.PathLike[str]) -> tuple[dict[str, Any], dict[str, memoryview]]:
    """Return the header of a certificate, and the entries that hold its arrays."""
    try:
        with Path(path).open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            require(100 <= size <= (2 << 30) + (8 << 20), f"a certificate does not have {size} bytes")
            data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    except (OSError, ValueError) as error:
        raise BadFileError(f"cannot be read: {plain(error)}") from None
    entries = stored_entries(data, 2, "the certificate")
    require(set(entries) == {"header.json", "arrays.npz"}, "it has to hold header.json and arrays.npz")
    require(len(entries["header.json"]) <= 4 << 20, "header.json is larger than 4 MB")
    require(len(entries["arrays.npz"]) <= 2 << 30, "arrays.npz is larger than 2 GB")
    header = parse_json(bytes(entries["header.json"]))
    return header, stored_entries(entries["arrays.npz"], 60_000, "arrays.npz")


def read_boxes(value: object, keys: str, most: int) -> list[dict[str, Any]]:
    """Read boxes of parameters with some keys and a prefix each, with which the names of its arrays begin."""
    boxes = [table(box, "a box", f"prefix {keys}") for box in rows(value, "boxes", 1, most)]
    prefixes = [box["prefix"] for box in boxes]
    named = all(isinstance(p, str) and re.fullmatch(r"[0-9]{1,6}\.", p) for p in prefixes)
    require(named and len(set(prefixes)) == len(boxes), "the prefixes of the boxes are not as they should be")
    return boxes


def read_sections(value: object, where: str = "claims", least: int = 1) -> dict[str, Any]:
    """Read a list of claims, so many at least and each made once: the section of each by its name."""
    sections: dict[str, Any] = {}
    for claim in rows(value, where, least, 100):
        name = table(claim, f"{where}: a claim", "claim section")["claim"]
        require(isinstance(name, str) and name not in sections, f"{where}: a claim is no text, or made twice")
        sections[name] = claim["section"]
    return sections


def section_alone(
    header: dict[str, Any],
    word: str,
    of: str,
    keys: str,
    nothing: str,
    *,
    optional: str = "",
    noisy: bool = False,
) -> dict[str, Any]:
    """Return the section of a claim that stands alone in a file, which says so for a file with more in it."""
    sections = read_sections(header["claims"])
    require(len(sections) == 1, f"the claims of {of} are more than one")
    section = table(sections[word], f"section of {word}", keys, optional)
    quiet = header["tolerance"] is None and (noisy or header["noise"] is None)
    require(header["boxes"] == [] and quiet, nothing)
    return section


@dataclass
class Cells(Labelled):
    """The arrays of one box; the cells of all sides stand one after another."""

    edges: list[Array]
    jog: Array
    flip: Array
    branch: Array
    rank: Array
    component: Array
    phi: Array
    side: Array = field(init=False)
    start: Array = field(init=False)  # the first cell of each side; at the end the number of all cells

    def __post_init__(self) -> None:
        counts = [len(edges) - 1 for edges in self.edges]
        self.start = np.concatenate([[0], np.cumsum(counts)])
        self.side = np.repeat(np.arange(len(counts)), counts)

    def lower(self) -> Array:
        """Return the lower ends of all cells."""
        return np.concatenate([edges[:-1] for edges in self.edges])

    def upper(self) -> Array:
        """Return the upper ends of all cells."""
        return np.concatenate([edges[1:] for edges in self.edges])

    def name(self, cell: int) -> str:
        """Name a cell, for people."""
        side = int(self.side[cell])
        k = cell - int(self.start[side])
        return f"side {side}, cell {cell}, x in [{float(self.edges[side][k])!r}, {float(self.edges[side][k + 1])!r}]"

    def ways(self) -> list[Way]:
        """Return a jog and a flip."""

        def extremes(targets: Array, label: Array, cells: Array) -> tuple[Array, Array]:
            first, last = targets[cells].T
            return -range_max(-label, first, last), range_max(label, first, last)

        both = (("a jog", self.jog), ("a flip", self.flip))
        return [Way(name, to[:, 0] >= 0, functools.partial(extremes, to)) for name, to in both]


class Arrays:
    """The arrays of a file, read one by one, as its header describes them; `names` are those that were read."""

    def __init__(self, said: object, entries: dict[str, memoryview]):
        require(isinstance(said, dict), "arrays is not an object")
        assert isinstance(said, dict)
        self.said, self.entries, self.names = said, entries, set[str]()

    def read(self, name: str, dtype: str, columns: int = 1) -> Array:
        """Read one."""
        require(f"{name}.npy" in self.entries, f"array {name} is missing")
        self.names.add(name)
        return read_array(self.entries[f"{name}.npy"], name, dtype, columns, self.said.get(name))

    def require_no_others(self) -> None:
        """Require that header and file have the arrays that were read, and no others."""
        require(set(self.said) == self.names, "the header describes arrays that no claim needs")
        held = set(self.entries) == {f"{name}.npy" for name in self.names}
        require(held, "arrays.npz holds entries that no claim needs")


def read_cells(arrays: Arrays, prefix: str, sides: int) -> Cells:
    """Read the arrays of one box, and check that their lengths fit each other."""

    def read(name: str, dtype: str, columns: int = 1) -> Array:
        return arrays.read(prefix + name, dtype, columns)

    edges = [read(f"edges.{i}", "<f8") for i in range(sides)]
    require(all(len(e) >= 2 for e in edges), "a side has no cells")
    cells = Cells(
        edges, read("jog", "<i4", 2), read("flip", "<i4", 2), branch=read("branch", "|i1"),
        rank=read("rank", "<i4"), component=read("component", "<i4"), phi=read("phi", "<f8", 2),
    )  # fmt: skip
    n = len(cells.side)
    rows_of = (cells.jog, cells.flip, cells.branch, cells.rank, cells.component, cells.phi)
    require(all(len(array) == n for array in rows_of), "the arrays do not have one row for each cell")
    return cells
