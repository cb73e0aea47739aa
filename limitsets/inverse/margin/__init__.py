"""Scenes with a large margin: a search by floats, whose result `limitsets.robust` proves."""
