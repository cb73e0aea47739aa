"""The public answers whose digests a move of the code must not change: commands, certificates, maps, throws, stores."""

import hashlib
import json
import math
import re
import shlex
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

import limitsets as ls
from limitsets.base.files import as_json
from limitsets.systems.maps import advance
from tests.doors.asking import command
from tests.doors.scenes import scenes
from tests.plates import LEAD_QUAD
from tests.trays.scenes import with_tray

# What differs from run to run, or with the code alone.
VOLATILE = {"timings", "seconds", "versions", "producer", "code", "recheck", "digests", "plan_hash", "plan"}
SCENES = (
    "designed", "designed, small angles", "a goal that fails", "four corners", "nothing gets there", "from anywhere",
    "reaches", "surface above the joint", "speed and tilt", "with friction", "with an effect", "a lead plate",
)  # fmt: skip
HEAVY = ("designed", "speed and tilt")
# Quick commands, asked of every scene; SCENE and OUT stand for its file and a folder of its own.
QUICK = (
    "check SCENE", "throw SCENE --x 15 --side 0 --count 50", "audit SCENE",
    "analyse SCENE --cells 256 -o OUT/analysis", "certify SCENE -o OUT/all.proof.zip",
    "margin SCENE arm.surface_height --reading fixed --width 0.2 -o OUT/margin",
)  # fmt: skip
# Longer ones, asked of scenes that get a cavity and throws to choose from.
LONG = (
    "certify SCENE --claim goal --tolerance 'throw.speed=0.02 %' -o OUT/fixed.proof.zip",
    "certify SCENE --claim goal --noise 'landing.x=0.01 in' -o OUT/noise.proof.zip",
    "certify SCENE --claim goal --laid 2=16:20 -o OUT/laid.proof.zip",
    "feed SCENE --scatter 'throw.speed=0.5 %' --trials 2000 --no-level --seconds 1000 --certificate OUT/fed.proof.zip",
    "feed SCENE --scatter 'landing.x=0.05 in' --law bounded --trials 2000 --no-level --no-proof --brackets 64",
    ("robustness SCENE --quantity throw.speed --without joint --without curve --scatter 'throw.speed=0.2 %' "
    "--cells 128 --width 0.2 --workers 1 -o OUT/sheet"),
    ("feedback SCENE --starts 2=17:18 --cells 256 --seconds 1000 --parts 1000 -o OUT/policy "
    "--certificate OUT/policy.proof.zip"),
    "design SCENE --critical-points free,10,free --vary part.mass.center.along --starts 1 -o OUT/design",
    "atlas SCENE --x throw.kappa=25:26:8 --y arm.surface_height=-0.3:-0.1:6 --workers 1 -o OUT/atlas.zarr",
)  # fmt: skip
ADDED = {
    "cavity": {"position": "20 in", "width": "9.3 in", "depth": "5.8633 in", "angle": "32.23 deg"},
    "feedback": {
        "throws": [{"name": "own", "kappa": "33.3605945 in"}, {"name": "fast", "kappa": "27.57073926 in"}]
    },
}


def plain(value: Any, folder: str) -> Any:
    """Give an answer without what differs from run to run."""
    if isinstance(value, dict):
        return {key: plain(each, folder) for key, each in value.items() if key not in VOLATILE}
    if isinstance(value, list):
        return [plain(each, folder) for each in value]
    return value.replace(folder, "OUT") if folder and isinstance(value, str) else value


def digest(array: Any) -> str:
    """Give shape, type and a digest of an array."""
    array = np.asarray(array)
    return f"{array.dtype.str} {array.shape} {hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]}"


def certificate(file: Path) -> Any:
    """Give what a certificate says, and digests of its arrays."""
    with ZipFile(file) as whole:
        header = json.loads(whole.read("header.json"))
        with np.load(whole.open("arrays.npz")) as arrays:
            return header | {"arrays": {name: digest(arrays[name]) for name in sorted(arrays)}}


def written(folder: Path) -> dict[str, Any]:
    """Give what commands wrote that is no picture: certificates, tables and stores."""
    found: dict[str, Any] = {}
    for file in sorted(folder.rglob("*")):
        name = str(file.relative_to(folder))
        if file.name.endswith(".proof.zip"):
            found[name] = certificate(file)
        elif file.suffix in (".csv", ".toml", ".md"):
            lines = file.read_text(encoding="utf-8").splitlines()
            seconds = re.compile(r"\| [\w ,-]+ \| \d+\.\d{3} \|")
            found[name] = [line for line in lines if not seconds.fullmatch(line)]
        elif file.suffix == ".zarr":
            import xarray

            data = xarray.open_zarr(file, consolidated=False)
            found[name] = {str(key): digest(array.values) for key, array in data.variables.items()}
    return found


def of_commands(name: str, scene: Any, lines: tuple[str, ...], folder: Path) -> Iterator[tuple[str, Any]]:
    """Ask commands of one scene."""
    own = folder / name.replace(" ", "-").replace(",", "")
    own.mkdir(parents=True)
    file = own / "scene.toml"
    loaded = ls.load(tomllib.loads(scene) if isinstance(scene, str) else scene)
    file.write_text(ls.dump(loaded), encoding="utf-8")
    for number, line in enumerate(lines):
        out = own / str(number)
        out.mkdir()
        words = [word.replace("SCENE", str(file)).replace("OUT", str(out)) for word in shlex.split(line)]
        code, record, said = command(*words)
        answer = {"exit": code, "json": record, "said": said if code == 2 else ""} | written(out)
        yield f"{name}: {line}", plain(answer, str(own))


