"""The order in which Python searches folders for modules: whatever a person happens to stand in comes last.

A `random.py` or a folder `mcap/` in the current folder would otherwise be run in place of the module of that name, by
`python -m`, by worker processes, or by an empty part of PYTHONPATH, which stands for the current folder. The packages
of another Python, as a sourced ROS puts them onto PYTHONPATH, cannot be loaded and hide those that can.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping

PYTHONPATH = "PYTHONPATH"
SAFE = {"PYTHONSAFEPATH": "1"}  # `python -m` and workers do not search the current folder before all others


def current_folder() -> str:
    """The current folder; empty if it was removed."""
    try:
        return os.getcwd()
    except OSError:
        return ""


def search_current_folder() -> None:
    """Search the current folder too, after all others."""
    here = current_folder()
    if here and not {here, ""} & set(sys.path):
        sys.path.append(here)


def search_strangers_last() -> None:
    """Move the current folder, and folders of another Python's packages, behind all others."""
    here = current_folder()
    sys.path.sort(key=lambda folder: (folder in ("", here), is_of_another_python(folder)))


def safe_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Variables by which the children of an environment search the current folder after all others."""
    given = environment.get(PYTHONPATH)
    parts = [part for part in (given or "").split(os.pathsep) if part]
    return SAFE if given is None else SAFE | {PYTHONPATH: os.pathsep.join(parts)}


def own_packages(environment: Mapping[str, str]) -> dict[str, str]:
    """PYTHONPATH of an environment, where it has one, without folders of another Python's packages."""
    parts = environment.get(PYTHONPATH, "").split(os.pathsep)
    kept = os.pathsep.join(part for part in parts if not is_of_another_python(part))
    return {PYTHONPATH: kept} if PYTHONPATH in environment else {}


def is_of_another_python(folder: str) -> bool:
    """Whether a folder holds packages of another version of Python, by its name: lib/python3.12/site-packages."""
    own = "python{}.{}".format(*sys.version_info)
    names = [part for part in folder.split(os.sep) if part.startswith("python3.")]
    return bool(names) and names[-1] != own
