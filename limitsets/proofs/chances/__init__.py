"""Probabilities with proof: brackets of a noisy chain's absorption, and of its long-run averages.

Functions that are affine on cells are kept on both sides of the true ones.  What one throw makes of such a function is
proved by the checker's own code (`limitsets/checker/steps.py`), here and when a certificate is rechecked.  `nodes` and
`chain` make the cells and the certificate; `absorption` bounds probabilities of ending at places, `forever` those after
any number of throws, `long_run` averages over ever more throws.
"""
