"""What an atlas holds: exact axes, the task's answers, the same bytes however it was computed."""

import json
import math
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import LimitsetsError, SceneError
from limitsets.base.files import as_json
from limitsets.parameters.atlas import Axis, atlas
from limitsets.parameters.atlas.parameter_atlas import plan_of
from limitsets.parameters.atlas.plan import chunk_shape
from limitsets.parameters.atlas.subjects import SceneSubject, axis_of
from limitsets.parameters.atlas.work import answer
from tests.maps_of_tests import Tent
from tests.sweep.stores import Shuffled, bytes_of, flags_of, run
from tests.sweep.tasks_of_tests import TASK, X, Y

ROOT = Path(__file__).resolve().parents[2]
BLOCKS = "tests.sweep.tasks_of_tests:in_blocks"
DESIGNED = ls.load("paper-designed")


@pytest.fixture(scope="module")
def computed():
    """The atlas of these tests, in memory."""
    return run(None)


# ---------------------------------------------------------------- axes


def test_values_of_an_axis_are_the_nearest_floats_to_exact_fractions():
    axis = axis_of("arm.surface_height=-1:0.2:1001", SceneSubject(DESIGNED).unit_of)
    exact = [Fraction(-1) + Fraction(12, 10) * k / 1000 for k in range(1001)]
    assert axis.values.tolist() == [float(each) for each in exact]
    assert axis.unit == "in"


@pytest.mark.parametrize(
    ("text", "unit", "second"),
    [
        ("throw.speed=120:180:7", "deg/s", math.radians(130)),
        ("throw.speed=20 rpm:30 rpm:11", "rpm", 21 * math.pi / 30),
        ("throw.speed='2 rad/s':'3 rad/s':11", "rad/s", 2.1),
        ("arm.length=70 cm:80 cm:11", "cm", 71 / 2.54),
        ("part.sides[1]=3:4:11", "in", 3.1),
        ("gravity.tilt=20:30:11", "deg", math.radians(21)),
        ("gravity.acceleration=150:160:11", "in/s^2", 151),
    ],
)
def test_axes_are_read_in_the_unit_in_which_people_read_the_quantity(text, unit, second):
    subject = SceneSubject(DESIGNED)
    axis = axis_of(text, subject.unit_of)
    assert axis.unit == unit
    assert subject.in_base(axis)[1] == pytest.approx(second, rel=1e-15)


def test_the_unit_of_a_scene_in_millimetres_given_by_rpm():
    text = ls.dump(DESIGNED).replace('kappa = "25.3778518 in"', 'speed = "25 rpm"')
    subject = SceneSubject(ls.load(text.replace('"28 in"', '"711.2 mm"')))
    units = [subject.unit_of(name, None) for name in ("throw.speed", "arm.surface_height", "throw.kappa")]
    assert units == ["rpm", "in", "mm"]


NO_AXES = "=1:2 =1:2:3:4 =2:1:5 =1:1:5 =1:2:1 =1:2:0 =1:2:-5 =1:2:2.5 =1:x:3 =1deg/s:2deg/s:3 =nan:2:3 =1:2:99999999"


def test_axes_that_cannot_be_are_refused():
    units = ["=1:2 deg/s:3", "=1 deg/s:2 rad/s:3", "=1 in:2 in:3"]
    speeds = [f"throw.speed{values}" for values in ["", *NO_AXES.split(), *units]]
    for text in [*speeds, "speed=1:2:3", "landing.x=1:2:3"]:
        with pytest.raises(LimitsetsError, match="allowed: "):
            atlas("paper-designed", text, task=TASK)


def test_each_point_has_the_scene_that_its_coordinates_write(computed):
    found = computed.dataset
    speed, height = found["throw.speed"].values.tolist(), found["arm.surface_height"].values.tolist()
    for j, k in ((0, 20), (4, 13), (8, 17)):
        at = {"throw.speed": f"{speed[k]!r} deg/s", "arm.surface_height": f"{height[j]!r} in"}
        alone = DESIGNED.with_values(at)
        assert found.kappa.values[j, k] == alone.kappa
        assert np.array_equal(found.feet.values[j, k], alone.sides.a + alone.surface_height)


# ---------------------------------------------------------------- points and variables


