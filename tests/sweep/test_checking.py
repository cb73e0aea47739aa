"""Checks in the run: which points are checked, that agreement is found, and that a wrong record is not."""

import numpy as np
import pytest

import limitsets as ls
from limitsets.parameters.atlas import of_topology as checking
from limitsets.parameters.atlas.plan import Block
from limitsets.parameters.atlas.subjects import SceneSubject
from limitsets.systems.topology import topologies


@pytest.fixture(scope="module")
def block():
    scene = ls.load("paper-designed")
    speeds = np.deg2rad(np.linspace(155.0, 160.0, 6))
    values = {"throw.speed": speeds, "arm.surface_height": np.full(6, -0.2)}
    subject = SceneSubject(scene)
    return Block(subject.points(values), np.arange(6), 0, frozenset({"checked"}), subject, values)


@pytest.fixture
def every(monkeypatch):
    monkeypatch.setattr(checking, "SAMPLED", 1)
    monkeypatch.setattr(checking, "PROVED_OF", 1)


def told(block):
    points = block.points
    return topologies(points.params, points.lo, points.hi, points.anchor)


def test_fine_cells_and_proofs_agree(block, every):
    found = checking.checks(block, told(block))
    assert set(found.tolist()) <= {checking.AGREES, checking.PROVED}
    assert (found == checking.PROVED).sum() >= 4  # of some, next to the margin, neither is proved


def test_a_wrong_field_is_found(block, every):
    wrong = told(block)
    wrong.jogs_max[2, 0, 2] += 1
    wrong.reach[3, 0, 0] += 1e-5
    found = checking.checks(block, wrong)
    assert np.flatnonzero(found == checking.DIFFERS).tolist() == [2, 3]


def test_a_threshold_that_a_proof_denies_is_found(block, every, monkeypatch):
    record = told(block)
    record.reach[:, 0, 0] = 21.0  # the goal would fail: nothing may lie there beyond x = 20
    monkeypatch.setattr(checking, "_same", lambda one, other, scale: np.ones(6, bool))
    found = checking.checks(block, record)
    assert (found == checking.CONTRADICTED).sum() >= 4


def test_about_one_point_of_a_thousand_is_checked_whatever_the_chunks(block):
    numbers = np.arange(200_000, dtype=np.uint64)
    mixed = (numbers * checking.SCATTERED) % np.uint64(2**32)
    assert (mixed % np.uint64(checking.SAMPLED) == 0).sum() == pytest.approx(200, rel=0.3)
