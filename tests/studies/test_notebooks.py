"""Every notebook runs from top to bottom, and shows what is stored in it."""

import asyncio
import warnings
from pathlib import Path

import nbformat
import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))
LONG = {
    "4_margins_and_design.ipynb",
    "5_the_atlas.ipynb",
    "6_your_own_map.ipynb",
}  # the last compiles its maps
TO_RUN = [pytest.param(n, marks=pytest.mark.sweep) if n.name in LONG else n for n in NOTEBOOKS]


def code_of(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def shown(cell):
    """What a cell shows, by kind.  Prints may come in pieces; bars of progress leave empty pages where it is slow."""
    outputs = [each for each in cell.outputs if each.output_type in ("execute_result", "display_data")]
    return [sorted(output.data) for output in outputs if output.data.get("text/html") != ""]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_stored_as_it_ran(path):
    """From top to bottom in a new kernel, without errors or warnings, with pictures that load fast."""
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    code = code_of(notebook)
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    outputs = [output for cell in code for output in cell.outputs]
    assert not [
        output for output in outputs if output.output_type == "error" or output.get("name") == "stderr"
    ]
    assert path.stat().st_size < 150_000


@pytest.mark.sweep
@pytest.mark.parametrize("path", TO_RUN, ids=lambda path: path.name)
def test_runs_and_shows_what_is_stored(path, tmp_path):
    with warnings.catch_warnings():  # of jupyter's own making
        warnings.simplefilter("ignore")
        from nbclient import NotebookClient

        notebook = nbformat.read(path, as_version=4)
        stored = [shown(cell) for cell in code_of(notebook)]
        place = {"metadata": {"path": tmp_path}}
        client = NotebookClient(notebook, timeout=300, kernel_name="python3", resources=place)
        asyncio.run(client.async_execute())
    outputs = [output for cell in code_of(notebook) for output in cell.outputs]
    assert not [output for output in outputs if output.output_type == "error"]
    assert [shown(cell) for cell in code_of(notebook)] == stored
    assert len([kinds for cell in stored for kinds in cell if "image/png" in kinds]) >= 2
