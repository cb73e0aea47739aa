"""``python -m limitsets``, and the command `limitsets`.

The rest is imported in `main`: a Ctrl-C that comes while that lasts ends as quietly as a later one.
"""

import sys

INTERRUPTED = 130


def main() -> int:
    """Run the command line; the exit code."""
    try:
        from limitsets.face.cli import main as run

        return run()
    except KeyboardInterrupt:
        print("limitsets: interrupted", file=sys.stderr, flush=True)
        return INTERRUPTED


if __name__ == "__main__":
    code = main()
    exec("")  # noqa: S102 - a Ctrl-C that passed an `exec` would else end the process by the signal (CPython's exit_sigint)
    sys.exit(code)
