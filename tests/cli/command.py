"""The command line called within the process of the tests."""

import re

from limitsets.cli import main

PROGRESS = re.compile(r" \([0-9]+ of [0-9]+\)$")  # of what takes over two seconds


def run(capfd, *words):
    """Exit code, and what goes to each stream: to the second only lines that name the command."""
    code = main(words)
    out, err = capfd.readouterr()
    assert "Traceback" not in err
    assert all(line.startswith("limitsets: ") for line in err.splitlines())
    return code, out, err
