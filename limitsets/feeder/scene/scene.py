"""A scene with resolved units, the input of all later rooms; and the units in which it writes its quantities."""

from __future__ import annotations

import copy
import math
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from limitsets.base import AnswerError, Column, SceneError, Table, Tabled, facts
from limitsets.feeder.geometry import Hole, RestingSides
from limitsets.feeder.goals import Goal
from limitsets.feeder.scene.facts import WITHOUT_EDGE, Deviation, Effects, World
from limitsets.feeder.scene.numbers import corners_of
from limitsets.feeder.scene.quantities import (
    NOISE_ONLY,
    base_unit,
    find,
    in_units,
    replaced,
    text_at,
    unit_read,
)
from limitsets.feeder.scene.surroundings import Cavity, Feedback, Tray
from limitsets.feeder.scene.units import exact_factor, written

if TYPE_CHECKING:
    from limitsets.feeder.thrower import Throw
    from limitsets.feeder.thrower.motion import FullThrow
    from limitsets.systems.cells import Domain


# below this share of the way from a_i to the arm's end the number of throws needed to get away is unbounded
_NEAREST = 1e-6

# Turns of a part thrown from the arm's end beyond which a bare number for the speed is not believed.
MOST_TURNS = 100

# A gravity that differs by less is the same in other words: the paper's 193.045 in/s^2 are those of a tilt of 30 deg.
_SAME = 1e-4


def turns(arm_length: float, kappa: float) -> float:
    """Say how often a part thrown from the arm's end turns before it lands, by the small-angle model with a = 0."""
    return arm_length / (math.pi * kappa)


