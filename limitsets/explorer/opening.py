"""Other scenes: drawn by clicking corners, typed, or sent as a file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import panel as pn

from limitsets.errors import LimitsetsError, SceneError
from limitsets.explorer.look import SLIDER
from limitsets.explorer.outside import MOST_BYTES, scene_from, with_outline
from limitsets.scene import Scene, dump

# Corners that are drawn are kept to so many digits: a click is no more exact.
DIGITS = 3


class Opening:
    """What opens another scene.

    Parameters
    ----------
    opened : callable
        Told the scene.
    drawn : callable
        Told the corners so far, and whether more are awaited.
    say : callable
        Told what is wrong.
    """

    def __init__(
        self,
        opened: Callable[[Scene], None],
        drawn: Callable[[list[tuple[float, float]], bool], None],
        say: Callable[[object], None],
    ) -> None:
        self._opened, self._drawn, self._say = opened, drawn, say
        self._scene: Scene | None = None
        look: dict[str, Any] = {"stylesheets": [SLIDER]}
        self._draw = pn.widgets.Toggle(label="Draw a part", sizing_mode="stretch_width", **look)
        self._corners = pn.widgets.TextInput(
            label="corners x,y, clicked or typed",
            placeholder="0,0 6,0 3,4",
            visible=False,
            sizing_mode="stretch_width",
            **look,
        )
        self._text = pn.widgets.TextAreaInput(
            label="the scene as text", height=220, max_length=MOST_BYTES, sizing_mode="stretch_width", **look
        )
        apply = pn.widgets.Button(label="Use this text", **look)
        self._file = pn.widgets.FileInput(accept=".toml", **look)
        self._draw.param.watch(self._toggled, "value")
        self._corners.param.watch(lambda _: self._sketched(), "value")
        apply.on_click(lambda _: self._read(self._text.value_input or self._text.value))
        self._file.param.watch(lambda event: self._sent(event.new), "value")
        card = pn.Card(
            self._text, apply, pn.pane.HTML("<label>or open a TOML file</label>"), self._file,
            title="Scene as text, or from a file", collapsed=True, sizing_mode="stretch_width",
        )  # fmt: skip
        self.column = pn.Column(self._draw, self._corners, card, sizing_mode="stretch_width")

    def show(self, scene: Scene) -> None:
        """Show a scene's text."""
        self._scene = scene
        self._text.value = dump(scene)

    def corner(self, x: float, y: float) -> None:
        """Add a corner where the part's picture was clicked, if one is being drawn."""
        if self._draw.value:
            self._corners.value = f"{self._corners.value} {x:.{DIGITS}g},{y:.{DIGITS}g}".strip()

    def _toggled(self, event: Any) -> None:
        self._corners.visible = event.new
        self._draw.label = "Done: use these corners" if event.new else "Draw a part"
        if event.new:
            self._corners.value = ""
            self._drawn([], True)
            return
        try:
            corners = self._read_corners()
            self._drawn([], False)
            if corners and self._scene is not None:
                self._opened(with_outline(self._scene, corners))
        except LimitsetsError as error:
            self._say(error)
            self._drawn([], False)

    def _sketched(self) -> None:
        try:
            self._drawn(self._read_corners(), True)
        except LimitsetsError as error:
            self._say(error)

    def _read_corners(self) -> list[tuple[float, float]]:
        words, found = self._corners.value.split(), []
        for word in words:
            try:
                x, y = (float(each) for each in word.split(","))
            except ValueError:
                raise SceneError("a corner", word[:40], "x,y, two numbers", "correct it") from None
            found.append((x, y))
        return found

    def _read(self, text: str) -> None:
        try:
            self._opened(scene_from(text))
        except LimitsetsError as error:
            self._say(error)

    def _sent(self, content: bytes | None) -> None:
        if content:
            self._read(content.decode("utf-8", "replace"))
