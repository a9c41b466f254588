"""Robots that run, or a bag, on a websocket that Foxglove opens; on this computer alone."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from foxglove import Context, start_server
from foxglove.websocket import WebSocketServer

from fulmar_console.bags.paths import bags_of
from fulmar_console.exports.foxglove_file import steps_of
from fulmar_console.exports.foxglove_scene import NS, FoxgloveScene
from fulmar_core.config.errors import ConfigError

ADDRESS = "127.0.0.1"
FRAME_S = 0.04
REST_S = 1.0  # between two rounds of a bag
Say = Callable[[str], None]


def serve_bag(path: Path, port: int, rate: float, say: Say, warn: Callable[[Iterable[str]], None]) -> None:
    """Play a bag again and again until interrupted; `say` takes the address.

    Raises:
        BagError: There is no bag, or it holds no robot.
        ConfigError: The port is taken.
    """
    paths = bags_of(path)
    context = Context()
    server = _started(port, context)
    try:
        from fulmar_console.bags.recording import read_recording

        recording = read_recording(paths, path.resolve().name, lambda _share, _words: None)
        warn(recording.document["notes"])
        say(_address(server))
        scene = FoxgloveScene(context)
        while True:
            begin_ns, began = time.time_ns(), time.monotonic()
            for t_s, publish in steps_of(recording, scene, begin_ns):
                wait_s = began + t_s / rate - time.monotonic()
                if wait_s > 0.0:
                    time.sleep(wait_s)
                publish()
            time.sleep(REST_S)
    finally:
        server.stop()


def serve_live(port: int, say: Say) -> None:
    """Publish the robots of the ROS domain until interrupted; `say` takes the address.

    Raises:
        ConfigError: The port is taken.
    """
    context = Context()
    server = _started(port, context)
    from fulmar_console.live.live_source import LiveSource

    source = LiveSource()
    try:
        say(_address(server))
        source.start()
        live = LiveScene(FoxgloveScene(context), source)
        while True:
            live.publish(time.time_ns())
            time.sleep(FRAME_S)
    finally:
        source.close()
        server.stop()


class LiveScene:
    """Publishes what a source of robots knows, step by step."""

    def __init__(self, scene: FoxgloveScene, source: Any) -> None:
        """Begin; `source` is a `fulmar_console.source.Source`."""
        self._scene, self._source = scene, source
        self._goals: dict[str, Any] = {}
        self._looking = ""

    def publish(self, now_ns: int) -> None:
        """Publish everything once, stamped with this time [ns]."""
        records = {record["index"]: record for record in self._source.robots()}
        health: Mapping[str, Mapping[str, Any]] = self._source.health()
        samples, _ = self._source.frame()
        self._look(records)
        for sample in samples:
            record = records.get(sample.index)
            if record is None or sample.age_s > REST_S:
                continue
            said = health.get(record["name"], {})
            self._scene.see(record, sample.pose, _signals(record, said, sample.shares), now_ns)
            self._see_goal(record, said.get("goal") or {}, now_ns)
        for event in self._source.events():
            self._scene.event(event["robot"], event["kind"], str(event["words"]), now_ns)
        for image in self._source.images():
            if image.index in records:
                self._scene.image(records[image.index]["name"], image.kind, image.data, now_ns)

    def _look(self, records: Mapping[int, Mapping[str, Any]]) -> None:
        """Ask for the images of the first robot that has a camera."""
        seen = [record["name"] for record in records.values() if (record.get("info") or {}).get("camera")]
        if seen and seen[0] != self._looking:
            self._looking = seen[0]
            command = {"do": "look", "robot": seen[0], "camera": ["rgb", "depth"]}
            self._source.do(command, self._answered, "foxglove")

    def _answered(self, accepted: bool, _words: str) -> None:
        if not accepted:
            self._looking = ""  # ROS is not there yet: ask again

    def _see_goal(self, record: Mapping[str, Any], goal: Mapping[str, Any], now_ns: int) -> None:
        targets = goal.get("targets") or ()
        target = targets[int(goal.get("done") or 0) % len(targets)] if targets else None
        key = (target, now_ns // NS)  # repeated each second, for a viewer that comes late
        if target is not None and len(target) == 7 and self._goals.get(record["name"]) != key:
            self._goals[record["name"]] = key
            tolerance = ((record.get("info") or {}).get("tolerance") or {}).get("position_m", 0.0)
            self._scene.goal(str(record["name"]), target, max(0.02, float(tolerance)), now_ns)


def _signals(
    record: Mapping[str, Any], health: Mapping[str, Any], shares: Iterable[float]
) -> dict[str, float]:
    """Numbers for plots, the same keys each time."""
    names = [each["name"] for each in (record.get("info") or {}).get("actuators") or ()]
    levels = {"ok": 0.0, "warn": 1.0}
    distance = (health.get("goal") or {}).get("distance_m")
    known = {
        "error": float("nan") if distance is None else float(distance),
        "latency": float(health.get("latency_ms") or "nan"),
        "level": levels.get(str(health.get("level")), 2.0),
    }
    return known | {name: float(share) for name, share in zip(names, shares, strict=False)}


def _started(port: int, context: Context) -> WebSocketServer:
    try:
        return start_server(name="Fulmar", host=ADDRESS, port=port, context=context)
    except (OSError, RuntimeError) as error:
        raise ConfigError(
            f"--port {port}: another program listens on {ADDRESS}:{port} already, or it is not allowed ({error}). "
            "Name another, or 0 for any."
        ) from None


def _address(server: WebSocketServer) -> str:
    return f"ws://{ADDRESS}:{server.port}"
