"""Classes: points of one topology, with a number and a name that depend on that topology alone.

A class is (attractors; of each its bands per side, flip order and period; whether none, some or all starts leave, and
whether none, some or all come back to the joint).  Jogs, extents and shares differ within a class.

The name writes the class down (`TopologyClass.name`), the number is a hash of the name.  So a class has one number
whatever other classes are met, in which order, on which grid, by which worker, and in every atlas.  Attractors count
in a canonical order, not by their place.  A point that is undecided belongs to the class `UNDECIDED`, to no other.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.base import AnswerError
from limitsets.parameters.atlas.plan import codes_of

if TYPE_CHECKING:
    import xarray as xr


# Numbers beside those of classes: undecided points, and points at which there is no scene or map.
UNDECIDED, NOWHERE = 0, -1
UNDECIDED_NAME = "undecided"
# What averaging over cells may leave of a share that is 0 or 1.
ROUNDING = 1e-9
# Bytes of a number: JSON keeps integers exactly below 2^53.  Two of 1000 classes share one once in 10^8 atlases.
_BYTES = 6
_IRREGULAR = -2
_COUNTS = ("no", "one", "two", "three", "four")
# Of a map that is no throw: whose starts leave, whose collapse, and both.
OVER_THE_ENDS = (
    ("leave over the upper end", "leaves over the upper end"),
    ("leave over the lower end", "leaves over the lower end"),
    "all starts leave, some over either end",
)
FIELDS = ("attractors", "undecided", "bands", "flip_order", "period", "leaves", "collapses")


class AttractorKind(NamedTuple):
    """What a class says of one attractor.

    Attributes
    ----------
    bands : tuple of int
        Intervals on each side; points, if it is a cycle.
    flip_order : tuple of int or None
        Sides in cyclic order, from the smallest; None where it changes.
    period : int
        Length of the cycle that it is; 0 if it is none.
    """

    bands: tuple[int, ...]
    flip_order: tuple[int, ...] | None
    period: int

    @property
    def name(self) -> str:
        """All of it, in signs."""
        order = "changes" if self.flip_order is None else "-".join(map(str, self.flip_order))
        return f"bands:{'+'.join(map(str, self.bands))},order:{order},period:{self.period}"

    @property
    def words(self) -> str:
        """All of it, in words.

        Examples
        --------
        >>> AttractorKind((1, 1, 1), (0, 1, 2), 0).words
        '3 bands, 0-1-2'
        >>> AttractorKind((3,), (0,), 3).words
        'a cycle of 3'
        """
        count = sum(self.bands)
        met = [each for each in self.bands if each]
        parts = f" ({' + '.join(map(str, self.bands))})" if len(met) > 1 and max(met) > 1 else ""
        cycle = "a fixed point" if self.period == 1 else f"a cycle of {self.period}"
        phrase = f"{cycle}{parts}" if self.period else f"{count} band{'s' * (count > 1)}{parts}"
        if len(self.bands) == 1:
            return phrase
        if self.flip_order is None:
            return f"{phrase}, the order changes"
        order = "-".join(map(str, self.flip_order))
        return f"{phrase}, side {order} alone" if len(self.flip_order) == 1 else f"{phrase}, {order}"


class TopologyClass(NamedTuple):
    """A class of points of one topology.

    Attributes
    ----------
    attractors : tuple of AttractorKind
        In a canonical order.
    leaves, collapses : {"none", "some", "all"}
        How many of the starts leave, and how many come back to the joint.

    Examples
    --------
    >>> each = TopologyClass((AttractorKind((1, 1, 1), (0, 1, 2), 0),), "some", "none")
    >>> each.words
    'one attractor, 3 bands, 0-1-2; some starts leave'
    >>> each.name
    'bands:1+1+1,order:0-1-2,period:0;leaves:some;collapses:none'
    >>> named_class(each.name) == each
    True
    """

    attractors: tuple[AttractorKind, ...]
    leaves: str
    collapses: str

    @property
    def name(self) -> str:
        """All of it, in signs without a blank."""
        kinds = [each.name for each in self.attractors] or ["no-attractor"]
        return ";".join((*kinds, f"leaves:{self.leaves}", f"collapses:{self.collapses}"))

    @property
    def number(self) -> int:
        """Its number, above 0: a hash of its name."""
        return int.from_bytes(hashlib.sha256(self.name.encode()).digest()[:_BYTES], "big") or 1

    @property
    def words(self) -> str:
        """What a legend says of it, for a throw."""
        return self.said(("leave", "leaves"), ("collapse", "collapses"))

    def said(self, leave: tuple[str, str], collapse: tuple[str, str], both: str = "") -> str:
        """Say it with these words for what starts do that leave and that collapse, and for what every start does.

        `both`: instead of these where no start stays and some go either way.
        """
        count = len(self.attractors)
        sentence = f"{_COUNTS[count] if count < len(_COUNTS) else count} attractor{'s' * (count != 1)}"
        kinds = [each.words for each in self.attractors]
        if count == 1:
            sentence += f", {kinds[0]}"
        elif count > 1:
            sentence += f", each {kinds[0]}" if len(set(kinds)) == 1 else f": {'; '.join(kinds)}"
        if both and not count and self.leaves == self.collapses == "some":
            return f"{sentence}; {both}"
        ways = [(self.leaves, leave), (self.collapses, collapse)]
        said = [f"{share} starts {several}" for share, (several, _) in ways if share == "some"]
        said += [f"every start {one}" for share, (_, one) in ways if share == "all"]
        return "; ".join((sentence, " and ".join(said))) if said else sentence


def named_class(name: str) -> TopologyClass:
    """Read the name of a class.

    Raises
    ------
    AnswerError
        It is none.
    """
    try:
        *kinds, leaves, collapses = name.split(";")
        topology_class = TopologyClass(
            tuple(_kind(kind) for kind in kinds if kind != "no-attractor"),
            leaves.removeprefix("leaves:"),
            collapses.removeprefix("collapses:"),
        )
        if topology_class.name == name:
            return topology_class
    except ValueError:
        pass
    raise AnswerError("the name of a class", name, "one of the attribute flag_meanings", "correct it")


def _kind(name: str) -> AttractorKind:
    bands, order, period = (part.partition(":")[2] for part in name.split(","))
    sides = None if order == "changes" else tuple(int(each) for each in order.split("-"))
    return AttractorKind(tuple(int(each) for each in bands.split("+")), sides, int(period))


def classes(found: Any) -> tuple[npt.NDArray[np.int64], dict[int, str]]:
    """Give each point the number of its class.

    Parameters
    ----------
    found : Topologies or xarray.Dataset
        `attractors`, `undecided`, `bands`, `flip_order`, `period`, `leaves` and `collapses` of every point.

    Returns
    -------
    numbers : ndarray of int64, of the points' shape
        The number of each point's class; 0 where it is undecided, -1 where there is no scene or map.
    names : dict of int to str
        The names of those met, undecided ones among them.

    Raises
    ------
    AnswerError
        A field is missing.

    Examples
    --------
    >>> import numpy as np
    >>> from limitsets import maps
    >>> from limitsets.systems.maps.pieces import stacked
    >>> from limitsets.topology import topologies
    >>> stack = stacked([maps.Logistic(r) for r in (3.2, 3.83, 3.3)])
    >>> numbers, names = classes(topologies(stack, np.zeros((3, 1)), np.ones((3, 1))))
    >>> bool(numbers[0] == numbers[2]), [named_class(names[k]).words for k in numbers[:2].tolist()]
    (True, ['one attractor, a cycle of 2', 'one attractor, a cycle of 3'])
    """
    attractors, undecided, bands, order, period, leaves, collapses = (_values(found, name) for name in FIELDS)
    n, sides = attractors.size, bands.shape[-1]
    whole = [undecided > 0, attractors, _some(leaves), _some(collapses)]
    kinds = np.concatenate([bands, order, period[..., None]], axis=-1).reshape(n, -1)
    columns = [*(each.reshape(n, 1) for each in whole), kinds]
    rows = np.concatenate(columns, axis=1, dtype=np.int64, casting="unsafe")
    keys = [row.tobytes() for row in rows]
    entries = {key: _numbered(row.tolist(), sides) for key, row in dict(zip(keys, rows, strict=True)).items()}
    numbers = np.array([entries[key][0] for key in keys], np.int64).reshape(attractors.shape)
    return numbers, {number: name for number, name in sorted(entries.values()) if name}


def _values(points: Any, name: str) -> npt.NDArray[Any]:
    given = points.get(name) if hasattr(points, "data_vars") else getattr(points, name, None)
    if given is None:
        raise AnswerError(f"the variable {name}", "missing", ", ".join(FIELDS), "compute these too")
    return np.asarray(given)


def _some(share: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """0 for none, 1 for some, 2 for all."""
    return (share > ROUNDING).astype(np.int64) + (share >= 1.0 - ROUNDING)


def _numbered(row: list[int], sides: int) -> tuple[int, str]:
    """Read a row of `classes`: number and name, the attractors in the order of their names' parts."""
    undecided, attractors, leaves, collapses, *numbers = row
    if undecided:
        return UNDECIDED, UNDECIDED_NAME
    if attractors < 0:
        return NOWHERE, ""
    kinds, width = [], 2 * sides + 1
    for k in range(0, attractors * width, width):
        bands, order = tuple(numbers[k : k + sides]), numbers[k + sides : k + 2 * sides]
        visited = None if _IRREGULAR in order else tuple(side for side in order if side >= 0)
        kinds.append(AttractorKind(bands, visited, numbers[k + width - 1]))
    kinds.sort(key=lambda kind: (kind.bands, kind.flip_order or (), kind.period))
    words = ("none", "some", "all")
    topology_class = TopologyClass(tuple(kinds), words[leaves], words[collapses])
    return topology_class.number, topology_class.name


