"""`python -m tests.attack N --seed S --log FILE`: judge N random scenes, a JSON line each; goes on where it ended."""

from __future__ import annotations

import argparse
import json
import signal
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.progress import track

from tests.attack.generate import case
from tests.attack.judge import ORBITS, judge

SHOWN = ("claim", "verdict", "starts", "share", "leaves", "creeps", "open", "reason", "timings")


class TooLongError(BaseException):  # past whatever catches errors
    pass


def stop(*_: Any) -> None:
    raise TooLongError


def one(seed: int, limit: int, orbits: int, recheck: bool) -> dict[str, Any]:
    """Judge the scene of a seed; a crash is a fault, a scene that takes too long is said to."""
    began = time.monotonic()
    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, limit)
    given = case(seed)
    row: dict[str, Any] = {"seed": seed, "faults": [], "doubts": [], "verdicts": []}
    try:
        with tempfile.TemporaryDirectory() as folder:
            found = judge(given, Path(folder), orbits, recheck)
        row |= {"faults": found.faults, "doubts": found.doubts, "recheck": found.recheck.get("verdict")}
        row["parts"] = {key: round(value, 1) for key, value in found.seconds.items()}
        row["verdicts"] = [{key: claim.get(key) for key in SHOWN} for claim in found.claims]
    except TooLongError:
        row["too_long"] = True
    except Exception:  # noqa: BLE001 - a crash of what is judged is a finding
        row["faults"] = [traceback.format_exc()]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    return row | {"case": asdict(given), "seconds": round(time.monotonic() - began, 1)}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.attack", description=__doc__)
    parser.add_argument("scenes", type=int)
    parser.add_argument("--seed", type=int, default=0, help="of the first scene")
    parser.add_argument("--log", type=Path, default=Path("attack.jsonl"))
    parser.add_argument("--limit", type=int, default=120, help="seconds of the processor for one scene")
    parser.add_argument("--orbits", type=int, default=ORBITS)
    parser.add_argument("--no-recheck", action="store_true")
    given = parser.parse_args()
    lines = given.log.read_text().splitlines() if given.log.exists() else []
    done = {json.loads(line)["seed"] for line in lines}
    counts: Counter[str] = Counter()
    with given.log.open("a") as log:
        for seed in track(range(given.seed, given.seed + given.scenes), description="scenes"):
            if seed in done:
                continue
            row = one(seed, given.limit, given.orbits, not given.no_recheck)
            log.write(json.dumps(row) + "\n")
            log.flush()
            counts.update(
                f"{v['claim']} {v['verdict']} {v['starts'] if isinstance(v['starts'], str) else ''}"
                for v in row["verdicts"]
            )
            counts.update(["faults"] * bool(row["faults"]) + ["too long"] * ("too_long" in row))
    print(*(f"{count:5d}  {what}" for what, count in sorted(counts.items())), sep="\n")


if __name__ == "__main__":
    main()
