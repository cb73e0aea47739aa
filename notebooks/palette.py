"""Store the pictures in notebooks with 256 colours: figures have few, and a page that loads fast needs no more.

``python notebooks/palette.py NOTEBOOK...`` changes the files in place; `make notebooks` calls it.
"""

import base64
import io
import sys
from collections.abc import Iterator
from pathlib import Path

import nbformat
from PIL import Image


def pictures(notebook: nbformat.NotebookNode) -> Iterator[nbformat.NotebookNode]:
    """Find the outputs with a picture."""
    for cell in notebook.cells:
        yield from (
            output.data for output in cell.get("outputs", []) if "image/png" in output.get("data", {})
        )


def smaller(png: str) -> str:
    """Write a picture, PNG in base64, with a palette."""
    picture = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    written = io.BytesIO()
    few = picture.quantize(256, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    few.save(written, "png", optimize=True)
    return base64.b64encode(written.getvalue()).decode()


for name in sys.argv[1:]:
    path = Path(name)
    notebook = nbformat.read(path, as_version=4)
    for data in pictures(notebook):
        data["image/png"] = smaller(data["image/png"])
    nbformat.write(notebook, path)
