"""Assembly: two parts on one arm, one of which is to lie in the cavity and the other on top of it.

`pairing` joins two scenes; `drawing` draws what a trial needs, by its number; `outlines` asks whether parts overlap;
`passing` throws parts that pass through each other, as the paper assumes, `pushing` parts in contact, in the engine.
`counting` counts finished trials; `assembly_run` joins all (`limitsets.assemble`).
"""

from limitsets.cell.assembly.assembly_run import Assembly as Assembly
from limitsets.cell.assembly.assembly_run import assemble as assemble
