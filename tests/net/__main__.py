"""``python -m tests.net record FOLDER`` before a move, ``python -m tests.net compare FOLDER`` after it."""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from tests.net.answering import all_answers
from tests.net.comparing import differences, keep, kept

MOST_SHOWN = 5

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Record the public answers, or compare them with a record.")
    parser.add_argument("what", choices=("record", "compare"))
    parser.add_argument("folder", type=Path)
    words = parser.parse_args()
    words.folder.mkdir(parents=True, exist_ok=True)
    before = kept(words.folder) if words.what == "compare" else {}
    wrong, begin = 0, time.perf_counter()
    with tempfile.TemporaryDirectory() as scratch:
        for number, (name, answer) in enumerate(all_answers(Path(scratch))):
            with tempfile.TemporaryDirectory() as own:
                keep(Path(own), 0, name, answer)
                answer = kept(Path(own))[name]  # as JSON gives it back
            if words.what == "record":
                keep(words.folder, number, name, answer)
                print(f"{time.perf_counter() - begin:6.0f} s  {name}", flush=True)
                continue
            other = list(differences(before.pop(name, None), answer))
            wrong += bool(other)
            for line in other[:MOST_SHOWN]:
                print(f"{name}{line}", flush=True)
    for name in before:
        print(f"{name}: not asked any more")
    if words.what == "compare":
        print(f"{wrong + len(before)} answers differ, {time.perf_counter() - begin:.0f} s")
    sys.exit(wrong + len(before) > 0)
