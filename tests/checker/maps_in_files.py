"""A second writer of certificates of maps, in plain floats and apart from the package: it proves nothing.

Formulas are functions of numpy, which run on arrays and on numbers that record.  Targets are the hull of sampled
images, widened; the checker has to find everything right by itself.
"""

import copy
import hashlib
import io
import itertools
import json
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from limitsets.checker import Report, recheck

WORDS = {
    "subtract": "sub",
    "multiply": "mul",
    "divide": "div",
    "negative": "neg",
    "absolute": "abs",
    "arctan2": "atan2",
}
WORDS |= {"minimum": "min", "maximum": "max"}


class Recorded(np.lib.mixins.NDArrayOperatorsMixin):
    """A number that records what numpy does with it, each operation once."""

    def __init__(self, tape, *operation):
        self.tape, self.index = tape, tape.setdefault(operation, len(tape))

    def __array_ufunc__(self, ufunc, method, *inputs):
        word = WORDS.get(ufunc.__name__, ufunc.__name__)
        if word == "power":
            return Recorded(self.tape, "pow", inputs[0].index, inputs[1])
        return Recorded(self.tape, word, *(lifted(self.tape, value) for value in inputs))


def lifted(tape, value):
    return value.index if isinstance(value, Recorded) else Recorded(tape, "c", written(value)).index


def written(value):
    """A number as its shortest decimal, whole ones without a point."""
    return str(int(value)) if value == int(value) and abs(value) < 2**53 else repr(float(value))


def recorded(function, dimension, names, *after):
    """The operations and results of function(x, p, *after)."""
    tape = {}
    x = [Recorded(tape, "x", axis) for axis in range(dimension)]
    p = SimpleNamespace(**{name: Recorded(tape, "p", name) for name in names})
    values = function(x, p, *after)
    out = [lifted(tape, value) for value in (values if isinstance(values, tuple) else (values,))]
    return {"ops": [list(operation) for operation in tape], "out": out}


class Example:
    """A map for tests: image(x, p, side, branch) and margin(x, p, side), both of lists of arrays."""

    def __init__(self, dimension, names, image, margin=None, *, sides=1, to=lambda side, branch: side):
        self.dimension, self.names, self.image, self.margin = dimension, names.split(), image, margin
        self.sides, self.branches, self.to = sides, 1 + (margin is not None), to

    def header(self):
        keys = list(itertools.product(range(self.sides), range(self.branches)))
        programs = [
            {
                "side": s,
                "branch": b,
                "to": self.to(s, b),
                **recorded(self.image, self.dimension, self.names, s, b),
            }
            for s, b in keys
        ]
        margins = [
            {"side": s, **recorded(self.margin, self.dimension, self.names, s)}
            for s in range(self.sides)
            if self.margin
        ]
        return {
            "dimension": self.dimension, "sides": self.sides, "branches": self.branches, "parameters": self.names,
            "programs": programs, "margins": margins, "periodic": [[None] * self.dimension] * self.sides,
        }  # fmt: skip


def uniform(*axes, cells):
    """Edges of one side: (lo, hi) along each axis."""
    return [[np.linspace(lo, hi, cells + 1) for lo, hi in axes]]


def ends_of(edges):
    """The boxes of all cells of a side: lower and upper ends (n, d)."""
    lower = np.meshgrid(*(e[:-1] for e in edges), indexing="ij")
    upper = np.meshgrid(*(e[1:] for e in edges), indexing="ij")
    return np.stack([v.ravel() for v in lower], 1), np.stack([v.ravel() for v in upper], 1)


def samples(lo, hi, count):
    """Points of each box on a lattice (samples, n, d)."""
    for at in itertools.product(np.linspace(0, 1, count), repeat=lo.shape[1]):
        yield lo + (hi - lo) * np.array(at)


