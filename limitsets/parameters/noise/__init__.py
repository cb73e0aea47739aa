"""Random noise by the transfer operator and by trials.  The public name `limitsets.robust` is this room.

Noise with a probability law is a Markov chain on cells (generalised cell mapping); its answers are numerical
approximations, never proofs, and say so.  Margins and proved brackets of probabilities, which `limitsets.robust` also
has, come from `limitsets.parameters.margins` and `limitsets.proofs.chances`.
"""

from __future__ import annotations

from limitsets.feeder.scattering import (
    Gaussian as Gaussian,
)
from limitsets.feeder.scattering import (
    Given as Given,
)
from limitsets.feeder.scattering import (
    Samples as Samples,
)
from limitsets.feeder.scattering import (
    Scattering as Scattering,
)
from limitsets.feeder.scattering import (
    Uniform as Uniform,
)
from limitsets.parameters.margins.margin_result import Margin as Margin
from limitsets.parameters.margins.single import margin as margin
from limitsets.parameters.noise.absorbing import absorption as absorption
from limitsets.parameters.noise.absorbing import classes as classes
from limitsets.parameters.noise.statistics import (
    NoiseStatistics as NoiseStatistics,
)
from limitsets.parameters.noise.statistics import (
    noise_levels as noise_levels,
)
from limitsets.parameters.noise.statistics import (
    noise_statistics as noise_statistics,
)
from limitsets.parameters.noise.ulam import transfer as transfer
from limitsets.proofs.chances.absorption import (
    AbsorptionBrackets as AbsorptionBrackets,
)
from limitsets.proofs.chances.absorption import (
    absorption_brackets as absorption_brackets,
)
