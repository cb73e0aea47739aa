"""One bit of feedback: games on cells, policies as tables, and how they do when they are thrown.

`game` knows nothing of throws: it takes the image of each cell under each action.  `synthesis` is the throw-and-catch
feeder with the table ``[feedback]``; its images enclose those of every point and every noise ("boxes").
"""

from limitsets.proofs.policies.chances import PolicyChances, policy_chances
from limitsets.proofs.policies.game import Game, game_of, image_of
from limitsets.proofs.policies.policy import Found, Policy, broken, search
from limitsets.proofs.policies.synthesis import Synthesis, feedback, places

__all__ = [
    "Found",
    "Game",
    "Policy",
    "PolicyChances",
    "Synthesis",
    "broken",
    "feedback",
    "game_of",
    "image_of",
    "places",
    "policy_chances",
    "search",
]
