"""Refuse a commit that changes limitsets/ and leaves CHANGELOG.md as it was."""

import subprocess
import sys

staged = subprocess.run(
    ["git", "diff", "--cached", "--name-only"], check=True, capture_output=True, text=True
).stdout.split("\n")
if any(name.startswith("limitsets/") for name in staged) and "CHANGELOG.md" not in staged:
    sys.exit("limitsets/ changes and CHANGELOG.md does not: add a line under Unreleased")
