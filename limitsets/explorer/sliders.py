"""Sliders, each with a field beside it in which a value with a unit can be typed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import panel as pn

from limitsets.errors import LimitsetsError
from limitsets.explorer.canvas import Bar
from limitsets.explorer.knobs import Knob
from limitsets.explorer.look import SLIDER


class Sliders:
    """The sliders of a scene or a map.

    Parameters
    ----------
    moved : callable
        Told that a value has changed.
    say : callable
        Told what is wrong.
    """

    def __init__(self, moved: Callable[[], None], say: Callable[[object], None]) -> None:
        self._moved, self._say, self._setting = moved, say, False
        self.knobs: tuple[Knob, ...] = ()
        self.values: dict[str, float] = {}
        self._bars: dict[str, Any] = {}
        self._fields: dict[str, Any] = {}
        self.column = pn.Column(sizing_mode="stretch_width")

    @property
    def has_centre(self) -> bool:
        """Whether there are sliders of the centre of mass."""
        return "part.mass.center.along" in self.values

    def open(self, knobs: tuple[Knob, ...]) -> None:
        """Begin with these; sliders of the same numbers are kept, and the keyboard's focus with them."""
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
                label=f"{knob.words}, typed",
                value=_text(knob, knob.value),
                width=128,
                stylesheets=[SLIDER, HIDDEN_LABEL],
            )
            bar.param.watch(lambda event, name=knob.name: self._slid(name, event.new), "value")
            field.param.watch(lambda event, knob=knob: self._typed(knob, event.new), "value")
            self._bars[knob.name], self._fields[knob.name] = bar, field
            rows.append(pn.Row(bar, field, sizing_mode="stretch_width"))
        self.column.objects = rows

    def put(self, values: Mapping[str, float], *, told: bool = True) -> None:
        """Move sliders without a hand."""
        self._setting = True
        for name, value in values.items():
            knob = next(each for each in self.knobs if each.name == name)
            self.values[name] = value
            bar = self._bars[name]
            shown = min(max(value, knob.lo), knob.hi)  # what is typed may lie beyond
            if bar.value != shown:
                bar.value = shown
        self._setting = False
        if told:
            self._moved()

    def tell(self) -> None:
        """Write the values into the fields."""
        self._setting = True
        for knob in self.knobs:
            text = _text(knob, self.values[knob.name])
            if self._fields[knob.name].value != text:
                self._fields[knob.name].value = text
        self._setting = False

    def _slid(self, name: str, value: float) -> None:
        if not self._setting:
            self.put({name: value})

    def _typed(self, knob: Knob, text: str) -> None:
        if self._setting:
            return
        try:
            self.put({knob.name: knob.read(text)})
        except LimitsetsError as error:
            self._say(error)


HIDDEN_LABEL = """
label { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); white-space: nowrap; }
"""


def _text(knob: Knob, value: float) -> str:
    return f"{value:.6g} {knob.unit}".rstrip()
