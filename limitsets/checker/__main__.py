"""`python -m limitsets.checker FILE`."""

import sys

from .main import main

if __name__ == "__main__":
    sys.exit(main())
