"""A scene with a tray is proved and rechecked as the same scene without one: nothing of the tray is read there."""

import pytest

import limitsets as ls
from tests.trays.scenes import with_tray


@pytest.mark.sweep  # compiles a cover and starts the checker
def test_a_scene_with_a_tray_has_certificates(tmp_path):
    proof = ls.certify(with_tray(), ["attracts-all"])
    assert [claim.verdict for claim in proof.claims] == ["proved"]
    found = ls.recheck(proof.save(tmp_path / "tray.proof.zip", recheck=False))
    assert found.verdict == "proved"
