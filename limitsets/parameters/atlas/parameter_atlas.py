"""The atlas: what a task says at every point of one or two axes, kept in a store that can be continued."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import (
    Column,
    LimitsetsError,
    MapError,
    Progress,
    Table,
    Tabled,
    arguments_checked,
    as_plain,
    locked,
    shown_in_notebooks,
)
from limitsets.base.campaign import Work, chosen_pool, drive, imported
from limitsets.feeder.scene import Model, Scene, load
from limitsets.parameters.atlas.classes import UNDECIDED_NAME
from limitsets.parameters.atlas.plan import Plan, chunk_shape, code_of, codes_of, named, resolved
from limitsets.parameters.atlas.store import CHECKSUM, SEAL, Store
from limitsets.parameters.atlas.subjects import Axis, MapSubject, SceneSubject, Subject, axis_of
from limitsets.parameters.atlas.work import STEP, answer
from limitsets.systems.cells import Domain, as_domain
from limitsets.systems.maps import coerce, domain_of
from limitsets.systems.maps.contract import compiled_kind_of, require_dimension
from limitsets.systems.maps.written import modules_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from limitsets.parameters.regions import Regions, RegionsOfMap
    from limitsets.systems.cells import Grid


# By the public names: stores and plans hold them.
TOPOLOGY, MORSE = "limitsets.sweep.of_topology:topology", "limitsets.sweep.of_morse:morse"


@dataclass(frozen=True, eq=False)
class Atlas(Tabled):
    """What a task said at every point of a plan.

    Attributes
    ----------
    dataset : xarray.Dataset
        One variable for each answer, on the axes of the plan; codes have their names in attributes.  That of a store is
        read when it is used.
    store : Path or None
        Where it is kept.
    new, kept : int
        How many chunks were computed now, and by earlier calls.
    map : NamedTuple or None
        The map whose parameters vary; None of an atlas of a scene.
    """

    dataset: xr.Dataset
    store: Path | None
    new: int
    kept: int
    map: Any = None

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the quantities, the slowest first."""
        return tuple(axis["name"] for axis in self.dataset.attrs["plan"]["axes"])

    @property
    def model(self) -> Model | None:
        """Of which model the answers are, and which facts of the scene that leaves out; None of a map."""
        plan = self.dataset.attrs["plan"]
        return Model.of(load(plan["scene"])) if "scene" in plan else None

    @property
    def _how(self) -> str:
        """How the answers were found, and of which model."""
        return "sampled, not proved" + ("" if self.model is None else f"; {self.model.sentence}")

    def to_dataframe(self) -> pd.DataFrame:
        """Give a table with a row for each point, a column for each variable, and one for each entry of an array.

        Attractors beyond the most that a point has are left out.
        """
        pd = imported("pandas")
        data, columns = self.dataset, {}
        if "attractors" in data and "attractor" in data.sizes:
            data = data.isel(attractor=slice(max(int(data["attractors"].max()), 1)))
        for name, variable in data.data_vars.items():
            more = [dim for dim in variable.dims if dim not in self.axes]
            for places in product(*(range(data.sizes[dim]) for dim in more)):
                label = f"{name}[{','.join(map(str, places))}]" if places else str(name)
                columns[label] = variable.isel(dict(zip(more, places, strict=True))).values.ravel()
        names = [str(axis) for axis in self.axes]
        index = pd.MultiIndex.from_product([data[name].values for name in names], names=names)
        return pd.DataFrame(columns, index=index).reset_index()

    def table(self) -> Table:
        """Give the table of `to_dataframe`, with units in the heads."""
        frame, data = self.to_dataframe(), self.dataset
        columns = [
            Column(head, "" if name not in data else str(data[name].attrs.get("units", "")))
            for head in map(str, frame.columns)
            for name in [head.partition("[")[0] if head not in data else head]
        ]
        return Table(columns, frame.itertuples(index=False), "Atlas", self._how)

    def tables(self) -> tuple[Table, ...]:
        """Give what the answers range over."""
        rows = [self._range(str(name)) for name in sorted(self.dataset, key=str)]
        caption = f"Atlas over {' and '.join(self.axes)}"
        return (Table(("variable", "values", "unit", "what"), rows, caption, self._how),)

    def _range(self, name: str) -> tuple[str, str, str, str]:
        """Say what one variable ranges over, apart from where there is nothing; of codes how many points have each."""
        variable = self.dataset[name]
        values, attributes = np.asarray(variable.values), variable.attrs
        if "flag_meanings" in attributes:
            counts = [
                (word.replace("_", " "), int((values == code).sum()))
                for word, code in codes_of(attributes).items()
            ]
            if name == "class":  # their names are codes: the legend has words for them
                met = {word: count for word, count in counts if count}
                doubt = met.pop(UNDECIDED_NAME, 0)
                counts = [("classes", len(met)), ("undecided", doubt)]
            return name, ", ".join(f"{word}: {count}" for word, count in counts if count), "", ""
        good = values[np.isfinite(values) if values.dtype.kind == "f" else values >= 0]
        ends = [f"{end:.9g}" for end in dict.fromkeys((good.min(), good.max()))] if good.size else []
        said = "none" if not ends or (name == "period" and ends == ["0"]) else " to ".join(ends)
        return name, said, attributes.get("units", ""), attributes.get("long_name", "")

    def to_json(self) -> dict[str, Any]:
        """Give the document of docs/json.md: the scene, the axes, and every variable as nested lists."""
        data, plan = self.dataset, self.dataset.attrs["plan"]
        axes = [
            {"name": name, "unit": data[name].attrs.get("units", ""), "values": as_plain(data[name].values)}
            for name in self.axes
        ]
        variables = {str(name): _table(variable) for name, variable in data.data_vars.items()}
        subject = {key: plan[key] for key in ("scene", "map", "parameters", "domain") if key in plan}
        model = self.model
        return {
            **subject,
            "unit": data.attrs.get("unit_of_length", ""),
            "axes": axes,
            "variables": variables,
            **({} if model is None else {"model": model.to_json()}),
            "task": plan["task"],
            "plan_hash": data.attrs["plan_hash"],
            "versions": plan["versions"],
        }

    def certify(
        self,
        grid: Grid | None = None,
        claims: Sequence[str] | None = None,
        *,
        depth: int | None = None,
        executor: Executor | None = None,
        progress: Progress | None = None,
        **asked: Any,
    ) -> Regions | RegionsOfMap:
        """Cut the window into cells of parameters, and prove of each what holds for all its parameters.

        Parameters
        ----------
        grid, claims
            Of a map alone: the cells of its domain, and what is claimed (`limitsets.regions.certified_map`).
        depth : int, optional
            Of a scene, whose window is cut into as many cells as there are points: how often a cell is halved along
            both axes while it is undecided, by default 2.  Of a map: how often the whole window is halved, by default
            8.
        executor : concurrent.futures.Executor, optional
            Of a scene alone: where the cells are done; here by default.
        progress : callable, optional
            Told ``(step, done, of)``.
        **asked
            Of a map alone: `ends`, `starts`, `share`, `first` and `seconds` of `limitsets.regions.certified_map`.

        Returns
        -------
        Regions or RegionsOfMap
            Codes, regions and a certificate to save.

        Raises
        ------
        LimitsetsError
            For an atlas of a scene along one axis, or arguments of the other kind of atlas.

        Examples
        --------
        >>> import limitsets as ls
        >>> task = "limitsets.parameters.atlas.examples:critical_points"
        >>> x, y = "throw.speed=157 deg/s:158 deg/s:2", "arm.surface_height=-0.2:-0.15:2"
        >>> found = ls.atlas("paper-designed", x, y, task=task)
        >>> found.certify().shares()["proved"]
        1.0
        >>> found = ls.atlas(ls.maps.Logistic(2.0), "r=2:2.5:5")
        >>> found.certify(ls.grid([(0.1, 0.9)], cells=256), ["attracts-all", "trapping"]).shares()["proved"]
        Fraction(1, 1)
        """
        from limitsets.parameters.regions import (  # lazily: an atlas without proofs does not load them
            certified,
            certified_map,
            evenly,
        )

        plan = self.dataset.attrs["plan"]
        levels: dict[str, Any] = {} if depth is None else {"depth": depth}
        if self.map is not None:
            if executor is not None or grid is None:
                thing, given = ("executor", "given") if grid is not None else ("grid", None)
                raise LimitsetsError(
                    f"the argument {thing} of certify",
                    given,
                    "cells, and no executor, of an atlas of a map",
                    "ask so: .certify(limitsets.grid([(lo, hi)], cells=1024), claims)",
                )
            ends = [{name: float(self.dataset[name].values[end]) for name in self.axes} for end in (0, -1)]
            lower, upper = (MapSubject(self.map, None).at(values) for values in ends)
            return certified_map(lower, grid, claims, upper=upper, progress=progress, **levels, **asked)
        if grid is not None or claims is not None or asked:
            given = ", ".join(["grid"] * (grid is not None) + ["claims"] * (claims is not None) + [*asked])
            raise LimitsetsError(
                "the arguments of certify", given, "none of these of an atlas of a scene", "leave them out"
            )
        if len(self.axes) != 2:
            raise LimitsetsError(
                "the atlas", f"of {len(self.axes)} axes", "one with two axes", "give x and y"
            )
        axes = []
        for name in reversed(self.axes):  # x first
            values, unit = self.dataset[name].values, self.dataset[name].attrs["units"]
            first, last = (f"{float(each)!r} {unit}" for each in (values[0], values[-1]))
            axes.append(evenly(name, first, last, values.size))
        x, y = axes
        return certified(load(plan["scene"]), x, y, executor=executor, progress=progress, **levels)


