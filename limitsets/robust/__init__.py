"""How far a scene may drift, and what chance does to it: margins of goals, and noise by the transfer operator.

A margin is a bracket of deviations: up to its lower end the goal is proved, at its upper end an orbit refutes it.
Noise that has a distribution instead of bounds is a Markov chain between cells (generalised cell mapping); what it says
is computed, never proved, and every answer says so.
"""

from __future__ import annotations

from limitsets.robust.margins.finding import Margin as Margin
from limitsets.robust.margins.finding import margin as margin
from limitsets.robust.noise.absorbing import absorption as absorption
from limitsets.robust.noise.laws import Gaussian as Gaussian
from limitsets.robust.noise.laws import Given as Given
from limitsets.robust.noise.laws import Samples as Samples
from limitsets.robust.noise.laws import Uniform as Uniform
from limitsets.robust.noise.scattering import Scattering as Scattering
from limitsets.robust.noise.settling import classes as classes
from limitsets.robust.noise.statistics import NoiseStatistics as NoiseStatistics
from limitsets.robust.noise.statistics import noise_levels as noise_levels
from limitsets.robust.noise.statistics import noise_statistics as noise_statistics
from limitsets.robust.noise.ulam import transfer as transfer
