"""The node `estimator`: readings of sensors to one estimate, of whatever kind its file in configs/estimators names.

What each kind takes and publishes is a row of `fulmar_core.estimators.kinds`; how messages become readings, and
estimates messages, is a row of `estimator_wires`.
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from fulmar_bags.message_reader import stamp_ns
from fulmar_bags.reading_messages import Read, reader_of
from fulmar_core.config.errors import shortened
from fulmar_core.config.process import CONTROL_PRIORITY, take_priority_with_helpers
from fulmar_core.estimators.kinds import estimator_kind, load_estimator, make_estimator
from fulmar_core.estimators.motion.estimator import LACKS_NOTHING, Estimate
from fulmar_core.estimators.readings import reading_problem, readings_of
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ODOMETRY, Wire
from fulmar_core.robots.wire_check import BETWEEN, WIRE_WARNINGS
from fulmar_core.wires.reading import Reading
from fulmar_ros.bytes_reader import BytesReader
from fulmar_ros.deadline import Spread
from fulmar_ros.estimator_wires import WRITERS, Write
from fulmar_ros.frame_wires import odometry_transform
from fulmar_ros.graph import WireWatch, WriterWatch
from fulmar_ros.health import Health
from fulmar_ros.lockstep_answer import LockstepAnswer
from fulmar_ros.message_class import needed_class
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.parameters import name_of, own_frames, read_parameters
from fulmar_ros.qos import EVERYTHING, LAST_WORDS_S, publisher_qos, subscriber_qos
from fulmar_ros.runtime import RequestExit, run_node

WATCH_S = 0.1
STATUS_PERIOD_S = 0.5
DEPTHS = {"best_effort": 5, "stream": 50}  # by delivery: of a stream each reading counts
BROKEN = "the estimator began anew after a message that it cannot use, of"
NEW_EPOCH_NS = 1_000_000_000  # an estimate so much older than the last one is of a new epoch


@dataclass(frozen=True)
class EstimatorNodeSettings:
    """ROS parameters of the estimator node."""

    robot: str = "floating_platform"
    estimator: str = "mocap_imu"  # name of a file in configs/estimators, or a path that ends in .yaml
    lockstep: bool = False  # answer the periods of a plant in lock step
    upstream: tuple[str, ...] = ("",)  # in lock step: other nodes whose outputs are inputs of this one
    exact_sensors: bool = False  # they measure without noise, as in some simulations: they may repeat a value
    wait_for_subscribers: int = 0  # in lock step: of each output, before the first answer
    transforms: bool = True  # publish /tf, where tf2_msgs is installed; off where another node does


class EstimatorNode(Node):
    """Answers every reading with the newest estimate, or in lock step every period, as long as it is not stale."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Begin without an estimate.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter or a file is wrong.
        """
        super().__init__("estimator", cli_args=cli_args)
        settings = read_parameters(self, EstimatorNodeSettings)
        robot = load_robot(settings.robot)
        kind = estimator_kind(settings.estimator, robot)
        self._robot = robot
        self._estimator = make_estimator(settings.estimator, robot, exact_sensors=settings.exact_sensors)
        self._bridge_s = load_estimator(settings.estimator).bridge_s
        self._frames = own_frames(self, robot)
        self._published_ns = -1
        self._published, self._refused = 0, 0
        self._problem, self._refusal = self._estimator.problem, ""
        self._computation_ms = Spread()  # of each reading
        self._received_s = time.monotonic()
        self._prior = settings.lockstep  # whether this thread has what priority it needs
        self._said: tuple[object, ...] = ()
        self._said_s = 0.0
        self._outputs = [self._output(wire, lockstep=settings.lockstep) for wire in kind.publishes]
        self._transform = odometry_transform(
            self,
            self._frames,
            wanted=settings.transforms and ODOMETRY in kind.publishes,
            lockstep=settings.lockstep,
        )
        self._every_ns = round(1e9 * kind.every_s)
        more = []
        if kind.status is not None:
            more.append(self.create_publisher(DiagnosticArray, kind.status.name, publisher_qos(kind.status)))
        self._health = Health(self, f"{name_of(self, robot)}: {self.get_name()}", *more)
        self._wire_watch = WireWatch(self, dict.fromkeys(kind.readings.values(), settings.lockstep))
        self._period: LockstepAnswer | None = None
        topics, followed = {}, {}
        for name, wire in kind.readings.items():
            topics[self.resolve_topic_name(wire.name)] = name
            followed[wire.name] = self._subscribe(name, wire, lockstep=settings.lockstep)
        self._writer_watch = WriterWatch(self, followed)
        self._contested = ""
        if settings.lockstep:
            self._period = LockstepAnswer(
                self,
                topics,
                self._compute,
                [publisher for publisher, _ in self._outputs],
                take=self._take_early,
                upstream=[node for node in settings.upstream if node],
                silent=[topic for topic, name in topics.items() if _is_lacking(name, robot)],
                wait_for_subscribers=settings.wait_for_subscribers,
            )
        self.create_timer(WATCH_S, self._publish_status, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _output(self, wire: Wire, *, lockstep: bool) -> tuple[Publisher, Write]:
        kind, writer = WRITERS[wire]
        return self.create_publisher(kind, wire.name, publisher_qos(wire, lockstep=lockstep)), writer(
            self._frames
        )

    def _subscribe(self, name: str, wire: Wire, *, lockstep: bool) -> list[Subscription]:
        kind, read = needed_class(wire), reader_of(readings_of(self._robot)[name])
        depth = EVERYTHING if lockstep else DEPTHS[wire.delivery]
        receive = partial(self._on_message, name, self.resolve_topic_name(wire.name), read)
        if lockstep:
            qos = subscriber_qos(wire, reliable=True, depth=depth, lossless=True)
            return [
                self.create_subscription(kind, wire.name, BytesReader(kind).passing(receive), qos, raw=True)
            ]
        return subscribe_every(self, kind, wire, receive, depth=depth)

    def _on_message(self, name: str, topic: str, read: Read, message: Any) -> None:
        reading = self._unbroken(name, read, message, self._frames)
        if self._period is not None:
            self._period.add(topic, stamp_ns(message.header.stamp), reading)
        elif reading is not None and self._take(name, reading):
            self._publish()

    def _take(self, name: str, reading: Reading | str) -> bool:
        """Whether the estimator takes a reading; if not, the status says why."""
        if not self._prior:
            take_priority_with_helpers(CONTROL_PRIORITY)  # a controller waits for us
            self._prior = True
        begun_s = time.perf_counter()
        words: str | None = reading if isinstance(reading, str) else None
        refusal = self._see_writers() or words or self._unbroken(name, self._refusal_of, name, reading)
        self._computation_ms.add(1e3 * (time.perf_counter() - begun_s))
        if refusal is not None:
            self._refused += 1
            self._refusal = refusal
            return False
        self._received_s = time.monotonic()
        return True

    def _see_writers(self) -> str:
        """Why no reading is taken: one of them comes from two nodes, and an estimate of both is of no use."""
        contested = self._writer_watch.look(time.monotonic_ns())
        if contested != self._contested:
            self._contested = contested
            self._estimator.reset()
        return contested

    def _unbroken(self, name: str, use: Callable[..., Any], *given: Any) -> Any:
        """What a function makes of a message; where it raises, its error in words, and the estimator begins anew.

        Without an estimator a robot has no estimate at all: it never ends by a message, whatever that holds.
        """
        try:
            return use(*given)
        except Exception as error:  # noqa: BLE001 - whatever a message holds must not end the estimates
            self.get_logger().error(traceback.format_exc())
            self._estimator.reset()
            return f"{BROKEN} '{name}': {type(error).__name__}: {shortened(str(error))}"

    def _refusal_of(self, name: str, reading: Reading) -> str | None:
        return reading_problem(name, reading, self._robot) or self._estimator.take(name, reading)

    def _publish(self) -> None:
        """Publish the estimate, if it is newer than the last one."""
        estimate = self._estimate(None)
        if estimate is None or not self._is_new(estimate):
            return
        for publisher, message in self._messages(estimate):
            publisher.publish(message)
        self._note(estimate)

    def _compute(self, period_ns: int, readings: list[tuple[str, Any]]) -> list[tuple[Publisher, Any]]:
        """Take the readings of a period of lock step; returns the estimate at its end, to be published."""
        for name, reading in readings:
            self._take_early(name, reading)
        estimate = self._estimate(period_ns)
        if self._contested or estimate is None or not self._is_new(estimate):
            return []
        self._note(estimate)
        return self._messages(estimate)

    def _messages(self, estimate: Estimate) -> list[tuple[Publisher, Any]]:
        """What an estimate is published as: first what others wait for, then the transform."""
        found = [(publisher, write(estimate)) for publisher, write in self._outputs]
        if self._transform is not None:
            transform = self._transform.message(estimate.value, estimate.stamp_ns)
            found.append((self._transform.publisher, transform))
        return found

    def _take_early(self, name: str, reading: Reading | str | None) -> None:
        """Take a reading of a period that is under way, while the plant measures the next ones."""
        if reading is not None:
            self._take(name, reading)

    def _is_new(self, estimate: Estimate) -> bool:
        """Whether an estimate is newer than the last one by as much as its kind says, or of a new epoch."""
        since_ns = estimate.stamp_ns - self._published_ns
        return since_ns < -NEW_EPOCH_NS or since_ns >= max(1, self._every_ns)

    def _estimate(self, time_ns: int | None) -> Estimate | None:
        estimate: Estimate | str | None = self._unbroken("estimate", self._estimator.estimate, time_ns)
        if isinstance(estimate, str):
            self._problem = self._refusal = estimate
            return None
        self._problem = self._estimator.problem
        return estimate

    def _note(self, estimate: Estimate) -> None:
        self._published_ns = estimate.stamp_ns
        self._published += 1

    def _publish_status(self) -> None:
        silent_s = time.monotonic() - self._received_s
        stale = f"nothing usable comes for {silent_s:.1f} s" if silent_s > self._bridge_s else ""
        problem = self._see_writers() or self._problem or stale
        unfit, contested = self._wire_watch.look(), self._writer_watch.alarm
        warnings = (*([contested] if contested else []), *self._estimator.warnings(), *unfit)
        key = (problem[:16], warnings, self._estimator.epoch, self._refused > 0)
        if key == self._said and time.monotonic() - self._said_s < STATUS_PERIOD_S:
            return
        self._said, self._said_s = key, time.monotonic()
        values = {
            "published": str(self._published),
            "outliers": str(self._estimator.outliers),
            "refused": str(self._refused),
            "last_refusal": self._refusal,
            "epoch": str(self._estimator.epoch),
            "stale": str(bool(problem)).lower(),
            WIRE_WARNINGS: BETWEEN.join(unfit),
            **self._computation_ms.percentiles("computation_ms"),
        }
        values |= self._estimator.status()
        lacks = values.get("lacks", LACKS_NOTHING)
        estimating = "estimating" if lacks == LACKS_NOTHING else f"estimating without {lacks}"
        level = "error" if contested else "warn" if problem or warnings else "ok"
        message = problem or "; ".join(warnings) or estimating
        self._health.publish(level, message, values, warnings=warnings)

    def stop(self) -> None:
        """Wait for the last estimate to arrive; nodes that receive none stop by themselves."""
        for publisher, _ in self._outputs:
            publisher.wait_for_all_acked(Duration(seconds=LAST_WORDS_S))


def _is_lacking(name: str, robot: Robot) -> bool:
    """Whether a reading is that of a sensor which a robot does not have."""
    return readings_of(robot)[name].sensor is not None and name not in robot.sensors.kinds


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(EstimatorNode))


if __name__ == "__main__":
    main()
