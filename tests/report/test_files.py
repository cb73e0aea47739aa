"""Files that are replaced whole, or not at all, and answers as JSON."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from limitsets.base.files import as_json, as_table, replaced


@dataclass
class Place:
    x: float
    side: int


class Told:
    def to_json(self):
        return as_table(place=Place(math.nan, np.int64(2)))


def test_an_answer_as_json():
    answer = {
        1: (Told(), Place(np.float64(0.1), 0)),
        "sizes": np.array([[1.5, -np.inf], [np.nan, 2.0]]),
        "none": None,
        "words": iter(["a", "é"]),
        "sure": np.True_,
    }
    text = as_json(answer)
    assert json.loads(text) == {
        "1": [{"place": {"x": None, "side": 2}}, {"x": 0.1, "side": 0}],
        "sizes": [[1.5, None], [None, 2.0]],
        "none": None,
        "words": ["a", "é"],
        "sure": True,
    }
    assert text == json.dumps(json.loads(text), indent=2) + "\n"
    with pytest.raises(TypeError):
        as_json(object())


def test_all_at_once(tmp_path):
    (tmp_path / "one").write_text("old")
    with replaced(tmp_path) as draft:
        (draft / "one").write_text("new")
        (draft / "two").write_text("new")
        assert (tmp_path / "one").read_text() == "old"
        assert not (tmp_path / "two").exists()
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"one": "new", "two": "new"}


@pytest.mark.parametrize("fault", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_fault_leaves_the_old_ones(tmp_path, fault):
    (tmp_path / "one").write_text("old")
    with pytest.raises(fault), replaced(tmp_path) as draft:  # noqa: PT012 - leaving the block is what is tested
        (draft / "one").write_text("half")
        raise fault
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("one", "old")]


def test_a_fault_between_two_renames_leaves_whole_files(tmp_path, monkeypatch):
    for name in ("one", "two"):
        (tmp_path / name).write_text("old")
    rename, calls = Path.replace, []

    def fails_second(self, target):
        calls.append(target)
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        return rename(self, target)

    monkeypatch.setattr(Path, "replace", fails_second)
    with pytest.raises(OSError, match="No space"), replaced(tmp_path) as draft:  # noqa: PT012 - leaving the block is what is tested
        (draft / "one").write_text("new")
        (draft / "two").write_text("new")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"one": "new", "two": "old"}


def test_only_regular_files_are_replaced(tmp_path):
    (tmp_path / "two").mkdir()
    (tmp_path / "one").write_text("old")
    with pytest.raises(FileExistsError), replaced(tmp_path) as draft:  # noqa: PT012 - leaving the block is what is tested
        (draft / "one").write_text("new")
        (draft / "two").write_text("new")
    assert (tmp_path / "one").read_text() == "old"
    assert {path.name for path in tmp_path.iterdir()} == {"one", "two"}
