"""Where no browser is installed the tests of pages are left out, and the last lines say so."""

import os
from types import SimpleNamespace

import pytest

from tests.browsers import REASON, REQUIRED, browser, installed
from tests.conftest import pytest_terminal_summary


@pytest.fixture
def empty_path(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv(REQUIRED, raising=False)
    return tmp_path


@pytest.mark.parametrize("name", ["chromium", "google-chrome-stable", "microsoft-edge"])
def test_any_chromium_chrome_or_edge_serves(name, empty_path):
    program = empty_path / name
    program.touch(mode=0o755)
    assert installed() == os.fspath(program)


def test_without_a_browser_a_test_is_left_out(empty_path):
    with pytest.raises(pytest.skip.Exception, match=REASON), browser():
        pytest.fail("there is no browser")


def test_where_a_browser_has_to_be_the_test_fails(empty_path, monkeypatch):
    monkeypatch.setenv(REQUIRED, "1")
    # a test that is left out here would not fail: both are caught, and told apart
    with pytest.raises((pytest.fail.Exception, pytest.skip.Exception), match=REASON) as said, browser():
        pass
    assert said.type is pytest.fail.Exception


@pytest.mark.parametrize("missing", [0, 1, 3])
def test_the_last_lines_say_how_many_and_why(missing):
    lines = []
    others = [SimpleNamespace(longrepr=("a.py", 3, "Skipped: the checker needs python-flint"))]
    left_out = [SimpleNamespace(longrepr=("b.py", 7, f"Skipped: {REASON}"))] * missing
    reporter = SimpleNamespace(stats={"skipped": others + left_out}, write_line=lines.append)
    assert list(pytest_terminal_summary(reporter)) == [None]
    assert lines == [
        f"{missing} tests look at pages in a browser and were left out: {REASON}" for _ in range(missing > 0)
    ]
