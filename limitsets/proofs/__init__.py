"""Proofs about a scene's map, certificates of them, and their recheck."""

from limitsets.proofs.certify import CLAIMS, certify
from limitsets.proofs.proof import Claim, Proof

__all__ = ["CLAIMS", "Claim", "Proof", "certify"]
