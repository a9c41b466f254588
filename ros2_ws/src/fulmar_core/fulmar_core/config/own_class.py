"""Load a user's own class by its dotted path: `mypackage.mymodule:MyClass`.

Controllers, tasks and drivers of users come this way. The module is searched for in the current folder first, then on
PYTHONPATH and among the installed packages, in every process. What it imports is searched for in the current folder
last, so that no file there takes the place of a module that others need. Nothing is executed but the import.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import re
import sys
import traceback
import types
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import Any

from fulmar_core.config.bounded_file import CONFIG_BYTES, read_bounded
from fulmar_core.config.errors import ConfigError, FulmarError, did_you_mean, shortened
from fulmar_core.config.module_path import current_folder, search_current_folder
from fulmar_core.config.yaml_text import YamlError, load

SEPARATOR = ":"  # of module and class; no name of anything that Fulmar brings has one
EXAMPLE = "mypackage.mymodule:MyClass"
_FILE = re.compile(r"(.+)\.py:([^\W\d]\w*)")
_PATH = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*")


def is_own(name: str) -> bool:
    """Whether the name of a controller or task is the dotted path of a class."""
    return SEPARATOR in name


def check_class_path(text: str) -> None:
    """Refuse a text that is no dotted path of a class.

    Raises:
        ConfigError: It is malformed.
    """
    if file := _FILE.fullmatch(text):
        dotted = ".".join(part for part in Path(file[1]).parts if part not in (".", "..", "/"))
        raise ConfigError(
            f"'{shortened(text)}' names a file: write the module, and leave .py out: {dotted}{SEPARATOR}{file[2]}."
        )
    if not _PATH.fullmatch(text):
        raise ConfigError(f"'{shortened(text)}' names no class: write it as {EXAMPLE}.")


def load_class(text: str, *, members: Iterable[str], what: str) -> type[Any]:
    """Import a class and check that it has what its role asks for.

    Args:
        text: Dotted path, `mypackage.mymodule:MyClass`.
        members: Methods and other attributes that the class must have; abstract ones do not count.
        what: Role of the class, for messages: controller, task or driver.

    Returns:
        The class.

    Raises:
        ConfigError: Malformed text, no such module, a module that raises, no such class, no class, or one that lacks a
            member. One line, with the line of the user's file where there is one.
    """
    check_class_path(text)
    module_name, _, name = text.partition(SEPARATOR)
    module = _module(module_name, what)
    here = f"{what} '{text}': {module.__file__ or module_name}"
    try:
        found = getattr(module, name)
    except AttributeError:
        classes = [key for key, value in vars(module).items() if isinstance(value, type)]
        raise ConfigError(f"{here} has no class '{name}'.{did_you_mean(name, classes)}") from None
    if not isinstance(found, type):
        raise ConfigError(f"{here}: '{name}' is a {type(found).__name__}, a class is needed.")
    lacking = [member for member in members if not _has(found, member)]
    if lacking:
        names = [key for key in dir(found) if not key.startswith("_") and key not in lacking]
        near = did_you_mean(lacking[0], names) if names else ""
        raise ConfigError(
            f"{here}: class '{name}' lacks {', '.join(lacking)}."
            + (near if near.startswith(" Did you mean") else f" A {what} needs: {', '.join(members)}.")
        )
    return found


def construct(cls: type[Any], call: str, what: str, *arguments: Any, **named: Any) -> Any:
    """Make an object of a user's class.

    Args:
        cls: The class.
        call: How it is called, for the message.
        what: Role of the class, as in `load_class`.
        arguments: Of its constructor.
        named: Same.

    Raises:
        ConfigError: The constructor raised.
        FulmarError: The constructor raised this one itself, such as a DeviceError for a device that is not there.
    """
    try:
        return cls(*arguments, **named)
    except FulmarError:
        raise
    except (Exception, SystemExit) as error:
        raise ConfigError(
            f"{what} '{cls.__module__}:{cls.__name__}': {call} raised {one_line(error, cls.__module__)}."
        ) from error


def settings_beside(cls: type[Any]) -> dict[str, Any]:
    """Settings of a user's class: the mapping in the YAML file of the same name beside its module, or an empty one.

    Raises:
        ConfigError: The file is not valid YAML, or holds no mapping.
    """
    path = source_of(cls).with_suffix(".yaml")
    if not path.exists():
        return {}
    try:
        values = load(read_bounded(path, CONFIG_BYTES).decode("utf-8"), ours=True)
    except YamlError as error:
        raise ConfigError(f"{path}:{error.line}: {error}.") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}.") from error
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: must hold a mapping, found {type(values).__name__}.")
    return values


def source_of(cls: type[Any]) -> Path:
    """The file that a user's class is in."""
    return Path(str(sys.modules[cls.__module__].__file__))


