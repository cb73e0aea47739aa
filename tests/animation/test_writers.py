"""Files: what a page holds, frames and delays of a GIF; the page needs nothing from elsewhere."""

import json
import re

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.face.animation import animating, film_of
from limitsets.face.animation.picture import Picture
from limitsets.face.animation.writers import frames
from tests.browsers import Page
from tests.test_lines import LATE, run_python

SHORT = {"start": (21.0, 2), "throws": 1, "slow": 1.0, "fps": 20.0}


def test_a_page_holds_the_poses_and_nothing_from_elsewhere(tmp_path):
    file = ls.animate("paper-designed", tmp_path / "run.html", **SHORT)
    text, film = file.read_text(encoding="utf-8"), film_of("paper-designed", **SHORT)
    page = Page(text)
    assert not re.search(r"https?:|//[a-z]|@import|url\(", text)
    assert not [attrs for _, attrs in page.tags if {"src", "href", "xlink:href"} & attrs.keys()]
    data = json.loads("".join(text for _, name, text in page.texts if name == "film"))
    assert np.array(data["poses"]) == pytest.approx(film.poses, abs=1e-5)
    assert np.array(data["arm"]) == pytest.approx(film.arm, abs=1e-6)
    assert data["captions"] == list(film.captions)
    assert len(data["times"]) == film.frames
    assert file.stat().st_size < 100_000
    # the still part and the first frame are there without a script
    drawn = " ".join(f"{x:.2f},{y:.2f}" for x, y in Picture.of(film).at(film.polygon(0)))
    assert f'points="{drawn}"' in text
    # it speaks to those who do not see it
    attributes = {attrs["id"]: attrs for _, attrs in page.tags if "id" in attrs}
    (picture,) = [attrs for tag, attrs in page.tags if tag == "svg"]
    assert picture["role"] == "img"
    assert all(name in attributes for name in picture["aria-labelledby"].split())
    assert attributes["frame"]["aria-label"] == "Frame"
    assert attributes["said"]["aria-live"] == "polite"
    said = [text for tag, _, text in page.texts if tag == "button"]
    assert any("flip from 21.00 in, side 2, to 16.55, side 0" in text for text in said)


def test_a_gif_has_the_frames_and_their_delays(tmp_path):
    from PIL import Image

    film = film_of("paper-designed", **SHORT)
    with Image.open(ls.animate("paper-designed", tmp_path / "run.gif", **SHORT)) as image:
        assert image.info["loop"] == 0
        delays = []
        for k in range(image.n_frames):
            image.seek(k)
            delays.append(image.info["duration"])
        assert image.size == tuple(2 * round(0.45 * each) for each in Picture.of(film).size)
    # frames that are alike are stored as one, shown as long
    assert sum(delays) == 50 * film.frames
    assert film.frames - 5 <= len(delays) <= film.frames


def test_pixels_show_the_part_where_it_is():
    """Its colour is at its centre of mass, aside from the sign there, and nowhere under the arm; edges have a line."""
    film = film_of("paper-designed", **SHORT)
    picture, face, edge = Picture.of(film), np.array([0xCF, 0xE3, 0xF2]), (0x00, 0x72, 0xB2)
    for k, pixels in enumerate(frames(picture)):
        if k % 9 == 0:
            centre, corners = picture.at(film.poses[k, 0, :2]), picture.at(film.polygon(k))
            beside = centre + 0.25 * (corners.mean(axis=0) - centre) + (0.0, -9.0)
            x, y = np.round(beside).astype(int)
            above = pixels[: int(picture.bottom)].astype(int)
            found = np.argwhere((np.abs(above - face) < 6).all(axis=2))
            assert (np.abs(found - (y, x)).sum(axis=1) <= 12).any()
            assert found[:, 1].min() >= corners[:, 0].min() - 3
            assert found[:, 1].max() <= corners[:, 0].max() + 3
            assert found[:, 0].max() <= corners[:, 1].max() + 3
            for x, y in (0.5 * (corners + np.roll(corners, 1, axis=0))).astype(int):
                # the line is two pixels wide: it covers two thirds of this one at least
                assert (np.abs(pixels[y, x].astype(int) - edge) < 70).all()


def test_a_film_that_is_not_finished_leaves_the_old_file(tmp_path):
    file = tmp_path / "run.gif"
    file.write_bytes(b"old")

    def stop(stage, done, _):
        if stage == "frames" and done > 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ls.animate("paper-designed", file, progress=stop, **SHORT)
    assert file.read_bytes() == b"old"
    assert [each.name for each in tmp_path.iterdir()] == ["run.gif"]


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(AnswerError, match="the film's file"):
        ls.animate("paper-designed", tmp_path / "taken" / "run.html", **SHORT)


def test_importing_limitsets_loads_none_of_it():
    loaded = run_python("import sys, limitsets; print(*sys.modules)").split()
    assert not [name for name in loaded if name.startswith(("limitsets.animation", "PIL"))]
    loaded = run_python("import sys, limitsets as ls; ls.animate; print(*sys.modules)").split()
    assert not {*LATE, "PIL"} & set(loaded) - {"numba", "scipy", "networkx"}


def test_every_kind_and_writer_of_the_tables_is_there():
    for where in (*animating.KINDS.values(), *animating.SUFFIXES.values()):
        assert callable(animating._found(where))
