"""Almost every start thins out of the cells without a rank: what is true by hand is proved, what is false denied.

The tent x' = s x up to 1/2, s (1 - x) beyond, leaves [0, 1] from almost every start where s > 2 (for s = 3 the middle
thirds stay), and from none where s <= 2.
"""

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from tests.checker.maps_in_files import Example, MapCertificate, denied, refused

TENT = Example(1, "s", lambda x, p, _, b: p.s * (1.0 - x[0]) if b else p.s * x[0], lambda x, *_: x[0] - 0.5)
FOLDED = Example(1, "s", lambda x, p, *_: p.s * np.minimum(x[0], 1.0 - x[0]))
DOUBLED = Example(1, "s", lambda x, p, *_: p.s * x[0])
PARABOLA = Example(1, "s", lambda x, p, *_: p.s * x[0] ** 2 - 1.2)
OVERLAPS = Example(1, "s", lambda x, p, _, b: p.s * x[0] + (1.0 - p.s) * b, lambda x, *_: x[0] - 0.5)
NEVER = (-2, -2)

# between 3/8 and 5/8 starts leave at once; elsewhere one formula of one slope, which sends two parts to the same places
PARTED = Example(
    1,
    "s",
    lambda x, p, _, b: p.s * x[0] - (p.s - 1.0) * np.floor(x[0] + 0.5) if b else 0.0 * x[0] + 5.0,
    lambda x, *_: np.abs(x[0] - 0.5) - 0.125,
)
TWICE = Example(1, "s", lambda x, p, *_: p.s * x[0], sides=2, to=lambda side, _: 1 - side)
JOINED = Example(1, "s", lambda x, p, *_: p.s * x[0], sides=2, to=lambda side, _: 0)


def thinning(example, edges, s, *targets):
    """No cell has a rank, and all have the weight 1; by branch the first and last target of each cell."""
    count = len(edges) - 1
    cells = {f"target.{b}": np.array(rows, np.int32) for b, rows in enumerate(targets)}
    cells |= {"edges.0.0": np.array(edges, float), "weight": np.ones(count)}
    cells |= {name: np.full(count, -1, np.int32) for name in ("rank", "component")}
    return MapCertificate(example, [({"s": s}, {"almost-every": {}}, cells)])


QUARTERS, HALVES = [0.0, 0.25, 0.5, 0.75, 1.0], [-1.0, -0.5, 0.0, 0.5, 1.0]


def tent(s="3", inner=(0, 2), outer=(3, 4), beyond=(4, 4)):
    """Where the inner cells, the outer ones, and by branch 0 the cell after 1/2 lead."""
    return thinning(TENT, QUARTERS, s, [inner, outer, beyond, NEVER], [NEVER, NEVER, outer, inner])


def doubled():
    """Cells 0 and 1 both lead to cell 0, but no point of it has two states before it."""
    return thinning(DOUBLED, HALVES, "2", [(-1, 0), (0, 1), (2, 3), (3, 4)])


def parted(s):
    return thinning(PARTED, [0.0, 0.375, 0.625, 1.0], s, [(3, 3)] * 3, [(0, 2), NEVER, (0, 3)])


def two_sides(example):
    """Of doubling on two sides."""
    made, one = thinning(example, HALVES, "2", []), doubled().arrays
    twice = {name: np.concatenate([one[name]] * 2) for name in one if "edges" not in name}
    made.arrays |= twice | {"0.edges.1.0": one["0.edges.0.0"]}
    return made


TRUE = {
    "two parts of one branch": lambda: parted("2.5"),
    "two sides": lambda: two_sides(TWICE),
    "tent of slope 3": tent,
    "tent of slope 2.1": lambda: tent("2.1", (0, 2), (2, 4), (4, 4)),
    "tent of slopes 2.5 to 2.9": lambda: tent(["2.5", "2.9"], (0, 2), (2, 4), (4, 4)),
    "doubling": doubled,
    "two branches in a cell": lambda: thinning(OVERLAPS, [0.0, 1.0], "3", [(0, 1)], [(-1, 0)]),
    "halving, turned over": lambda: thinning(DOUBLED, HALVES, "-2", [(3, 4), (2, 3), (0, 1), (-1, 0)]),
}


