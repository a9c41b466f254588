"""Parameters of the recorder."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_core.config.bounded_file import WEIGHTS_BYTES, read_bounded
from fulmar_core.config.errors import BagError, ConfigError
from fulmar_core.config.recording import Recording
from fulmar_core.config.yaml_text import dump
from fulmar_core.wires.wire import Wire


@dataclass(frozen=True)
class RecorderSettings(Recording):
    """What is kept, where, and with what beside it."""

    things: tuple[str, ...] = ("",)  # names of the things of the task, beside the topics of the table
    # Topics of the robot's own sensors, each with its type: `range/front sensor_msgs/msg/Range`.
    own_topics: tuple[str, ...] = ("",)
    robots: tuple[str, ...] = (
        "",
    )  # of a fleet, by name: topics of each are recorded, in the place of the node's own
    lossless: bool = False  # lock step with nodes between: lose nothing, and leave repetitions out
    resume: bool = False  # go on with what a recorder that died has left in the directory
    directory: str = ""  # bag folder to make; "" makes one under `runs/` that is named after robot and time
    run_info: str = "{}"  # JSON object: what kind of run this is
    attachments: str = (
        "{}"  # JSON object: name to path of files to carry along, or to what a YAML file is to say
    )

    def own_wires(self) -> tuple[Wire, ...]:
        """The topics of the robot's own sensors.

        Raises:
            ConfigError: An entry is not a topic and its type.
        """
        found = []
        for entry in filter(None, self.own_topics):
            name, _, kind = entry.partition(" ")
            if kind.count("/") != 2:
                raise ConfigError(
                    f"parameter 'own_topics' of node 'recorder' has '{entry}', it must be a topic and its type: "
                    "range/front sensor_msgs/msg/Range"
                )
            found.append(Wire(name, kind, "plant", "stream", "", ""))
        return tuple(found)

    def run(self) -> dict[str, Any]:
        """What kind of run this is.

        Raises:
            ConfigError: The parameter is no JSON object.
        """
        return _json_object("run_info", self.run_info)

    def files(self) -> dict[str, bytes]:
        """Files to carry along, by name.

        Raises:
            ConfigError: The parameter is no JSON object.
            BagError: A file cannot be read.
        """
        try:
            files = _json_object("attachments", self.attachments)
            return {name: _content(what) for name, what in files.items()}
        except OSError as error:
            raise BagError(f"cannot attach {error.filename}: {error.strerror}.") from error


def _content(what: str | dict[str, Any]) -> bytes:
    if isinstance(what, dict):
        return dump(what).encode()
    return read_bounded(Path(what), WEIGHTS_BYTES)


def _json_object(parameter: str, text: str) -> dict[str, Any]:
    try:
        value = json.loads(text or "{}")
    except json.JSONDecodeError as error:
        raise ConfigError(f"parameter '{parameter}' of node 'recorder' is not JSON: {error}.") from error
    if not isinstance(value, dict):
        raise ConfigError(f"parameter '{parameter}' of node 'recorder' must be a JSON object, found {text}.")
    return value
