"""What a service needs of the folder and environment that it is installed from: it runs in another folder."""

from __future__ import annotations

import importlib.util
import os
import pkgutil
import sys
from collections.abc import Iterable, Mapping
from importlib.machinery import PathFinder
from pathlib import Path

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.module_path import PYTHONPATH, search_current_folder
from fulmar_core.config.own_class import SEPARATOR
from fulmar_core.config.paths import OWN_FOLDERS

# Variables that hold a path, or several as in PATH.
PATHS = (
    OWN_FOLDERS, "FULMAR_CALIBRATION", "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE",
    "ROS_SECURITY_KEYSTORE",
)  # fmt: skip


def whole_paths(environment: Mapping[str, str]) -> dict[str, str]:
    """The variables of an environment that hold paths, each path from the root on."""
    return {name: _whole(environment[name]) for name in PATHS if environment.get(name)}


def module_path(modules: Iterable[str], environment: Mapping[str, str]) -> dict[str, str]:
    """PYTHONPATH by which a service finds own modules; nothing where none is needed.

    Args:
        modules: Modules, or dotted paths of classes: of controllers, tasks, drivers and nodes.
        environment: Of the one who installs.

    Raises:
        ConfigError: The folder of an own module has others that would be run in the place of Python's or of installed
            ones, for a service finds it by PYTHONPATH, which Python searches before those.
    """
    search_current_folder()
    given = [part for part in environment.get(PYTHONPATH, "").split(os.pathsep) if part]
    searched = [str(Path.cwd()), *map(_whole, given)]
    roots = [_root(module.partition(SEPARATOR)[0].partition(".")[0]) for module in modules]
    if not any(root in searched for root in roots):
        return {}
    own = [root for root in roots if root == searched[0]]
    if own:
        _check_places_taken(searched[0])
    return {PYTHONPATH: os.pathsep.join(dict.fromkeys([*own, *searched[1:]]))}


def _check_places_taken(folder: str) -> None:
    packages = [each for each in sys.path if Path(each).name in ("site-packages", "dist-packages")]
    for _, name, _ in pkgutil.iter_modules([folder]):
        if name in sys.stdlib_module_names or PathFinder.find_spec(name, packages):
            raise ConfigError(
                f"{Path(folder) / name}: a service would run it in the place of the module '{name}' that others need. "
                "Rename it, or install from a folder that holds your classes alone."
            )


def _whole(paths: str) -> str:
    return os.pathsep.join(str(Path(part).absolute()) for part in paths.split(os.pathsep) if part)


def _root(top: str) -> str:
    """The folder in which a module is found; empty for one without."""
    spec = importlib.util.find_spec(top)
    if spec is None:
        return ""
    places = list(spec.submodule_search_locations or [])
    return str(Path(places[0] if places else spec.origin or "").parent.absolute())
