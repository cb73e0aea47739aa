"""The store that nothing interrupted, computed once."""

import pytest

from tests.sweep.stores import bytes_of, run


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """Every file of the store that nothing interrupted."""
    store = tmp_path_factory.mktemp("whole") / "whole.zarr"
    run(store)
    return bytes_of(store)


@pytest.fixture
def stored(tmp_path, whole):
    """A copy of it, for one test to spoil."""
    store = tmp_path / "s.zarr"
    for name, data in whole.items():
        (store / name).parent.mkdir(parents=True, exist_ok=True)
        (store / name).write_bytes(data)
    return store
