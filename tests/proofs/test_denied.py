"""Certificates that were right and that the checker denied, or took minutes for, found by a search over random scenes."""

import json

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

import limitsets as ls
from limitsets.errors import AnswerError
from limitsets.proofs.certificate import write
from limitsets.proofs.confirm import DeniedError
from tests.cli.running import run


def test_a_constant_slope_is_seen_at_once(tmp_path):
    """Small angles, with lengths to 0.4 %: dR'/dR = 1 + 2|h|/kappa was enclosed by 16 383 boxes a cell."""
    tree = ls.load("paper-initial-small-angle").as_dict()
    del tree["goal"]
    tolerance = {"part.sides[2]": "0.02387 in", "part.mass.center.along": "0.02387 in"}
    proof = ls.certify(ls.load(tree), ["invariant", "expanding"], tolerance=tolerance)
    assert proof.proved
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False))
    assert report.verdict == "proved"
    inside = sum(int((found.component >= 0).sum()) for found in proof.attractions)
    assert report.boxes < 4 * inside
