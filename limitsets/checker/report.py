"""A file from first to last, and the report about it.

docs/certificates.md, "Checking one": the words of a verdict, and what is printed.
"""

import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from html import escape
from typing import Any

import flint

from .any_map import map_in_words
from .balls import PRECISION, reason_of
from .brackets import UNIFORM, Chances, bounds_of_laws, chances_in_words, check_chances, read_chances
from .cells import Crew, Progress, added_up, extents, scene_of_box
from .claims import CLAIMS, check_box_claims, failing, read_claims
from .entropy import read_entropy
from .feeding import verdict_of_feeds
from .file import (
    KINDS,
    Arrays,
    BadFileError,
    Cells,
    is_whole,
    model_in_words,
    open_certificate,
    plain,
    quantity,
    read_boxes,
    read_cells,
    read_sections,
    require,
    table,
)
from .goals import content_of_goal, goal_of_scene
from .long_run import LongRun, check_long_run, long_run_in_words, read_long_run
from .map_cells import check_map_task, map_of_box
from .map_claims import check_parts, work_of_maps
from .map_file import NOISY, MapFile, read_map_file
from .map_plane import region_in_words
from .model import FORMULAS
from .observable import Allowed, read_average
from .plane import (
    Plane,
    area_shares,
    check_codes,
    check_regions,
    claims_of_cells,
    plane_in_words,
    raster_of,
    read_plane,
)
from .policy import Policy, check_images, check_policy, policy_in_words, read_policy
from .policy_chances import (
    PolicyChances,
    check_policy_chances,
    policy_chances_in_words,
    read_policy_chances,
)
from .region import check_region_cell
from .scene import (
    Scene,
    check_by_halves,
    check_parameters,
    check_tolerance,
    is_exact,
    left_out,
    quantities,
    read_scene,
)
from .starts import shares

MOST_OPEN = 0.01  # the share of the arm that may be open where a goal is proved from some x on
NO_GOAL = "of the scene's own goal nothing is claimed"
WORDS = {  # the verdicts, in JSON and for people
    "proved": "PROVED",
    "proved-on-cells": "PROVED ON CELLS",
    "refuted": "REFUTED",
    "failed": "FAILED",
    "not rechecked": "NOT RECHECKED",
    "bad file": "BAD FILE",
}
EXITS = {"proved": 0, "proved-on-cells": 1, "refuted": 1, "failed": 1, "bad file": 2}


@dataclass
class Report:
    """The verdict on a certificate.

    Attributes
    ----------
    verdict : str
        "proved", "proved-on-cells", "refuted", "failed" or "bad file".
    claims : list of tuple
        (claim, a word of `WORDS`, reason).
    starts : str, dict or None
        Those of the goal, as the certificate has them.
    share : float or None
        Share of the arm, or of the ranges in which parts are laid down, for whose starts the goal is proved: a lower
        bound.
    explained : float or None
        Share of the arm with the starts that are proved to be lost or to creep to the joint: a lower bound.
    open : float or None
        Share of the arm with the other starts: an upper bound.
    fed : dict of str to float, or None
        Of the claim `feeds`: shares of the arm for whose starts each part is proved.
    area : dict of str to float, or None
        Of a plane: the shares that are proved, refuted and undecided.
    statement : list of str
        What is proved, in sentences.
    parameters : dict of str to str
        Quantities of the scenes.
    relied_on : list of str
        What the verdict relies on.
    model : dict, or None
        ``{"simulated": [...], "left_out": [...], "assumptions_broken": None}``: effects that the verdict has, facts of
        the scene's [world] that it has not; nobody looked which assumptions the scene breaks.
    reason : str
        Why the certificate fails, empty where it does not.
    map : dict, or None
        Of a certificate of a map: ``{"dimension", "sides", "branches", "formulas": [...], "boxes": [...]}``, by box of
        parameters ``{"parameters": [...], "holds_for", "verdict", "claims": [...]}``, by claim name, a word of `WORDS`,
        and what is proved or why not.
    seconds : float
        Time of the recheck.
    cells, boxes : int
        Number of cells, and of boxes of parameters.
    """

    verdict: str = "failed"
    claims: list[tuple[str, str, str]] = field(default_factory=list)
    starts: Any = None
    share: float | None = None
    explained: float | None = None
    open: float | None = None
    fed: dict[str, float] | None = None
    area: dict[str, float] | None = None
    statement: list[str] = field(default_factory=list, repr=False)
    parameters: dict[str, str] = field(default_factory=dict, repr=False)
    relied_on: list[str] = field(default_factory=list, repr=False)
    model: dict[str, Any] | None = field(default=None, repr=False)
    map: dict[str, Any] | None = field(default=None, repr=False)
    reason: str = ""
    seconds: float = 0.0
    cells: int = 0
    boxes: int = 0

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        rows = [(name, WORDS[state], why) for name, state, why in self.claims]
        rows.append(("certificate", WORDS[self.verdict], self.reason))
        lines = "".join(
            "<tr>" + "".join(f"<td>{escape(text)}</td>" for text in row) + "</tr>" for row in rows
        )
        heads = "".join(f'<th scope="col">{head}</th>' for head in ("claim", "verdict", "reason"))
        caption = "Recheck" if self.model is None else f"Recheck, {model_in_words(self.model)}"
        body = f"<thead><tr>{heads}</tr></thead><tbody>{lines}</tbody>"
        return f"<table><caption>{escape(caption)}</caption>{body}</table>"


