#!/usr/bin/env python3
"""Check a proof certificate of a throw-and-catch feeder: a lone file, written from the physics, not from the prover.

    python recheck.py FILE [--json] [--workers N]

It needs Python, numpy and python-flint, and nothing else of the package that wrote the certificate.  Everything that
is believed here is either an integer comparison, an exact rational, or a sign of a ball that Arb computed.  A
certificate is taken to come from a stranger: it is data, nothing in it is evaluated, unpickled or used as a path.

A proof for one throw map: a part rests on side i at x = R, the arm throws it, it lands on its left vertex at the
angle phi and either falls back ("jog") or over that vertex on side i+1 ("flip").  The certificate cuts every side
into cells.  For every cell it says how the throw decides, where the images lie and what bracket holds phi; this file
proves each of these anew, for all x in the cell and all parameters allowed, and follows the integers to the claims.

Exit status: 0 every claim proved; 1 not: a goal of some starts only, a refutation that is confirmed, a claim that
fails; 2 not a readable certificate; 130 interrupted.
"""

import argparse
import bisect
import copy
import hashlib
import itertools
import json
import math
import mmap
import multiprocessing
import os
import re
import signal
import struct
import sys
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import flint
import numpy as np
from flint import arb, fmpq

PRECISION = 100  # bits of every ball
DEPTH = 12  # a cell is halved at most so often in x, so often in kappa, and so often in all else that is an interval
MOST_BOXES = 20_000  # pieces of one cell: a certificate that needs more is refused
MOST_HALVES = 1_000  # pieces of a tolerance, for one check that is not of a cell
CHUNK = 2_000  # cells handed to a worker at once
SMALL = 20_000  # so many cells are done before other processes have started
FULL_TURN = 6.283185307179586  # a float below 2 pi

Arb = Any  # flint.arb has no stubs
Array = np.ndarray[Any, np.dtype[Any]]
HALF, ZERO, ONE = arb(0.5), arb(0), arb(1)

FORMULAS = {
    "always": [
        "a, d, L: foot from the left vertex, height of the centre of mass, length of the side; rho: radius of gyration",
        "ell^2 = a^2 + d^2;  M = rho^2 + ell^2;  kappa = g/w^2;  h: height of the arm's surface above the joint",
    ],
    "exact": [
        "phi: smallest positive root of R phi - a sin(phi) + d (1 - cos(phi)) - (kappa/2) phi^2",
        "X = a cos(phi) - d sin(phi);  H = a sin(phi) + d cos(phi);  V = kappa (ell - H)",
        "om = (rho^2 + X (R - kappa phi) + H (h + d))/M;  K = (1/2) M om^2",
        "jog: R' = R - h phi + a (1 - cos phi) - d (phi - sin phi);  flip: R' = R'(jog) - a - (L' - a'), next side",
    ],
    "small": [
        "om = (rho^2 - a R + 2 a^2 + d^2 + d h)/M;  K = (1/2) M om^2;  V = kappa (ell - d) - 2 a (R - a)",
        "jog: R' = R - h phi;  flip: R' = R - h phi - a - (L' - a'), next side",
    ],
    "small-angle": ["phi = 2 (R - a)/kappa"],
    "small-angle-2": ["phi = 2 (R - a)/(kappa - d)"],
    "exact energy": ["flip if and only if K > V or X < 0"],
    "exact signed": ["flip if and only if sgn(om) K - sgn(X) V > 0"],
    "small energy": ["flip if and only if K > V"],
    "small signed": ["flip if and only if sgn(om) K - V > 0"],
}


# ---------------------------------------------------------------------------------------------------------- the file


class BadFileError(Exception):
    """The file is not a certificate that can be read."""


def require(condition: bool, message: str) -> None:
    """Raise BadFileError unless the condition holds."""
    if not condition:
        raise BadFileError(message)


def plain(text: object, most: int = 80) -> str:
    """Clean the text of a stranger: without control characters, fit to be printed, and cut where all can see it."""
    whole = str(text)
    shown = "".join(c if c.isprintable() and c.isascii() else "?" for c in whole[:most])
    return shown + ("... (cut)" if len(whole) > most else "")


def stored_entries(data: memoryview, most: int, what: str) -> dict[str, memoryview]:
    """Find the entries of an uncompressed zip, as views of its bytes; refuse anything out of the ordinary."""

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
        shown = plain(name.decode("latin-1"))
        ordinary(method == 0 and packed == full, f"entry {shown} is compressed; only stored ones are read")
        ordinary(flags & ~0x0800 == 0 and name.isascii(), f"entry {shown} has unusual flags or an odd name")
        ordinary(shown not in entries, f"entry {shown} occurs twice")
        local = bytes(data[offset : offset + 30])  # what stands before the entry itself
        ordinary(offset + 30 <= start and local[:4] == b"PK\3\4", f"entry {shown} is damaged")
        n_local, extra_local = struct.unpack("<2H", local[26:])
        begin = offset + 30 + n_local + extra_local
        same = local[8:10] == b"\0\0" and bytes(data[offset + 30 : offset + 30 + n_local]) == name
        ordinary(same and begin + full <= start, f"entry {shown} is damaged")
        entries[shown] = data[begin : begin + full]
        spans.append((offset, begin + full))
        if full <= 4 << 20:  # larger ones are covered by the hashes of the arrays
            ordinary(zlib.crc32(entries[shown]) == crc, f"entry {shown} is damaged (checksum)")
    ordinary(at == end, "damaged directory")
    ordinary(all(a[1] <= b[0] for a, b in itertools.pairwise(sorted(spans))), "entries overlap")
    return entries


def parse_json(raw: bytes) -> dict[str, Any]:
    """Parse the header; depth, numbers and repeated keys are limited before and while it is read."""
    # "*+" keeps no way back: ten times as fast on a file of nothing but quotes
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
    rb"\{'descr': '([<|][fi][148])', 'fortran_order': False, 'shape': \(([0-9]{1,10}),(?: ([0-9]{1,2}))?\), \} *\n"
)


def read_array(entry: memoryview, name: str, dtype: str, columns: int, said: object) -> Array:
    """Read one array from the bytes of a .npy file: of the type its name asks for, with the hash that is said."""
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
    """Return the header and the entries of the arrays."""
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


# --------------------------------------------------------------------------------------------------------- the scene

DECIMAL = r"[+-]?(?:[0-9]{1,100}(?:\.[0-9]{0,100})?|\.[0-9]{1,100})(?:[eE][+-]?[0-9]{1,3})?"
NUMBER = re.compile(rf" *({DECIMAL})(?: +|(?=%))([a-z%/^0-9]{{1,8}}) *")  # as a scene may be written
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
    "density": {"kg/m^2": Fraction(1), "g/cm^2": Fraction(10)},  # of a plate's area; and of its volume:
    "bulk": {"kg/m^3": Fraction(1), "g/cm^3": Fraction(1000)},
    "share": {"%": Fraction(1, 100)},
}
KINDS = " ".join(UNITS)
BY_PI = ("deg", "deg/s", "rpm")
G0 = Fraction(980665, 100_000)
LONGEST_TEXT = (
    64  # of a quantity: what is longer is not read, so that nothing has to be cut where it is shown
)


def decimal(value: Fraction) -> str:
    """Write a rational number as the decimal that it is; one that is none as a fraction, which is exact as well."""
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


def shown(value: float, *, up: bool, digits: int = 9) -> str:
    """Write a float with few digits, rounded up or down."""
    return str(Context(digits, ROUND_CEILING if up else ROUND_FLOOR).create_decimal(value))


class Quantity(NamedTuple):
    """An interval in basic units (metre, radian, second, kilogram), exact; in multiples of pi where `pi` says so."""

    lo: Fraction
    hi: Fraction
    pi: bool
    unit: str

    def ball(self) -> Arb:
        """Enclose it in a ball."""
        return span(self.lo, self.hi) * (arb.pi() if self.pi else 1)

    def ends(self) -> list[Arb]:
        """Enclose its two ends."""
        return [exact(end) * (arb.pi() if self.pi else 1) for end in (self.lo, self.hi)]

    def __str__(self) -> str:
        """Write what was read, from the numbers and not from the text."""
        factor = next(kind[self.unit] for kind in UNITS.values() if self.unit in kind)
        lo, hi = (f"{decimal(end / factor)} {self.unit}" for end in (self.lo, self.hi))
        return lo if self.lo == self.hi else f"every value in [{lo}, {hi}]"


def exact(value: Fraction) -> Arb:
    """Enclose a rational number."""
    return arb(fmpq(value.numerator, value.denominator))


def span(lo: Fraction, hi: Fraction) -> Arb:
    """Enclose an interval."""
    return exact(lo) if lo == hi else exact(lo).union(exact(hi))


def quantity(value: object, kinds: str, where: str) -> Quantity:
    """Read a quantity, `"5.75 in"` or a pair of such, of one of the kinds named; a half of one is read already."""
    if isinstance(value, Quantity):  # `halves` put it there: nothing that stands in a file is one
        return value
    pair = value if isinstance(value, list) else [value, value]
    require(len(pair) == 2, f"{where}: an interval has two ends")
    read = []
    for text in pair:
        words = text if isinstance(text, str) and len(text) <= LONGEST_TEXT else ""
        tidy = words == " ".join(words.split()) != ""
        require(
            tidy, f"{where}: {plain(text)} is not text of at most {LONGEST_TEXT} signs, with single blanks"
        )
        found = NUMBER.fullmatch(words)
        require(found is not None, f"{where}: {plain(text)} is not a decimal number and a unit")
        assert found is not None
        size = abs(Fraction(found[1]))
        ordinary = size == 0 or Fraction(1, 10**300) <= size <= 10**12
        require(ordinary, f"{where}: {plain(text)} is not 0 or of a size from 1e-300 to 1e12")
        factors = [UNITS[kind][found[2]] for kind in kinds.split() if found[2] in UNITS[kind]]
        require(len(factors) == 1, f"{where}: {plain(found[2])} is not a unit of {kinds}")
        read.append((Fraction(found[1]) * factors[0], found[2]))
    (lo, unit), (hi, other) = read
    require((unit in BY_PI) == (other in BY_PI), f"{where}: mixes degrees and radians")
    require(lo <= hi, f"{where}: the interval is empty")
    return Quantity(lo, hi, unit in BY_PI, unit)


def table(value: object, where: str, needed: str, optional: str = "") -> dict[str, Any]:
    """Return a JSON object that has the keys needed and no others but the optional ones."""
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


@dataclass(slots=True)
class Side:
    """What the throw from one side depends on, as balls (`small_d` is d in small-angle-2 and 0 otherwise)."""

    a: Arb
    d: Arb
    length: Arb
    h: Arb
    rho2: Arb
    arm: Arb
    exact: bool
    signed: bool
    concave: bool = False
    small_d: Arb = ZERO
    shift: Arb = ZERO  # R'(jog) - R'(flip) = a + L' - a'
    ell: Arb = ZERO
    hd: Arb = ZERO  # h + d
    landing: Arb = ZERO  # a part lands within this of where the throw would put it
    over_2m: Arb = ZERO
    floats: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)  # a, d, small_d, a past half a turn: for guesses only
    early: tuple[float, ...] = (
        0.0,
        0.0,
        0.0,
        0.0,
    )  # those of the earliest impact, and of the latest: f has -a sin p,
    late: tuple[float, ...] = (
        0.0,
        0.0,
        0.0,
        0.0,
    )  # so that a large a hastens it up to p = pi and delays it from there


@dataclass(slots=True)
class Scene:
    """Enclosures of all that a scene says, lengths in the unit of arm.length."""

    sides: list[Side]
    k_lo: Arb  # kappa at its smallest, noise included; both ends are exact points
    k_hi: Arb
    rho: Arb
    arm: tuple[Fraction, Fraction]
    unit: str
    raw: dict[str, Any] = field(default_factory=dict)  # what it was read from, and the noise
    noise: object = None
    loose: float = 0.0  # how wide its sides' enclosures are together, as far as `halves` can narrow them
    parts: "dict[tuple[str, int], list[Scene]]" = field(
        default_factory=dict
    )  # its halves, once they are asked for

    def cuts(self) -> list[str]:
        """Name the quantities of part and arm that are intervals; kappa is halved apart, the arm ends where it ends."""
        known = [(name, value) for name, value in quantities(self.raw) if name.startswith(("part.", "arm.s"))]
        halved = [name for name, value in known if isinstance(value, Quantity) and value.lo < value.hi]
        return halved + [name for name, value in known if isinstance(value, list)]

    def halves(self, of: str = "", side: int = 0) -> "list[Scene]":
        """Return two scenes that hold it together, [] if it is a point: halved in what narrows its enclosures most.

        A quantity is halved, not a_i or d_i: they and the lengths go together.  `of`: what is wanted narrower, on one
        side; everything on all sides by default.
        """
        key = (of, side)
        if self.loose > 0 and key not in self.parts:
            pairs = [[read_scene(raw, self.noise) for raw in halved(self.raw, name)] for name in self.cuts()]
            self.parts[key] = min(
                pairs, key=lambda pair: sum(half.width(of, side) for half in pair), default=[]
            )
        return self.parts.get(key, [])

    def width(self, of: str = "", side: int = 0) -> float:
        """Say how wide the enclosures are: all, or those that the decision or the image of one side depends on."""
        if not of:
            return self.loose
        s = self.sides[side]
        balls = [s.a, s.d, s.h, self.rho] + ([s.shift] if of == "image" else [])
        return sum(float(ball.rad()) for ball in balls)


def halved(raw: dict[str, Any], name: str) -> Iterator[dict[str, Any]]:
    """Cut one quantity of a scene that was read in two halves."""
    words = re.findall(r"[^.\[\]]+", name)

    def place(tree: Any) -> tuple[Any, Any]:
        for k, word in enumerate(words):
            at = word if isinstance(tree, dict) else int({"x": "0", "y": "1"}.get(word, word))
            if k == len(words) - 1:
                return tree, at
            tree = tree[at]
        raise KeyError(name)

    node, at = place(raw)
    q = quantity(node[at], KINDS, name)
    middle = (q.lo + q.hi) / 2
    for half in (q._replace(hi=middle), q._replace(lo=middle)):
        tree = copy.deepcopy(raw)
        node, at = place(tree)
        node[at] = half
        yield tree


def over_halves(scene: Scene, check: Callable[..., str], *more: Any) -> str:
    """Check something that is said of all parameters, by halves where it fails of them together; what fails, or ""."""
    stack, tried = [(scene, 0)], 0
    while stack:
        piece, depth = stack.pop()
        tried += 1
        bad = check(piece, *more)
        if bad:
            parts = piece.halves() if depth < DEPTH and tried + len(stack) < MOST_HALVES else []
            if not parts:
                return bad
            stack += [(half, depth + 1) for half in parts]
    return ""


def read_scene(raw: object, noise: object) -> Scene:
    """Enclose a_i, d_i, L_i, rho, kappa, h and the arm's length from the decimals of a scene."""
    scene = table(raw, "scene", "part arm throw model", "name gravity goal world tolerance effects")
    check_spread(scene, noise)
    arm = table(scene["arm"], "arm", "surface_height length")
    reach = quantity(arm["length"], "length", "arm.length")
    unit = LENGTHS[reach.unit]

    def length(value: object, where: str) -> Arb:
        q = quantity(value, "length", where)
        return span(q.lo / unit, q.hi / unit)

    rests, rho = narrow_part(scene["part"], unit)
    require(bool(rho > 0), "the radius of gyration is not positive")
    rho2 = rho * rho

    k_lo, k_hi = read_kappa(scene, noise, unit)
    scatter = read_noise(noise, "landing.x", "length").ball() / exact(unit)
    model = table(scene["model"], "model", "flight flip")
    known = model["flight"] in ("exact", "small-angle", "small-angle-2") and model["flip"] in (
        "signed",
        "energy",
    )
    require(known, "the model is not one that is known")
    is_exact, is_signed = model["flight"] == "exact", model["flip"] == "signed"
    require(reach.lo > 0, "arm.length is not positive")
    h = length(arm["surface_height"], "arm.surface_height")
    reach_ball = span(reach.lo / unit, reach.hi / unit)
    sides = []
    for i, (a, d, long, shift) in enumerate(rests):
        require(bool(a > 0) and bool(a < long) and bool(d > 0), f"the part does not rest on side {i}")
        sides.append(Side(a, d, long, h, rho2, reach_ball, is_exact, is_signed, shift=shift))
    for side in sides:
        side.ell = (side.a**2 + side.d**2).sqrt()
        side.hd = side.h + side.d
        side.over_2m = HALF / (side.rho2 + side.ell**2)
        side.landing = scatter
        side.small_d = side.d if model["flight"] == "small-angle-2" else ZERO
        side.concave = bool(k_lo > side.ell) or not side.exact
        a_lo, a, a_hi = (float(end) for end in (side.a.lower(), side.a.mid(), side.a.upper()))
        side.floats = (a, float(side.d.mid()), float(side.small_d.mid()), a)
        side.early = (a_hi, float(side.d.lower()), float(side.small_d.lower()), a_lo)
        side.late = (a_lo, float(side.d.upper()), float(side.small_d.upper()), a_hi)
        require(bool(k_lo > side.small_d), "small-angle-2 needs kappa > d")
    ends = reach.lo / unit, reach.hi / unit
    whole = Scene(sides, k_lo, k_hi, rho, ends, reach.unit, scene, noise)
    if whole.cuts():
        whole.loose = sum(float(ball.rad()) for s in sides for ball in (s.a, s.d, s.h, s.shift, whole.rho))
    return whole


class Rising:
    """A ball with its derivatives by some quantities, for the mean value theorem."""

    __slots__ = ("by", "x")

    def __init__(self, x: Arb, by: list[Arb]):
        self.x, self.by = x, by

    def __neg__(self) -> "Rising":
        return Rising(-self.x, [-d for d in self.by])

    def __add__(self, other: Any) -> "Rising":
        if isinstance(other, Rising):
            return Rising(self.x + other.x, [d + e for d, e in zip(self.by, other.by, strict=True)])
        return Rising(self.x + other, self.by)

    def __sub__(self, other: Any) -> "Rising":
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> "Rising":
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> "Rising":
        if isinstance(other, Rising):
            pairs = zip(self.by, other.by, strict=True)
            return Rising(self.x * other.x, [d * other.x + self.x * e for d, e in pairs])
        return Rising(self.x * other, [d * other for d in self.by])

    def __truediv__(self, other: Any) -> "Rising":
        if isinstance(other, Rising):
            ratio, pairs = self.x / other.x, zip(self.by, other.by, strict=True)
            return Rising(ratio, [(d - ratio * e) / other.x for d, e in pairs])
        return Rising(self.x / other, [d / other for d in self.by])

    def __rtruediv__(self, other: Any) -> "Rising":
        ratio = other / self.x
        return Rising(ratio, [-ratio * d / self.x for d in self.by])

    def __pow__(self, two: int) -> "Rising":
        return Rising(self.x**two, [two * self.x ** (two - 1) * d for d in self.by])

    def sqrt(self) -> "Rising":
        """Take the square root."""
        root = self.x.sqrt()
        return Rising(root, [d / (2 * root) for d in self.by])

    def sin_cos(self) -> "tuple[Rising, Rising]":
        """Take sine and cosine."""
        sin, cos = self.x.sin_cos()
        return Rising(sin, [cos * d for d in self.by]), Rising(cos, [-sin * d for d in self.by])

    def __abs__(self) -> "Rising":  # of use in x |x| only, where the sign of 0 does not matter
        sign = ONE if self.x > 0 else -ONE if self.x < 0 else ONE.union(-ONE)
        return Rising(abs(self.x), [sign * d for d in self.by])

    def __gt__(self, other: Any) -> bool:
        return bool(self.x > (other.x if isinstance(other, Rising) else other))

    __radd__, __rmul__ = __add__, __mul__


def ends_of(value: object, where: str, unit: Fraction) -> tuple[Fraction, Fraction]:
    """Read a length of the part in the scene's unit, or a mass in kg: its least and its largest value."""
    kind, by = ("mass", Fraction(1)) if where.endswith(".mass") else ("length", unit)
    q = quantity(value, kind, where)
    return q.lo / by, q.hi / by


def narrow_part(part: object, unit: Fraction) -> tuple[list[tuple[Any, ...]], Arb]:
    """Enclose (a_i, d_i, L_i, a_i + L_next - a_next) of every side, and rho.

    Where lengths or masses are intervals a formula that names one of them twice is too wide: f(c) + f'(box) (q - c) is
    narrower.
    """

    def plain(value: object, where: str) -> Arb:
        return span(*ends_of(value, where, unit))

    plain_rests, rho = read_part(part, unit, plain)
    wide: dict[int, tuple[int, Fraction, Fraction]] = {}

    def look(value: object, where: str) -> Arb:
        lo, hi = ends_of(value, where, unit)
        if lo < hi:
            wide.setdefault(id(value), (len(wide), lo, hi))
        return span(lo, hi)

    read_part(part, unit, look)
    if not wide:
        return plain_rests, rho

    def middle(value: object, where: str) -> Arb:
        known = wide.get(id(value))
        return plain(value, where) if known is None else exact((known[1] + known[2]) / 2)

    def rising(value: object, where: str) -> Any:
        known = wide.get(id(value))
        own = None if known is None else known[0]
        return Rising(plain(value, where), [ONE if k == own else ZERO for k in range(len(wide))])

    centre, rho_centre = read_part(part, unit, middle)
    steep, rho_steep = read_part(part, unit, rising)
    half = [span(-(hi - lo) / 2, (hi - lo) / 2) for _, lo, hi in wide.values()]

    def about(c: Arb, f: Any, known: Arb) -> Arb:
        if not isinstance(f, Rising):
            return known
        total = c
        for slope, offset in zip(f.by, half, strict=True):
            total = total + slope * offset
        return known if not total.is_finite() or known in total else known.intersection(total)

    rests = [
        tuple(about(*each) for each in zip(*rows_of_side, strict=True))
        for rows_of_side in zip(centre, steep, plain_rests, strict=True)
    ]
    return rests, about(rho_centre, rho_steep, rho)


