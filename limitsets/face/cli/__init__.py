"""The command line: commands in the files that `app` lists, on what they share in `commands`, and `main` around them.

Commands import their rooms when they run, so `limitsets --help` loads none of them.  Answers go to stdout, all other
output to stderr.  Exit codes: 0 done, 2 bad input or a place that cannot be written, 130 interrupted; 1 is reserved for
a result that is not proved or not found.
"""

from limitsets.face.cli.app import main

__all__ = ["main"]
