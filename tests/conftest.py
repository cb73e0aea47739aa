"""Settings for every test: random examples without deadlines, and no window ever opened."""

import os

import pytest
from hypothesis import settings

from tests.browsers import REASON

# Before anything imports matplotlib, in this process and in those that tests start.
os.environ["MPLBACKEND"] = "Agg"

# Tables are as wide as their text where nothing says how wide a line is; some runners of tests say it.
os.environ.pop("COLUMNS", None)

# Deadlines would fail the first example of a kernel, which compiles.  In CI the examples are the same at every run.
settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(terminalreporter):
    """Say in the last lines how many tests of pages were left out, and why."""
    yield
    left_out = [
        report for report in terminalreporter.stats.get("skipped", []) if REASON in str(report.longrepr)
    ]
    if left_out:
        terminalreporter.write_line(
            f"{len(left_out)} tests look at pages in a browser and were left out: {REASON}"
        )