def read_part(
    part: Any, unit: Fraction, read: Callable[[object, str], Any]
) -> tuple[list[tuple[Any, ...]], Any]:
    """Compute (a_i, d_i, L_i, a_i + L_next - a_next) of every side, and rho, in whatever arithmetic `read` gives."""
    vertices = read_polygon(part, read)
    n = len(vertices)
    mass = part["mass"]
    if "plate_density" in mass:
        table(mass, "part.mass", "plate_density", "plate_thickness points")
        start, rho2 = read_plate(mass, vertices, unit, read)
        (ex, ey), along, above, rho, own = (ONE, ZERO), ZERO, ZERO, rho2.sqrt(), -1
    else:
        table(mass, "part.mass", "center radius_of_gyration")
        center = table(mass["center"], "part.mass.center", "side along above")
        fits = type(center["side"]) is int and 0 <= center["side"] < n
        require(fits, "part.mass.center.side is not a side")
        along = read(center["along"], "part.mass.center.along")
        above = read(center["above"], "part.mass.center.above")
        own = center["side"]
        start, (ex, ey), _ = side_frame(vertices, own)
        rho = read(mass["radius_of_gyration"], "part.mass.radius_of_gyration")
    rests = []
    for i in range(n):
        (px, py), (ux, uy), long = side_frame(vertices, i)
        x, y = start[0] - px, start[1] - py
        with_e, across_e = ex * ux + ey * uy, ux * ey - uy * ex
        a = x * ux + y * uy + along * with_e - above * across_e  # the centre is start + along e + above n
        d = ux * y - uy * x + along * across_e + above * with_e
        # what stands in the scene is narrower than what is computed, where something is known to a tolerance only
        a, d = (along, above) if i == own else (a, d)
        long = read(part["sides"][i], "part.sides") if "sides" in part else long
        rests.append((a, d, long))
    after = rests[1:] + rests[:1]
    return [(a, d, long, a + ll - aa) for (a, d, long), (aa, _, ll) in zip(rests, after, strict=True)], rho


def read_polygon(part: object, read: Callable[[object, str], Any]) -> list[tuple[Arb, Arb]]:
    """Read the vertices, counterclockwise; side i goes from vertex -i to vertex 1 - i (mod their number).

    So side 0 is the edge from vertex 0 to vertex 1, and the left vertex of side i is the right vertex of side i+1.
    """
    keys = table(part, "part", "mass", "sides vertices")
    require(("sides" in keys) != ("vertices" in keys), "part: either sides or vertices")
    require(isinstance(keys["mass"], dict), "part.mass is not an object")
    if "sides" in keys:
        three = rows(keys["sides"], "part.sides", 3, 3)
        base, left, right = (read(q, f"part.sides[{i}]") for i, q in enumerate(three))
        x = (base**2 + left**2 - right**2) / (2 * base)
        y2 = left**2 - x**2
        positive = all(bool(q > 0) for q in (base, left, right, y2))
        require(positive, "the sides form no triangle")
        vertices = [(ZERO, ZERO), (base, ZERO), (x, y2.sqrt())]
    else:
        pairs = [rows(v, "a vertex", 2, 2) for v in rows(keys["vertices"], "part.vertices", 3, 64)]
        vertices = [(read(x, "part.vertices"), read(y, "part.vertices")) for x, y in pairs]
    n = len(vertices)
    for k in range(n):
        (px, py), (ex, ey), _ = side_frame(vertices, -k)
        for j in set(range(n)) - {k, (k + 1) % n}:
            beyond = (vertices[j][1] - py) * ex - (vertices[j][0] - px) * ey
            require(bool(beyond > 0), "the vertices are not those of a convex polygon, counterclockwise")
    return vertices


def side_frame(vertices: list[tuple[Arb, Arb]], i: int) -> tuple[tuple[Arb, Arb], tuple[Arb, Arb], Arb]:
    """Left end, unit vector to the right end, and length of side i."""
    n = len(vertices)
    left, right = vertices[-i % n], vertices[(1 - i) % n]
    dx, dy = right[0] - left[0], right[1] - left[1]
    long = (dx**2 + dy**2).sqrt()
    return left, (dx / long, dy / long), long


def read_plate(
    mass: dict[str, Any],
    vertices: list[tuple[Arb, Arb]],
    unit: Fraction,
    read: Callable[[object, str], Any],
) -> tuple[tuple[Arb, Arb], Arb]:
    """Compute centre of mass and squared radius of gyration of a uniform plate with points of mass on it."""
    area = sx = sy = second = ZERO
    for (x0, y0), (x1, y1) in zip(vertices, vertices[1:] + vertices[:1], strict=True):
        cross = x0 * y1 - x1 * y0
        area += cross / 2
        sx += (x0 + x1) * cross / 6
        sy += (y0 + y1) * cross / 6
        second += (x0 * x0 + x0 * x1 + x1 * x1 + y0 * y0 + y0 * y1 + y1 * y1) * cross / 12
    thick = "plate_thickness" in mass
    density = quantity(mass["plate_density"], "bulk" if thick else "density", "part.mass.plate_density")
    weight = density.ball() * exact(unit) ** 2
    if thick:
        thickness = quantity(mass["plate_thickness"], "length", "part.mass.plate_thickness")
        require(thickness.lo > 0, "part.mass.plate_thickness is not positive")
        weight = weight * thickness.ball()
    total, sx, sy, second = weight * area, weight * sx, weight * sy, weight * second
    for point in rows(mass.get("points", []), "part.mass.points", 0, 1000):
        table(point, "part.mass.points", "x y mass")
        x, y = (read(point[key], f"part.mass.points.{key}") for key in "xy")
        w = read(point["mass"], "part.mass.points.mass")
        require(w > 0, "a mass is not positive")
        total, sx, sy, second = total + w, sx + w * x, sy + w * y, second + w * (x**2 + y**2)
    require(density.lo > 0 and bool(total > 0), "a mass is not positive")
    return (sx / total, sy / total), second / total - (sx / total) ** 2 - (sy / total) ** 2


NONE = Quantity(Fraction(0), Fraction(0), False, "")


def read_noise(noise: object, name: str, kinds: str) -> Quantity:
    """Read by how much a quantity differs from throw to throw; a share of it where the unit is %."""
    if noise is None:
        return NONE
    known = table(noise, "noise", "", "throw.speed gravity.tilt landing.x")
    require(len(known) > 0, "noise of nothing")
    dev = quantity(known[name], kinds, f"noise of {name}") if name in known else NONE
    require(dev.lo == dev.hi >= 0, "noise is not a number that is not negative")
    return dev


def check_spread(scene: dict[str, Any], noise: object) -> None:
    """Check that no effects are on but a bounded spread, and that this is in the noise that is claimed."""
    effects = scene.get("effects", {})
    on = (
        {name: how for name, how in effects.items() if how}
        if isinstance(effects, dict)
        else {"effects": True}
    )
    known = set(on) <= {"spread"} and on.get("spread", "bounded") == "bounded"
    require(known, "scene: effects are switched on, which the throw map, version 1, has not")
    facts = "friction restitution bounce_threshold stroke scatter"
    world = table(scene.get("world") or {}, "scene.world", "", facts)
    for word, text in table(world.get("scatter") or {}, "scene.world.scatter", "", "speed landing").items():
        name, kinds = SCATTER[word]
        scatter, claimed = (
            quantity(text, kinds, f"scene.world.scatter.{word}"),
            read_noise(noise, name, kinds),
        )
        require(scatter.lo == scatter.hi >= 0, "scene.world.scatter is not a number that is not negative")
        alike = (scatter.unit == "%", scatter.pi) == (claimed.unit == "%", claimed.pi)
        covered = scatter.lo == 0 or (alike and scatter.lo <= claimed.lo)
        require(
            not on or covered,
            f"scene: its spread scatters {name} by {scatter}, which is not in the noise claimed",
        )


SCATTER = {"speed": ("throw.speed", "share speed"), "landing": ("landing.x", "length")}


def share_and_more(dev: Quantity) -> tuple[Arb, Arb]:
    """Split a deviation: a share of the quantity, or so much of it in its own unit."""
    return (dev.ball(), ZERO) if dev.unit == "%" else (ZERO, dev.ball())


def tilted(tilts: list[Arb], dev: Quantity) -> list[Arb]:
    """Least and largest tilt with its noise, proved to lie between level and upright, where the sine rises."""
    share, more = share_and_more(dev)
    ends = [tilts[0] * (1 - share) - more, tilts[1] * (1 + share) + more]
    steep = bool(ends[0] > 0) and bool(ends[1] < arb.pi() / 2)
    require(steep, "gravity.tilt is not between 0 and 90 degrees")
    return ends


def read_kappa(scene: dict[str, Any], noise: object, unit: Fraction) -> tuple[Arb, Arb]:
    """Enclose the smallest and largest kappa = g/w^2, with all noise, from below and from above by points.

    Where kappa is given the noise of the tilt multiplies it by sin(tilt') / sin(tilt).  With a share s that is
    sin((1 +- s) t) / sin(t), whose logarithm has the slope (1 +- s) cot((1 +- s) t) - cot(t), and u cot(u t) falls with
    u; with so much more, cos(m) +- cot(t) sin(m).  Either is farthest from 1 at the smallest tilt allowed.
    """
    throw = table(scene["throw"], "throw", "", "kappa speed")
    require(len(throw) == 1, "throw: either kappa or speed")
    gravity = table(scene.get("gravity", {}), "gravity", "", "acceleration tilt")
    share, more = share_and_more(read_noise(noise, "throw.speed", "share speed"))
    require(bool(share < 1), "noise reaches 100 %")
    dev = read_noise(noise, "gravity.tilt", "share angle")
    require("tilt" in gravity or dev is NONE, "noise of gravity.tilt needs a tilt")
    if "kappa" in throw:
        q = quantity(throw["kappa"], "length", "throw.kappa")
        require(q.lo > 0, "throw.kappa is not positive")
        require(bool(more == 0), "noise with a unit needs throw.speed")
        less = greater = ONE
        if dev is not NONE:
            tilts = quantity(gravity["tilt"], "angle", "gravity.tilt").ends()
            tilted(tilts, dev)
            less, greater = (end.sin() / tilts[0].sin() for end in tilted([tilts[0], tilts[0]], dev))
        lo = exact(q.lo / unit) * less / (1 + share) ** 2
        hi = exact(q.hi / unit) * greater / (1 - share) ** 2
        return lo.lower(), hi.upper()
    require(len(gravity) == 1, "gravity: either acceleration or tilt")
    if "tilt" in gravity:
        tilts = quantity(gravity["tilt"], "angle", "gravity.tilt").ends()
        g = [exact(G0 / unit) * tilt.sin() for tilt in tilted(tilts, dev)]
    else:
        g = [end / exact(unit) for end in quantity(gravity["acceleration"], "acceleration", "gravity").ends()]
    speeds = quantity(throw["speed"], "speed", "throw.speed").ends()
    slow, fast = speeds[0] * (1 - share) - more, speeds[1] * (1 + share) + more
    require(bool(g[0] > 0) and bool(slow > 0), "gravity and throw.speed must be positive")
    return (g[0] / fast**2).lower(), (g[1] / slow**2).upper()


def check_parameters(scene: Scene, said: object, where: str) -> str:
    """Check that each enclosure lies inside the interval the producer says it computed with; else what does not.

    No proof rests on it, it tells a file that was put together wrongly: so it may be a little wider.
    """
    names = "a d length kappa surface_height arm_length radius_of_gyration"
    said = table(said, f"{where} parameters", names)
    first = scene.sides[0]
    mine: dict[str, list[Arb]] = {key: [getattr(s, key) for s in scene.sides] for key in ("a", "d", "length")}
    mine |= {"kappa": [scene.k_lo.union(scene.k_hi)], "surface_height": [first.h], "arm_length": [first.arm]}
    mine["radius_of_gyration"] = [scene.rho]
    for key, balls in mine.items():
        pairs = rows(said[key], key, len(balls), len(balls)) if key in ("a", "d", "length") else [said[key]]
        for i, (ball, pair) in enumerate(zip(balls, pairs, strict=True)):
            lo, hi = (arb(hex_float(text, key)) for text in rows(pair, key, 2, 2))
            # a ball's radius has 30 bits; and where the formulas of a part with a tolerance bend, a ball is wider than
            # an interval may be
            slack = (hi - lo) * 2.0**-10 + (abs(hi) * 2.0**-26 if scene.loose > 0 else ZERO)
            if not (ball >= lo - slack and ball <= hi + slack):
                return f"parameter {key} {i}: the scene gives {ball.str(17)}, not in [{lo.str(17)}, {hi.str(17)}]"
    return ""


def hex_float(text: object, where: str) -> float:
    """Read a float in Python's hexadecimal form."""
    form = r"-?0x[01]\.[0-9a-f]{1,13}p[+-][0-9]{1,4}"
    fits = isinstance(text, str) and re.fullmatch(form, text) is not None
    require(fits, f"{where} is not a hexadecimal number")
    try:
        return float.fromhex(str(text))
    except OverflowError:
        raise BadFileError(f"{where} is too large") from None


# ---------------------------------------------------------------------------------------------- the model's formulas


class Angle(NamedTuple):
    """An angle p with two functions of it alone: g, where f = (R - kappa p/2) p + g, and D = R'(jog) - R."""

    p: Arb
    g: Arb
    D: Arb


def at_angle(s: Side, p: Arb) -> Angle:
    """Evaluate what depends on the angle alone."""
    if s.exact:
        sin, cos = p.sin_cos()
        back = 1 - cos  # a and d once each: they may be wide
        return Angle(p, s.d * back - s.a * sin, s.a * back - s.d * (p - sin) - s.h * p)
    return Angle(p, (HALF * s.small_d * p - s.a) * p, -s.h * p)


def flight(x: Arb, kappa: Arb, at: Angle) -> Arb:
    """Evaluate f at one angle: positive before the impact."""
    return (x - HALF * kappa * at.p) * at.p + at.g


def sine_cosine(phi: Arb) -> tuple[Arb, Arb]:
    """Enclose both over a wide ball, by the mean value theorem: Arb's own are as wide as the angle."""
    sin, cos = phi.sin_cos()
    middle = phi.mid()
    at, off = middle.sin_cos(), phi - middle
    return at[0] + cos * off, at[1] - sin * off


def over_angles(s: Side, phi: Arb, R: Arb, kappa: Arb) -> tuple[int, Arb, Arb]:
    """Over a box: the decision (0 jog, 1 flip, 2 not settled), D'(phi), and df/dphi."""
    if s.exact:
        sin, cos = sine_cosine(phi)
        H = s.a * sin + s.d * cos
        X = s.a * cos - s.d * sin
        fall = R - kappa * phi
        spin = s.rho2 + X * fall + H * s.hd  # M om
        return decide_exact(s, spin, X, H, kappa), s.a * sin - s.d * (1 - cos) - s.h, fall - X
    spin = s.rho2 - s.a * R + 2 * s.a * s.a + s.d * s.d + s.d * s.h
    V = kappa * (s.ell - s.d) - 2 * s.a * (R - s.a)
    F = spin * (abs(spin) if s.signed else spin) * s.over_2m - V
    return (1 if F > 0 else 0 if F < 0 else 2), -s.h, R - s.a - (kappa - s.small_d) * phi


def slope_over(s: Side, phi: Arb, kappa: Arb, rise: Arb, f_slope: Arb) -> Arb | None:
    """Enclose dR'/dR over a bracket of the angle; None where one root in it for each R, growing with R, is not proved.

    f(p) = (R - R(p)) p, so that dphi/dR = 1/R'(phi) where R(p) rises: kappa, a and d stand there once, and R does not.
    By df/dphi it is -phi/(df/dphi).
    """
    if not s.exact:
        return ONE - 2 * s.h / (kappa - s.small_d)
    steep = its_slope(s, ratios(phi), kappa) if phi < 3 else ZERO
    wide, narrow = (ONE + rise / steep if steep > 0 else None), None
    if f_slope < 0:  # better where the box is small, for R(p) is a series that ends
        narrow = ONE - rise * phi / f_slope
    if wide is None or narrow is None:
        return narrow if wide is None else wide
    return wide.intersection(narrow)


def decide_exact(s: Side, spin: Arb, X: Arb, H: Arb, kappa: Arb) -> int:
    """Decide by the flip criterion of the exact model over a box.

    X^2 + H^2 = ell^2 gives ell - H = X^2/(ell + H): the right of it is narrow where H > 0, and next to H = -ell only
    the left is; both hold wherever they are defined.
    """
    V = kappa * barrier(s.ell, X, H, s.signed)
    F = spin * (abs(spin) if s.signed else spin) * s.over_2m - V
    if F > 0 or (X < 0 and not s.signed):
        return 1
    return 0 if F < 0 and (s.signed or X > 0) else 2


def barrier(ell: Any, X: Any, H: Any, signed: bool) -> Any:
    """Evaluate V/kappa = ell - H, with the sign of X where that counts."""
    top, below_it = ell + H, ell - H
    if signed and not X > 0:
        below_it = -below_it if -X > 0 else None  # of either sign
    if not top > 0:
        return arb("nan") if below_it is None else below_it
    above_it = X * (abs(X) if signed else X) / top
    if below_it is None or H > 0 or isinstance(above_it, Rising):
        return above_it if below_it is None or H > 0 else below_it
    return above_it.intersection(below_it)


def positive_until(s: Side, x: Arb, kappa: Arb, end: Angle) -> bool:
    """Prove f > 0 on (0, end].

    f(0) = 0 and f'(0) = x - a > 0.  Where f is strictly concave, f(end) > 0 is enough.  Otherwise a march: with
    m >= |f''|, f(t + u) >= f(t) + f'(t) u - m u^2/2, which is concave in u, so that two positive ends suffice.
    """
    if not (flight(x, kappa, end) > 0 and x > s.a):
        return False
    if s.concave:
        return True
    m = s.ell + kappa
    t = arb(
        float(((x - s.a) / m).lower())
    )  # f(u) >= u (x - a - m u/2) > 0 for u <= (x - a)/m, and t rounds near
    if not x - s.a - HALF * m * t > 0:
        return False
    for _ in range(1000):
        if t >= end.p:
            return True
        sin, cos = t.sin_cos()
        f = flight(x, kappa, at_angle(s, t))
        slope = x - s.a * cos + s.d * sin - kappa * t
        f0, s0, m0 = float(f.mid()), float(slope.mid()), float(m.mid())
        if not f0 > 0:
            return False
        u = arb((s0 + math.sqrt(s0 * s0 + 2 * m0 * f0)) / m0 * (1 - 2.0**-20))
        if not (u > 0 and f > 0 and f + (slope - HALF * m * u) * u > 0):
            return False
        t = arb(math.nextafter(float(t + u), 0.0))  # not above t + u
    return False


# Brackets this far beyond a guess: where a and d are wide their balls' radii, which have 30 bits, hide anything less.
SLACKS = (2.0**-40, 2.0**-26)


def guess_root(floats: tuple[float, ...], exact: bool, x: float, kappa: float, p: float) -> float:
    """Newton in floats from p; believed by nobody."""
    first_a, d, small, a_past = floats
    if not exact:
        return 2.0 * (x - first_a) / (kappa - small)
    last = math.inf
    for k in range(
        100
    ):  # next to the joint the angle is far smaller than where it begins, and is halved at first
        sin, cos = math.sin(p), math.cos(p)
        a = first_a if sin > 0 else a_past
        slope = x - a * cos + d * sin - kappa * p
        if slope >= 0.0:
            return math.nan
        step = ((x - 0.5 * kappa * p) * p + d - a * sin - d * cos) / slope
        p -= step
        if abs(step) < 1e-14 * p or (k > 12 and abs(step) > 0.75 * last):
            break
        last = abs(step)
    return p


def root_above(s: Side, x: Arb, kappa: Arb, at: Angle) -> Angle:
    """Find an angle that the impact at x comes before, for this kappa and larger ones: `at` or a proved better one."""
    p = guess_root(s.late, s.exact, float(x.mid()), float(kappa.mid()), float(at.p.mid()))
    for slack in SLACKS:
        if 0 < p * (1 + slack) < at.p:
            better = at_angle(s, arb(p * (1 + slack)))
            if flight(x, kappa, better) < 0:
                return better
    return at


def root_below(s: Side, x: Arb, kappa: Arb, at: Angle, start: Arb) -> Angle:
    """Find an angle that the impact at x comes after, for this kappa and smaller ones: `at` or a proved better one."""
    p = guess_root(s.early, s.exact, float(x.mid()), float(kappa.mid()), float(start.mid()))
    for slack in SLACKS:
        if at.p < p * (1 - slack) < FULL_TURN:
            better = at_angle(s, arb(p * (1 - slack)))
            if positive_until(s, x, kappa, better):
                return better
    return at


