"""A small producer of certificates for tests, in plain floats and apart from the package and from the checker.

It proves nothing: the checker has to find every bracket, decision and image right.  Cells are graded, the images are
those of the corners of a cell with a margin, the attracting cells are the last component of the graph.
"""

import copy
import hashlib
import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import networkx as nx
import numpy as np

SLACK = 2.0**-34
EXACT, SMALL = ("exact", "signed"), ("small-angle", "energy")
MODELS = {  # flight, flip, along, above, kappa, height, arm
    "designed": (*EXACT, "4.2255778 in", "0.7082490 in", "25.3778518 in", "-0.2 in", "28 in"),
    "above": (*EXACT, "4.2255778 in", "0.7082490 in", "25.3778518 in", "0.1 in", "28 in"),
    "energy": ("exact", "energy", "4.2255778 in", "0.7082490 in", "25.3778518 in", "-0.2 in", "28 in"),
    "initial": (*EXACT, "3.9867006 in", "1.8835981 in", "33.3605945 in", "-0.2 in", "28 in"),
    "initial-small": (*SMALL, "3.2444722 in", "1.7898493 in", "85.2549144 in", "-1.0 in", "40 in"),
    "small": (*SMALL, "4.4179581 in", "0.5040259 in", "48.6228609 in", "-1.0 in", "40 in"),
}
LENGTHS = (5.75, 3.6, 6.75)


def scene(model: str) -> dict:
    flight, flip, along, above, kappa, height, arm = MODELS[model]
    center = {"side": 2, "along": along, "above": above}
    mass = {"center": center, "radius_of_gyration": "1.25 in"}
    return {
        "name": f"forged-{model}",
        "part": {"sides": ["5.75 in", "3.6 in", "6.75 in"], "mass": mass},
        "arm": {"surface_height": height, "length": arm},
        "throw": {"kappa": kappa},
        "model": {"flight": flight, "flip": flip},
    }


def magnitude(text: str) -> float:
    """Drop the unit."""
    return float(text.split()[0])


def box(lo: float, hi: float | None = None) -> list[str]:
    """Widen by more than the error of plain floats, in the certificate's spelling."""
    hi = lo if hi is None else hi
    return [float(v).hex() for v in (lo - 1e-12 * (1 + abs(lo)), hi + 1e-12 * (1 + abs(lo)))]


