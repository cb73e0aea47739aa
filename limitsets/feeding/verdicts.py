"""What is proved of feeding, in words and numbers: which sides can be fed, and whether every start is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from limitsets.files import as_table, picked
from limitsets.proofs.goals import State
from limitsets.scene.left_out import WITHOUT_SCATTER

Extents = dict[int, list[tuple[float, float]]]

Answer = TypeVar("Answer", "Safe", "Fed")


@dataclass(frozen=True)
class Safe:
    """What is proved of the sides that are fed.

    Attributes
    ----------
    verdict : str
        Where the scene scatters its throws without bounds, followed by "of the scene without its scatter".
        "proved": no start of 99 % of the arm at least feeds another side, under any noise; "refuted": one does;
        "proved-on-cells": only the starts in `only_wanted` are proved not to; else "undecided".
    possible : dict of int to extents
        By side that may be fed the starts, by the side they lie on, from which it may be: of all others it is proved
        that they do not feed it.
    only_wanted : extents
        Starts that feed no other side than the one wanted, if they feed any.
    share : float
        Their share of the starts on the arm.
    leaving : float
        Share of the starts of which it is not excluded that they leave the arm otherwise.
    counterexample : tuple of State
        A start and its landing beyond the end on another side, proved; empty if none is shown.
    """

    verdict: str
    possible: dict[int, Extents]
    only_wanted: Extents
    share: float
    leaving: float
    counterexample: tuple[State, ...] = ()

    def lines(self, side: int, *, laid: bool = False) -> list[str]:
        """Put it in words, for the side wanted; of the whole arm, or of where parts are laid down."""
        word, words = self.verdict.partition(" ")[0], _words(self.verdict)
        if word == "proved":
            starts = (
                f"no start {'that is laid down' if laid else 'on the arm'}"
                if self.share == 1.0
                else f"none of {100 * self.share:.4f} % of the starts"
            )
            return [f"safety: {words}, {starts} feeds another side than {side}"]
        share = f"{100 * self.share:.2f} % of the starts are proved to feed no other side than {side}"
        if self.counterexample:
            start, landing = self.counterexample[0], self.counterexample[-1]
            shown = f"a throw from x = {start.lo:.6g} on side {start.side} lands on side {landing.side}"
            return [f"safety: {words}, {shown} at x = {landing.lo:.6g}", share]
        return [f"safety: {words}, {share}"]


@dataclass(frozen=True)
class Fed:
    """What is proved of whether starts are fed at all.

    Attributes
    ----------
    verdict : str
        As of `Safe`, of every start and every sequence of the noise: "proved", "proved-on-cells" (of those from
        `beyond` on), "refuted" or "undecided".
    throws : int or None
        Throws after which every start from `beyond` on is fed, at most; None where that is not proved.
    beyond : dict of int to float
        By side the x from which on it is proved; empty where parts are laid down in ranges [length].
    share : float
        Share of the starts on the arm for which it is proved.
    almost_every : str or None
        The verdict for all starts but some of total length zero; None where every start is fed.
    almost_from : str, dict or None
        For which starts that is proved: "almost-every", or those beyond some x, ``{"from": {"0": x}}``.
    almost_share : float
        Their share of the starts on the arm.
    thinning : int
        Rounds within which the other starts are proved to thin out; 0 where that is not asked or not proved.
    never_fed : tuple of State
        A periodic orbit before the end of the arm, proved; empty where none was found.
    cycle : mapping
        The same as a certificate has it; empty where nothing rechecks it.
    reason : str
        What is missing, empty if nothing.
    """

    verdict: str
    throws: int | None
    beyond: dict[int, float]
    share: float
    almost_every: str | None = None
    almost_from: Any = None
    almost_share: float = 0.0
    thinning: int = 0
    never_fed: tuple[State, ...] = ()
    cycle: Mapping[str, Any] = field(default_factory=dict)
    reason: str = ""

    def lines(self, unit: str) -> list[str]:
        """Put it in words."""
        words = _words(self.verdict)
        if self.never_fed:
            told = " -> ".join(f"{state.lo:.5g} ({state.side})" for state in self.never_fed[:4])
            period = len(self.never_fed) - 1
            found = [
                f"progress of every start: {words}, an orbit of period {period} is never fed: {told} -> ..."
            ]
        elif self.throws is None:
            found = [f"progress: {words}, {self.reason}"]
        else:
            whole = "every start on the arm is fed, " if self.share >= 1.0 else ""
            within = f"every start beyond {_places(self.beyond, unit)} within {self.throws} throws"
            if not self.beyond:
                whole, within = "", f"every start that is laid down is fed within {self.throws} throws"
            found = [f"progress: {words}, {whole}{within}"]
        if self.almost_every is not None:
            words = _words(self.almost_every)
            places = (
                f" beyond {_places(self.almost_from['from'], unit)}"
                if isinstance(self.almost_from, dict)
                else ""
            )
            found.append(f"progress of almost every start{places}: {words}")
        return found

    def to_json(self) -> dict[str, Any]:
        """Give it as JSON takes it."""
        names = (
            "verdict",
            "throws",
            "beyond",
            "share",
            "almost_every",
            "almost_from",
            "almost_share",
            "never_fed",
        )
        return as_table(**picked(self, *names), reason=self.reason or None)


def _words(verdict: str) -> str:
    """Write a verdict for people: its word in capitals."""
    word, _, of = verdict.partition(" ")
    return f"{word.upper().replace('-', ' ')} {of}".rstrip()


def without_scatter(found: Answer) -> Answer:
    """Say in the verdicts that they are of the scene without its scatter.

    Examples
    --------
    >>> without_scatter(Safe("proved", {}, {}, 1.0, 0.0)).lines(2)
    ['safety: PROVED of the scene without its scatter, no start on the arm feeds another side than 2']
    """
    said = {name: getattr(found, name, None) for name in ("verdict", "almost_every")}
    changes: dict[str, Any] = {name: f"{word} {WITHOUT_SCATTER}" for name, word in said.items() if word}
    return replace(found, **changes)


def _places(beyond: Mapping[Any, float], unit: str) -> str:
    return ", ".join(f"{x:.4g} {unit} on side {side}" for side, x in beyond.items())
