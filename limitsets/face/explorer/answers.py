"""The texts of the page as HTML, with text from outside escaped, and the ways to type or draw another scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from itertools import chain
from typing import Any

import panel as pn

from limitsets.base import SceneError
from limitsets.face.explorer.canvas import SLIDER, said, swatch
from limitsets.face.explorer.estimates import CELLS, Estimate, Knob, Points
from limitsets.face.explorer.pictures import look_of
from limitsets.face.explorer.work import MOST_BYTES, scene_from, with_outline
from limitsets.face.plot.style import interval_text
from limitsets.face.report.pages import goal_sentence, starts_words, verdict_words
from limitsets.feeder.goals import Goal
from limitsets.feeder.scene import Scene, dump
from limitsets.parameters.analysis import in_limit_sets, other_vertex_first
from limitsets.systems.maps import codes

KEY = (
    '<p class="how">Bars: limit sets. Strips: where starts lead, hatched unless to limit set 0. Strokes r: critical '
    "points. Dotted: the goal. Triangle: the part; click to throw it.</p>"
)

LISTED = 12
"""Largest number of points of a cycle that are listed one by one."""

VERDICTS = {
    "proved": "&#10003; <b>proved</b>",
    "proved-on-cells": "&#9680; <b>proved</b>",
    "refuted": "&#10007; <b>not proved: an orbit refutes it</b>",
    "undecided": "&#10007; <b>not proved</b>",
}


def error_line(error: object) -> str:
    """Give the error in one line that a screen reader speaks at once."""
    return f'<p role="alert" class="wrong">{escape(str(error))}</p>' if error else '<p role="alert"></p>'


def careful_line(estimate: Estimate, scene: Scene) -> str:
    """Say from how many starts a throw is outside the model, and for which throws of a limit set the model is wrong."""
    lines = []
    share = dict(estimate.shares).get(codes.OUTSIDE_MODEL, 0.0)
    if share:
        lines.append(
            f"from {100 * share:.3g} % of the starts the part comes to a throw that is outside the model: it has not "
            "landed within a full turn"
        )
    broken = ", ".join(map(str, in_limit_sets(other_vertex_first(scene), estimate.sets)))
    if broken:
        lines.append(
            f"of some throws of the limit set from side {broken} another vertex lands first, and the model does not "
            "describe them"
        )
    return "".join(f'<p class="wrong">careful: {line}</p>' for line in lines)


def estimate_words(estimate: Estimate, goal: Goal | None, unit: str, of: str = "") -> str:
    """Put the estimate into words; `of` names its model."""
    rows = []
    for k, (extents, bands, order) in enumerate(
        zip(estimate.sets, estimate.bands, estimate.orders, strict=True)
    ):
        drawn = sum(map(len, extents.values()))
        is_cycle = all(lo == hi for parts in extents.values() for lo, hi in parts)
        if is_cycle and drawn > LISTED:
            places = f"from {min(chain(*extents.values()))[0]:.6g} to {max(chain(*extents.values()))[0]:.6g}"
        else:
            places = "; ".join(f"side {side}: {_places(parts)}" for side, parts in sorted(extents.items()))
        visits = "; the order of sides changes" if order is None else f"; sides {'-'.join(map(str, order))}"
        visits = visits if len(estimate.lo) > 1 else ""
        kind = f"; a cycle of period {drawn}" if is_cycle else ""
        joined = f"; {bands} intervals, which these cells join" if bands > drawn else ""
        rows.append((f"limit set {k}", f"{places} {unit}".rstrip() + f"{visits}{kind}{joined}"))
    if not estimate.sets:
        rows.append(("limit set", "none: no start was found to stay"))
    looks = [(*look_of(label), share) for label, share in estimate.shares]
    shares = "; ".join(
        f"{swatch(face, hatch)}{words} {100 * share:.3g} %" for face, hatch, words, share in looks
    )
    rows.append(("starts", shares))
    points = ", ".join(f"r{side}{chr(39) * number} = {x:.4f}" for side, number, x in estimate.critical)
    if points:
        rows.append(("critical points", f"{points} {unit}"))
    if goal is not None:
        rows.append((f"goal: {escape(goal_sentence(goal, unit))}", _goal_words(estimate, goal, unit)))
    how = f"from {CELLS} cells a side" + (
        ", ends from the compiled loop of the atlas" if estimate.sharp else ""
    )
    return _table("Estimated (follows the sliders, proves nothing)", rows, "; ".join(filter(None, (how, of))))


def _places(parts: Sequence[tuple[float, float]]) -> str:
    """Write points, or intervals."""
    if all(lo == hi for lo, hi in parts):
        return ", ".join(f"{x:.6g}" for x, _ in parts)
    return escape(interval_text(parts)).replace("\n", ", ")


def points_words(points: Points) -> str:
    """Say how many orbits of a map of two or three dimensions stay, and where the others go."""
    stay = points.starts - sum(points.gone.values())
    rows = [("stay", f"{stay} of {points.starts} orbits")]
    rows += [("leave", f"{count} of {points.starts} orbits {where}") for where, count in points.gone.items()]
    return _table("Estimated (follows the sliders, proves nothing)", rows, "from a few starts")


def _goal_words(estimate: Estimate, goal: Goal, unit: str) -> str:
    share = sum(share for label, share in estimate.shares if label >= 0)
    words = verdict_words(goal, estimate.holds, share, len(estimate.sets), vacuous=estimate.vacuous)
    return words + ("" if estimate.threshold is None else f"; threshold x = {estimate.threshold:.4f} {unit}")


def proof_words(lines: Sequence[Mapping[str, Any]], knobs: Sequence[Knob], state: str, of: str = "") -> str:
    """Put the proofs into words, and how far the next one is; `of` names their model."""
    names = {knob.name: knob.words for knob in knobs}
    rows = []
    for line in lines:
        if "claim" in line:
            reason = f" ({escape(str(line['reason']))})" if line.get("reason") else ""
            verdict = str(line["verdict"])
            written = verdict.startswith("proved") and line.get("starts")
            whose = f", {escape(starts_words(line['starts'], line['share']))}" if written else ""
            left = "" if verdict == "proved" else reason
            note = f"; {escape(str(line['note']))}" if line.get("note") else ""
            rows.append((escape(str(line["claim"])), f"{VERDICTS[verdict]}{whose}{left}{note}"))
        elif "margin" in line and "proved" in line:
            limit = "" if line["refuted"] is None else f"; refuted at {escape(str(line['refuted']))}"
            rows.append(
                (
                    f"margin of {names.get(str(line['margin']), '')}",
                    f"proved up to &plusmn; {escape(str(line['proved']))}{limit}",
                )
            )
        elif "error" in line and "margin" not in line:
            rows.append(("no answer", escape(str(line["error"]))))
        elif "step" in line:
            rows.append(progress_row(line, names))
    return _table("Proved (once the sliders rest)", rows, "; ".join(filter(None, (state, of))))


def progress_row(line: Mapping[str, Any], names: Mapping[str, str]) -> tuple[str, str]:
    """Say what the background is computing, and how far it is; names of quantities become words.

    Examples
    --------
    >>> progress_row({"step": "margin of throw.speed, 40 %", "number": 2, "of": 6}, {"throw.speed": "speed"})[1]
    '<progress value="1" max="6"></progress> margin of speed, 40 % (2 of 6)'
    """
    step, number, of = escape(str(line["step"])), line["number"], line["of"]
    for name, words in names.items():
        step = step.replace(f" {name},", f" {words},")
    bar = f'<progress value="{number - 1}" max="{of}"></progress>'
    return "being computed", f"{bar} {step} ({number} of {of})"


def _table(title: str, rows: Sequence[tuple[str, str]], foot: str) -> str:
    body = "".join(f'<tr><th scope="row">{head}</th><td>{words}</td></tr>' for head, words in rows)
    return (
        f'<h2>{title}</h2><table class="said">{body}</table><p class="how" role="status">{escape(foot)}</p>'
    )


# ----------------------------------------------------------------
# Other scenes: drawn by clicking corners, typed, or sent as a file.


# Digits of drawn corners: a click is not more exact.
DIGITS = 3


class Opening:
    """The controls that open another scene.

    Parameters
    ----------
    opened : callable
        Called with the scene.
    drawn : callable
        Called with the corners so far, and whether more are expected.
    say : callable
        Called with the error.
    """

    def __init__(
        self,
        opened: Callable[[Scene], None],
        drawn: Callable[[list[tuple[float, float]], bool], None],
        say: Callable[[object], None],
    ) -> None:
        self._opened, self._drawn, self._say = opened, drawn, say
        self._scene: Scene | None = None
        look: dict[str, Any] = {"stylesheets": [SLIDER], "margin": (4, 0)}
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
        """Add a corner at the place of a click on the part's picture, while a part is being drawn."""
        if self._draw.value:
            self._corners.value = f"{self._corners.value} {x:.{DIGITS}g},{y:.{DIGITS}g}".strip()

    def _toggled(self, event: Any) -> None:
        self._corners.visible = event.new
        self._draw.label = "Done: use these corners" if event.new else "Draw a part"
        if event.new:
            self._corners.value = ""
        else:
            said(self._finished, self._say)
        self._drawn([], event.new)

    def _finished(self) -> None:
        corners = self._read_corners()
        if corners and self._scene is not None:
            self._opened(with_outline(self._scene, corners))

    def _sketched(self) -> None:
        said(lambda: self._drawn(self._read_corners(), True), self._say)

    def _read_corners(self) -> list[tuple[float, float]]:
        words, corners = self._corners.value.split(), []
        for word in words:
            try:
                x, y = (float(each) for each in word.split(","))
            except ValueError:
                raise SceneError("a corner", word[:40], "x,y, two numbers", "correct it") from None
            corners.append((x, y))
        return corners

    def _read(self, text: str) -> None:
        said(lambda: self._opened(scene_from(text)), self._say)

    def _sent(self, content: bytes | None) -> None:
        if content:
            self._read(content.decode("utf-8", "replace"))
