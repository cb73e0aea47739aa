"""The command line: exit codes, what goes to which stream, JSON words, and files that stay whole."""

import ctypes
import io
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from unittest.mock import Mock

import pytest
from numba.core.compiler_lock import global_compiler_lock

import limitsets as ls
import limitsets.feeder.scene
from limitsets.face.cli import output
from tests.cli.command import json_of, names_in, prints, refusal, run, written

SCENES = Path(__file__).parents[1] / "analysis"
COMMAND = [sys.executable, "-W", "error", "-m", "limitsets"]


def start(*words, **options):
    return subprocess.Popen(
        [*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )


# ---------------------------------------------------------------- bad input

# A command, and what stands behind it.
BAD = """
| nonsense | --bogus
analyse | | nope.toml | paper-designd | '' | . | broken.toml
analyse paper-designed | --cells 0 | --cells many | --cells 99999999999 | --error 0 | --error nan | --error fine
analyse paper-designed | --error 1e-6 --cells 64 | --cells 64 --out file | --cells 64 --out file/below
throw paper-designed | --x 8 | --side 2
throw paper-designed --x 8 | --side 3 | --side -1
throw paper-designed --side 2 | --x '8 kg' | --x 8,5 | --x nan | --x inf | --x 1e400 | --x '' | --x 28.1
throw paper-designed --x 8 --side 2 | --count 0 | --count 9999999999 | --out . | --out /dev/full
plot paper-designed | | blob | map --out map.bmp | map --x 8 --side 2
plot paper-designed flight | --x 8 | --x 1 --side 2 | --x 8 --side 2 --out file/map.png
scenes | --out file/scenes.json
"""
REFUSED = [
    f"{command.strip()} {rest.strip()}"
    for command, *rests in (row.split("|") for row in BAD.strip().splitlines())
    for rest in rests
]


@pytest.mark.parametrize("line", REFUSED)
def test_bad_input_is_one_line_and_exit_2(capfd, line):
    Path("file").write_text("mine")
    Path("broken.toml").write_text("name = ")
    refusal(capfd, line)
    assert Path("file").read_text() == "mine"


def test_a_bug_is_one_line_too(capfd, monkeypatch):
    monkeypatch.setattr(limitsets.scene, "scenes", lambda: 1 / 0)
    code, out, err = run(capfd, "scenes")
    assert (code, out) == (2, "")
    assert err == "limitsets: this is a bug in limitsets: ZeroDivisionError: division by zero\n"


@pytest.mark.parametrize("fault", [MemoryError, PermissionError(13, "denied", "x.png"), OSError("odd")])
def test_faults_of_the_machine(capfd, monkeypatch, fault):
    monkeypatch.setattr(limitsets.scene, "scenes", Mock(side_effect=fault))
    refusal(capfd, "scenes")


# ---------------------------------------------------------------- answers


def test_scenes(capfd):
    assert [record["name"] for record in json_of(capfd, "scenes")] == ls.scenes()
    out = prints(capfd, "scenes")
    assert all(name in out for name in ls.scenes())


def test_throw(capfd):
    code, out, err = run(capfd, "throw paper-designed --x 8 --side 2 --count 3 --json")
    assert (code, err) == (0, "")
    record = json.loads(out)
    assert [each["x"] for each in record] == pytest.approx([8.262013, 8.557124, 8.891802], abs=1e-6)
    words = {"x", "side", "status", "phi", "displacement", "sides_turned", "other_vertex_first"}
    assert all(set(each) == words for each in record)
    assert record[0]["phi"] == pytest.approx(0.311437, abs=1e-6)
    assert [each["status"] for each in record] == ["jog"] * 3
    assert json_of(capfd, "throw paper-designed --x '20.32 cm' --side 2 --count 3 -o throws.json") == record
    assert json.loads(Path("throws.json").read_text()) == record
    assert names_in() == {"throws.json"}
    text = prints(capfd, "throw paper-designed --x 8 --side 2")
    assert "x [in]" in text
    assert "8.262013" in text


def test_throw_ends_at_the_first_exit(capfd):
    (record,) = json_of(capfd, "throw paper-designed --x 3 --side 2 --count 9")
    assert record == {
        "x": 3.0, "side": 2, "status": "outside-model", "phi": None, "displacement": None, "sides_turned": 0,
        "other_vertex_first": False,
        "reason": "R <= a: no part rests on side 2 with its centre of mass at x = 3, for a = 4.22558",
    }  # fmt: skip
    high = written(values={"arm.surface_height": -3.0})
    assert json_of(capfd, f"throw {high} --x 20 --side 0 --count 99")[-1]["status"] == "outward"


def test_throw_says_why_it_is_outside_the_model(capfd):
    _, _, err = run(capfd, "throw paper-designed --x 1 --side 2")
    assert "outside-model: R <= a" in err
    weak = written(values={"throw.kappa": 1.0})  # 2 (R - a) is more than 2 pi kappa
    _, out, err = run(capfd, f"throw {weak} --x 27 --side 2 --json")
    assert json.loads(out)[-1]["reason"] == "no impact within a full turn"
    assert "no impact within a full turn" in err


def test_throw_that_stalls_says_so(capfd):
    start_x = str(ls.load("paper-designed").sides.a[0] * (1 + 1e-15))
    code, out, err = run(capfd, "throw paper-designed --x", start_x, "--side", "0", "--count", "5", "--json")
    assert (code, json.loads(out)) == (0, [])
    assert "stalled" in err


def test_throw_and_flags(capfd):
    assert json_of(capfd, "throw paper-designed --x 21 --side 0")[0]["other_vertex_first"] is True
    assert "another vertex lands first" in prints(capfd, "throw paper-designed --x 21 --side 0")


def test_analyse(capfd):
    """Of four scenes all that is written: tests/report."""
    record = json_of(capfd, "analyse", str(SCENES / "five-sides.toml"))
    folder = Path("five-sides-analysis")
    assert names_in(folder) >= {"report.md", "analysis.json", "limit-set.png"}
    assert record == json.loads((folder / "analysis.json").read_text())
    assert record["scene"]["name"] == "five-sides"


def test_analyse_in_words(capfd):
    out = prints(capfd, "analyse paper-initial -o here --cells 2048")
    assert "18.994 to 19.976, 20.434 to 21.555" in out
    assert "goal oriented_beyond: does not hold (sampled, not proved)" in out
    assert f"report: {Path('here') / 'report.md'}" in out


def test_analyse_to_an_error(capfd):
    code, out, err = run(capfd, "analyse paper-designed --error 1e-6 --json")
    assert code == 0
    assert err.count("limitsets: error 1e-06 in asked: end points") == 1
    found = json.loads(out)
    assert found["accuracy"]["met"] is True
    assert found["accuracy"]["how"] == "proved"
    (lo, hi) = found["attractors"][0]["extents"]["2"][0]
    assert max(abs(lo - 8.9140259080455), abs(hi - 23.383151921158)) < found["accuracy"]["asked"]
    report = Path("paper-designed-analysis/report.md").read_text()
    assert "Error reached" in report
    assert "was not met" not in report


def test_an_error_that_cannot_be_met_is_told_before_and_after(capfd):
    code, out, err = run(capfd, "analyse paper-designed --error 1e-15")
    assert code == 0
    assert "error 1e-15 in asked cannot be met; the best there is: end points" in err
    assert "the error of 1e-15 in was not met: rounding leaves about" in out
    assert "**The error asked for was not met**" in Path("paper-designed-analysis/report.md").read_text()


@pytest.mark.parametrize("kind", ["limit-set", "map", "basins", "morse", "flight"])
def test_plot(capfd, kind):
    figure = json_of(capfd, "plot", str(SCENES / "five-sides.toml"), kind, "-o", "other.svg")
    assert figure == {"figure": "other.svg"}
    assert "<svg" in Path("other.svg").read_text()


def test_plot_where_nothing_is_said_and_of_a_chosen_flight(capfd):
    assert prints(capfd, "plot paper-designed morse") == "figure: paper-designed-morse.png\n"
    assert prints(capfd, "plot paper-designed part") == "figure: paper-designed-part.png\n"
    assert Path("paper-designed-morse.png").read_bytes().startswith(b"\x89PNG")
    prints(capfd, "plot paper-designed flight --x '38.1 cm' --side 1 -o one.pdf")
    assert Path("one.pdf").read_bytes().startswith(b"%PDF")


def test_version_and_help(capfd):
    code, out, _ = run(capfd, "--version")
    assert (code, out) == (0, f"limitsets {ls.__version__}\n")
    for words in (["--help"], ["analyse", "-h"], []):
        code, out, err = run(capfd, *words)
        assert (code, err) == (0, "")
        assert "Usage: limitsets" in out


# ---------------------------------------------------------------- as a process


def test_help_loads_no_room():
    code = "import sys; from limitsets.cli import main; main(['--help']); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.splitlines()[-1].split()}
    assert "typer" in loaded
    heavy = "numpy numba scipy matplotlib networkx xarray zarr pandas pyarrow dask distributed panel bokeh"
    assert not loaded & set(heavy.split())


def test_exit_codes_and_streams_of_a_process():
    process = start("scenes", "--json")
    out, err = process.communicate()
    assert (process.returncode, err) == (0, "")
    assert len(json.loads(out)) >= 4
    process = start("analyse", "nope")
    out, err = process.communicate()
    assert (process.returncode, out) == (2, "")
    assert err.count("\n") == 1


def test_no_progress_is_printed_after_the_command(monkeypatch):
    begun = threading.Event()

    class Slow(io.StringIO):
        def write(self, text):
            begun.set()
            time.sleep(0.1)
            return super().write(text)

    monkeypatch.setattr("limitsets.progress.PATIENCE", 0.0)
    monkeypatch.setattr(sys, "stderr", Slow())
    with output.progress() as tell:
        tell("throwing", 0, 1)
        assert begun.wait(10)
    assert sys.stderr.getvalue() == "limitsets: throwing (1 of 1)\n"


def test_ctrl_c_that_a_callback_loses_ends_what_comes_of_it(capfd):
    """While numba compiles it may be lost, and what is half compiled fails: "a bug: no compiled object yet"."""

    @ctypes.CFUNCTYPE(None)
    def callback():
        signal.raise_signal(signal.SIGINT)

    def work():
        with output.progress():
            callback()
            raise RuntimeError("no compiled object yet")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    hook = sys.unraisablehook
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
        with pytest.raises(RuntimeError), output.progress():
            raise RuntimeError("an error of its own")
    finally:
        signal.signal(signal.SIGINT, before)
    assert sys.unraisablehook is hook
    assert capfd.readouterr().err == ""


def test_a_reader_that_goes_away():
    process = start("throw", "paper-designed", "--x", "8", "--side", "2", "--count", "20000", "--json")
    process.stdout.readline()
    process.stdout.close()
    assert process.wait() == 0
    said = process.stderr.read().splitlines()
    process.stderr.close()
    assert [line for line in said if "a first run compiles" not in line] == []  # told on a slow machine


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk():
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*COMMAND, "scenes"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert done.stderr == "limitsets: No space left on device\n"


IMPORTED = """
import runpy, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
class Finder:
    def find_spec(name, path=None, target=None):
        if name == {module!r}:
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Finder)
sys.argv = ['limitsets', 'scenes']
runpy.run_module('limitsets', run_name='__main__', alter_sys=True)
"""


@pytest.mark.parametrize(
    "module", [f"limitsets.face.cli{rest}" for rest in ("", ".app", ".output")] + ["typer"]
)
def test_ctrl_c_while_the_package_is_imported(module):
    """A finder sends the signal where the module is asked for."""
    code = IMPORTED.format(module=module)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "limitsets: interrupted\n")


