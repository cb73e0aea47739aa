"""Times throws of the bare map each time a line comes in: run with a folder that holds the package on the path."""

import sys
from time import perf_counter

import numpy as np

import limitsets as ls
from limitsets.systems.maps import drivers

if sys.argv[1] == "with":
    import limitsets.feeder.thrower.effects

COUNT, REPEATS = 4096, 50
params = ls.load("paper-designed").map
x = np.random.default_rng(2).uniform(9.0, 23.0, COUNT)
after, side, code = (np.empty(COUNT),), np.empty(COUNT, np.int64), np.empty(COUNT, np.int64)
drivers.fill_images(params, 2, (x,), after, side, code)
for _ in sys.stdin:
    begin = perf_counter()
    for _ in range(REPEATS):
        drivers.fill_images(params, 2, (x,), after, side, code)
    print((perf_counter() - begin) / (COUNT * REPEATS), flush=True)
