"""Runs that are killed, and disks that are full: what is computed afterwards is what an undisturbed run gives."""

import errno
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest
from zarr.storage import _local

from limitsets.base.campaign import Processes, Work, drive
from limitsets.base.errors import LimitsetsError
from limitsets.parameters.atlas import atlas
from tests.sweep.stores import bytes_of, run
from tests.sweep.tasks_of_tests import TASK, X, Y, long_answer

ROOT = Path(__file__).resolve().parents[2]
MARKS = [[], [pytest.mark.sweep], *[pytest.mark.repeats] * 18]
SEEDS = [pytest.param(k, marks=marks) for k, marks in enumerate(MARKS)]


def workers_of(process):
    """The processes that compute: children of the server that a driver starts, not of the driver."""
    found = []
    for child in psutil.Process(process).children():
        try:
            found += child.children()
        except psutil.NoSuchProcess:
            continue
    return found


def marks_of(store):
    """How many chunks a store counts as done."""
    place = store / "chunk_checksum" / "c"
    return sum(len(list(row.iterdir())) for row in place.iterdir()) if place.exists() else 0


@pytest.mark.parametrize("seed", SEEDS)
def test_a_killed_worker_costs_nothing_but_time(seed, tmp_path, whole):
    rng, killed, store = random.Random(seed), [], tmp_path / "s.zarr"
    chunks = rng.randrange(15)  # of 21, so that workers are there to be killed

    def kill():
        deadline = time.monotonic() + 60
        while not killed and time.monotonic() < deadline:
            found = workers_of(os.getpid())
            if found and marks_of(store) >= chunks:
                time.sleep(rng.uniform(0.0, 0.02))
                victim = rng.choice(found)
                with suppress(psutil.NoSuchProcess):  # ended in that very moment: take another
                    victim.kill()
                    killed.append(victim.pid)
            time.sleep(0.001)

    killer = threading.Thread(target=kill)
    killer.start()
    found = run(store, workers=2)
    killer.join()
    assert killed
    assert found.new == 21
    assert bytes_of(store) == whole


@pytest.mark.sweep
@pytest.mark.parametrize("seed", SEEDS)
def test_a_killed_driver_is_continued_and_leaves_no_workers(seed, tmp_path, whole):
    store, rng = tmp_path / "s.zarr", random.Random(seed)
    for chunks in sorted(rng.randrange(20) for _ in range(2)):  # the second one kills a run that continues
        driver = driver_of(store)
        while driver.poll() is None and marks_of(store) < chunks:
            time.sleep(0.001)
        time.sleep(rng.uniform(0.0, 0.03))
        workers = workers_of(driver.pid) if driver.poll() is None else []
        driver.kill()
        driver.wait()
        gone, left = psutil.wait_procs(workers, timeout=30)
        assert not left
        assert len(gone) == len(workers)
    run(store)
    assert bytes_of(store) == whole


def test_an_array_whose_making_was_cut_off_is_made_anew(stored, whole):
    """A driver may be killed after it made the folder of an array, and before it wrote what the array is."""
    shutil.rmtree(stored / "chunk_checksum" / "c")
    shutil.rmtree(stored / "height")
    (stored / "height").mkdir()
    (stored / "height" / "zarr.json.1f.partial").write_bytes(b"{")
    run(stored)
    assert bytes_of(stored) == whole


class Memory:
    """Keeps the numbers of chunks, in memory; its disk is full after so many."""

    path = None

    def __init__(self, room):
        self.done, self.room = set(), room

    def write(self, found):
        if len(self.done) == self.room:
            raise OSError(errno.ENOSPC, "No space left on device")
        self.done.add(found[0])


@pytest.mark.parametrize("room", [2, 9])
def test_a_worker_that_ends_amid_a_long_answer_keeps_nobody_waiting(room, tmp_path):
    """Because it was killed, or because the disk is full and all are ended while they answer."""
    kept, ended = Memory(room), []
    work = Work(9, long_answer, (str(tmp_path),), lambda k: 1, str, "the task", "name", "points")

    def run_it():
        with suppress(OSError):
            drive(work, kept, Processes(2))
        ended.append(True)

    runner = threading.Thread(target=run_it, daemon=True)
    runner.start()
    runner.join(120)
    assert ended
    assert len(kept.done) == room
    assert len(list(tmp_path.iterdir())) >= 1  # some worker died indeed


def driver_of(store, **options):
    """Start a driver, and wait until it has begun its store and its workers."""
    command = [sys.executable, "-m", "tests.sweep.tasks_of_tests", str(store)]
    driver = subprocess.Popen(command, cwd=ROOT, start_new_session=True, **options)
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and driver.poll() is None:
        if (store / "zarr.json").exists() and workers_of(driver.pid):
            return driver
        time.sleep(0.01)
    assert driver.poll() == 0, "it neither works nor is done"
    return driver


def refusal_of(store, new=None):
    """The words by which a run is refused; none where it is not, which computes so many chunks."""
    try:
        found = run(store)
    except LimitsetsError as refusal:
        return str(refusal)
    assert new in (None, found.new)
    return ""


