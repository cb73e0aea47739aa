"""What this package draws in the browser by itself: pictures on a canvas, sliders, and lines of text.

A figure of Bokeh costs the browser some 20 ms for a picture of the lanes, and its slider, which rebuilds itself at
every move, 14 ms for a move: too much for 20 pictures a second on two cores.  These cost 2 ms and 5 ms.
"""

from __future__ import annotations

import base64
import json
import math
import operator
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import param
from panel.custom import JSComponent

HERE = Path(__file__).parent
PACE = (HERE / "pace.js").read_text(encoding="utf-8")
MOST = 65535


class Hand(NamedTuple):
    """What a finger or a mouse does on a picture.

    Attributes
    ----------
    what : str
        "tap", of a drag "grasp", "drag", "release", of keys "step" and "enter".
    x, y : float
        Where, in the picture's coordinates; of a step whether to the right and up (1) or back (-1).
    """

    what: str
    x: float
    y: float


class Layer:
    """Shapes of one kind and look.

    Parameters
    ----------
    kind : str
        One of those that `canvas.js` draws: bars, strokes, path, marks, words, dots.
    called : str, optional
        What scripts of a reader, and tests, find it by.
    columns : iterable of str
        The names of its columns.
    **look
        The same for all its shapes.
    """

    def __init__(
        self, kind: str, called: str = "", *, columns: Iterable[str] = ("x", "y"), **look: Any
    ) -> None:
        self.kind, self.called, self.look = kind, called, look
        self.data: dict[str, Any] = {name: [] for name in columns}


class Canvas(JSComponent):  # type: ignore[misc]  # panel is not followed
    """A picture: layers of shapes in coordinates of its own, drawn by the browser, which then says so (`seen`).

    Parameters
    ----------
    called : str
        What scripts of a reader, and tests, find it by.
    layers : sequence of Layer
        From below to above.
    height : int
        On the page [pixel].
    touched : callable, optional
        Told what a `Hand` does.
    **view
        How it is laid out: `margins` [pixel] to the left, right, top and bottom; `equal` for one scale on both axes;
        `across` and `up`, names of the axes where they are drawn; `lanes`, words instead of numbers on the other axis;
        `keys` where arrow keys and Enter are told.
    """

    called = param.String()
    drawn = param.String("{}")
    _esm = PACE + (HERE / "canvas.js").read_text(encoding="utf-8")

    def __init__(
        self,
        called: str,
        layers: list[Layer],
        height: int,
        touched: Callable[[Hand], None] | None = None,
        *,
        stylesheets: Sequence[str] = (),
        **view: Any,
    ) -> None:
        self.layers, self.heading, self._touched, self.seen = layers, "", touched, False
        self._looks: tuple[str, dict[str, Any]] | None = None
        self._data: list[dict[str, Any]] = []
        self.view: dict[str, Any] = {"x": [0.0, 1.0], "y": [0.0, 1.0], **view}
        options = {"height": height, "sizing_mode": "stretch_width", "stylesheets": list(stylesheets)}
        super().__init__(called=called, drawn=self._written(), **options)

    def send(self) -> None:
        """Show what has changed, if anything has: one message.  Data of layers are not changed, but replaced."""
        looks, data = (self.heading, dict(self.view)), [each.data for each in self.layers]
        # most beats change nothing, and writing takes ten times as long as this
        if looks != self._looks or any(map(operator.is_not, data, self._data)):
            self._looks, self._data = looks, data
            self.drawn = self._written()

    def _written(self) -> str:
        layers = [
            {"kind": each.kind, "called": each.called, **each.look, **self._columns(each)}
            for each in self.layers
        ]
        return json.dumps({"view": self.view, "heading": self.heading, "layers": layers})

    def _columns(self, layer: Layer) -> dict[str, Any]:
        if layer.kind != "dots":
            return layer.data
        shares = [
            (np.asarray(layer.data[axis]) - lo) / (hi - lo) for axis in "xy" for lo, hi in [self.view[axis]]
        ]
        seen = np.stack(shares, axis=1)
        seen = seen[((seen >= 0.0) & (seen <= 1.0)).all(axis=1)]
        return {"packed": base64.b64encode(np.round(seen * MOST).astype("<u2").tobytes()).decode()}

    def _handle_msg(self, data: Any) -> None:
        """Take what the browser says, which may be anything."""
        self.seen = True
        if self._touched is None or not isinstance(data, dict):
            return
        what, at = data.get("what"), [data.get(axis, math.nan) for axis in "xy"]
        if isinstance(what, str) and all(
            isinstance(each, float | int) and math.isfinite(each) for each in at
        ):
            self._touched(Hand(what, *at))


class Bar(JSComponent):  # type: ignore[misc]  # panel is not followed
    """A slider.  Its values are not held back: Panel otherwise waits for 50 ms, and so takes fewer than 20 a second."""

    _debounce = 0

    label = param.String()
    start, end, step, value = (param.Number(default) for default in (0.0, 1.0, 0.01, 0.0))
    _esm = PACE + (HERE / "slider.js").read_text(encoding="utf-8")


class Words(JSComponent):  # type: ignore[misc]  # panel is not followed
    """A piece of HTML.  A pane of Panel makes the browser lay out the whole page when it changes."""

    object = param.String()
    _esm = """
    export function render({ model, el }) {
      const tell = () => { el.innerHTML = model.object }
      model.on("object", tell)
      tell()
    }
    """

    def __init__(self, html: str = "", **options: Any) -> None:
        super().__init__(object=html, sizing_mode="stretch_width", **options)
