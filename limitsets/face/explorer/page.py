"""The pages of a scene and of a map: sliders, pictures and answers, and their reactions to the visitor.

`beat`, called some sixty times a second, does all the drawing: slider events only mark the page as changed, so that a
hand that is faster than the computation leaves no queue.
"""

from __future__ import annotations

import io
import time
from typing import Any

import numpy as np
import panel as pn

from limitsets.base import LimitsetsError
from limitsets.face.animation.film import Film, Pace
from limitsets.face.animation.legs import require_start
from limitsets.face.animation.thrown_scenes import film_of_throws
from limitsets.face.explorer.answers import (
    KEY,
    Opening,
    careful_line,
    error_line,
    estimate_words,
    points_words,
    proof_words,
)
from limitsets.face.explorer.atlas_page import AtlasPage, Background
from limitsets.face.explorer.canvas import GRID, SLIDER, Hand, Sliders, Words, said
from limitsets.face.explorer.estimates import (
    GOAL_X,
    centre_at,
    estimate,
    estimate_of_map,
    knobs_of,
    knobs_of_map,
    map_with,
    points_of_map,
    scene_with,
)
from limitsets.face.explorer.pictures import ArmPicture, LanesPicture, PartPicture, PointsPicture
from limitsets.face.explorer.work import within_reach
from limitsets.feeder.scene import Model, Scene, dump
from limitsets.systems.cells import Domain

WORDS = 0.25
"""Seconds between two changes of the text."""

WIDE: dict[str, Any] = {"sizing_mode": "stretch_width"}


class Page:
    """What the pages of one visitor have in common: sliders, a line for errors, and texts that change now and then."""

    def __init__(self) -> None:
        self._error = Words(error_line(""), css_classes=["error"])
        self.sliders = Sliders(self._moved, self.say)
        self._dirty = self._refit = self._told = True
        self._wrote = -1.0

    def say(self, error: object = "") -> None:
        """Show one line of what is wrong, or take it away."""
        self._error.object = error_line(error)

    def _moved(self) -> None:
        """Mark the page as changed; `beat` draws it."""
        self._dirty = True

    def _writes(self) -> bool:
        """Whether the texts are to be written now; the fields of the sliders are among them."""
        due = not self._told and time.monotonic() - self._wrote > WORDS
        if due:
            self._told, self._wrote = True, time.monotonic()
            self.sliders.tell()
        return due


def _cell(called: str, *shown: Any) -> pn.Column:
    """Put things into a cell of the page, whose place is in `GRID`."""
    return pn.Column(*shown, css_classes=[called], **WIDE)


# ----------------------------------------------------------------
# The page of a map: its parameters as sliders, and its attractors.


class MapPage(Page):
    """The page of one visitor who looks at a map.

    Parameters
    ----------
    params : NamedTuple
        The map's parameters.
    domain : Domain
        The part of the state space that is shown.
    """

    def __init__(self, params: Any, domain: Domain) -> None:
        super().__init__()
        self._params, self._domain, self._words, self._said = params, domain, "", Words()
        self.sliders.open(knobs_of_map(params))
        self.lanes = LanesPicture() if domain.dimension == 1 else None
        self.points = None if self.lanes else PointsPicture(domain.lo[0].tolist(), domain.hi[0].tolist())
        shown = self.lanes or self.points
        assert shown is not None  # it is one of the two
        self._canvas = shown.canvas
        self.beat()
        title = Words(f"<h1>limitsets: {type(params).__name__}</h1>", css_classes=["title"])
        cells = _cell("sliders", self.sliders.column), _cell("pictures", self._canvas, self._said)
        self.layout = pn.Column(title, self._error, *cells, stylesheets=[GRID], **WIDE)

    def beat(self) -> None:
        """Draw the changes."""
        if self._writes():
            self._said.object = self._words
        if not self._dirty:
            return
        self._dirty = self._told = False
        said(self._redraw, self.say)
        self._canvas.send()

    def _redraw(self) -> None:
        params = map_with(self._params, self.sliders.values)
        if self.points is not None:
            points = points_of_map(params, self._domain)
            self.points.show(points.x)
            self._words = points_words(points)
        if self.lanes is not None:
            answer = estimate_of_map(params, self._domain)
            if self._refit:
                self.lanes.frame(answer, "")
                self._refit = False
            self.lanes.show(answer)
            self._words = estimate_words(answer, None, "")
        self.say()

    def close(self) -> None:
        """Do nothing: a map has no running computations."""


# ----------------------------------------------------------------
# The page of a scene: one visitor's sliders, pictures and answers, and their reactions to the visitor.


RESTS = 0.6
"""Seconds without a move after which a slider counts as at rest."""


