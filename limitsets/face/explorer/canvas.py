"""The package's own drawing in the browser: the look of the page, pictures on a canvas, sliders with fields.

A Bokeh figure of the lanes costs the browser some 20 ms, and a Bokeh slider, which rebuilds itself at every move, 14 ms
per move: too much for 20 pictures a second on two cores.  The pictures and sliders here cost 2 ms and 5 ms.
"""

from __future__ import annotations

import base64
import json
import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import panel as pn
import param
from panel.custom import JSComponent

from limitsets.base import LimitsetsError
from limitsets.face.explorer.estimates import Knob

HERE = Path(__file__).parent
PACE = (HERE / "pace.js").read_text(encoding="utf-8")
MOST = 65535


class Hand(NamedTuple):
    """An action of a finger, a mouse or a key on a picture.

    Attributes
    ----------
    what : str
        "tap"; "grasp", "drag" and "release" for a drag; "step" and "enter" for keys.
    x, y : float
        The place in the picture's coordinates; for a step its direction: right or up (1), or back (-1).
    """

    what: str
    x: float
    y: float


class Layer:
    """Shapes of one kind and look.

    Parameters
    ----------
    kind : str
        A kind that `canvas.js` draws: bars, strokes, path, marks, words, dots.
    called : str
        What it is filled by, and what scripts of a reader, and tests, find it by.
    columns : iterable of str
        The names of its columns.
    **look
        The look of all its shapes.
    """

    def __init__(self, kind: str, called: str, columns: Iterable[str] = ("x", "y"), **look: Any) -> None:
        self.kind, self.called, self.look = kind, called, look
        self.data: dict[str, Any] = {name: [] for name in columns}

    def put(self, rows: Iterable[Sequence[Any]]) -> None:
        """Replace its shapes; a row has an entry for each column."""
        shapes = list(rows)
        self.data = {name: [shape[k] for shape in shapes] for k, name in enumerate(self.data)}


