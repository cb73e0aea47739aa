"""The machine: the part, the arm, the throw and its effects, a scene in words, and a rigid-body engine beside it."""