def of_scenes(folder: Path) -> Iterator[tuple[str, Any]]:
    """Ask all commands that answer alike each time they are asked."""
    known = scenes()
    for name in SCENES:
        yield from of_commands(name, known[name][0], QUICK, folder)
    for name in HEAVY:
        yield from of_commands(f"{name}, more", known[name][0] | ADDED, LONG, folder)
    yield from of_others(folder / "others")


def of_others(folder: Path) -> Iterator[tuple[str, Any]]:
    """Ask what takes a film, a cavity or two parts."""
    folder.mkdir(parents=True)
    from limitsets.parameters.fitting import simulated_throws

    truth = ls.load("paper-designed")
    film = simulated_throws(truth, np.linspace(8, 23, 48), [0, 1, 2] * 16, error=0.02, speed=0.002)
    yield "fit", plain(json.loads(as_json(ls.fit(truth, film))), "")
    pairs = {
        "assemble SCENE SCENE --trials 40 --workers 1": truth.as_dict() | ADDED,
        "tray SCENE --passes 20 --drops 40": with_tray(),
    }
    for line, scene in pairs.items():
        yield from of_commands(line.split()[0], scene, (line,), folder)
    yield "scenes", command("scenes")[1]


def of_throws() -> Iterator[tuple[str, Any]]:
    """Throw 1000 parts 1000 times, in each model and with effects."""
    models: dict[str, Any] = {
        name: ls.load(name) for name in ("paper-designed", "paper-designed-small-angle")
    }
    tree = ls.load("paper-designed").as_dict()
    models["landing, roll"] = ls.load(tree | {"effects": {"landing": True, "roll": True}})
    scattered = {"world": {"scatter": {"speed": "0.5 %"}}, "effects": {"spread": "gaussian"}}
    models["gaussian spread"] = ls.load(tree | scattered)
    models["lead"] = ls.load(LEAD_QUAD)
    for name, scene in models.items():
        side = np.arange(1000) % len(scene.sides)
        first = np.asarray(scene.sides.a)[side]
        x = first + (scene.arm_length - first) * np.linspace(0.02, 0.98, 1000)
        end = advance(scene.map, x, side, 1000)
        yield f"10^6 throws: {name}", [digest(each) for each in end]


def of_maps() -> Iterator[tuple[str, Any]]:
    """Ask eight maps what the machinery of cells, cycles, proofs and resilience says of them."""
    line, plane = [(0.0, 1.0)], [(-1.5, 1.5), (-0.5, 0.5)]
    maps: dict[str, tuple[Any, list[tuple[float, float]], list[str]]] = {
        "logistic": (ls.maps.Logistic(3.83), line, ["trapping", "cycles"]),
        "cubic": (ls.maps.Cubic(1.5), [(-1.2, 1.2)], ["trapping", "attracts-all"]),
        "doubling": (ls.maps.Doubling(), line, ["invariant", "expanding"]),
        "rotation": (ls.maps.Rotation(math.sqrt(2) - 1), line, ["invariant"]),
        "circle": (ls.maps.Circle(0.35, 0.9), line, ["invariant", "cycles"]),
        "henon": (ls.maps.Henon(1.4, 0.3), plane, ["trapping", "cycles"]),
        "leslie": (ls.maps.Leslie(19.6, 23.68, 0.1, 0.7), [(0.0, 90.0), (0.0, 70.0)], ["trapping"]),
        "standing circle": (ls.maps.Circle(0.5, 0.9), line, ["invariant", "cycles"]),
    }
    for name, (chosen, box, claims) in maps.items():
        grid = ls.grid(box, cells=64 if len(box) == 2 else 512)
        yield from of_map(name, chosen, grid, claims)


def of_map(name: str, chosen: Any, grid: Any, claims: list[str]) -> Iterator[tuple[str, Any]]:
    """Ask one map."""
    for method in ("boxes", "corners-padded", "corners"):
        graph = ls.transitions(chosen, grid, method)
        found = ls.attractors(graph, throws=200)
        basins = ls.basins(graph, found)
        edges = [digest(each) for each in graph.ranges if isinstance(each, np.ndarray)]
        sets = {"attractors": json.loads(as_json(list(found))), "basins": json.loads(as_json(basins))}
        yield f"{name}: {method}", {"edges": edges, **sets}
    asks: dict[str, Callable[[], Any]] = {
        "certify": lambda: ls.certify(chosen, grid, claims=claims),
        "basin entropy": lambda: ls.resilience.basin_entropy(graph, found, box=4),
        "stability": lambda: ls.resilience.basin_stability(graph, found),
        "cycles": lambda: ls.cycles(graph, 4),
    }
    for word, ask in asks.items():
        try:
            yield f"{name}: {word}", plain(json.loads(as_json(ask())), "")
        except ls.errors.LimitsetsError as error:
            yield f"{name}: {word}", str(error)


def all_answers(folder: Path) -> Iterator[tuple[str, Any]]:
    """Ask everything, a name and a plain answer at a time."""
    yield from of_throws()
    yield from of_maps()
    yield from of_scenes(folder)
