"""Former names of modules that users' own classes import: they work for one release, and warn.

They are those of docs/own-*.md, and what such classes usually take beside them.
"""

from __future__ import annotations

import sys
import types
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec

# Where the names of each went.
MOVED = {
    "fulmar_core.errors": ("fulmar_core.config.errors",),
    "fulmar_core.estimation.kinds": ("fulmar_core.estimators.kinds",),
    "fulmar_core.goal": ("fulmar_core.tasks.goal",),
    "fulmar_core.health.filters": ("fulmar_core.estimators.actuator_health.filters",),
    "fulmar_core.planar": ("fulmar_core.states.planar",),
    "fulmar_core.robot": ("fulmar_core.robots.robot", "fulmar_core.robots.robot_file"),
    "fulmar_core.rotation": ("fulmar_core.states.rotation",),
    "fulmar_core.sensors.reading": ("fulmar_core.wires.reading",),
    "fulmar_core.spatial": ("fulmar_core.states.spatial",),
    "fulmar_core.state": ("fulmar_core.states.state",),
    "fulmar_core.things": ("fulmar_core.dynamics.things",),
}
_FOLDERS = {name.rpartition(".")[0] for name in MOVED} - {"fulmar_core"}


class MovedModules(MetaPathFinder, Loader):
    """Finds a module under its former name."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: types.ModuleType | None = None
    ) -> ModuleSpec | None:
        """A module with the names that were in it; None for every other one."""
        if fullname in MOVED or fullname in _FOLDERS:
            return ModuleSpec(fullname, self, is_package=fullname in _FOLDERS)
        return None

    def exec_module(self, module: types.ModuleType) -> None:
        """Fill it; the warning names the line that imports it."""
        places = MOVED.get(module.__name__, ())
        for place in places:
            found = vars(import_module(place))
            vars(module).update({name: value for name, value in found.items() if not name.startswith("__")})
        if places:
            now = " and ".join(places)
            said = f"'{module.__name__}' is now {now}. The former name goes with the next release."
            warnings.warn(said, FutureWarning, stacklevel=2)


def keep_former_names() -> None:
    """Let `import` find them, after every other module."""
    if not any(isinstance(finder, MovedModules) for finder in sys.meta_path):
        sys.meta_path.append(MovedModules())