class Entry(NamedTuple):
    """A line of a legend: a class by its number and name, in words, and the share of the points that it has."""

    number: int
    name: str
    words: str
    share: float


def legend(dataset: xr.Dataset) -> list[Entry]:
    """List the classes of an atlas, the most frequent first and the undecided points last.

    Parameters
    ----------
    dataset : xarray.Dataset
        With `class`, or what `classes` needs; with `jogs_min` and `jogs_max` the words say the jogs too.

    Returns
    -------
    list of Entry
    """
    numbers, names = numbers_of(dataset)
    there = int((numbers != NOWHERE).sum())
    entries = []
    for number, name in names.items():
        here = numbers == number
        if here.any():
            entries.append(Entry(number, name, _words(dataset, name, here), float(here.sum() / there)))
    return sorted(entries, key=lambda each: (each.number == UNDECIDED, -each.share, each.name))


def _words(dataset: xr.Dataset, name: str, here: npt.NDArray[np.bool_]) -> str:
    """Say a class by its name, of a map with the ends of its domain, for it has no joint."""
    if name == UNDECIDED_NAME:
        return name
    if "map" in dataset.attrs.get("plan", {}):
        return named_class(name).said(*OVER_THE_ENDS)
    return named_class(name).words + _jogs(dataset, here)


def is_classified(dataset: xr.Dataset) -> bool:
    """Say whether an atlas has classes, or what they are made of."""
    return "class" in dataset or set(FIELDS) <= set(dataset)


def numbers_of(dataset: xr.Dataset) -> tuple[npt.NDArray[np.int64], Mapping[int, str]]:
    """Return the numbers of an atlas's classes, as stored or from its fields, and the names."""
    if "class" not in dataset:
        return classes(dataset)
    stored = dataset["class"]
    return np.asarray(stored.values), {code: name for name, code in codes_of(stored.attrs).items()}


def _jogs(dataset: xr.Dataset, here: npt.NDArray[np.bool_]) -> str:
    """Say the jogs of a visit, over all points of a class and all sides that its attractors visit."""
    if not {"jogs_min", "jogs_max"} <= set(dataset):
        return ""
    least, most = (np.asarray(dataset[name].values)[here] for name in ("jogs_min", "jogs_max"))
    if not (least >= 0).any():
        return ""
    low, high = int(least[least >= 0].min()), int(most.max())
    if low == high:
        return f"; {low} jog{'s' * (low != 1)} a visit"
    return f"; {low} {'or' if high == low + 1 else 'to'} {high} jogs a visit"
