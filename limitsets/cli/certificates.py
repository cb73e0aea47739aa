"""Certificates as files of the commands: their names, and `--certificate FILE`, checked before it gets its name."""

from __future__ import annotations

import time
from contextlib import suppress
from json import loads
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile, ZipFile

from limitsets.cli.output import refuse_other, saved, say_other, stem_of
from limitsets.proposals import proposed

if TYPE_CHECKING:
    from limitsets.scene import Scene


def own_file(scene: Scene) -> Path:
    """Name a certificate after the scene's file; a certificate of another scene that has this name stays."""
    file = Path(f"{stem_of(scene)}.proof.zip")
    if found := _question_of(file):
        refuse_other("the certificate", file, found[0]["name"], scene)
    return file


def _question_of(file: Path) -> tuple[Any, ...]:
    """Read of which scene and of which deviations a certificate is; empty where there is none that says so."""
    with suppress(OSError, BadZipFile, ValueError, TypeError, LookupError), ZipFile(file) as zipped:
        header = loads(zipped.read("header.json"))
        scene = header["boxes"][0]["scene"]
        return scene | {"name": str(scene["name"])}, header.get("noise"), header.get("tolerance")
    return ()


def say_replaced(file: Path, draft: Path) -> None:
    """Say that a certificate of other values or deviations gives way to a draft.

    It may be the last that knows those values; not to replace it would be in the way of everyone who edits a scene and
    proves again.  What differs is known once the new one is written, for both have one form then.
    """
    before, after = _question_of(file), _question_of(draft)
    if before and after and before != after:
        say_other("the certificate", file, before[0]["name"])


def with_ending(file: Path) -> Path:
    """Give a certificate its ending where its name has none; what is there, a folder or a device, keeps its name."""
    return file if file.suffix or file.exists() else file.with_name(f"{file.name}.proof.zip")


def certified(
    found: Any, file: Path, claim: str, *, proved: bool, recheck: bool
) -> tuple[Any, dict[str, Any]]:
    """Write the certificate; what is left of the answer where the checker denies it, and what is said of the file."""
    from limitsets.proofs.confirm import DeniedError

    if not proved:
        return found, {"file": None, "denied": False, "recheck": None}
    begin, file = time.perf_counter(), with_ending(file)
    with saved(file) as draft:
        try:
            found.save(draft, recheck=recheck, workers=None)
        except DeniedError as error:
            kept = str(file.with_name(Path(error.file or "").name))
            return found.denied(error.claims[claim]), {"file": kept, "denied": True, "recheck": None}
        say_replaced(file, draft)
    seconds = time.perf_counter() - begin if recheck else None
    return found, {"file": str(file), "denied": False, "recheck": seconds}


def said_of(written: dict[str, Any], missing: str) -> str:
    """Say it to people; `missing` is why there is no file."""
    file, seconds = written["file"], written["recheck"]
    if file is None:
        return f"no certificate is written: {missing}"
    if written["denied"]:
        return f"the checker denies the certificate: it is kept as {file}"
    done = "not rechecked" if seconds is None else f"rechecked in {seconds:.2g} s"
    return f"certificate: {file}, {done} (check it: {proposed('recheck', file)})"
