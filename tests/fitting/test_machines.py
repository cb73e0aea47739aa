"""The machines that a film leaves possible: their ellipsoid and its box, draws, and what commands make of them."""

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from limitsets.fitting import Machines, simulated_throws
from scipy.stats import f as f_law, t as student

import limitsets as ls
from limitsets.base import DataError
from limitsets.parameters.fitting import searching
from tests.cli.command import json_of, prints
from tests.fitting.machines import ABOVE, ALONG, HEIGHT, RADIUS

CAVITY = {"position": "20 in", "width": "9.3 in", "depth": "5.8633 in", "angle": "32.23 deg"}
SPEED = "throw.speed"


def thrown_scene():
    return ls.load({**ls.load("paper-designed").as_dict(), "cavity": CAVITY})


@cache
def fitted(throws=96, error=0.005, seed=1):
    scene = thrown_scene()
    places, sides = np.linspace(8, 23, throws), np.resize([0, 1, 2], throws)
    return ls.fit(
        scene, simulated_throws(scene, places, sides, error=error, speed=5e-4, landing=0.002, seed=seed)
    )


@pytest.fixture
def written(tmp_path):
    """The scene and the fit as files."""
    (tmp_path / "arm.toml").write_text(ls.dump(thrown_scene()), encoding="utf-8")
    (tmp_path / "fit.json").write_text(json.dumps(fitted().to_json()), encoding="utf-8")
    return str(tmp_path / "arm.toml"), "--fitted", str(tmp_path / "fit.json")


def test_on_the_ellipsoid_the_likelihood_has_fallen_by_as_much_as_the_region_allows():
    """In every direction of the four quantities, all else at its best."""
    found, random = fitted(), np.random.default_rng(0)
    machines = found.machines
    size = np.array([machines.halves[name] for name in machines.together]) * machines.stretch(4)
    allowed = searching.threshold_of(4, 96, 5)
    for way in random.standard_normal((8, 4)):
        off = size * (np.linalg.cholesky(machines.correlation) @ (way / np.linalg.norm(way)))
        at = {n: machines.values[n] + by for n, by in zip(machines.together, off.tolist(), strict=True)}
        assert found.deviance(at) == pytest.approx(allowed, rel=0.25)


def test_the_region_of_several_quantities_reaches_farther():
    machines = fitted().machines
    spare = 96 - 5
    assert machines.stretch(1) == pytest.approx(1.0, rel=1e-12)
    assert machines.stretch(4) == pytest.approx(
        math.sqrt(4 * f_law.ppf(0.95, 4, spare)) / student.ppf(0.975, spare)
    )
    assert machines.box[SPEED] == machines.halves[SPEED] * machines.stretch(4)
    assert machines.box[RADIUS] == machines.halves[RADIUS]


def test_drawn_machines_vary_and_go_together_as_the_fit_says():
    machines, scene = fitted().machines, fitted().machines.on(thrown_scene())
    drawn = [
        [each.value(name) for name in (*machines.together, RADIUS)] for each in machines.drawn(scene, 1500, 3)
    ]
    *rows, radius = np.array(drawn).T
    spare = machines.spare
    scale = np.array([machines.halves[name] for name in machines.together]) / student.ppf(0.975, spare)
    expected = np.outer(scale, scale) * machines.correlation * spare / (spare - 2)
    assert np.cov(rows) / np.outer(scale, scale) == pytest.approx(expected / np.outer(scale, scale), abs=0.12)
    half = machines.halves[RADIUS]
    assert np.abs(radius - machines.values[RADIUS]).max() <= half * (1 + 1e-12)
    assert radius.std() == pytest.approx(half / math.sqrt(3), rel=0.05)


def test_a_scene_takes_the_machine_in_its_own_words():
    machines = fitted().machines
    scene = machines.on(thrown_scene())
    assert scene.tolerance.keys() == {SPEED, ALONG, ABOVE, HEIGHT, RADIUS}
    assert scene.tolerance[ALONG].value == pytest.approx(machines.box[ALONG], rel=0.01)
    assert scene.tolerance[ALONG].value >= machines.box[ALONG]
    assert scene.tolerance[SPEED].value == pytest.approx(
        machines.box[SPEED] / machines.values[SPEED], rel=0.01
    )
    assert scene.cavity is not None
    most = {name: found.hi for name, found in ((SPEED, fitted().speed), ("landing.x", fitted().landing))}
    assert float(machines.noise[SPEED].removesuffix(" %")) == pytest.approx(300 * most[SPEED], rel=0.01)
    assert float(machines.noise["landing.x"].removesuffix(" in")) == pytest.approx(
        3 * most["landing.x"], rel=0.01
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda fit: fit.pop("correlation"), "limitsets fit"),
        (lambda fit: fit["quantities"][ALONG].update(bounded=False), ALONG),
        (lambda fit: fit["quantities"][ALONG].update(lo=None), ALONG),
        (lambda fit: fit["scatter"]["landing.x"].update(hi=None), "landing.x"),
    ],
)
def test_what_is_no_fit_or_an_open_one_is_refused(change, words):
    fit = json.loads(json.dumps(fitted().to_json()))
    change(fit)
    with pytest.raises(DataError, match=words):
        Machines.of(fit)