def test_points_without_a_scene_or_an_answer_have_a_status_and_no_numbers(computed):
    found = computed.dataset
    # speeds of 0 and below are none; kappa = g/w^2 is above 400 in below 0.695 rad/s
    speed = np.radians(found["throw.speed"].values)
    wanted = np.where(speed <= 0, 1, np.where(speed**2 < 193.045 / 400, 2, 0))
    assert np.array_equal(found.status.values, np.broadcast_to(wanted, found.status.shape))
    assert np.array_equal(np.isfinite(found.kappa.values), found.status.values == 0)
    assert flags_of(found.status) == {"computed": 0, "impossible": 1, "refused": 2}
    empty = (found.status.values != 0) | (found["arm.surface_height"].values[:, None] > 0)
    assert np.array_equal(np.isnan(found.height.values), empty)


def test_seeds_depend_on_the_number_of_the_point_alone(computed):
    found = computed.dataset.drawn.values
    other = atlas("paper-designed", X, Y, task=TASK, chunk=(9, 21)).dataset.drawn.values
    good = np.isfinite(found)
    assert np.array_equal(found, other, equal_nan=True)
    assert np.unique(found[good]).size == good.sum()
    assert (found[good] != run(None, seed=1).dataset.drawn.values[good]).all()


def test_a_block_task_gives_what_single_scenes_give(computed):
    wanted = ["kappa", "feet", "sign", "dear"]
    blocks = atlas("paper-designed", X, Y, task=BLOCKS, chunk=(2, 4), variables=wanted)
    single, found = computed.dataset, blocks.dataset
    good = single.status.values == 0
    assert np.array_equal(found.kappa.values[good], single.kappa.values[good])
    assert np.array_equal(found.feet.values[good], single.feet.values[good])
    possible = found.status.values == 0
    assert np.array_equal(possible, single.status.values != 1)
    assert np.array_equal(np.isfinite(found.kappa.values), possible)
    assert (found.dear.values[possible] == math.pi).all()
    assert set(found.sign.values[~possible].tolist()) == {-1}
    assert found.sign.dtype == np.int8
    assert found.feet.dims == ("arm.surface_height", "throw.speed", "side")
    assert found.kappa.attrs == {"units": "in", "long_name": "gravity over the squared speed"}


def test_variables_are_chosen_and_options_passed():
    chosen = atlas("paper-designed", X, task=BLOCKS, variables=["kappa"], options={"power": 2}).dataset
    assert set(chosen.data_vars) == {"kappa", "status"}
    assert "dear" not in atlas("paper-designed", X, task=BLOCKS).dataset
    plain = atlas("paper-designed", X, task=BLOCKS).dataset
    assert np.array_equal(chosen.kappa.values, plain.kappa.values**2, equal_nan=True)
    assert set(run(None, variables=["feet"]).dataset.data_vars) == {"feet", "status"}


def test_one_axis_alone_and_values_of_its_own():
    speeds = [150.0, 158.02, 170.5]
    found = atlas("paper-designed", Axis("throw.speed", speeds, "deg/s"), task=BLOCKS).dataset
    assert found.kappa.dims == ("throw.speed",)
    assert found.kappa.values == pytest.approx([193.045 / math.radians(w) ** 2 for w in speeds], rel=1e-14)


def test_any_registered_map(tmp_path):
    task = "tests.sweep.tasks_of_tests:of_map"
    found = atlas(maps.Logistic(4), "r=2:4:5", task=task, options={"factor": 2.0}, store=tmp_path / "s.zarr")
    assert found.dataset.fixed_point.values == pytest.approx([1.0, 1.2, 4 / 3, 10 / 7, 1.5])
    assert found.dataset.attrs["plan"]["parameters"] == {"r": 4.0}
    record = found.to_json()
    assert record["map"] == "limitsets.systems.maps.textbook.logistic:Logistic"
    assert record["parameters"] == {"r": 4.0}
    with pytest.raises(LimitsetsError, match=r"the parameter is 's'.*field"):
        atlas(maps.Logistic(4), "s=2:4:5", task=task)
    with pytest.raises(LimitsetsError, match="parameters of a map have none"):
        atlas(maps.Logistic(4), "r=2 in:4 in:5", task=task)
    with pytest.raises(LimitsetsError, match="pass domain="):
        atlas(Tent(1.8), "slope=1.5:1.9:5", task=BLOCKS)


def test_a_textbook_map_has_a_domain_of_its_own():
    """The fixed point 1 - 1/r attracts at r = 2.5, a cycle of two at 3.25; the domain is told as if it were given."""
    found = ls.atlas(maps.Logistic(2.0), "r=2.5:3.25:2")
    assert found.dataset.period.values[:, 0].tolist() == [1, 2]
    assert found.dataset.lowest.values[0, 0, 0] == pytest.approx(0.6, abs=1e-6)
    assert found.to_json()["domain"] == {"lo": [[0.0]], "hi": [[1.0]]}
    given = ls.atlas(maps.Logistic(2.0), "r=2.5:3.25:2", domain=[(0.0, 1.0)])
    assert given.dataset.attrs["plan_hash"] == found.dataset.attrs["plan_hash"]


