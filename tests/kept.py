"""Loops that tests compile are kept on disk, as those of the package are."""

import hashlib
from pathlib import Path
from typing import Any

from limitsets.numbers.jit import cache


def kept(loop: Any) -> Any:
    """Keep the machine code of a loop under the digests of the package and of the file in which it stands.

    For loops that call kernels of these two only, with the package's classes.
    """
    if cache.FOLDER is not None:
        file = Path(loop.py_func.__code__.co_filename)
        made = cache._source_cache(cache.FOLDER / hashlib.sha256(file.read_bytes()).hexdigest()[:24])
        if made is not None:
            loop._cache = made(loop.py_func)
    return loop
