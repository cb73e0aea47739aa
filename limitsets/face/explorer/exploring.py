"""`limitsets.explore`: a scene or a map as a page that sliders move.  Panel is imported when a page is asked for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from limitsets.base import AnswerError, LimitsetsError, arguments_checked
from limitsets.feeder.scene import load

if TYPE_CHECKING:
    from limitsets.face.explorer.visits import Explorer


def required() -> None:
    """Refuse to go on without the libraries of the extra.

    Raises
    ------
    LimitsetsError
        Panel or Bokeh is missing; with the command that installs them.
    """
    for library in ("bokeh", "panel"):
        try:
            __import__(library)
        except ImportError:
            raise LimitsetsError(
                f"the library {library}", "missing", "the extra explore", "pip install 'limitsets[explore]'"
            ) from None


@arguments_checked
def explore(
    scene: Any = "paper-designed", *, domain: Any = None, atlas: str | Path | None = None
) -> Explorer:
    """Open a scene, or a map, as a page: sliders move it, and limit sets, basins and the goal's threshold follow.

    What follows a slider is an estimate; proofs and margins are computed once it rests.

    Parameters
    ----------
    scene : Scene, str, Path, mapping, or a map's parameters
        A scene, what `limitsets.load` reads, or the parameters of a registered map of one to three dimensions.
    domain : Domain or array_like, optional
        Of a map: a pair (lo, hi) for each coordinate; textbook maps have one of their own.
    atlas : str or Path, optional
        The store of an atlas of two quantities of the scene (`limitsets.atlas`), for its picture.

    Returns
    -------
    Explorer
        A Panel viewable: a notebook shows it, ``.servable()`` and ``.show()`` serve it, and every visitor has a page
        of his own.

    Raises
    ------
    LimitsetsError
        The extra `explore` is not installed, or an atlas of something else.
    SceneError
        For a scene that cannot be read, or has too many sides.
    AnswerError
        For a map without a domain.

    Examples
    --------
    >>> import limitsets as ls
    >>> page = ls.explore("paper-designed").page()
    >>> page.sliders.put({"throw.speed": 150.0})
    >>> page.beat()
    >>> round(page.scene.kappa, 3)
    28.166
    >>> page.close()
    """
    required()
    from limitsets.face.explorer.visits import Explorer

    if isinstance(scene, tuple | type):
        return Explorer.of_map(scene, domain)
    if domain is not None:
        raise AnswerError("the domain", "given", "none beside a scene", "a scene has one: leave it out")
    return Explorer.of_scene(load(scene), None if atlas is None else Path(atlas))