def test_ctrl_c_inside_an_exec_ends_the_command_by_its_exit_code(tmp_path):
    """CPython remembers the interrupt of an `exec` and kills the process that handled it, under `-m` alone."""
    code = IMPORTED.format(module="limitsets.face.cli.app").split("sys.argv")[0]
    code = code.replace("signal.raise_signal(signal.SIGINT)", "exec('signal.raise_signal(signal.SIGINT)')")
    (tmp_path / "sitecustomize.py").write_text(code)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    command = [sys.executable, "-m", "limitsets", "scenes"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "limitsets: interrupted\n")


def test_ctrl_c_waits_while_numba_compiles():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), output.progress() as tell:  # noqa: PT012 - what comes after the interrupt is tested
            with global_compiler_lock:
                signal.raise_signal(signal.SIGINT)
                compiled = True
            tell("next", 0, 1)
            pytest.fail("the step goes on")
        assert compiled
        with pytest.raises(KeyboardInterrupt), output.progress(), global_compiler_lock:  # noqa: PT012 - likewise
            signal.raise_signal(signal.SIGINT)
            with pytest.raises(KeyboardInterrupt):  # the second does not wait
                signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.sweep
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_leaves_the_old_files_whole(tmp_path):
    folder = tmp_path / "report"
    folder.mkdir()
    old = ("report.md", "map.png")
    for name in old:
        (folder / name).write_text("old")
    # A run in the background of a shell hands on that SIGINT is ignored; a person's terminal does not.
    heard = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.default_int_handler)}
    process = start("analyse", "paper-designed", "-o", str(folder), **heard)
    deadline = time.monotonic() + 120
    while not list(folder.glob(".draft-*")) and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 130
    assert "Traceback" not in err
    assert err.splitlines()[-1] == "limitsets: interrupted"
    assert {path.name: path.read_text() for path in folder.iterdir()} == dict.fromkeys(old, "old")


def test_throw_tells_sides_turned_and_that_auto_is_not_resolved(capfd):
    # beyond r_2 = 20 a part flips, from side 2 onto side 0
    asks = written("paper-initial", effects={"auto": True})
    _, out, err = run(capfd, f"throw {asks} --x 22 --side 2 --json")
    assert "auto in [effects] is resolved by limitsets analyse; thrown with: no effects" in err
    (record,) = json.loads(out)
    assert (record["status"], record["sides_turned"], record["side"]) == ("flip", 1, 0)
