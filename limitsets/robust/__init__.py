"""How far a scene may drift, and what chance does to it: margins of goals, and noise by the transfer operator.

A margin is a bracket of deviations: up to its lower end the goal is proved, at its upper end an orbit refutes it.
Noise that has a distribution instead of bounds is a Markov chain between cells (generalised cell mapping); it is
sampled knowledge, never a proof, and every answer says so.
"""

from __future__ import annotations

from limitsets.robust.absorbing import absorption as absorption
from limitsets.robust.laws import Gaussian as Gaussian
from limitsets.robust.laws import Given as Given
from limitsets.robust.laws import Samples as Samples
from limitsets.robust.laws import Uniform as Uniform
from limitsets.robust.scattering import Scattering as Scattering
from limitsets.robust.settling import classes as classes
from limitsets.robust.statistics import NoiseStatistics as NoiseStatistics
from limitsets.robust.statistics import noise_levels as noise_levels
from limitsets.robust.statistics import noise_statistics as noise_statistics
from limitsets.robust.ulam import transfer as transfer
