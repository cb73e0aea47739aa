"""Effects beyond the minimal model.  None is built in this version: a scene that switches one on is refused."""

BUILT: tuple[str, ...] = ()
"""Names of the effects a scene may switch on."""
