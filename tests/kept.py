"""Loops that tests compile are kept on disk, as those of the package are."""

import hashlib
from pathlib import Path
from typing import Any

from limitsets import jit


def kept(loop: Any) -> Any:
    """Keep the machine code of a loop under the digests of the package and of the file in which it stands.

    For loops that call kernels of these two only, with the package's classes.
    """
    if jit._folder is not None:
        file = Path(loop.py_func.__code__.co_filename)
        cache = jit._source_cache(jit._folder / hashlib.sha256(file.read_bytes()).hexdigest()[:24])
        if cache is not None:
            loop._cache = cache(loop.py_func)
    return loop
