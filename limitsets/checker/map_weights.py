"""Almost every start of a map on a line leaves the cells without a rank: those that stay there thin out.

docs/certificates.md, "Certificates of any map": the claim `almost-every`.  Let Z be the cells with rank -1, S the
points that lie in no others, w the weight, constant on each cell of Z, and p_1, p_2, ... any parameters of the box.
Take the starts whose states 0 to n all lie in S, a set A_n, and their states n.  The length of starts that come to a
set has there a density r_n of at most C theta^n w, with C = 1/min w and some theta below 1:

* r_0 is at most 1, so at most C w.
* A *run* consists of neighbouring cells of Z on one side where the slope on branch b is proved to be above 0 on each,
  or below 0 on each.  At a border both cells have the same formula, so that f is continuous on the run.  There
  |f(x) - f(y)| is at least the least slope times |x - y| (Lebourg's mean value theorem): f is one to one on the run,
  and only sets of length 0 come to such sets, so that there are no atoms.  A point y inside a cell t of Z has at most
  one state x before it on the run; x lies in a cell c of the run with t among its targets, and |f'(x)| is at least m,
  the least slope on c.  So the run adds at most r_n(x)/m to r_n+1(y), and at most C theta^n times the largest w(c)/m
  among these cells c.
* Where a part of the run takes another branch, less is added.  Cells none of whose targets lies in Z add nothing, and
  need no slope.  What comes beyond the domain, or to a cell with a rank, is outside S.
* Checked is that these largest ones, added over all branches and runs, are less than w(t).  There are finitely many t,
  so that the sums are at most theta w(t) with a theta below 1.

The length of A_n is the integral of r_n, and tends to 0.  So the starts that stay in S for ever have the length 0; all
others come to a cell with a rank, or leave the domain.  Where parameters change, the exceptions depend on them.
"""

import itertools

import numpy as np

from .any_map import Map
from .balls import Array, UnprovedError, floats_around
from .map_cells import MapCells

SMALLEST, LARGEST = (
    2.0**-500,
    2.0**500,
)  # of weights and slopes: no quotient of two leaves the range of doubles
ROOM = 1.0 - 2.0**-20  # sums of at most 2^31 quotients are right to 2^-21


def check_weights(the_map: Map, c: MapCells) -> None:
    """Check that the cells without a rank receive less than their weights."""
    received, fits = np.zeros(len(c.rank)), (c.weight >= SMALLEST) & (c.weight <= LARGEST)
    c.prove_all(~c.thin | fits, "its weight is not between 2^-500 and 2^500")
    for branch, side in itertools.product(range(len(c.target)), range(len(c.edges))):
        add_received(the_map, c, (side, branch), received)
    c.prove_all(~c.thin | (received < c.weight * ROOM), "it may receive as much as its weight")


def add_received(the_map: Map, c: MapCells, key: tuple[int, int], received: Array) -> None:
    """Add what the cells of a side receive on a branch, the largest of each run."""
    side, branch = key
    begin, count = int(c.start[c.to[branch][side]]), int(c.counts[c.to[branch][side]][0])
    runs: list[list[tuple[int, int, float]]] = []
    before = (-2, False)  # the last cell of a run, and whether f rises there
    own = np.arange(c.start[side], c.start[side + 1])
    for cell in own[c.thin[own]].tolist():
        low, high = c.target[branch][cell].tolist()
        first, last = begin + max(low, 0), begin + min(high, count - 1)
        if last < first or not c.thin[first : last + 1].any():  # none either where the branch is impossible
            continue
        slope = the_map.image[key].gradients(the_map.piece(c.box(cell)[1]).balls)[0][0]
        least = floats_around(abs(slope))[0]
        if not ((slope > 0 or slope < 0) and least >= SMALLEST):
            why = f"that the slope on branch {branch} has one sign is not proved"
            raise UnprovedError(f"{c.name(cell)}: {why}")
        if before != (cell - 1, bool(slope > 0)):
            runs.append([])
        runs[-1].append((first, last, float(c.weight[cell]) / min(least, LARGEST)))
        before = cell, bool(slope > 0)
    for run in runs:
        first, last = min(low for low, _, _ in run), max(high for _, high, _ in run)
        largest = np.zeros(last + 1 - first)
        for low, high, density in run:
            part = slice(low - first, high + 1 - first)
            largest[part] = np.maximum(largest[part], density)
        received[first : last + 1] += largest
