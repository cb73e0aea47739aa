"""Assembly: two parts on one arm, one of which is to lie in the cavity and the other on top of it.

`pairing` joins two scenes; `drawing` draws what a trial needs, by its number; `outlines` asks whether the parts overlap;
`passing` throws parts that pass through each other, as the paper assumes, `touching` parts in contact, in the engine.
`trial_file` keeps finished trials; `assembly_run` runs and counts them (`limitsets.assemble`), `searching` looks for a
cavity and a throw with a higher rate.
"""
