"""Margins: how far a quantity, or a tolerance, may deviate before a goal fails, here or at other X, proved and refuted.

`deviations` measures one quantity or several at once.  `estimate` proposes by floats; `brackets` and `joint` search,
with `limitsets.proofs.prover.query` to prove and refute.  `single` is where a call begins, for one X or several, and
`margin_result` what the call gives.
"""
