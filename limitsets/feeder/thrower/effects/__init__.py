"""Effects beyond the minimal model, one file each, which declares it, and a line here.

A file has the effect's numbers and kernels, and says by `declare` what the rest of the package has to know of it,
also the facts of `[world]` that no effect needed before.  Which effects a scene switches on, and with which facts, is
the scene's business.  Source: docs/model.md, effects.
"""

# In the order in which a throw meets them.
from limitsets.feeder.thrower.effects import drive, landing, slip, bounce, pivot, roll, spread  # noqa: F401, I001
from limitsets.feeder.thrower.motion import EFFECTS, Effect, declare

__all__ = ["EFFECTS", "Effect", "declare"]
