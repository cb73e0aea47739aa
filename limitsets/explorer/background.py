"""Questions that take seconds, asked of a process of its own which is ended when nobody wants the answer any more."""

from __future__ import annotations

import atexit
import json
import queue
import subprocess
import sys
import threading
import weakref
from typing import Any

RUNNING = threading.BoundedSemaphore(2)
"""Processes of all visitors together; others wait in line."""

LONGEST = 600.0
"""Seconds after which an answer is given up."""


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
    >>> [line.get("verdict") for line in asked.wait()]
    ['proved', 'proved', None]
    """

    def __init__(self) -> None:
        self._lines: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._wanted = threading.Event()
        self._process: subprocess.Popen[str] | None = None
        self._thread: threading.Thread | None = None
        _ALL.add(self)

    def ask(self, question: dict[str, Any]) -> None:
        """Drop what is being answered and ask this; the answers end with ``{"done": True}``."""
        self.stop()
        self._lines, self._wanted = queue.SimpleQueue(), threading.Event()
        about = question, self._lines, self._wanted
        self._thread = threading.Thread(target=self._run, args=about, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the process; what it said is forgotten."""
        self._wanted.set()
        self._lines = queue.SimpleQueue()
        if self._process is not None:
            self._process.kill()

    def answers(self) -> list[dict[str, Any]]:
        """Take what has been answered since the last call, without waiting."""
        found = []
        while not self._lines.empty():
            found.append(self._lines.get())
        return found

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
            command = [sys.executable, "-m", "limitsets.explorer.work"]
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
            )
            self._process = process
            if dropped.is_set():  # between the two: nobody else would end it
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
