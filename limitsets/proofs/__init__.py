"""Proofs by interval arithmetic: of claims about a map or a scene, of chances, of policies, and of the assumptions."""
