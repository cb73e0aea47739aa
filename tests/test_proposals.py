"""Commands that answers propose, as they are typed into a shell."""

import os
import sys
from pathlib import Path

import pytest

from limitsets.base.proposals import proposed


@pytest.mark.parametrize(
    ("started", "program"),
    [
        (".venv/bin/limitsets", ".venv/bin/limitsets"),
        ("{here}/.venv/bin/limitsets", ".venv/bin/limitsets"),
        ("{here}/on path/limitsets", "limitsets"),
        ("/opt/my tools/limitsets", "'/opt/my tools/limitsets'"),
        ("/site/limitsets/__main__.py", "{python} -m limitsets"),
        ("/usr/bin/pytest", "limitsets"),
        ("", "limitsets"),
    ],
)
def test_the_program_is_the_one_that_was_started(started, program, tmp_path, monkeypatch):
    (tmp_path / "on path").mkdir()
    (tmp_path / "on path" / "limitsets").touch(mode=0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", os.fspath(tmp_path / "on path"))
    monkeypatch.setattr(sys, "executable", "/opt/python3")
    monkeypatch.setattr(sys, "argv", [started.format(here=tmp_path)])
    assert proposed("scenes") == program.format(here=tmp_path, python="/opt/python3") + " scenes"


def test_words_are_quoted_for_the_shell(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["limitsets"])
    assert proposed("check", Path("it's mine.toml")) == """limitsets check 'it'"'"'s mine.toml'"""
