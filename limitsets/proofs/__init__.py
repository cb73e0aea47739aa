"""Proofs about a scene's map, certificates of them, and their recheck."""

from limitsets.proofs.certify import CLAIMS, Claim, Proof, certify

__all__ = ["CLAIMS", "Claim", "Proof", "certify"]