def resting_places(a: Any, arm_length: Any) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the least and the largest x at which a part can rest on sides with these a."""
    hi = np.zeros_like(a) + arm_length
    return a + _NEAREST * (hi - a), hi


@dataclass(frozen=True, eq=False, repr=False)
class Scene(Tabled):
    """A part, an arm, a throw and what is asked of them.  Build it with `limitsets.load`.

    Parameters
    ----------
    name : str
        Its name; files that belong to it are named after it.
    unit : str
        Unit of all lengths here, that of the arm's length in the file: ``"in"``.
    vertices : ndarray, shape (n, 2)
        The part's convex hull, which carries its throws, counterclockwise [length]; a triangle given by its sides lies
        on side 0, from the origin.
    outline : ndarray, shape (m, 2)
        The part itself, a plate with notches perhaps; `vertices` are among its vertices [length].
    holes : tuple of Hole
        In the plate [length].
    centre : tuple of float
        Centre of mass in the frame of `vertices` [length].
    radius_of_gyration : float
        About the centre of mass [length].
    sides : RestingSides
        Where the centre of mass stands over each side [unit, rad].
    surface_height : float
        Signed height of the arm's surface over the joint [length].
    arm_length : float
        The largest x at which a part can rest [length].
    kappa : float
        Gravity over the squared angular speed of the throw [length].
    gravity : float or None
        Gravity in the plane of the motion, where it is given [unit/s^2].
    flight, flip : str
        Which formulas.
    goal : Goal or None
        What is asked.
    cavity : Cavity or None
        Where the arm ends, and what lies beyond its end; only `limitsets.feed` asks for it.
    tray : Tray or None
        A plate with depressions; only `limitsets.tray` asks for it.
    world : World
        Facts, whether or not an effect uses them.
    effects : Effects
        What is simulated beyond the minimal model.
    tolerance : mapping of str to Deviation
        Scales of a joint margin, by quantity.
    feedback : Feedback or None
        The throws that a controller can choose from, and its sensor.
    file : str or None
        The file it was read from, or the name of a built-in scene.
    text : mapping
        The scene as it was written; `as_dict` gives a copy of it.
    """

    name: str
    unit: str
    vertices: npt.NDArray[np.float64]
    outline: npt.NDArray[np.float64]
    holes: tuple[Hole, ...]
    centre: tuple[float, float]
    radius_of_gyration: float
    sides: RestingSides
    surface_height: float
    arm_length: float
    kappa: float
    gravity: float | None
    flight: str
    flip: str
    goal: Goal | None
    cavity: Cavity | None
    tray: Tray | None
    world: World
    effects: Effects
    tolerance: Mapping[str, Deviation]
    feedback: Feedback | None
    file: str | None
    text: Mapping[str, Any]

    @classmethod
    def of(cls, structure: object, file: str | None) -> Scene:
        """Check and resolve what TOML held; `limitsets.load` also reads names, files and text.

        Raises
        ------
        SceneError
            For the first thing wrong, with file, key, value, what is allowed and what to do.
        """
        from limitsets.feeder.scene.build import resolved  # lazily: a `Scene` may be all that is needed

        return cls(**resolved(structure, file))

    def __eq__(self, other: object) -> bool:
        """Two scenes are equal that are written in the same words, wherever they were read."""
        return self.text == other.text if isinstance(other, Scene) else NotImplemented

    def __repr__(self) -> str:
        """Name it, with its sizes; `print` shows its tables."""
        arm, kappa = f"arm {self.arm_length:g} {self.unit}", f"kappa {self.kappa:g} {self.unit}"
        return f"Scene({self.name!r}, {len(self.sides)} sides, {arm}, {kappa})"

    def __str__(self) -> str:
        return "\n\n".join(table.text() for table in self.tables())

    def __hash__(self) -> int:
        return hash((self.name, self.unit, self.kappa, self.arm_length))

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        unit, sides = self.unit, self.sides
        rows = [
            (side, float(sides.length[side]), float(sides.a[side]), float(sides.d[side]))
            for side in range(len(sides))
        ]
        columns = (
            "side",
            Column("length", unit, ".5g"),
            Column("centre of mass from the left end", unit, ".5g"),
            Column("centre of mass above it", unit, ".5g"),
        )
        values: dict[str, object] = {
            f"arm length [{unit}]": self.arm_length,
            f"arm surface height [{unit}]": self.surface_height,
            f"kappa [{unit}]": self.kappa,
            f"radius of gyration [{unit}]": self.radius_of_gyration,
            "flight": self.flight,
            "flip": self.flip,
            "goal": None if self.goal is None else self.goal.question(unit),
        }
        return Table(columns, rows, self.name), facts("Arm and throw", values)

    @cached_property
    def map(self) -> Throw | FullThrow:
        """The throw map of the scene, as kernels take it, with the effects it switches on."""
        if not self.effects.words:
            return self.bare_map
        from limitsets.feeder.thrower.full import with_effects  # lazily: it loads numba

        return with_effects(self.bare_map, self.effects.words, self._facts())

    def map_of_seed(self, seed: int) -> Throw | FullThrow:
        """Give the map with the scatter of another seed; `map` has seed 0, and without scatter all are the same.

        Raises
        ------
        SceneError
            A seed that is no whole number from 0.

        Examples
        --------
        >>> from limitsets.scene import load
        >>> scene = load("paper-designed")
        >>> scene.map_of_seed(3) is scene.map
        True
        """
        if not (isinstance(seed, int) and 0 <= seed < 2**53):
            raise SceneError("the seed", seed, "a whole number from 0", "correct it", file=self.file)
        if self.effects.spread is None:
            return self.map
        full = cast("FullThrow", self.map)
        return full._replace(effects=tuple(
            each._replace(seed=float(seed)) if "seed" in each._fields else each for each in full.effects
        ))  # fmt: skip

    def _facts(self) -> World:
        """Return the world with its scatter of the speed as a share, where the scene knows the speed."""
        scatter = self.world.scatter
        if scatter is None or scatter.speed is None or scatter.speed.relative:
            return self.world
        share = Deviation(scatter.speed.value / self.value("throw.speed"), relative=True)
        return replace(self.world, scatter=replace(scatter, speed=share))

    @cached_property
    def bare_map(self) -> Throw:
        """The minimal model's map of the scene, whatever effects it switches on."""
        from limitsets.feeder.thrower import throw_map  # lazily: it loads numba

        return throw_map(
            a=self.sides.a,
            d=self.sides.d,
            length=self.sides.length,
            corner=self.sides.corner,
            radius_of_gyration=self.radius_of_gyration,
            kappa=self.kappa,
            surface_height=self.surface_height,
            arm_length=self.arm_length,
            flight=self.flight,
            flip=self.flip,
        )

    @cached_property
    def domain(self) -> Domain:
        """Where the part can rest on each side, from just beyond the least x with a flight to the arm's end.

        A side on which it cannot rest, a chamfer, has no states: its box is empty, at the arm's end.
        """
        from limitsets.systems.cells import Domain

        a, rests = self.sides.a, self.sides.rests
        lo, hi = resting_places(a, self.arm_length)
        return Domain(np.where(rests, lo, hi)[:, None], hi[:, None], np.where(rests, a, 0.0))

    def value(self, name: str) -> float:
        """Give the value of a quantity.

        Parameters
        ----------
        name : str
            A name of `limitsets.scene.NAMES`, with numbers for i: ``"part.sides[1]"``.

        Returns
        -------
        float
            In the scene's units: lengths in `unit`, angles in rad, speeds in rad/s, masses in kg.

        Raises
        ------
        SceneError
            No such quantity, or this scene does not give it.

        Examples
        --------
        >>> from limitsets.scene import load
        >>> load("paper-designed").value("arm.length")
        28.0
        """
        find(name, file=self.file)  # an error names the file
        text = text_at(self.text, name)
        if text is not None:
            return in_units(self.unit, name, text)
        derived = {
            "throw.kappa": self.kappa,
            "throw.speed": None if self.gravity is None else math.sqrt(self.gravity / self.kappa),
            "gravity.acceleration": self.gravity,
            "part.mass.radius_of_gyration": self.radius_of_gyration,
        }
        number = derived.get(name)
        if number is None:
            remedies = {"throw.speed": "add [gravity]", NOISE_ONLY: "it names the noise of landings only"}
            remedy = remedies.get(name, "it is given in other words here")
            raise SceneError(
                "the quantity", name, "a quantity that the scene gives", remedy, key=name, file=self.file
            )
        return number

    def with_values(self, values: Mapping[str, float | str]) -> Scene:
        """Give the scene with other values; everything that follows from them is computed anew.

        The scene keeps its unit of length.  Naming throw.speed in a scene given by throw.kappa replaces it (the scene
        needs [gravity] then), and the other way round; likewise gravity.tilt and gravity.acceleration.

        Parameters
        ----------
        values : mapping of str to float or str
            By name of the quantity, text with a unit (``"150 deg/s"``), or numbers in the scene's units: lengths in
            `unit`, but angles in rad and speeds in rad/s.  A bare speed at which a part thrown from the arm's end
            would turn more than 100 times is refused: it is meant in deg/s; as text it is taken.  Another gravity
            beside throw.kappa changes no throw; a warning says so where neither kappa nor speed is named with it.

        Returns
        -------
        Scene

        Raises
        ------
        SceneError
            An unknown quantity, one that this scene is not written in, or a scene that cannot be.

        Examples
        --------
        >>> from limitsets.scene import load
        >>> load("paper-designed").with_values({"arm.length": 30, "throw.kappa": "2 ft"}).kappa
        24.0
        """
        made = Scene.of(replaced(self.text, self.unit, self.file, values), self.file)
        self._require_sides(made)
        speed = values.get("throw.speed")
        most_turns = turns(made.arm_length, made.kappa)
        if not values.keys() & {"throw.speed", "throw.kappa"} and "kappa" in made.text["throw"]:
            self._warn_of_gravity(made)
        if isinstance(speed, str | None) or most_turns <= MOST_TURNS:
            return made
        # a number of deg/s, most often: no throw from the outer half of the arm lands within a turn
        raise SceneError(
            "this angular speed",
            f"{float(speed):g} rad/s",
            f"a speed whose throws land: a part thrown from the arm's end would turn {most_turns:.0f} times",
            f'a bare number is read in rad/s: write "{float(speed):g} deg/s", or the text "{float(speed):g} rad/s"',
            key="throw.speed",
            file=self.file,
        )

    def _require_sides(self, made: Scene) -> None:
        """Refuse values that change which vertices are corners of the hull: its sides would bear other numbers."""
        before, after = corners_of(self.text["part"]), corners_of(made.text["part"])
        if tuple(before) != tuple(after):
            remedy = "sides are edges of the hull: write it as a scene of its own"
            allowed = f"an outline whose hull has the corners {', '.join(map(str, before))}"
            corners = f"one with the corners {', '.join(map(str, after))}"
            raise SceneError(
                "the hull of the part", corners, allowed, remedy, key="part.vertices", file=self.file
            )

    def _warn_of_gravity(self, made: Scene) -> None:
        """Say that another gravity changes no throw where it is given by kappa."""
        if self.gravity is None or made.gravity is None:
            return
        if not math.isclose(self.gravity, made.gravity, rel_tol=_SAME):
            warnings.warn(
                "[gravity] changes no throw beside throw.kappa, only the speed that it stands for: "
                "give throw.speed, too, for other throws, or throw.kappa to keep them without this warning",
                stacklevel=3,
            )

    def as_dict(self) -> dict[str, Any]:
        """Give the scene as it was written, as plain tables and lists that `limitsets.load` reads again."""
        return copy.deepcopy(dict(self.text))