# ------------------------------------------------------------------------------------------------------ the integers


class Failure(NamedTuple):
    """What was not proved: `kind` is "image" or "slope" for a cell, and text for people."""

    kind: str
    text: str


@dataclass
class Cells:
    """The arrays of one box, cells of all sides one after another."""

    edges: list[Array]
    jog: Array
    flip: Array
    branch: Array
    rank: Array
    component: Array
    phi: Array
    side: Array = field(init=False)
    start: Array = field(init=False)  # the first cell of each side, and the number of cells

    def __post_init__(self) -> None:
        counts = [len(edges) - 1 for edges in self.edges]
        self.start = np.concatenate([[0], np.cumsum(counts)])
        self.side = np.repeat(np.arange(len(counts)), counts)

    def lower(self) -> Array:
        """Lower ends of all cells."""
        return np.concatenate([edges[:-1] for edges in self.edges])

    def upper(self) -> Array:
        """Upper ends of all cells."""
        return np.concatenate([edges[1:] for edges in self.edges])

    def name(self, cell: int) -> str:
        """Name a cell, for people."""
        side = int(self.side[cell])
        k = cell - int(self.start[side])
        return f"side {side}, cell {cell}, x in [{float(self.edges[side][k])!r}, {float(self.edges[side][k + 1])!r}]"


def read_cells(entries: dict[str, memoryview], said: dict[str, Any], prefix: str, sides: int) -> Cells:
    """Read the arrays of one box and see that their shapes fit each other."""

    def read(name: str, dtype: str, columns: int = 1) -> Array:
        require(f"{prefix}{name}.npy" in entries, f"array {prefix}{name} is missing")
        key = prefix + name
        return read_array(entries[f"{key}.npy"], key, dtype, columns, said.get(key))

    edges = [read(f"edges.{i}", "<f8") for i in range(sides)]
    require(all(len(e) >= 2 for e in edges), "a side has no cells")
    cells = Cells(
        edges, read("jog", "<i4", 2), read("flip", "<i4", 2), read("branch", "|i1"),
        read("rank", "<i4"), read("component", "<i4"), read("phi", "<f8", 2),
    )  # fmt: skip
    n = len(cells.side)
    arrays = (cells.jog, cells.flip, cells.branch, cells.rank, cells.component, cells.phi)
    require(all(len(array) == n for array in arrays), "the arrays do not have one row for each cell")
    return cells


def range_max(values: Array, first: Array, last: Array) -> Array:
    """Maxima of values[first..last], by the table of maxima over windows of length 2^k, one k at a time."""
    level = np.frexp((last - first + 1).astype(np.float64))[1] - 1  # floor(log2), exact for integers
    out = np.zeros(len(first), dtype=np.int64)
    window = values.astype(np.int64)
    for k in range(int(level.max(initial=0)) + 1):
        q = np.flatnonzero(level == k)
        out[q] = np.maximum(window[first[q]], window[last[q] - (1 << k) + 1])
        window = np.maximum(window[: -(1 << k)], window[1 << k :])
    return out


def check_structure(c: Cells, scene: Scene, least_rank: int) -> str:
    """Check what every claim needs: order of the edges, brackets, branches, targets; "" or what fails."""
    n_sides = len(c.edges)
    for i, edges in enumerate(c.edges):
        if not (np.diff(edges) > 0).all():
            return f"side {i}: the edges of the cells do not ascend"
        if not arb(float(edges[0])) > scene.sides[i].a:
            return f"side {i}: the cells begin left of a_{i}"
    lo, hi = c.phi[:, 0], c.phi[:, 1]
    checks = [
        ((lo > 0) & (lo < hi) & (hi <= FULL_TURN), "the bracket of phi is not one"),
        ((c.branch >= 0) & (c.branch <= 2), "the branch is not 0, 1 or 2"),
        (c.component >= -1, "the component is below -1"),
        (c.rank >= least_rank, f"the rank is below {least_rank}"),
    ]
    for array, mine, target in ((c.jog, 0, c.side), (c.flip, 1, (c.side + 1) % n_sides)):
        first, last = array[:, 0], array[:, 1]
        inside = (first >= c.start[target]) & (first <= last) & (last < c.start[target + 1])
        fits = np.where((c.branch == mine) | (c.branch == 2), inside, (first == -1) & (last == -1))
        checks.append((fits, f"its branch and the target cells of a {('jog', 'flip')[mine]} do not fit"))
    return first_bad(c, checks)


def first_bad(c: Cells, checks: list[tuple[Array, str]]) -> str:
    """Name the first cell at which one of the checks does not hold."""
    for good, what in checks:
        if not good.all():
            return f"{c.name(int(np.argmin(good)))}: {what}"
    return ""


def check_components(c: Cells) -> str:
    """Check that component cells map into cells of their own component; "" or what fails."""
    if not (c.component >= 0).any():
        return "there are no attracting cells"
    for array, what in ((c.jog, "jog"), (c.flip, "flip")):
        q = np.flatnonzero((array[:, 0] >= 0) & (c.component >= 0))
        first, last = array[q, 0], array[q, 1]
        own = c.component[q]
        good = np.ones(len(c.component), dtype=bool)
        highest, lowest = range_max(c.component, first, last), -range_max(-c.component, first, last)
        good[q] = (highest == own) & (lowest == own)
        bad = first_bad(c, [(good, f"a {what} may leave its component")])
        if bad:
            return bad
    return ""


def check_ranks(c: Cells, scene: Scene, max_rank: int) -> str:
    """Check that the cells reach to the arm's end and the rank falls off the components; "" or what fails."""
    for i, edges in enumerate(c.edges):
        if Fraction(float(edges[-1])) < scene.arm[1]:
            return f"side {i}: the cells end before arm.length"
    inside = c.component >= 0
    checks = [(~inside | (c.rank == 0), "a cell of a component has a rank above 0")]
    checks.append((c.rank >= 0, "nothing is claimed of starts in it: its rank is -1"))
    for array, what in ((c.jog, "jog"), (c.flip, "flip")):
        q = np.flatnonzero((array[:, 0] >= 0) & ~inside)
        good = np.ones(len(inside), dtype=bool)
        good[q] = range_max(c.rank, array[q, 0], array[q, 1]) < c.rank[q]
        checks.append((good, f"the rank does not fall along a {what}"))
    checks.append((c.rank <= max_rank, f"its rank is above max_rank = {max_rank}"))
    return first_bad(c, checks)


# --------------------------------------------------------------------------------------------------------- the cells


def check_bracket(s: Side, box: "Box") -> str:
    """Check a bracket of phi: f rises with x and falls with kappa, so that it holds if it does at two corners."""
    if not positive_until(s, box.x0, box.k1, box.low):
        return f"f > 0 up to phi = {float(box.low.p)!r} is not proved at x = {float(box.x0)!r}"
    if not flight(box.x1, box.k0, box.high) < 0:
        return f"f < 0 at phi = {float(box.high.p)!r} is not proved at x = {float(box.x1)!r}"
    return ""


def check_cell(
    scene: Scene, side: int, x: tuple[float, float], phi: tuple[float, float],
    targets: tuple[tuple[float, float], tuple[float, float]], least: Arb | None,
) -> tuple[Failure | None, int]:  # fmt: skip
    """Prove what the certificate says about one cell; the failure or None, and the number of boxes looked at.

    `targets` are the ends of the target cells of a jog and of a flip: (nan, nan) where the branch is excluded, so
    that nothing lies inside; an upper end inf stands for the arm's length.
    """
    k_lo, k_hi = scene.k_lo, scene.k_hi
    s = scene.sides[side]
    first = Box(
        scene, arb(x[0]), arb(x[1]), k_lo, k_hi, at_angle(s, arb(phi[0])), at_angle(s, arb(phi[1])), 0, 0, 0
    )
    bad = check_bracket(s, first)
    if bad and scene.loose > 0:
        bad = over_halves(scene, lambda half: check_bracket(half.sides[side], first.of(half, side)))
    if bad:
        return Failure("image", bad), 1
    stack, boxes = [first], 0
    while stack:
        box = stack.pop()
        boxes += 1
        failure = check_box(box.scene.sides[side], box, targets, least)
        if failure is not None:
            halves = box.halves(side, "decision" if failure.text.endswith("is not excluded") else "image")
            if not halves or boxes + len(stack) > MOST_BOXES:
                return failure, boxes
            for half in halves:
                s = half.scene.sides[side]
                high = root_above(s, half.x1, half.k0, half.high)
                low = root_below(s, half.x0, half.k1, half.low, high.p)
                stack.append(half._replace(low=low, high=high))
    return None, boxes


class Box(NamedTuple):
    """A piece of a cell, of kappa and of all else, a bracket of the impact angle over it, how often each was halved."""

    scene: Scene
    x0: Arb
    x1: Arb
    k0: Arb
    k1: Arb
    low: Angle
    high: Angle
    in_x: int
    in_k: int
    in_s: int

    def halves(self, side: int, of: str) -> list["Box"]:
        """Halve it in what matters more to the angle, x, kappa or a quantity; [] if it has been halved enough.

        `of`: what is too wide, the "decision" or the "image".
        """
        xm = arb(float((HALF * (self.x0 + self.x1)).mid()))
        km = arb(float((HALF * (self.k0 + self.k1)).mid()))
        by_x = self.in_x < DEPTH and self.x0 < xm and xm < self.x1
        by_k = self.in_k < DEPTH and self.k0 < km and km < self.k1
        of_x = float(self.x1 - self.x0) if by_x else 0.0
        of_k = float(HALF * self.high.p * (self.k1 - self.k0)) if by_k else 0.0
        if self.in_s < DEPTH and self.scene.loose > 0 and self.scene.width(of, side) > max(of_x, of_k):
            return [self.of(half, side) for half in self.scene.halves(of, side)]
        if by_k and of_k >= of_x:
            return [self._replace(k0=km, in_k=self.in_k + 1), self._replace(k1=km, in_k=self.in_k + 1)]
        if by_x:
            return [self._replace(x0=xm, in_x=self.in_x + 1), self._replace(x1=xm, in_x=self.in_x + 1)]
        return []

    def of(self, scene: Scene, side: int) -> "Box":
        """Make it one of a narrower scene: the bracket stays, what depends on the angle is narrower."""
        low, high = (at_angle(scene.sides[side], at.p) for at in (self.low, self.high))
        return self._replace(scene=scene, low=low, high=high, in_s=self.in_s + 1)


def check_box(
    s: Side, box: Box, targets: tuple[tuple[float, float], tuple[float, float]], least: Arb | None
) -> Failure | None:
    """Check decision, images and slope over a box.

    R'(jog) = R + D(phi).  Where D' > 0 both terms are largest at the upper ends.  Otherwise, where R' is proved to
    rise with R at each kappa, its extremes lie at the ends of the cell, and D there is
    enclosed from a bracket of phi at that end by the mean value theorem; else the mean value theorem over the box.
    Noise of the landing place moves an image, and does not decide.
    """
    _, x0, x1, k0, k1, low, high, _, _, _ = box
    phi, R = low.p.union(high.p), x0.union(x1)
    decision, rise, f_slope = over_angles(s, phi, R, k0.union(k1))
    lo, hi = x0 + low.D, x1 + high.D
    slope = None
    rises = rise > 0
    if least is not None or not rises:
        slope = slope_over(s, phi, k0.union(k1), rise, f_slope)
    if not rises:
        if slope is not None and slope > 0:
            lo = lo + rise * ZERO.union(root_above(s, x0, k0, high).p - low.p)
            hi = hi - rise * ZERO.union(high.p - root_below(s, x1, k1, low, high.p).p)
        else:
            lo = hi = R + low.D + rise * (phi - low.p)
    lo, hi = lo - s.landing, hi + s.landing
    for branch in (0, 1) if decision == 2 else (decision,):
        left, right = targets[branch]
        if branch == 1:
            lo, hi = lo - s.shift, hi - s.shift
        if not (lo > left and (hi <= s.arm if right == math.inf else hi < right)):
            what = ("jog", "flip")[branch]
            if math.isnan(left):
                return Failure("image", f"a {what} is not excluded")
            image = f"[{float(lo.lower())!r}, {float(hi.upper())!r}]"
            end = "arm.length" if right == math.inf else repr(right)
            text = f"the image of a {what}, {image}, is not proved to lie in ({left!r}, {end})"
            return Failure("image", text)
    if least is not None and not (slope is not None and (slope >= least or -slope >= least)):
        return Failure("slope", "its slope is not proved to be as large as claimed")
    return None


class Task(NamedTuple):
    """Some cells of one side: ends, brackets and ends of the targets, as arrays of rows."""

    box: int
    side: int
    cells: Array
    rows: Array  # x0, x1, phi_lo, phi_hi, jog lo, jog hi, flip lo, flip hi
    least: float | None


SETUP: list[Any] = []  # of this process: the scenes as written, and the noise
SCENES: dict[int, Scene] = {}  # balls do not travel between processes, so each reads the scenes it needs anew


def prepare(raw: list[object], noise: object) -> None:
    """Set up a worker."""
    flint.ctx.prec = PRECISION
    SETUP[:] = raw, noise
    SCENES.clear()


def check_task(task: Task) -> tuple[int, Failure | None, int]:
    """Find the first cell of a task that is not proved, and what fails; and count the boxes looked at."""
    if task.box not in SCENES:
        SCENES.clear()  # with all its halves
        SCENES[task.box] = read_scene(SETUP[0][task.box], SETUP[1])
    scene = SCENES[task.box]
    least = None if task.least is None else arb(task.least)
    total = 0
    for cell, (x0, x1, p0, p1, j0, j1, f0, f1) in zip(task.cells.tolist(), task.rows.tolist(), strict=True):
        targets = ((j0, j1), (f0, f1))
        failure, boxes = check_cell(scene, task.side, (x0, x1), (p0, p1), targets, least)
        total += boxes
        if failure is not None:
            return cell, failure, total
    return -1, None, total


