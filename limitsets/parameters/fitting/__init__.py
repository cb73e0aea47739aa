"""The model fitted to a machine: from filmed throws to a scene, its uncertainty, and whether that is good enough.

    found = limitsets.fit("paper-designed", "throws.csv", error="0.5 mm")

`throws` reads the film.  `likelihood` says what each throw was, how likely the film is, and what to film next.
`searching` finds the most likely machine and how far it may be from the true one.  `misfit` tests the model itself and
looks for a misreading of the film.  `fit_result` says whether the goal's margin is large enough.  `filmed` makes the
file of throws from the table of a tracker: `tracks` reads it, `poses` says where the part is, `rests`
where it lies still.
"""

from limitsets.parameters.fitting.filmed import FilmedThrows, throws_of_film
from limitsets.parameters.fitting.fit_result import Enough, Fit, Fitted, Scatter, enough
from limitsets.parameters.fitting.fitting_run import Bootstrap, bootstrap, fit, simulated_throws
from limitsets.parameters.fitting.throws import Throws, read_throws
from limitsets.parameters.margins.machines import Machines

__all__ = [
    "Bootstrap",
    "Enough",
    "FilmedThrows",
    "Fit",
    "Fitted",
    "Machines",
    "Scatter",
    "Throws",
    "bootstrap",
    "enough",
    "fit",
    "read_throws",
    "simulated_throws",
    "throws_of_film",
]