def require_rests(scene: Scene) -> None:
    """Refuse a part with a side on which it cannot rest, where nothing is known of what it does there.

    Raises
    ------
    AnswerError
        With the side, and the way out.
    """
    tips = np.flatnonzero(~scene.sides.rests).tolist()
    if tips:
        where = f"one that cannot rest on side {' and '.join(map(str, tips))}"
        allowed = "a part that rests on each of its sides"
        raise AnswerError("the part", where, allowed, f"{WITHOUT_EDGE}, without [effects]", file=scene.file)


# ----------------------------------------------------------------
# The units in which a scene writes its quantities, for what is told of them and for scenes that are made of it.


def unit_of(scene: Scene, name: str) -> str:
    """Give the unit in which a scene writes a quantity, or the usual one of its dimension.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> unit_of(load("paper-designed"), "throw.kappa"), unit_of(load("paper-designed"), "throw.speed")
    ('in', 'deg/s')
    """
    return unit_read(scene.text, scene.unit, name)


def in_unit_of(scene: Scene, name: str, value: float) -> float:
    """Give a value in the scene's units (`Scene.value`) in the unit that `unit_of` names.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> round(in_unit_of(load("paper-designed"), "throw.speed", 3.141592653589793), 9)
    180.0
    """
    base = base_unit(find(name).dimension, scene.unit)
    unit = unit_of(scene, name)
    return value if unit == base else value * float(exact_factor(base, unit))


def in_units_of(scene: Scene, like: Scene, names: Iterable[str], decimals: int | None = None) -> Scene:
    """Write quantities of a scene in the units of another one, with so many decimals where they are given.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> fast = load("paper-designed").with_values({"throw.speed": 3.0})
    >>> in_units_of(fast, load("paper-designed"), ["throw.speed"], decimals=2).text["throw"]
    {'speed': '171.89 deg/s'}
    """
    values: dict[str, float | str] = {}
    for name in names:
        value, unit = in_unit_of(like, name, scene.value(name)), unit_of(like, name)
        values[name] = written(value, unit) if decimals is None else f"{value:.{decimals}f} {unit}"
    return scene.with_values(values)
