"""What the minimal model leaves out: which of it a scene calls for.

`assumptions.py` is the table: for every assumption the effect that would lift it, the number that decides, and the
fact of the world that it takes.  `places.py` says where the numbers are asked for: the cells that hold the limit set, a
long orbit on it, and the whole domain.  `audits.py` puts the two together.
"""

from limitsets.auditing.assumptions import ASSUMPTIONS, Assumption
from limitsets.auditing.audits import Audit, Finding, audit
from limitsets.auditing.choice import Choice, choose
from limitsets.auditing.stretches import where

__all__ = ["ASSUMPTIONS", "Assumption", "Audit", "Choice", "Finding", "audit", "choose", "where"]
