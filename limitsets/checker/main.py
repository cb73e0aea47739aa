"""The command line: `python -m limitsets.checker FILE`; docs/certificates.md, "Checking one"."""

import argparse
import json
import sys
import time
from dataclasses import asdict

from .file import model_in_words, plain
from .report import EXITS, WORDS, Report, recheck


def show(report: Report, file: str) -> None:
    """Print a report for people."""
    print(f"certificate: {plain(file, 200)}")
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


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="Check a proof certificate of a throw-and-catch feeder.")
    parser.add_argument("file", help="the certificate, NAME.proof.zip")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
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
        show(report, options.file)
    return EXITS[report.verdict]