def _table(variable: xr.DataArray) -> dict[str, Any]:
    codes = codes_of(variable.attrs)
    return {
        "dims": list(variable.dims),
        "unit": variable.attrs.get("units", ""),
        "values": as_plain(variable.values),
        **({"codes": codes} if codes else {}),
    }


@shown_in_notebooks
@arguments_checked
def atlas(
    subject: Any,
    x: str | Axis,
    y: str | Axis | None = None,
    *,
    task: str | Callable[..., Any] | None = None,
    variables: Sequence[str] | None = None,
    options: Mapping[str, Any] | None = None,
    domain: Any = None,
    chunk: Sequence[int] | None = None,
    seed: int = 0,
    refine: bool | str = False,
    coarse: int = STEP,
    store: str | Path | None = None,
    executor: Executor | None = None,
    cluster: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Atlas:
    """Map one or two parameters of a scene, or of any map, to what a task says at each point.

    Parameters
    ----------
    subject : Scene, str, or a map's parameters
        What is varied: a scene or the name of one, or the parameters of a registered map.
    x, y : str or Axis
        ``"throw.speed=120:180:1000"``: a quantity of the scene or a field of the parameters, its ends, and how many
        values.  The ends are in the unit in which the scene gives the quantity (speeds else in deg/s, lengths else in
        that of the arm), or have units: ``"throw.speed=120 deg/s:180 deg/s:1000"``.  Without y: one parameter.
    task : str or callable
        What is asked of each point: an importable function, or ``"module:function"``.  It takes a scene (or a map's
        parameters), and `seed` if it has such an argument, and returns numbers, or arrays of them, by name; or it is
        registered for blocks of points (`limitsets.sweep.block_task`).  By default: the topology of the attractors.
    variables : sequence of str, optional
        Those that are wanted.
    options : mapping, optional
        Keyword arguments of the task.
    domain : Domain or array_like, optional
        Of a map, for tasks that need one; see `limitsets.grid`.  Textbook maps have one of their own.
    chunk : sequence of int, optional
        Points of a chunk along y and x (or x); chosen by the number of points otherwise.
    seed : int
        Of all random numbers; each point has its own by its number.
    refine : bool or str
        True: compute a coarse grid, and then only the points near boundaries of classes; the rest is filled from the
        nearest computed corner and marked by `level` -1 (docs/atlas.md).  A name: of another variable than `class`
        whose changes are the boundaries.
    coarse : int
        Step of the coarse grid, in points along each axis.
    store : str or Path, optional
        A folder for the results.  If it holds a part of them already, only the rest is computed.
    executor : concurrent.futures.Executor, optional
        It computes the chunks; processes on this machine otherwise.
    cluster : str, optional
        Instead: the address of a Dask scheduler.
    workers : int, optional
        How many processes, as many as there are cores otherwise.
    progress : callable, optional
        Told ``(step, done, of)``.

    Returns
    -------
    Atlas

    Raises
    ------
    LimitsetsError
        For an unknown quantity or variable, a task that cannot be imported or fails, a store of another plan.

    Notes
    -----
    Results do not depend on the executor, the number of workers, or the order in which chunks are done.

    Examples
    --------
    >>> import limitsets as ls
    >>> task = "limitsets.parameters.atlas.examples:critical_points"
    >>> found = ls.atlas("paper-designed", "throw.kappa=25.3778518:26.3778518:2", task=task)
    >>> found.dataset.critical_point.values[0].round(5).tolist()  # the speed that the paper designed
    [10.0, 10.0, 20.0]
    """
    plan = plan_of(
        subject, x, y, task=task, variables=variables, options=options, domain=domain, chunk=chunk, seed=seed,
        refine=refine, coarse=coarse,
    )  # fmt: skip
    path = None if store is None else Path(store)
    imported("xarray")
    with nullcontext() if path is None else locked(path):
        held = Store(plan, path)
        kept, of = len(held.done), math.prod(plan.chunks)
        if kept < of:
            if executor is None and cluster is None and of > 1:
                _require_importable(plan)
            with chosen_pool(of, executor, cluster, workers) as (pool, window):
                drive(_work(plan), held, pool, window, progress)
    varied = plan.subject.params if isinstance(plan.subject, MapSubject) else None
    return Atlas(opened(held.group.store), path, of - kept, kept, varied)


def opened(store: Any) -> xr.Dataset:
    """Open what a store holds, without the marks of its chunks."""
    dataset = imported("xarray").open_zarr(store, chunks=None, consolidated=False, decode_timedelta=False)
    for variable in dataset.variables.values():
        variable.attrs.pop(SEAL, None)
    return dataset.drop_vars(CHECKSUM)  # type: ignore[no-any-return]  # a Dataset


def plan_of(
    subject: Any,
    x: str | Axis,
    y: str | Axis | None = None,
    *,
    task: str | Callable[..., Any] | None = None,
    variables: Sequence[str] | None = None,
    options: Mapping[str, Any] | None = None,
    domain: Any = None,
    chunk: Sequence[int] | None = None,
    seed: int = 0,
    refine: bool | str = False,
    coarse: int = STEP,
) -> Plan:
    """Make the plan of an atlas, and refuse one that cannot be carried out (`atlas`)."""
    chosen = _subject(subject, domain)
    axes = tuple(axis_of(each, chosen.unit_of) for each in ((x,) if y is None else (y, x)))
    box = chosen.domain if isinstance(chosen, MapSubject) else None
    usual = TOPOLOGY if box is None or box.dimension == 1 else MORSE
    name = named(usual if task is None else task)
    resolved(name)
    shape = tuple(axis.values.size for axis in axes)
    parts = chunk_shape(shape, name) if chunk is None else tuple(int(n) for n in chunk)
    if len(parts) != len(shape) or min(parts) < 1:
        raise LimitsetsError("the chunk", parts, f"{len(shape)} numbers from 1", "give one for each axis")
    parts = tuple(min(step, n) for step, n in zip(parts, shape, strict=True))
    if refine and coarse < 2:
        raise LimitsetsError("the step of the coarse grid", coarse, "2 or more", "correct it")
    by = None if refine is False else ("class" if refine is True else refine, int(coarse))
    wanted = None if variables is None else tuple(dict.fromkeys((*variables, *(by or ())[:1])))
    plan = Plan(
        subject=chosen,
        axes=axes,
        task=name,
        options=dict(options or {}),
        variables=wanted,
        chunk=parts,
        code=code_of(chosen, name),
        seed=seed,
        refine=by,
    )
    plan.require()
    return plan


def _subject(subject: Any, domain: Any) -> Subject:
    if isinstance(subject, str | Path):
        subject = load(subject)
    if isinstance(subject, Scene):
        if domain is not None:
            raise LimitsetsError(
                "the domain", "given", "none beside a scene", "a scene has one: leave it out"
            )
        return SceneSubject(subject)
    compiled_kind_of(subject, "the atlas")
    chosen = coerce(subject)
    box = _own_domain(chosen) if domain is None else as_domain(domain)
    if box is not None:
        require_dimension(subject, "domain", box.dimension)
        box.require_ends("the domain of the atlas")
    return MapSubject(chosen, box)


def _own_domain(params: Any) -> Domain | None:
    """Give the domain of a textbook map; other maps have none of their own."""
    try:
        return as_domain(domain_of(params))
    except MapError:
        return None


def _work(plan: Plan) -> Work:
    """Give the chunks of a plan to be computed."""
    return Work(
        chunks=math.prod(plan.chunks),
        function=answer,
        given=(plan,),
        size=lambda number: math.prod(part.stop - part.start for part in plan.region(number)),
        place=lambda number: plan.words(plan.region(number)),
        task=f"the task {plan.task}",
        name="atlas",
        points="points",
    )


def _require_importable(plan: Plan) -> None:
    """Refuse what stands in the script itself: processes cannot import it by its name."""
    modules = {plan.task.partition(":")[0]}
    if isinstance(plan.subject, MapSubject):
        modules |= modules_of(type(plan.subject.params))
    if "__main__" in modules:
        raise LimitsetsError(
            "the task or the map", "one of the script itself", "one of a file that other processes import",
            "move it to a file, or pass executor=concurrent.futures.ThreadPoolExecutor(1)",
        )  # fmt: skip
