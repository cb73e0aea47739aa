"""Proofs of one's own maps, saved and rechecked: what stands in the file, and what the checker finds by itself."""

import json
import math
import zipfile

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.proofs.prover import certificate_of_map
from limitsets.proofs.prover.certificate import DeniedError, written
from limitsets.proofs.prover.certificate_of_map import frames_to_try
from tests.maps_of_tests import henon, logistic, ricker, rivals, spiral, turned, two_lines


def bent_spiral():
    return ls.map(spiral, c=0.4, s=0.4, bend=0.1)


def gap():
    return two_lines(1.4, 0.9, -1.0)


# By name: the map, its grid, the upper corner's values, the claims, and an orbit: its period and one of its points.
TWO = 0.5 * (3.2 + 1 - math.sqrt((3.2 - 3) * (3.2 + 1))) / 3.2
CASES = {
    # 1.4 (1.4 x + 0.9) - 1 = x
    "gap": (gap, [(-1.3, 1.2)], 1000, {}, "trapping attracts-all expanding cycles", (2, -0.26 / 0.96)),
    "logistic": (lambda: ls.map(logistic, r=3.2), [(0.4, 0.9)], 512, {}, "invariant cycles", (2, TWO)),
    "range": (lambda: ls.map(ricker, r=2.3), [(0.02, 2.6)], 1000, {"r": 2.35}, "trapping basin", None),
    # a jump of floor has an image, and no slope
    "jump": (lambda: ls.map(turned, omega=0.05, k=0.9), [(0.0, 1.0)], 256, {}, "trapping basin", None),
    "spiral": (bent_spiral, [(-1, 1), (-1, 1)], 64, {}, "trapping basin cycles", (1, 0.0)),
    "leslie": (ls.maps.Leslie, [(-0.001, 90), (-0.001, 70)], 64, {}, "trapping basin", None),
    "textbook": (lambda: ls.maps.Logistic(2.5), [(0.1, 0.9)], 512, {}, "attracts-all", None),
}


def certified(name, folder):
    make, box, cells, upper, claims, orbit = CASES[name]
    lower = make()
    corner = lower.with_values(**upper) if upper else None
    proof = ls.certify(lower, ls.grid(box, cells=cells), claims.split(), upper=corner)
    assert proof.proved
    return proof, proof.save(folder / f"{name}.proof.zip"), orbit


def header_of(file):
    with zipfile.ZipFile(file) as packed:
        return json.loads(packed.read("header.json"))


def test_cells_on_a_face_that_stays_are_invariant_and_not_trapping(tmp_path):
    """Each of two rivals alone is at 2 and attracts, on an axis, which is mapped into itself: no image is off it."""
    proof = ls.certify(ls.map(rivals), ls.grid([(0.0, 3.0)] * 2, cells=64), ["trapping", "invariant"])
    assert [claim.verdict for claim in proof.claims] == ["undecided", "proved"]
    assert "may reach the border of the domain" in proof.claims[0].reason
    proof.save(tmp_path / "rivals.proof.zip")


@pytest.mark.parametrize("name", CASES)
def test_what_is_proved_is_saved_and_rechecked(name, tmp_path):
    proof, file, orbit = certified(name, tmp_path)
    report = ls.recheck(file)
    assert {claim for claim, *_ in report.claims} == set(CASES[name][4].split())
    assert report.map["formulas"] == ls.formulas(proof.map).lines
    header = header_of(file)
    assert (header["version"], header["goal"], header["map"]["dimension"]) == (3, None, len(CASES[name][1]))
    if orbit is not None:
        period, point = orbit
        claims = {each["claim"]: each["section"] for each in header["boxes"][0]["claims"]}
        listed = [each for each in claims["cycles"]["cycles"] if len(each["boxes"]) == period]
        ends = [[float.fromhex(end) for end in box[0]] for each in listed for box in each["boxes"]]
        assert any(lo < point < hi and hi - lo < 1e-6 for lo, hi in ends)
        assert listed[0]["attracts"] is (name != "gap")  # 1.4^2 > 1
        assert listed[0].get("unstable", False) is (name == "gap")