def tasks_of(c: Cells, scene: Scene, box: int, chosen: Array, least: float | None) -> Iterator[Task]:
    """Cut the chosen cells (ascending) into tasks of one side each."""
    lower, upper = c.lower(), c.upper()
    short, long = (float(end) for end in scene.arm)
    short = short if Fraction(short) <= scene.arm[0] else math.nextafter(short, -math.inf)
    long = long if Fraction(long) >= scene.arm[1] else math.nextafter(long, math.inf)
    for side in range(len(c.edges)):
        own = chosen[c.side[chosen] == side]
        for part in np.array_split(own, max(1, -(-len(own) // CHUNK))):
            rows = np.full((len(part), 8), math.nan)
            rows[:, 0], rows[:, 1], rows[:, 2:4] = lower[part], upper[part], c.phi[part]
            for column, array in ((4, c.jog[part]), (6, c.flip[part])):
                q = np.flatnonzero(array[:, 0] >= 0)
                rows[q, column] = lower[array[q, 0]]
                ends = upper[array[q, 1]]
                # where the shortest arm ends before the cells, its end counts
                rows[q, column + 1] = np.where((ends > short) | (ends >= long), math.inf, ends)
            if len(part):
                yield Task(box, side, part, rows, least)


@contextmanager
def deaf_children() -> Iterator[None]:
    """Let processes that are started in here leave Ctrl-C to this one."""
    if threading.current_thread() is not threading.main_thread():  # only that one may say what a signal does
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


class Crew:
    """The processes that check cells, or this one alone; they are started for large certificates only."""

    def __init__(
        self, raw: list[object], noise: object, workers: int, progress: Callable[[int], None] | None
    ):
        self.setup, self.workers, self.progress = (raw, noise), workers, progress
        self.done = self.boxes = 0
        self.pool: ProcessPoolExecutor | None = None
        prepare(raw, noise)

    def run(self, tasks: list[Task]) -> tuple[int, Failure] | None:
        """Return the first cell, in the order of the tasks, that is not proved, and what fails there; or None."""
        if self.workers > 1 and self.pool is None and sum(len(t.cells) for t in tasks) > SMALL:
            context = multiprocessing.get_context("spawn")
            self.pool = ProcessPoolExecutor(self.workers, context, prepare, self.setup)
        try:
            with deaf_children():
                results = map(check_task, tasks) if self.pool is None else self.pool.map(check_task, tasks)
            for task, (cell, failure, boxes) in zip(tasks, results, strict=True):
                self.done += len(task.cells)
                self.boxes += boxes
                if failure is not None:
                    return cell, failure
                if self.progress is not None:
                    self.progress(self.done)
        except BrokenProcessPool:  # processes cannot be started here, as from a script without a main guard
            self.close()
            self.workers = 1
            return self.run(tasks)
        return None

    def close(self) -> None:
        """End the processes."""
        if self.pool is not None:
            self.pool.shutdown(cancel_futures=True)
            self.pool = None


# ------------------------------------------------------------------------- end points, and periodic orbits

MOST_ENDS, MOST_PIECES, MOST_IMAGES = 400, 4_000, 20_000
MOST_ORBITS, LONGEST = 200, 1_000
MOST_THROWN = 100_000  # boxes, for one claim: a section that needs more is refused

Pair = tuple[float, float]
Union = list[list[Pair]]  # closed intervals by side, ascending and disjoint


class UnprovedError(Exception):
    """What a section says was not proved."""


def prove(condition: bool, message: str) -> None:
    """Raise UnprovedError unless the condition holds."""
    if not condition:
        raise UnprovedError(message)


class Piece(NamedTuple):
    """A part of the attracting cells: the branch there (2: either) and the sign of dR'/dR (0: none is claimed)."""

    side: int
    lo: float
    hi: float
    branch: int
    sign: int

    def name(self) -> str:
        """Name it, for people."""
        return f"side {self.side}, x in [{self.lo!r}, {self.hi!r}]"


def read_ends(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read the section of end-points: two unions of intervals, one inside the other, and the pieces."""
    images = section["images"]
    require(type(images) is int and 0 < images <= MOST_IMAGES, "images is not a number of images")
    outer: Union = [[] for _ in range(n_sides)]
    inner: Union = [[] for _ in range(n_sides)]
    ends = [table(e, "an end", "side which outer inner") for e in rows(section["ends"], "ends", 2, MOST_ENDS)]
    sides = [read_side(end["side"], n_sides) for end in ends]
    paired = [end["which"] for end in ends] == ["lo", "hi"] * (len(ends) // 2)
    paired = paired and sides[::2] == sides[1::2] and sides == sorted(sides)
    require(paired, "the ends are not a lower and an upper one of each interval, by sides")
    for side, low, high in zip(sides[::2], ends[::2], ends[1::2], strict=True):
        a, b, c, d = (
            hex_float(end[key], key) for end, key in zip((low, low, high, high), END_KEYS, strict=True)
        )
        apart = a < b < c < d and (not outer[side] or outer[side][-1][1] < a)
        require(apart, f"side {side}: the ends do not ascend, outer before inner, interval after interval")
        outer[side].append((a, d))
        inner[side].append((b, c))
    pieces: list[list[Piece]] = [[] for _ in range(n_sides)]
    for row in rows(section["pieces"], "pieces", 1, MOST_PIECES):
        side, lo, hi, branch, sign = rows(row, "a piece", 5, 5)
        fits = all(type(n) is int for n in (branch, sign)) and 0 <= branch <= 2 and -1 <= sign <= 1
        require(fits, "branch or slope of a piece is not one")
        piece = Piece(read_side(side, n_sides), hex_float(lo, "lo"), hex_float(hi, "hi"), branch, sign)
        own = pieces[piece.side]
        ordered = piece.lo < piece.hi and (not own or own[-1].hi <= piece.lo)
        require(ordered, f"{piece.name()}: the pieces do not ascend")
        own.append(piece)
    return {"images": images, "outer": outer, "inner": inner, "pieces": pieces}


END_KEYS = ("outer", "inner", "inner", "outer")


def read_side(value: object, n_sides: int) -> int:
    """Read the number of a side."""
    require(type(value) is int and 0 <= value < n_sides, "a side is not a number of one")
    assert isinstance(value, int)
    return value


class Orbit(NamedTuple):
    """A periodic orbit as it is claimed: where it begins, the branches, and its multiplier."""

    side: int
    lo: float
    hi: float
    word: list[int]
    multiplier: Pair
    attracts: bool


def read_orbits(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read the section of cycles."""
    require(section["complete"] is False, "that no cycle is missing is nothing that can be proved here")
    orbits = []
    for each in rows(section["cycles"], "cycles", 1, MOST_ORBITS):
        table(each, "a cycle", "side itinerary interval multiplier attracts")
        word = rows(each["itinerary"], "an itinerary", 1, LONGEST)
        require(all(type(b) is int and b in (0, 1) for b in word), "an itinerary is not one of 0 and 1")
        lo, hi = (hex_float(end, "interval") for end in rows(each["interval"], "an interval", 2, 2))
        least, most = (hex_float(end, "multiplier") for end in rows(each["multiplier"], "a multiplier", 2, 2))
        require(lo < hi and least <= most, "an interval or a multiplier is empty")
        attracts = each["attracts"]
        right = (least > -1 and most < 1) if attracts else (least > 1 or most < -1)
        require(isinstance(attracts, bool) and right, "a multiplier and what it is said to do do not fit")
        orbits.append(Orbit(read_side(each["side"], n_sides), lo, hi, word, (least, most), attracts))
    return {"orbits": orbits}


def ends_statement(section: dict[str, Any], noisy: bool) -> str:
    """Put the claim of end points in words: the numbers are those that are checked."""
    noise = ", with whatever speeds of the noise" if noisy else ""
    after = f"after {section['images']} throws or more they lie within the outer ends"
    always = "and always they hold all between the inner ends"
    lines = [
        f"end-points: let the attracting cells be thrown, all of them, ever again{noise}; {after}, {always}"
    ]
    for side, (outer, inner) in enumerate(zip(section["outer"], section["inner"], strict=True)):
        for (a, d), (b, c) in zip(outer, inner, strict=True):
            lines.append(f"    side {side}: lower end in [{a!r}, {b!r}], upper end in [{c!r}, {d!r}]")
    return "\n".join(lines)


def orbits_statement(section: dict[str, Any]) -> str:
    """Put the claim of periodic orbits in words."""
    lines = ["cycles: periodic orbits in the attracting cells, no two the same (there may be more)"]
    for o in section["orbits"]:
        does = "attracts" if o.attracts else "repels"
        where = f"the only one of it with x in [{o.lo!r}, {o.hi!r}] on side {o.side}"
        lines.append(
            f"    period {len(o.word)}, {where}: {does}, multiplier in [{o.multiplier[0]!r}, {o.multiplier[1]!r}]"
        )
    return "\n".join(lines)


class Thrown(NamedTuple):
    """Throws from a box: the decision (0, 1, or 2: not settled), bounds of R'(jog), and dR'/dR or None."""

    decision: int
    lo: Arb
    hi: Arb
    slope: Arb | None


def beside_root(s: Side, x: Arb, kappa: Arb, before: bool) -> Angle:
    """Find an angle that is proved to lie just before, or just after, the impact at x."""
    if not s.exact:
        p = 2 * (x - s.a) / (kappa - s.small_d)
        p = p.lower() if before else p.upper()
        prove(bool(p > 0 and p < FULL_TURN), "the impact is not within a turn")
        return at_angle(s, p)
    a, d, _, _ = s.floats
    x0, k = float(x), float(kappa)
    right = (x0 + math.sqrt(x0 * x0 + 2 * k * (d + math.hypot(a, d)))) / k  # f < 0 there
    p = arb(guess_root(s.floats, s.exact, x0, k, right) if 0 < right < 1e3 else math.nan)
    for tried in range(8):  # two will do, but where the floats are poor: next to the joint
        f = flight(x, kappa, at_angle(s, p))
        sin, cos = p.sin_cos()
        p = (p - f / (x - s.a * cos + s.d * sin - kappa * p)).mid()
        root = ROOT if tried < 6 else WIDER_ROOT
        at = at_angle(s, (p * (ONE - root if before else ONE + root)).mid())
        f = flight(x, kappa, at)
        # x > a and f concave: positive up to its one positive root and negative from there on
        right_side = bool(f > 0 if before else f < 0) and bool(at.p > 0 and at.p < FULL_TURN)
        if right_side or not p.is_finite():
            break
    prove(right_side and s.concave and bool(x > s.a), f"the impact is not bracketed at x = {x0!r}")
    return at


# Brackets of the impact are so narrow, relative to the angle; or so where R - a is less than a millionth of a.
ROOT, WIDER_ROOT = arb(2) ** -70, arb(2) ** -45


class Throws:
    """Throws of points and boxes from one scene, counted."""

    def __init__(self, scene: Scene):
        self.scene, self.left = scene, MOST_THROWN
        self.points: dict[tuple[int, float], Thrown] = {}

    def spend(self) -> None:
        """Count a box."""
        self.left -= 1
        prove(self.left >= 0, f"more than {MOST_THROWN} boxes would be needed")

    def box(self, side: int, x0: Arb, x1: Arb, k0: Arb, k1: Arb) -> Thrown:
        """Throw all x in [x0, x1] with all kappa in [k0, k1]; the four are exact.

        The angle rises with x and falls with kappa.  phi'(R) = -f_R/f_phi = -phi/f_phi, R' = R + D(phi).
        """
        self.spend()
        s = self.scene.sides[side]
        low, high = beside_root(s, x0, k1, True), beside_root(s, x1, k0, False)
        phi, R, kappa = low.p.union(high.p), x0.union(x1), k0.union(k1)
        decision, rise, f_slope = over_angles(s, phi, R, kappa)
        slope = slope_over(s, phi, kappa, rise, f_slope)
        if rise > 0:
            return Thrown(decision, x0 + low.D, x1 + high.D, slope)
        whole = R + low.D + rise * (phi - low.p)
        return Thrown(decision, whole, whole, slope)

    def interval(self, side: int, x0: Arb, x1: Arb) -> Thrown:
        """Throw an interval; where dR'/dR has a sign the images of its ends bound all of them."""
        k0, k1 = self.scene.k_lo, self.scene.k_hi
        t = self.box(side, x0, x1, k0, k1)
        if x0 < x1 and t.slope is not None and (t.slope > 0 or t.slope < 0):
            first, last = (x0, x1) if t.slope > 0 else (x1, x0)
            lo, hi = self.box(side, first, first, k0, k1).lo, self.box(side, last, last, k0, k1).hi
            return t._replace(lo=lo, hi=hi)
        return t

    def point(self, side: int, x: float) -> Thrown:
        """Throw one point, once."""
        if (side, x) not in self.points:
            self.points[side, x] = self.interval(side, arb(x), arb(x))
        return self.points[side, x]

    def piece(self, piece: Piece) -> None:
        """Prove branch and sign of the slope on a piece, halving it in x and in kappa."""
        stack = [(arb(piece.lo), arb(piece.hi), self.scene.k_lo, self.scene.k_hi)]
        while stack:
            x0, x1, k0, k1 = stack.pop()
            t = self.box(piece.side, x0, x1, k0, k1)
            wrong = piece.branch != 2 and t.decision == 1 - piece.branch
            steep = bool(piece.sign == 0 or (t.slope is not None and piece.sign * t.slope > 0))
            if piece.branch in (2, t.decision) and steep:
                continue
            xm, km = (arb(float((HALF * (lo + hi)).mid())) for lo, hi in ((x0, x1), (k0, k1)))
            by_x, by_k = bool(x0 < xm and xm < x1), bool(k0 < km and km < k1)
            what = "branch" if piece.branch not in (2, t.decision) else "sign of the slope"
            prove(not wrong and (by_x or by_k), f"{piece.name()}: the {what} is not proved")
            if by_k and not (by_x and k1 - k0 < x1 - x0):
                stack += [(x0, x1, km, k1), (x0, x1, k0, km)]
            else:
                stack += [(xm, x1, k0, k1), (x0, xm, k0, k1)]


def below(value: Arb) -> float:
    """Round down."""
    prove(value.is_finite(), "an image is not bounded")
    x = float(value.lower())
    while not arb(x) <= value:
        x = math.nextafter(x, -math.inf)
    return x


def above(value: Arb) -> float:
    """Round up."""
    return -below(-value)


def joined(intervals: list[Pair]) -> list[Pair]:
    """Union of closed intervals, ascending."""
    union: list[Pair] = []
    for lo, hi in sorted(intervals):
        if union and lo <= union[-1][1]:
            union[-1] = (union[-1][0], max(union[-1][1], hi))
        else:
            union.append((lo, hi))
    return union


def meeting(one: list[Pair], other: list[Pair]) -> list[Pair]:
    """Intersection of two unions, ascending."""
    common = []
    i = k = 0
    while i < len(one) and k < len(other):
        lo, hi = max(one[i][0], other[k][0]), min(one[i][1], other[k][1])
        if lo <= hi:
            common.append((lo, hi))
        if one[i][1] < other[k][1]:
            i += 1
        else:
            k += 1
    return common


def first_outside(union: Union, within: Union) -> str:
    """Name the first interval that does not lie in one of another union; "" if all do."""
    for side, (parts, wider) in enumerate(zip(union, within, strict=True)):
        for lo, hi in parts:
            if meeting([(lo, hi)], wider) != [(lo, hi)]:
                return f"side {side}, x in [{lo!r}, {hi!r}]"
    return ""


def attracting(c: Cells) -> Union:
    """Return the attracting cells as intervals."""
    union: Union = []
    for i, edges in enumerate(c.edges):
        own = np.flatnonzero(c.component[c.start[i] : c.start[i + 1]] >= 0)
        union.append(joined(list(zip(edges[own].tolist(), edges[own + 1].tolist(), strict=True))))
    return union


def parts_of(throws: Throws, union: Union, pieces: list[list[Piece]]) -> Iterator[tuple[int, Piece]]:
    """Cut a union at the borders of the pieces; each part with the number of the interval it is of."""
    for intervals, own in zip(union, pieces, strict=True):
        at = 0
        for owner, (lo, hi) in enumerate(intervals):
            while at < len(own) and own[at].hi < lo:
                at += 1
            for piece in itertools.islice(own, at, None):
                if piece.lo > hi:
                    break
                throws.spend()
                yield owner, piece._replace(lo=max(lo, piece.lo), hi=min(hi, piece.hi))


def image_outward(throws: Throws, union: Union, pieces: list[list[Piece]]) -> Union:
    """Return a union that holds the image of another, by both branches where either is possible."""
    n = len(union)
    images: Union = [[] for _ in range(n)]
    for _, part in parts_of(throws, union, pieces):
        if part.sign != 0:
            ends = [throws.point(part.side, x) for x in (part.lo, part.hi)]
        else:
            ends = [throws.interval(part.side, arb(part.lo), arb(part.hi))]
        for branch in (0, 1) if part.branch == 2 else (part.branch,):
            shift = throws.scene.sides[part.side].shift if branch else ZERO
            lo, hi = min(below(t.lo - shift) for t in ends), max(above(t.hi - shift) for t in ends)
            images[(part.side + branch) % n].append((lo, hi))
    return [joined(intervals) for intervals in images]


def image_inward(throws: Throws, union: Union, pieces: list[list[Piece]]) -> Union:
    """Return a union that lies in the image of another.

    On neighbouring pieces of one branch the map is continuous, f being concave.  So all between the images of two of
    their points is covered (intermediate values).  Pieces without a branch give nothing.
    """
    n = len(union)
    images: Union = [[] for _ in range(n)]

    def close(run: list[Piece]) -> None:
        shift = throws.scene.sides[run[0].side].shift if run[0].branch else ZERO
        ends = [throws.point(part.side, x) for part in run for x in (part.lo, part.hi)]
        lo, hi = min(above(t.hi - shift) for t in ends), max(below(t.lo - shift) for t in ends)
        if lo <= hi:
            images[(run[0].side + run[0].branch) % n].append((lo, hi))

    run: list[Piece] = []
    of = -1
    for owner, part in parts_of(throws, union, pieces):
        last = run[-1] if run else part
        follows = (of, last.side, last.branch, last.hi) == (owner, part.side, part.branch, part.lo)
        if run and not follows:
            close(run)
            run = []
        if part.branch != 2:
            run.append(part)
            of = owner
    if run:
        close(run)
    return [joined(intervals) for intervals in images]


def check_ends(scene: Scene, c: Cells, section: dict[str, Any]) -> str:
    """Prove the end points from the attracting cells N, which are invariant; "" or what fails.

    Outer: A(0) = N, A(n+1) = F(A(n)) & A(n), rounded outward, holds the image of N under n + 1 throws, whatever kappas
    of the noise they have.  Inner: B lies in N and in its own image F(B), for each kappa: so in every image of N.
    """
    cells, outer, inner, pieces = attracting(c), section["outer"], section["inner"], section["pieces"]
    for side, s in enumerate(scene.sides):
        if not s.concave:
            return f"side {side}: kappa > ell is not proved, so that there may be several impacts"
        if joined([(piece.lo, piece.hi) for piece in pieces[side]]) != cells[side]:
            return f"side {side}: the pieces do not make up the attracting cells"
    bad = first_outside(inner, cells)
    if bad:
        return f"{bad}: not in the attracting cells"
    throws = Throws(scene)
    try:
        for piece in itertools.chain(*pieces):
            throws.piece(piece)
        bad = first_outside(inner, image_inward(throws, inner, pieces))
        if bad:
            return f"{bad}: it is not proved that all of it is reached again"
        union, taken = cells, 0
        while first_outside(union, outer):
            images = image_outward(throws, union, pieces)
            smaller = [meeting(one, other) for one, other in zip(images, union, strict=True)]
            taken += 1
            if smaller == union or taken > section["images"]:
                after = f"after {taken - 1} images of the attracting cells"
                return f"{first_outside(union, outer)}: not proved to lie within the outer ends {after}"
            union = smaller
    except UnprovedError as error:
        return str(error)
    return ""


class Followed(NamedTuple):
    """Starts along an itinerary: side and bounds of every state, the last one after all throws, and dR/dR(start)."""

    states: list[tuple[int, Arb, Arb]]
    slope: Arb


def follow(throws: Throws, orbit: Orbit, x0: Arb, x1: Arb) -> Followed:
    """Follow the starts in [x0, x1], proving that each throw decides as the itinerary says."""
    states, slope = [(orbit.side, x0, x1)], ONE
    for k, branch in enumerate(orbit.word):
        side, lo, hi = states[-1]
        t = throws.interval(side, lo, hi)
        prove(t.decision == branch, f"throw {k + 1}: that it is a {('jog', 'flip')[branch]} is not proved")
        if t.slope is None:
            raise UnprovedError(f"throw {k + 1}: its slope is not bounded")
        shift = throws.scene.sides[side].shift if branch else ZERO
        after = (side + branch) % len(throws.scene.sides)
        states.append((after, (t.lo - shift).lower(), (t.hi - shift).upper()))
        slope = slope * t.slope
    return Followed(states, slope)


def prove_orbit(throws: Throws, cells: Union | None, orbit: Orbit) -> Followed:
    """Prove one periodic orbit: with G the throws along the itinerary, G(R) - R changes sign in the interval.

    Along the interval all decisions are those of the itinerary and f is concave, so that G is the map and continuous.
    |G'| > 1 or < 1 on it: G(R) - R is monotone and the orbit alone.  The attracting cells, if it has to lie in them,
    are invariant: one point of the orbit in them is enough.
    """
    if cells is not None:
        here: Union = [[] for _ in cells]
        here[orbit.side] = [(orbit.lo, orbit.hi)]
        prove(not first_outside(here, cells), "not in the attracting cells")
    lo, hi = arb(orbit.lo), arb(orbit.hi)
    first, last = (follow(throws, orbit, x, x).states[-1] for x in (lo, hi))
    prove(first[0] == orbit.side, "it ends on another side")
    grows = bool(first[2] < lo and last[1] > hi)
    prove(grows or bool(first[1] > lo and last[2] < hi), "that it comes back is not proved")
    found = follow(throws, orbit, lo, hi)
    period = len(orbit.word)
    for k in range(1, period):
        apart = period % k or not meets(found.states[k], found.states[0])
        prove(bool(apart), f"its period may be {k}")
    least, most = orbit.multiplier
    within = bool(found.slope >= least and found.slope <= most)
    prove(within, f"its multiplier, {found.slope.str(10)}, is not proved to be as claimed")
    return found


def meets(one: tuple[int, Arb, Arb], other: tuple[int, Arb, Arb]) -> bool:
    """Whether two intervals may have a point in common."""
    return one[0] == other[0] and not (one[2] < other[1] or other[2] < one[1])


def check_orbits(scene: Scene, c: Cells, section: dict[str, Any]) -> str:
    """Prove that all of the periodic orbits exist, and are different; "" or what fails."""
    cells, throws = attracting(c), Throws(scene)
    proved: list[Followed] = []
    for orbit in section["orbits"]:
        name = f"period {len(orbit.word)}, side {orbit.side}, x in [{orbit.lo!r}, {orbit.hi!r}]"
        try:
            prove(all(s.concave for s in scene.sides), "kappa > ell is not proved")
            found = prove_orbit(throws, cells, orbit)
        except UnprovedError as error:
            return f"{name}: {error}"
        for other in proved:
            if len(other.states) == len(found.states) and any(
                meets(state, found.states[0]) for state in other.states
            ):
                return f"{name}: it may be the same orbit as another one"
        proved.append(found)
    return ""


def check_sets(scene: Scene, c: Cells, claims: dict[str, dict[str, Any]]) -> Iterator[tuple[list[str], str]]:
    """Check end points and periodic orbits of attracting cells that are proved; yields what fails."""
    for name, check in (("end-points", check_ends), ("cycles", check_orbits)):
        bad = check(scene, c, claims[name]) if name in claims else ""
        if bad:
            yield [name], bad


# -------------------------------------------------------------------------------------------- an orbit that refutes

INSIDE = (
    arb(2) ** -80
)  # a stated kappa keeps this share of it from the ends of its noise: these are known to 100 bits


RECURS = (
    "cycle",
    "closed",
    "once",
)  # why an orbit refutes: it is periodic, it closes with noise, once is enough
BROKEN = {  # keys of a goal that an orbit may refute, besides from_anywhere, and what is said of the orbit
    "oriented_beyond": ("kind x side", "comes to lie beyond x = {text} on another side than {side}"),
    "reaches": ("kind x side every_orbit", "never comes to rest on side {side} at x >= {text}"),
    "flip_order": ("kind order", "does not follow the order {order} of sides"),
    "stays_on_arm": ("kind", "leaves the arm"),
    "attracts_all": ("kind", "leaves the arm"),
}


def read_refutation(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read an orbit that refutes a goal: its start, what each throw was like, and why it comes back; or a cycle."""
    goal = section["goal"]
    kind = goal.get("kind") if isinstance(goal, dict) else None
    require(isinstance(kind, str) and kind in BROKEN, "refuted.goal: not a kind that an orbit refutes")
    goal = table(goal, "refuted.goal", BROKEN[str(kind)][0], "from_anywhere")
    goal = {"throws": 0} | goal if kind == "reaches" else {"jogs": 0} | goal if kind == "flip_order" else goal
    nominal, tolerance = section["nominal"], section["tolerance"]
    same = isinstance(nominal, dict) and isinstance(tolerance, dict) and set(nominal) == set(tolerance)
    require(
        same and len(nominal) <= 64, "refuted: nominal values and tolerance do not name the same quantities"
    )
    found = {"goal": read_goal(goal, n_sides), "nominal": nominal, "tolerance": tolerance, "why": ""}
    if "recurs" in section:
        recurs = table(section["recurs"], "refuted.recurs", "", " ".join(RECURS))
        require(len(recurs) == 1, "refuted.recurs is not one of cycle, closed and once")
        (found["why"],) = recurs
        if found["why"] == "cycle":
            require(not {"start", "throws"} & set(section), "refuted: a cycle has no start and no throws")
            (orbit,) = read_orbits({"cycles": [recurs["cycle"]], "complete": False}, n_sides)["orbits"]
            return found | {"orbit": orbit}
        require(recurs[found["why"]] is True, "refuted.recurs is not true")
    require({"start", "throws"} <= set(section), "refuted: start or throws are missing")
    start = table(section["start"], "refuted.start", "x side")
    throws = [read_throw(each) for each in rows(section["throws"], "refuted.throws", 1, 100_000)]
    spans = [number for number, (kappa, _) in enumerate(throws) if isinstance(kappa, tuple)]
    closes = found["why"] == "closed" and spans == [len(throws) - 1]
    last = not spans or not found["why"] or closes
    require(last, "two values of kappa are those of the throw that closes an orbit")
    x, side = hex_float(start["x"], "refuted.start.x"), read_side(start["side"], n_sides)
    return found | {"x": x, "side": side, "throws": throws}


def read_throw(value: object) -> tuple[Any, Any]:
    """Read what a throw was like: kappa, two values between which it lies, or None; how far off it landed, or None."""
    one = table(value, "a throw", "kappa landing")
    kappa, landing = one["kappa"], one["landing"]
    if isinstance(kappa, list):
        low, high = (hex_float(end, "kappa") for end in rows(kappa, "kappa", 2, 2))
        require(low < high, "kappa is an empty interval")
        kappa = arb(low), arb(high)
    elif kappa is not None:
        kappa = arb(hex_float(kappa, "kappa"))
    return kappa, None if landing is None else arb(hex_float(landing, "landing"))


def statement_of_refutation(section: dict[str, Any]) -> str:
    """Put it in words."""
    near = ", ".join(
        f"{plain(name)} within {quantity(dev, KINDS, 'tolerance')} of"
        f" {quantity(section['nominal'][name], KINDS, 'nominal')}"
        for name, dev in section["tolerance"].items()
    )
    goal = section["goal"]
    order = " ".join(map(str, goal.get("order", ())))
    broken = BROKEN[goal["kind"]][1].format(text=goal.get("text"), side=goal.get("side"), order=order)
    if section["why"] == "cycle":
        o = section["orbit"]
        of = "almost every start" if o.attracts else "every start"
        orbit = f"a periodic orbit, of {len(o.word)} throws, with a place x in [{o.lo!r}, {o.hi!r}] on side {o.side}"
        what = f"not from {of}: {orbit}, which {'attracts' if o.attracts else 'repels'}, {broken}"
    else:
        start = f"x = {section['x']!r} on side {section['side']}"
        number = f"{len(section['throws'])} throws"
        if section["why"] == "closed":
            what = (
                f"not for every sequence of throws: an orbit of {number} from {start} back to there {broken}"
            )
        else:
            what = f"not from every start on the arm: the orbit from {start}, of {number}, {broken}"
    return f"refuted: {what}" + (f"; {near}" if near else "")


def check_deviations(scene: Scene, section: dict[str, Any]) -> str:
    """Check that the scene deviates from the nominal values by no more than is said; "" or what fails."""
    flat = dict(quantities(scene.raw))
    for name, text in section["tolerance"].items():
        square = name == "throw.speed" and "throw.kappa" in flat
        key = "throw.kappa" if square else name
        require(key in flat, f"refuted: {plain(name)} is not a quantity of the scene")
        q, nominal = quantity(flat[key], KINDS, key), quantity(section["nominal"][name], KINDS, key)
        dev = quantity(text, KINDS, "tolerance")
        require(dev.lo == dev.hi >= 0 and nominal.lo == nominal.hi, "refuted: a deviation is not one number")
        if dev.unit == "%":
            power = 2 if square else 1
            low, high = nominal.lo * (1 - dev.lo), nominal.lo * (1 + dev.lo)
            if square:
                require(dev.lo < 1, "refuted: a deviation of 100 %")
                low, high = nominal.lo / (1 + dev.lo) ** power, nominal.lo / (1 - dev.lo) ** power
            low, high = min(low, high), max(low, high)
        else:
            require(not square and dev.pi == q.pi == nominal.pi, f"refuted: {plain(name)} is in another unit")
            low, high = nominal.lo - dev.lo, nominal.lo + dev.lo
        if q.pi != nominal.pi or not low <= q.lo <= q.hi <= high:
            return f"{plain(name)} is not within {plain(text)} of {plain(section['nominal'][name])}"
    return ""


def check_refuted(scene: Scene, section: dict[str, Any]) -> str:
    """Throw the orbit again in balls, whatever the cells are; "" or what fails."""
    why, goal = section["why"], section["goal"]
    if not why:
        return "it shows a passing orbit only: a goal is refuted by one that comes back"
    bad = check_deviations(scene, section)
    if bad:
        return bad
    once = goal["kind"] in ("stays_on_arm", "attracts_all")
    if once or (goal["kind"] == "oriented_beyond" and goal["anywhere"]):
        if why != "once":
            return "an orbit that comes back is not what refutes this goal"
    elif why == "once":
        return "once is not enough: the goal does not speak of every throw from every start"
    try:
        states = periodic(scene, section["orbit"]) if why == "cycle" else thrown_again(scene, section)
        if why == "once":
            return left_or_beyond(scene, goal, states[-1])
        prove(breaks(scene, goal, states), "no state of the orbit violates the goal")
    except UnprovedError as error:
        return str(error)
    if goal["kind"] == "reaches" and not goal["every"] and not (why == "cycle" and section["orbit"].attracts):
        return "the goal speaks of almost every start, and the orbit is not proved to attract"
    return ""


State = tuple[int, Arb, Arb]  # side, and bounds of x


def periodic(scene: Scene, orbit: Orbit) -> list[State]:
    """Prove a periodic orbit of the scene without noise, which is one of the sequences allowed; its states."""
    quiet = read_scene({**scene.raw, "effects": {}}, None)
    prove(all(s.concave for s in quiet.sides), "kappa > ell is not proved")
    states = prove_orbit(Throws(quiet), None, orbit).states
    for side, lo, hi in states:
        s = quiet.sides[side]
        prove(bool(lo > s.a and hi <= s.arm), "a point of the periodic orbit is not proved to lie on the arm")
    return states


def thrown_again(scene: Scene, section: dict[str, Any]) -> list[State]:
    """Prove every throw of an orbit, and that it comes back exactly to its start where that is said; its states."""
    side, x = section["side"], arb(section["x"])
    throws, fixed = Throws(scene), scene.k_lo.union(scene.k_hi)
    varies = isinstance(scene.noise, dict) and bool({"throw.speed", "gravity.tilt"} & set(scene.noise))
    states = [(side, x, x)]
    for number, (said, landing) in enumerate(section["throws"], 1):
        s = scene.sides[side]
        prove(bool(x > s.a and x <= s.arm), f"the part does not lie on the arm before throw {number}")
        kappa = said if isinstance(said, tuple) else () if said is None else (said,)
        prove(varies or not kappa, f"the kappa of throw {number} is not within the noise: it is known")
        prove(bool(kappa) or not varies, f"throw {number} does not say its kappa")
        for k in kappa:
            within = k > scene.k_lo * (1 + INSIDE) and k < scene.k_hi * (1 - INSIDE)
            prove(bool(within), f"the kappa of throw {number} is not within the noise")
        shift = ZERO if landing is None else landing
        prove(bool(abs(shift) <= s.landing), f"throw {number} lands farther off than the noise allows")
        images = []
        for k in (kappa[0].union(kappa[1]), *kappa) if len(kappa) > 1 else kappa or (fixed,):
            thrown = throws.box(side, x.lower(), x.upper(), k.lower(), k.upper())
            prove(thrown.decision != 2, f"the decision of throw {number} is not settled")
            turned = s.shift if thrown.decision == 1 else ZERO
            images.append(thrown.lo.union(thrown.hi) + shift - turned)
        if number == len(section["throws"]) and section["why"] == "closed":
            to = states[0][0]
            prove((side + thrown.decision) % len(scene.sides) == to, "the last throw ends on another side")
            prove(
                comes_back(scene, states[0][1], images, landing),
                "that the last throw comes back is not proved",
            )
            return states
        x, side = images[0], (side + thrown.decision) % len(scene.sides)
        states.append((side, x.lower(), x.upper()))
    return states


def comes_back(scene: Scene, start: Arb, images: list[Arb], landing: Arb | None) -> bool:
    """Whether a throw can land exactly on the start.

    By the noise of the landing, if it spans the distance from all of the enclosed place; or between two values of kappa
    whose places lie on either side: f being concave the place moves continuously with kappa.
    """
    if len(images) == 1:
        return landing is None and bool(abs(images[0] - start) <= scene.sides[0].landing.lower())
    _, first, last = images
    parted = bool(first < start and last > start) or bool(first > start and last < start)
    return parted and all(s.concave for s in scene.sides)


def breaks(scene: Scene, goal: dict[str, Any], states: list[State]) -> bool:
    """Whether an orbit that comes back to its first state violates a goal, whichever number each ball stands for."""
    if goal["kind"] == "flip_order":
        order, sides = goal["order"], [side for side, _, _ in states]
        allowed = set(zip(order, [*order[1:], order[0]], strict=True))
        flips = [(a, b) for a, b in itertools.pairwise([*sides, sides[0]]) if a != b]
        return bool(set(flips) - allowed) or (not flips and len(set(order)) > 1)
    x = goal["x"].ball() / exact(LENGTHS[scene.unit])
    if goal["kind"] == "oriented_beyond":
        return any(side != goal["side"] and bool(lo > x) for side, lo, _ in states)
    return all(side != goal["side"] or bool(hi < x) for side, _, hi in states)


def left_or_beyond(scene: Scene, goal: dict[str, Any], last: State) -> str:
    """Check that a state is off the arm, or beyond x on another side; "" or what fails."""
    side, lo, hi = last
    s = scene.sides[side]
    if goal["kind"] != "oriented_beyond":
        off = bool(hi <= s.a or lo > s.arm)
        return "" if off else f"the orbit ends on side {side} at x = {lo.union(hi).str(12)}, on the arm"
    if breaks(scene, goal, [last]) and hi <= s.arm:
        return ""
    return f"the orbit ends on side {side} at x = {lo.union(hi).str(12)}, which the goal allows"


# --------------------------------------------------------------------------------------------------- near the joint


def check_near_joint(s: Side, k_lo: Arb, k_hi: Arb, edge: float, q: float) -> str:
    """Prove on (a, edge] that a throw is a decided jog and R' - a >= q (R - a), R' <= arm; "" or what fails.

    f = (R - a) phi + a (phi - sin phi) + d (1 - cos phi) - (kappa/2) phi^2 and both brackets are >= 0, so f > 0 for
    phi < 2 (R - a)/kappa: the impact comes later than that.  f rises with R, so f(bound) < 0 at the edge bounds it
    from above.  R' - R = -h phi + a (1 - cos phi) - d (phi - sin phi) >= -h phi + phi^2 (a/2 - a phi^2/24 - d phi/6)
    and <= -h phi + a phi^2/2.  Small angles: phi = 2 (R - a)/(kappa - small_d) and R' - R = -h phi.
    """
    x, height = arb(edge), -s.h
    if not s.landing <= 0:
        return "with noise of the landing place a part near the joint may land at x <= a"
    if not height > 0:
        return "the arm's surface is not below the joint"
    if not x > s.a:
        return "the cells begin left of a"
    bound = arb(float((2 * (x - s.a) / (k_hi - s.small_d)).upper()))
    for _ in range(20):
        if flight(x, k_lo, at_angle(s, bound)) < 0:
            break
        bound = bound * 1.25
    if not (flight(x, k_lo, at_angle(s, bound)) < 0 and bound < 1):
        return "the impact angle is not bounded"
    if s.exact and not HALF * s.a - s.a * bound**2 / 24 - s.d * bound / 6 > 0:
        return "a (1 - cos phi) >= d (phi - sin phi) is not proved"
    if not (q > 1 and q <= 1 + 2 * height / (k_hi - s.small_d)):
        return f"R' - a >= q (R - a) is not proved for q = {q!r}"
    if not x + height * bound + HALF * (s.a if s.exact else ZERO) * bound**2 <= s.arm:
        return "R' <= arm.length is not proved"
    R, kappa, pieces = s.a.union(x), k_lo.union(k_hi), 64
    for k in range(pieces):
        phi = (bound * k / pieces).union(bound * (k + 1) / pieces)
        if over_angles(s, phi, R, kappa)[0] != 0:
            return "a jog is not proved"
    return ""


# ------------------------------------------------------------------------------- the surface above the joint (h > 0)


class Ratios(NamedTuple):
    """Of an angle p in [0, 3]: sin(p)/p, V = (1 - cos p)/p^2 and W = (p - sin p)/p^3."""

    p: Arb
    sine: Arb
    V: Arb
    W: Arb


def ratios(p: Arb) -> Ratios:
    """Evaluate them; W between the sums 1/6 - p^2/120 (+ p^4/5040), whose terms alternate and fall for p^2 < 42."""
    low = ONE / 6 - p * p / 120
    return Ratios(p, p.sinc(), HALF * (HALF * p).sinc() ** 2, low.union(low + p**4 / 5040))


def landing_at(s: Side, r: Ratios, kappa: Arb) -> Arb:
    """Evaluate R(p), the start whose f has the root p: f = (R - R(p)) p."""
    return s.a * r.sine + r.p * (HALF * kappa - s.d * r.V)


def its_slope(s: Side, r: Ratios, kappa: Arb) -> Arb:
    """Evaluate dR(p)/dp = kappa/2 - a (V - W) p - d (sin p/p - V)."""
    return HALF * kappa - s.a * (r.V - r.W) * r.p - s.d * (r.sine - r.V)


def gain_at(a: Arb, d: Arb, h: Arb, r: Ratios) -> Arb:
    """Evaluate E(p) = (R' - R)/p of a jog; it rises with a and falls with d and h."""
    return a * r.p * r.V - d * (ONE - r.sine) - h


def gain_slope(a: Arb, d: Arb, r: Ratios) -> Arb:
    """Evaluate dE/dp."""
    return a * (r.sine - r.V) - d * (r.V - r.W) * r.p


def fixed_angles(s: Side) -> tuple[Ratios, Ratios] | None:
    """Find angles with E < 0 at the first and E > 0 at the second for all parameters: guessed by Newton, proved."""
    found = []
    for sign, a, d, h in (
        (-1, s.a.upper(), s.d.lower(), s.h.lower()),
        (1, s.a.lower(), s.d.upper(), s.h.upper()),
    ):
        p = 2 * h / a
        for _ in range(60):
            r = ratios(p)
            slope = gain_slope(a, d, r).mid()
            if not (slope > 0 and p < 3):
                return None
            p = (p - gain_at(a, d, h, r).mid() / slope).mid()
        if not (p > 0 and p < 3):
            return None
        for k in range(10):
            r = ratios(arb(float(p) * (1 + sign * 2.0 ** (3 * k - 46))))
            if sign * gain_at(s.a, s.d, s.h, r) > 0:
                break
        else:
            return None
        found.append(r)
    return found[0], found[1]


def last_angle(s: Side, x: float, k_lo: Arb) -> Ratios | None:
    """Find an angle p with R(p) > x for all parameters."""
    guess = guess_root(s.late, s.exact, x, float(k_lo), 4 * (x - s.floats[0]) / float(k_lo) + 0.1)
    for k in range(20):
        p = guess * (1 + 2.0 ** (2 * k - 38))
        if 0 < p < 3:
            r = ratios(arb(p))
            if landing_at(s, r, k_lo) > arb(x):
                return r
    return None


def check_fixed_point(s: Side, k_lo: Arb, k_hi: Arb, edge: float, q: float, said: tuple[float, float]) -> str:
    """Prove the claims about starts up to the edge where the arm's surface is above the joint; "" or what fails.

    They are: on (a, edge] a throw is a jog; it has one fixed point R* there, with said[0] <= R* <= said[1]; starts in
    (a, R*) tend to a; and R' - R* >= q (R - R*), R' <= arm on (R*, edge].

    f(p) = (R - R(p)) p.  Where dR/dp > 0 on (0, top] and R(top) > edge, each start in (a, edge] has one root there, its
    first, and they grow together: all is said by the angle.  dE/dp > 0 with E < 0 at one angle and E > 0 at a later one
    leaves one zero p* between, R* = R(p*); E has the sign of p - p*.  (R' - a)/p = kappa/2 - h + a (V - W) p
    - d (V + 1 - sin p/p) > 0 keeps a jog right of a: below R* starts fall and stay above a, to a limit, which is fixed
    and so a.  (With another kappa at every throw they fall too, on any closed interval in there by a least step.)
    Beyond, R' - R = D(p), dD/dR = (dD/dp)/(dR/dp) >= q - 1 from the first angle on, and D = 0 at R*.
    """
    if not s.exact:
        return "every jog goes inward in this flight, where the arm's surface is above the joint"
    angles, last = fixed_angles(s), last_angle(s, edge, k_lo)
    if angles is None or last is None:
        return "the fixed point of the jog is not found"
    below, above = angles
    top, kappa = last.p, k_lo.union(k_hi)
    least, most = landing_at(s, below, k_lo), landing_at(s, above, k_hi)
    if not (below.p < above.p and above.p < top and most < arb(edge)):
        return "the cells do not begin beyond the fixed point of the jog"
    if not (least >= arb(said[0]) and most <= arb(said[1])):
        return f"the fixed point of the jog is not proved to lie in [{said[0]!r}, {said[1]!r}]"
    pieces = 256
    for k in range(pieces):
        ends = ratios(top * k / pieces), ratios(top * (k + 1) / pieces)
        r = ratios(ends[0].p.union(ends[1].p))
        if not (its_slope(s, r, k_lo) > 0 and gain_slope(s.a, s.d, r) > 0):
            return "the fixed point of the jog is not proved to be the only one"
        if not HALF * k_lo - s.h + s.a * (r.V - r.W) * r.p - s.d * (r.V + ONE - r.sine) > 0:
            return "R' > a is not proved"
        R = landing_at(s, ends[0], k_lo).union(landing_at(s, ends[1], k_hi))
        if over_angles(s, r.p, R, kappa)[0] != 0:
            return "a jog is not proved"
    pieces = 16
    for k in range(pieces):
        r = ratios(
            (below.p + (top - below.p) * k / pieces).union(below.p + (top - below.p) * (k + 1) / pieces)
        )
        sin, cos = r.p.sin_cos()
        rise = s.a * sin - s.d * (1 - cos) - s.h
        if not (q > 1 and rise > 0 and rise >= (arb(q) - 1) * its_slope(s, r, k_hi)):
            return f"R' - R* >= q (R - R*) is not proved for q = {q!r}"
    if not arb(edge) + at_angle(s, top).D <= s.arm:
        return "R' <= arm.length is not proved"
    return ""


def check_below_cells(
    scene: Scene, side: int, edge: float, q: float, said: tuple[float, float] | None
) -> str:
    """Check what is said of starts before the first cell: whichever the sign of h asks for; "" or what fails."""
    s = scene.sides[side]
    if s.h > 0:
        if said is None:
            return "the arm's surface is above the joint, and no fixed point of the jog is given"
        if not s.landing <= 0:
            return "with noise of the landing place a part may come to either side of the jog's fixed point"
        return check_fixed_point(s, scene.k_lo, scene.k_hi, edge, q, said)
    if said is not None:
        return "a fixed point of the jog is given, but the arm's surface is not above the joint"
    return check_near_joint(s, scene.k_lo, scene.k_hi, edge, q)


def fixed_points_in_words(section: dict[str, Any], noisy: bool) -> str:
    """Put attracts-all in words where the arm's surface is above the joint."""
    said = "; ".join(f"side {i}: [{lo!r}, {hi!r}]" for i, (lo, hi) in enumerate(section["fixed"]))
    if noisy:
        what = (
            "for each speed of the noise the jog has an unstable fixed point, all in an interval [lo_i, hi_i]"
        )
        beyond, before, rest = "hi_i", "lo_i", "; nothing is claimed of starts between lo_i and hi_i"
    else:
        what, beyond, before, rest = (
            "the jog has an unstable fixed point R*_i in an interval",
            "R*_i",
            "R*_i",
            "",
        )
    return (
        f"attracts-all, with the arm's surface above the joint: on every side i {what} ({said});"
        f" every start {beyond} < x <= arm.length on every side i enters the attracting cells and stays in them, within"
        f" {section['max_rank']} throws where x is in the cells; nearer to it x - {beyond} grows by a factor of at"
        f" least {shown(min(section['q']), up=False)} with every throw; every start a_i < x < {before} stays on side i"
        f" and tends to a_i{rest}"
    )


# --------------------------------------------------------------------------------------------------------- the claims

SECTIONS = {  # the claims that are known, and the keys of their sections
    "attracts-all": "near_joint max_rank",
    "invariant": "",
    "trapping": "",
    "goal": "kind",  # and what that kind needs, see GOALS
    "expanding": "least_slope",
    "end-points": "images ends pieces",
    "cycles": "cycles complete",
    "refuted": "goal nominal tolerance",
}
MORE_KEYS = {"refuted": "recurs start throws"}  # that a section may have besides
WORDS = {  # of a verdict, in JSON and for people
    "proved": "PROVED",
    "proved-on-cells": "PROVED ON CELLS",
    "refuted": "REFUTED",
    "failed": "FAILED",
    "not rechecked": "NOT RECHECKED",
    "bad file": "BAD FILE",
}
EXITS = {"proved": 0, "proved-on-cells": 1, "refuted": 1, "failed": 1, "bad file": 2}


@dataclass
class Report:
    """What became of a certificate: `claims` has (claim, a word of `WORDS`, reason); `starts` are those of the goal.

    `share` is that of the arm for whose starts the goal is proved, `explained` that of starts which are proved to be
    lost or to creep to the joint: both are lower bounds, and `open` is an upper one of what remains.
    """

    verdict: str = "failed"
    claims: list[tuple[str, str, str]] = field(default_factory=list)
    starts: Any = None
    share: float | None = None
    explained: float | None = None
    open: float | None = None
    statement: list[str] = field(default_factory=list)
    parameters: dict[str, str] = field(default_factory=dict)
    relied_on: list[str] = field(default_factory=list)
    reason: str = ""
    seconds: float = 0.0
    cells: int = 0
    boxes: int = 0


def quantities(value: object, where: str = "") -> Iterator[tuple[str, object]]:
    """Name every quantity of a scene."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if where or key in ("part", "arm", "throw", "gravity"):
                yield from quantities(inner, f"{where}.{key}" if where else key)
    elif isinstance(value, list) and where in ("part.sides", "part.vertices", "part.mass.points"):
        for i, inner in enumerate(value):
            yield from quantities(inner, f"{where}[{i}]")
    elif isinstance(value, list) and re.fullmatch(r"part\.vertices\[[0-9]+\]", where):
        yield from ((f"{where}.{key}", inner) for key, inner in zip("xy", value, strict=True))
    else:
        yield where, value


def check_tolerance(raw: list[Any], tolerance: object) -> tuple[dict[str, str], str]:
    """Check that the boxes cover the tolerance: the range of each quantity for people, and what fails.

    All boxes agree but in the quantities named; they cover the box that holds all of them, and that must be as wide as
    the tolerance around some middle.
    """
    if tolerance is None:
        require(len(raw) == 1, "several boxes need a tolerance")
        return {}, ""
    require(isinstance(tolerance, dict) and 0 < len(tolerance) <= 64, "tolerance is not an object")
    assert isinstance(tolerance, dict)
    flat = [dict(quantities(scene)) for scene in raw]
    ranges: list[list[Quantity]] = []
    shown, names = {}, []
    for name, text in tolerance.items():
        dev = quantity(text, KINDS, "tolerance")
        square = name == "throw.speed" and "throw.kappa" in flat[0]
        key = "throw.kappa" if square else name
        require(
            all(key in f for f in flat) and dev.lo == dev.hi >= 0,
            f"tolerance: {plain(name)} is not understood",
        )
        own = [quantity(f[key], KINDS, key) for f in flat]
        require(len({q.pi for q in own}) == 1, f"{plain(key)}: mixes degrees and radians")
        ranges.append(own)
        require(key not in names, "tolerance names one quantity twice")
        names.append(key)
        lo, hi = min(q.lo for q in own), max(q.hi for q in own)
        shown[key] = str(own[0]._replace(lo=lo, hi=hi)) if lo < hi else f"every value in [{own[0]}, {own[0]}]"
        if dev.unit == "%":
            lo, hi = (lo, hi) if lo > 0 else (-hi, -lo)
            power = 2 if square else 1
            wide = dev.lo < 1 and lo > 0 and lo * (1 + dev.lo) ** power <= hi * (1 - dev.lo) ** power
        else:
            require(not square and dev.pi == own[0].pi, f"tolerance of {plain(name)} is in another unit")
            wide = hi - lo >= 2 * dev.lo
        if not wide:
            return shown, f"the boxes do not cover the tolerance of {plain(name)}"
    rest = [{key: value for key, value in f.items() if key not in names} for f in flat]
    alike = ("model", "goal", "world", "tolerance", "effects")
    same = all(
        r == rest[0] and all(scene.get(key) == raw[0].get(key) for key in alike)
        for r, scene in zip(rest, raw, strict=True)
    )
    if not same:
        return shown, "the boxes differ in something else than the tolerance"
    boxes = [[(own[b].lo, own[b].hi) for own in ranges] for b in range(len(raw))]
    whole = [(min(q.lo for q in own), max(q.hi for q in own)) for own in ranges]
    if not covered(whole, boxes):
        return shown, "the boxes leave a gap in the tolerance"
    return shown, ""


Ends = list[tuple[Fraction, Fraction]]


def covered(whole: Ends, boxes: list[Ends]) -> bool:
    """Whether boxes cover a box, exactly: it lies in one, or is cut at an end of one and both parts are covered.

    Cut where the fewest boxes lie on both sides; points that only touch a box lie in it.
    """
    stack, looked = [(whole, boxes)], 0
    while stack:
        region, some = stack.pop()
        looked += len(some)
        require(looked <= 20_000_000, "too many boxes")
        if any(
            all(lo <= a and b <= hi for (a, b), (lo, hi) in zip(region, box, strict=True)) for box in some
        ):
            continue
        best: tuple[int, int, Fraction] | None = None
        for k, (a, b) in enumerate(region):
            lows, highs = sorted(box[k][0] for box in some), sorted(box[k][1] for box in some)
            for cut in {end for ends in (lows, highs) for end in ends if a < end < b}:
                both = bisect.bisect_left(lows, cut) - bisect.bisect_right(highs, cut)
                uneven = max(bisect.bisect_left(lows, cut), len(some) - bisect.bisect_right(highs, cut))
                if best is None or (both, uneven) < best[:2]:
                    best = (both, uneven, cut)
                    axis = k
        if best is None:
            return False
        cut = best[2]
        for part in ((region[axis][0], cut), (cut, region[axis][1])):
            inner = [*region[:axis], part, *region[axis + 1 :]]
            meeting = [
                box
                for box in some
                if all((lo < b and a < hi) or a == b for (a, b), (lo, hi) in zip(inner, box, strict=True))
            ]
            stack.append((inner, meeting))
    return True


def read_claims(
    header: dict[str, Any], n_sides: int, version: int
) -> tuple[dict[str, dict[str, Any]], list[tuple[str, str, str]]]:
    """Read the claims that can be checked, name -> section, and those that cannot."""
    known: dict[str, dict[str, Any]] = {}
    unknown = []
    for claim in rows(header["claims"], "claims", 1, 100):
        table(claim, "a claim", "claim", "section")
        name, section = claim["claim"], claim.get("section")
        if not isinstance(name, str) or name not in SECTIONS:
            unknown.append((plain(name), "not rechecked", "this checker does not know the claim"))
        elif section is None:
            unknown.append((name, "not rechecked", "the claim has no section"))
        elif name == "goal" and isinstance(section, dict) and section.get("kind") not in list(GOALS):
            unknown.append((name, "not rechecked", "this checker does not know the kind of goal"))
        else:
            require(name not in known, f"claim {name} is made twice")
            if name == "goal":
                known[name] = read_asked(section, n_sides, version)
            else:
                section = table(section, f"section of {name}", SECTIONS[name], MORE_KEYS.get(name, ""))
                known[name] = read_section(name, section, n_sides)
    return known, unknown


def read_asked(section: object, n_sides: int, version: int) -> dict[str, Any]:
    """Read the section of a goal: what is asked, and for which starts."""
    starts = "starts thinning near_joint lost" if version > 1 else ""
    known = table(section, "section of goal", "kind", f"{GOAL_KEYS} {starts}")
    own = {key: value for key, value in known.items() if key not in starts.split()}
    more = "from_anywhere throws" if own["kind"] == "oriented_beyond" else "from_anywhere"
    goal = read_goal(table(own, "section of goal", GOALS[own["kind"]], more), n_sides)
    return goal | {"starts": read_starts(known, goal, n_sides) if version > 1 else None}


def read_section(name: str, section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read the numbers of a section."""
    if name == "attracts-all":
        q, fixed = read_near_joint(section["near_joint"], n_sides)
        require(type(section["max_rank"]) is int, "max_rank is not an integer")
        return {"q": q, "fixed": fixed, "max_rank": section["max_rank"]}
    if name == "expanding":
        least = hex_float(section["least_slope"], "least_slope")
        require(least > 1, "least_slope is not above 1")
        return {"least": least}
    if name == "end-points":
        return read_ends(section, n_sides)
    if name == "cycles":
        return read_orbits(section, n_sides)
    if name == "refuted":
        return read_refutation(section, n_sides)
    return {}


def read_near_joint(value: object, n_sides: int) -> tuple[list[float], list[Pair | None]]:
    """Read what is said of starts before the first cell of each side."""
    near = by_side(value, "near_joint", n_sides)
    each = [table(one, "near_joint", "q", "fixed_point") for one in near]
    fixed = [read_bracket(one["fixed_point"]) if "fixed_point" in one else None for one in each]
    return [hex_float(one["q"], "q") for one in each], fixed


def by_side(value: object, where: str, n_sides: int) -> list[Any]:
    """Read an object with one entry for each side."""
    names = [str(i) for i in range(n_sides)]
    known = table(value, where, " ".join(names))
    return [known[name] for name in names]


def read_bracket(value: object) -> tuple[float, float]:
    """Read two numbers that enclose one."""
    lo, hi = (hex_float(end, "fixed_point") for end in rows(value, "fixed_point", 2, 2))
    require(lo <= hi, "fixed_point is an empty interval")
    return lo, hi


# ---------------------------------------------------------------------------------------------------------- the goals

GOAL_KEYS = "x side every_orbit throws order jogs from_anywhere"
GOALS = {  # the kinds that are known, and the keys of their sections; from_anywhere may come with each
    "oriented_beyond": "kind x side",
    "reaches": "kind x side every_orbit throws",
    "attracts_all": "kind",
    "flip_order": "kind order jogs",
    "stays_on_arm": "kind",
}
MOST_COUNTED = 100_000  # throws that a goal may count
MOST_EDGES = 20_000_000


def read_goal(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read a goal; `all`: whether it is about throws from all cells, not from the attracting ones alone."""

    def whole(value: object, least: int, most: int, what: str) -> int:
        fits = type(value) is int and least <= value < most
        require(fits, f"goal.{what} is not a whole number as it should be")
        return int(str(value))

    kind, anywhere = section["kind"], section.get("from_anywhere", False)
    require(isinstance(anywhere, bool), "goal.from_anywhere is neither true nor false")
    goal = {"kind": kind, "anywhere": anywhere, "all": anywhere or kind == "attracts_all"}
    if "x" in section:
        x = quantity(section["x"], "length", "goal.x")
        require(x.lo == x.hi, "goal.x is not one number")
        goal |= {"x": x, "text": str(x), "side": whole(section["side"], 0, n_sides, "side")}
    if kind == "oriented_beyond":
        goal["throws"] = whole(section.get("throws", 0), 0, 3, "throws")
        require(
            goal["throws"] in (0, 2) and not (anywhere and goal["throws"]), "goal.throws is neither 0 nor 2"
        )
    if kind == "reaches":
        require(isinstance(section["every_orbit"], bool), "goal.every_orbit is neither true nor false")
        goal |= {
            "every": section["every_orbit"],
            "throws": whole(section["throws"], 0, MOST_COUNTED, "throws"),
        }
    if kind == "flip_order":
        order = [whole(i, 0, n_sides, "order") for i in rows(section["order"], "goal.order", 1, 64)]
        goal |= {"order": order, "jogs": whole(section["jogs"], 0, MOST_COUNTED, "jogs")}
    return goal


class Starts(NamedTuple):
    """For which starts a goal is claimed: "every", "almost-every", "from" (beyond x on each side) or "cells".

    `thinning`: rounds of it; `near`: factors and fixed points of starts below the first cells, where they are claimed;
    `lost`: up to where, on each side, a worst sequence of landings takes a part to the joint; `only`: whether nothing
    is claimed of other starts than those in the attracting cells.
    """

    kind: str
    x: list[float] | None = None
    thinning: int = 0
    near: tuple[list[float], list[Pair | None]] | None = None
    lost: list[float] | None = None
    only: bool = False

    def fixed(self, side: int) -> Pair | None:
        """Return the bracket of the jog's fixed point on a side, where one is named."""
        return None if self.near is None else self.near[1][side]


ATTRACTING = Starts("cells", only=True)  # as in certificates of version 1


def read_starts(section: dict[str, Any], goal: dict[str, Any], n_sides: int) -> Starts:
    """Read for which starts a goal is claimed."""
    require("starts" in section, "goal.starts is missing")
    said, kind = section["starts"], section["starts"]
    x = None
    if isinstance(said, dict):
        table(said, "goal.starts", "from")
        kind, x = "from", [hex_float(each, "goal.starts") for each in by_side(said["from"], "from", n_sides)]
    require(kind in ("every", "almost-every", "from", "cells"), "goal.starts is none that is known")
    thinning = section.get("thinning", 0)
    fits = type(thinning) is int and (0 < thinning < MOST_COUNTED if "thinning" in section else True)
    require(fits, "goal.thinning is not a number of rounds")
    near = read_near_joint(section["near_joint"], n_sides) if "near_joint" in section else None
    lost = None
    if "lost" in section:
        lost = [hex_float(each, "lost") for each in by_side(section["lost"], "lost", n_sides)]
    anywhere = goal["anywhere"] and goal["kind"] != "attracts_all"  # which is of every start in any case
    almost = goal["kind"] == "reaches" and not goal["every"]
    starts = Starts(kind, x, thinning, near, lost, only=almost and kind == "cells")
    points = [starts.fixed(i) for i in range(n_sides)]
    require(lost is None or kind in ("from", "cells"), f"starts {kind}: none of them are lost")
    if kind in ("every", "almost-every"):
        require(
            (near is not None or anywhere) and not any(points), f"starts {kind}: near_joint does not say so"
        )
        fits = ("thinning" in section) == (kind == "almost-every") or (almost and kind == "almost-every")
        require(fits, f"starts {kind} and thinning do not fit")
    for i, point in enumerate(points):
        require(
            x is None or point is None or x[i] >= point[1],
            "starts before the end of a fixed point are claimed",
        )
    require(not (almost and kind == "every"), "a goal of almost every orbit is claimed for every start")
    of = "almost-every" if almost else "every"
    require(kind == of or not anywhere, f"this goal from anywhere is one of starts {of}")
    require(kind != "cells" or goal["kind"] != "attracts_all", "attracts_all of some cells")
    return starts


def starts_in_words(starts: Starts, noisy: bool) -> str:
    """Put the starts in words: the numbers are those that are checked."""
    some = "every start a_i < x <= arm.length on every side i"
    if starts.x is not None:
        some = "every start with " + ", or ".join(
            f"{x!r} < x <= arm.length on side {i}" for i, x in enumerate(starts.x)
        )
    elif starts.kind == "cells":
        before = ", and before the first cells" if starts.near is not None else ""
        some = f"every start in the cells that have a rank{before}"
    others = ", others for other throws" if noisy else ""
    return some + (f", but for starts of total length zero{others}" if starts.thinning else "")


def explained_in_words(starts: Starts) -> list[str]:
    """Put in words what becomes of starts that are not claimed."""
    lines = []
    for i in range(len(starts.lost or (starts.near or ([], []))[0])):
        fixed = starts.fixed(i)
        if fixed is not None:
            lines.append(f"    side {i}: starts a_{i} < x < {fixed[0]!r} stay on it and creep to a_{i}")
        elif starts.lost is not None:
            lines.append(
                f"    side {i}: each start a_{i} < x <= {starts.lost[i]!r} is lost by a worst sequence of landings"
            )
    return lines


def asked(goal: dict[str, Any]) -> tuple[Any, ...]:
    """Say what a goal asks, to compare it: kind, x in metres, side, and the rest."""
    x = goal["x"].lo if "x" in goal else None
    words = (goal.get("side"), goal.get("every"), goal.get("order"))
    return (goal["kind"], goal["all"], x, *words)


def goal_of_scene(scene: dict[str, Any], n_sides: int) -> dict[str, Any] | None:
    """Read a scene's own goal, as its section would be."""
    if scene.get("goal") is None:
        return None
    known = table(scene["goal"], "scene.goal", "", " ".join([*GOALS, "from_anywhere"]))
    kinds = [key for key in known if key != "from_anywhere"]
    require(len(kinds) == 1, "scene.goal does not name one goal")
    kind, value = kinds[0], known[kinds[0]]
    section = {"kind": kind, "from_anywhere": known.get("from_anywhere", False)}
    if kind in ("oriented_beyond", "reaches"):
        more = "every_orbit" if kind == "reaches" else ""
        section |= table(value, f"scene.goal.{kind}", "x side", more)
        section |= {"every_orbit": section.get("every_orbit", False), "throws": 0} if more else {}
    elif kind == "flip_order":
        section |= {"order": value, "jogs": 0}
    else:
        require(value is True, f"scene.goal.{kind} is not true")
    return read_goal(section, n_sides)


def statement_of_goal(goal: dict[str, Any], noisy: bool) -> str:
    """Put a goal in words, `starts` being those for which it is proved."""
    starts = goal["starts"] or (Starts("every") if goal["all"] else ATTRACTING)
    place = starts_in_words(starts, noisy)
    into = f"; into the attracting cells comes, and there stays, {place}"
    if starts.only:
        place, into = "every start in the attracting cells", ""
    if goal["anywhere"]:
        into = ""
    here = place if goal["anywhere"] else "every start in the attracting cells"
    words = "goal: "
    if goal["kind"] == "oriented_beyond":
        cells = "after two throws with the same parameters in" if goal["throws"] else "in"
        where = f"after a throw from {place}" if goal["anywhere"] else f"{cells} the attracting cells"
        words += f"{where}, x > {goal['text']} implies side {goal['side']}{into}"
    elif goal["kind"] == "reaches":
        there = f"comes to rest on side {goal['side']} at x >= {goal['text']}"
        if goal["every"]:
            words += f"{here} {there}, after {goal['throws']} throws at most where x is in the cells{into}"
        else:
            those = "" if starts.thinning else ", but for starts of total length zero"
            those += ", others for other throws" if those and noisy else ""
            words += f"{place}{those} {there}"
    elif goal["kind"] == "attracts_all":
        words += f"{place} enters one component of attracting cells, connected by its images, and stays in it"
    elif goal["kind"] == "flip_order":
        order = " ".join(map(str, goal["order"]))
        again = f"comes to lie on the sides in the order {order}, again and again"
        words += (
            f"from {here} the part {f'stays on side {order}' if len(goal['order']) == 1 else again}{into}"
        )
    else:
        words += f"from {place} no throw leads off the arm or to x <= a_i"
    return "\n".join([words, *explained_in_words(starts)])


def check_goal(c: Cells, scene: Scene, goal: dict[str, Any]) -> str:
    """Check a goal by the integers, given that all images are what the certificate says; "" or what fails."""
    inside, starts = c.component >= 0, goal["starts"]
    everywhere = goal["all"] if starts is None else goal["anywhere"] and goal["kind"] != "attracts_all"
    bad = check_everywhere(c, scene) if everywhere else ""
    if not bad and starts is not None:
        bad = check_starts(c, scene, goal, starts)
    elif not bad and goal["all"] and goal["kind"] in ("attracts_all", "flip_order"):
        bad = check_ranks(c, scene, int(c.rank.max()))
    if bad:
        return bad
    if goal["kind"] == "oriented_beyond":
        return check_oriented(c, scene, goal)
    if goal["kind"] == "reaches":
        return check_reaches(c, scene, goal)
    if goal["kind"] == "attracts_all":
        return check_one_component(c)
    if goal["kind"] == "flip_order":
        order, n = goal["order"], len(c.edges)
        if len(order) == 1 and not goal["anywhere"]:
            return first_bad(c, [(~inside | (c.side == order[0]), "an attracting cell lies on another side")])
        if len(order) != n or any(
            (a + 1) % n != b for a, b in zip(order, order[1:] + order[:1], strict=True)
        ):
            return "the order is not that in which flips lead from side to side"
        # one more than the jogs in a row: the throw after them is a flip, or has come to none
        late = arrive(c, [c.jog], inside, np.zeros(len(inside), dtype=bool), goal["jogs"] + 1)
        return first_bad(c, [(~late, f"{goal['jogs'] + 1} jogs in a row are not excluded")])
    return ""  # stays_on_arm: that images lie in cells is all that it says


def check_starts(c: Cells, scene: Scene, goal: dict[str, Any], starts: Starts) -> str:
    """Check that the starts claimed come into the attracting cells, given all images; "" or what fails.

    Let G be the cells with a rank.  No orbit leaves them, and off the components the rank never rises: so in the end it
    stays what it is.  It cannot where it falls along every target; nor for ever in a cell that only leads to itself and
    to lower ranks, while each jog from it moves the part one way by more than the landing scatters.  What is left, Z,
    has to thin out, rank by rank; and starts of length zero have to come from starts of length zero only.
    """
    if starts.only:
        return ""
    inside, claimed = c.component >= 0, c.rank >= 0
    near, almost = starts.near, goal["kind"] == "reaches" and not goal["every"]
    if goal["kind"] == "attracts_all" and near is not None and any(near[1]):
        return "parts near the joint creep to it: there are two basins"
    for i, edges in enumerate(c.edges):
        first, own = float(edges[0]), claimed[c.start[i] : c.start[i + 1]]
        needed = np.zeros(len(own), dtype=bool)
        if starts.kind != "cells":
            if Fraction(float(edges[-1])) < scene.arm[1]:
                return f"side {i}: the cells end before arm.length"
            needed = edges[1:] > (-math.inf if starts.x is None else starts.x[i])
        if starts.x is not None and near is None and not starts.x[i] >= first:
            return f"side {i}: starts are claimed that lie before the cells"
        if near is not None:
            bad = over_halves(scene, check_below_cells, i, first, near[0][i], near[1][i])
            if bad:
                return f"side {i}, near the joint, x in (a, {first!r}]: {bad}"
            needed |= edges[:-1] <= above(near_landing(scene.sides[i], scene.k_lo, scene.k_hi, first))
        if not own[needed].all():
            cell = int(c.start[i]) + int(np.argmax(needed & ~own))
            return f"{c.name(cell)}: nothing is claimed of starts in it: its rank is -1"
        if starts.lost is not None:
            bad = over_halves(scene, check_lost, i, starts.lost[i])
            if bad:
                return f"side {i}, starts up to x = {starts.lost[i]!r}: {bad}"
    if goal["anywhere"] and not (goal["kind"] == "flip_order" or almost):
        return ""  # what is asked is asked of every throw, or of a number of throws: no orbit has to arrive
    stuck, bad = level_cells(c, scene)
    if bad:
        return bad
    if stuck.any():
        if not starts.thinning:
            return first_bad(c, [(~stuck, "the rank does not fall along a throw")])
        bad = check_thinning(c, scene, stuck, starts.thinning, c.rank)
        if bad:
            return bad
    if stuck.any() or almost:
        some = claimed if almost else leading_to(c, stuck)
        return check_null(c, scene, some & claimed & ~inside, near is not None and not any(near[1]))
    return ""


def level_cells(c: Cells, scene: Scene) -> tuple[Array, str]:
    """Find the cells of Z: off the components, those in which an orbit may stay at its rank; and what fails."""
    inside, claimed = c.component >= 0, c.rank >= 0
    level = np.zeros(len(inside), dtype=bool)
    alone = np.ones(len(inside), dtype=bool)  # no other cell than itself has its rank among its targets
    checks = [(~inside | (c.rank == 0), "a cell of a component has a rank other than 0")]
    for array, what in ((c.jog, "jog"), (c.flip, "flip")):
        q = np.flatnonzero((array[:, 0] >= 0) & claimed & ~inside)
        first, last = array[q, 0], array[q, 1]
        most, least = range_max(c.rank, first, last), -range_max(-c.rank, first, last)
        stays, falls = np.ones(len(inside), dtype=bool), np.ones(len(inside), dtype=bool)
        stays[q], falls[q] = least >= 0, most <= c.rank[q]
        checks.append((stays, f"a {what} may lead to a cell with the rank -1"))
        checks.append((falls, f"the rank may rise along a {what}"))
        level[q] |= most == c.rank[q]
        for lo, hi in ((first, np.minimum(last, q - 1)), (np.maximum(first, q + 1), last)):
            some = lo <= hi
            alone[q[some]] &= range_max(c.rank, lo[some], hi[some]) < c.rank[q[some]]
    bad = first_bad(c, checks)
    for k in np.flatnonzero(level & alone).tolist() if not bad else ():
        level[k] = bool(over_halves(scene, check_passing, int(c.side[k]), c.phi[k].tolist()))
    return level, bad


def check_passing(scene: Scene, side: int, phi: list[float]) -> str:
    """Check that jogs with angles in the bracket all move one way by more than the landing scatters; "" or not."""
    s = scene.sides[side]
    low, high = at_angle(s, arb(phi[0])), at_angle(s, arb(phi[1]))
    rise = -s.h
    if s.exact:
        sin, cos = sine_cosine(low.p.union(high.p))
        rise = s.a * sin - s.d * (1 - cos) - s.h
    moved = low.D.union(high.D) if rise > 0 else low.D + rise * ZERO.union(high.p - low.p)
    one_way = moved > s.landing or moved < -s.landing
    return "" if one_way else "a jog is not proved to move it one way"


def leading_to(c: Cells, cells: Array) -> Array:
    """Find the cells that lead to some cells, and these themselves."""
    found, count = cells.copy(), -1
    while count != int(found.sum()):
        count = int(found.sum())
        number = np.concatenate([[0], np.cumsum(found)])
        for array in (c.jog, c.flip):
            q = np.flatnonzero(array[:, 0] >= 0)
            found[q] |= number[array[q, 1] + 1] > number[array[q, 0]]
    return found


def check_lost(scene: Scene, side: int, end: float) -> str:
    """Check that a worst sequence of landings takes every start in (a, end] to the joint; "" or what fails.

    Told by the angle p: a start R(p, kappa) is thrown by D(p).  Where it is a jog with D < e for all p up to an angle
    after the impact at the end, landings that fall short by e bring the part inward, by a least step: to x <= a.  One
    kappa of the noise will do; where kappa is not known but for a tolerance, all of them have to.
    """
    s, x = scene.sides[side], arb(end)
    if not s.landing > 0:
        return "without noise of the landing place no part is lost by it"
    if x <= s.a:
        return ""  # nothing is said
    if not (x > s.a and x <= s.arm):
        return "they do not lie on the arm"
    loose = any(
        isinstance(value, list | Quantity) for name, value in quantities(scene.raw) if name[:5] in VARYING
    )
    inner = scene.k_lo * (1 + INSIDE), scene.k_hi * (1 - INSIDE)
    kappa = inner[1] if not loose and inner[0] < inner[1] else scene.k_lo.union(scene.k_hi)
    bound = near_angle(s, kappa.lower(), kappa.upper(), end)
    if not bound < 3:
        return "the impact angle is not bounded"
    top = root_above(s, x, kappa.lower(), at_angle(s, bound)).p
    stack, looked = [(top * k / 64, top * (k + 1) / 64) for k in range(64)], 0
    while stack:
        lo, hi = stack.pop()
        looked += 1
        p = lo.union(hi)
        R = landing_at(s, ratios(p), kappa) if s.exact else s.a + HALF * (kappa - s.small_d) * p
        if over_angles(s, p, R, kappa)[0] == 0 and not check_short(s, lo, hi):
            continue
        if looked > MOST_HALVES:
            return "that a jog falls short is not proved"
        stack += [(lo, HALF * (lo + hi)), (HALF * (lo + hi), hi)]
    return ""


VARYING = ("throw", "gravi")  # what kappa is computed from


def check_short(s: Side, lo: Arb, hi: Arb) -> str:
    """Check that jogs with these angles move a part by less than the landing scatters; "" or not."""
    rise = (
        s.a * sine_cosine(lo.union(hi))[0] - s.d * (1 - sine_cosine(lo.union(hi))[1]) - s.h
        if s.exact
        else -s.h
    )
    end = at_angle(s, hi).D
    moved = end if rise > 0 else end - rise * ZERO.union(hi - lo)
    return "" if moved < s.landing else "a jog may move a part outward by more than the landing scatters"


def shares(c: Cells, scene: Scene, starts: Starts, cells: Array) -> tuple[float, float]:
    """Bound, from below, the share of the arm whose starts are claimed, and of those explained: lost, or creeping."""
    if starts.kind in ("every", "almost-every"):
        return 1.0, 0.0
    whole = claimed = explained = 0.0
    end = below(exact(scene.arm[0]))
    for i, s in enumerate(scene.sides):
        begin, fixed = above(s.a), starts.fixed(i)
        whole += above(exact(scene.arm[1])) - below(s.a)
        edges = np.minimum(c.edges[i], end)
        since = -math.inf if starts.x is None else starts.x[i]
        own = cells[c.start[i] : c.start[i + 1]]
        claimed += float(np.clip(edges[1:] - np.maximum(edges[:-1], since), 0.0, None)[own].sum())
        if starts.near is not None and not starts.only:
            claimed += max(0.0, float(edges[0]) - max(begin if fixed is None else fixed[1], since))
        until = fixed[0] if fixed is not None else begin if starts.lost is None else starts.lost[i]
        explained += max(0.0, min(until, end) - begin)
    room = 1 - 2.0**-30  # against the rounding of these sums
    return claimed / whole * room, explained / whole * room


def check_everywhere(c: Cells, scene: Scene) -> str:
    """Check that every start on the arm is in a cell, or near the joint and thrown outward; "" or what fails."""
    for i, edges in enumerate(c.edges):
        if Fraction(float(edges[-1])) < scene.arm[1]:
            return f"side {i}: the cells end before arm.length"
        edge = float(edges[0])
        near = over_halves(scene, check_thrown_out, i, edge)
        if near:
            return f"side {i}, near the joint, x in (a, {float(edges[0])!r}]: {near}"
    return ""


def check_thrown_out(scene: Scene, side: int, edge: float) -> str:
    """Check that starts up to the edge are thrown outward, by whatever factor; "" or what fails."""
    s = scene.sides[side]
    gain = -2 * s.h / (scene.k_hi - s.small_d)
    q = float((1 + gain * (1 - 2.0**-20)).lower())
    return check_near_joint(s, scene.k_lo, scene.k_hi, edge, q)


def check_oriented(c: Cells, scene: Scene, goal: dict[str, Any]) -> str:
    """Check that no attracting cell, or no target of any cell, of another side reaches beyond x; "" or what fails."""
    beyond = goal["x"].lo / LENGTHS[scene.unit]
    x = float(beyond)
    if Fraction(x) > beyond:
        x = math.nextafter(x, -math.inf)  # the largest float that is not above
    wrong = (c.side != goal["side"]) & (c.upper() > x)
    if not goal["anywhere"]:
        wrong &= c.component >= 0
        if goal["throws"] and wrong.any():
            return check_two_throws(c, scene, wrong, x)
        return first_bad(
            c, [(~wrong, f"an attracting cell of another side reaches beyond x = {float(beyond)!r}")]
        )
    for array, what in ((c.jog, "jog"), (c.flip, "flip")):
        q = np.flatnonzero(array[:, 0] >= 0)
        good = np.ones(len(wrong), dtype=bool)
        good[q] = range_max(wrong.astype(np.int64), array[q, 0], array[q, 1]) == 0
        bad = first_bad(c, [(good, f"a {what} may end beyond x = {float(beyond)!r} on another side")])
        if bad:
            return bad
    for i, edges in enumerate(c.edges):
        edge = float(edges[0])
        if i != goal["side"] and not near_landing(scene.sides[i], scene.k_lo, scene.k_hi, edge) <= x:
            return f"side {i}, near the joint: a throw may end beyond x = {float(beyond)!r}"
    return ""


# ----------------------------------------------------------------------- two throws with the same parameters

# A throw with the impact angle p begins at x = P(p), where f = 0, and jogs to P(p) + D(p): nothing is to be solved.
# Two throws are angles p and r with x'(p) + e = P(r), e the noise of the landing.  For weights v, w >= 0 and any u
#     x'' <= G = x'' + v m(p) + w m(r) + u (x' + e - P(r)),
# m signed so that it is not negative where the branch is taken.  G at a point, and its derivatives over a box around
# it, bound G there: where it rises or falls for sure only that end of the box counts.

P, R, E, KAPPA, HEIGHT, MORE = range(
    6
)  # the variables: two angles, where it lands, kappa, h, lengths of the part
ANGLE_PIECES, MOST_PAIRS = (
    12,
    20_000,
)  # pieces of each angle to begin with, and boxes, for one kind of two throws


def read_lengths(part: object, unit: Fraction) -> list[tuple[int, str, Arb]]:
    """List what is known of the lengths of the part that are intervals, in the order in which they are read."""
    found: dict[int, tuple[int, str, Arb]] = {}

    def look(value: object, where: str) -> Arb:
        lo, hi = ends_of(value, where, unit)
        if lo < hi and not where.endswith(".mass"):
            found.setdefault(id(value), (id(value), where, span(lo, hi)))
        return span(lo, hi)

    read_part(part, unit, look)
    return list(found.values())


def by_angle(scene: Scene, rest: Any, rho: Any, kappa: Any, h: Any, p: Any) -> tuple[Any, Any, Any]:
    """Compute P, R'(jog) and what decides (flip where it is positive), of a throw with the angle p."""
    a, d = rest[0], rest[1]
    s = scene.sides[0]
    ell2 = a**2 + d**2
    ell = ell2.sqrt()
    if s.exact:
        sin, cos = p.sin_cos()
        x = HALF * kappa * p + (a * sin - d * (ONE - cos)) / p
        jog = x - h * p + a * (ONE - cos) - d * (p - sin)
        X, H = a * cos - d * sin, a * sin + d * cos
        spin = rho**2 + X * (x - kappa * p) + H * (h + d)
        V = kappa * barrier(ell, X, H, signed=True)
    else:
        x = a + HALF * (kappa - d if "2" in scene.raw["model"]["flight"] else kappa) * p
        jog = x - h * p
        spin = rho**2 - a * x + 2 * a**2 + d**2 + d * h
        V = kappa * (a**2 / (ell + d)) - 2 * a * (x - a)
    turned = spin * abs(spin) if s.signed else spin * spin
    return x, jog, turned / (2 * (rho**2 + ell2)) - V


class Two(NamedTuple):
    """Two throws: the side they begin on, and their branches (0 jog, 1 flip)."""

    side: int
    first: int
    second: int


def two_throws(scene: Scene, kind: Two, lengths: list[int], v: list[Any]) -> list[Any]:
    """Compute x'', what decides in both throws, signed, and x' + e - P(r)."""
    known = dict(zip(lengths, v[MORE:], strict=True))
    unit = LENGTHS[scene.unit]

    def read(value: object, where: str) -> Any:
        return known.get(id(value), span(*ends_of(value, where, unit)))

    rests, rho = read_part(scene.raw["part"], unit, read)
    begin, then = rests[kind.side], rests[(kind.side + kind.first) % len(rests)]
    _, mid, m = by_angle(scene, begin, rho, v[KAPPA], v[HEIGHT], v[P])
    start, end, n = by_angle(scene, then, rho, v[KAPPA], v[HEIGHT], v[R])
    mid = mid - begin[3] if kind.first else mid
    end = end - then[3] if kind.second else end
    return [end, m if kind.first else -m, n if kind.second else -n, mid + v[E] - start]


def weigh(at: Array, slopes: Array) -> list[float]:
    """Propose weights in floats: a corner of least |...|, where three derivatives or weights are nothing."""
    lines = np.concatenate([slopes, [[0, 0], [1, 0], [0, 1], [0, 0]]], axis=1)
    three = np.array([t for t in itertools.combinations(range(lines.shape[1]), 3) if t[0] <= R])
    matrix = np.moveaxis(lines[1:, three], 0, 2)
    good = abs(np.linalg.det(matrix)) > 1e-300
    found = np.linalg.solve(matrix[good], -lines[0, three[good]][:, :, None])[:, :, 0]
    found = np.concatenate([[[0.0, 0.0, 0.0]], found[(found[:, :2] >= 0).all(axis=1)]])
    cost = at[0] + found @ at[1:] + abs(slopes[0] + found @ slopes[1:]).sum(axis=1)
    return [float(w) for w in found[int(np.nanargmin(cost))]]


def pair_stays(scene: Scene, kind: Two, lengths: list[int], box: list[Pair], x: Arb) -> int:
    """Prove a box of angles and parameters: -1, or the variable along which it is to be halved."""
    n = len(box)
    ends = [(arb(lo), arb(hi)) for lo, hi in box]
    middle = [arb(lo + (hi - lo) / 2) for lo, hi in box]
    rising = [
        Rising(lo.union(hi), [ONE if j == k else ZERO for j in range(n)]) for k, (lo, hi) in enumerate(ends)
    ]
    steep = [term.by for term in two_throws(scene, kind, lengths, rising)]
    centre = two_throws(scene, kind, lengths, middle)
    off = [lo.union(hi) - mid for (lo, hi), mid in zip(ends, middle, strict=True)]
    over = [
        c + sum((d * o for d, o in zip(by, off, strict=True)), ZERO)
        for c, by in zip(centre, steep, strict=True)
    ]
    landing = scene.sides[0].landing
    if over[0] + landing <= x or over[1] < 0 or over[2] < 0 or over[3] > 0 or over[3] < 0:
        return -1
    half = [float((hi - lo).mid()) / 2 for lo, hi in ends]
    floats = np.array([[float(d.mid()) * h for d, h in zip(by, half, strict=True)] for by in steep])
    at = np.array([float(c.mid()) for c in centre])
    if not (np.isfinite(floats).all() and np.isfinite(at).all()):
        return int(np.argmax(half))
    weights = [ONE, *(arb(w) for w in weigh(at, floats))]
    if not (weights[1] >= 0 and weights[2] >= 0):
        return int(np.argmax(half))
    slopes = [sum((w * by[k] for w, by in zip(weights, steep, strict=True)), ZERO) for k in range(n)]
    point = [
        hi if d >= 0 else lo if d <= 0 else mid for d, (lo, hi), mid in zip(slopes, ends, middle, strict=True)
    ]
    value = sum(
        (w * t for w, t in zip(weights, two_throws(scene, kind, lengths, point), strict=True)), landing
    )
    loose = [ZERO if d >= 0 or d <= 0 else abs(d) * abs(o) for d, o in zip(slopes, off, strict=True)]
    if value + sum(loose, ZERO) <= x:
        return -1
    sizes = [float(abs(d).upper()) if d.contains(0) else float(d.rad()) for d in slopes]
    return int(np.argmax([size * h for size, h in zip(sizes, half, strict=True)]))


def kinds_of_two(c: Cells, bad: Array) -> Iterator[tuple[Two, list[Pair]]]:
    """Two throws from attracting cells that may end in the bad ones, and the ranges of both angles."""
    inside = c.component >= 0
    ways = (c.jog, c.flip)
    for second, first in itertools.product((0, 1), (0, 1)):
        then = inside & (ways[second][:, 0] >= 0)
        q = np.flatnonzero(then)
        then[q] = range_max(bad.astype(np.int64), *ways[second][q].T) > 0
        begin = inside & (ways[first][:, 0] >= 0)
        q = np.flatnonzero(begin)
        begin[q] = range_max(then.astype(np.int64), *ways[first][q].T) > 0
        for side in range(len(c.edges)):
            own = np.flatnonzero(begin & (c.side == side))
            if len(own):
                next_side = (side + first) % len(c.edges)
                at = np.flatnonzero(then & (c.side == next_side))
                ranges = [(float(c.phi[some, 0].min()), float(c.phi[some, 1].max())) for some in (own, at)]
                yield Two(side, first, second), ranges


def check_two_throws(c: Cells, scene: Scene, bad: Array, x: float) -> str:
    """Check that second throws, parameters kept, end beyond x in no attracting cell called bad; "" or what fails."""
    names = scene.noise if isinstance(scene.noise, dict) else {}
    if set(names) - {"landing.x"}:
        return "with noise of the throw no two throws have the same parameters"
    unit = LENGTHS[scene.unit]
    known = read_lengths(scene.raw["part"], unit)
    h = quantity(scene.raw["arm"]["surface_height"], "length", "arm.surface_height")
    landing = scene.sides[0].landing
    balls = [(-landing).union(landing), scene.k_lo.union(scene.k_hi), span(h.lo / unit, h.hi / unit)]
    balls += [ball for _, _, ball in known]
    fixed = [(below(ball), above(ball)) for ball in balls]
    for kind, ranges in kinds_of_two(c, bad):
        cuts = [np.linspace(*ends, ANGLE_PIECES + 1).tolist() for ends in ranges]
        pairs = itertools.product(*(itertools.pairwise(each) for each in cuts))
        stack, looked = [[*pair, *fixed] for pair in pairs], 0
        while stack:
            box = stack.pop()
            looked += 1
            k = pair_stays(scene, kind, [one for one, _, _ in known], box, arb(x))
            if k < 0:
                continue
            lo, hi = box[k]
            cut = lo + (hi - lo) / 2
            if looked + len(stack) > MOST_PAIRS or not lo < cut < hi:
                return f"two throws with the same parameters may end beyond x = {x!r} on another side"
            stack += [[*box[:k], (lo, cut), *box[k + 1 :]], [*box[:k], (cut, hi), *box[k + 1 :]]]
    return ""


def near_angle(s: Side, k_lo: Arb, k_hi: Arb, edge: float) -> Arb:
    """Bound the impact angle of throws from (a, edge] by a sign of f, which rises with R; nan if it is not found."""
    x = arb(edge)
    bound = arb(float((2 * (x - s.a) / (k_hi - s.small_d)).upper()))
    for _ in range(20):
        if flight(x, k_lo, at_angle(s, bound)) < 0:
            return bound
        bound = bound * 1.25
    return arb("nan")


def near_landing(s: Side, k_lo: Arb, k_hi: Arb, edge: float) -> Arb:
    """Bound where throws from (a, edge] land: R' <= R - h phi + a phi^2/2."""
    bound = near_angle(s, k_lo, k_hi, edge)
    bound = root_above(s, arb(edge), k_lo, at_angle(s, bound)).p if bound.is_finite() else bound
    return arb(edge) + abs(s.h) * bound + HALF * s.a * bound**2 + s.landing


def arrive(c: Cells, ways: list[Array], cells: Array, wanted: Array, throws: int) -> Array:
    """Find the cells whose orbits are not proved to come to the wanted ones within so many throws.

    After k rounds every orbit from a cell that is done comes to a wanted one within k throws: all of its targets were
    done a round before.  A throw that is not one of the ways has arrived.
    """
    done = cells & wanted
    for _ in range(throws):
        left = np.flatnonzero(cells & ~done)
        undone = np.concatenate([[0], np.cumsum(~done)])
        good = np.ones(len(left), dtype=bool)
        for array in ways:
            first, last = array[left, 0], array[left, 1]
            good &= (first < 0) | (undone[last + 1] - undone[np.maximum(first, 0)] == 0)
        if not good.any():
            break
        done[left[good]] = True
    return cells & ~done


def check_reaches(c: Cells, scene: Scene, goal: dict[str, Any]) -> str:
    """Check that orbits come to rest at x or beyond on the side, every one or almost every one; "" or what fails."""
    least = goal["x"].lo / LENGTHS[scene.unit]
    x = float(least)
    if Fraction(x) < least:
        x = math.nextafter(x, math.inf)  # the smallest float that is not below
    wanted = (c.side == goal["side"]) & (c.lower() >= x)
    inside = c.component >= 0
    if goal["every"]:
        everything = np.ones(len(inside), dtype=bool)
        cells = everything if goal["anywhere"] else inside
        late = arrive(c, [c.jog, c.flip], cells, wanted, goal["throws"])
        return first_bad(c, [(~late, f"{goal['throws']} throws are not proved to be enough")])
    if goal["anywhere"] and goal["starts"] is None:
        bad = check_ranks(c, scene, int(c.rank.max())) or check_null(c, scene, ~inside, True)
        if bad:
            return bad
    return check_thinning(c, scene, inside & ~wanted, goal["throws"], np.zeros(len(inside), dtype=np.int32))


def check_null(c: Cells, scene: Scene, cells: Array, near: bool) -> str:
    """Check that on some cells starts of length zero come from starts of length zero only; "" or what fails.

    Where dR'/dR > 0 is proved on a cell each branch has an inverse with bounded slope.  Near the joint, where it is
    asked, phi rises with R, be it by jumps; where D' > 0 on all angles possible R' = R + D(phi) grows at least as fast
    as R.  Beyond the jog's fixed point that is proved already.
    """
    lower, upper = c.lower(), c.upper()
    rises = np.ones(len(c.side), dtype=bool)
    for k in np.flatnonzero(cells).tolist():
        s, x, phi = scene.sides[int(c.side[k])], (float(lower[k]), float(upper[k])), c.phi[k].tolist()
        told = s, scene.k_lo, scene.k_hi, x, (phi[0], phi[1])
        rises[k] = steepness(*told, 1) > 0 or steepness(*told) > 0
    for i, s in enumerate(scene.sides if near else ()):
        bound = near_angle(s, scene.k_lo, scene.k_hi, float(c.edges[i][0]))
        phi = ZERO.union(bound)
        if not (-s.h > 0 if not s.exact else s.a * phi.sin() - s.d * (1 - phi.cos()) - s.h > 0):
            return f"side {i}, near the joint: R' is not proved to rise with R"
    return first_bad(c, [(rises, "dR'/dR > 0 is not proved")])


def steepness(
    s: Side, k_lo: Arb, k_hi: Arb, x: tuple[float, float], phi: tuple[float, float], pieces: int = 8
) -> float:
    """Bound dR'/dR on a cell from below, piece by piece; 0 where df/dphi < 0, and so one root, is not proved."""
    low, high = at_angle(s, arb(phi[0])), at_angle(s, arb(phi[1]))
    cuts = [x[0] + (x[1] - x[0]) * k / pieces for k in range(pieces)] + [x[1]]
    least = math.inf
    for x0, x1 in itertools.pairwise(cuts):
        if not x0 < x1:
            continue
        to = root_above(s, arb(x1), k_lo, high)
        since = root_below(s, arb(x0), k_hi, low, to.p)
        both = since.p.union(to.p)
        _, rise, f_slope = over_angles(s, both, arb(x0).union(arb(x1)), k_lo.union(k_hi))
        told = slope_over(s, both, k_lo.union(k_hi), rise, f_slope)
        if told is None:
            return 0.0
        slope = float(told.lower())
        least = min(least, slope if slope > 0 else 0.0)
    return least


def check_thinning(c: Cells, scene: Scene, left: Array, throws: int, kind: Array) -> str:
    """Check that almost every orbit leaves some cells, or comes to some of another kind; "" or what fails.

    Spread starts evenly over the cells, and look at those that have not left them.  After a throw their density is, at
    y, the sum over all x thrown to y of the density at x over dR'/dR.  On neighbouring cells of a side where that slope
    is positive a jog rises and is continuous, and so is a flip: at most one x for each run of such cells and branch.
    The density is bounded by numbers, one for each cell; those at a target are at most the sum, over runs and branches,
    of the largest number over slope that leads to it.  This rises with the numbers and is proportional to them, so once
    all are below 1 they fall to 0 by repetition, and what never leaves has length zero.  Slopes are lower bounds, sums
    of floats are taken 2^-30 too large.  What comes to another kind has left: each kind has a round of its own.
    """
    steep = np.full(len(left), math.nan)
    lower, upper = c.lower(), c.upper()
    for k in np.flatnonzero(left).tolist():
        s, x, phi = scene.sides[int(c.side[k])], (float(lower[k]), float(upper[k])), c.phi[k].tolist()
        steep[k] = steepness(s, scene.k_lo, scene.k_hi, x, (phi[0], phi[1]))
    bad = first_bad(c, [(~left | (steep > 0), "dR'/dR > 0 is not proved")])
    if bad:
        return bad
    cells = np.flatnonzero(left)
    run = np.cumsum((np.diff(cells, prepend=-2) > 1) | (np.diff(c.side[cells], prepend=-1) != 0))
    froms, tos, groups = [], [], []
    for branch, array in enumerate((c.jog, c.flip)):
        q = np.flatnonzero(array[cells, 0] >= 0)
        first, last = array[cells[q], 0].astype(np.int64), array[cells[q], 1].astype(np.int64)
        if int((last - first + 1).sum()) > MOST_EDGES:
            return "there are too many targets"
        for step in range(int((last - first).max(initial=-1)) + 1):
            to = first + step
            some = (to <= last) & left[np.minimum(to, len(left) - 1)]
            some[some] &= kind[cells[q][some]] == kind[to[some]]
            froms.append(cells[q][some])
            tos.append(to[some])
            groups.append(2 * run[q][some] + branch)
    source, to, group = (np.concatenate([np.zeros(0, np.int64), *part]) for part in (froms, tos, groups))
    slots, slot = np.unique(to * (2 * len(cells) + 2) + group, return_inverse=True)
    owner = slots // (2 * len(cells) + 2)
    density: Array = left.astype(np.float64)
    names, number = np.unique(kind[cells], return_inverse=True)
    gone = np.zeros(len(names), dtype=bool)
    for _ in range(throws):
        most = np.zeros(len(slots))
        np.maximum.at(most, slot, density[source] / steep[source] * (1 + 2.0**-30))
        density = np.bincount(owner, most, minlength=len(left)).astype(np.float64) * (1 + 2.0**-30)
        worst = np.zeros(len(names))
        np.maximum.at(worst, number, density[cells])
        gone |= worst < 1
        if gone.all():
            return ""
        density[cells[gone[number]]] = 0.0  # no other kind hangs on it
        if not (density < 1e100).all():
            break
    return f"what has not arrived is not proved to thin out within {throws} throws"


def check_one_component(c: Cells) -> str:
    """Check that each attracting cell leads to every other through targets; "" or what fails."""
    inside = c.component >= 0
    start = np.zeros(len(inside), dtype=bool)
    start[np.argmax(inside)] = True
    ways = [(array, np.flatnonzero((array[:, 0] >= 0) & inside)) for array in (c.jog, c.flip)]
    forward, backward = start.copy(), start.copy()
    while True:
        before = int(forward.sum()) + int(backward.sum())
        count = np.concatenate([[0], np.cumsum(backward)])
        marks = np.zeros(len(inside) + 1, dtype=np.int64)
        for array, q in ways:
            own = q[forward[q]]
            np.add.at(marks, array[own, 0], 1)
            np.add.at(marks, array[own, 1] + 1, -1)
            backward[q] |= count[array[q, 1] + 1] > count[array[q, 0]]
        forward |= np.cumsum(marks[:-1]) > 0
        if int(forward.sum()) + int(backward.sum()) == before:
            break
    connected = ~inside | (forward & backward)
    return first_bad(c, [(connected, "an attracting cell is not of one component with the first")])


def extents(c: Cells) -> str:
    """List the attracting cells as intervals, for people."""
    parts = []
    for i, edges in enumerate(c.edges):
        own = np.concatenate([[False], c.component[c.start[i] : c.start[i + 1]] >= 0, [False]])
        ends = np.flatnonzero(np.diff(own.astype(np.int8)))
        spans = [
            f"[{shown(edges[a], up=False)}, {shown(edges[b], up=True)}]" for a, b in ends.reshape(-1, 2)[:6]
        ]
        more = " ..." if len(ends) > 12 else ""
        parts.append(f"side {i}: {' u '.join(spans) or 'none'}{more}")
    return "; ".join(parts)


def statement_of(name: str, section: dict[str, Any], noisy: bool) -> str:
    """Put a claim in words."""
    if name == "attracts-all":
        if None not in section["fixed"]:
            return fixed_points_in_words(section, noisy)
        return (
            f"attracts-all: every start a_i < x <= arm.length on every side i enters the attracting cells and stays in"
            f" them, within {section['max_rank']} throws where x is in the cells; nearer to the joint x - a_i grows by"
            f" a factor of at least {shown(min(section['q']), up=False)} with every throw"
        )
    if name == "goal":
        return statement_of_goal(section, noisy)
    if name == "expanding":
        least = section["least"]
        entropy = "" if noisy else f"; topological entropy >= ln({least!r}) >= {entropy_of(least)}"
        return f"expanding: |dR'/dR| >= {least!r} on the attracting cells{entropy}"
    if name == "end-points":
        return ends_statement(section, noisy)
    if name == "cycles":
        return orbits_statement(section)
    if name == "refuted":
        return statement_of_refutation(section)
    if name == "trapping":
        return "trapping: the attracting cells are mapped into their interior (relative to x <= arm.length)"
    return "invariant: no throw leaves the attracting cells, nor the component it starts in"


def entropy_of(least: float) -> str:
    """Write the logarithm, rounded down by more than its error."""
    return shown(math.log(least) * (1 - 2.0**-40), up=False, digits=6)


def check_box_claims(
    scene: Scene, c: Cells, box: int, claims: dict[str, dict[str, Any]], crew: Crew
) -> Iterator[tuple[list[str], str]]:
    """Check all claims for one box; yields the claims that fail, with the reason.

    Images are proved to lie strictly inside the union of their target cells (or at most at the arm's length), so
    that "invariant" already gives "trapping".
    """
    if "refuted" in claims:
        bad = check_refuted(scene, claims["refuted"])
        if bad:
            yield ["refuted"], bad
        claims = {name: section for name, section in claims.items() if name != "refuted"}
        if not claims:
            return
    everything = list(claims)
    first_version = claims.get("goal", {}).get("starts", "") is None
    bad = check_structure(c, scene, 0 if first_version else -1) or check_components(c)
    if bad:
        yield everything, bad
        return
    wide = []  # claims about throws from all cells
    some = []  # about throws from the cells that have a rank
    if "goal" in claims:
        goal = claims["goal"]
        bad = check_goal(c, scene, goal)
        if bad:
            yield ["goal"], bad
        elif (first_version and goal["all"]) or (goal["anywhere"] and goal["kind"] != "attracts_all"):
            wide += ["goal"]
        elif not first_version:
            some += ["goal"]
    if "attracts-all" in claims:
        bad = check_ranks(c, scene, claims["attracts-all"]["max_rank"])
        for i in range(len(scene.sides)):
            edge = float(c.edges[i][0])
            said = claims["attracts-all"]["fixed"][i]
            q = claims["attracts-all"]["q"][i]
            near = over_halves(scene, check_below_cells, i, edge, q, said)
            bad = bad or (f"side {i}, near the joint, x in (a, {edge!r}]: {near}" if near else "")
        wide += [] if bad else ["attracts-all"]
        if bad:
            yield ["attracts-all"], bad
    least = claims["expanding"]["least"] if "expanding" in claims else None
    inside = np.flatnonzero(c.component >= 0)
    found = crew.run(list(tasks_of(c, scene, box, inside, least)))
    if found is not None and found[1].kind == "slope":
        yield ["expanding"], f"{c.name(found[0])}: {found[1].text}"
        found = crew.run(list(tasks_of(c, scene, box, inside, None)))
    if found is not None:
        yield everything, f"{c.name(found[0])}: {found[1].text}"
        return
    yield from check_sets(scene, c, claims)
    for names, mask in ((wide + some, c.rank >= 0), (wide, c.rank < 0)):
        chosen = np.flatnonzero((c.component < 0) & mask)
        found = crew.run(list(tasks_of(c, scene, box, chosen, None))) if names else None
        if found is not None:
            yield names, f"{c.name(found[0])}: {found[1].text}"
            return


# --------------------------------------------------------------------------------------------------------- the report


def check_certificate(
    path: str | os.PathLike[str], workers: int, progress: Callable[[int, int], None] | None, report: Report
) -> None:
    """Fill in the report; raises BadFileError."""
    header, entries = open_certificate(path)
    needed = "format version map noise boxes claims arrays tolerance"
    table(header, "header.json", needed, "state producer")
    version = header["version"]
    right = header["format"] == "limitsets-proof" and type(version) is int and version in (1, 2)
    require(right, "the format is not limitsets-proof, version 1 or 2")
    the_map = table(header["map"], "map", "name version flight flip", "formulas")
    first = type(the_map["version"]) is int and the_map["version"] == 1
    require(the_map["name"] == "throw" and first, "the map is not throw, version 1")
    boxes = rows(header["boxes"], "boxes", 1, 5_000)
    prefixes = [table(b, "a box", "scene parameters prefix")["prefix"] for b in boxes]
    named = all(isinstance(p, str) and re.fullmatch(r"[0-9]{1,6}\.", p) for p in prefixes)
    require(named and len(set(prefixes)) == len(boxes), "the prefixes of the boxes are not as they should be")
    raw = [b["scene"] for b in boxes]
    scenes = [read_scene(scene, header["noise"]) for scene in raw]
    for scene in raw:
        model = (the_map["flight"], the_map["flip"])
        same = model == (scene["model"]["flight"], scene["model"]["flip"])
        require(same, "map and scene name different models")
    require(isinstance(header["arrays"], dict), "arrays is not an object")
    n_sides = len(scenes[0].sides)
    require(all(len(s.sides) == n_sides for s in scenes), "the boxes do not have the same number of sides")
    cells = [read_cells(entries, header["arrays"], prefix, n_sides) for prefix in prefixes]
    expected = {p + name for p in prefixes for name in ["jog", "flip", "branch", "rank", "component", "phi"]}
    expected |= {f"{p}edges.{i}" for p in prefixes for i in range(n_sides)}
    require(set(header["arrays"]) == expected, "the header describes arrays that do not belong there")
    named = set(entries) == {f"{name}.npy" for name in expected}
    require(named, "arrays.npz holds entries that do not belong there")
    claims, unknown = read_claims(header, n_sides, version)

    flight_of = the_map["flight"]
    kind = "exact" if flight_of == "exact" else "small"
    for key in ("always", flight_of, kind, f"{kind} {the_map['flip']}"):
        report.relied_on += [line for line in FORMULAS[key] if line not in report.relied_on]
    the_model = f"throw, version 1, flight {flight_of}, flip {the_map['flip']}"
    report.relied_on.insert(0, f"the formulas of the map {the_model}")
    report.relied_on.append(
        f"the ball arithmetic of python-flint {flint.__version__} (Arb), numpy and Python"
    )
    for name, value in quantities(raw[0]):
        report.parameters[plain(name)] = value_in_words(value, name)
    noise = header["noise"]
    covered, gap = check_tolerance(raw, header["tolerance"])
    report.parameters |= covered
    if header["tolerance"] is not None:
        report.parameters["tolerance (fixed but unknown)"] = deviations_in_words(header["tolerance"])
    report.parameters["noise (at every throw)"] = "none" if noise is None else deviations_in_words(noise)
    report.cells = sum(len(c.side) for c in cells)

    failed: dict[str, str] = {}
    if gap:
        failed = dict.fromkeys(claims, gap)
    if header["noise"] is not None and "cycles" in claims:
        failed["cycles"] = "the orbit of the one throw is not that of the other: not with noise"
    if not all(side.landing <= 0 for scene in scenes for side in scene.sides) and "end-points" in claims:
        failed["end-points"] = "the landing place moves at every throw: not with noise of it"
    own = goal_of_scene(raw[0], n_sides)
    for name in ("goal", "refuted"):
        goal = claims.get(name, {}).get("goal", claims[name]) if name in claims else None
        if own is not None and goal is not None and asked(goal) != asked(own):
            failed[name] = "the scene in this file has another goal of its own"
    everywhere = "attracts-all" in claims or claims.get("goal", {}).get("all", False)
    ranked = "goal" in claims and version > 1
    work = sum(
        len(c.side) if everywhere else int(((c.component >= 0) | (ranked & (c.rank >= 0))).sum())
        for c in cells
    )
    told = None if progress is None else (lambda done: progress(min(done, work), work))
    crew = Crew(raw, noise, workers, told)
    try:
        for k, (scene, c, b) in enumerate(zip(scenes, cells, boxes, strict=True)):
            bad = over_halves(scene, check_parameters, b["parameters"], f"box {k}")
            where = f"box {k}, " if len(boxes) > 1 else ""
            found = [(list(claims), bad)] if bad else check_box_claims(scene, c, k, claims, crew)
            for names, reason in found:
                for name in names:
                    failed.setdefault(name, where + reason)
            if version == 1 and not {"goal", "attracts-all"} & set(failed):
                first_version_starts(scene, c, claims)
            scene.parts.clear()  # room
            if len(failed) == len(claims):
                break
    finally:
        crew.close()
    report.boxes = crew.boxes
    if "goal" in claims and "goal" not in failed:
        if "attracts-all" in failed and not claims["goal"]["all"]:
            claims["goal"].pop("found", None)
        tell_starts(report, claims["goal"], scenes, cells)
    report.statement = [statement_of(name, section, noise is not None) for name, section in claims.items()]
    which = " (first box)" if len(cells) > 1 else ""
    if set(claims) - {"refuted"}:  # which does not speak of them: they are not checked for it
        report.statement.append(f"attracting cells: {extents(cells[0])}{which}")
    if own is not None and not {"goal", "refuted"} & set(claims):
        report.statement.append("of the scene's own goal nothing is claimed")
    for name in claims:
        state, why = ("failed", failed[name]) if name in failed else ("proved", "")
        if not why and name == "refuted":
            state = "refuted"
        if not why and name == "goal" and (report.starts == "cells" or (report.open or 0.0) > MOST_OPEN):
            state, why = "proved-on-cells", on_cells_in_words(report)
        report.claims.append((name, state, why))
    report.claims += unknown
    states = [state for _, state, _ in report.claims]
    worst = ("failed", "not rechecked", "refuted", "proved-on-cells")
    report.verdict = next((word for word in worst if word in states), "proved")
    report.verdict = "failed" if report.verdict == "not rechecked" else report.verdict
    report.reason = next((f"{name}: {why}" for name, state, why in report.claims if why), "")


MOST_OPEN = 0.01  # of the arm may be open where a goal is proved from some x on


def first_version_starts(scene: Scene, c: Cells, claims: dict[str, dict[str, Any]]) -> None:
    """Find for which starts a goal of version 1 is proved: "attracts-all" in the same file brings them to the cells."""
    goal, attracts = claims.get("goal"), claims.get("attracts-all")
    if goal is None or goal.get("found") == ATTRACTING:
        return
    almost = goal["kind"] == "reaches" and not goal["every"]
    every = Starts("almost-every" if almost else "every")
    found = every if goal["all"] else ATTRACTING
    if attracts is not None and not goal["all"]:
        fixed = attracts["fixed"]
        found = every._replace(near=(attracts["q"], fixed))
        if None not in fixed:
            found = found._replace(kind="from", x=[point[1] for point in fixed])
        if almost and check_null(c, scene, c.component < 0, not any(fixed)):
            found = ATTRACTING
    goal["found"] = found


def tell_starts(report: Report, goal: dict[str, Any], scenes: list[Scene], cells: list[Cells]) -> None:
    """Fill in for which starts the goal is proved, and how much of the arm they are: the least of all boxes."""
    goal["starts"] = starts = goal["starts"] or goal.get("found") or ATTRACTING
    both = []
    for scene, c in zip(scenes, cells, strict=True):
        some = c.component >= 0 if starts.only else c.rank >= 0
        both.append(shares(c, scene, starts, some))
    beyond = None if starts.x is None else {str(i): x for i, x in enumerate(starts.x)}
    report.starts = starts.kind if beyond is None else {"from": beyond}
    report.share, report.explained = (math.floor(min(each) * 1e6) / 1e6 for each in zip(*both, strict=True))
    report.open = math.ceil((1 - min(claimed + known for claimed, known in both)) * 1e6) / 1e6


def on_cells_in_words(report: Report) -> str:
    """Say for which starts a goal is proved that is not proved for all it might be."""
    which = "in the cells" if report.starts == "cells" else "from some x on"
    return f"proved for starts {which} only, {100 * (report.share or 0.0):.4g} % of the arm or more: the rest is open"


def value_in_words(value: object, name: str) -> str:
    """Write what a scene says, from the numbers that were read."""
    if isinstance(value, str | list):
        return str(quantity(value, KINDS, name))
    return plain(value)


def deviations_in_words(deviations: object) -> str:
    """Write noise or a tolerance, from the numbers that were read."""
    known = table(deviations, "deviations", "", " ".join(deviations) if isinstance(deviations, dict) else "")
    return ", ".join(f"{plain(name)} within {quantity(text, KINDS, name)}" for name, text in known.items())


def recheck(
    path: str | os.PathLike[str],
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Report:
    """Check the certificate in a file.

    Parameters
    ----------
    path
        The file.
    workers
        Number of processes; all processors of this process if None.  Small certificates are checked in this one.
    progress
        Called now and then with the number of cells done and the number of all.
    """
    begun = time.perf_counter()
    report = Report()
    if workers is None:
        workers = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    before = flint.ctx.prec
    flint.ctx.prec = PRECISION
    try:
        check_certificate(path, workers, progress, report)
    except BadFileError as error:
        report = Report(verdict="bad file", reason=str(error))
    finally:
        flint.ctx.prec = before
    report.seconds = time.perf_counter() - begun
    return report


def show(report: Report, file: str) -> None:
    """Print a report for people."""
    print(f"certificate: {plain(file, 200)}")
    for title, lines in (
        ("claimed", report.statement),
        ("for", [f"{name} = {value}" for name, value in report.parameters.items()]),
        ("relying on", report.relied_on),
    ):
        if lines:
            print("\n  ".join([f"{title}:", *lines]))
    for name, state, why in report.claims:
        print(f"{name}: {WORDS[state]}" + (f" - {why}" if why else ""))
    print(f"{report.cells} cells, {report.seconds:.1f} s")
    print(WORDS[report.verdict] + (f": {report.reason}" if report.reason else ""))


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="Check a proof certificate of a throw-and-catch feeder.")
    parser.add_argument("file", help="the certificate, NAME.proof.zip")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--workers", type=int, metavar="N", help="processes (default: all processors)")
    options = parser.parse_args()
    begun = last = time.monotonic()

    def bar(done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if now - begun > 2 and (now - last > 0.2 or done == total):
            last = now
            full = 40 * done // max(total, 1)
            text = f"\r[{'#' * full}{'.' * (40 - full)}] {done}/{total} cells"
            print(text, end="", file=sys.stderr, flush=True)
            if done == total:
                print(file=sys.stderr)

    try:
        report = recheck(options.file, options.workers, bar)
    except KeyboardInterrupt:
        print("\ninterrupted", file=sys.stderr)
        return 130
    if options.json:
        print(json.dumps(asdict(report), allow_nan=False))
    else:
        show(report, options.file)
    return EXITS[report.verdict]


if __name__ == "__main__":
    sys.exit(main())
