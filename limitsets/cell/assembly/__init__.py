"""Assembly: two parts on one arm, one of which is to lie in the cavity and the other on top of it.

`pairing` joins two scenes, draws what a trial needs by its number, and asks whether outlines overlap.  `trials` throws
parts that pass through each other, as the paper assumes, or parts in contact, in the engine.  `assembly_run` counts
finished trials (`limitsets.assemble`).
"""

from limitsets.cell.assembly.assembly_run import Assembly as Assembly, assemble as assemble
