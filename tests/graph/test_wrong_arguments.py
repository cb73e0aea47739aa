"""What a beginner passes in place of a map, a domain, a grid and a graph: the error says what to pass."""

import pytest

import limitsets as ls
from limitsets.errors import AnswerError, GridError, MapError

SCENE = ls.load("paper-designed")


@pytest.mark.parametrize(
    ("asked", "error", "said"),
    [
        (lambda: ls.grid(SCENE), GridError, "the domain is 'Scene'.*pass its .domain"),
        (lambda: ls.transitions(SCENE, ls.grid(SCENE.domain)), MapError, "the map is 'Scene'.*pass its .map"),
        (
            lambda: ls.transitions(SCENE.map, SCENE.domain),
            AnswerError,
            "the grid is 'Domain'.*pass limitsets.grid",
        ),
        (lambda: ls.attractors(SCENE), AnswerError, "the graph is 'Scene'.*pass limitsets.transitions"),
    ],
    ids=["domain", "map", "grid", "graph"],
)
def test_a_scene_in_the_wrong_place_is_told_what_goes_there(asked, error, said):
    with pytest.raises(error, match=said):
        asked()
