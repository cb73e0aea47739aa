"""An effect with facts of its own is a file and a name in one line: in a copy of the package, by another process."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from tests.thrower.effects.copies import environment_of_copy

GUST = """from typing import NamedTuple

from limitsets.feeder.thrower.motion import Effect, at_kappa, declare, thrown
from limitsets.feeder.world import Fact
from limitsets.numbers.jit import kernel


class Gust(NamedTuple):
    share: float


@kernel
def lifted(gust, bare):
    return at_kappa(bare, bare.kappa * (1.0 - gust.share))


FACTS = {
    "lift": Fact("the lift", "acceleration", meaning="what gravity is less"),
    "lift_share": Fact("the share of lift", most=0.5, words="0.1"),
}
thrown.on(Gust, lifted)
declare(Effect("gust", Gust, lambda world, how: Gust(world.lift_share), "the air rests", (*FACTS,), facts=FACTS))
"""

# What files outside the package do as well (refusals, certificates) is asked in test_outside.py.
SCRIPT = """
import pickle, sys
import limitsets as ls
from limitsets.checker.scene import left_out, read_scene
from limitsets.feeder.scene.starting import starting_text
from limitsets.feeder.scene.left_out import Model

kernels = "limitsets.feeder.thrower.motion"
whole = ls.load("paper-designed").as_dict()
ls.load(whole | {"world": {"friction": 0.3}})
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
for world in ({"lift_shar": 0.25}, {"lift": "2 cm"}):
    try:
        ls.load(whole | {"world": world})
    except ls.errors.SceneError as error:
        print(error)
from limitsets.proofs.prover.certificate import in_certificate
text = in_certificate(scene.text)
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
    command = [sys.executable, "-W", "error", "-c", SCRIPT]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    misspelt, unit = done.stdout.splitlines()
    assert all(word in misspelt for word in ("world.lift_shar", "it is not known", "lift_share"))
    assert all(word in unit for word in ("world.lift", "this acceleration", "2 cm", "a unit of m/s^2"))
