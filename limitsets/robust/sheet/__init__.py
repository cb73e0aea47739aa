"""The tolerance sheet of a scene: all its margins, the joint one, margins against X and noise, kept as they are found.

`gathering` asks, `keeping` goes on with what an earlier run found, `entries` and `summary` hold the answers; `chance`
and `against_x` are the questions about noise and about X.
"""
