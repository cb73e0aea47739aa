"""The page in a notebook: a kernel without JupyterLab, and what it sends to a browser."""

import re

import pytest

pytestmark = pytest.mark.sweep

SHOWN = """
import asyncio
import limitsets as ls

explorer, pages = ls.explore("paper-designed"), []
make = explorer.page
explorer.page = lambda: pages.append(make()) or pages[-1]
explorer
"""
MOVED = """
page = pages[-1]
page.sliders.put({"throw.speed": 150.0})
await asyncio.sleep(0.3)
print(page.scene.kappa > 26)
page.arm.canvas._handle_msg("seen")  # what the browser says of a picture that is there
await asyncio.sleep(1.0)
print(page.scene.kappa > 26)
"""
THREADS = """
import threading
import panel as pn

layout = next(view for view, *_ in pn.state._views.values() if isinstance(view, pn.Column))
taken = []
pn.Column._on_msg = lambda *_: taken.append(threading.current_thread())
threading.Thread(target=lambda: layout._on_msg("ref", None, {})).start()  # as JupyterLab does since 4.4
await asyncio.sleep(0.3)
print(taken == [threading.main_thread()])
"""


def test_a_notebook_shows_it_without_the_internet_and_it_beats_once_it_is_seen():
    nbformat = pytest.importorskip("nbformat", reason="notebooks")
    nbclient = pytest.importorskip("nbclient", reason="notebooks")
    pytest.importorskip("ipykernel", reason="notebooks")
    cells = [nbformat.v4.new_code_cell(cell) for cell in (SHOWN, MOVED, THREADS)]
    book = nbformat.v4.new_notebook(cells=cells)
    nbclient.NotebookClient(book, timeout=600, kernel_name="python3").execute()
    shown, moved, threads = (cell.outputs for cell in book.cells)
    assert not [each for each in shown if each.output_type == "stream"]  # no warning
    bundles = [each["data"] for each in shown if "data" in each]
    assert any("Bokeh" in data.get("text/html", "") for data in bundles)
    scripts = "".join(data.get("application/javascript", "") for data in bundles)
    assert len(scripts) > 1_000_000  # they come along
    assert set(re.findall(r"js_urls = (\[.*\])", scripts)) == {"[]"}
    assert "".join(each["text"] for each in moved) == "False\nTrue\n"
    assert threads[0]["text"] == "True\n"
