"""Trials by any executor, in any order, cut off and gone on with; what cannot be; JSON and the command."""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace

import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from tests.assembly.pairs import NAMES, NOISE, pair
from tests.cli.command import run
from tests.sweep.stores import Shuffled

COUNT = 45  # the last chunk is not full


@pytest.fixture(scope="module")
def whole():
    return ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8).rows


class Killed(Executor):
    """Ends the run, as Ctrl-C does, after some chunks."""

    def __init__(self, chunks):
        self.left = chunks

    def submit(self, function, /, *arguments):
        if self.left == 0:
            raise KeyboardInterrupt
        self.left -= 1
        future = Future()
        future.set_result(function(*arguments))
        return future


@pytest.mark.sweep
def test_the_same_by_threads_in_any_order_and_by_processes(whole):
    with ThreadPoolExecutor(3) as pool:
        assert ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, executor=pool).rows == plain(whole)
    assert ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, executor=Shuffled(4)).rows == plain(whole)
    assert ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, workers=2).rows == plain(whole)


def plain(rows):
    return tuple(json.loads(json.dumps(row)) for row in rows)


def test_a_killed_run_goes_on(whole, tmp_path):
    file = tmp_path / "trials.json"
    # the driver hands out a window of chunks before it writes: two are kept before the run that is killed
    ls.assemble(*NAMES, NOISE, trials=20, seed=8, file=file)
    with pytest.raises(KeyboardInterrupt):
        ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, file=file, executor=Killed(1))
    assert len(json.loads(file.read_text())["trials"]) == 20
    made = []
    found = ls.assemble(
        *NAMES, NOISE, trials=COUNT, seed=8, file=file, progress=lambda stage, done, of: made.append(done)
    )
    assert min(made) >= 2  # two of the five chunks were there
    assert found.rows == plain(whole)
    assert ls.assemble(*NAMES, NOISE, trials=7, seed=8, file=file).rows == plain(whole)[:7]


