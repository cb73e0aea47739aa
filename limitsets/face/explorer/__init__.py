"""The explorer: a page in the browser where sliders move a scene, or a map, and the picture follows.

The computing files (`estimates`, `work`) know nothing of the page; the page (`page`, `pictures`) only shows their
answers, and its own scripts (`canvas`) draw them in the browser.  While a slider moves, the page shows estimates.
Proofs and margins are computed once the slider rests, in a separate process (`Background` in `atlas_page`), so that
neither the page nor another visitor waits for them.
"""

from limitsets.face.explorer.exploring import explore

__all__ = ["explore"]