@dataclass
class Certificate:
    """The content of a file: read, and not yet believed."""

    raw: list[dict[str, Any]]  # the scene of each box, as written
    parameters: list[object]  # of each box, as the producer computed them
    noise: object
    tolerance: object
    scenes: list[Scene]
    cells: list[Cells]
    claims: dict[str, dict[str, Any]]  # those that can be checked
    unknown: list[tuple[str, str, str]]  # and those that cannot


OF_SCENES = "format version noise tolerance boxes claims arrays"  # keys of a header, in each version


def in_version_3(header: dict[str, Any]) -> dict[str, Any]:
    """Return the header of a file as version 3 has it, where it is of version 2 too; raises BadFileError."""
    version = header.get("version")
    right = header.get("format") == "limitsets-proof" and is_whole(version, 1, 3)
    require(right, "the format is not limitsets-proof, version 2 or 3")
    require(version != 1, "version 1 of the format is not read any more: prove the scene again")
    if version == 3:
        return header
    table(header, "header.json", f"map {OF_SCENES}", "state producer")
    model = dict(table(header["map"], "map", "name version flight flip", "formulas"))
    model.pop("formulas", None)  # like `state` for people
    first = is_whole(model.pop("version"), 1, 1) and model.pop("name") == "throw"
    require(first, "the map is not throw, version 1")
    return {word: header[word] for word in OF_SCENES.split()} | {"version": 3, "scene": model}


def require_model(header: dict[str, Any], scenes: list[dict[str, Any]]) -> None:
    """Require that the header names the model of all scenes."""
    model = table(header["scene"], "scene", "flight flip")
    require(all(scene["model"] == model for scene in scenes), "the header and a scene name different models")


def read_certificate(header: dict[str, Any], entries: dict[str, memoryview]) -> Certificate:
    """Read the content of a file; raises BadFileError."""
    boxes = read_boxes(header["boxes"], "scene parameters", 5_000)
    raw = [b["scene"] for b in boxes]
    scenes = [read_scene(scene, header["noise"]) for scene in raw]
    require_model(header, raw)
    arrays = Arrays(header["arrays"], entries)
    n_sides = len(scenes[0].sides)
    require(all(len(s.sides) == n_sides for s in scenes), "the boxes do not have the same number of sides")
    cells = [read_cells(arrays, box["prefix"], n_sides) for box in boxes]
    claims, unknown = read_claims(header["claims"], n_sides)
    allowed = Allowed(n_sides, 2, [])
    for name, reader in (("average", read_average), ("entropy", read_entropy)):
        if name in claims:
            read = reader(claims[name], arrays, boxes[0]["prefix"], allowed, f"section of {name}")
            claims[name] = {"read": read, "cells": cells[0]}
    arrays.require_no_others()
    return Certificate(
        raw,
        [box["parameters"] for box in boxes],
        noise=header["noise"],
        tolerance=header["tolerance"],
        scenes=scenes,
        cells=cells,
        claims=claims,
        unknown=unknown,
    )


