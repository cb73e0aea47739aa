"""Continuation: attractors followed along a curve in parameter space, and what happens to them on the way."""

from limitsets.sweep.continuation.following import continuation
from limitsets.sweep.continuation.result import Collision, Continuation, Event, State

__all__ = ["Collision", "Continuation", "Event", "State", "continuation"]
