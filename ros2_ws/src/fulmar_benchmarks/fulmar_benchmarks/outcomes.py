"""Files of outcomes: figures of one cell under a key, the hash of everything that they depend on."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_benchmarks.shape import Cell, Figures
from fulmar_bringup.console import log_line
from fulmar_core.config.atomic_write import whole_file
from fulmar_core.config.paths import config_files

_BATCH = ("fulmar_core", "fulmar_evaluation", "policy_server")
# Packages whose code figures depend on, by the way of running.
_NODES = ("fulmar_ros", "fulmar_bringup", "fulmar_bags")
PACKAGES = {
    "batch": _BATCH,
    "mujoco": (*_BATCH, "sim_nodes"),
    "ros": (*_BATCH, "sim_nodes", *_NODES),
    "training": (*_BATCH, "training"),
}
FAMILIES = ("robots", "tasks", "scenarios", "controllers", "goals", "estimators", "things")  # of configs
COMPUTING = ("numpy", "onnxruntime", "mujoco")  # libraries whose version is part of a key
ARRAY, KEY, VALUE = "array", "key", "value"


def hash_of(*parts: str) -> str:
    """SHA-256 of some texts in their order."""
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def library_version(name: str) -> str:
    """Version of an installed library; empty where it is not there."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def code_hash(way: str) -> str:
    """Hash of the code, the configuration and the libraries that outcomes of one way depend on."""
    folders = [find_spec(name).submodule_search_locations[0] for name in PACKAGES[way]]  # type: ignore[union-attr,index]
    files = [path for folder in folders for path in sorted(Path(folder).rglob("*.py"))]
    files += sorted(path for family in FAMILIES for path in config_files(family).values())
    return hash_of(*_contents(files), *map(library_version, COMPUTING))


def _contents(files: Iterable[Path]) -> list[str]:
    return [hashlib.sha256(path.read_bytes()).hexdigest() for path in files]


def keys_of(cells: Iterable[Cell]) -> dict[str, str]:
    """Hash of everything that the figures of each cell depend on, by its name."""
    code: dict[tuple[Any, ...], str] = {}
    keys = {}
    for cell in cells:
        mine = type(cell), cell.way
        if mine not in code:
            own = [Path(inspect.getfile(each)) for each in type(cell).__mro__ if issubclass(each, Cell)]
            own += [Path(str(find_spec(module).origin)) for module in cell.modules]  # type: ignore[union-attr]
            code[mine] = hash_of(code_hash(cell.way), *_contents(own))
        keys[cell.name] = hash_of(
            type(cell).__name__, json.dumps(cell.parts(), sort_keys=True, default=str), code[mine]
        )
    return keys


def keep(path: Path, key: str, figures: Figures) -> Figures:
    """Write figures, whole or not at all, and give them back as they are read."""
    arrays: list[np.ndarray] = []
    value = _without_arrays(figures, arrays)
    path.parent.mkdir(parents=True, exist_ok=True)
    written: dict[str, Any] = {KEY: np.array(key), VALUE: np.array(json.dumps(value))}
    written |= {f"{ARRAY}{number}": array for number, array in enumerate(arrays)}
    with whole_file(path) as file:
        np.savez_compressed(file, **written)
    return read(path, key) or {}


def read(path: Path, key: str) -> Figures | None:
    """Figures under a key, if an earlier run kept them; a file that is torn is set aside, and said."""
    try:
        with np.load(path, allow_pickle=False) as file:
            if KEY not in file.files or str(file[KEY]) != key:
                return None
            arrays = [file[f"{ARRAY}{number}"] for number in range(len(file.files) - 2)]
            figures: Figures = _with_arrays(json.loads(str(file[VALUE])), arrays)
            return figures
    except FileNotFoundError:
        return None
    except Exception:  # noqa: BLE001 - zlib, zipfile, json and NumPy raise whatever they meet
        aside = path.with_suffix(f"{path.suffix}.torn")
        path.replace(aside)
        log_line(f"warning: {path} is no whole outcome; it is now {aside.name}, and is measured again")
        return None


def _without_arrays(value: Any, arrays: list[np.ndarray]) -> Any:
    """The same with a number in place of each array, which are gathered."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {ARRAY: len(arrays) - 1}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {name: _without_arrays(each, arrays) for name, each in value.items()}
    return [_without_arrays(each, arrays) for each in value] if isinstance(value, list | tuple) else value


def _with_arrays(value: Any, arrays: list[np.ndarray]) -> Any:
    if isinstance(value, dict):
        if list(value) == [ARRAY]:
            return arrays[value[ARRAY]]
        return {name: _with_arrays(each, arrays) for name, each in value.items()}
    return [_with_arrays(each, arrays) for each in value] if isinstance(value, list) else value
