"""``python -m tests.doors``: all twenty scenes, a line of each and where doors disagree; minutes."""

import sys
import tempfile
from pathlib import Path

from tests.doors.asking import asked, disagreements
from tests.doors.scenes import scenes

if __name__ == "__main__":
    bad = 0
    for name, (scene, quantity) in scenes().items():
        if sys.argv[1:] and name not in sys.argv[1:]:
            continue
        with tempfile.TemporaryDirectory() as folder:
            found = asked(scene, quantity, Path(folder))
        wrong = disagreements(found)
        bad += bool(wrong)
        print(
            f"{name}: {quantity}: {found['Python']}", "; ".join(wrong) or "the same", sep="\n    ", flush=True
        )
    print(f"{bad} scenes with doors that disagree")
    sys.exit(bad > 0)