@pytest.mark.sweep
def test_a_run_killed_from_outside_goes_on(tmp_path):
    file, command = tmp_path / "trials.json", [sys.executable, "-m", "limitsets", "assemble", *NAMES]
    command += ["--scatter", "throw.speed=0.5 %", "--trials", "2000", "--seed", "8", "--json"]
    begun = subprocess.Popen(
        [*command, "--file", str(file)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    until = time.monotonic() + 120.0
    while not file.exists() and time.monotonic() < until and begun.poll() is None:
        time.sleep(0.01)
    os.kill(begun.pid, signal.SIGKILL)
    begun.wait()
    kept = json.loads(file.read_text())["trials"]
    assert 0 < len(kept) < 2000
    command[command.index("2000")] = str(len(kept) + 30)
    continued, afresh = (
        subprocess.run([*command, *more], capture_output=True, check=True, text=True).stdout
        for more in (["--file", str(file)], [])
    )
    assert json.loads(continued) == json.loads(afresh)
    assert kept.items() <= json.loads(file.read_text())["trials"].items()


@pytest.mark.sweep
def test_a_dask_cluster_of_separate_processes_gives_the_same_trials(whole, tmp_path):
    from distributed import LocalCluster

    options = {"processes": True, "threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(n_workers=2, local_directory=str(tmp_path / "dask"), **options) as cluster:
        found = ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, cluster=cluster.scheduler_address)
    assert found.rows == plain(whole)


def test_a_file_of_other_trials_is_refused(tmp_path):
    file = tmp_path / "trials.json"
    ls.assemble(*NAMES, NOISE, trials=1, seed=8, file=file)
    with pytest.raises(AnswerError, match="seed differs"):
        ls.assemble(*NAMES, NOISE, trials=1, seed=9, file=file)
    file.write_text("[]")
    with pytest.raises(AnswerError, match="a file of trials that this call wrote"):
        ls.assemble(*NAMES, NOISE, trials=1, seed=8, file=file)


def test_what_cannot_be():
    two = ls.load(NAMES[1])
    with pytest.raises(AnswerError, match="overlapping"):
        ls.assemble(*NAMES, starts=[(10.0, 2), (10.5, 1)], trials=1)
    with pytest.raises(AnswerError, match="the start of paper-quadrilateral"):
        ls.assemble(*NAMES, starts=[(6.0, 2), (20.5, 1)], trials=1)
    with pytest.raises(AnswerError, match="kappa of the two scenes"):
        ls.assemble(NAMES[0], two.with_values({"throw.kappa": 24.0}), trials=1)
    with pytest.raises(AnswerError, match="surface_height of the two scenes"):
        ls.assemble(NAMES[0], two.with_values({"arm.surface_height": -0.4}), trials=1)
    trees = both()
    for tree in trees:
        del tree["cavity"]
    with pytest.raises(AnswerError, match="cavity"):
        ls.assemble(*trees, trials=1)
    with pytest.raises(AnswerError, match=r"effects\.contact"):
        ls.assemble(*NAMES, contact="hinge", trials=1)
    with pytest.raises(AnswerError, match=r"effects\.contact of the two scenes"):
        ls.assemble(pair(contact=True)[0], NAMES[1], trials=1)
    with pytest.raises(AnswerError, match="the contact"):
        ls.assemble(*pair(contact=True), contact="glue", trials=1)
    with pytest.raises(AnswerError, match="the trials"):
        ls.assemble(*NAMES, trials=0)
    with pytest.raises(AnswerError, match=r"the seed is -1; allowed: a whole number from 0"):
        ls.assemble(*NAMES, trials=1, seed=-1)
    energy = [ls.load({**tree, "model": {"flight": "exact", "flip": "energy"}}) for tree in both()]
    with pytest.raises(AnswerError, match="the flip of paper-triangle"):
        ls.assemble(*energy, trials=1)


def both():
    return [ls.load(name).as_dict() for name in NAMES]


def test_parts_that_do_not_fit_one_on_the_other_are_named(capfd, tmp_path):
    """Two triangles: the second's side 2 lies on the ramp beyond the first, which fills it down to the wall."""
    one = both()[0]
    deep = {**one, "cavity": {**one["cavity"], "width": "7 in", "depth": "4.4 in"}}
    ls.dump(ls.load(deep), tmp_path / "deep.toml")
    found = ls.assemble(deep, deep, trials=1)
    assert found.misfit.startswith("the part on side 2 in the cavity: standing out by")
    _, out, _ = run(capfd, "assemble", *[str(tmp_path / "deep.toml")] * 2, "--trials", "1")
    assert "THEY DO NOT FIT: the part on side 2" in out
    deep["effects"] = {"contact": True}
    with pytest.raises(AnswerError, match="standing out by"):
        ls.assemble(deep, deep, trials=1)


def test_a_film_is_of_a_trial_that_was_made():
    pytest.importorskip("pymunk")
    found = ls.assemble(*pair(contact=True), NOISE, trials=1)
    for number in (1, -1):
        with pytest.raises(AnswerError, match="the trial is"):
            found.film(number)


def test_the_first_series_is_of_twenty_or_of_all_there_are(whole):
    found = ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8)
    words = [row["outcome"] for row in whole]
    for made in (12, COUNT):
        fewer = replace(found, rows=found.rows[:made])
        first = words[: min(made, 20)]
        assert fewer.to_json()["first_series"] == {"of": len(first), "assembled": first.count("assembled")}
    assert "assembled" in words[20:]


KEYS = {
    "scenes", "unit", "contact", "carried", "misfit", "overlaps", "trials", "seed", "scatter", "counts", "assembled",
    "first_series", "joint", "survived",
}  # fmt: skip


def test_json_and_the_command(capfd, tmp_path):
    options = ("--trials", "12", "--seed", "2", "--scatter", "throw.speed=0.5 %")
    code, out, _ = run(capfd, "assemble", *NAMES, *options, "--json", "-o", str(tmp_path))
    found = json.loads(out)
    assert code == 0
    assert set(found) == KEYS
    assert found["contact"] == "none"
    assert found["misfit"] is None
    assert set(found["overlaps"]) == {"ever", "at_start", "at_rest", "in_flight"}
    assert set(found["assembled"]) == {"count", "of", "share", "interval"}
    assert set(found["joint"]) == {
        "table", "rates", "both", "product", "error", "error_interval", "serial"
    }  # fmt: skip
    assert json.loads((tmp_path / "assembly.json").read_text()) == found
    assert (tmp_path / "assembly.png").stat().st_size > 10_000
    code, out, _ = run(capfd, "assemble", *NAMES, *options)
    assert code == 0
    assert "the outlines overlap in" in out.splitlines()[1]  # reported first
    assert "one part after the other, or two arms" in out
    assert f"{found['first_series']['assembled']} assembled in the first 12 trials" in out
    code, _, err = run(capfd, "assemble", NAMES[0], "paper-designed")
    assert code == 2
    assert err.count("\n") == 1
