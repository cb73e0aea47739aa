"""Random noise: the transfer operator of a map with random throws, and its statistics (generalised cell mapping).

`laws` and `scattering` define the noise; `cutting`, `casting`, `sheets`, `staging` and `ulam` build the operator;
`settling`, `absorbing`, `arrivals` and `solving` evaluate it; `statistics` combines the answers of a scene; `sampling`
checks them by throws.
"""
