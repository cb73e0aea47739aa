"""Write the reference into docs/api, from the docstrings: the public names, then each room."""

from pathlib import Path
from pkgutil import iter_modules

import pdoc

import limitsets

# pdoc looks names up in the module's dictionary, where the lazy ones are not.
for name in limitsets.__all__:
    vars(limitsets)[name] = getattr(limitsets, name)

rooms = [f"limitsets.{module.name}" for module in iter_modules(limitsets.__path__)]
shown = {f"limitsets.{name}" for name in limitsets.__all__} | {"limitsets.__main__"}
pdoc.render.configure(docformat="numpy")
pdoc.pdoc(
    "limitsets",
    *(room for room in rooms if room not in shown),
    output_directory=Path(__file__).parent / "api",
)