def targets(example, edges, parameters, count=5, slack=0.02):
    """By branch the targets of all cells, and the cells whose image leaves the domain."""
    corners = [
        SimpleNamespace(**dict(zip(parameters, at, strict=True)))
        for at in itertools.product(*parameters.values())
    ]
    start = np.concatenate([[0], np.cumsum([np.prod([len(e) - 1 for e in axes]) for axes in edges])])
    d = example.dimension
    target = [np.full((start[-1], 2 * d), -2, np.int32) for _ in range(example.branches)]
    lost = np.zeros(start[-1], bool)
    for side, branch in itertools.product(range(example.sides), range(example.branches)):
        lo, hi = ends_of(edges[side])
        places = [(x.T, p) for x in samples(lo, hi, count) for p in corners]
        images = np.array(
            [np.broadcast_arrays(*np.atleast_2d(example.image(x, p, side, branch))) for x, p in places]
        )
        low, high = images.min(0).T, images.max(0).T
        wide = slack * (high - low) + 1e-9
        to = edges[example.to(side, branch)]
        first = np.stack(
            [np.searchsorted(e, v, "right") - 1 for e, v in zip(to, (low - wide).T, strict=True)], 1
        )
        last = np.stack(
            [np.searchsorted(e, v, "left") - 1 for e, v in zip(to, (high + wide).T, strict=True)], 1
        )
        met = np.ones(len(lo), bool)
        if example.margin:
            margins = np.array([np.broadcast_to(example.margin(x, p, side), len(lo)) for x, p in places])
            met = margins.max(0) > 0 if branch else margins.min(0) <= 0
        inside = ((first >= 0) & (last < [len(e) - 1 for e in to])).all(1)
        cells = np.arange(start[side], start[side + 1])
        target[branch][cells[met & inside]] = np.hstack([first, last])[met & inside]
        lost[cells[met & ~inside]] = True
    return target, lost, start


def links(example, edges, target, start):
    """Each cell with each of its target cells."""
    rows, columns = [], []
    for branch, side in itertools.product(range(example.branches), range(example.sides)):
        to = example.to(side, branch)
        shape = [len(e) - 1 for e in edges[to]]
        numbers = start[to] + np.arange(np.prod(shape)).reshape(shape)
        for cell in range(start[side], start[side + 1]):
            box = target[branch][cell]
            if box[0] >= 0:
                d = len(shape)
                own = numbers[tuple(slice(box[a], box[d + a] + 1) for a in range(d))].ravel()
                rows.append(np.full(len(own), cell))
                columns.append(own)
    return np.concatenate(rows), np.concatenate(columns)


def arrays_of(example, edges, parameters, final=None, whole=False, **how):
    """The arrays of a box of parameters; `final`: cells near a cycle, which get component 0.

    Attracting cells are the strong components that nothing leaves; with `whole` all that recurrent cells lead to.
    """
    target, lost, start = targets(example, edges, parameters, **how)
    n = start[-1]
    final = np.zeros(n, bool) if final is None else final
    row, column = links(example, edges, target, start)
    use = ~final[row]
    row, column = row[use], column[use]
    _, label = connected_components(
        csr_array((np.ones(len(row)), (row, column)), (n, n)), connection="strong"
    )
    leaves = np.bincount(label, minlength=n) * 0
    np.add.at(leaves, label[row], label[row] != label[column])
    np.add.at(leaves, label[lost & ~final], 1)
    recurs = np.zeros(len(leaves), bool)
    recurs[label[row][label[row] == label[column]]] = True
    attracting = (recurs & (leaves == 0))[label] & ~final
    if whole:
        attracting = recurs[label]
        for _ in range(n):
            after = attracting.copy()
            after[column[attracting[row]]] = True
            if (after == attracting).all():
                break
            attracting = after
        label = np.zeros(n, int)
    component = np.full(n, -1, np.int32)
    component[attracting] = (
        1 + np.unique(label[attracting], return_inverse=True)[1] if attracting.any() else 0
    )
    component[final] = 0
    rank = np.full(n, -1, np.int32)
    rank[attracting | final] = 0
    degree = np.bincount(row, minlength=n)
    for k in itertools.count(1):
        ready = (np.bincount(row, rank[column] >= 0, n) == degree) & (rank < 0) & ~lost & (degree > 0)
        if not ready.any():
            break
        rank[ready] = k
    grid = {f"edges.{s}.{a}": e for s, axes in enumerate(edges) for a, e in enumerate(axes)}
    return grid | {f"target.{b}": t for b, t in enumerate(target)} | {"rank": rank, "component": component}


