"""The tolerance sheet of a scene: all margins, the joint margin, the margin curve and noise, stored as they come.

`sheet_run` runs the parts.  `entries` holds single margins and reads those of an earlier run; `summary` holds the whole
answer, reads the noise and computes the margin curve.
"""