class Plain:
    """The throw in numpy floats."""

    def __init__(self, data: dict, noise: float = 0.0):
        center = data["part"]["mass"]["center"]
        self.h, self.arm = magnitude(data["arm"]["surface_height"]), magnitude(data["arm"]["length"])
        self.kappa = magnitude(data["throw"]["kappa"])
        self.k_lo, self.k_hi = self.kappa / (1 + noise) ** 2, self.kappa / (1 - noise) ** 2
        self.rho = magnitude(data["part"]["mass"]["radius_of_gyration"])
        self.exact = data["model"]["flight"] == "exact"
        self.signed = data["model"]["flip"] == "signed"
        # The triangle on side 2: (0, 0), (L2, 0) and the apex, which is the left vertex of side 0.
        low, left, right = LENGTHS[2], LENGTHS[0], LENGTHS[1]
        x = (low**2 + left**2 - right**2) / (2 * low)
        apex = np.array([x, np.sqrt(left**2 - x**2)])
        zero, far = np.zeros(2), np.array([low, 0.0])
        com = np.array([magnitude(center["along"]), magnitude(center["above"])])
        self.a, self.d = np.empty(3), np.empty(3)
        for side, (start, end) in {2: (zero, far), 0: (apex, zero), 1: (far, apex)}.items():
            e = (end - start) / np.linalg.norm(end - start)
            self.a[side] = (com - start) @ e
            self.d[side] = e[0] * (com - start)[1] - e[1] * (com - start)[0]
        self.L = np.array(LENGTHS)
        self.ell = np.hypot(self.a, self.d)

    def phi(self, i: int, R: np.ndarray, kappa: float) -> np.ndarray:
        a, d = self.a[i], self.d[i]
        if not self.exact:
            return 2 * (R - a) / kappa
        p = (R + np.sqrt(R**2 + 2 * kappa * (d + self.ell[i]))) / kappa
        for _ in range(25):
            f = R * p - a * np.sin(p) + d * (1 - np.cos(p)) - kappa / 2 * p**2
            p = p - f / (R - a * np.cos(p) + d * np.sin(p) - kappa * p)
        return p

    def decision(self, i: int, R: np.ndarray, kappa: float) -> np.ndarray:
        """F*, positive where the part flips."""
        a, d, h = self.a[i], self.d[i], self.h
        M = self.rho**2 + self.ell[i] ** 2
        if not self.exact:
            om = (self.rho**2 - a * R + 2 * a**2 + d**2 + d * h) / M
            return (
                0.5 * M * om * (np.abs(om) if self.signed else om)
                - kappa * (self.ell[i] - d)
                + 2 * a * (R - a)
            )
        p = self.phi(i, R, kappa)
        X, H = a * np.cos(p) - d * np.sin(p), a * np.sin(p) + d * np.cos(p)
        om = (self.rho**2 + X * (R - kappa * p) + H * (h + d)) / M
        K, V = 0.5 * M * om**2, kappa * (self.ell[i] - H)
        if self.signed:
            return np.sign(om) * K - np.sign(X) * V
        return np.where(X < 0, K + V, K - V)

    def jog(self, i: int, R: np.ndarray, kappa: float) -> np.ndarray:
        p = self.phi(i, R, kappa)
        turn = self.a[i] * (1 - np.cos(p)) - self.d[i] * (p - np.sin(p)) if self.exact else 0.0
        return R - self.h * p + turn

    def flip(self, i: int, R: np.ndarray, kappa: float) -> np.ndarray:
        j = (i + 1) % 3
        return self.jog(i, R, kappa) - self.a[i] - (self.L[j] - self.a[j])

    def slope(self, i: int, R: np.ndarray, kappa: float) -> np.ndarray:
        return (self.jog(i, R * (1 + 1e-6), kappa) - self.jog(i, R * (1 - 1e-6), kappa)) / (2e-6 * R)

    def fixed_point(self, i: int) -> float:
        """Where a jog moves the part neither in nor out, for h > 0, by bisection."""
        lo, hi = self.a[i] * (1 + 1e-6), self.a[i] + 4 * self.h * self.kappa / self.a[i]
        for _ in range(100):
            mid = np.array([0.5 * (lo + hi)])
            lo, hi = (mid[0], hi) if self.jog(i, mid, self.kappa)[0] < mid[0] else (lo, mid[0])
        return float(hi)


class Forged:
    """A header and arrays that can be spoiled before they are written."""

    def __init__(self, header: dict, arrays: dict[str, np.ndarray]):
        self.header, self.arrays = header, arrays

    def copy(self) -> "Forged":
        return Forged(copy.deepcopy(self.header), {name: array.copy() for name, array in self.arrays.items()})

    def seal(self) -> "Forged":
        """Describe the arrays anew, as a forger would."""
        self.header["arrays"] = {}
        for name, array in self.arrays.items():
            digest = hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()
            about = {"sha256": digest, "dtype": array.dtype.str, "shape": list(array.shape)}
            self.header["arrays"][name] = about
        return self

    def bytes(self, method: int = zipfile.ZIP_STORED) -> bytes:
        inner, outer = io.BytesIO(), io.BytesIO()
        np.savez(inner, **self.arrays)
        with zipfile.ZipFile(outer, "w", method) as file:
            file.writestr("header.json", json.dumps(self.header))
            file.writestr("arrays.npz", inner.getvalue())
        return outer.getvalue()

    def write(self, path: Path) -> Path:
        path.write_bytes(self.bytes())
        return path