def one_line(error: BaseException, module_name: str) -> str:
    """Type, message and place of an error: the innermost line of the user's module that it came through."""
    text = " ".join(str(error).split())
    place = _place(error, module_name)
    return f"{type(error).__name__}: {text}" + (f" ({place})" if place else "")


class _CurrentFolderFirst(MetaPathFinder):
    """Finds one module, and no other, in the current folder."""

    def __init__(self, name: str) -> None:
        self._name = name

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        if fullname != self._name or fullname in sys.stdlib_module_names:
            return None
        found = PathFinder.find_spec(fullname, [current_folder()])
        return found if found and found.origin else None


@contextmanager
def current_folder_first(name: str) -> Iterator[None]:
    """Search the current folder for one module before all other folders, and for what it imports after them."""
    search_current_folder()
    finder = _CurrentFolderFirst(name)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)


def _module(name: str, what: str) -> types.ModuleType:
    importlib.invalidate_caches()
    top = name.partition(".")[0]
    try:
        with current_folder_first(top):
            module = importlib.import_module(name)
    except (Exception, SystemExit) as error:
        missing = error.name if isinstance(error, ModuleNotFoundError) else None
        if missing and (name == missing or name.startswith(f"{missing}.")):
            raise _not_found(name, what) from None
        raise ConfigError(f"{what}: module '{name}' cannot be imported: {one_line(error, name)}.") from error
    _check_not_shadowed(top, what)
    return module


def _not_found(name: str, what: str) -> ConfigError:
    parent, _, last = name.rpartition(".")
    folders = [current_folder()] if not parent else list(getattr(sys.modules.get(parent), "__path__", []))
    if parent and not folders:
        top = name.partition(".")[0]
        parent, last, folders = "", top, [current_folder()]
    known = [module.name for module in pkgutil.iter_modules(folders)]
    where = (
        f"package '{parent}'" if parent else f"{folders[0]}, on PYTHONPATH or among the installed packages"
    )
    return ConfigError(f"{what}: there is no module '{last}' in {where}.{did_you_mean(last, known)}")


def _check_not_shadowed(top: str, what: str) -> None:
    """Refuse a module of the current folder whose name another module had taken before."""
    loaded = getattr(sys.modules[top], "__file__", None)
    folder = Path.cwd()
    own = next((path for path in (folder / f"{top}.py", folder / top / "__init__.py") if path.exists()), None)
    if own is not None and (loaded is None or not Path(loaded).is_relative_to(folder)):
        raise ConfigError(
            f"{what}: '{top}' is a module that was loaded before, from {loaded or 'the interpreter'}. Rename {own}."
        )


def _has(cls: type[Any], member: str) -> bool:
    found = getattr(cls, member, None)
    return found is not None and not getattr(found, "__isabstractmethod__", False)


def _place(error: BaseException, module_name: str) -> str:
    """The innermost line of the user's files that an error came through; empty if there is none."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename}:{error.lineno}"
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if not frame.filename.startswith("<") and Path(frame.filename).is_relative_to(_root(module_name))
    ]
    own = [frame for frame in frames if "site-packages" not in Path(frame.filename).parts] or frames
    return f"{own[-1].filename}:{own[-1].lineno}" if own else ""


def _root(module_name: str) -> Path:
    """The folder of a module's outermost package, or the file of a module without one."""
    top = module_name.partition(".")[0]
    spec = importlib.util.find_spec(top)
    if spec is None or spec.origin is None:
        return Path.cwd()
    return Path(spec.origin).parent if spec.submodule_search_locations else Path(spec.origin)
