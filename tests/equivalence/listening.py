"""A pytest plugin that notes what the checker says of every file that the tests put before it."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

import pytest

CHECKERS = ("lone_checker", "limitsets.checker")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems() -> None:
    import limitsets.checker  # noqa: F401

    log = Path(os.environ["LIMITSETS_CHECKED"])

    def listened(check: Any) -> Any:
        def recheck(*words: Any, **more: Any) -> Any:
            report = check(*words, **more)
            test = os.environ.get("PYTEST_CURRENT_TEST", "").rsplit(" ", 1)[0]
            with log.open("a") as file:
                said = (report.verdict, re.sub("pytest-[0-9]+", "pytest", report.reason), report.claims)
                file.write(f"{test}\t{said!r}".replace("\n", " ") + "\n")
            return report

        return recheck

    for name in CHECKERS:
        if name in sys.modules:
            module: Any = sys.modules[name]
            module.recheck = listened(module.recheck)