def recheck(
    path: str | os.PathLike[str],
    workers: int | None = None,
    progress: Progress = None,
) -> Report:
    """Check the certificate in a file.

    Parameters
    ----------
    path
        The file.
    workers
        Number of processes; all processors of this process if None.  Small certificates are checked in this one.
    progress
        Called now and then with the number of cells done and the number of all.
    """
    begun = time.perf_counter()
    report = Report()
    if workers is None:
        workers = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    before = flint.ctx.prec
    flint.ctx.prec = PRECISION
    try:
        check_certificate(path, workers, progress, report)
    except BadFileError as error:
        report = Report(verdict="bad file", reason=str(error))
    finally:
        flint.ctx.prec = before
    report.seconds = time.perf_counter() - begun
    return report


def check_certificate(path: str | os.PathLike[str], workers: int, progress: Progress, report: Report) -> None:
    """Fill in the report; raises BadFileError."""
    as_written, entries = open_certificate(path)
    header = in_version_3(as_written)
    if "map" in header:
        recheck_map(read_map_file(header, entries), workers, progress, report)
        return
    table(header, "header.json", f"scene {OF_SCENES}", "producer")
    claimed = read_sections(header["claims"])
    alone = next((word for word in ALONE if word in claimed), None)
    if alone is not None:
        read, check, noise_of = ALONE[alone]
        content = read(header, entries)
        require_model(header, [content.raw])
        describe_scene(report, content.raw, noise_of(content), alone)
        bad = reason_of(check, content, workers, progress, report)
        report.verdict = "failed" if bad else "proved"
        report.claims = [(alone, report.verdict, bad)]
        report.reason = f"{alone}: {bad}" if bad else ""
        return
    file = read_certificate(header, entries)
    gap = describe(report, file)
    own = goal_of_scene(file.raw[0], len(file.scenes[0].sides))
    failed = failed_at_once(file, gap, own)
    setup = scene_of_box, list(file.raw), file.noise
    with crew_of(report, setup, workers, progress, work_of(file)) as crew:
        check_boxes(file, crew, failed)
    conclude(report, file, failed, own)


@contextmanager
def crew_of(report: Report, setup: tuple[Any, ...], *how: Any) -> Iterator[Crew]:
    """Give the processes that check cells, until these are checked; the report tells how many boxes they looked at."""
    crew = Crew(setup, *how)
    try:
        yield crew
    finally:
        crew.close()
        report.boxes = crew.boxes


def recheck_map(file: MapFile, workers: int, progress: Progress, report: Report) -> None:
    """Check a certificate of a map, and fill in the report."""
    setup = map_of_box, file.shape, [part.parameters for part in file.parts]
    with crew_of(report, setup, workers, progress, work_of_maps(file), check_map_task) as crew:
        outcomes = list(check_parts(file, crew))
    report.map = {
        "dimension": file.shape.dimension,
        "sides": file.shape.sides,
        "branches": file.shape.branches,
        "formulas": list(map_in_words(file.shape, file.firsts)),
        "boxes": [outcome._asdict() for outcome in outcomes],
    }
    report.cells = sum(len(part.cells.rank) for part in file.parts if part.cells is not None)
    noisy = [part.of_line[name].noisy for part in file.parts for name in NOISY if name in part.of_line]
    report.cells += sum(len(edges) - 1 for each in noisy for edges in each.edges)
    arithmetic = f"the ball arithmetic of python-flint {flint.__version__} (Arb), numpy and Python"
    report.relied_on = ["exact arithmetic of these formulas (no rounding of a computer's orbits)", arithmetic]
    for k, outcome in enumerate(outcomes):
        where = f"box {k}: " if len(outcomes) > 1 else ""
        for name, word, text in outcome.claims:
            good = word in ("proved", "refuted")
            report.claims.append((where + name, word, "" if good else text))
            report.statement += [f"{where}{name}: {text}"] if good else []
    if file.axes:
        words = [{name: word for name, word, _ in outcome.claims} for outcome in outcomes]
        lines, report.map["plane"] = region_in_words(file.axes, file.places, words)
        report.statement = lines + report.statement
    worst = {outcome.verdict for outcome in outcomes if outcome.verdict}
    report.verdict = "failed" if "failed" in worst else "proved" if "proved" in worst else "refuted"
    report.reason = next((f"{name}: {why}" for name, _, why in report.claims if why), "")


