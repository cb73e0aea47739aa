"""The tolerance sheet of a scene: all margins, the joint margin, the margin curve and noise, written as they come.

`sheet_run` runs the parts; `summary` holds the whole answer, reads the noise and computes the margin curve.
"""
