"""Readings in any order of arrival to one filter: what came late is taken in at its own time.

A pose is as old as its capture, and inertial readings have come since: the filter goes back to the time of capture,
takes the pose in, and repeats what came after it.
"""

from __future__ import annotations

import bisect
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from fulmar_core.estimators.motion.estimator import LACKS_NOTHING, Estimate
from fulmar_core.estimators.motion.filter import ATTITUDE, IMU, POSE, Filter, Placed
from fulmar_core.estimators.motion.frozen import EXACT, FrozenSources, Noise
from fulmar_core.estimators.motion.inertial_prediction import InertialPredictions
from fulmar_core.estimators.motion.reading_problems import inertial_problem, pose_problem, saturation
from fulmar_core.estimators.motion.reading_times import ReadingTimes
from fulmar_core.estimators.motion.settings import MotionSettings
from fulmar_core.estimators.motion.strangers import CONTRADICT_NS, TO_BEGIN_ANEW_NS, Stranger, Strangers
from fulmar_core.robots.robot import Limits
from fulmar_core.wires.reading import Reading

S = TypeVar("S", bound=MotionSettings)

KEPT_NS = 1_000_000_000  # how far back an estimate can be corrected
READING_LASTS_NS = 60_000_000  # how long after it an inertial reading still stands for what happens
WHAT = {IMU: "inertial reading", POSE: "pose", ATTITUDE: "attitude"}  # for people
LATELY_NS = 10_000_000_000  # how long after it began anew unexpected poses are asked more of
LATE_STD_S = 0.05  # by how much the latency of poses may differ from that of the settings [s]
SEPARATION = (
    100.0  # squared distance of estimate and inertial readings that no noise makes: 10 standard deviations
)
CONTRADICTION = (
    "motion capture and inertial readings contradict each other: neither is trusted until they agree on a motion. "
    "Turn the robot by hand and hold it, or restart the estimator"
)
NO_POSE = "no pose yet. Is the motion capture running, and does it see the robot?"


@dataclass(slots=True)
class Event:
    """Something that was measured, and what was believed after it."""

    stamp_ns: int
    kind: int
    value: Any  # what the filter takes of this kind
    after: Any = None  # snapshot of the filter

    @property
    def key(self) -> tuple[int, int]:
        """Order: by time, then by kind."""
        return self.stamp_ns, self.kind


