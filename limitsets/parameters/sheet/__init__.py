"""The tolerance sheet of a scene: all margins, the joint margin, the margin curve and noise, stored as they are found.

`gathering` runs the parts, `keeping` resumes an earlier run, `entries` and `summary` hold the answers; `chance` reads
the noise, `against_x` computes the margin curve.
"""
