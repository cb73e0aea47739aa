"""The explorer: a page in the browser where sliders move a scene, or a map, and the picture follows.

What is computed (`knobs`, `estimates`, `outside`, `work`) knows nothing of the page; the page (`page`, `pictures`) only
shows it, and scripts of its own (`canvas`) draw it in the browser.  What follows a slider is an estimate.  Proofs and
margins are computed once the slider rests, by a process of their own (`background`), so that neither the page nor
another visitor waits for them.
"""

from limitsets.face.explorer.visits import explore

__all__ = ["explore"]
