"""Labels of cells against orbits: no start in a cell may end elsewhere than its label says."""

import math
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.maps import OUTSIDE, UNDECIDED, UNDEFINED, images

# ---------------------------------------------------------------- maps with holes: roots, logarithms, quotients


class Root(NamedTuple):
    below: float


def root(params, x, side):
    return math.sqrt(x) - params.below if x >= 0.0 else math.nan, side, 0


class Logarithm(NamedTuple):
    above: float


def logarithm(params, x, side):
    return math.log(x) + params.above if x > 0.0 else math.nan, side, 0


class Log2(NamedTuple):
    factor: float


def log_of_size(params, x, side):
    """A pole and no hole: every orbit but one of a countable set goes on for ever, until it passes the border."""
    return (params.factor * math.log(abs(x)) if x != 0.0 else -math.inf), side, 0


class Gap(NamedTuple):
    half: float


def gap(params, x, side):
    """The logarithm of x^2 - half^2: a hole in the middle, with a steep border on both sides."""
    inside = x * x - params.half * params.half
    return 0.3 * math.log(inside) + 1.0 if inside > 0.0 else math.nan, side, 0


class Newton(NamedTuple):
    square: float


def newton(params, x, side):
    """Newton's method for a root: a pole at 0, two attractors."""
    return (0.5 * (x + params.square / x) if x != 0.0 else math.nan), side, 0


class Reciprocal(NamedTuple):
    less: float


def reciprocal(params, x, side):
    return (1.0 / x - params.less if x != 0.0 else math.nan), side, 0


class Tangent(NamedTuple):
    factor: float


def tangent(params, x, side):
    return params.factor * math.tan(x), side, 0


class Arch(NamedTuple):
    height: float


def arch(params, x, side):
    """A half circle: vertical at both ends of where it is defined."""
    under = 1.0 - x * x
    return params.height * math.sqrt(under) - 0.5 if under >= 0.0 else math.nan, side, 0


class Means(NamedTuple):
    share: float


def means(params, x, side):
    """Arithmetic and geometric means: undefined where the signs differ, else towards a point of the diagonal."""
    under = x[0] * x[1]
    other = math.sqrt(under) if under >= 0.0 else math.nan
    return (params.share * (x[0] + x[1]), 0.9 * other + 0.05), side, 0


class Quotient(NamedTuple):
    factor: float


def quotient(params, x, side):
    return (params.factor * x[0] / x[1] if x[1] != 0.0 else math.nan, 0.5 * x[1] + 0.3 * x[0]), side, 0


class Cubes(NamedTuple):
    scale: float


def cubes(params, z, side):
    """Newton's method for z^3 = 1 in the plane: a pole at 0, three basins mixed everywhere between them."""
    x, y = z
    size = (x * x + y * y) ** 2
    if size == 0.0:
        return (math.nan, math.nan), side, 0
    return (
        (2.0 * x + params.scale * (x * x - y * y) / size) / 3.0,
        (2.0 * y - params.scale * 2.0 * x * y / size) / 3.0,
    ), side, 0


class Nothing(NamedTuple):
    unused: float


def nothing(params, x, side):
    return math.nan, side, 0


for line, image in (
    (Root, root),
    (Logarithm, logarithm),
    (Log2, log_of_size),
    (Gap, gap),
    (Newton, newton),
    (Reciprocal, reciprocal),
    (Tangent, tangent),
    (Arch, arch),
    (Nothing, nothing),
):
    ls.register(line, image=image)
for plane, image in ((Means, means), (Quotient, quotient), (Cubes, cubes)):
    ls.register(plane, image=image, dimension=2)