def test_fields_of_sides_and_of_inner_tuples_vary_too():
    """A throw map is a map as well; its points are those of stacked scenes."""
    given = DESIGNED.bare_map
    axes = ("a[1]=1:2:3", "radius_of_gyration=1:2:3")
    found = atlas(given, *axes, domain=DESIGNED.domain, task=BLOCKS).dataset
    assert found.feet.values[1, 2, 1] == 2.0 + given.surface_height
    assert found.feet.values[1, 2, 0] == given.a[0] + given.surface_height
    assert (found.kappa.values == given.kappa).all()
    with pytest.raises(LimitsetsError, match="it would be both"):
        atlas(given, "kappa=20:30:3", domain=DESIGNED.domain, task=BLOCKS)


def test_the_default_task_tells_the_topology_of_the_designed_feeder():
    """Against cells and critical orbits (`ls.attractors`, `ls.limit_set`), and the threshold of `ls.analyse`."""
    found = atlas("paper-designed", "throw.kappa=25.3778518:25.3778518:1").dataset.isel({"throw.kappa": 0})
    graph = ls.transitions(DESIGNED.map, ls.grid(DESIGNED.domain, cells=1024))
    (attractor,) = ls.attractors(graph)
    extents = ls.limit_set(graph, attractor).extents
    assert (int(found.attractors), int(found.undecided), int(found.leaves)) == (1, 0, 0)
    assert tuple(found.flip_order.values[0]) == attractor.flip_order
    assert found.bands.values[0].tolist() == [len(extents[side]) for side in range(3)]
    assert found.reach.values[0] == pytest.approx([extents[side][-1][1] for side in range(3)], abs=1e-8)
    assert float(found.threshold) == pytest.approx(max(extents[side][-1][1] for side in (0, 1)), abs=1e-8)


# ---------------------------------------------------------------- the same, however it is computed


@pytest.mark.parametrize(
    "options", [*({"executor": Shuffled(seed)} for seed in range(3)), {"workers": 1}, {"workers": 3}]
)
def test_neither_the_order_of_completion_nor_the_number_of_processes_shows(options, tmp_path, whole):
    run(tmp_path / "s.zarr", **options)
    assert bytes_of(tmp_path / "s.zarr") == whole


