"""Random noise: the transfer operator of a map whose throws scatter, and what it says (generalised cell mapping).

`laws` and `scattering` say what scatters; `cutting`, `casting`, `sheets`, `staging` and `ulam` build the operator;
`settling`, `absorbing`, `arrivals` and `solving` ask it; `statistics` puts the answers of a scene together; `sampling`
throws, to check.
"""