def alone(raw: dict, claim: str, section: dict, **more: object) -> dict:
    """The header of a claim that needs no boxes."""
    of_scenes = {"format": "limitsets-proof", "version": 3, "scene": dict(raw["model"])}
    header = of_scenes | {"noise": None, "tolerance": None}
    return header | {"boxes": [], "claims": [{"claim": claim, "section": section}]} | more


def of_version_2(f: Forged) -> Forged:
    """The same certificate as version 2 has it: the model in `map`, beside two texts for people."""
    old = f.copy()
    of_map = {"name": "throw", "version": 1, **old.header.pop("scene"), "formulas": ["jog: R' = R - h phi"]}
    old.header |= {"version": 2, "map": of_map, "state": "x [in]: centre of mass along the arm"}
    return old


def opened(path: Path) -> Forged:
    """A certificate that can be spoiled and sealed again."""
    with zipfile.ZipFile(path) as file, np.load(io.BytesIO(file.read("arrays.npz"))) as arrays:
        return Forged(json.loads(file.read("header.json")), dict(arrays))


def spoiled(path: Path, change: Callable[[Forged], object], to: Path) -> Path:
    """A certificate that is changed, and sealed again as another file."""
    forged = opened(path)
    change(forged)
    return forged.seal().write(to)


def _place(header: dict, path: tuple) -> tuple:
    *words, last = path
    for word in words:
        header = header[word]
    return header, last


def put(*path_and_value: object) -> Callable[[Forged], None]:
    """A change of a header: an entry, its path and its value."""
    *path, value = path_and_value

    def change(f: Forged) -> None:
        table, last = _place(f.header, tuple(path))
        table[last] = value

    return change


def leave_out(*path: object) -> Callable[[Forged], None]:
    """A change of a header: an entry less."""

    def change(f: Forged) -> None:
        table, last = _place(f.header, path)
        del table[last]

    return change


def rewritten(path: Path, target: Path, change: Callable[[dict], None]) -> Path:
    """The same certificate with another header."""
    return spoiled(path, lambda f: change(f.header), target)


def with_section(path: Path, target: Path, change: Callable[[dict], None]) -> Path:
    """The same certificate with another section of its first claim."""
    return rewritten(path, target, lambda header: change(header["claims"][0]["section"]))


def graded(start: float, end: float, first: float, ratio: float, widest: float) -> np.ndarray:
    edges = [start + first]
    while edges[-1] < end:
        edges.append(edges[-1] + min(ratio * (edges[-1] - start), widest))
    edges[-1] = end
    if edges[-1] - edges[-2] < 0.3 * (edges[-2] - edges[-3]):
        del edges[-2]
    return np.array(edges)


def sampled(m: Plain, i: int, x0: float, x1: float) -> tuple[int, dict[int, tuple[float, float]]]:
    """The decision in a cell with noise, and the images of the parts where the part jogs and flips, by samples."""
    x = np.linspace(x0, x1, 31)
    kappas = np.linspace(m.k_lo, m.k_hi, 31)
    F = np.array([m.decision(i, x, k) for k in kappas])
    spare = 0.02 * (F.max() - F.min())
    images = {}
    for branch, image, mask in ((0, m.jog, spare >= F), (1, m.flip, -spare <= F)):
        values = np.array([image(i, x, k) for k in kappas])
        if mask.any():
            steps = np.abs(np.diff(values, axis=0)).max() + np.abs(np.diff(values, axis=1)).max()
            images[branch] = float(values[mask].min() - steps), float(values[mask].max() + steps)
    return (2 if len(images) == 2 else next(iter(images))), images


