"""Turn rates from recorded events, window after window, by the estimator that runs as a node."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.bag_reading import AS_IT_IS, BagReading
from fulmar_bags.contents import Bag, open_bag
from fulmar_bags.event_files import EventFile, is_event_file, open_event_file
from fulmar_bags.event_packets import events_of_cloud
from fulmar_bags.message_reader import stamp_ns
from fulmar_bags.wire_reader import WireReader
from fulmar_core.config.errors import BagError, ConfigError
from fulmar_core.dynamics.sky.events import Events
from fulmar_core.estimators.event_rate.estimator import EventRateEstimator
from fulmar_core.estimators.kinds import load_estimator
from fulmar_core.estimators.motion.settings import EventRateSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.star_camera import StarCamera
from fulmar_core.robots.topics import EVENTS, EVENTS_2
from fulmar_core.wires.reading import Reading
from fulmar_evaluation.event_bag import CAMERAS

WIRES = {"events": EVENTS, "events_2": EVENTS_2}
LONGEST_PAUSE_S = 600.0  # in which a camera that looks at the stars may see nothing [s]
PACKET_S = 0.05  # of recordings that have no packets
Packet = tuple[int, str, Events]  # end [ns], name of the reading, events


@dataclass(frozen=True)
class Rates:
    """Turn rates of windows."""

    times_s: np.ndarray  # middles of windows since the recording began, shape (n,) [s]
    rates: np.ndarray  # about the body's axes, shape (n, 3) [rad/s]
    stds: np.ndarray  # shape (n, 3) [rad/s]
    seconds: float  # of the recording, from its first event to the end of its last packet [s]
    events: int
    words: Counter[str]  # why other packets brought no rate, and refusals

    def document(self) -> dict[str, Any]:
        """JSON-ready, in degrees a second."""
        degrees, spread = np.degrees(self.rates), np.degrees(self.stds)
        return {
            "seconds": round(self.seconds, 6),
            "events": self.events,
            "windows": len(self.times_s),
            "mean_deg_s": degrees.mean(axis=0).tolist() if len(degrees) else None,
            "std_deg_s": np.median(spread, axis=0).tolist() if len(degrees) else None,
            "without_rate": dict(self.words),
            "rates": [
                {"t_s": round(float(t), 6), "deg_s": rate.tolist(), "std_deg_s": std.tolist()}
                for t, rate, std in zip(self.times_s, degrees, spread, strict=True)
            ],
        }


def cameras_of(
    robot: Robot,
    sources: Sequence[Path],
    *,
    size: tuple[int, int] | None,
    fov_deg: float | None,
    reading: BagReading = AS_IT_IS,
) -> tuple[StarCamera, ...]:
    """Cameras that a bag or recordings are from: mounted as the robot's, of the size that a file says, or was given.

    Raises:
        ConfigError: The robot has no event camera, or fewer than there are files.
        BagError: As in `open_event_file`.
    """
    its = tuple(each.camera for each in robot.event_cameras)
    if not its:
        raise ConfigError(f"'{robot.name}' has no event camera. Add 'event_cameras' to its file.")
    files = [path for path in sources if is_event_file(path)]
    if len(files) > len(its):
        raise ConfigError(
            f"{len(files)} recordings were given, and '{robot.name}' has {len(its)} event cameras."
        )
    known = []  # width, height [px] and field of view [deg] of each
    if files:
        opened = [open_event_file(path, size) for path in files]
        known = [(file.width, file.height, camera.fov_deg) for file, camera in zip(opened, its, strict=False)]
    else:
        bag = open_bag(sources[0], reading)
        count = 2 if len(bag.of(EVENTS_2)) else 1
        known = [(camera.width, camera.height, camera.fov_deg) for camera in its[:count]]
        known = [tuple(each) for each in (bag.info or {}).get(CAMERAS, known)]
        known = [(*size, wide) for _, _, wide in known] if size else known
    return tuple(
        replace(camera, width=int(width), height=int(height), fov_deg=fov_deg or float(wide))
        for camera, (width, height, wide) in zip(its, known, strict=False)
    )


def packets_of(
    sources: Sequence[Path], cameras: Sequence[StarCamera], reading: BagReading = AS_IT_IS
) -> Iterator[Packet]:
    """Packets of one bag, or of a file for each camera, by time.

    Raises:
        BagError: There is no packet of events in a bag, or as in `open_event_file`.
    """
    files = [path for path in sources if is_event_file(path)]
    if files and len(files) == len(sources):
        streams = [
            _of_file(EventFile(path, camera.width, camera.height), name)
            for path, camera, name in zip(files, cameras, WIRES, strict=False)
        ]
        return heapq.merge(*streams, key=lambda packet: packet[:2])
    if len(sources) != 1:
        raise ConfigError("give one bag, or one recording for each camera.")
    return iter(_of_bag(open_bag(sources[0], reading), sources[0]))


def rates_of(
    packets: Iterator[Packet],
    cameras: tuple[StarCamera, ...],
    settings: str = "event_rate",
    each: Callable[[Packet], None] = lambda _packet: None,
) -> Rates:
    """Estimate the rate of every window.

    Args:
        packets: By time.
        cameras: One or two.
        settings: Name or path of an estimator's file.
        each: Called with each packet before it is used.
    """
    its = load_estimator(settings)
    if not isinstance(its, EventRateSettings):
        raise ConfigError(f"estimator '{settings}' is of another kind; rates need one of kind 'event_rate'.")
    estimator = EventRateEstimator(its, cameras)
    found: list[tuple[int, np.ndarray, np.ndarray]] = []
    words: Counter[str] = Counter()
    begun_ns = end_ns = -1
    events = 0
    spans: dict[str, tuple[int, int]] = {}  # first and last end of a packet of each camera [ns]
    for packet in packets:
        each(packet)
        end_ns, name, some = packet
        events += len(some)
        begin_ns = int(some.t[0]) if len(some) else end_ns
        spans[name] = spans.get(name, (end_ns, end_ns))[0], end_ns
        _refuse_apart(spans, LONGEST_PAUSE_S)
        before = estimator.problem
        refusal = estimator.take(name, Reading(some, end_ns))
        if refusal is not None:
            words[refusal] += 1
        elif begun_ns < 0 or begin_ns < begun_ns:
            begun_ns = (
                begin_ns  # of two cameras the packet that ends first need not be the one that begins first
            )
        estimate = estimator.estimate()
        if estimate is not None and (not found or estimate.stamp_ns > found[-1][0]):
            found.append((estimate.stamp_ns, estimate.value, np.sqrt(np.diag(estimate.covariance))))
        elif estimator.problem and estimator.problem != before:
            words[estimator.problem] += 1
    _refuse_apart(spans, 0.0)
    if end_ns < 0:
        raise BagError("there is no event in it.")
    if not found and not words:
        words[f"shorter than a window of {its.window_s:g} s"] += 1
    times = np.array([(stamp - begun_ns) / 1e9 for stamp, _, _ in found])
    rates = np.array([rate for _, rate, _ in found]).reshape(-1, 3)
    stds = np.array([std for _, _, std in found]).reshape(-1, 3)
    return Rates(times, rates, stds, (end_ns - begun_ns) / 1e9 if begun_ns >= 0 else 0.0, events, words)


def _refuse_apart(spans: Mapping[str, tuple[int, int]], pause_s: float) -> None:
    """Refuse cameras that recorded nothing at the same time; so far they may be apart by a pause [s].

    Raises:
        BagError: As said.
    """
    if len(spans) < 2:
        return
    (first, (_, first_until)), (second, (begin, _)) = sorted(spans.items(), key=lambda span: span[1])
    if begin - first_until > 1e9 * pause_s:
        raise BagError(
            f"the recordings do not overlap in time: '{first}' ends {(begin - first_until) / 1e9:.6g} s before "
            f"'{second}' begins. They must be of one clock: do both files have 't_offset'?"
        )


def _of_file(file: EventFile, name: str) -> Iterator[Packet]:
    for end_ns, events in file.packets(PACKET_S):
        yield end_ns, name, events


def _of_bag(bag: Bag, path: Path) -> list[Packet]:
    reader, found = WireReader(bag), []
    for name, wire in WIRES.items():
        for _, message in reader.messages(wire):
            events, problem = events_of_cloud(message)
            if events is None:
                raise BagError(f"{path}: a packet of '{wire.name}' is none: {problem}")
            found.append((stamp_ns(message.header.stamp), name, events))
    if not found:
        raise BagError(
            f"{path}: no packet on '{EVENTS.name}', which Fulmar's recorder leaves out. Convert a recording with "
            "fulmar rates FILE --to-bag BAG, or record the topic with ros2 bag record."
        )
    return sorted(found, key=lambda packet: packet[:2])
