"""What a scene does not ask for is not in its machine code: the bare map's is the same with the effects deleted."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.thrower.effects.copies import environment_of_copy

# Prints a digest of the machine code of one compiled loop over throws; symbols carry counters, so they are left out.
SCRIPT = """
import hashlib, re, sys
import numpy as np
import limitsets as ls
from limitsets.maps import drivers, images
if sys.argv[1] == "with":
    import limitsets.feeder.thrower.effects
images(ls.load("paper-designed").map, np.linspace(9.0, 20.0, 8), 2)
(signature,) = drivers.fill_images.signatures
code = drivers.fill_images.inspect_asm(signature)
lines = [line for line in code.splitlines() if not line.lstrip().startswith((".", "#"))]
symbol = r"[A-Za-z0-9_.$]*_ZN?[A-Za-z0-9_.$]*|\\.?numba[A-Za-z0-9_.$]*|NRT[A-Za-z0-9_]*"
body = re.sub(symbol, "symbol", "\\n".join(lines))
print(len(lines), hashlib.sha256(body.encode()).hexdigest())
"""


def machine_code(folder: Path, word: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, word],
        capture_output=True,
        text=True,
        check=False,
        env=environment_of_copy(folder, word),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.sweep
def test_the_bare_map_has_the_same_machine_code_without_the_effects(tmp_path: Path) -> None:
    whole, bare = machine_code(tmp_path, "with"), machine_code(tmp_path, "without")
    assert whole == bare
    assert int(whole.split()[0]) > 500  # there is a loop in it