@contextmanager
def full_after(monkeypatch, writes, *, torn=False):
    """Let a disk be full after so many files; a torn one has half a file's bytes in place of the whole file."""
    real, left = _local._put, [writes]

    def put(path, value, exclusive=False):
        left[0] -= 1
        if left[0] >= 0:
            return real(path, value, exclusive=exclusive)
        if torn and path.name != "zarr.json":
            half = bytes(value.as_buffer_like())
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(half[: len(half) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(_local, "_put", put)
        yield


@pytest.mark.parametrize("torn", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_full_disk_is_said_in_one_line_and_continued(seed, torn, tmp_path, whole, monkeypatch):
    store, rng = tmp_path / "s.zarr", random.Random(seed)
    writes = 40  # more than a store's first files
    while True:
        with full_after(monkeypatch, rng.randint(writes, 60), torn=torn):
            if not (words := refusal_of(store)):
                break
        assert "No space left on device; what is done is kept, the same call does the rest" in words
        writes = 10
    run(store)
    assert {name for name in bytes_of(store) if name.endswith(".partial")} == set()
    assert bytes_of(store) == whole


@pytest.mark.parametrize("writes", range(0, 24, 5))
def test_a_disk_that_is_full_from_the_start_leaves_no_half_store(writes, tmp_path, whole, monkeypatch):
    store = tmp_path / "s.zarr"
    with full_after(monkeypatch, writes), pytest.raises(LimitsetsError, match="No space left"):
        run(store)
    run(store)
    assert bytes_of(store) == whole
    assert [path.name for path in tmp_path.iterdir()] == ["s.zarr"]


def mounted(place, size):
    """Mount a small file system; False where this process may not."""
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


if hasattr(os, "geteuid") and os.geteuid() == 0:

    @pytest.mark.sweep
    @pytest.mark.parametrize("pages", [25, 34, 43])
    def test_a_file_system_that_is_full_is_continued_when_it_is_larger(pages, tmp_path, whole):
        place = tmp_path / "small"
        place.mkdir()
        if not mounted(place, pages * 4096):
            return  # root of a container that may mount nothing
        try:
            with pytest.raises(LimitsetsError, match="No space left on device"):
                run(place / "s.zarr")
            subprocess.run(["mount", "-o", "remount,size=4m", str(place)], check=True)
            run(place / "s.zarr")
            assert bytes_of(place / "s.zarr") == whole
        finally:
            subprocess.run(["umount", str(place)], check=True)


def test_a_second_process_is_refused_as_long_as_the_first_writes(tmp_path, whole):
    store = tmp_path / "s.zarr"
    driver = driver_of(store)
    said = rf"written by process {driver.pid} on .*wait until that process ends"
    with pytest.raises(LimitsetsError, match=said):
        run(store)
    driver.kill()
    driver.wait()
    run(store)
    assert bytes_of(store) == whole
    assert [path.name for path in tmp_path.iterdir()] == ["s.zarr"]


# What a file of metadata says that a reader goes by; what zarr fills in where it is misspelt may pass.
SAID = ["attributes", "shape", "data_type", "dimension_names", "fill_value"]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    "name",
    ["arm.surface_height/c/0", "throw.speed/c/0", "throw.speed/zarr.json", "kappa/zarr.json", "zarr.json"],
)
def test_a_bit_that_flipped_beside_the_data_is_one_line(name, seed, stored, whole):
    """Coordinates, units, codes and attributes; what a flip leaves as it was (a space, a case of E) may pass."""
    rng, data = random.Random(seed), bytearray(whole[name])
    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    (stored / name).write_bytes(bytes(data))
    words = refusal_of(stored, new=0)  # nothing is computed again
    if words:
        assert "damaged" in words
        assert "\n" not in words
        return
    for key, text in whole.items():
        if key.endswith("zarr.json"):
            found, wanted = json.loads((stored / key).read_text()), json.loads(text)
            assert [found.get(word) for word in SAID] == [wanted.get(word) for word in SAID]


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("kappa", '"in"', '"mm"'),
        ("throw.speed", '"deg/s"', '"rad/s"'),
        ("status", "impossible", "impassible"),
        ("status", '"flag_values": [', '"flag_values": [ 7,'),
        ("chunk_checksum", "CRC", "CRD"),
    ],
)
def test_units_codes_and_attributes_are_compared(name, old, new, tmp_path):
    store = tmp_path / "s.zarr"
    given = {"task": f"{TASK.partition(':')[0]}:in_blocks", "store": store}
    atlas("paper-designed", X, Y, **given)
    file = store / name / "zarr.json"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(LimitsetsError, match=rf"damaged.*{name}.*name another store"):
        atlas("paper-designed", X, Y, **given)


def test_chunks_that_were_damaged_are_computed_again(stored, whole):
    (stored / "kappa" / "c" / "1" / "4").write_bytes(b"no such bytes")
    (stored / "feet" / "c" / "2" / "3" / "0").unlink()
    found = run(stored)
    assert (found.new, found.kept) == (2, 19)
    assert bytes_of(stored) == whole


def test_a_chunk_that_always_kills_its_worker_is_named(tmp_path):
    axes = ("throw.speed=150:160:4", "arm.surface_height=-1:0:5")
    task = "tests.sweep.tasks_of_tests:deadly"
    given = {"task": task, "chunk": (1, 4), "store": tmp_path / "s.zarr", "workers": 2}
    place = r".*arm\.surface_height -0\.5 in, throw\.speed 150"
    for said in (rf"killed 3 times by one chunk{place}", "killed 3 times"):
        with pytest.raises(LimitsetsError, match=said):
            atlas("paper-designed", *axes, **given)


@pytest.mark.sweep
def test_ctrl_c_ends_the_workers_and_keeps_what_is_done(tmp_path, whole):
    store = tmp_path / "s.zarr"
    driver = driver_of(store, stderr=subprocess.PIPE)
    while driver.poll() is None and marks_of(store) < 3:
        time.sleep(0.01)
    workers = workers_of(driver.pid)
    os.killpg(driver.pid, signal.SIGINT)  # as a terminal does: to all of them
    _, said = driver.communicate(timeout=60)
    assert b"KeyboardInterrupt" in said
    assert said.count(b"Traceback") == 1  # the driver's own; workers say nothing
    assert not psutil.wait_procs(workers, timeout=30)[1]
    assert run(store).kept >= 3
    assert bytes_of(store) == whole
