"""Stores as bytes, the one that nothing interrupted, and executors of other kinds."""

import random
import threading
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path

from limitsets.parameters.atlas import atlas
from tests.sweep.tasks_of_tests import TASK, X, Y


def run(store, **options):
    """Compute the atlas of these tests, by threads where nothing else is said."""
    given = {"task": TASK, "chunk": (3, 3), "store": store, **options}
    if options.keys() & {"workers", "executor", "cluster"}:
        return atlas("paper-designed", X, Y, **given)
    with ThreadPoolExecutor(2) as pool:
        return atlas("paper-designed", X, Y, executor=pool, **given)


def bytes_of(store):
    """Every file of a store."""
    root = Path(store)
    return {str(file.relative_to(root)): file.read_bytes() for file in root.rglob("*") if file.is_file()}


def flags_of(variable):
    """The codes of a variable by their names."""
    return dict(zip(variable.attrs["flag_meanings"].split(), variable.attrs["flag_values"], strict=True))


class Shuffled(Executor):
    """Runs what it is given in random order."""

    def __init__(self, seed):
        self.rng, self.waiting, self.lock = random.Random(seed), [], threading.Lock()

    def submit(self, function, /, *arguments):
        future = Future()
        with self.lock:
            self.waiting.append((future, function, arguments))
        threading.Timer(0.001, self._one).start()
        return future

    def _one(self):
        with self.lock:
            future, function, arguments = self.waiting.pop(self.rng.randrange(len(self.waiting)))
            future.set_result(function(*arguments))