@pytest.mark.sweep
def test_a_dask_cluster_of_separate_processes_gives_the_same_store(tmp_path, whole):
    from distributed import LocalCluster

    options = {"processes": True, "threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(n_workers=2, local_directory=str(tmp_path / "dask"), **options) as cluster:
        run(tmp_path / "s.zarr", cluster=cluster.scheduler_address)
    assert bytes_of(tmp_path / "s.zarr") == whole


def test_a_cluster_that_is_not_there_is_named():
    with pytest.raises(LimitsetsError, match="address of a Dask scheduler"):
        run(None, cluster="tcp//nowhere")


def test_a_store_that_is_done_is_read_and_not_computed_and_xarray_opens_it(stored, whole, computed):
    again = run(stored)
    assert (again.new, again.kept) == (0, 21)
    assert bytes_of(stored) == whole
    assert again.dataset.identical(computed.dataset)
    with xr.open_zarr(stored, consolidated=False) as found:
        assert found.kappa.sel({"throw.speed": 150.0, "arm.surface_height": -1.0}) > 0
        assert ls.load(found.attrs["scene"]) == DESIGNED
        assert found.attrs["plan_hash"] == computed.dataset.attrs["plan_hash"]
        assert set(found.attrs["versions"]) == {"limitsets", "numpy", "numba"}


CHANGES = [
    ({"subject": "paper-initial"}, r"scene\.name is 'paper-designed' there, 'paper-initial' here"),
    ({"subject": DESIGNED.with_values({"arm.length": 30})}, r"length is '28 in' there, '30.0 in' here"),
    ({"y": "arm.surface_height=-1:0.1:10"}, r"axes\[0\]\.count is 9 there, 10 here"),
    ({"task": BLOCKS}, "task is 'tests.sweep.tasks_of_tests:numbers' there"),
    ({"options": {"pause": 0.0}}, r"options\.pause is None there, 0.0 here"),
    ({"seed": 1}, "seed is 0 there, 1 here"),
    ({"chunk": (4, 4)}, r"chunk\[0\] is 3 there, 4 here"),
    ({"variables": ["kappa"]}, r"variables is None there, \['kappa'\] here"),
]


def test_a_store_of_another_plan_is_refused_with_what_differs(stored, whole):
    for change, words in CHANGES:
        given = {"subject": "paper-designed", "x": X, "y": Y, "task": TASK, "chunk": (3, 3)} | change
        with pytest.raises(LimitsetsError, match=words):
            atlas(store=stored, **given)
    assert bytes_of(stored) == whole


OF_PLAN = "limitsets.parameters.atlas.plan."


@pytest.mark.parametrize(
    ("name", "other", "of_store", "of_worker"),
    [
        (
            "version",
            lambda package: "0.0",
            "is '.*' there, '0.0' here",
            r"versions\.limitsets of a worker is '0\.0'",
        ),
        (
            "code_digest",
            lambda: "0" * 64,
            "the code of limitsets is not the code that",
            r"sources\.limitsets of a w",
        ),
        ("source_of", lambda name: {name: "-"}, r"code of tests\.sweep\.tasks_of_tests is not", "sources"),
    ],
)
def test_other_versions_and_edited_code_are_refused(name, other, of_store, of_worker, stored, monkeypatch):
    """What the plan says of the code is patched as if it were on another machine: of a store, and of a worker."""
    plan = plan_of("paper-designed", X, task=TASK)
    monkeypatch.setattr(OF_PLAN + name, other)
    with pytest.raises(LimitsetsError, match=of_store):
        run(stored)
    with pytest.raises(LimitsetsError, match=of_worker):
        answer(plan, 0)


def test_what_is_no_store_is_not_touched(tmp_path):
    (tmp_path / "file.zarr").write_text("a letter")
    (tmp_path / "folder.zarr").mkdir()
    (tmp_path / "folder.zarr" / "letter").write_text("a letter")
    xr.Dataset({"a": ("x", [1.0])}).to_zarr(tmp_path / "other.zarr", consolidated=False)
    before = bytes_of(tmp_path)
    for place in sorted(tmp_path.iterdir()):
        with pytest.raises(LimitsetsError):
            run(place)
    assert bytes_of(tmp_path) == before


# ---------------------------------------------------------------- tasks that cannot be asked


OF_TESTS = "tests.sweep.tasks_of_tests"
HEIGHTS = {"x": "arm.surface_height=-1:0:5", "chunk": (5,)}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (HEIGHTS | {"task": "no.such.module:function"}, "No module named"),
        (HEIGHTS | {"task": "math:nothing"}, "nothing"),
        (HEIGHTS | {"task": "math:pi"}, "it is none"),
        (HEIGHTS | {"task": "math"}, "module:function"),
        (HEIGHTS | {"task": lambda scene: {}}, "workers import it by its name"),
        (HEIGHTS | {"task": f"{OF_TESTS}:failing"}, r"ZeroDivisionError.*arm\.surface_height -0\.5"),
        (HEIGHTS | {"task": f"{OF_TESTS}:uneven"}, "one shape"),
        (HEIGHTS | {"task": "limitsets.scene:dump"}, "returns is 'str'; allowed: a dict"),
        ({"variables": ["nothing"], "task": BLOCKS}, "the variable is 'nothing'; allowed: kappa"),
        ({"variables": ["nothing"], "task": TASK}, "returns as nothing is 'missing'"),
        ({"y": X, "task": TASK}, "name each once"),
        ({"chunk": (3, 3), "task": TASK}, "give one for each axis"),
        ({"chunk": (0,), "task": TASK}, "numbers from 1"),
        ({"workers": 0, "task": TASK}, "1 or more"),
        ({"workers": 2, "cluster": "tcp://", "task": TASK}, "give one of them"),
        ({"options": {"pause": {1, 2}}, "task": TASK}, "numbers, text, lists and tables"),
        ({"domain": [(0, 1)], "task": TASK}, "a scene has one"),
    ],
)
def test_what_cannot_be_asked_is_refused(options, words):
    with pytest.raises(LimitsetsError, match=words):
        atlas("paper-designed", **({"x": X} | options))


def test_gravity_does_not_vary_in_blocks_where_the_throw_is_given_by_kappa():
    with pytest.raises(SceneError, match=r"give throw\.speed"):
        atlas("paper-designed", "gravity.tilt=20:30:3", task=BLOCKS)


