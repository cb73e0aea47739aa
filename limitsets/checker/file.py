"""The file: a zip of a header and arrays.  docs/certificates.md, "The file".

Sizes, depths and hashes are checked before anything is believed, and nothing is unpickled or evaluated.
"""

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
from pathlib import Path
from typing import Any

import numpy as np

from .balls import Array
from .texts import BadFileError, plain, require


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


@dataclass
class Cells:
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


def read_cells(entries: dict[str, memoryview], said: dict[str, Any], prefix: str, sides: int) -> Cells:
    """Read the arrays of one box, and check that their lengths fit each other."""

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