class Canvas(JSComponent):  # type: ignore[misc]  # panel is not followed
    """A picture: layers of shapes in coordinates of its own, drawn by the browser, which then says so (`seen`).

    Parameters
    ----------
    called : str
        What scripts of a reader, and tests, find it by.
    layers : sequence of Layer
        From below to above.
    height : int or None
        Height on the page [pixel]; None where `tall` gives it.
    touched : callable, optional
        Called with each `Hand`.
    **view
        How it is laid out: `margins` [pixel] to the left, right, top and bottom; `equal` for one scale on both axes;
        `across` and `up`, names of the axes where they are drawn; `lanes`, words instead of numbers on the other axis;
        `keys` if arrow keys and Enter are reported; `tall`, the frame's height as a share of its width.
    """

    called = param.String()
    drawn = param.String("{}")
    _esm = PACE + (HERE / "canvas.js").read_text(encoding="utf-8")

    def __init__(
        self,
        called: str,
        layers: list[Layer],
        height: int | None,
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

    def layer(self, called: str) -> Layer:
        """Give the layer of this name."""
        return next(layer for layer in self.layers if layer.called == called)

    def put(self, called: str, rows: Iterable[Sequence[Any]]) -> None:
        """Replace the shapes of a layer."""
        self.layer(called).put(rows)

    def send(self) -> None:
        """Send the changes, if there are any, in one message.  Data of layers are replaced, never changed in place."""
        looks, data = (self.heading, dict(self.view)), [each.data for each in self.layers]
        # most beats change nothing, and writing takes ten times as long as this comparison
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
        """Take a message of the browser, which may contain anything."""
        self.seen = True
        if self._touched is None or not isinstance(data, dict):
            return
        what, at = data.get("what"), [data.get(axis, math.nan) for axis in "xy"]
        if isinstance(what, str) and all(
            isinstance(each, float | int) and math.isfinite(each) for each in at
        ):
            self._touched(Hand(what, *at))


class Bar(JSComponent):  # type: ignore[misc]  # panel is not followed
    """A slider without throttling: Panel's own waits for 50 ms, and so takes fewer than 20 values a second."""

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

    def __init__(self, html: str = "", **look: Any) -> None:
        super().__init__(object=html, sizing_mode="stretch_width", stylesheets=[SAID], **look)


# ----------------------------------------------------------------
# The look of the page: one column on a phone, three on a wide screen; the keyboard's focus is visible.


# Panel's own page (`base`), with the line that makes phones use their own width.
PAGE = """{% extends base %}{% block preamble %}
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>body { padding: 0 10px 10px !important; box-sizing: border-box; color: #222; }</style>
{% endblock %}"""


GRID = """
:host { display: grid !important; grid-template-columns: minmax(0, 1fr); gap: 8px 24px; align-items: start; }
.error { height: 3.4rem; overflow: auto; }
@media (min-width: 1000px) {
  :host { grid-template-columns: repeat(3, minmax(0, 1fr)); grid-template-rows: auto auto 1fr; max-width: 1480px; }
  .title, .sliders, .proved { grid-column: 1; }
  .error, .pictures { grid-column: 2 / 4; }
  .pictures { grid-row: 2 / 4; }
  .proved { grid-row: 3 / 5; }
  .estimated { grid-area: 4 / 2; }
  .part { grid-area: 4 / 3; }
  .atlas { grid-column: 1 / 4; }
}
"""
"""Cells of the page by their classes.  The room of an error is there without one: what is below does not move."""


def swatch(face: str, hatch: str = " ") -> str:
    """Draw a piece of a colour and, in lines or dots, its hatch, as the pictures have them (HTML)."""
    marks = ", ".join(
        "radial-gradient(#222 30%, transparent 35%) 0 0 / 5px 5px"
        if angle is None
        else f"repeating-linear-gradient({angle}deg, transparent 0 3px, #222 3px 4px)"
        for angle in TURNED.get(hatch, ())
    )
    return f'<span class="swatch" style="background: {marks}{", " if marks else ""}{face}"></span>'


LINES: dict[str, tuple[int | None, ...]] = {
    "/": (135,),
    "\\": (45,),
    "x": (45, 135),
    "|": (90,),
    "-": (0,),
    "+": (0, 90),
}
TURNED = {**LINES, "*": (0, 90), "o": (None,), ".": (None,)}
"""Angles across the lines of each hatch, in the words of CSS; None for dots."""

SAID = """
:host, div { font-family: system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: #222; }
h1 { font-size: 1.25rem; margin: 0.2rem 0; }
h2 { font-size: 1rem; margin: 0.5rem 0 0.2rem; }
p { margin: 0.2rem 0; font-size: 0.9rem; line-height: 1.35; }
.wrong { color: #8a1c00; background: #fdeee6; border-left: 4px solid #8a1c00; padding: 0.4rem 0.6rem; }
.wrong { overflow-wrap: anywhere; }
.how { color: #555; font-size: 0.8rem; }
.said { border-collapse: collapse; font-size: 0.85rem; width: 100%; }
.said th { text-align: left; font-weight: 600; vertical-align: top; padding: 0.2rem 0.6rem 0.2rem 0; width: 38%; }
.said td { vertical-align: top; padding: 0.2rem 0; overflow-wrap: anywhere; }
progress { width: 5rem; accent-color: #0072B2; }
.swatch { display: inline-block; width: 1.1em; height: 0.8em; border: 1px solid #444; margin-right: 0.3em; }
"""

SLIDER = """
input:focus-visible, button:focus-visible, select:focus-visible, a:focus-visible, canvas:focus-visible,
textarea:focus-visible { outline: 3px solid #0072B2; outline-offset: 1px; }
label { font-size: 0.85rem; font-family: system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; }
input[type=range] { display: block; width: 100%; height: 24px; margin: 0; accent-color: #0072B2; touch-action: pan-y; }
"""


# ----------------------------------------------------------------
# Sliders, each with a field beside it in which a value with a unit can be typed.


def said(action: Callable[[], None], say: Callable[[object], None]) -> None:
    """Do something, and say what is wrong if it is refused."""
    try:
        action()
    except LimitsetsError as error:
        say(error)


class Sliders:
    """The sliders of a scene or a map.

    Parameters
    ----------
    moved : callable
        Called when a value has changed.
    say : callable
        Called with the error.
    """

    def __init__(self, moved: Callable[[], None], say: Callable[[object], None]) -> None:
        self._moved, self._say, self._setting = moved, say, False
        self.knobs: tuple[Knob, ...] = ()
        self.values: dict[str, float] = {}
        self._bars: dict[str, Any] = {}
        self._fields: dict[str, Any] = {}
        self.column = pn.Column(sizing_mode="stretch_width")

    def open(self, knobs: tuple[Knob, ...]) -> None:
        """Show these knobs; sliders of the same quantities are kept, and the keyboard's focus with them."""
        if [knob[:3] for knob in knobs] == [knob[:3] for knob in self.knobs]:
            self.knobs, self._setting = knobs, True
            for knob in knobs:
                self._bars[knob.name].param.update(start=knob.lo, end=knob.hi, value=knob.value)
            self.put({knob.name: knob.value for knob in knobs}, told=False)
            return
        self.knobs, self.values = knobs, {knob.name: knob.value for knob in knobs}
        self._bars, self._fields, rows = {}, {}, []
        for knob in knobs:
            bar = Bar(
                label=knob.title, start=knob.lo, end=knob.hi, step=knob.step, value=knob.value,
                stylesheets=[SLIDER], styles={"flex": "1 1 150px"}, sizing_mode="stretch_width",
            )  # fmt: skip
            field = pn.widgets.TextInput(
                label=f"{knob.words}, typed", value=_text(knob, knob.value),
                width=128, margin=(5, 0, 5, 10), stylesheets=[SLIDER, HIDDEN_LABEL],
            )  # fmt: skip
            bar.param.watch(lambda event, name=knob.name: self._slid(name, event.new), "value")
            field.param.watch(lambda event, knob=knob: self._typed(knob, event.new), "value")
            self._bars[knob.name], self._fields[knob.name] = bar, field
            rows.append(pn.Row(bar, field, sizing_mode="stretch_width"))
        self.column.objects = rows

    def put(self, values: Mapping[str, float], *, told: bool = True) -> None:
        """Move sliders by program."""
        self._setting = True
        self.values |= values
        for knob in self.knobs:
            if knob.name in values:  # a typed value may lie beyond the slider's ends
                self._bars[knob.name].value = min(max(values[knob.name], knob.lo), knob.hi)
        self._setting = False
        if told:
            self._moved()

    def tell(self) -> None:
        """Write the values into the fields."""
        self._setting = True
        for knob in self.knobs:
            self._fields[knob.name].value = _text(knob, self.values[knob.name])
        self._setting = False

    def _slid(self, name: str, value: float) -> None:
        if not self._setting:
            self.put({name: value})

    def _typed(self, knob: Knob, text: str) -> None:
        if not self._setting:
            said(lambda: self.put({knob.name: knob.read(text)}), self._say)


HIDDEN_LABEL = """
label { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); white-space: nowrap; }
"""


def _text(knob: Knob, value: float) -> str:
    return f"{value:.6g} {knob.unit}".rstrip()
