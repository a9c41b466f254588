"""Shows a recorded run in X-Plane: its poses at the pace of the run, while X-Plane's own physics stands still."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_bags.contents import Bag
from fulmar_bags.decode import odometries
from fulmar_core.config.errors import BagError, ConfigError, UnknownNameError
from fulmar_core.states.state import RigidBodyState
from hardware_drivers.earth_frame import LocalFrame
from hardware_drivers.hardware import load_hardware
from hardware_drivers.settings import Geodetic, XPlane
from hardware_drivers.xplane_link import XPlaneLink
from hardware_drivers.xplane_messages import Position
from hardware_drivers.xplane_state import shown_at

SHOWN_AT = Geodetic(49.5, -3.0)  # where a hardware file without an origin puts it: open water of the Channel
FASTEST_HZ = 60.0  # of poses; X-Plane draws about so many frames a second
ASK_S, SILENT_S = 0.5, 2.0  # X-Plane is asked so often, and lost after so long without an answer
CONNECT_S = 2.0
NS = 1e9


@dataclass(frozen=True)
class Film:
    """Poses to show, and when."""

    times_s: np.ndarray  # (n,) since the first pose of the bag, rising [s]
    positions: tuple[Position, ...]
    left_out: int  # poses that cannot be shown: unreadable, not finite, or not later than the one before

    @property
    def duration_s(self) -> float:
        """Between the first and the last pose [s]."""
        return float(self.times_s[-1] - self.times_s[0])


@dataclass(frozen=True)
class Shown:
    """Result of showing."""

    poses: int  # sent
    rounds: int
    late_ms_p99: float  # behind the pace [ms]


def film_of(bag: Bag, *, topics: Sequence[str] | None = None, start_s: float = 0.0) -> Film:
    """Poses of a bag, on the Earth where `configs/hardware/xplane.yaml` has its origin.

    Args:
        bag: The bag.
        topics: Name of one odometry, relative to the robot's namespace or absolute; the robot's own by default.
        start_s: Leave out so much of the beginning [s].

    Raises:
        BagError: There is no pose to show.
        ConfigError: Unknown or several topics, or a start beyond the end.
    """
    driver = load_hardware("xplane").driver
    assert isinstance(driver, XPlane)
    origin = driver.origin or SHOWN_AT
    found = odometries(bag.odometry(_chosen(bag, topics)))
    times_ns = found.stamp_ns if len(np.unique(found.stamp_ns)) > 1 else found.log_ns
    norms = np.linalg.norm(found.pose[:, 3:], axis=1)
    sound = np.isfinite(found.pose).all(axis=1) & (np.abs(norms - 1.0) < 0.01)
    kept, newest = [], -np.inf
    for index in np.flatnonzero(sound).tolist():
        if times_ns[index] > newest:
            kept.append(index)
            newest = times_ns[index]
    if not kept:
        raise BagError(f"{bag.path}: holds no pose that can be shown.")
    times_s = (times_ns[kept] - times_ns[kept[0]]) / NS
    first = int(np.searchsorted(times_s, start_s))
    if first == len(kept):
        raise ConfigError(f"--start {start_s:g}: the bag is {times_s[-1]:.2f} s long. Begin earlier.")
    frame = LocalFrame(origin.latitude, origin.longitude)
    still = np.zeros(3)
    positions = tuple(
        shown_at(RigidBodyState(pose[:3], pose[3:], still, still), frame, driver.elevation)
        for pose in found.pose[kept[first:]]
    )
    return Film(times_s[first:], positions, len(found) + found.left_out - len(kept))


def _chosen(bag: Bag, topics: Sequence[str] | None) -> str | None:
    if not topics:
        return None
    if len(topics) > 1:
        raise ConfigError(f"--to xplane shows one robot: give one --topic, not {len(topics)}.")
    absolute = topics[0] if topics[0] in bag.topics else f"{bag.prefix}{topics[0]}"
    if absolute not in bag.topics:
        raise UnknownNameError("topic", topics[0], [bag.relative(name) for name in bag.topics])
    return absolute


def show(
    film: Film, port: str, *, rate: float = 1.0, loop: bool = False, stop: threading.Event | None = None
) -> Shown:
    """Show a film; X-Plane is paused before it, and stays paused after it.

    Args:
        film: From `film_of`.
        port: udp://host:port of the plugin.
        rate: Seconds of the run in a wall-clock second, > 0.
        loop: Begin again at the end, until Ctrl-C.
        stop: Ends it early.

    Raises:
        DeviceError: No X-Plane answers, or it does not pause, or it falls silent.
    """
    stop = stop or threading.Event()
    link = XPlaneLink(port, within_s=CONNECT_S)
    projector = _Projector(film, link, rate, stop)
    rounds = 0
    try:
        link.pause()
        while not stop.is_set():
            projector.show_once()
            rounds += 1
            if not loop:
                break
    except KeyboardInterrupt:
        pass
    finally:
        link.close()
    late = projector.late_ms
    return Shown(projector.count, rounds, float(np.percentile(late, 99)) if late else 0.0)


class _Projector:
    """Sends poses by absolute deadlines on a steady clock."""

    def __init__(self, film: Film, link: XPlaneLink, rate: float, stop: threading.Event) -> None:
        self._film, self._link, self._rate, self._stop = film, link, rate, stop
        self._ask_s = 0.0
        self.count = 0
        self.late_ms: list[float] = []

    def show_once(self) -> None:
        """Show the film from its beginning.

        Raises:
            DeviceError: X-Plane has fallen silent.
        """
        times, began, index = self._film.times_s, time.monotonic(), 0
        while index < len(times):
            due = began + (times[index] - times[0]) / self._rate
            while (ahead := due - time.monotonic()) > 0.0:
                self._look()
                if self._stop.wait(min(ahead, ASK_S)):
                    return
            self._link.send(self._film.positions[index])
            self.count += 1
            self.late_ms.append(1e3 * (time.monotonic() - due))
            self._look()
            if index == len(times) - 1:
                return
            # Poses between two frames are left out, the last one never is.
            after = int(np.searchsorted(times, times[index] + self._rate / FASTEST_HZ - 1e-9))
            index = min(max(index + 1, after), len(times) - 1)

    def _look(self) -> None:
        """Ask X-Plane now and then whether it is there."""
        now = time.monotonic()
        if now >= self._ask_s:
            self._ask_s = now + ASK_S
            self._link.ask()
        self._link.check(SILENT_S)