def describe_scene(report: Report, raw: dict[str, Any], noise: object, alone: str = "") -> None:
    """Say what a file relies on, and of which scene it is; `alone`: its claim, where that stands alone."""
    tell_model(report, raw, noise)
    if "plate_density" in raw["part"]["mass"] and "vertices" in raw["part"]:
        report.relied_on.append(
            "an outline of the plate that does not cross itself, holes inside it and apart"
        )
    for name, value in quantities(raw):
        if not alone.startswith("policy") or not name.startswith(
            "throw."
        ):  # its throws are those to choose from
            report.parameters[plain(name)] = value_in_words(value, name)


def recheck_plane(plane: Plane, workers: int, progress: Progress, report: Report) -> None:
    """Check regions of a plane, and fill in the report."""
    report.parameters |= {axis.name: axis.between(0, len(axis.texts) - 1) for axis in plane.axes}
    report.parameters["noise (at every throw)"] = "none"
    report.cells = int(plane.first[-1])
    goal = goal_of_scene(plane.raw, plane.n_sides, checked=True)
    raster = raster_of(plane)
    check_codes(plane, goal is not None)
    with crew_of(report, (None,), workers, progress, report.cells, check_region_cell) as crew:
        crew.run(plane.name, claims_of_cells(plane))
    check_regions(plane, raster)
    report.statement = plane_in_words(plane, goal)
    undecided, proved, refuted = (float(share) for share in area_shares(plane))
    report.area = {"proved": proved, "refuted": refuted, "undecided": undecided}


def of_chain(
    in_words: Callable[[Any], list[str]], check: Callable[[Any, Callable[[int], None]], None]
) -> Callable[[Any, int, Progress, Report], None]:
    """Give the recheck of a claim about a noisy chain, from what puts the claim in words and what checks it."""

    def recheck_chain(c: Any, _: int, progress: Progress, report: Report) -> None:
        describe_chain(c, report, in_words(c))
        with added_up(progress, c.work) as advance:
            check(c, advance)

    return recheck_chain


def noise_of_chain(c: Chances | LongRun | PolicyChances) -> object:
    """Return the bounds of the laws."""
    return bounds_of_laws(c.setting.laws)


def describe_chain(c: Chances | LongRun | PolicyChances, report: Report, statement: list[str]) -> None:
    """Say what is claimed of a noisy chain, and its laws."""
    for name, (word, text) in c.setting.laws.items():
        said = "uniform, within" if word == UNIFORM else "normal, with a standard deviation of"
        report.parameters[f"law of {name}"] = f"{said} {quantity(text, KINDS, name)}"
    report.cells = sum(len(e) - 1 for e in c.edges)
    report.statement = statement
    if goal_of_scene(c.raw, len(c.setting.scene.sides)) is not None:
        report.statement.append(NO_GOAL)


def recheck_policy(policy: Policy, workers: int, progress: Progress, report: Report) -> None:
    """Check a policy, and fill in the report."""
    report.parameters["noise (at every throw)"] = noise_in_words(policy.game.noise)
    report.cells = len(policy.cells[0].side)
    report.statement = policy_in_words(policy)
    made = check_policy(policy)
    setup = scene_of_box, [each.scene.raw for each in policy.game.choices], policy.game.noise
    with crew_of(report, setup, workers, progress, sum(int(some.sum()) for some in made)) as crew:
        for number, some in enumerate(made):
            check_images(policy, number, some, crew)


ALONE: dict[str, tuple[Callable[..., Any], Callable[..., None], Callable[[Any], object]]] = {
    "region": (read_plane, recheck_plane, lambda _: None),
    "policy": (read_policy, recheck_policy, lambda policy: policy.game.noise),
    "probabilities": (read_chances, of_chain(chances_in_words, check_chances), noise_of_chain),
    "long-run": (read_long_run, of_chain(long_run_in_words, check_long_run), noise_of_chain),
    "policy-chances": (
        read_policy_chances,
        of_chain(policy_chances_in_words, check_policy_chances),
        noise_of_chain,
    ),
}
"""The claims that stand alone in a file: how each is read and checked, and the noise that it has."""


