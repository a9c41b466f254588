"""Configuration files: where they lie, and which names they define."""

from __future__ import annotations

import functools
import os
from pathlib import Path

from fulmar_core.config.errors import ConfigError, UnknownNameError

OWN_FOLDERS = "FULMAR_CONFIGS"  # environment variable: folders of a user's own files, separated as in PATH


@functools.cache
def config_directory() -> Path:
    """Folder of what Fulmar comes with: `robots/`, `tasks/` and so on.

    Looked for in this order: a copy beside this package (an installed wheel), an ament `share` folder (a colcon
    workspace), and a `configs` folder above (a checkout).

    Raises:
        ConfigError: If none of the places has a `robots` folder.
    """
    here = Path(__file__).resolve()
    candidates = [here.parents[1] / "configs"]
    candidates += [parent / "share" / "fulmar_core" / "configs" for parent in here.parents]
    candidates += [parent / "configs" for parent in here.parents]
    for candidate in candidates:
        if (candidate / "robots").is_dir():
            return candidate.resolve()
    raise ConfigError(f"no configuration folder with 'robots/' in {candidates[0]}. Install Fulmar again.")


def config_directories() -> tuple[Path, ...]:
    """Folders to look into: those that FULMAR_CONFIGS names, and then what Fulmar comes with.

    Raises:
        ConfigError: A folder is named that has no configuration, or there is none at all.
    """
    shipped = config_directory()
    families = sorted(path.name for path in shipped.iterdir() if path.is_dir())
    own = [Path(part).resolve() for part in os.environ.get(OWN_FOLDERS, "").split(os.pathsep) if part]
    for folder in own:
        if not any((folder / family).is_dir() for family in families):
            raise ConfigError(
                f"{folder}: no configuration folder: it has none of {', '.join(f'{each}/' for each in families)}. "
                f"Set {OWN_FOLDERS} to folders that have one, or unset it."
            )
    return (*own, shipped)


def config_files(family: str) -> dict[str, Path]:
    """YAML files of one family, such as `robots`, by their names, sorted; the first folder with a name counts."""
    found: dict[str, Path] = {}
    for folder in reversed(config_directories()):
        found |= {path.stem: path for path in (folder / family).glob("*.yaml")}
    return dict(sorted(found.items()))


def config_names(family: str) -> list[str]:
    """Names of all files in one family, sorted; arguments as in `config_files`."""
    return list(config_files(family))


def config_path(family: str, name: str) -> Path:
    """File of a name in a family such as `robots`, relative to the working folder where that is shorter.

    Raises:
        UnknownNameError: If there is no such file.
        ConfigError: If a path is given instead of a name.
    """
    files = config_files(family)
    if name not in files:
        if Path(name).suffix in (".yaml", ".yml") and Path(name).is_file():
            raise ConfigError(
                f"{name}: is a file, and a name of {family} is asked for. Put it into FOLDER/{family}/, set "
                f"{OWN_FOLDERS}=FOLDER, and say '{Path(name).stem}'."
            )
        raise UnknownNameError(family.removesuffix("s"), name, files)
    try:
        return files[name].relative_to(Path.cwd())
    except ValueError:
        return files[name]
