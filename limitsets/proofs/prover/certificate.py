"""Writing a certificate: all data that a recheck needs, none that it has to trust; and the recheck from Python.

One zip, stored: `header.json` (claims, the scene as written, hashes) and `arrays.npz`
(per box of parameters: cell borders, target cells per branch, branch, rank, component, brackets of the impact angle).
The format is described in docs/certificates.md.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import zipfile
from collections.abc import Callable, Collection, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, Tabled, arguments_checked, bar, in_notebook, replaced
from limitsets.base.arrays import Array, Arrays
from limitsets.feeder.scene.units import spelled_plainly
from limitsets.feeder.thrower.effects import EFFECTS
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.cover import Cover, targets

if TYPE_CHECKING:
    from limitsets.checker import Report


# ----------------------------------------------------------------
# `limitsets.recheck`: the checker, called from Python; every writer of certificates calls it too.
#
# The checker alone needs python-flint, so it is imported where it is called.


class DeniedError(AnswerError):
    """The checker does not confirm a certificate that was just written.

    Attributes
    ----------
    file : str
        Where it is kept, NAME.denied.zip.
    claims : dict of str to str
        The claims that are not confirmed, and why.
    """

    claims: dict[str, str]

    @classmethod
    def of(cls, file: Path, claims: dict[str, str]) -> DeniedError:
        """Name the first claim that is not confirmed."""
        name, why = next(iter(claims.items()))
        remedy = "report it; the claim is undecided"
        error = cls(
            f"the certificate's claim {name}",
            f"denied: {why}",
            "what the checker confirms",
            remedy,
            file=str(file),
        )
        error.claims = claims
        return error


def require_confirmed(file: Path, kept: Path, verdicts: Mapping[str, str], workers: int | None = 1) -> float:
    """Recheck a certificate before it gets its name; the seconds that it took.

    Parameters
    ----------
    file : Path
        The draft.
    kept : Path
        Where its writer keeps it if it is denied.
    verdicts : mapping of str to str
        What has to become of each claim: "proved", "proved-on-cells" or "refuted".
    workers : int, optional
        As in `recheck`.

    Raises
    ------
    DeniedError
        The checker comes to another verdict.
    """
    report = recheck(file, workers=workers)
    states = {claim: (state, why) for claim, state, why in report.claims}
    denied = {
        claim: why or f"it is {state}, not {verdicts[claim]}"
        for claim, (state, why) in states.items()
        if state != verdicts[claim]
    }
    if report.verdict == "bad file":
        denied = dict.fromkeys(verdicts, report.reason)
    if denied:
        raise DeniedError.of(kept, denied)
    return report.seconds


def require_checker() -> None:
    """Refuse to go on without the checker's arithmetic."""
    if find_spec("flint") is None:
        raise AnswerError(
            "the arithmetic of the checker",
            "not installed",
            "python-flint",
            "pip install python-flint",
        )


@arguments_checked
def recheck(
    path: str | Path, *, workers: int | None = 1, progress: Callable[[int, int], None] | None = None
) -> Report:
    """Check a certificate anew, in other arithmetic and by other code than those that made it.

    Parameters
    ----------
    path : str or Path
        What `Proof.save` wrote, or what a stranger sent: it is data, nothing in it is run.
    workers : int, optional
        Processes to share the work among, None for all processors.  More than one starts the calling script anew in
        each of them, so it needs ``if __name__ == "__main__":``.
    progress : callable, optional
        Called now and then with the number of cells done and of all.

    Returns
    -------
    Report
        Its `verdict` is "proved", "proved-on-cells" (a goal, of the starts in some cells only), "refuted" (an orbit
        that violates the goal is confirmed), "failed" or "bad file"; `reason` says what fails first; `statement`,
        `parameters` and `relied_on` say what was claimed, of which scenes, and what that rests on; `starts` and
        `share`, for which starts the goal is proved and what share of the arm they are.

    Raises
    ------
    AnswerError
        python-flint is not installed.

    Examples
    --------
    >>> import tempfile, limitsets as ls
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = ls.certify("paper-designed").save(Path(folder) / "designed.proof.zip")
    ...     ls.recheck(file).verdict
    'proved'
    """
    require_checker()
    from limitsets.checker import recheck as check

    if progress is None and in_notebook():
        with bar() as tell:
            return check(path, workers, lambda done, of: tell("cells checked", done - 1, of))
    return check(path, workers, progress)


# ----------------------------------------------------------------
# Writing a certificate: all data that a recheck needs, none that it has to trust.