KINDS = {
    # the 2-cycle has lost its stability at 1 + sqrt(6) = 3.449, the 4-cycle that has come from it not yet
    "logistic": (ls.map(logistic, r=3.5), [(0.1, 0.9)], "1 unstable 2 unstable 4 attracting"),
    # saddles
    "henon": (
        ls.map(henon, a=1.4, b=0.3),
        [(-1.5, 1.5), (-0.5, 0.5)],
        "1 unstable 1 unstable 2 unstable 4 unstable",
    ),
}


@pytest.mark.parametrize("name", KINDS)
def test_the_kind_of_every_orbit_is_said_in_print_and_in_the_file(name, tmp_path):
    the_map, box, kinds = KINDS[name]
    proof = ls.certify(the_map, ls.grid(box, cells=64), ["all-cycles"], period=4)
    (orbits,) = (table for table in proof.tables() if table.caption == "Periodic orbits")
    assert " ".join(f"{row[0]} {row[-1]}" for row in orbits.rows) == kinds
    said = ls.recheck(proof.save(tmp_path / "orbits.proof.zip", recheck=False)).statement[0]
    assert [each.split()[-1] for each in said.split(";")] == kinds.split()[1::2]


def test_a_range_of_parameters_stands_in_the_file_as_it_was_written(tmp_path):
    _, file, _ = certified("range", tmp_path)
    assert header_of(file)["boxes"][0]["parameters"] == {"r": ["2.3", "2.35"]}
    assert "r in [2.3, 2.35]" in "\n".join(ls.recheck(file).map["boxes"][0]["parameters"])


def test_orbits_that_pass_through_recurrent_cells_have_no_rank_and_no_certificate(tmp_path):
    proof = ls.certify(bent_spiral(), ls.grid([(-1, 1), (-1, 1)], cells=64), ["attracts-all"])
    assert proof.proved
    with pytest.raises(AnswerError, match=r"pass through cells that recur.*finer cells"):
        proof.save(tmp_path / "spiral.proof.zip")


def test_only_what_is_proved_is_claimed(tmp_path):
    coarse = ls.certify(ls.map(logistic, r=3.2), ls.grid([(0.4, 0.9)], cells=64), ["trapping", "expanding"])
    assert [each.verdict for each in coarse.claims] == ["proved", "undecided"]
    report = ls.recheck(coarse.save(tmp_path / "coarse.proof.zip", recheck=False))
    assert [claim for claim, *_ in report.claims] == ["trapping"]
    nothing = ls.certify(ls.map(logistic, r=3.2), ls.grid([(0.4, 0.9)], cells=64), ["expanding"])
    with pytest.raises(AnswerError, match="without a proved claim"):
        nothing.save(tmp_path / "nothing.proof.zip")


def test_a_certificate_of_other_formulas_is_denied_and_kept(tmp_path, monkeypatch):
    proof = ls.certify(ls.map(logistic, r=3.2), ls.grid([(0.4, 0.9)], cells=256), ["trapping"])
    table = certificate_of_map.recorded_map(ls.map(logistic, r=3.2), 1)
    one = next(op for op in table["programs"][0]["ops"] if op[0] == "c")
    one[1] = "1.05"
    monkeypatch.setattr(certificate_of_map, "recorded_map", lambda *_: table)
    with pytest.raises(AnswerError, match="as it is compiled"):  # the comparison after recording
        proof.save(tmp_path / "logistic.proof.zip")
    monkeypatch.setattr(certificate_of_map, "require_same", lambda *_: None)
    with pytest.raises(DeniedError, match="trapping"):
        proof.save(tmp_path / "logistic.proof.zip")
    assert [each.name for each in tmp_path.iterdir()] == ["logistic.denied.zip"]


def test_cells_of_which_nothing_is_claimed_have_no_rank():
    lower, grid = ls.map(logistic, r=3.2), ls.grid([(-0.1, 0.9)], cells=500)
    arrays = certificate_of_map.cells_of(certificate_of_map.targets_of(lower, lower, grid), grid)
    middle = np.linspace(-0.1, 0.9, 501)[:-1] + 0.001
    rank, component = arrays["rank"], arrays["component"]
    assert (rank[middle < -0.01] == -1).all()  # they leave
    near = np.abs(middle - 0.6875) < 0.002  # the unstable fixed point
    assert (rank[near] == -1).all()
    assert (rank[middle > 0.1] >= 0).mean() > 0.95
    assert (rank[component >= 0] == 0).all()
    first, last = arrays["target.0"][rank > 0].T
    highest = np.array([rank[a : b + 1].max() for a, b in zip(first, last, strict=True)])
    assert (highest < rank[rank > 0]).all()


