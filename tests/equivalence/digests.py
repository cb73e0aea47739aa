"""What is recorded: pairs of a name and a digest, by section."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import limitsets as ls
from limitsets.face.cli import main
from limitsets.proofs.prover.parameters import parameter_box, whole
from limitsets.systems.graph.images.enclosed import enclosures
from limitsets.systems.graph.ranges import RUN
from limitsets.systems.maps import images
from tests.attack.generate import Case, case
from tests.thrower.effects import throws as effect_throws

FOUR = ("paper-designed", "paper-designed-small-angle", "paper-initial", "paper-initial-small-angle")
RANDOM = range(1000, 1020)
CELLS, STARTS = 50_000, 100_000
EVERY = ("attracts-all", "invariant", "trapping", "expanding", "end-points", "cycles", "goal")

WITH = (("landing",), ("roll",), ("pivot",), ("slip",), ("bounce",), ("landing", "roll", "pivot", "bounce"))

Pairs = Iterator[tuple[str, str]]


def digest(*parts: Any) -> str:
    found = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            found.update(f"{part.dtype}{part.shape}".encode() + np.ascontiguousarray(part).tobytes())
        else:
            found.update(part if isinstance(part, bytes) else repr(part).encode())
    return found.hexdigest()[:16]


def cases() -> Iterator[tuple[str, ls.Scene, Case | None]]:
    """The paper's four scenes, and random ones."""
    for name in FOUR:
        yield name, ls.load(name), None
    for seed in RANDOM:
        given = case(seed)
        yield f"random {seed}", ls.load(tomllib.loads(given.text)), given


def boxes() -> Pairs:
    """Enclosures of images of cells, with the scene's own noise and tolerance and without."""
    for name, scene, given in cases():
        plain = parameter_box(scene)
        known = {"exact": plain}
        if given and (given.noise or given.tolerance):
            tree = whole(scene, given.tolerance).tree() if given.tolerance else None
            known["wide"] = parameter_box(scene, tree=tree, noise=given.noise or None)
        for kind, box in known.items():
            for side, a in enumerate(scene.sides.a):
                edges = a + (scene.arm_length - a) * np.linspace(1e-4, 1.0, CELLS + 1) ** 1.5
                found = enclosures(box.lo, box.hi, edges, side)
                hulls = [part for key in sorted(found.hulls) for part in (np.array(key), *found.hulls[key])]
                yield f"{name}, {kind}, side {side}", digest(*hulls, *found.witness, found.lost)


def floats() -> Pairs:
    """Throws of every flight and criterion, and of every effect."""
    for name, scene, _ in cases():
        for flight in ("exact", "small-angle", "small-angle-2"):
            for flip in ("signed", "energy"):
                now = ls.load({**scene.as_dict(), "model": {"flight": flight, "flip": flip}})
                for side, a in enumerate(now.sides.a):
                    got = images(now.map, np.linspace(a, now.arm_length, STARTS + 1)[1:], side)
                    yield f"{name}, {flight}, {flip}, side {side}", digest(got.x, got.side, got.code)
    for k, each in enumerate(effect_throws.cases(6, seed=11)):
        for names in WITH:
            now = each.full(names)
            for side, a in enumerate(each.bare.a):
                got = images(now, a + each.kappa * np.linspace(0.01, 2.0, STARTS // 100), side)
                yield f"effects {'+'.join(names)}, case {k}, side {side}", digest(got.x, got.side, got.code)


def certificates() -> Pairs:
    """The bytes of certificates, and what is said of each claim."""
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, given in cases():
            claims = [claim for claim in EVERY if claim != "goal" or scene.goal is not None]
            runs = {"": (claims, {}, {})}
            if given and (given.noise or given.tolerance):
                runs["wide"] = (["attracts-all", "goal"], given.noise, given.tolerance)
            for kind, (wanted, noise, tolerance) in runs.items():
                proof = ls.certify(scene, wanted, noise=noise, tolerance=tolerance)
                for claim in proof.claims:
                    said = (
                        claim.verdict,
                        claim.starts,
                        sorted(claim.shares.items()),
                        claim.reason,
                        claim.note,
                    )
                    orbit = [(s.lo, s.hi, s.side, s.kappa, s.landing) for s in claim.counterexample]
                    yield f"{name} {kind} {claim.claim}", digest(said, orbit, sorted(claim.section))
                if any(claim.verdict.startswith("proved") for claim in proof.claims):
                    path = proof.save(Path(folder) / "x.proof.zip", recheck=False)
                    with zipfile.ZipFile(path) as file:
                        for member in sorted(file.namelist()):
                            yield f"{name} {kind} {member}", digest(contents(file.read(member)))


def contents(member: bytes) -> list[bytes]:
    """A file's bytes; of an archive those of its members, without their dates."""
    if not member.startswith(b"PK"):
        return [member]
    with zipfile.ZipFile(io.BytesIO(member)) as archive:
        return [archive.read(name) for name in sorted(archive.namelist())]


def quiet(text: str) -> str:
    """Without times."""
    try:
        return repr(timeless(json.loads(text)))
    except json.JSONDecodeError:
        lines = [line for line in text.splitlines() if not re.fullmatch(r"\| [a-zA-Z ]+ \| [0-9.]+ \|", line)]
        return re.sub(r"\b[0-9.]+ (s|ms|seconds|min)\b", "T", "\n".join(lines))


def timeless(found: Any) -> Any:
    if isinstance(found, dict):
        return {key: timeless(value) for key, value in found.items() if key not in ("seconds", "timings")}
    return [timeless(each) for each in found] if isinstance(found, list) else found


def reports() -> Pairs:
    """What `analyse` and `robustness` write for people and for machines."""
    for name in FOUR:
        for words in (["analyse"], ["robustness"]) if name == "paper-designed" else (["analyse"],):
            with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
                out = io.StringIO()
                with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
                    main((*words, name))
                yield f"{words[0]} {name}: screen", digest(quiet(out.getvalue()))
                for path in sorted(Path(folder).rglob("*")):
                    if path.suffix in (".md", ".json", ".csv", ".toml"):
                        yield f"{words[0]} {name}: {path.name}", digest(quiet(path.read_text()))


def leslie() -> Pairs:
    """Graph, components, order and basins of the Leslie map."""
    for depth in (12, 14, 16):
        cells = ls.grid([(-0.001, 90.0), (-0.001, 70.0)], depth=depth)
        for method in ("corners-padded", "boxes"):
            graph = ls.transitions(ls.maps.Leslie(), cells, method=method)
            ranges = graph.ranges
            yield f"{depth}, {method}, graph", digest(ranges.first, ranges.box[:, RUN], ranges.exits)
            found = ls.attractors(graph)
            yield f"{depth}, {method}, attractors", digest([sorted(each.extents.items()) for each in found])


def checker() -> Pairs:
    """Verdict and first failure of every file that the tests put before the checker."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        environment = {**os.environ, "LIMITSETS_CHECKED": str(log)}
        command = [sys.executable, "-m", "pytest", "tests/proofs", "-q", "-p", "tests.equivalence.listening"]
        subprocess.run(command, env=environment, check=False, stdout=subprocess.DEVNULL)
        found: dict[str, list[str]] = {}
        for line in log.read_text().splitlines():
            test, said = line.split("\t", 1)
            found.setdefault(test, []).append(said)
        for test, said in found.items():
            yield test, digest(said)


SECTIONS: dict[str, Callable[[], Pairs]] = {
    "boxes": boxes,
    "floats": floats,
    "certificates": certificates,
    "reports": reports,
    "leslie": leslie,
    "checker": checker,
}
