"""An effect with facts of its own is a file and a name in one line: in a copy of the package, by another process."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from tests.thrower.effects.copies import environment_of_copy

GUST = '''"""Effect `gust`: air that moves lessens gravity."""

from typing import Any, NamedTuple

from limitsets.feeder.thrower.motion import Effect, at_kappa, declare, thrown
from limitsets.feeder.thrower.params import Throw
from limitsets.feeder.world import Fact
from limitsets.numbers.jit import kernel


class Gust(NamedTuple):
    """By how much gravity is less [length/s^2], and a share."""

    lift: float
    share: float


@kernel
def _lifted(gust: Gust, bare: Throw) -> Throw:
    return at_kappa(bare, bare.kappa * (1.0 - gust.share))


def _of(world: Any, how: Any) -> Gust:
    return Gust(world.lift, world.lift_share)


thrown.on(Gust, _lifted)
declare(
    Effect(
        "gust",
        Gust,
        _of,
        "the air rests",
        ("lift", "lift_share"),
        facts={
            "lift": Fact("the lift", "acceleration", meaning="what gravity is less"),
            "lift_share": Fact("the share of lift", most=0.5, words="0.1"),
        },
    )
)
'''

SCRIPT = """
import pickle, sys
import limitsets as ls
from limitsets.checker.scene import left_out, read_scene
from limitsets.feeder.scene.checking import starting_text
from limitsets.feeder.scene.left_out import Model

kernels = "limitsets.feeder.thrower.motion"
whole = ls.load("paper-designed").as_dict()
scene = ls.load(whole | {"world": {"friction": 0.3}})
assert kernels not in sys.modules  # what states no fact of an effect's loads none
facts = {"friction": 0.3, "lift": "2 cm/s^2", "lift_share": 0.25}
scene = ls.load(whole | {"world": facts})
assert kernels in sys.modules
assert scene.world.lift_share == 0.25 and abs(scene.world.lift - 2 / 2.54) < 1e-12
assert pickle.loads(pickle.dumps(scene)).world == scene.world
assert Model.of(scene).left_out == ("friction", "lift", "lift_share")
blown = ls.load(whole | {"world": facts, "effects": {"gust": True}})
assert Model.of(blown).left_out == ("friction",)
assert blown.map.effects[0].share == 0.25
assert '# lift = "1 m/s^2"' in starting_text("mine", "mine.toml")
for world, effects in (
    ({"lift_shar": 0.25}, {}),
    ({"lift": "2 cm"}, {}),
    ({"lift_share": 0.6}, {}),
    ({"lift": "2 cm/s^2"}, {"gust": True}),
):
    try:
        ls.load(whole | {"world": world, "effects": effects})
    except ls.errors.SceneError as error:
        print(error)

from limitsets.proofs.prover.certificate import in_certificate

text = in_certificate(scene.text)
assert text["world"] == {"friction": 0.3, "other": {"lift": "2 cm/s^2", "lift_share": 0.25}}
read_scene(text, None)
assert left_out(text, None) == ["friction", "lift", "lift_share"]
"""


def test_one_file_and_one_line(tmp_path: Path) -> None:
    """Scenes, refusals, the text to start from, models of answers and certificates know its facts by themselves."""
    environment = environment_of_copy(tmp_path, "with")
    folder = tmp_path / "with" / "limitsets" / "feeder" / "thrower" / "effects"
    (folder / "gust.py").write_text(GUST, encoding="utf-8")
    face = folder / "__init__.py"
    known = face.read_text(encoding="utf-8")
    assert known.count("import drive, landing") == 1
    face.write_text(known.replace("import drive, landing", "import gust, drive, landing"), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", SCRIPT],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    assert done.returncode == 0, done.stderr
    refused = done.stdout.splitlines()
    assert len(refused) == 4
    for line, words in zip(
        refused,
        (
            ("world.lift_shar", "it is not known", "lift_share"),
            ("world.lift", "this acceleration", "2 cm", "a unit of m/s^2"),
            ("world.lift_share", "the share of lift", "0.6", "from 0 to 0.5"),
            ("effects.gust", "the fact world.lift_share", "missing"),
        ),
        strict=True,
    ):
        assert all(word in line for word in words), line
