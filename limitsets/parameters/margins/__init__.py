"""Margins: how far a quantity, or a whole tolerance, may deviate before a goal fails, proved and refuted.

`deviations` measures one quantity, `vector` several at once.  `sensitivity` and `estimate` propose by floats,
`brackets` and `joint` search, with `limitsets.proofs.prover.query` to prove and refute.  `finding` is where a call
begins,
`answer` what it gives; `beyond` asks for several X.
"""