@pytest.mark.sweep
def test_a_script_without_a_guard_starts_processes_and_sends_them_nothing_of_its_own(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(f"""
import sys; sys.path.insert(0, {str(ROOT)!r})
from concurrent.futures import ThreadPoolExecutor
import limitsets as ls
def here(scene):
    return {{"kappa": scene.kappa}}
try:
    ls.atlas("paper-designed", {X!r}, task=here, workers=2)
except ls.errors.LimitsetsError as error:
    print(error)
with ThreadPoolExecutor(1) as pool:
    print(ls.atlas("paper-designed", {X!r}, task=here, executor=pool).dataset.sizes["throw.speed"])
found = ls.atlas("paper-designed", {X!r}, task={TASK!r}, chunk=[4], workers=2)
print(found.new, sys.modules["__main__"].__file__ == __file__)
""")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    refusal, points, ran = done.stdout.splitlines()
    assert "move it to a file, or pass executor=concurrent.futures.ThreadPoolExecutor(1)" in refusal
    assert (points, ran, done.stderr) == ("21", "6 True", "")


# ---------------------------------------------------------------- tables, chunks, libraries


def test_a_table_has_a_row_for_each_point(computed):
    table, data = computed.to_dataframe(), computed.dataset
    assert list(table.columns[:2]) == ["arm.surface_height", "throw.speed"]
    assert {"kappa", "feet[0]", "feet[1]", "feet[2]", "status"} < set(table.columns)
    row = table[(table["throw.speed"] == 150.0) & (table["arm.surface_height"] == -1.0)].iloc[0]
    one = data.sel({"throw.speed": 150.0, "arm.surface_height": -1.0})
    assert len(table) == 9 * 21
    assert [row["kappa"], row["feet[1]"]] == [float(one.kappa), float(one.feet[1])]


def test_json_has_everything_and_no_nan(computed):
    record = json.loads(as_json(computed))
    assert list(record) == ["scene", "unit", "axes", "variables", "model", "task", "plan_hash", "versions"]
    assert record["axes"][1]["values"][20] == 180.0
    assert record["variables"]["kappa"]["values"][0][0] is None
    assert record["variables"]["status"]["codes"] == {"computed": 0, "impossible": 1, "refused": 2}
    assert record["variables"]["feet"]["dims"] == ["arm.surface_height", "throw.speed", "feet_0"]


def test_chunks_are_about_square_and_of_one_size():
    for shape, task, chunk in (
        ((1000, 1000), BLOCKS, (100, 100)),
        ((1_000_000,), BLOCKS, (10_000,)),
        ((3, 1_000_000), BLOCKS, (3, 3323)),
        ((30, 30), BLOCKS, (30, 30)),
        ((1000, 1000), TASK, (8, 8)),
        ((1,), TASK, (1,)),
    ):
        assert chunk_shape(shape, task) == chunk


def loaded_by(code):
    """The modules that a new interpreter in this checkout has loaded after some code."""
    command = [sys.executable, "-W", "error", "-c", f"import sys\n{code}\nprint('loaded', *sys.modules)"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.rpartition("loaded ")[2].split())


HEAVY = {"xarray", "zarr", "pandas", "pyarrow", "dask", "distributed"}
# The topology of a point needs no graph library, optimizer or proof.
NEEDLESS = {
    "networkx",
    "scipy.optimize",
    "scipy.sparse",
    "limitsets.proofs",
    "limitsets.parameters.continuation",
}


def test_what_a_worker_computes_by_loads_what_it_needs_alone():
    """Each worker begins with these imports, those of the room among them."""
    loaded = loaded_by("import limitsets.sweep.of_topology")
    assert {"limitsets.parameters.atlas", "limitsets.parameters.atlas.of_topology"} <= loaded
    assert not (HEAVY | NEEDLESS) & loaded


@pytest.mark.sweep
def test_an_analysis_loads_none_of_them(tmp_path):
    words = ["analyse", "paper-designed", "--cells", "64", "--out", str(tmp_path / "a"), "--json"]
    assert not HEAVY & loaded_by(f"import limitsets.cli\nlimitsets.cli.main({words})")


def test_its_tables_have_words_and_no_codes_and_columns_for_the_attractors_there_are():
    """One on this feeder; of two tells `test_classes`."""
    found = ls.atlas("paper-designed", "throw.speed=140:170:4")
    values = {row[0]: row[1] for row in found.tables()[0].rows}
    assert values["class"] == "classes: 2"  # every start leaves; one attractor
    assert "not checked" in values["checked"]
    assert [name for name in found.to_dataframe().columns if name.startswith("share")] == ["share[0]"]
