"""Probabilities with proof: brackets of a noisy chain's absorption, by functions affine on cells.

With (K V)(x) the mean of V after one throw from x, two functions that are continuous and affine on each cell are kept
on both sides of the true one, V- <= v <= V+, and (K V+)(x) <= V+_new(x) is proved for every place x of every cell, as
is the reverse.  `averages` holds the cells of these functions and makes that step.  `landings` encloses where throws
land and flip.  `deficits` holds the laws of the noise and bounds how far a mean lies above its chord; `throws` builds
the average over the speed.  `chain` joins the averages of one throw and writes the certificate.  `absorption` bounds
the probabilities.
"""