@pytest.mark.parametrize("name", TRUE)
def test_almost_every_start_leaves(name, tmp_path):
    certificate = TRUE[name]()
    report = certificate.recheck(tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
    domain = str(certificate.arrays["0.edges.0.0"][[0, -1]].tolist())
    where = "the domain" if name == "two sides" else domain
    assert report.statement == [
        f"almost-every: almost every start in {where} (all but a set of length 0) leaves it"
    ]


def put(make, **arrays):
    """Change entries of arrays: by name a cell and its value."""

    def forged():
        certificate = make()
        for name, (cell, value) in arrays.items():
            certificate.arrays[f"0.{name.replace('target', 'target.')}"][cell] = value
        return certificate

    return forged


WEIGHT, RECEIVES, IMAGE = "weight is not between", "as much as its weight", "image on branch"
FALSE = {
    "two parts of one branch": (lambda: parted("1.9"), RECEIVES),  # true: but these weights do not show it
    "two sides that lead to one": (lambda: two_sides(JOINED), RECEIVES),
    "tent of slope 2": (lambda: tent("2", (0, 2), (1, 4), (3, 4)), RECEIVES),
    "tent of slope 1.9": (lambda: tent("1.9", (0, 1), (1, 3), (3, 4)), RECEIVES),
    "tent of slopes 1.9 to 2.9": (lambda: tent(["1.9", "2.9"], (0, 2), (1, 4), (3, 4)), RECEIVES),
    "tent of one formula": (lambda: thinning(FOLDED, QUARTERS, "1.9", [(0, 1), (1, 3), (1, 3), (0, 1)]), ""),
    "two branches in a cell": (lambda: thinning(OVERLAPS, [0.0, 1.0], "1.5", [(0, 1)], [(-1, 0)]), RECEIVES),
    "a formula that folds": (
        lambda: thinning(PARABOLA, HALVES, "2.5", [(0, 4), (-1, 0), (-1, 0), (0, 4)]),
        "slope on branch 0 has one sign",
    ),
    "a map that keeps lengths": (
        lambda: thinning(DOUBLED, HALVES, "-1", [(3, 3), (2, 2), (1, 1), (0, 0)]),
        RECEIVES,
    ),
    "a contraction": (lambda: thinning(DOUBLED, HALVES, "0.5", [(1, 1), (1, 1), (2, 2), (2, 2)]), RECEIVES),
    "weight 0": (put(tent, weight=(0, 0.0)), WEIGHT),
    "weight below 0": (put(tent, weight=(0, -1.0)), WEIGHT),
    "weights too small": (put(tent, weight=(slice(None), 1e-300)), WEIGHT),
    "weights too large": (put(tent, weight=(slice(None), 1e300)), WEIGHT),
    "a weight too large for where it leads": (put(tent, weight=(3, 2.5)), RECEIVES),
    "a weight larger by less than what sums are rounded by": (
        put(doubled, weight=(0, 0.5 + 2.0**-23)),
        RECEIVES,
    ),
    "a weight too small": (put(doubled, weight=(0, 0.5)), RECEIVES),
    "a branch excluded": (put(tent, target1=(2, NEVER)), "branch 1 is not excluded"),
    "a target too few": (put(tent, target0=(1, (4, 4))), IMAGE),
    "the domain left too soon": (put(doubled, target0=(3, (4, 4))), IMAGE),
    "another slope": (lambda: tent("2.9", (0, 1)), IMAGE),
    "a rank invented": (put(tent, rank=(0, 1)), "the rank does not fall"),
    "an attracting cell invented": (put(doubled, rank=(1, 0), component=(1, 0)), "out of its component"),
}


@pytest.mark.parametrize("name", FALSE)
def test_what_is_false_is_denied(name, tmp_path):
    make, why = FALSE[name]
    denied(make(), tmp_path, why)


def changed(make, change):
    def odd():
        certificate = make()
        change(certificate)
        return certificate

    return odd


PLANE = Example(2, "s", lambda x, p, *_: (p.s * x[0], p.s * x[1]))


def plane():
    made = thinning(PLANE, [-1.0, 1.0], "2", [(-1, -1, 1, 1)])
    made.arrays["0.edges.0.1"] = made.arrays["0.edges.0.0"]
    return made


ODD = {
    "two coordinates": plane,
    "a period": changed(tent, lambda made: made.header["map"].update(periodic=[["1"]])),
    "weights missing": changed(tent, lambda made: made.arrays.pop("0.weight")),
    "weights of another length": changed(tent, lambda made: made.arrays.update({"0.weight": np.ones(3)})),
    "weights in single": changed(tent, lambda made: made.arrays.update({"0.weight": np.ones(4, np.float32)})),
    "weights that no claim needs": changed(tent, lambda made: made.header["boxes"][0].update(
        claims=[{"claim": "basin", "section": {}}])),
    "weight nan": put(tent, weight=(0, np.nan)),
    "weight infinite": put(tent, weight=(slice(None), np.inf)),
    "a section with a key": changed(tent, lambda made: made.claims()["almost-every"].update(theta="0.5")),
    "target beyond the first after the last": put(tent, target0=(1, (3, 5))),
    "target before the first before the first": put(tent, target0=(1, (-2, 1))),
    "a rank with targets beyond": put(tent, rank=(1, 0), component=(1, 0)),
}  # fmt: skip


@pytest.mark.parametrize("name", ODD)
def test_odd_files_are_refused(name, tmp_path):
    refused(ODD[name](), tmp_path)
