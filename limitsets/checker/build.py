"""Pack the checker in one file to copy away: `python build.py recheck.pyz`.

The file holds the package `checker` and a `__main__` of two lines: processes that share the work import the package,
which they could not do with a lone `__main__.py`.
"""

import shutil
import sys
import tempfile
import zipapp
from pathlib import Path

START = "from checker.main import main\nraise SystemExit(main())\n"


def build(target: Path) -> None:
    """Write the file."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        unwanted = shutil.ignore_patterns("__pycache__", "build.py")
        shutil.copytree(Path(__file__).parent, Path(folder) / "checker", ignore=unwanted)
        (Path(folder) / "__main__.py").write_text(START, encoding="utf-8")
        zipapp.create_archive(folder, target)


if __name__ == "__main__":
    build(Path(sys.argv[1]))
