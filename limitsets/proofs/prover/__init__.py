"""Proofs about a scene's map, certificates of them, and their recheck."""

from limitsets.proofs.prover.certifying import CLAIMS, certify
from limitsets.proofs.prover.proof import Claim, Proof

__all__ = ["CLAIMS", "Claim", "Proof", "certify"]
