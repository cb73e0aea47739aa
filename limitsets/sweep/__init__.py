"""Answers as functions of parameters."""