def describe(report: Report, file: Certificate) -> str:
    """Say what the certificate relies on, and for which scenes; return "" or the gap in its tolerance."""
    describe_scene(report, file.raw[0], file.noise)
    ranges, gap = check_tolerance(file.raw, file.tolerance)
    report.parameters |= ranges
    if file.tolerance is not None:
        report.parameters["tolerance (fixed but unknown)"] = deviations_in_words(file.tolerance)
    report.parameters["noise (at every throw)"] = noise_in_words(file.noise)
    report.cells = sum(len(c.side) for c in file.cells)
    return gap


def tell_model(report: Report, scene: dict[str, Any], noise: object) -> None:
    """Say on what formulas and on what arithmetic the report relies, and which facts of the scene it leaves out."""
    on = [name for name, how in scene.get("effects", {}).items() if how]
    report.model = {"simulated": on, "left_out": left_out(scene, noise), "assumptions_broken": None}
    flight, flip = scene["model"]["flight"], scene["model"]["flip"]
    kind = "exact" if flight == "exact" else "small"
    report.relied_on.append(f"the formulas of the map throw, version 1, flight {flight}, flip {flip}")
    for key in ("always", flight, kind, f"{kind} {flip}"):
        report.relied_on += [line for line in FORMULAS[key] if line not in report.relied_on]
    report.relied_on.append(
        f"the ball arithmetic of python-flint {flint.__version__} (Arb), numpy and Python"
    )


def failed_at_once(file: Certificate, gap: str, own: dict[str, Any] | None) -> dict[str, str]:
    """Find the claims that fail without a look at the cells, with the reasons; `own` is the scene's own goal."""
    claims = file.claims
    failed = dict.fromkeys(claims, gap) if gap else {}
    if file.noise is not None and "cycles" in claims:
        failed["cycles"] = "the orbit of the one throw is not that of the other: not with noise"
    if not all(side.landing <= 0 for scene in file.scenes for side in scene.sides) and "end-points" in claims:
        failed["end-points"] = "the landing place moves at every throw: not with noise of it"
    if "feeds" in claims and (file.tolerance is not None or len(file.scenes) > 1):
        failed["feeds"] = "it is about one scene: not with a tolerance"
    single = file.noise is None and file.tolerance is None and len(file.scenes) == 1
    for name in {"average", "entropy"} & set(claims):
        if not (single and is_exact(file.raw[0])):
            failed[name] = "it is about one scene: not with noise, nor with a tolerance or an interval"
    for name in {"goal", "refuted"} & set(claims):
        goal = claims[name].get("goal", claims[name])
        if own is not None and content_of_goal(goal) != content_of_goal(own):
            failed[name] = "the scene in this file has another goal of its own"
    return failed


def work_of(file: Certificate) -> int:
    """Count the cells whose throws are checked, for the progress bar."""
    everywhere = bool({"attracts-all", "feeds"} & set(file.claims)) or file.claims.get("goal", {}).get(
        "all", False
    )
    ranked = "goal" in file.claims
    return sum(
        len(c.side) if everywhere else int(((c.component >= 0) | (ranked & (c.rank >= 0))).sum())
        for c in file.cells
    )


def check_boxes(file: Certificate, crew: Crew, failed: dict[str, str]) -> None:
    """Check all claims for box after box, until all have failed; `failed` gets the first reason of each."""
    claims = file.claims
    for k, (scene, c) in enumerate(zip(file.scenes, file.cells, strict=True)):
        said = file.parameters[k], f"box {k}"
        failures = failing(claims, check_by_halves, scene, check_parameters, *said)
        failures = failures or check_box_claims(scene, c, k, claims, crew)
        for name, reason in failures.items():
            failed.setdefault(name, (f"box {k}, " if len(file.scenes) > 1 else "") + reason)
        scene.parts.clear()  # room
        if len(failed) == len(claims):
            break


