"""Of which model a command's answer is: the last line of text, and `model` in JSON."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from limitsets.base.files import as_plain

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene
    from limitsets.feeder.scene.left_out import Model


@dataclass(frozen=True)
class About:
    """What an answer is about.

    Attributes
    ----------
    model : Model
        The model of the answer.
    name : str
        The scene, as another command takes it.
    scene : Scene or None
        The scene, where it is to be seen which assumptions of the model break; None where nobody looks.
    """

    model: Model
    name: str
    scene: Scene | None = None

    @cached_property
    def audited(self) -> Model:
        """The model with the assumptions that break on the limit set: looked for once, when somebody asks."""
        if self.scene is None or self.model.broken is not None:
            return self.model
        from limitsets.proofs.auditing import audited

        return audited(self.model, self.scene)

    def added(self, record: Any) -> Any:
        """Give an answer as plain tables for JSON, with its model in each."""
        plain = as_plain(record)
        for each in plain if isinstance(plain, list) else [plain]:
            each["model"] = self.audited.to_json()
        return plain

    def line(self) -> str:
        """Say it to people."""
        return self.audited.line(self.name)
