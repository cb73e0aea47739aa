"""Random noise by the transfer operator and by trials.  The public name `limitsets.robust` is this room.

Noise with a probability law is a Markov chain on cells (generalised cell mapping); its answers are numerical
approximations, never proofs, and say so.  Margins and proved brackets of probabilities, which `limitsets.robust` also
has, come from `limitsets.parameters.margins` and `limitsets.proofs.chances`.
"""

from limitsets.feeder.scattering import Gaussian, Given, Samples, Scattering, Uniform
from limitsets.parameters.margins.margin_result import Margin
from limitsets.parameters.margins.single import margin
from limitsets.parameters.noise.absorbing import absorption, classes
from limitsets.parameters.noise.statistics import NoiseStatistics, noise_levels, noise_statistics
from limitsets.parameters.noise.ulam import transfer
from limitsets.proofs.chances.absorption import AbsorptionBrackets, absorption_brackets
from limitsets.proofs.chances.long_run import LongRunAverages, long_run_averages

__all__ = [
    "AbsorptionBrackets",
    "Gaussian",
    "Given",
    "LongRunAverages",
    "Margin",
    "NoiseStatistics",
    "Samples",
    "Scattering",
    "Uniform",
    "absorption",
    "absorption_brackets",
    "classes",
    "long_run_averages",
    "margin",
    "noise_levels",
    "noise_statistics",
    "transfer",
]
