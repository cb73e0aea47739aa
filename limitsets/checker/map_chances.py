"""The claim `probabilities` of a map: where orbits whose steps scatter end, and when.

docs/certificates.md, "Probabilities of a map".  Orbits end at places that the file names, and where they leave the
domain, which on each side is what lies between the second node and the last but one.  On all other cells steps are
made: one of which the image is not enclosed makes the claim fail.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from .absorption import (
    ANY,
    LEFT,
    OF_ABSORPTION,
    Absorption,
    absorption_in_words,
    check_absorption,
    read_absorption,
)
from .any_map import Map
from .balls import Array, prove
from .brackets import Place, overlapping, start_row, table_of
from .file import Arrays, require
from .means import Mesh, Rows
from .noisy_map import (
    MORE_OF_NOISY,
    OF_NOISY,
    NoisyMap,
    between_ends,
    chain_of_map,
    mesh_of_map,
    noise_of_map_in_words,
    read_noisy,
    read_stretches,
    strata_of,
    stretches_in_words,
)
from .observable import Allowed
from .steps import Chain

OF_CHANCES = f"{OF_NOISY} absorbing {OF_ABSORPTION}"
MORE_OF_CHANCES = f"{MORE_OF_NOISY} ever"


class ChancesOfMap(NamedTuple):
    """What is claimed: read, and not yet believed."""

    noisy: NoisyMap
    absorbing: dict[str, list[Place]]
    absorption: Absorption


def read_chances_of_map(
    section: dict[str, Any], arrays: Arrays, prefix: str, allowed: Allowed, where: str
) -> ChancesOfMap:
    """Read the claim of a box of parameters."""
    noisy = read_noisy(section, arrays, prefix, allowed, where)
    absorbing = read_places_of_map(section["absorbing"], noisy.starts, allowed.sides, where)
    return ChancesOfMap(noisy, absorbing, read_absorption(section, arrays, prefix, absorbing, noisy.nodes))


def read_places_of_map(value: object, starts: list[Place], sides: int, where: str) -> dict[str, list[Place]]:
    """Read the places that absorb, by their names, and require that no place counts twice, nor a start."""
    absorbing = {
        name: read_stretches(some, sides, f"{where}: {name}")
        for name, some in table_of(value, f"{where}: absorbing").items()
    }
    require(not {ANY, LEFT} & set(absorbing), f"{where}: {ANY} and {LEFT} name no places")
    require(not overlapping(absorbing), f"{where}: two places that absorb overlap")
    require(not overlapping({"starts": starts}), f"{where}: starts overlap: they would count twice")
    return absorbing


def chances_of_map_in_words(c: ChancesOfMap) -> Iterator[str]:
    """Put the claim in words."""
    yield "T is the step with which an orbit first lands at a place named below, or leaves the domain"
    yield f"    T is 0 for a start at such a place; {noise_of_map_in_words(c.noisy)}"
    domain = [(k, edges[1], edges[-2]) for k, edges in enumerate(c.noisy.edges)]
    yield f"    domain: {stretches_in_words(domain)}"
    yield f"    starts, equally likely per length: {stretches_in_words(c.noisy.starts)}"
    for name, places in c.absorbing.items():
        yield f"    {name}: {stretches_in_words(places)}"
    yield from absorption_in_words(c.absorption, "step")


def places_on(mesh: Mesh, absorbing: dict[str, list[Place]]) -> tuple[Array, dict[str, Array]]:
    """List the cells from which steps are made, by their left nodes, and by name the nodes of those that absorb."""
    first, end = mesh.first[:-1], mesh.first[1:]
    absorbed = {LEFT: np.concatenate([*(first + k for k in range(3)), *(end - k for k in (3, 2, 1))])}
    live = np.setdiff1d(between_ends(mesh), np.concatenate([first + 1, end - 3]))
    for name, places in absorbing.items():
        nodes = []
        for side, lo, hi in places:
            own = mesh.place[mesh.first[side] : mesh.first[side + 1]]
            a, b = np.searchsorted(own, [float(lo), float(hi)])
            at = f'"{name}" from {float(lo)!r} to {float(hi)!r} on side {side}'
            prove(a >= 2 and b <= len(own) - 3, f"{at}: it reaches beyond the domain")
            prove(own[a] == float(lo) and own[b] == float(hi), f"{at}: its ends are no nodes")
            nodes.append(mesh.first[side] + np.arange(a, b + 1))
            live = np.setdiff1d(live, nodes[-1][:-1])
        absorbed[name] = np.unique(np.concatenate(nodes))
    return live, absorbed


def chain_that_ends(the_map: Map, c: NoisyMap, absorbing: dict[str, list[Place]]) -> tuple[Chain, Rows]:
    """Prove the steps; with the row that makes means over the starts."""
    mesh = mesh_of_map(c.edges, c.law)
    live, absorbed = places_on(mesh, absorbing)
    prove(bool(len(live)), "there is no cell from which steps are made")
    for side, lo, hi in c.starts:
        within = float(c.edges[side][1]) <= lo and hi <= float(c.edges[side][-2])
        prove(within, f"side {side}: starts lie beyond the domain")
    chain, _ = chain_of_map(strata_of(the_map, c.varied), mesh, c.law, live, absorbed)
    lost = mesh.place[np.setdiff1d(live, chain.live)].tolist()
    prove(not lost, f"the image of the cell that begins at x = {lost[:1]!r} is not enclosed")
    return chain, start_row(c.starts, mesh)


def check_chances_of_map(the_map: Map, c: ChancesOfMap) -> None:
    """Check the claim."""
    chain, row = chain_that_ends(the_map, c.noisy, c.absorbing)
    # beyond the far nodes a function is constant: a slope up to there would end at a kink that no cell shows
    ends = [(chain.mesh.first[:-1], 1), (chain.mesh.first[1:] - 1, -1)]
    flat = all(
        (v[far] == v[far + inward]).all() for v in c.absorption.functions.values() for far, inward in ends
    )
    prove(flat, "a function is not constant beyond the domain")
    check_absorption(chain, row, c.absorption, "step", lambda: None)