def hexed(value):
    """Floats, and lists of them, in hexadecimal."""
    return (
        [hexed(one) for one in value] if isinstance(value, (list, tuple, np.ndarray)) else float(value).hex()
    )


def region(*box, side=0):
    return {"side": side, "box": hexed(box)}


def cycle(points, *, width=1e-9, branches=None, sides=None, frames=None, radius=None, attracts=None):
    """A cycle of a section, from its points in floats."""
    points = np.asarray(points, float).reshape(len(points), -1)
    boxes = [[(float(v) - width, float(v) + width) for v in point] for point in points]
    return {
        "boxes": hexed(boxes), "side": list(sides or [0] * len(boxes)), "branch": list(branches or [0] * len(boxes)),
        "attracts": frames is not None if attracts is None else attracts,
        "frames": None if frames is None else hexed(frames), "radius": None if radius is None else hexed(radius),
    }  # fmt: skip


def frames_of(slopes):
    """Frames in which a cycle with these matrices of derivatives contracts: eigenvectors, carried along the cycle."""
    one = np.eye(len(slopes[0]))
    values, vectors = np.linalg.eig(np.linalg.multi_dot([one, *slopes[::-1], one]))
    frames = [
        np.column_stack([v.imag if w.imag < 0 else v.real for w, v in zip(values, vectors.T, strict=True)])
    ]
    for a in slopes[:-1]:
        after = a @ frames[-1]
        frames.append(after / max(np.linalg.norm(after, 2), 1e-300))
    return frames if all(np.linalg.cond(s) < 1e6 for s in frames) else lyapunov_frames(slopes)


def lyapunov_frames(slopes):
    """Frames by Lyapunov's equation, where eigenvectors are nearly parallel or a slope is 0."""
    one = np.eye(len(slopes[0]))
    p = [one] * len(slopes)
    for k in [*reversed(range(len(p)))] * 60:
        p[k] = one + slopes[k].T @ p[(k + 1) % len(p)] @ slopes[k]
    return [np.linalg.inv(np.linalg.cholesky(q).T) for q in p]


class MapCertificate:
    """A certificate in memory, to be forged: `header` and `arrays` may be changed before it is written."""

    def __init__(self, example, boxes, goal=None):
        """`boxes`: (parameters, claims, arrays) for each box of parameters."""
        rows = [
            {
                "parameters": p,
                "prefix": f"{k}.",
                "claims": [{"claim": c, "section": s} for c, s in claims.items()],
            }
            for k, (p, claims, _) in enumerate(boxes)
        ]
        self.arrays = {f"{k}.{name}": v for k, one in enumerate(boxes) for name, v in (one[2] or {}).items()}
        header = {
            "format": "limitsets-proof",
            "version": 3,
            "map": example.header(),
            "boxes": rows,
            "goal": goal,
        }
        self.header = copy.deepcopy(header | {"plane": None, "producer": {"limitsets": "tests"}})

    def copy(self):
        return copy.deepcopy(self)

    def claims(self, box=0):
        return {claim["claim"]: claim["section"] for claim in self.header["boxes"][box]["claims"]}

    def claim(self, name, box=0, **section):
        self.header["boxes"][box]["claims"].append({"claim": name, "section": section})
        return self

    def write(self, path: Path) -> Path:
        """Write with fresh hashes."""
        arrays = {name: np.ascontiguousarray(v) for name, v in self.arrays.items()}
        said = {
            name: {
                "sha256": hashlib.sha256(v.tobytes()).hexdigest(),
                "dtype": v.dtype.str,
                "shape": list(v.shape),
            }
            for name, v in arrays.items()
        }
        packed = io.BytesIO()
        np.savez(packed, **arrays)
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("header.json", json.dumps({"arrays": said} | self.header))
            file.writestr("arrays.npz", packed.getvalue())
        return path

    def recheck(self, folder: Path) -> Report:
        return recheck(self.write(folder / "map.proof.zip"), workers=1)


def denied(certificate, folder, why=""):
    """What is not proved is denied, for a reason that holds some words."""
    report = certificate.recheck(folder)
    assert (report.verdict, why in report.reason) == ("failed", True), report


def refused(certificate, folder):
    """What cannot be read is refused, for some reason."""
    report = certificate.recheck(folder)
    assert (report.verdict, report.reason != "") == ("bad file", True), report