def near_joint(m: Plain, i: int, begin: float, edge: float) -> dict:
    """What is said of starts before the first cell; for h > 0 begin is the fixed point of the jog."""
    if m.h < 0:
        return {"q": float(1 + 2 * abs(m.h) / m.k_hi * (1 - 1e-9)).hex()}
    least = m.slope(i, np.linspace(begin, edge, 9), m.kappa).min()
    return {
        "q": float(1 + 0.98 * (least - 1)).hex(),
        "fixed_point": [float(begin - 1e-9).hex(), float(begin + 1e-9).hex()],
    }


def starts_of(m: Plain, edges: list, rank: np.ndarray, near: dict, landing: float) -> dict:
    """For which starts a goal is claimed: every one; beyond the fixed points; or from where landings do not matter."""
    near = copy.deepcopy(near)
    if not landing:
        if m.h < 0:
            return {"starts": "every", "near_joint": near}
        return {
            "starts": {"from": {i: each["fixed_point"][1] for i, each in near.items()}},
            "near_joint": near,
        }
    begins, lost, at = {}, {}, 0
    for i, own in enumerate(edges):
        unclaimed = np.flatnonzero(rank[at : at + len(own) - 1] < 0)
        begins[str(i)] = float(own[unclaimed[-1] + 1] if len(unclaimed) else own[0]).hex()
        at += len(own) - 1
        x = np.linspace(m.a[i] + 1e-6, m.a[i] + 2, 4001)
        lost[str(i)] = float(x[np.argmax(m.jog(i, x, m.k_hi) - x > 0.999 * landing)]).hex()
    return {"starts": {"from": begins}, "lost": lost}


