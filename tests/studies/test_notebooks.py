"""Every notebook runs from top to bottom, and is stored without outputs."""

import asyncio
import warnings
from pathlib import Path

import nbformat
import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))
LONG = {"02_atlas.ipynb"}  # a sweep over parameters
TO_RUN = [pytest.param(n, marks=pytest.mark.sweep) if n.name in LONG else n for n in NOTEBOOKS]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_stored_without_outputs(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert code
    assert all(cell.outputs == [] and cell.execution_count is None for cell in code)


@pytest.mark.parametrize("path", TO_RUN, ids=lambda path: path.name)
def test_runs(path, tmp_path):
    with warnings.catch_warnings():  # of jupyter's own making
        warnings.simplefilter("ignore")
        from nbclient import NotebookClient

        notebook = nbformat.read(path, as_version=4)
        place = {"metadata": {"path": tmp_path}}
        client = NotebookClient(notebook, timeout=300, kernel_name="python3", resources=place)
        asyncio.run(client.async_execute())
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not [output for output in outputs if output.output_type == "error"]
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) >= 3
