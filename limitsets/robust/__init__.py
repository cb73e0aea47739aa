"""Robustness: margins of goals under deviations, and random noise by the transfer operator.

A margin is a bracket of deviations: up to its lower end the goal is proved, at its upper end an orbit refutes it.
Noise with a probability law is a Markov chain on cells (generalised cell mapping); its answers are numerical
approximations, never proofs, and say so.
"""

from __future__ import annotations

from limitsets.robust.brackets.absorption import absorption_brackets as absorption_brackets
from limitsets.robust.brackets.result import AbsorptionBrackets as AbsorptionBrackets
from limitsets.robust.margins.finding import margin as margin
from limitsets.robust.margins.margin_result import Margin as Margin
from limitsets.robust.noise.absorbing import absorption as absorption
from limitsets.robust.noise.communicating_classes import classes as classes
from limitsets.robust.noise.laws import Gaussian as Gaussian
from limitsets.robust.noise.laws import Given as Given
from limitsets.robust.noise.laws import Samples as Samples
from limitsets.robust.noise.laws import Uniform as Uniform
from limitsets.robust.noise.scattering import Scattering as Scattering
from limitsets.robust.noise.statistics import NoiseStatistics as NoiseStatistics
from limitsets.robust.noise.statistics import noise_levels as noise_levels
from limitsets.robust.noise.statistics import noise_statistics as noise_statistics
from limitsets.robust.noise.ulam import transfer as transfer
