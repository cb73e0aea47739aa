"""A small atlas beside the scene, computed in a separate process, or stored; a click opens one of its feeders."""

from __future__ import annotations

import atexit
import json
import queue
import subprocess
import sys
import threading
import weakref
from collections.abc import Callable, Mapping
from html import escape
from typing import Any

import numpy as np
import panel as pn

from limitsets.face.explorer.canvas import SLIDER, Canvas, Hand, Layer, Words, swatch
from limitsets.face.explorer.estimates import Knob
from limitsets.face.explorer.pictures import BARS, NUMBERS, WHITE, pattern
from limitsets.face.plot import style
from limitsets.face.plot.atlas_maps import edges, widest
from limitsets.feeder.scene import Scene, dump
from limitsets.feeder.scene.units import written

# ----------------------------------------------------------------
# Questions that take seconds are answered by a separate process, which is ended when the answer is not needed
# any more.


RUNNING = threading.BoundedSemaphore(2)
"""Largest number of processes for all visitors together; further questions wait in line."""

LONGEST = 600.0
"""Seconds after which a question is given up."""


_ALL: weakref.WeakSet[Background] = weakref.WeakSet()


@atexit.register
def _stop_all() -> None:
    """Leave no process behind when the server ends."""
    for each in list(_ALL):
        each.stop()


