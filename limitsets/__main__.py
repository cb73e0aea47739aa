"""``python -m limitsets``."""

import sys

from limitsets.cli import main

if __name__ == "__main__":
    sys.exit(main())
