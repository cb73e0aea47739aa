"""The formulas of the throw are written once and called on floats and on intervals: what the compiler fuses of them."""

import json
import os
import subprocess
import sys

import pytest
from llvmlite.binding import get_host_cpu_features

# In a process of its own with an empty cache: code that comes from the cache cannot be read.
READ = r"""
import json, re, sys
import numpy as np
import limitsets as ls
from limitsets.graph.images import hulls
from limitsets.graph.images.enclosed import enclosures
from limitsets.maps import drivers, images

fused = re.compile(r"\bvfn?m(add|sub)|\bvfm(addsub|subadd)")
x = np.linspace(8.0, 28.0, 50)
for flight, flip in json.loads(sys.argv[1]):
    scene = ls.load({**ls.load("paper-designed").as_dict(), "model": {"flight": flight, "flip": flip}})
    enclosures(scene.map, scene.map, x, 0)
    images(scene.map, x, 0)
codes = {"boxes": hulls._enclose.inspect_asm(), "floats": drivers._images.inspect_asm()}
print(json.dumps({key: [len(fused.findall(code)) for code in found.values()] for key, found in codes.items()}))
"""


MODELS = [("small-angle", "signed"), ("exact", "energy"), ("small-angle-2", "energy")]


@pytest.fixture(
    scope="module", params=[[("exact", "signed")], pytest.param(MODELS, marks=pytest.mark.sweep)], ids=len
)
def fused(request, tmp_path_factory):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path_factory.mktemp("cache"))}
    command = [sys.executable, "-c", READ, json.dumps(request.param)]
    found = json.loads(subprocess.run(command, env=environment, check=True, capture_output=True).stdout)
    assert [len(codes) for codes in found.values()] == [len(request.param)] * 2
    return found


def test_no_bound_is_fused(fused):
    assert not any(fused["boxes"])


def test_floats_are_fused_where_the_processor_can(fused):
    """So the test above can fail."""
    assert all(fused["floats"]) == bool(get_host_cpu_features().get("fma"))