class Saved(Tabled):
    """An answer that can be saved as a certificate: `_write` says what stands in the file."""

    def save(self, path: str | Path, *, recheck: bool = True, workers: int | None = 1) -> Path:
        """Write the certificate of what is proved; it gets its name once `limitsets.recheck` has confirmed it.

        Parameters
        ----------
        path : str or Path
            The file, replaced whole.
        recheck : bool
            Whether to have it checked first.
        workers : int, optional
            Processes that check it, as in `limitsets.recheck`.

        Raises
        ------
        AnswerError
            Nothing is proved, or it is proved of a map that no recheck knows or that cannot be recorded: the line names
            the way out.
        DeniedError
            The checker does not confirm it: it is kept as NAME.denied.zip, and what it denies is undecided.
        """
        self._write(path, recheck=recheck, workers=workers)
        return Path(path)

    def _write(self, path: str | Path, **how: Any) -> None:
        raise NotImplementedError  # each answer has its own


# Letters of a header at most.
MOST_TEXT = 4 << 20

# Brackets of the impact are widened by this share of the angle, so that another arithmetic can confirm them.
SLACK = 2.0**-34


def brackets(cover: Cover) -> Array:
    """Brackets of the impact angle, shape (n_cells, 2), widened by the slack."""
    phi = np.concatenate([images.witness for images in cover.images], axis=1).T
    slack = SLACK * np.abs(phi)
    return np.stack([phi[:, 0] - slack[:, 0], phi[:, 1] + slack[:, 1]], axis=1)


def arrays_of(proof: Attraction, prefix: str) -> Arrays:
    """Arrays of one box of parameters."""
    cover = proof.cover
    jog, flip = targets(cover, 0), targets(cover, 1)
    jogs, flips = jog[:, 0] >= 0, flip[:, 0] >= 0
    arrays: Arrays = {
        "jog": jog,
        "flip": flip,
        "branch": np.where(jogs & flips, 2, np.where(flips, 1, 0)).astype(np.int8),
        "rank": proof.basin.rank,
        "component": proof.component,
        "phi": brackets(cover),
    }
    _say_nothing(arrays, cover)
    for side, (edges,) in enumerate(cover.grid.edges):
        arrays[f"edges.{side}"] = edges
    return {prefix + name: np.ascontiguousarray(value) for name, value in arrays.items()}


def _say_nothing(arrays: Arrays, cover: Cover) -> None:
    """Enter the cells whose images are not proved: their starts land within one turn if at all, at any place."""
    offset, sides = cover.grid.offset, cover.grid.sides
    for side, images in enumerate(cover.images):
        cells, after = offset[side] + np.flatnonzero(images.lost), (side + 1) % sides
        arrays["jog"][cells] = offset[side], offset[side + 1] - 1
        arrays["flip"][cells] = offset[after], offset[after + 1] - 1
        arrays["branch"][cells] = 2
        arrays["phi"][cells] = SLACK, 2.0 * math.pi


def _parameters(cover: Cover) -> dict[str, Any]:
    lo, hi = cover.box.lo, cover.box.hi

    def scalar(name: str) -> list[str]:
        return [float(getattr(lo, name)).hex(), float(getattr(hi, name)).hex()]

    def per_side(name: str) -> list[list[str]]:
        return [
            [float(a).hex(), float(b).hex()]
            for a, b in zip(getattr(lo, name), getattr(hi, name), strict=True)
        ]

    return {
        **{name: per_side(name) for name in ("a", "d", "length")},
        **{name: scalar(name) for name in ("kappa", "surface_height", "arm_length", "radius_of_gyration")},
    }


def in_certificate(scene: Mapping[str, Any], *without: str) -> dict[str, Any]:
    """Write a scene as a certificate has it, less some of its tables: with its model, and of its effects the spread.

    Facts that effects declare stand apart, in `other`: the checker need not know their names.
    """
    text: dict[str, Any] = spelled_plainly(
        {word: table for word, table in scene.items() if word not in ("effects", *without)}
        | {"model": {"flight": "exact", "flip": "signed"} | scene.get("model", {})}
    )
    world, spread = text.get("world", {}), scene.get("effects", {}).get("spread")
    own = {name: world.pop(name) for effect in EFFECTS.values() for name in effect.facts if name in world}
    if own:
        world["other"] = own
    if spread and "effects" not in without:
        text["effects"] = {"spread": spread}
    return text


def write(
    path: str | Path,
    proofs: Sequence[Attraction],
    claims: Sequence[Mapping[str, Any]],
    *,
    noise: Mapping[str, str] | None,
    tolerance: Mapping[str, str] | None,
    arrays: Mapping[str, NDArray[Any]] | None = None,
    recheck: bool = True,
    workers: int | None = 1,
) -> float | None:
    """Write a certificate, replacing an older file whole; it gets its name once the checker has confirmed it.

    Parameters
    ----------
    path : str or Path
        The file.
    proofs : sequence of Attraction
        One per box of parameters.
    claims : sequence of mapping
        ``{"claim": ..., "section": {...}}`` each, and the ``verdict`` where it is not "proved".
    noise, tolerance : mapping or None
        Deviations of the parameters for which the claims are proved.
    arrays : mapping of str to ndarray, optional
        What claims need beside the cells of the first box.
    recheck : bool
        Whether to check it first.
    workers : int, optional
        Processes that check it, None for all processors.

    Returns
    -------
    float or None
        Seconds that the check took.

    Raises
    ------
    DeniedError
        The checker does not confirm it: it is kept as NAME.denied.zip.
    """
    packed: Arrays = {f"0.{name}": array for name, array in (arrays or {}).items()}
    boxes: list[dict[str, Any]] = []
    for number, proof in enumerate(proofs):
        packed |= arrays_of(proof, f"{number}.")
        boxes.append(
            {
                "scene": in_certificate(proof.cover.box.scene),
                "parameters": _parameters(proof.cover),
                "prefix": f"{number}.",
            }
        )
    return pack(
        path,
        boxes[0]["scene"]["model"],
        claims,
        packed,
        boxes=boxes,
        noise=noise,
        tolerance=tolerance,
        recheck=recheck,
        workers=workers,
    )


