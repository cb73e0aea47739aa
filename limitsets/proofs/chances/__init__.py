"""Probabilities with proof: brackets of a noisy chain's absorption, by functions affine on cells.

With (K V)(x) the mean of V after one throw from x, two functions that are continuous and affine on each cell are kept
on both sides of the true one, V- <= v <= V+, and (K V+)(x) <= V+_new(x) is proved for every place x of every cell, as
is the reverse.  `averages` is that step, `spans` what it needs of a function; `nodes` are the
cells, `densities` the laws, `landings` where throws land, `decisions` where they flip, `throws` and
`scatter_of_landing` build the two averages of a throw; `absorption` asks, `result` answers, `writing` makes the
certificate.
"""
