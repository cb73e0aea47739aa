"""Files that are replaced whole, or not at all."""

from pathlib import Path

import pytest

from limitsets.files import replaced


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