ENDS, STARTS = [[(0.35, 1.65)]], [[(0.02, 2.6)]]


HALVES, NOT_ALL = [[(0.35, 0.9)], [(1.1, 1.65)]], "starts whose orbits are not proved to end"
WHERE = [
    ({"ends": ENDS, "starts": STARTS}, ""),
    ({"ends": ENDS}, ""),
    ({"ends": (0.35, 1.65), "starts": {0: [(0.5, 2.0)]}}, ""),
    ({"ends": HALVES}, ""),
    (
        {"ends": HALVES, "starts": STARTS},
        NOT_ALL,
    ),  # the unstable fixed point 1 is one, and does not end there
    ({"ends": [[(0.8, 1.65)]]}, "no cells in the ends are proved to stay there"),
]


@pytest.mark.parametrize(("how", "reason"), WHERE)
def test_where_starts_end(how, reason, tmp_path):
    """Orbits of Ricker's map end in [0.35, 1.65] for every r in [2.3, 2.35]: its 2-cycle lies in [0.37, 1.63]."""
    lower = ls.map(ricker, r=2.3)
    proof = ls.certify(lower, ls.grid([(0.02, 2.6)], cells=1000), upper=lower.with_values(r=2.35), **how)
    assert [each.claim for each in proof.claims] == ["ends-in"]
    assert proof.claims[0].reason.startswith(reason)
    assert proof.proved is (not reason)
    if not reason:
        proof.save(tmp_path / "ricker.proof.zip")


@pytest.mark.parametrize(
    ("claims", "how", "words"),
    [
        (["ends-in"], {}, "the claims is 'ends-in'"),
        (["trapping"], {"ends": ENDS}, "ends-in by itself"),
        (None, {"ends": [[(1.0, 0.5)]]}, "the argument ends of certify"),
        (None, {"ends": [[(0.0, 1.0), (0.0, 1.0)]]}, "boxes of 1 pairs"),
        (None, {"ends": {1: ENDS}}, "on side 1"),
        (None, {"ends": "all"}, "the argument ends of certify is 'all"),
        (None, {"ends": ENDS, "starts": [[(0.0, 3.0)]]}, "boxes in the domain of the grid"),
    ],
)
def test_boxes_that_cannot_be(claims, how, words):
    with pytest.raises(AnswerError) as error:
        ls.certify(ls.map(ricker, r=2.3), ls.grid([(0.02, 2.6)], cells=100), claims, **how)
    assert words in str(error.value)


@pytest.mark.parametrize(
    "slopes",
    [
        [[[0.5, -0.7], [0.7, 0.5]]],  # a spiral
        [[[0.9, 5.0], [0.0, 0.9]]],  # eigenvectors that are parallel
        [[[0.0, 1.0], [0.0, 0.0]], [[0.3, 0.0], [0.4, 0.2]]],  # a step that loses a direction
        [[[0.0, 0.0], [0.0, 0.0]]],
        [[[0.2]], [[-3.0]]],
    ],
)
def test_every_step_contracts_in_the_frames_of_an_attracting_orbit(slopes):
    slopes = np.array(slopes)
    chosen = frames_to_try(slopes)[0]
    size = 1.0
    for k, slope in enumerate(slopes):
        after = chosen[(k + 1) % len(slopes)]
        size *= np.linalg.norm(np.linalg.solve(after, slope @ chosen[k]), 2)
    assert size < 1.0


def test_a_text_that_no_checker_reads_is_not_written(tmp_path):
    with pytest.raises(AnswerError, match=r"is '5\.0 MB'; allowed: at most 4 MB"):
        written(tmp_path / "long.proof.zip", {"boxes": ["x" * 2**20] * 5}, {}, {}, recheck=False, workers=1)
    assert not list(tmp_path.iterdir())
