"""Many points of a parameter space: a plan, a task, workers, and a store that grows in whole chunks.

A plan says what is varied and what is asked (`plan`, `subjects`).  A task answers for a chunk of the points (`work`).
Any executor of `concurrent.futures` runs the chunks (`limitsets.base.campaign`), and one process, the driver, writes
them to a Zarr store that can be continued (`store`).  `parameter_atlas` is the call that users make.  `classes` gives
points of one topology one number.

xarray, zarr, pandas and distributed are imported where they are used: the extras `atlas` and `cluster`.
"""

from limitsets.parameters.atlas.parameter_atlas import Atlas, atlas
from limitsets.parameters.atlas.plan import Block, Variable, block_task
from limitsets.parameters.atlas.subjects import Axis

__all__ = ["Atlas", "Axis", "Block", "Variable", "atlas", "block_task"]
