"""Values that a user sets by `--set key=value`, on a robot's keys."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.config.yaml_text import YamlError, load

OPTION = "--set"


def read_settings(texts: Iterable[str]) -> dict[str, Any]:
    """Read `body.mass=8.1`; values are YAML, so that a list is `body.inertia=[0.3, 0.3, 0.4]`.

    Returns:
        Values by dotted key.

    Raises:
        ConfigError: A text is none of the kind, or a key comes twice.
    """
    found: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        key = key.strip()
        if not equals or not all(key.split(".")):
            raise ConfigError(f"{OPTION} {text}: must be KEY=VALUE, such as {OPTION} body.mass=8.1")
        if key in found:
            raise ConfigError(f"{OPTION} {key} is given twice. Give it once.")
        try:
            found[key] = load(value, ours=True)
        except YamlError as error:
            raise ConfigError(f"{OPTION} {text}: the value is no YAML: {error}.") from error
        if found[key] is None:
            raise ConfigError(f"{OPTION} {key}= has no value.")
    return found


def apply_settings(robot: dict[str, Any], settings: Mapping[str, Any]) -> None:
    """Set values of a robot's keys, in place; a whole part, such as `hydrodynamics`, may be set too.

    Raises:
        ConfigError: A key goes through something that has no keys.
    """
    for key, value in settings.items():
        *above, last = key.split(".")
        part: Any = robot
        for number, name in enumerate(above):
            where = ".".join(above[: number + 1])
            if isinstance(part, list) and name.isdecimal() and int(name) < len(part):
                part = part[int(name)]
            elif isinstance(part, dict):
                if number == 0 and name not in part:
                    raise ConfigError(f"{OPTION} {key}: unknown key '{name}'.{did_you_mean(name, part)}")
                part = part.setdefault(name, {})
            else:
                raise ConfigError(f"{OPTION} {key}: '{where}' is not in the file.")
        if isinstance(part, list) and last.isdecimal() and int(last) < len(part):
            part[int(last)] = value
        elif isinstance(part, dict):
            part[last] = value
        else:
            raise ConfigError(f"{OPTION} {key}: '{'.'.join(above)}' has no key '{last}'.")
