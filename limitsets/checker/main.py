"""The command line: `python -m limitsets.checker FILE`; docs/certificates.md, "Checking one"."""

import argparse
import itertools
import json
import sys
import time
from dataclasses import asdict
from typing import Any

from .file import model_in_words, plain
from .report import EXITS, WORDS, Report, recheck

MOST_LINES = 40  # of formulas; of more the first and the last ten are printed


def show(report: Report, file: str, *, formulas: bool = False) -> None:
    """Print a report for people; `formulas`: all lines of the formulas of a map."""
    print(f"certificate: {plain(file, 200)}")
    if report.map is not None:
        show_map(report, report.map, whole=formulas)
        return
    for title, lines in (
        ("claimed", report.statement),
        ("for", [f"{name} = {value}" for name, value in report.parameters.items()]),
        ("relying on", report.relied_on),
    ):
        if lines:
            print("\n  ".join([f"{title}:", *lines]))
    for name, state, why in report.claims:
        print(f"{name}: {WORDS[state]}" + (f" - {why}" if why else ""))
    if report.model is not None:
        print(model_in_words(report.model))
    print(f"{report.cells} cells, {report.seconds:.1f} s")
    print(WORDS[report.verdict] + (f": {report.reason}" if report.reason else ""))


def counted(count: int, what: str) -> str:
    """Write a number of things."""
    return f"{count} {what}{'' if count == 1 else 'es' if what.endswith('ch') else 's'}"


def show_map(report: Report, of: dict[str, Any], *, whole: bool) -> None:
    """Print the report of a certificate of a map: its formulas, and box after box of parameters what is proved."""
    shape = (("dimension", "coordinate"), ("sides", "side"), ("branches", "branch"))
    print(f"certificate of a map: {', '.join(counted(of[key], what) for key, what in shape)}")
    lines = of["formulas"]
    if len(lines) > MOST_LINES and not whole:
        hidden = f"    ... {len(lines) - 20} lines of formulas are not shown: --formulas shows all"
        lines = [*lines[:10], hidden, *lines[-10:]]
    print("\n".join(lines))
    for k, box in enumerate(of["boxes"]):
        title = [f"box {k} of parameters"] if len(of["boxes"]) > 1 else []
        said = [f"{name}: {WORDS[word]} - {text}" for name, word, text in box["claims"]]
        said = said or ["nothing is claimed"]
        print("\n".join([*title, *box["parameters"], *filter(None, [box["holds_for"]]), *said]))
    if "plane" in of:
        print(
            "\n".join(
                itertools.takewhile(lambda line: line.startswith(("region:", "    ")), report.statement)
            )
        )
    print(f"relying on: {'; '.join(report.relied_on)}")
    print(f"{counted(report.cells, 'cell')}, {report.seconds:.1f} s")
    verdicts = [box["verdict"] for box in of["boxes"]]
    kinds = (("proved", "proved"), ("refuted", "refuted"), ("failed", "failed"), ("", "without claims"))
    parts = ", ".join(f"{verdicts.count(key)} {words}" for key, words in kinds if key in verdicts)
    of_boxes = f", boxes of parameters: {parts}" if len(verdicts) > 1 else ""
    print(WORDS[report.verdict] + of_boxes + (f": {report.reason}" if report.reason else ""))


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(
        description="Check a proof certificate of a throw-and-catch feeder, or of a map."
    )
    parser.add_argument("file", help="the certificate, NAME.proof.zip")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--formulas", action="store_true", help="print all lines of the formulas of a map")
    parser.add_argument("--workers", type=int, metavar="N", help="processes (default: all processors)")
    options = parser.parse_args()
    seen, begun = sys.stderr.isatty(), time.monotonic()
    last = begun

    def bar(done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if seen and now - begun > 2 and (now - last > 0.2 or done == total):
            last = now
            full = 40 * done // max(total, 1)
            text = f"\r[{'#' * full}{'.' * (40 - full)}] {done}/{total} cells"
            print(text, end="", file=sys.stderr, flush=True)
            if done == total:
                print(file=sys.stderr)

    try:
        report = recheck(options.file, options.workers, bar)
    except KeyboardInterrupt:
        print("\ninterrupted", file=sys.stderr)
        return 130
    if options.json:
        print(json.dumps(asdict(report), allow_nan=False))
    else:
        show(report, options.file, formulas=options.formulas)
    return EXITS[report.verdict]