def _producer() -> dict[str, str]:
    """Name the version of the package, for information; nothing where the sources are not installed."""
    try:
        return {"limitsets": version("limitsets")}
    except PackageNotFoundError:
        return {}


def pack(
    path: str | Path,
    model: Mapping[str, str],
    claims: Sequence[Mapping[str, Any]],
    arrays: Mapping[str, NDArray[Any]],
    *,
    boxes: Sequence[Mapping[str, Any]] = (),
    noise: Mapping[str, str] | None = None,
    tolerance: Mapping[str, str] | None = None,
    recheck: bool = True,
    workers: int | None = 1,
) -> float | None:
    """Write what a certificate of any kind has, replacing an older file whole.

    Parameters
    ----------
    path : str or Path
        The file.
    model : mapping of str to str
        Of all scenes `flight` and `flip`.
    claims : sequence of mapping
        ``{"claim": ..., "section": {...}}`` each, and the ``verdict`` where it is not "proved".
    arrays : mapping of str to ndarray
        By name.
    boxes : sequence of mapping
        Scene, parameters and prefix of each box of parameters.
    noise, tolerance : mapping or None
        What the parameters were allowed to do.
    recheck : bool
        Whether the checker has to confirm the claims before the file gets its name.
    workers : int, optional
        Processes that check it, None for all processors.

    Returns
    -------
    float or None
        Seconds that the check took.

    Raises
    ------
    DeniedError
        The checker does not confirm it: it is kept as NAME.denied.zip.
    """
    header = {
        "scene": dict(model),
        "noise": spelled_plainly(noise) if noise else None,
        "tolerance": spelled_plainly(tolerance) if tolerance else None,
        "boxes": spelled_plainly(list(boxes)),
        "claims": spelled_plainly([{"claim": each["claim"], "section": each["section"]} for each in claims]),
    }
    verdicts = {each["claim"]: each.get("verdict", "proved") for each in claims}
    return written(path, header, arrays, verdicts, recheck=recheck, workers=workers)


def require_proved(claims: Collection[Any]) -> None:
    """Refuse to write a certificate of nothing."""
    if not claims:
        raise AnswerError(
            "the certificate", "without a proved claim", "at least one", "see the reasons in .claims"
        )


def written(
    path: str | Path,
    header: Mapping[str, Any],
    arrays: Mapping[str, NDArray[Any]],
    verdicts: Mapping[str, str],
    *,
    recheck: bool,
    workers: int | None,
) -> float | None:
    """Write header and arrays, with the format and what describes the arrays; the last two arguments as in `pack`.

    `verdicts` says what has to become of each claim.
    """
    described = {
        name: {
            "sha256": hashlib.sha256(value.tobytes()).hexdigest(),
            "dtype": value.dtype.str,
            "shape": list(value.shape),
        }
        for name, value in arrays.items()
    }
    form = {"format": "limitsets-proof", "version": 3}
    whole = {**form, **header, "producer": _producer(), "arrays": described}
    text = json.dumps(whole, indent=1)
    if len(text) > MOST_TEXT:
        value, way = (
            f"{len(text) / 2**20:.1f} MB",
            "claim fewer orbits, or fewer boxes of parameters, in one file",
        )
        raise AnswerError("the text of the certificate", value, "at most 4 MB, which the checker reads", way)
    packed = io.BytesIO()
    np.savez(packed, **arrays)  # type: ignore[arg-type]  # arrays by name
    target, seconds, denied = Path(path), None, None
    with replaced(target.parent) as draft:
        written = draft / target.name
        with zipfile.ZipFile(written, "w", zipfile.ZIP_STORED) as file:
            file.writestr("header.json", text)
            file.writestr("arrays.npz", packed.getvalue())
        if recheck:
            kept = target.with_name(target.name.removesuffix(".zip").removesuffix(".proof") + ".denied.zip")
            try:
                seconds = require_confirmed(written, kept, verdicts, workers)
            except DeniedError as error:
                denied = error
                written.rename(draft / kept.name)
    if denied is not None:
        raise denied
    return seconds