SQUARE = [(-2.0, 2.0), (-2.0, 2.0)]
HOLES = [
    (Root(0.2), [(-1.0, 2.0)], 1000),
    (Root(-0.25), [(-1.0, 2.0)], 333),
    (Logarithm(1.5), [(-1.0, 4.0)], 1000),
    (Log2(1.3), [(-3.0, 3.0)], 999),
    (Gap(0.01), [(-2.0, 2.0)], 500),
    (Newton(2.0), [(-3.0, 3.0)], 1001),
    (Newton(-1.0), [(-30.0, 30.0)], 1000),
    (Reciprocal(0.6), [(-2.0, 2.0)], 777),
    (Tangent(0.7), [(-5.0, 5.0)], 1000),
    (Arch(1.2), [(-1.5, 1.5)], 700),
    (Means(0.5), SQUARE, 64),
    (Quotient(0.4), SQUARE, 81),
    (Cubes(1.0), SQUARE, 128),
    (Nothing(0.0), [(0.0, 1.0)], 50),
]
TEXTBOOK = [
    (ls.maps.Baker(), [(0.0, 1.0), (0.0, 1.0)], 64),
    (ls.maps.Contraction(0.5), [(-1.0, 1.0)], 333),
    (ls.maps.Cubic(1.5), [(-1.7, 1.7)], 1000),
    (ls.maps.Cubic(2.6), [(-1.7, 1.7)], 1001),
    (ls.maps.Doubling(2.0), [(0.0, 1.0)], 333),
    (ls.maps.Henon(1.4, 0.3), SQUARE, 128),
    (ls.maps.Henon(1.0, 0.3), SQUARE, 256),
    (ls.maps.Leslie(), ls.maps.domain_of(ls.maps.Leslie()), 128),
    (ls.maps.Linear2(0.5, 0.0, 0.0, 2.0), SQUARE, 64),
    (ls.maps.Logistic(3.2), [(-0.2, 1.2)], 1000),
    (ls.maps.Logistic(3.83), [(-0.2, 1.2)], 777),
    (ls.maps.Logistic(4.1), [(0.0, 1.0)], 999),
    (ls.maps.Product(), [(0.0, 1.2), (0.0, 1.2)], 64),
    (ls.maps.Rotation(), [(0.0, 1.0)], 100),
    (ls.maps.ThreeState(), [(-3.0, 3.0)], 100),
    (ls.maps.TwoState(1.0), SQUARE, 32),
]


def outcomes(params, grid, starts, steps):
    """Where each start is after so many steps: cell, or code of the exit it left the grid by."""
    x, end = starts.copy(), np.zeros(len(starts), np.int64)
    going = np.arange(len(starts))
    for _ in range(steps):
        there = images(params, x[going], 0)
        x[going] = there.x
        cell = grid.index(there.x, 0)
        end[going] = np.where(there.code < 0, there.code, np.where(cell < 0, OUTSIDE, cell))
        going = going[end[going] >= 0]
    return end


@pytest.mark.parametrize(("params", "domain", "cells"), HOLES + TEXTBOOK, ids=lambda value: str(value)[:24])
def test_no_label_is_contradicted_by_an_orbit(params, domain, cells):
    grid = ls.grid(domain, cells=cells)
    graph = ls.transitions(params, grid)
    found = ls.attractors(graph, throws=1000)
    shares = ls.basins(graph, found)
    rng = np.random.default_rng(10)
    numbers = np.repeat(np.arange(grid.n_cells), 4)
    lo, hi = grid.boxes(numbers, 0)
    starts = lo + rng.random(lo.shape) * (hi - lo)
    end = outcomes(params, grid, starts[:, 0] if len(domain) == 1 else starts, 3000 if len(domain) == 1 else 300)
    label = shares.labels[numbers]
    staying = np.array([*(each.cells.mask for each in found), np.zeros(grid.n_cells, bool)])
    kept = staying[np.maximum(label, -1), np.maximum(end, 0)] & (end >= 0)
    right = (label == UNDECIDED) | (label == end) | ((label >= 0) & kept)
    assert right.all(), (params, numbers[~right][:5], label[~right][:5], end[~right][:5], (~right).sum())
