"""The model of a command's answer: the last line of its text, and `model` in JSON."""

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
    """The model and the scene of an answer.

    Attributes
    ----------
    model : Model
        The model of the answer.
    name : str
        Name or file of the scene, as other commands take it.
    scene : Scene or None
        The scene, if the answer is to say which assumptions of the model it breaks; else None.
    """

    model: Model
    name: str
    scene: Scene | None = None

    @cached_property
    def audited(self) -> Model:
        """The model with the assumptions that break on the limit set, computed at the first use."""
        if self.scene is None or self.model.broken is not None:
            return self.model
        from limitsets.proofs.auditing import audited

        return audited(self.model, self.scene)

    def added(self, record: Any) -> Any:
        """Give an answer as plain tables for JSON, each with the model."""
        plain = as_plain(record)
        for each in plain if isinstance(plain, list) else [plain]:
            each["model"] = self.audited.to_json()
        return plain

    def line(self) -> str:
        """Give the line of text that names the model."""
        return self.audited.line(self.name)
