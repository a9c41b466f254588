"""Environments beside `.venv`, for programs whose packages contradict ours: each is made by a target of `make`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_directory

PEERS = ".venv-peers"  # of the outside programs that Fulmar is compared with, and of Basilisk


def environment_python(environment: str, folders: Iterable[Path], purpose: str) -> Path:
    """The Python of an environment.

    Args:
        environment: Name of its folder, `.venv-` and the target of `make` that makes it.
        folders: Where it may lie, in the order of search.
        purpose: What runs in it, a clause that begins the message.

    Raises:
        ConfigError: It is in none of the folders.
    """
    places = (folder / environment / "bin" / "python" for folder in folders)
    python = next((place for place in places if place.is_file()), None)
    if python is None:
        raise ConfigError(
            f"{purpose}, and {environment}/bin/python is missing. {make_environment(environment)}"
        )
    return python


def make_environment(environment: str) -> str:
    """The sentence that says how to make an environment, such as `.venv-peers`."""
    return f"Run: make {environment.removeprefix('.venv-')}"


def peers_python(purpose: str) -> Path:
    """The Python of the outside programs, of this checkout or of the folder in which one is.

    Raises:
        ConfigError: It is missing.
    """
    return environment_python(PEERS, (config_directory().parent, Path.cwd()), purpose)
