"""`python -m tests.equivalence record FILE` before a change, `... compare FILE` after it: what differs, by name.

Digests of bounds, floats, certificates, reports and verdicts.  What runs is asked by its public name where it has one,
so that the net outlives moves within the package.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from rich.progress import track

from tests.equivalence.digests import SECTIONS


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.equivalence", description=__doc__)
    parser.add_argument("what", choices=("record", "compare"))
    parser.add_argument("file", type=Path)
    parser.add_argument(
        "--only", nargs="*", choices=SECTIONS, default=list(SECTIONS), help="sections; default all"
    )
    given = parser.parse_args()
    found: dict[str, str] = {}
    for name in track(given.only, description="sections"):
        found |= {f"{name}: {key}": value for key, value in SECTIONS[name]()}
    if given.what == "record":
        known = json.loads(given.file.read_text()) if given.file.exists() else {}
        given.file.write_text(json.dumps(known | found, indent=0, sort_keys=True))
        print(f"{len(found)} digests recorded")
        return 0
    known = json.loads(given.file.read_text())
    asked = {key: value for key, value in known.items() if key.split(":")[0] in given.only}
    changed = sorted(key for key in asked.keys() | found.keys() if asked.get(key) != found.get(key))
    for key in changed:
        print(f"{key}\n    before {asked.get(key, 'nothing')}\n    now    {found.get(key, 'nothing')}")
    print(f"{len(asked.keys() | found.keys()) - len(changed)} equal, {len(changed)} differ")
    return 1 if changed else 0


if __name__ == "__main__":
    raise SystemExit(main())