def forge(
    model: str,
    *,
    noise: float = 0.0,
    landing: float = 0.0,
    first: float = 0.02,
    ratio: float = 0.012,
    widest: float = 0.04,
) -> Forged:
    """A certificate with all claims that are known; noise is a share of the speed, landing of the landing place.

    With scattered landings some cells lead off the arm: of them, and of those that lead there, nothing is claimed.
    """
    data = scene(model)
    m = Plain(data, noise)
    begin = [m.fixed_point(i) if m.h > 0 else m.a[i] for i in range(3)]
    edges = [graded(begin[i], m.arm, first, ratio, widest) for i in range(3)]
    starts = np.concatenate([[0], np.cumsum([len(e) - 1 for e in edges])])
    n = int(starts[-1])
    jog, flip = np.full((n, 2), -1, np.int32), np.full((n, 2), -1, np.int32)
    branch, phi = np.empty(n, np.int8), np.empty((n, 2))
    leaving: set[int] = set()
    for i in range(3):
        x0, x1 = edges[i][:-1], edges[i][1:]
        own = slice(starts[i], starts[i + 1])
        phi[own, 0] = m.phi(i, x0, m.k_hi) * (1 - SLACK)
        phi[own, 1] = m.phi(i, x1, m.k_lo) * (1 + SLACK)
        corners = [(x, k) for x in (x0, x1) for k in (m.k_lo, m.k_hi)]
        F = np.array([m.decision(i, x, k) for x, k in corners])
        clear = np.abs(F).min(axis=0) > 0.5 * (F.max(axis=0) - F.min(axis=0))
        branch[own] = np.where(clear & (F > 0).all(axis=0), 1, np.where(clear & (F < 0).all(axis=0), 0, 2))
        reached = {}
        for cell in np.flatnonzero(branch[own] == 2) if noise else ():
            branch[own][cell], reached[cell] = sampled(m, i, x0[cell], x1[cell])
        for array, image, j, mine in ((jog, m.jog, i, 0), (flip, m.flip, (i + 1) % 3, 1)):
            values = np.array([image(i, x, k) for x, k in corners])
            margin = 1e-3 * (x1 - x0) + landing
            lo, hi = values.min(axis=0) - margin, values.max(axis=0) + margin
            for cell, images in reached.items():
                if mine in images:
                    lo[cell], hi[cell] = max(lo[cell], images[mine][0]), min(hi[cell], images[mine][1])
            ranges = np.stack(
                [np.searchsorted(edges[j], lo, "right") - 1, np.searchsorted(edges[j], hi, "left") - 1],
                axis=1,
            )
            used = (branch[own] == mine) | (branch[own] == 2)
            if landing:
                off = used & ((ranges[:, 0] < 0) | (ranges[:, 1] > len(edges[j]) - 2))
                leaving.update((starts[i] + np.flatnonzero(off)).tolist())
                ranges = np.clip(ranges, 0, len(edges[j]) - 2)
            assert ((ranges[used] >= 0) & (ranges[used] < len(edges[j]) - 1)).all()
            array[own][used] = ranges[used] + starts[j]

    graph = nx.DiGraph()
    for cell in range(n):
        for first_cell, last_cell in (jog[cell], flip[cell]):
            graph.add_edges_from((cell, t) for t in range(first_cell, last_cell + 1) if t >= 0)
    graph.add_edges_from((cell, -1) for cell in leaving)  # -1: off the arm
    component, rank = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
    last = [c for c in nx.strongly_connected_components(graph) if all(t in c for v in c for t in graph[v])]
    last = [c for c in last if -1 not in c]
    for number, cells in enumerate(last):
        component[list(cells)], rank[list(cells)] = number, 0
    parts = nx.condensation(graph)
    for part in reversed(list(nx.topological_sort(parts))):
        cells = list(parts.nodes[part]["members"])
        after = [rank[t] if t >= 0 else -1 for cell in cells for t in graph[cell] if t not in cells]
        if -1 not in cells and component[cells[0]] < 0 and after and min(after) >= 0:
            rank[cells] = 1 + max(after)

    inside = component >= 0
    slopes = []
    for i in range(3):
        cells = inside[starts[i] : starts[i + 1]]
        x = np.concatenate([edges[i][:-1][cells], edges[i][1:][cells]])
        slopes += [m.slope(i, x, k).min() for k in (m.k_lo, m.k_hi) if len(x)]
    near = {str(i): near_joint(m, i, begin[i], edges[i][0]) for i in range(3)}
    goal = {"kind": "oriented_beyond", "x": "20 in", "side": 2}
    sections = {
        "attracts-all": {"near_joint": near, "max_rank": int(rank.max())},
        "invariant": {},
        "trapping": {},
        "expanding": {"least_slope": float(1 + (min(slopes) - 1) * 0.7).hex()},
        "goal": goal | starts_of(m, edges, rank, near, landing),
    }
    claims = [{"claim": claim, "section": section} for claim, section in sections.items()]
    parameters: dict = {"a": [*map(box, m.a)], "d": [*map(box, m.d)], "length": [*map(box, LENGTHS)]}
    parameters |= {"kappa": box(m.k_lo, m.k_hi), "surface_height": box(m.h)}
    parameters |= {"arm_length": box(m.arm), "radius_of_gyration": box(m.rho)}
    spread = {"throw.speed": f"{noise * 100:.6g} %"} if noise else {}
    spread |= {"landing.x": f"{landing!r} in"} if landing else {}
    header = {
        "format": "limitsets-proof",
        "version": 3,
        "scene": dict(data["model"]),
        "noise": spread or None,
        "tolerance": None,
        "boxes": [{"scene": data, "prefix": "0.", "parameters": parameters}],
        "claims": claims,
        "arrays": {},
        "producer": {"name": "forge"},
    }
    arrays = {f"0.edges.{i}": edges[i] for i in range(3)}
    arrays |= {"0.jog": jog, "0.flip": flip, "0.branch": branch, "0.rank": rank}
    arrays |= {"0.component": component, "0.phi": phi}
    return Forged(header, arrays).seal()


# ------------------------------------------------------------------------------------------------ periodic orbits

# The room of cycles [in].
GAP = 1e-10


