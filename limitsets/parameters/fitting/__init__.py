"""The model fitted to a machine: from filmed throws to a scene, its uncertainty, and whether that is good enough.

    found = limitsets.fit("paper-designed", "throws.csv", error="0.5 mm")

`throws` reads the film, `rows` says what each throw was, `likelihood` how likely it all is; `starting`, `searching` and
`maximising` find the most likely machine and how far it may be from the true one; `misfit` tests the model itself;
`further` says what to film next, `enough` whether the goal's margin is larger than what was found.
"""

from limitsets.parameters.fitting.fit_result import Enough, Fit, Fitted, Scatter, enough
from limitsets.parameters.fitting.fitting_run import Bootstrap, bootstrap, fit, simulated_throws
from limitsets.parameters.fitting.throws import Throws, read_throws

__all__ = [
    "Bootstrap",
    "Enough",
    "Fit",
    "Fitted",
    "Scatter",
    "Throws",
    "bootstrap",
    "enough",
    "fit",
    "read_throws",
    "simulated_throws",
]