class Background:
    """One question at a time, of one visitor.

    Examples
    --------
    >>> import limitsets as ls
    >>> asked = Background()
    >>> asked.ask({"what": "proof", "scene": ls.dump(ls.load("paper-designed")), "margins": []})
    >>> [line["verdict"] for line in asked.wait() if "verdict" in line]
    ['proved', 'proved']
    """

    def __init__(self) -> None:
        self._lines: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._wanted = threading.Event()
        self._process: subprocess.Popen[str] | None = None
        self._thread: threading.Thread | None = None
        _ALL.add(self)

    def ask(self, question: dict[str, Any]) -> None:
        """Drop the present question and ask this one; the answers end with ``{"done": True}``."""
        self.stop()
        self._lines, self._wanted = queue.SimpleQueue(), threading.Event()
        about = question, self._lines, self._wanted
        self._thread = threading.Thread(target=self._run, args=about, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the process, and forget its answers."""
        self._wanted.set()
        self._lines = queue.SimpleQueue()
        if self._process is not None:
            self._process.kill()

    def answers(self) -> list[dict[str, Any]]:
        """Take the answers since the last call, without waiting."""
        lines = []
        while not self._lines.empty():
            lines.append(self._lines.get())
        return lines

    def wait(self) -> list[dict[str, Any]]:
        """Wait for all answers."""
        if self._thread is not None:
            self._thread.join()
        return self.answers()

    def _run(
        self, question: dict[str, Any], lines: queue.SimpleQueue[dict[str, Any]], dropped: threading.Event
    ) -> None:
        with RUNNING:
            if dropped.is_set():
                return
            command = [sys.executable, "-m", "limitsets.face.explorer.work"]
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
            )
            self._process = process
            if dropped.is_set():  # `stop` came between the two lines: nothing else would end this process
                process.kill()
            late = threading.Timer(LONGEST, process.kill)
            late.start()
            try:
                _answered(process, question, lines)
            finally:
                late.cancel()
                process.kill()
                process.wait()
        lines.put({"done": True})


def _answered(
    process: subprocess.Popen[str], question: dict[str, Any], lines: queue.SimpleQueue[dict[str, Any]]
) -> None:
    assert process.stdin is not None  # they are pipes
    assert process.stdout is not None
    assert process.stderr is not None
    with process.stdin, process.stdout, process.stderr:
        try:
            json.dump(question, process.stdin)
            process.stdin.close()
            for line in process.stdout:
                lines.put(json.loads(line))
        except (BrokenPipeError, ValueError):  # ended from outside, in the middle of a line
            return
        if process.wait() != 0:
            lines.put({"error": "no answer: it took too long, or was given up"})


# ----------------------------------------------------------------
# A small atlas beside the scene: computed when it is asked for, or one that was stored; a click opens its feeder.


POINTS = 33
"""Points along each axis of an atlas that is computed for the page."""


class AtlasPage:
    """The atlas of one visitor.

    Parameters
    ----------
    opened : callable
        Called with the quantities at the clicked point, with their units.
    say : callable
        Called with the error.
    table : dict, optional
        A stored atlas, as `limitsets.face.explorer.work.table_of` gives it.
    """

    def __init__(
        self,
        opened: Callable[[dict[str, str]], None],
        say: Callable[[object], None],
        table: dict[str, Any] | None,
    ) -> None:
        self._opened, self._say, self._asked = opened, say, Background()
        self._table: dict[str, Any] | None = None
        self._scene: Scene | None = None
        self._knobs: dict[str, Knob] = {}
        look: dict[str, Any] = {"stylesheets": [SLIDER]}
        self._x = pn.widgets.Select(label="across", width=190, **look)
        self._y = pn.widgets.Select(label="up", width=190, **look)
        self._go = pn.widgets.Button(label=f"Compute {POINTS} x {POINTS} points", align="end", **look)
        self._go.on_click(lambda _: self._compute())
        self._words = Words()
        chosen = WHITE | {"fill": "#ffffff00", "line": style.FLIP}
        layers = [
            Layer("bars", "classes", (*BARS, "words")),
            Layer("words", "numbers", size=12, plate=True, **NUMBERS),
            Layer("marks", "here", shape="cross", size=16, **WHITE),
            Layer("marks", "chosen", shape="square", size=16, **chosen),
        ]
        view = {"margins": MARGINS, "across": " ", "up": "", "keys": True}
        self._canvas = Canvas("atlas", layers, 400, self._touched, stylesheets=[SLIDER], **view)
        self._canvas.visible = False
        self.column = pn.Card(
            pn.FlexBox(self._x, self._y, self._go), self._canvas, self._words,
            title="Atlas: where the topology changes; click a point to open that feeder",
            collapsed=table is None, sizing_mode="stretch_width",
        )  # fmt: skip
        if table is not None:
            self._show(table)

    def follow(self, scene: Scene, knobs: tuple[Knob, ...]) -> None:
        """Take note of the scene that is shown."""
        self._scene, self._knobs = scene, {knob.name: knob for knob in knobs}
        names = {knob.title: knob.name for knob in knobs}
        if self._x.options != names:
            self._x.options, self._y.options = names, names
            chosen = [name for name in ("throw.speed", "throw.kappa") if name in names.values()]
            self._x.value, self._y.value = chosen[0], "arm.surface_height"
        self._mark()

    def _compute(self) -> None:
        if self._scene is None or self._x.value == self._y.value:
            self._say(
                "the two quantities of the atlas are the same; allowed: two different ones; choose another"
            )
            return
        self._say("")
        x, y = (
            f"{knob.name}={written(knob.lo, knob.unit)}:{written(knob.hi, knob.unit)}:{POINTS}"
            for knob in (self._knobs[self._x.value], self._knobs[self._y.value])
        )
        self._words.object = '<p role="status">the atlas is being computed</p>'
        self._asked.ask({"what": "atlas", "scene": dump(self._scene), "x": x, "y": y})

    def tell(self) -> None:
        """Show the answers."""
        for line in self._asked.answers():
            if "error" in line:
                self._words.object = ""
                self._say(line["error"])
            elif "axes" in line:
                self._show(line)

    def _show(self, table: dict[str, Any]) -> None:
        self._table = table
        (x, y), numbers = table["axes"], np.array(table["numbers"])
        across, up = (edges(np.array(axis["values"])).tolist() for axis in (x, y))
        looks = {each["number"]: each for each in table["classes"]}
        boxes = [
            (across[j], across[j + 1], up[i], up[i + 1], *_look(looks[number]), looks[number]["words"])
            for (i, j), number in np.ndenumerate(numbers)
            if number in looks
        ]
        self._canvas.put("classes", boxes)
        marks = [(k + 1, numbers == each["number"]) for k, each in enumerate(table["classes"])]
        places = [(k, *widest(where)[0]) for k, where in marks if where.any()]
        self._canvas.put("numbers", [(x["values"][j], y["values"][i], str(k)) for k, i, j in places])
        self._canvas.view |= {
            "x": [across[0], across[-1]],
            "y": [up[0], up[-1]],
            "across": f"{x['name']} [{x['unit']}]",
            "up": f"{y['name']} [{y['unit']}]",
        }
        self._canvas.heading = "atlas: arrow keys choose a point, Enter opens it"
        self._canvas.visible = True
        rows = "".join(
            f"<tr><td>{swatch(*_look(each))}{k + 1}</td>"
            f"<td>{escape(each['words'])}</td><td>{100 * each['share']:.3g} %</td></tr>"
            for k, each in enumerate(table["classes"][:12])
        )
        self._words.object = f'<table class="said">{rows}</table><p class="how">estimated, not proved</p>'
        self._canvas.put("chosen", ())
        self._mark()
        self._canvas.send()

    def _mark(self) -> None:
        """Mark the place of the page's scene, if it lies in the atlas."""
        if self._table is None or self._scene is None:
            return
        knobs = [self._knobs.get(axis["name"]) for axis in self._table["axes"]]
        units = [axis["unit"] for axis in self._table["axes"]]
        if all(knob and knob.unit == unit for knob, unit in zip(knobs, units, strict=True)):
            self._canvas.put("here", [[knob.value for knob in knobs if knob]])
        self._canvas.send()

    def _touched(self, hand: Hand) -> None:
        """Open the tapped point; arrow keys move from point to point instead."""
        if self._table is None:
            return
        axes = [np.array(axis["values"]) for axis in self._table["axes"]]
        marked = [self._canvas.layer(called).data for called in ("chosen", "here")]
        at = [places[axis][0] for places in marked if places["x"] for axis in "xy"]
        if hand.what == "tap":
            at = [hand.x, hand.y]
        elif not at:  # the scene on the page is not in this atlas
            at = [float(values.mean()) for values in axes]
        numbers = [int(np.abs(values - each).argmin()) for values, each in zip(axes, at, strict=False)]
        if hand.what == "step":
            numbers = [
                min(max(number + int(by), 0), values.size - 1)
                for number, by, values in zip(numbers, (hand.x, hand.y), axes, strict=True)
            ]
        x, y = (float(values[number]) for values, number in zip(axes, numbers, strict=True))
        if hand.what == "step":
            self._canvas.put("chosen", [(x, y)])
            self._canvas.send()
        elif hand.what in ("tap", "enter"):
            self._canvas.put("chosen", ())
            places = zip(self._table["axes"], (x, y), strict=True)
            self._opened({axis["name"]: written(value, axis["unit"]) for axis, value in places})

    def close(self) -> None:
        """End the computation, if one is running."""
        self._asked.stop()


MARGINS = (64, 12, 40, 38)


def _look(kind: Mapping[str, Any]) -> tuple[str, str]:
    """Give face and hatch of a class, as the web writes them."""
    face = kind["facecolor"]
    if not isinstance(face, str):
        face = "#" + "".join(f"{round(255 * share):02x}" for share in face)
    return face, pattern(kind["hatch"])
