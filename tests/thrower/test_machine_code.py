"""What the compiler makes of kernels: operations fused, vectors as wide as the processor's, references counted.

The formulas of the throw are written once and called on floats and on intervals: a bound must not be fused.
"""

import json
import os
import subprocess
import sys

import pytest
from llvmlite.binding import get_host_cpu_features

# In a process of its own with an empty cache: code that comes from the cache cannot be read.
READ = r"""
import json, re, sys
import numba
import numpy as np
import limitsets as ls
from limitsets.systems.graph.images.enclosed import _enclose, enclosures
from limitsets.systems.graph.images.sampled import _hulls
from limitsets.maps import drivers, images

fused = re.compile(r"\bvfn?m(add|sub)|\bvfm(addsub|subadd)")
x = np.linspace(8.0, 28.0, 50)
for flight, flip in json.loads(sys.argv[1]):
    scene = ls.load({**ls.load("paper-designed").as_dict(), "model": {"flight": flight, "flip": flip}})
    enclosures(scene.map, scene.map, x, 0)
    images(scene.map, x, 0)
ls.transitions(scene.map, ls.grid(scene.domain, cells=8))
codes = {"boxes": _enclose.inspect_asm(), "floats": drivers.fill_images.inspect_asm()}
found = {key: [len(fused.findall(code)) for code in found.values()] for key, found in codes.items()}
found["widest"] = [code.count("zmm") for code in codes["floats"].values()]
found["counted"] = [code.count("NRT_") for code in _hulls.inspect_asm().values()]
found["target"] = numba.core.registry.cpu_target.target_context.codegen().magic_tuple()
print(json.dumps(found))
"""

WIDE = bool(get_host_cpu_features().get("avx512vl"))


MODELS = [("small-angle", "signed"), ("exact", "energy"), ("small-angle-2", "energy")]


@pytest.fixture(
    scope="module",
    params=[pytest.param(each, marks=pytest.mark.sweep) for each in ([("exact", "signed")], MODELS)],
    ids=len,
)
def fused(request, tmp_path_factory):
    # One of the processors for which LLVM by itself prefers vectors of 256 bits to those of 512 that it has.
    processor = {"NUMBA_CPU_NAME": "skylake-avx512"} if WIDE else {}
    environment = {**os.environ, **processor, "NUMBA_CACHE_DIR": str(tmp_path_factory.mktemp("cache"))}
    command = [sys.executable, "-c", READ, json.dumps(request.param)]
    found = json.loads(subprocess.run(command, env=environment, check=True, capture_output=True).stdout)
    assert [len(found[key]) for key in ("boxes", "floats")] == [len(request.param)] * 2
    return found


def test_no_bound_is_fused(fused):
    assert not any(fused["boxes"])


def test_floats_are_fused_where_the_processor_can(fused):
    """So the test above can fail."""
    assert all(fused["floats"]) == bool(get_host_cpu_features().get("fma"))


def test_vectors_are_the_widest_of_the_processor(fused):
    assert all(count > 0 for count in fused["widest"]) == WIDE


def test_the_key_of_compiled_code_covers_the_width(fused):
    """Numba's own key has the features of the target, and `jit` puts it into the name of each file."""
    assert ("-prefer-256-bit" in fused["target"][2]) == WIDE


def test_images_are_placed_without_counting_references(fused):
    assert fused["counted"] == [0]
