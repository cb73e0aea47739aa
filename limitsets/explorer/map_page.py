"""The page of a map: its parameters as sliders, and where it leads."""

from __future__ import annotations

import time
from typing import Any

import panel as pn

from limitsets.cells import Domain
from limitsets.errors import LimitsetsError
from limitsets.explorer.answers import error_line, estimate_words, points_words
from limitsets.explorer.canvas import Words
from limitsets.explorer.estimates import estimate_of_map, points_of_map
from limitsets.explorer.knobs import knobs_of_map, map_with
from limitsets.explorer.lanes import LanesPicture, PointsPicture
from limitsets.explorer.look import SAID
from limitsets.explorer.sliders import Sliders

WORDS = 0.25
"""Seconds between two changes of the text."""


class MapPage:
    """What one visitor sees of a map.

    Parameters
    ----------
    params : NamedTuple
        The map's parameters.
    domain : Domain
        Where it is looked at.
    """

    def __init__(self, params: Any, domain: Domain) -> None:
        self._params, self._domain, self._dirty = params, domain, True
        wide: dict[str, Any] = {"sizing_mode": "stretch_width"}
        self._error, self._said = Words(error_line(""), stylesheets=[SAID]), Words(stylesheets=[SAID])
        self.sliders = Sliders(self._moved, self.say)
        self.sliders.open(knobs_of_map(params))
        self.lanes = LanesPicture() if domain.dimension == 1 else None
        self.points = None if self.lanes else PointsPicture(domain.lo[0].tolist(), domain.hi[0].tolist())
        shown = self.lanes or self.points
        assert shown is not None  # it is one of the two
        self._shown = shown
        self._refit, self._told, self._wrote, self._words = True, False, -1.0, ""
        self.beat()
        title = Words(f"<h1>limitsets: {type(params).__name__}</h1>", stylesheets=[SAID])
        controls = pn.Column(self.sliders.column, styles={"flex": "1 1 300px", "min-width": "0"}, **wide)
        pictures = pn.Column(
            self._shown.canvas,
            self._said,
            styles={"flex": "3 1 330px", "min-width": "0"},
            **wide,
        )
        self.layout = pn.Column(title, self._error, pn.FlexBox(controls, pictures, **wide), **wide)

    def say(self, error: object = "") -> None:
        """Show one line of what is wrong, or take it away."""
        self._error.object = error_line(error)

    def _moved(self) -> None:
        self._dirty = True

    def beat(self) -> None:
        """Draw what has changed."""
        if not self._told and time.monotonic() - self._wrote > WORDS:
            self._told, self._wrote = True, time.monotonic()
            self.sliders.tell()
            self._said.object = self._words
        if not self._dirty:
            return
        self._dirty, self._told = False, False
        try:
            params = map_with(self._params, self.sliders.values)
            if self.lanes is None:
                assert self.points is not None  # it is one of the two
                points = points_of_map(params, self._domain)
                self.points.show(points.x)
                self._words = points_words(points)
            else:
                found = estimate_of_map(params, self._domain)
                if self._refit:
                    self.lanes.frame(found, "")
                    self._refit = False
                self.lanes.show(found)
                self._words = estimate_words(found, None, "")
        except LimitsetsError as error:
            self.say(error)
        else:
            self.say()
        self._shown.canvas.send()

    def close(self) -> None:
        """Nothing is being computed."""
