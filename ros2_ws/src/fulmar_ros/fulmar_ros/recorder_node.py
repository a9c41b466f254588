"""The recorder: every recorded wire of one robot into one bag."""

from __future__ import annotations

import importlib
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.node import Node

from fulmar_core.errors import BagError, ConfigError
from fulmar_core.exit_codes import DONE, FAILED
from fulmar_core.topics import WIRES, Wire
from fulmar_ros.bag_thread import BagThread
from fulmar_ros.bag_writer import BagWriter
from fulmar_ros.parameters import read_parameters
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import RequestExit, run_node

# Messages of one topic that may wait for a callback; a lock-stepped run is far faster than real time.
DEPTH = 5000
QUIET_S = 0.2  # nothing came for this long: what was published before the stop is here
LONGEST_GOODBYE_S = 5.0


@dataclass(frozen=True)
class RecorderSettings:
    """Parameters of the recorder."""

    directory: str = ""  # bag folder to make; "" makes one under `runs/` that is named after robot and time
    run_info: str = "{}"  # JSON object: what kind of run this is
    attachments: str = "{}"  # JSON object: name to path of files to carry along


class RecorderNode(Node):
    """Subscribes every recorded wire and keeps the messages as they came."""

    def __init__(self, _request_exit: RequestExit) -> None:
        """Make the bag, then the subscriptions.

        Raises:
            BagError: There is a bag already, or it cannot be written.
            ConfigError: A parameter is wrong.
        """
        super().__init__("recorder")
        settings = read_parameters(self, RecorderSettings)
        run_info = _json_object("run_info", settings.run_info)
        attachments = _read_files(_json_object("attachments", settings.attachments))
        directory = Path(settings.directory or self._default_directory())
        self._bag = BagWriter(directory, run_info=run_info, attachments=attachments)
        wires = [(wire, self.resolve_topic_name(wire.name)) for wire in WIRES if wire.recorded]
        for wire, topic in wires:
            self._bag.add_topic(topic, wire.type, wire.delivery)
        self._thread = BagThread(self._bag, on_error=self.get_logger().error)
        for wire, topic in wires:
            qos = subscriber_qos(wire, reliable=True, depth=DEPTH)
            self.create_subscription(_message_class(wire), topic, self._keep(topic), qos, raw=True)
        sys.stdout.write(f"recording to {self._bag.directory}\n")
        sys.stdout.flush()

    def _default_directory(self) -> str:
        return f"runs/{self.get_namespace().strip('/') or 'robot'}_{time.strftime('%Y%m%d_%H%M%S')}"

    def _keep(self, topic: str) -> Callable[[bytes], None]:
        put = self._thread.put
        # No time of sending: the EventsExecutor of rclpy 7.1.6 fails on callbacks that ask for message info.
        return lambda data: put(topic, data, time.time_ns())

    def stop(self) -> int:
        """Wait until nothing more comes, close the bag, and say what is in it."""
        deadline = time.monotonic() + LONGEST_GOODBYE_S
        before = -1
        while self._thread.received != before and time.monotonic() < deadline:
            before = self._thread.received
            time.sleep(QUIET_S)
        outcome = self._thread.stop()
        sys.stdout.write(
            f"recorded {outcome.recorded} messages, {outcome.size / 1e3:.0f} kB, to {self._bag.directory}\n"
        )
        sys.stdout.flush()
        if outcome.lost:
            self.get_logger().error(f"{outcome.lost} of {outcome.received} messages are not in the bag.")
        return FAILED if outcome.lost else DONE


def _message_class(wire: Wire) -> type:
    package, kind, name = wire.type.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), name)


def _json_object(parameter: str, text: str) -> dict[str, Any]:
    try:
        value = json.loads(text or "{}")
    except json.JSONDecodeError as error:
        raise ConfigError(f"parameter '{parameter}' of node 'recorder' is not JSON: {error}.") from error
    if not isinstance(value, dict):
        raise ConfigError(f"parameter '{parameter}' of node 'recorder' must be a JSON object, found {text}.")
    return value


def _read_files(paths: dict[str, Any]) -> dict[str, bytes]:
    try:
        return {name: Path(path).read_bytes() for name, path in paths.items()}
    except OSError as error:
        raise BagError(f"cannot attach {error.filename}: {error.strerror}.") from error


def main() -> None:
    """Record until told to stop."""
    sys.exit(run_node(RecorderNode))


if __name__ == "__main__":
    main()
