"""After how many throws with the same parameters no part rests beyond a place: found by the checker's own bands.

Cells proved for a box of parameters allow other parameters at every throw, as time-varying noise does.  Time-invariant
parameters lead less far: the scene whose slow throws jog to the highest place is not the one whose fast throws then
flip there.  docs/certificates.md, "Goals, end points, orbits", number 9.
"""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from limitsets.base.arrays import Mask
from limitsets.feeder.scene.units import spelled_plainly
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.certificate import arrays_of, in_certificate

# Throws that are followed, and boxes of parameters: more of them gain little, as the certificate may be cut as well.
MOST_THROWS, MOST_BOXES = 4, 24

# A parameter as narrow as this, relative to itself, is known but for rounding.
KNOWN = 1e-9


def throws_below(attraction: Attraction, bad: Mask, x: float) -> int:
    """Find after how many throws no part of an attracting component that has bad cells rests beyond x; 0 if unproved.

    Parameters
    ----------
    attraction : Attraction
        Cells and images of a box of parameters; landings may be off by the noise of the landing place.
    bad : ndarray of bool, shape (n_cells,)
        All attracting cells that reach beyond x on some sides.
    x : float
        The place.
    """
    box = attraction.cover.box
    lo, hi = box.bare
    least, most = (np.hstack([np.ravel(number) for number in ends[2:-1]]) for ends in (lo, hi))
    wide = bool((most - least > KNOWN * np.abs(most)).any())  # from kappa to the lengths of the sides
    varying = {"throw.speed", "gravity.tilt"} & box.noise.keys()
    if box.effects or varying or not wide or find_spec("flint") is None:
        return 0
    import flint

    from limitsets.checker import bands
    from limitsets.checker.balls import PRECISION, UnprovedError
    from limitsets.checker.file import BadFileError, Cells
    from limitsets.checker.scene import read_scene

    arrays = arrays_of(attraction, "")
    edges = [arrays[f"edges.{side}"] for side in range(attraction.cover.grid.sides)]
    names = ("jog", "flip", "branch", "rank", "component", "phi")
    with flint.ctx.workprec(PRECISION):
        try:
            scene = read_scene(in_certificate(box.scene), spelled_plainly(dict(box.noise)) or None)
            return bands.throws_below(
                Cells(edges, *(arrays[name] for name in names)), scene, bad, x, MOST_THROWS, MOST_BOXES
            )
        except (BadFileError, UnprovedError):
            return 0