def conclude(report: Report, file: Certificate, failed: dict[str, str], own: dict[str, Any] | None) -> None:
    """Put the claims in words and the verdicts into the report."""
    claims = file.claims
    if "goal" in claims and "goal" not in failed:
        tell_starts(report, claims["goal"], file.scenes, file.cells)
    if "feeds" in claims and "feeds" not in failed:
        shares_fed = claims["feeds"]["shares"].items()
        report.fed = {name: math.floor(share * 1e6) / 1e6 for name, share in shares_fed}
    noisy = file.noise is not None
    report.statement = [CLAIMS[name].statement(section, noisy) for name, section in claims.items()]
    if set(claims) - {
        "refuted",
        "feeds",
    }:  # these do not speak of attracting cells, which are not checked for them
        which = " (first box)" if len(file.cells) > 1 else ""
        report.statement.append(
            f"attracting cells: {extents(file.cells[0], file.cells[0].component >= 0)}{which}"
        )
    if own is not None and not {"goal", "refuted"} & set(claims):
        report.statement.append(NO_GOAL)
    report.claims = [
        (name, *state_of(report, name, section, failed)) for name, section in claims.items()
    ] + file.unknown
    report.verdict = verdict_of([state for _, state, _ in report.claims])
    report.reason = next((f"{name}: {why}" for name, state, why in report.claims if why), "")


def verdict_of(states: list[str]) -> str:
    """Return the worst state of a claim; one that is not rechecked makes the verdict "failed"."""
    if "failed" in states or "not rechecked" in states:
        return "failed"
    return next((word for word in ("refuted", "proved-on-cells") if word in states), "proved")


def state_of(report: Report, name: str, section: dict[str, Any], failed: dict[str, str]) -> tuple[str, str]:
    """Say what became of a claim, a word of `WORDS`, and why."""
    if failed.get(name):
        return "failed", failed[name]
    if name == "refuted":
        return "refuted", ""
    if name == "feeds":
        return verdict_of_feeds(section, MOST_OPEN)
    if name == "goal" and (report.starts == "cells" or (report.open or 0.0) > MOST_OPEN):
        return "proved-on-cells", on_cells_in_words(report, laid=section["starts"].laid is not None)
    return "proved", ""


def tell_starts(report: Report, goal: dict[str, Any], scenes: list[Scene], cells: list[Cells]) -> None:
    """Fill in the starts for which the goal is proved, and their share of the arm, the least of all boxes."""
    starts = goal["starts"]
    both = []
    for scene, c in zip(scenes, cells, strict=True):
        some = c.component >= 0 if starts.only else c.rank >= 0
        both.append(shares(c, scene, starts, some))
    beyond = None if starts.x is None else {str(i): x for i, x in enumerate(starts.x)}
    report.starts = starts.kind if beyond is None else {starts.kind: beyond}
    if starts.kind == "within":
        report.starts = {"within": {str(i): spans for i, spans in enumerate(starts.laid or ()) if spans}}
    report.share, report.explained = (math.floor(min(each) * 1e6) / 1e6 for each in zip(*both, strict=True))
    report.open = math.ceil((1 - min(claimed + known for claimed, known in both)) * 1e6) / 1e6


def on_cells_in_words(report: Report, *, laid: bool) -> str:
    """Say for which starts a goal is proved, where that is not for all starts."""
    which = "in the cells" if report.starts == "cells" else "from some x on"
    of = "the ranges in which parts are laid down" if laid else "the arm"
    return f"proved for starts {which} only, {100 * (report.share or 0.0):.4g} % of {of} or more: the rest is open"


def value_in_words(value: object, name: str) -> str:
    """Write a value of the scene; a quantity is written from its numbers, not from its text."""
    if isinstance(value, str | list):
        return str(quantity(value, KINDS, name))
    return plain(value)


def noise_in_words(noise: object) -> str:
    """Write the noise, if there is any."""
    return "none" if noise is None else deviations_in_words(noise)


def deviations_in_words(deviations: object) -> str:
    """Write noise or a tolerance, from the numbers and not from the texts."""
    known = table(deviations, "deviations", "", " ".join(deviations) if isinstance(deviations, dict) else "")
    return ", ".join(f"{plain(name)} within {quantity(text, KINDS, name)}" for name, text in known.items())