class HistoryEstimator(ABC, Generic[S]):
    """An `Estimator` that keeps a second of readings; each kind says what its filter takes of them.

    Attributes:
        what: Names of the readings that it takes.
    """

    KNOWN_SPEED_STD: ClassVar[float] = 0.15  # of the velocity, before an estimate is published [m/s]

    def __init__(
        self,
        settings: S,
        limits: Limits,
        *,
        gyroscope_range: float = math.inf,
        noise: Noise = EXACT,
    ) -> None:
        """Begin without an estimate.

        Args:
            settings: What to believe of the sensors.
            limits: What the robot can possibly do.
            gyroscope_range: Largest turn rate about an axis that inertial readings have [rad/s].
            noise: Which sources have any, and so never repeat a value.
        """
        self._gyroscope_range = gyroscope_range
        self._settings: S = settings
        self._limits = limits
        self._gate, self._bridge_s = settings.gate, settings.bridge_s
        self._slack = 10.0 * settings.position_std  # distance between two poses that their noise explains [m]
        self._frozen = FrozenSources(noise, bridge_s=settings.bridge_s)
        self._strangers = Strangers(
            speed=limits.speed, slack=self._slack, turn_slack=10.0 * settings.pose_turn_std
        )
        self._predictions = InertialPredictions(
            lambda: self._new_filter(self._first_pose),
            gap_ns=READING_LASTS_NS,
            late_std_s=LATE_STD_S,
        )
        self._latency_ns = round(1e9 * settings.latency_s)  # from capture of a pose to its stamp
        self._kinds: Mapping[str, tuple[int, Callable[[Reading], Any]]] = {
            "mocap": (POSE, self._pose),
            "imu": (IMU, self._inertial),
            "star_tracker": (ATTITUDE, self._attitude),
        }
        self.reset()

    @abstractmethod
    def _pose(self, reading: Reading) -> Any:
        """What the filter takes of a valid pose."""

    @abstractmethod
    def _inertial(self, reading: Reading) -> Any:
        """What the filter takes of a valid inertial reading."""

    @abstractmethod
    def _attitude(self, reading: Reading) -> Any:
        """What the filter takes of a valid attitude."""

    @abstractmethod
    def _new_filter(self, pose: Any) -> Filter:
        """A filter that begins at a pose, knowing little else."""

    @abstractmethod
    def _placed(self, pose: Any) -> Placed:
        """Position and attitude of a pose."""

    @abstractmethod
    def _value(self) -> tuple[Any, np.ndarray]:
        """Value and covariance of what the filter believes now."""

    @abstractmethod
    def _turn_rate(self, reading: Reading) -> float:
        """Turn rate of an inertial reading that the robot's limits bound [rad/s]."""

    def _believed(self, reading: Reading) -> None:
        """Note a pose that is believed."""

    def reset(self) -> None:
        """See `Estimator`."""
        self.outliers, self.epoch = 0, 0
        self._forget()

    def take(self, name: str, reading: Reading) -> str | None:
        """See `Estimator`; the latency of the settings is taken off the stamps of poses here."""
        if name not in self._kinds:
            return f"reading '{name}' is not known here, only {', '.join(self._kinds)}"
        if reading.stamp_ns is None:
            return f"reading of '{name}' has no stamp"
        kind, value_of = self._kinds[name]
        stamp_ns = reading.stamp_ns - (self._latency_ns if kind == POSE else 0)
        if kind == IMU:
            problem = inertial_problem(reading, self._turn_rate, self._limits.yaw_rate)
        else:
            problem = pose_problem(WHAT[kind], reading)
        saturated = saturation(reading, self._gyroscope_range) if kind == IMU else ""
        if problem and not saturated:
            return problem
        if time_problem := self._times.problem(f"the {WHAT[kind]}", stamp_ns):
            return time_problem
        if kind == IMU:
            self._saturated = saturated
            self._lacks = reading.value.lacks
        if problem or saturated:
            return problem or saturated
        if repetition := self._repetition(kind, reading, stamp_ns):
            return repetition
        return self._see(Event(stamp_ns, kind, None), value_of, reading) or None

    def _repetition(self, kind: int, reading: Reading, stamp_ns: int) -> str:
        """Why a reading is none, as its source only repeats itself; empty if it is one."""
        if kind == POSE:
            return self._frozen.pose_problem(reading.value, stamp_ns)
        return self._frozen.inertial_problem(reading.value, stamp_ns) if kind == IMU else ""

    def _see(self, event: Event, value_of: Callable[[Reading], Any], reading: Reading) -> str:
        if self._filter is None:
            if event.kind == POSE:
                event.value = value_of(reading)
                self._begin(event)
                self._trust(event, reading)
            return ""  # nothing else is of use before the first pose
        event.value = value_of(reading)
        if event.kind == IMU:
            self._insert(event)
            self._predictions.move(event.stamp_ns, event.value)
            return ""
        if not self._believe(event):
            return self._contradiction or (
                f"{WHAT[event.kind]} lies beyond the gate: {self.outliers} outliers so far"
            )
        if event.kind == POSE:
            self._trust(event, reading)
        return ""

    def _trust(self, event: Event, reading: Reading) -> None:
        self._believed_ns = event.stamp_ns
        self._believed(reading)

    def warnings(self) -> tuple[str, ...]:
        """Sources that are not trusted; see `Estimator.warnings`."""
        found = (*self._frozen.words(), self._contradiction, self._bias_problem())
        return tuple(words for words in found if words)

    def status(self) -> dict[str, str]:
        """What the newest inertial reading lacks; see `Estimator`."""
        return {"lacks": self._lacks or LACKS_NOTHING}

    def estimate(self, stamp_ns: int | None = None) -> Estimate | None:
        """See `Estimator`."""
        newest_ns = self._history[-1].stamp_ns if self._history else 0
        stamp_ns = newest_ns if stamp_ns is None else max(stamp_ns, newest_ns)
        self.problem = self._staleness(stamp_ns)
        if self.problem or self._filter is None:
            return None
        now = self._filter.snapshot()
        if stamp_ns > newest_ns:
            self._move_on(len(self._history), stamp_ns)
        value, covariance = self._value()
        self._filter.restore(now)
        return Estimate(value, covariance, stamp_ns)

    def _staleness(self, stamp_ns: int) -> str:
        if self._filter is None:
            return NO_POSE
        if (
            problem := self._saturated
            or self._frozen.pose_words
            or self._contradiction
            or self._bias_problem()
        ):
            return problem
        gap_s = (stamp_ns - self._believed_ns) / 1e9
        if gap_s > self._bridge_s:
            return f"no believable pose for {gap_s:.2f} s (limit {self._bridge_s:g} s)"
        if self._filter.speed_std() > self.KNOWN_SPEED_STD:
            return "the velocity is not known well enough yet"
        return ""

    def _bias_problem(self) -> str:
        """Which bias no sound sensor has; empty if both are possible."""
        if self._filter is None:
            return ""
        for name, bias, most, unit in zip(
            ("accelerometer", "gyroscope"),
            self._filter.biases(),
            (self._settings.accelerometer_bias, self._settings.gyroscope_bias),
            ("m/s²", "rad/s"),
            strict=True,
        ):
            if bias > most:
                return f"the bias of the {name} is beyond the possible {most:g} {unit}: it drifts"
        return ""

    def _forget(self) -> None:
        self._filter: Filter | None = None
        self._saturated = ""  # why the newest inertial reading has no turn rate
        self._lacks = ""  # of accelerometer and gyroscope, in the newest inertial reading
        self._history: list[Event] = []
        self._times: ReadingTimes = ReadingTimes(self._begin_epoch)
        self._believed_ns = 0
        self._contradiction = ""
        self._anew_ns = -LATELY_NS  # when unexpected poses were believed in the end
        self._strangers.forget()
        self._predictions.forget()
        self._frozen.forget()
        self.problem = NO_POSE

    def _begin(self, event: Event) -> None:
        self._first_pose = event.value
        self._filter = self._new_filter(event.value)
        event.after = self._filter.snapshot()
        self._history = [event]
        self._contradiction = ""
        self._strangers.forget()
        self._predictions.forget()

    def _begin_epoch(self) -> None:
        self._forget()
        self.epoch += 1

    def _believe(self, event: Event) -> bool:
        """Insert a pose or an attitude if it is no outlier."""
        assert self._filter is not None
        at = self._place_of(event)
        if at == 0:  # captured before everything that is remembered: too late to matter, but no lie
            return not self._contradiction
        self._rewind(at)
        self._move_on(at, event.stamp_ns)
        is_pose = event.kind == POSE
        if not (is_pose and self._contradiction) and (
            self._filter.distance2(event.kind, event.value) <= self._gate
        ):
            self._insert(event, is_there=at == len(self._history))
            return not is_pose or self._is_consistent()
        self.outliers += 1
        stranger = self._stranger(event) if is_pose else None
        self._replay(at)
        return stranger is not None and self._meet(stranger, event)

    def _stranger(self, event: Event) -> Stranger:
        """An unexpected pose, beside what the filter believes of its time."""
        assert self._filter is not None
        f = self._filter
        seen = self._placed(event.value)
        return Stranger(event.stamp_ns, seen, f.placed(), f.speed_std(), f.rate_std())

    def _meet(self, stranger: Stranger, event: Event) -> bool:
        """Whether to begin anew at an unexpected pose, as those before it move as the inertial readings say."""
        lately = event.stamp_ns - self._anew_ns < LATELY_NS
        agreement = self._strangers.meet(stranger, for_ns=TO_BEGIN_ANEW_NS if lately else CONTRADICT_NS)
        if agreement is None:
            return False
        if not (agreement.closely if lately else agreement.agrees):
            self._contradiction = CONTRADICTION
        if not (agreement.proves if self._contradiction else agreement.lasts):
            return False
        before = None if self._contradiction else self._filter
        self._begin(event)
        if before is not None:
            assert self._filter is not None
            self._filter.keep_biases(before)
            self._history[0].after = self._filter.snapshot()
        self._anew_ns = event.stamp_ns
        self.epoch += 1
        return True

    def _is_consistent(self) -> bool:
        """Whether poses and inertial readings of the last seconds go together; if not, neither is trusted."""
        assert self._filter is not None
        self._strangers.forget()
        now_ns = self._history[-1].stamp_ns
        if self._predictions.separation2(self._filter, now_ns) <= SEPARATION:
            self._predictions.renew(self._filter, now_ns)
            return True
        self._contradiction = CONTRADICTION
        self._go_on_by_inertial_readings()
        return False

    def _go_on_by_inertial_readings(self) -> None:
        """Go back to before the poses that cannot be true, as far as inertial readings were moved on without them."""
        prediction = self._predictions.oldest
        assert prediction is not None and self._filter is not None
        after = prediction.filter.snapshot()
        self._filter.restore(after)
        self._history = [Event(prediction.stamp_ns, IMU, prediction.inertial, after)]
        self._predictions.forget()

    def _insert(self, event: Event, *, is_there: bool = False) -> None:
        """Take an event in at its time; `is_there`: it is the newest, and the filter has moved to it."""
        assert self._filter is not None
        at = len(self._history) if is_there else self._place_of(event)
        if at == 0:
            return
        self._history.insert(at, event)
        if is_there:
            self._filter.correct(event.kind, event.value)
            event.after = self._filter.snapshot()
        else:
            self._replay(at)
        oldest = self._history[-1].stamp_ns - KEPT_NS
        while self._history[0].stamp_ns < oldest and len(self._history) > 1:
            del self._history[0]

    def _place_of(self, event: Event) -> int:
        """Where an event belongs in the history: after those of its time and kind. Most are the newest."""
        history = self._history
        if history and history[-1].key <= event.key:
            return len(history)
        return bisect.bisect_right(history, event.key, key=lambda past: past.key)

    def _rewind(self, at: int) -> None:
        """Believe what was believed before event number `at`."""
        assert self._filter is not None
        self._filter.restore(self._history[at - 1].after)

    def _replay(self, at: int) -> None:
        """Do event number `at` and everything after it, once more."""
        assert self._filter is not None
        self._rewind(at)
        for number in range(at, len(self._history)):
            event = self._history[number]
            self._move_on(number, event.stamp_ns)
            self._filter.correct(event.kind, event.value)
            event.after = self._filter.snapshot()

    def _move_on(self, at: int, stamp_ns: int) -> None:
        """Predict from the event before number `at` to a time, by the reading that stands for that time."""
        assert self._filter is not None
        seconds = (stamp_ns - self._history[at - 1].stamp_ns) / 1e9
        self._filter.move_on(seconds, self._inertial_for(at, stamp_ns))

    def _inertial_for(self, at: int, stamp_ns: int) -> Any:
        """The first reading at or after the end of the span, else the last before it, if it is near enough."""
        history = self._history
        for number in (*range(at, min(at + 3, len(history))), *range(at - 1, max(0, at - 20) - 1, -1)):
            event = history[number]
            if event.kind == IMU and abs(event.stamp_ns - stamp_ns) <= READING_LASTS_NS:
                return event.value
        return None