THROWS, FPS, SLOW = 6, 20.0, 2.0
COMPILING = "the first proof on a machine also compiles, for a minute or more"
BEING = f"being computed; {COMPILING}"
BUTTON: dict[str, Any] = {"stylesheets": [SLIDER], "margin": (4, 0), **WIDE}


class ScenePage(Page):
    """The page of one visitor who looks at a scene.

    Parameters
    ----------
    scene : Scene
        The scene shown first.
    atlas : dict, optional
        The table of a stored atlas, as `limitsets.face.explorer.work.table_of` gives it.
    """

    def __init__(self, scene: Scene, atlas: dict[str, Any] | None = None) -> None:
        super().__init__()
        self._first = within_reach(scene)
        self._proofs = Background()
        self._lines: list[dict[str, Any]] = []
        self._film: Film | None = None
        self._began, self._holding = 0.0, False
        self.part, self.arm = PartPicture(self._on_part), ArmPicture()
        self.lanes = LanesPicture(self._on_lanes)
        self.opening = Opening(self.open, self._draw, self.say)
        self.atlas = AtlasPage(self._at_point, self.say, atlas)
        self._title = Words(css_classes=["title"])
        self._careful, self._estimated, self._proved = (Words() for _ in range(3))
        beside: dict[str, Any] = {"margin": (4, 10, 4, 0), "stylesheets": [SLIDER]}
        self._x = pn.widgets.FloatInput(label="start x", value=0.0, width=110, **beside)
        self._side = pn.widgets.Select(label="side", options=[0], width=80, **beside)
        self._throw = pn.widgets.Button(label="Throw", color="primary", width=80, align="end", **beside)
        self._toml = pn.widgets.FileDownload(
            callback=lambda: io.StringIO(dump(self.scene)),
            filename="scene.toml",
            label="Save the scene (TOML)",
            **BUTTON,
        )
        self.open(scene)
        self.beat()
        self.layout = self._laid_out()

    # ------------------------------------------------------------ what is shown

    def _laid_out(self) -> pn.viewable.Viewable:
        self._throw.on_click(lambda _: self.throw(self._x.value, self._side.value))
        reset = pn.widgets.Button(label="Back to the first scene", **BUTTON)
        reset.on_click(lambda _: self.open(self._first))
        svg = pn.widgets.FileDownload(
            callback=self._svg, filename="limit-set.svg", label="Save the figure (SVG)", **BUTTON
        )
        cells = (  # texts that grow and shrink do not move what a finger drags: they stand below it
            _cell("sliders", self.sliders.column, pn.Row(self._x, self._side, self._throw)),
            _cell("pictures", self.lanes.canvas, Words(KEY), self.arm.canvas),
            _cell("part", self.part.canvas, self.opening.column, reset, self._toml, svg),
            _cell("proved", self._proved),
            _cell("estimated", self._careful, self._estimated),
            _cell("atlas", self.atlas.column),
        )
        return pn.Column(self._title, self._error, *cells, stylesheets=[GRID], **WIDE)

    @property
    def _of(self) -> str:
        """The model of the page, and the facts of the scene that the model leaves out."""
        return Model.of(self.scene).line()

    # ------------------------------------------------------------ what happens

    def open(self, scene: Scene) -> None:
        """Show another scene."""
        self.base, self.scene = scene, scene
        self.sliders.open(knobs_of(scene))
        self.opening.show(scene)
        self._side.options = list(range(len(scene.sides)))
        self.start: tuple[float, int] | None = None
        self._refit = True
        self._moved()

    def _moved(self) -> None:
        """Mark the page as changed; `beat` draws it."""
        self._dirty, self._asked, self._last, self._film = True, False, time.monotonic(), None

    def beat(self) -> None:
        """Do the next step: draw changes, show the next frame of a film, ask for proofs, show their answers."""
        if self._dirty:
            self._dirty = False
            said(self._redraw, self.say)
        else:
            if not self._asked and time.monotonic() - self._last > RESTS:
                self._ask()
            if self._film is not None:
                number = min(int((time.monotonic() - self._began) * FPS), self._film.frames - 1)
                self._show(self._film, number)
        if self._writes():
            self._careful.object = careful_line(self._found, self.scene)
            self._estimated.object = estimate_words(self._found, self.scene.goal, self.scene.unit, self._of)
        for picture in (self.lanes, self.part, self.arm):
            picture.canvas.send()
        self._tell(self._proofs.answers())
        self.atlas.tell()

    def _redraw(self) -> None:
        scene = scene_with(self.base, self.sliders.knobs, self.sliders.values)
        answer = estimate(scene)
        self.scene = scene
        self.say()
        # the part as it was opened: the axis follows the arm's length, and stays where the centre of mass moves
        size = float(np.hypot(*(self.base.vertices - self.base.centre).T).max())
        self.lanes.frame(answer, scene.unit, size)
        if self._refit:
            # a name of letters, digits, dots and dashes
            self._title.object = f"<h1>limitsets: {scene.name}</h1>"
            self._refit = False
        if not self._startable(scene):
            side, parts = (
                next(iter(answer.sets[0].items())) if answer.sets else (0, [(answer.lo[0], answer.hi[0])])
            )
            self.start = 0.5 * sum(parts[0]), side
            self._x.value, self._side.value = round(self.start[0], 3), side
        assert self.start is not None  # just chosen
        self.part.show(scene)
        self.arm.rest(scene, *self.start, self.lanes.canvas.view["x"])
        self.lanes.mark(*self.start)
        self.lanes.show(answer, scene)
        self._found, self._told = answer, False
        self._proofs.stop()  # also before the first answer: a later answer would be of another scene
        self._lines = []
        self._proved.object = proof_words([], (), "waits until the sliders rest", self._of)

    def _startable(self, scene: Scene) -> bool:
        try:
            return self.start is not None and require_start(scene, self.start) is not None
        except LimitsetsError:
            return False

    def _ask(self) -> None:
        self._asked, self._lines = True, []
        self.opening.show(self.scene)
        self._toml.filename = f"{self.scene.name}.toml"
        quantities = tuple(knob for knob in knobs_of(self.scene) if knob.name != GOAL_X)
        self.atlas.follow(self.scene, quantities)
        self._proved.object = proof_words([], (), BEING, self._of)
        names = [knob.name for knob in quantities]
        self._proofs.ask({"what": "proof", "scene": dump(self.scene), "margins": names})

    def _tell(self, lines: list[dict[str, Any]]) -> None:
        if lines:
            # a step is over once another line is there
            kept = [line for line in self._lines if "step" not in line]
            self._lines = kept + [line for line in lines[:-1] if "step" not in line] + lines[-1:]
            state = "" if "done" in lines[-1] else COMPILING
            self._proved.object = proof_words(self._lines, self.sliders.knobs, state, self._of)

    def throw(self, x: float, side: int) -> None:
        """Show throws from a start."""
        try:
            self.start = require_start(self.scene, (float(x), int(side)))
            clock = "1/w" if self.scene.gravity is None else "s"
            self._film = film_of_throws(self.scene, self.start, THROWS, Pace(FPS, SLOW, clock))
        except (LimitsetsError, TypeError) as error:  # TypeError: an empty field
            self.say(error)
            return
        self.say()
        self._x.value, self._side.value = round(float(x), 3), int(side)
        self._began = time.monotonic()
        self.arm.begin(self._film)

    def _show(self, film: Film, number: int) -> None:
        self.arm.frame(film, number)
        self.lanes.mark(*film.position[number].tolist())
        if number == film.frames - 1:
            self._film = None
            last = film.rests[-1]
            # the part has not left: show the arm close up again
            if film.position[number].tolist() == [last.x, last.side]:
                self.arm.rest(self.scene, last.x, last.side, self.lanes.canvas.view["x"])

    def _on_lanes(self, hand: Hand) -> None:
        if hand.what == "tap":
            self.throw(hand.x, round(-hand.y))

    def _on_part(self, hand: Hand) -> None:
        """Move the centre of mass with a drag that began on its mark; while a part is drawn, a tap adds a corner."""
        if hand.what == "tap":
            self.opening.corner(hand.x, hand.y)
        elif hand.what == "grasp":
            movable = "part.mass.center.along" in self.sliders.values
            self._holding = movable and self.part.is_at_mark(hand.x, hand.y)
        elif hand.what == "release":
            self._holding = False
        elif self._holding:
            self.sliders.put(centre_at(self.scene, hand.x, hand.y))

    def _draw(self, corners: list[tuple[float, float]], drawing: bool) -> None:
        self.part.sketch(corners)
        self.part.show(self.scene)
        if drawing:
            self.part.canvas.heading = "click the corners in turn"

    def _at_point(self, values: dict[str, str]) -> None:
        """Open the feeder at a point of the atlas."""
        said(lambda: self.open(self.base.with_values(values)), self.say)

    def _svg(self) -> io.BytesIO:
        from limitsets.face.plot import limit_set

        answer, written = estimate(self.scene), io.BytesIO()
        limit_set(self.scene, answer.sets).savefig(written, format="svg")
        written.seek(0)
        return written

    def close(self) -> None:
        """End running computations."""
        self._proofs.stop()
        self.atlas.close()
