"""Where configuration files lie, and which names they define."""

from __future__ import annotations

import os
from pathlib import Path

from fulmar_core.errors import ConfigError, UnknownNameError


def config_directory() -> Path:
    """Folder with `robots/`, `tasks/` and so on.

    Looked for in this order: the environment variable FULMAR_CONFIGS, a copy beside this package (an
    installed wheel), an ament `share` folder (a colcon workspace), and a `configs` folder above (a checkout).

    Returns:
        The folder.

    Raises:
        ConfigError: If none of the places has a `robots` folder.
    """
    here = Path(__file__).resolve()
    asked = os.environ.get("FULMAR_CONFIGS")
    if asked:
        candidates = [Path(asked)]
    else:
        candidates = [here.parent / "configs"]
        candidates += [parent / "share" / "fulmar_core" / "configs" for parent in here.parents]
        candidates += [parent / "configs" for parent in here.parents]
    for candidate in candidates:
        if (candidate / "robots").is_dir():
            return candidate.resolve()
    raise ConfigError(
        f"no configuration folder with 'robots/' in {candidates[0]}. Set FULMAR_CONFIGS to a folder that has one."
    )


def config_names(family: str) -> list[str]:
    """Names of all files in one family.

    Args:
        family: Folder below the configuration folder, such as `robots`.

    Returns:
        File names without `.yaml`, sorted.
    """
    return sorted(path.stem for path in (config_directory() / family).glob("*.yaml"))


def config_path(family: str, name: str) -> Path:
    """File that defines a name.

    Args:
        family: Folder below the configuration folder, such as `robots`.
        name: A known name.

    Returns:
        The YAML file, printed relative to the working folder where that is shorter.

    Raises:
        UnknownNameError: If there is no such file.
    """
    path = config_directory() / family / f"{name}.yaml"
    if name not in config_names(family):
        raise UnknownNameError(family.removesuffix("s"), name, config_names(family))
    try:
        return path.relative_to(Path.cwd())
    except ValueError:
        return path
