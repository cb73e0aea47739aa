"""Verdicts about a scene against an adversary: what is proved holds on thousands of orbits, what is refuted replays.

A verdict is read from the JSON of `limitsets certify --json`, the cells of a `proved-on-cells` from the certificate's
arrays. Orbits, digits, units and geometry are the code of this folder.
"""

from __future__ import annotations

import contextlib
import io
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.face.cli import main
from tests.attack.generate import Case
from tests.attack.goals import Verdict, ranges
from tests.attack.proved import attraction, proved_goal
from tests.attack.refuted import refuted

ORBITS = 10_000


def command(*words: str) -> tuple[int, str, str]:
    """The command line, within this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(words)
    return code, out.getvalue(), err.getvalue()


def ask(case: Case, folder: Path, claims: tuple[str, ...]) -> tuple[int, list[dict[str, Any]], Path, str]:
    """Certify a scene; exit code, claims, certificate, what went to stderr."""
    scene, file = folder / "attacked.toml", folder / "attacked.proof.zip"
    scene.write_text(case.text)
    for old in folder.glob("attacked.proof*"):
        old.unlink()
    words = [word for claim in claims for word in ("--claim", claim)]
    words += [word for name, by in case.noise.items() for word in ("--noise", f"{name}={by}")]
    words += [word for name, by in case.tolerance.items() for word in ("--tolerance", f"{name}={by}")]
    code, out, err = command("certify", str(scene), *words, "--json", "--no-recheck", "-o", str(file))
    found = json.loads(out) if out else []
    for claim in found:
        claim.setdefault("starts", (claim.get("section") or {}).get("starts"))
    return code, found, file, err


def contradictory(first: dict[str, Any], second: dict[str, Any]) -> bool:
    """Whether one is proved of a set of starts of which the other is refuted."""
    if {first["verdict"], second["verdict"]} != {"proved", "refuted"}:
        return False
    yes, no = (first, second) if first["verdict"] == "proved" else (second, first)
    strength = {"every": 2, "almost-every": 1}
    held = strength.get(yes["starts"], 0) if isinstance(yes["starts"], str) else 0
    return held >= strength.get(no["starts"], 1)


def judge(case: Case, folder: Path, count: int = ORBITS, recheck: bool = True) -> Verdict:
    """Certify, recheck, and look."""
    found = Verdict(case)
    rng = np.random.default_rng([11, case.seed])
    clock = time.monotonic()
    code, found.claims, file, err = ask(case, folder, case.claims)
    found.seconds["certify"] = time.monotonic() - clock
    if not found.claims:
        found.fault(f"certify: exit {code}, no JSON: {err.strip().splitlines()[-1:]}")
        return found
    proved = all(claim["verdict"] == "proved" for claim in found.claims)
    if (code == 0) != proved:
        found.fault(f"exit {code} with {[claim['verdict'] for claim in found.claims]}")
    for denied in folder.glob("*denied*"):
        found.fault(f"the checker denied {denied.name}: {[c.get('reason') for c in found.claims]}")
        denied.unlink()
    if recheck and file.exists():
        checked, out, err = command("recheck", str(file), "--json")
        found.recheck = json.loads(out) if out else {}
        said = found.recheck.get("verdict")
        kept = {claim["verdict"] for claim in found.claims} & {"proved", "proved-on-cells"}
        wanted = ("proved-on-cells",) if "proved-on-cells" in kept else ("proved",)
        wanted += ("refuted",) if not kept else ()
        if said not in wanted or (checked == 0) != (said == "proved"):
            found.fault(
                f"recheck: exit {checked}, {said!r}: {found.recheck.get('reason')} {err.strip()[-300:]}"
            )
    found.seconds["recheck"] = time.monotonic() - clock - found.seconds["certify"]
    within = ranges(case, rng)
    for claim in found.claims:
        if claim["verdict"] == "refuted":
            refuted(found, claim, within)
        elif claim["claim"] == "goal" and claim["verdict"] in ("proved", "proved-on-cells"):
            proved_goal(found, claim, within, file, rng, count)
        elif claim["claim"] == "attracts-all" and claim["verdict"] == "proved":
            attraction(found, claim, within, rng, count)
    found.seconds["orbits"] = time.monotonic() - clock - sum(found.seconds.values())
    again(found, folder)
    return found


def again(found: Verdict, folder: Path) -> None:
    """Asked together with other claims, and so on other cells, the goal must not have the opposite verdict."""
    case = found.case
    other = ("goal",) if len(case.claims) > 1 else ("attracts-all", "invariant", "goal")
    _, claims, _, _ = ask(case, folder, other)
    for claim in found.claims:
        for second in claims:
            if claim["claim"] == second["claim"] and contradictory(claim, second):
                found.fault(
                    f"{claim['claim']} {claim['verdict']} of {claim.get('starts')},"
                    f" and {second['verdict']} of {second.get('starts')}"
                )
