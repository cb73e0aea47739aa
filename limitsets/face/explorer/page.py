"""The pages of a scene and of a map: sliders, pictures and answers, and their reactions to the visitor.

`beat`, called some sixty times a second, does all the drawing: slider events only mark the page as changed, so that a
hand that is faster than the computation leaves no queue.
"""

from __future__ import annotations

import io
import time
from typing import Any

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
from limitsets.face.explorer.canvas import SLIDER, Hand, Sliders, Words, said
from limitsets.face.explorer.estimates import (
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
        self._error = Words(error_line(""))
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


def _part(room: str, *shown: Any) -> pn.Column:
    """Put things into a column that takes so much room (flex of CSS)."""
    return pn.Column(*shown, styles={"flex": room, "min-width": "0"}, **WIDE)


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
        title = Words(f"<h1>limitsets: {type(params).__name__}</h1>")
        columns = _part("1 1 300px", self.sliders.column), _part("3 1 330px", self._canvas, self._said)
        self.layout = pn.Column(title, self._error, pn.FlexBox(*columns, **WIDE), **WIDE)

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
BEING = "being computed; the first proof on a machine also compiles, for a minute or more"
MARGINS = "margins are being computed"
SAVE: dict[str, Any] = {"stylesheets": [SLIDER], **WIDE}


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
        self._title, self._careful, self._estimated, self._proved = (Words() for _ in range(4))
        self._x = pn.widgets.FloatInput(label="start x", value=0.0, width=110, stylesheets=[SLIDER])
        self._side = pn.widgets.Select(label="side", options=[0], width=80, stylesheets=[SLIDER])
        self._toml = pn.widgets.FileDownload(
            callback=lambda: io.StringIO(dump(self.scene)),
            filename="scene.toml",
            label="Save the scene (TOML)",
            **SAVE,
        )
        self.open(scene)
        self.beat()
        self.layout = self._laid_out()

    # ------------------------------------------------------------ what is shown

    def _laid_out(self) -> pn.viewable.Viewable:
        throw = pn.widgets.Button(label="Throw", color="primary", width=80, align="end", stylesheets=[SLIDER])
        throw.on_click(lambda _: self.throw(self._x.value, self._side.value))
        reset = pn.widgets.Button(label="Back to the first scene", stylesheets=[SLIDER])
        reset.on_click(lambda _: self.open(self._first))
        svg = pn.widgets.FileDownload(
            callback=self._svg, filename="limit-set.svg", label="Save the figure (SVG)", **SAVE
        )
        start = pn.Row(self._x, self._side, throw)
        rows = (
            (
                _part("1 1 300px", self.sliders.column, start),
                _part("2 1 340px", self.lanes.canvas, Words(KEY)),
            ),
            (
                _part("2 1 330px", self.arm.canvas),
                _part("1 1 220px", self.part.canvas),
                _part("1 1 300px", reset, self._toml, svg, self.opening.column),
            ),
            (  # a line that appears or disappears does not shift the controls under the visitor's hand
                _part("1 1 330px", self._careful, self._estimated),
                _part("1 1 330px", self._proved),
            ),
        )
        boxes = (pn.FlexBox(*row, gap="0 18px", **WIDE) for row in rows)
        return pn.Column(self._title, self._error, *boxes, self.atlas.column, **WIDE)

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
        if self._refit:
            self.lanes.frame(answer, scene.unit)
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
        self.arm.rest(scene, *self.start)
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
        self.atlas.follow(self.scene, knobs_of(self.scene))
        self._proved.object = proof_words([], (), BEING, self._of)
        names = [knob.name for knob in self.sliders.knobs]
        self._proofs.ask({"what": "proof", "scene": dump(self.scene), "margins": names})

    def _tell(self, lines: list[dict[str, Any]]) -> None:
        if lines:
            self._lines += lines
            claimed = any("claim" in line for line in self._lines)
            state = "" if "done" in self._lines[-1] else MARGINS if claimed else BEING
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
                self.arm.rest(self.scene, last.x, last.side)

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