def attracting(f: Forged) -> list[list[tuple[float, float]]]:
    """The attracting cells of each side as intervals."""
    spans: list[list[tuple[float, float]]] = []
    at = 0
    for i in range(3):
        edges = f.arrays[f"0.edges.{i}"]
        own = np.concatenate([[0], f.arrays["0.component"][at : at + len(edges) - 1] >= 0, [0]]).astype(int)
        at += len(edges) - 1
        spans.append(
            [(float(edges[a]), float(edges[b])) for a, b in np.flatnonzero(np.diff(own)).reshape(-1, 2)]
        )
    return spans


def throw(m: Plain, side: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where points of all sides go, on which side, and by which branch."""
    to, flips = np.empty_like(x), np.zeros(len(x), dtype=int)
    for i in range(3):
        own = side == i
        flips[own] = m.decision(i, x[own], m.kappa) > 0
        to[own] = np.where(flips[own] == 1, m.flip(i, x[own], m.kappa), m.jog(i, x[own], m.kappa))
    return (side + flips) % 3, to, flips


def cycles_of(m: Plain, spans: list, wanted: int) -> list[dict]:
    """Some periodic orbits that begin on side 0: sign changes of G(x) - x between neighbours of one itinerary."""
    x0 = np.linspace(*spans[0][0], 20_001)
    side, x, words, found = np.zeros(len(x0), dtype=int), x0, [], []
    for _ in range(70):
        side, x, flips = throw(m, side, x)
        words.append(flips)
        word = np.array(words)
        back = (side[1:] == 0) & (side[:-1] == 0) & (word[:, 1:] == word[:, :-1]).all(axis=0)
        crossed = np.flatnonzero(back & ((x - x0)[1:] * (x - x0)[:-1] < 0))[:1]
        found += [refined(m, word[:, k], x0[k], x0[k + 1]) for k in crossed]
        if len(found) == wanted:
            return found
    raise AssertionError


def refined(m: Plain, word: np.ndarray, lo: float, hi: float) -> dict:
    """Bisect for the orbit of one itinerary."""

    def around(x: float) -> tuple[float, float]:
        i, start, slope = 0, x, 1.0
        for branch in word:
            slope *= float(m.slope(i, np.array([x]), m.kappa)[0])
            x = float((m.jog, m.flip)[branch](i, np.array([x]), m.kappa)[0])
            i = (i + int(branch)) % 3
        return x - start, slope

    down = around(lo)[0]
    for _ in range(60):
        middle = 0.5 * (lo + hi)
        lo, hi = (middle, hi) if around(middle)[0] * down > 0 else (lo, middle)
    slope = around(lo)[1]
    assert slope > 1.01
    return {
        "side": 0,
        "itinerary": word.tolist(),
        "interval": [float(lo - GAP).hex(), float(lo + GAP).hex()],
        "multiplier": [(slope * (1 - 1e-5)).hex(), (slope * (1 + 1e-5)).hex()],
        "attracts": False,
    }


def section_of_average(f: Forged) -> dict:
    """The section of the claim `average`, of a scene or of the first box of a map."""
    claims = f.header["claims"] if "claims" in f.header else f.header["boxes"][0]["claims"]
    return next(each["section"] for each in claims if each["claim"] == "average")


def end_moved(number: int, key: str, share: float) -> Callable[[Forged], None]:
    """Move the lower or upper end of a function by a share of the width of its bounds."""

    def change(f: Forged) -> None:
        one = section_of_average(f)["functions"][number]
        lo, hi = (float.fromhex(one[end][0]) for end in ("lower", "upper"))
        one[key] = [(float.fromhex(one[key][0]) + share * (hi - lo)).hex()]

    return change


def average_changed(word: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Forged], None]:
    """Change an array of the claim `average`."""

    def forged(f: Forged) -> None:
        name = f"0.average.{word}"
        f.arrays[name] = np.ascontiguousarray(change(f.arrays[name]))

    return forged