def test_another_part_or_unit_is_refused_and_a_file_that_is_none(tmp_path):
    machines = fitted().machines
    with pytest.raises(DataError, match="another part"):
        machines.on(ls.load("paper-quadrilateral"))
    tree = thrown_scene().as_dict()
    tree["arm"]["length"] = "711.2 mm"
    with pytest.raises(DataError, match="mm"):
        machines.on(ls.load(tree))
    (tmp_path / "x.json").write_text("[1, 2", encoding="utf-8")
    for file in ("x.json", "none.json"):
        with pytest.raises(DataError, match=file):
            Machines.read(tmp_path / file)


def test_each_drawn_machine_throws_its_own_parts(written, capfd):
    machines = fitted().machines
    found = ls.feed(thrown_scene(), fitted=machines, trials=2000, prove=False, level=False, seed=5)
    assert (found.drawn.right.size, found.drawn.parts, found.trials.fate.size) == (200, 10, 2000)
    one = next(iter(machines.drawn(machines.on(thrown_scene()), 1, 5)))
    seed = int(np.random.SeedSequence(5).generate_state(1)[0])
    alone = ls.feed(one, machines.scattering, trials=10, prove=False, level=False, seed=seed)
    assert found.trials.fate[:10].tolist() == alone.trials.fate.tolist()
    assert found.trials.throws[:10].tolist() == alone.trials.throws.tolist()
    told = json_of(capfd, "feed", *written, "--trials", "400", "--no-proof", "--no-level")
    assert len(told["machines"]["right"]) == 200
    assert told["noise"] == machines.noise


def test_the_noise_of_a_joint_margin_is_as_many_times_as_the_tolerance():
    """With next to no tolerance the factor is the margin of that noise alone."""
    tree = ls.load("paper-designed").as_dict() | {"tolerance": {"part.sides[0]": "0.0000001 %"}}
    (joint,) = ls.margin(ls.load(tree), "joint", noise={SPEED: "1 %"}, width=0.05)
    (alone,) = ls.margin("paper-designed", SPEED, reading="per-throw", width=0.05)
    assert joint.noise.keys() == {SPEED}
    assert max(joint.proved, alone.proved) < min(joint.refuted, alone.refuted)
    assert joint.proved == pytest.approx(alone.proved, rel=0.1)


def test_the_machines_of_a_fit_are_proved_and_rechecked(written, tmp_path, capfd):
    fit = fitted().to_json()
    fit["scatter"][SPEED].update(value=0.0, hi=0.0)  # a speed that varies takes a minute of pieces
    Path(written[-1]).write_text(json.dumps(fit), encoding="utf-8")
    text = prints(capfd, "margin", *written, "--width", "0.1", "-o", str(tmp_path / "out"))
    (told,) = json.loads((tmp_path / "out" / "margins.json").read_text(encoding="utf-8"))
    assert (told["quantity"], [*told["noise"]]) == ("joint", ["landing.x"])
    assert told["proved"] > 1.0
    assert "is proved for every machine in the box of the film's 95 % ellipsoid" in text
    assert f"it holds up to {told['proved']:.4g} times these" in text


def test_an_atlas_shows_where_the_fit_leaves_the_quantities(tmp_path):
    machines = fitted().machines
    x, y = "throw.speed=157 deg/s:159 deg/s:4", "arm.surface_height=-0.22 in:-0.18 in:4"
    atlas = ls.atlas(machines.on(thrown_scene()), x, y, workers=1)
    (axes,) = ls.plot.atlas(atlas, fitted=machines).axes
    (line,) = (each for each in axes.lines if each.get_gid() == "fit")
    across, up = line.get_xdata(), line.get_ydata()
    reach = {n: machines.halves[n] * machines.stretch(2) for n in (SPEED, HEIGHT)}  # the ellipse's box
    assert across.max() == pytest.approx(math.degrees(machines.values[SPEED] + reach[SPEED]), rel=1e-4)
    assert up.min() == pytest.approx(machines.values[HEIGHT] - reach[HEIGHT], rel=1e-3)
    tilt = np.corrcoef(across[:-1], up[:-1])[0, 1]
    k = [machines.together.index(name) for name in (SPEED, HEIGHT)]
    assert tilt == pytest.approx(machines.correlation[k[0], k[1]], abs=0.02)
