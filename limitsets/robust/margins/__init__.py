"""Margins: how far a quantity, or a whole tolerance, may deviate before a goal fails, proved and refuted.

`deviations` says what deviates, `asking` puts one question, `worst` and `effect` propose, `brackets` and `joint`
search; `finding` is where a call begins, `answer` what it gives; `beyond` asks for several X.
"""
