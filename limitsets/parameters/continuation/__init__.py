"""Continuation: attractors followed along a curve in parameter space, and what happens to them on the way."""

from limitsets.parameters.continuation.following import continuation
from limitsets.parameters.continuation.snapshot import Collision, Continuation, Event, State

__all__ = ["Collision", "Continuation", "Event", "State", "continuation"]
