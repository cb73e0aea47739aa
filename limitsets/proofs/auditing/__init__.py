"""The audit: which assumptions of the minimal model a scene breaks, and which effects it calls for.

`assumptions.py` is the table: for every assumption the effect that would lift it, the number that decides, and the
fact of the world that it needs.  `judging.py` lists the states at which the numbers are evaluated (the cells that hold
the limit set, a long orbit on it, and the whole domain) and decides there.  `findings.py` collects the decisions.
"""

from limitsets.proofs.auditing.assumptions import ASSUMPTIONS, Assumption
from limitsets.proofs.auditing.findings import Audit, EffectChoice, Finding, audit, audited, choose_effects
from limitsets.proofs.auditing.judging import where

__all__ = [
    "ASSUMPTIONS",
    "Assumption",
    "Audit",
    "EffectChoice",
    "Finding",
    "audit",
    "audited",
    "choose_effects",
    "where",
]
