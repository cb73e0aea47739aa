"""`python -m tests.topology N --seed S --log FILE`: N points of a scene's window against the reference; resumes."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

import limitsets as ls
from limitsets.systems.maps.pieces import point_of
from limitsets.systems.sets.topology import DOUBTS
from tests.topology.compare import class_of, differences
from tests.topology.reference import STARTS, reference
from tests.topology.window import HEIGHT, SPEED, points_of

CELLS = (40_000, 160_000)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.topology", description=__doc__)
    parser.add_argument("points", type=int)
    parser.add_argument("--scene", default="paper-designed")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--log", type=Path, default=Path("topology.jsonl"))
    given = parser.parse_args()
    points = points_of(ls.load(given.scene), given.points, given.seed)
    found, stack = points.found, points.stack
    lines = given.log.read_text().splitlines() if given.log.exists() else []
    rows: dict[int, Any] = {row["point"]: row for row in map(json.loads, lines)}
    # a shuffled order: what is done when it is stopped is a sample of all
    order = np.random.default_rng(given.seed).permutation(given.points).tolist()
    with given.log.open("a") as log:
        for i in track([k for k in order if k not in rows], description="points"):
            at = points.places[i]
            row: dict[str, Any] = {
                "point": i,
                "speed": SPEED[0] + (SPEED[1] - SPEED[0]) * at[0],
                "height": HEIGHT[0] + (HEIGHT[1] - HEIGHT[0]) * at[1],
                "boundary": bool(points.at_boundary[i]),
                "undecided": DOUBTS[int(found.undecided[i])] if found.undecided[i] else "",
                "class": class_of(found, i),
            }
            if not row["undecided"]:
                params, lo, hi = point_of(stack.params, i), stack.lo[i], stack.hi[i]
                # both numbers of cells have to disagree: what only the coarser says is the cells' own error
                for cells in CELLS:
                    r = reference(params, lo, hi, cells=cells, seed=i)
                    row["differs"] = differences(found, i, r, STARTS, float((hi - lo).max()))
                    row["remain"], row["cells"] = r.remain, cells
                    if not row["differs"]:
                        break
            log.write(json.dumps(row, default=str) + "\n")
            log.flush()
            rows[i] = row
    for name, part in (("anywhere", False), ("next to a boundary", True)):
        mine = [row for row in rows.values() if row["boundary"] == part]
        undecided = Counter(row["undecided"] for row in mine if row["undecided"])
        fields = Counter(each.split()[0] for row in mine for each in row.get("differs", ()))
        wrong = sum(bool(row.get("differs")) for row in mine)
        print(f"{name}: {len(mine)} points, undecided {dict(undecided)}, {wrong} differ in {dict(fields)}")


if __name__ == "__main__":
    main()
