"""One question through every door: how far may a quantity of a scene deviate, the same at every throw."""

import contextlib
import io
import json
import tomllib
from pathlib import Path
from typing import Any
from unittest import mock

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.face.cli import main
from limitsets.face.explorer.work import answers
from limitsets.feeder.scene.left_out import WITHOUT_SCATTER
from limitsets.parameters.margins import single
from limitsets.parameters.margins.margin_result import bound

# How much narrower than what is proved, and wider than what is refuted, a tolerance is asked of `certify`.
INSIDE, OUTSIDE = 1.0 - 1e-3, 1.0 + 1e-3


def command(*words: str) -> tuple[int, Any, str]:
    """Run a command: exit code, what it printed as JSON, what it said on stderr."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([*words, "--json"])
    return code, json.loads(out.getvalue() or "null"), err.getvalue()


def asked(scene: Any, quantity: str, folder: Path) -> dict[str, Any]:
    """Ask each door; what it gives as proved and refuted, or why it does not answer.

    A bracket is searched for once: a door that asks the very same of the very same scene is given it again, and one
    that asks anything else (another goal, reading, width or scene) searches by itself.
    """
    kept: dict[str, Any] = {}
    search = single._single

    def once(query: Any, scale: Any, width: Any, tell: Any) -> Any:
        key = repr((ls.dump(query.scene), query.goals, scale, width))
        if key not in kept:
            kept[key] = search(query, scale, width, tell)
        return kept[key]

    with mock.patch.object(single, "_single", once):
        return _asked(scene, quantity, folder)


def _asked(scene: Any, quantity: str, folder: Path) -> dict[str, Any]:
    file = folder / "scene.toml"
    loaded = ls.load(tomllib.loads(scene) if isinstance(scene, str) else scene)
    file.write_text(ls.dump(loaded), encoding="utf-8")
    found: dict[str, Any] = {}
    try:
        (one,) = ls.margin(str(file), quantity, reading="fixed")
        found["Python"] = one.proved, one.refuted
    except LimitsetsError as error:
        found["Python"], one = str(error), None
    for door, words in (("margin", []), ("margin -o", ["-o", str(folder / "margin")])):
        code, record, said = command("margin", str(file), quantity, "--reading", "fixed", *words)
        found[door] = said if record is None else (record[0]["proved"], record[0]["refuted"])
        assert (code == 2) == (record is None)
        if record is not None and words:
            found["certificate"] = record[0]["certificate"] is not None
    leave = [word for part in ("joint", "curve", "noise", "audit") for word in ("--without", part)]
    _, record, said = command(
        "robustness", str(file), "--quantity", quantity, *leave, "--workers", "1", "-o", str(folder / "sheet")
    )
    found["robustness"] = said
    if record is not None:
        rows = [row for row in record["margins"] if (row["quantity"], row["reading"]) == (quantity, "fixed")]
        found["robustness"] = (rows[0]["proved"], rows[0]["refuted"]) if rows else str(record["left_out"])
    if one is not None:
        for word, value in (("inside", one.proved * INSIDE), ("outside", (one.refuted or 0.0) * OUTSIDE)):
            if value > 0.0:
                deviation = f"{quantity}={value!r} {one.unit}".strip()
                proof = str(folder / f"{word}.proof.zip")
                words = ["--claim", "goal", "--tolerance", deviation, "-o", proof]
                _, record, said = command("certify", str(file), *words)
                found[f"certify {word}"] = said if record is None else record[0]["verdict"]
                found[f"why {word}"] = None if record is None else record[0]["reason"]
    lines = list(answers({"what": "proof", "scene": ls.dump(loaded), "margins": [quantity]}))
    told = [line for line in lines if line.get("margin") == quantity]
    found["explorer"] = told[0] if told else lines
    return found | {"unit": None if one is None else one.unit}


def disagreements(found: dict[str, Any]) -> list[str]:
    """Say which doors answer otherwise than Python does."""
    answer, wrong = found["Python"], []
    for door in ("margin", "margin -o", "robustness"):
        if isinstance(answer, str):
            same = isinstance(found[door], str)
        else:
            same = found[door] == answer
        if not same:
            wrong.append(f"{door}: {found[door]}, Python: {answer}")
    if isinstance(answer, str):
        return wrong
    proved, refuted = answer
    # `certify` may leave a whole tolerance undecided that `margin` proves piece by piece, if it says why
    if proved > 0.0 and found["certify inside"] != "proved" and not found["why inside"]:
        wrong.append(f"certify inside {proved}: {found['certify inside']}")
    if refuted and found["certify outside"] == "proved":
        wrong.append(f"certify outside {refuted}: proved")
    told = found["explorer"]
    if isinstance(told, dict):
        shown = bound(proved, found["unit"]), refuted and bound(refuted, found["unit"], up=True)
        if (told["proved"].removesuffix(f" {WITHOUT_SCATTER}"), told["refuted"]) != shown:
            wrong.append(f"explorer: {told}, Python as shown: {shown}")
    return wrong
