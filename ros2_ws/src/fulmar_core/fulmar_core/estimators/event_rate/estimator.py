"""Turn rate from the events of one or two cameras that look at the stars, window after window.

Readings: `events` and `events_2` are packets of `Events`, stamped at their end. The estimate is the turn rate about the
body's axes, shape (3,) [rad/s], with its covariance (3, 3), stamped at the middle of its window.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np

from fulmar_core.dynamics.sky.events import Events, joined
from fulmar_core.estimators.event_rate.contrast import RateFit, fit_rate
from fulmar_core.estimators.event_rate.star_tracks import Tracks, find_tracks
from fulmar_core.estimators.motion.estimator import Estimate
from fulmar_core.estimators.motion.reading_times import ReadingTimes
from fulmar_core.estimators.motion.settings import EventRateSettings
from fulmar_core.robots.sensors.star_camera import StarCamera
from fulmar_core.wires.reading import Reading

AXES = "xyz"
NO_EVENTS = "no events yet. Does the camera run?"
# Motion of stars in a window, and in the longest one: events of less show pixels rather than a rate [px]
LEAST_PX, LEAST_PX_LONG = 1.0, 0.5
BOUND_PX = 2.0  # a star that moves so far in a window makes events enough to be found
UNKNOWN_STD = 1.0  # of an axis about which nothing is observable [rad/s]
LATE_NS, EARLY_NS = 10_000_000_000, 1_000_000_000  # from an event to the stamp of its packet, at most [ns]
APART_NS = 1_000_000_000  # between packets of two cameras that come one after the other, at most [ns]
APART_PACKETS = 100  # of one camera alone that are of another time: then the other camera has fallen silent
SILENT = 3  # windows without a camera's events, after which the other goes on alone


class EventRateEstimator:
    """See `estimators.motion.estimator.Estimator`.

    Attributes:
        bound: Upper bound of the turn rate across the boresight where no star moves; None where one does [rad/s].
        fit: Of the newest window; None where it has none.
        packets_lost: Packets that did not come, by the time between those that did.
    """

    def __init__(self, settings: EventRateSettings, cameras: tuple[StarCamera, ...]) -> None:
        """Begin without an estimate; one or two cameras."""
        self._settings = settings
        self._cameras = dict(zip(("events", "events_2"), cameras, strict=False))
        self.reset()

    def reset(self) -> None:
        """See `Estimator.reset`."""
        self.outliers, self.epoch, self.packets_lost = 0, 0, 0
        self._forget()

    def _forget(self) -> None:
        self.problem = NO_EVENTS
        self.fit: RateFit | None = None
        self.bound: float | None = None
        self._packets: dict[str, deque[tuple[int, Events]]] = {name: deque() for name in self._cameras}
        self._times = ReadingTimes(self._begin_epoch)
        self._spacing_ns: dict[str, int] = {}  # shortest time between two packets, by camera
        self._until_ns: dict[str, int] = {}  # end of the newest packet, by camera
        self._window_ns = self._begun_ns = -1  # where the next window begins, and where the first one began
        self._newest = ("", 0)  # camera and end of the newest packet that was taken
        self._apart = 0  # packets of the other camera since then that were too far from it
        self._estimate: Estimate | None = None
        self._noise_hz = 0.0
        self._events_hz = 0.0

    def _begin_epoch(self) -> None:
        self._forget()
        self.epoch += 1

    def take(self, name: str, reading: Reading) -> str | None:
        """See `Estimator.take`."""
        if name not in self._cameras:
            return f"reading '{name}' is not known here, only {', '.join(self._cameras)}"
        packet: Events = reading.value
        camera = self._cameras[name]
        if not packet.width:  # a message does not say how large its camera is
            packet = replace(packet, width=camera.width, height=camera.height)
        if (packet.width, packet.height) != (camera.width, camera.height):
            its, ours = f"{packet.width} × {packet.height}", f"{camera.width} × {camera.height}"
            return f"packet of '{name}' comes from a camera of {its} pixels, and the robot's has {ours}"
        if problem := packet.problem():
            return f"packet of '{name}': {problem}"
        if problem := self._clock_problem(name, packet, reading.stamp_ns):
            return problem
        if problem := self._times.problem(f"'{name}'", reading.stamp_ns):
            return problem
        end_ns = reading.stamp_ns or 0
        self._newest, self._apart = (name, end_ns), 0
        self._count_lost(name, end_ns)
        self._until_ns[name] = end_ns
        self._packets[name].append((end_ns, packet))
        if self._window_ns < 0:
            begin = int(packet.t[0]) if len(packet) else end_ns
            self._window_ns = self._begun_ns = begin
        self._run()
        return None

    def _clock_problem(self, name: str, packet: Events, end_ns: int | None) -> str:
        """Why the times of a packet are of another clock than its stamp, or than the packets of the other camera."""
        if end_ns is None:
            return ""
        if len(packet):
            late_ns = (end_ns - int(packet.t[0]), end_ns - int(packet.t[-1]))
            if max(late_ns) > LATE_NS or min(late_ns) < -EARLY_NS:
                worst_s = max(late_ns, key=abs) / 1e9
                return (
                    f"packet of '{name}': its events lie {worst_s:.6g} s before its stamp, of another clock"
                )
        other, other_ns = self._newest
        if other in ("", name) or abs(end_ns - other_ns) <= APART_NS or self._apart >= APART_PACKETS:
            return ""
        self._apart += 1
        apart_s = (end_ns - other_ns) / 1e9
        return f"packet of '{name}' is {apart_s:+.6g} s apart from those of '{other}': their clocks differ"

    def _count_lost(self, name: str, end_ns: int) -> None:
        last_ns = self._until_ns.get(name)
        if last_ns is not None:
            spacing_ns = min(self._spacing_ns.get(name, end_ns - last_ns), end_ns - last_ns)
            self._spacing_ns[name] = spacing_ns
            self.packets_lost += round((end_ns - last_ns) / spacing_ns) - 1

    def estimate(self, stamp_ns: int | None = None) -> Estimate | None:
        """See `Estimator.estimate`: that of the newest window, until it is `bridge_s` old; its stamp is its own."""
        if self._estimate is not None:
            age_s = (max(self._until_ns.values()) - self._estimate.stamp_ns) / 1e9
            if age_s > self._settings.bridge_s:
                self._estimate = None
                self.problem = self.problem or f"no rate for {age_s:.1f} s"
        return self._estimate

    def warnings(self) -> tuple[str, ...]:
        """None; see `Estimator.warnings`."""
        return ()

    def status(self) -> dict[str, str]:
        """See `Estimator.status`."""
        found = {"noise_hz_per_pixel": f"{self._noise_hz:.3g}", "events_per_s": f"{self._events_hz:.0f}"}
        found["packets_lost"] = str(self.packets_lost)
        found["stars"] = str(self.fit.stars if self.fit else 0)
        found["not_observable"] = ", ".join(self._unobservable()) or "none"
        if self.bound is not None:
            found["rate_at_most_deg_s"] = f"{np.degrees(self.bound):.4f}"
        return found

    def _unobservable(self) -> list[str]:
        if self.fit is None:
            return list(AXES)
        limit = np.radians(self._settings.limit_deg)
        return [axis for axis, var in zip(AXES, np.diag(self.fit.covariance), strict=True) if var > limit**2]

    def _run(self) -> None:
        """Estimate every window that all cameras have seen to its end."""
        length_ns = round(1e9 * self._settings.window_s)
        while True:
            end_ns = self._window_ns + length_ns
            newest = max(self._until_ns.values())
            waiting = [name for name in self._cameras if self._until_ns.get(name, -1) < end_ns]
            if newest < end_ns or (waiting and newest < end_ns + SILENT * length_ns):
                return
            self._window(end_ns)
            self._window_ns = end_ns

    def _window(self, end_ns: int) -> None:
        """Estimate the window that ends at a time; where it shows too little, with those before it as one."""
        s = self._settings
        self.fit = None
        for seconds, least_px in ((s.window_s, LEAST_PX), (s.longest_s, LEAST_PX_LONG)):
            begin_ns = max(end_ns - round(1e9 * seconds), self._begun_ns)
            tracks = self._tracks(begin_ns, end_ns)
            if not tracks:
                self.problem = "no events in this window"
                return
            start = self._estimate.value if self._estimate is not None and self._fresh(end_ns) else None
            fit = fit_rate(list(tracks.values()), [self._cameras[name] for name in tracks], start=start)
            moved = (
                fit is not None
                and fit.stars >= s.least_stars
                and fit.speed_px * (end_ns - begin_ns) >= 1e9 * least_px
            )
            if fit is not None and moved and self._is_good(fit):
                covariance = np.minimum(fit.covariance, UNKNOWN_STD**2)
                self.fit, self.bound, self.problem = replace(fit, covariance=covariance), None, ""
                self._estimate = Estimate(fit.rate, covariance, (begin_ns + end_ns) // 2)
                return
        focal = max(camera.focal_px for camera in self._cameras.values())
        found = sum(each.count for each in tracks.values())
        if found:
            self.bound = None
            self.problem = (
                f"{found} stars move in this window: too few for a rate ({s.least_stars} are needed)"
            )
        else:
            self.bound = BOUND_PX / (s.longest_s * focal)
            most = f"{np.degrees(self.bound):.4f} °/s"
            self.problem = f"no star moves: the body turns across its boresights by less than {most}"

    def _fresh(self, end_ns: int) -> bool:
        """Whether the last estimate is a start for the window that ends at a time."""
        assert self._estimate is not None
        return end_ns - self._estimate.stamp_ns < 2.1e9 * self._settings.window_s

    def _is_good(self, fit: RateFit) -> bool:
        """Whether a fit is a rate that can be, and determines the two axes across a boresight at least."""
        if not np.isfinite(fit.covariance).all() or np.linalg.norm(fit.rate) > np.radians(
            self._settings.fastest_deg
        ):
            return False
        return bool(np.linalg.eigvalsh(fit.covariance)[1] < np.radians(self._settings.limit_deg) ** 2)

    def _tracks(self, begin_ns: int, end_ns: int) -> dict[str, Tracks]:
        """Tracks of stars in each camera that has events in a window."""
        found, events = {}, 0
        for name, packets in self._packets.items():
            while packets and packets[0][0] <= end_ns - round(1e9 * self._settings.longest_s) - 1:
                packets.popleft()
            inside = [packet for until_ns, packet in packets if until_ns > begin_ns and len(packet)]
            if not inside:
                continue
            window = joined(inside).between(begin_ns, end_ns)
            if len(window):
                found[name] = find_tracks(window, begin_ns, end_ns)
                events += len(window)
                self._noise_hz = found[name].noise_hz
        self._events_hz = events / max((end_ns - begin_ns) / 1e9, 1e-9)
        return found
