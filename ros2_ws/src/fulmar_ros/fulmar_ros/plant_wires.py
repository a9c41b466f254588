"""Publishers and subscriptions of a plant: one object for every wire on its side."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.lifecycle import LifecycleNode
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    CLOCK,
    MOCAP,
    NEIGHBOURS,
    TRUTH,
    thing_wire,
)
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.disturbances import ODOMETRY as ODOMETRY_LINK
from fulmar_core.states.planar import at_rest
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.origin import origin_pose
from fulmar_core.wires.reading import BACK_NS
from fulmar_ros import plant_estop
from fulmar_ros.convert import (
    OdometryWriter,
    PoseWriter,
    VectorWriter,
    stamp_of,
)
from fulmar_ros.frame_wires import ModelWires, odometry_transform
from fulmar_ros.motion_capture import MakeCapture
from fulmar_ros.neighbour_messages import neighbours_message
from fulmar_ros.parameters import own_frames
from fulmar_ros.plant_clock import SimulatedTime
from fulmar_ros.plant_commands import PlantCommands
from fulmar_ros.plant_estop import PlantEstop
from fulmar_ros.plant_link import PlantLink
from fulmar_ros.plant_period import PlantPeriod
from fulmar_ros.qos import FLUSH_S, LAST_WORDS_S, flush, publish_patiently, publisher_qos
from fulmar_ros.relay import RelayedInputs
from fulmar_ros.sensor_wires import SensorWires

CLOCK_PERIOD_NS = 5_000_000  # /clock at most 200 times a wall-clock second


class PlantWires:
    """Publishers and subscriptions of a plant node.

    Attributes:
        commands: What moves the plant.
        lock: Held while its guard is touched.
        estop: Of this plant.
        subscribed: The wires that are subscribed; the values say whether a best-effort publisher is refused.
    """

    def __init__(
        self,
        node: LifecycleNode,
        robot: Robot,
        guard: ActuatorGuard,
        *,
        simulated: bool,
        clock: bool = False,
        odometry: bool = True,
        mocap: MakeCapture | None = None,
        lockstep: bool = False,
        simulated_time: SimulatedTime | None = None,
        chain: Sequence[str] = (),
        transforms: bool = True,
        truth_in_period: bool = False,
        origin: Sequence[float] = (),
        link: PlantLink | None = None,
        fleet: bool = False,
        neighbours: bool = False,
    ) -> None:
        """Create every endpoint.

        Args:
            node: Owner of the endpoints.
            robot: The robot.
            guard: Receives the commands; only touched under `lock`.
            simulated: Whether the truth is published.
            clock: Whether the clock is published.
            odometry: Whether the plant publishes odometry; if not, another node does.
            mocap: Makes the motion capture whose poses are published; None: none.
            lockstep: Whether the plant waits for the controller's answers, and for readers that lag behind. By the
                clock, without it, a person may take the actuators, and commands go before other work.
            simulated_time: Clock of a simulated plant, by which actuators follow commands.
            chain: Nodes between plant and controller that take part in lock step.
            transforms: Whether frames are published, where tf2_msgs is installed.
            truth_in_period: Whether nodes of the chain wait for the truth, as simulated cameras do.
            origin: Pose of `odom` in `map`: x, y, z [m], quaternion x, y, z, w; empty: they are one.
            link: Between plant and controller; None: neither readings nor commands are late.
            fleet: Whether the e-stop of a fleet counts, too.
            neighbours: Whether is published where the other robots of a fleet are.
        """
        self._link, self._lockstep = link, lockstep
        self._mocap = mocap(self._publish_pose) if mocap is not None else None
        self._publish = publish = publish_patiently if lockstep else Publisher.publish
        self._flush_s = FLUSH_S if lockstep else LAST_WORDS_S
        self._robot, self._guard = robot, guard
        # Without them, commands answer odometry of another node, whose stamps are of another clock.
        self.commands = PlantCommands(
            node,
            robot,
            guard,
            lockstep=lockstep,
            knows_ages=simulated or odometry,
            simulated_time=simulated_time,
            link=link,
        )
        self.lock = self.commands.lock
        self._clock_ns = 0
        self._captured_ns = 0
        self._qos = qos = partial(publisher_qos, lockstep=lockstep, lossless=bool(chain))
        self._period = PlantPeriod(node, chain, self.lock) if chain else None
        if self._period is not None:
            self._publish = self._period.publish
        frames = own_frames(node, robot)
        transform = odometry_transform(
            node, frames, wanted=transforms and odometry, publish=publish, lockstep=lockstep
        )
        self._sensors = SensorWires(
            node, robot, frames, qos, self._publish, odometry=odometry, lockstep=lockstep, transform=transform
        )
        origin = origin or origin_pose(())
        moved = tuple(origin) != origin_pose(())
        self._model = ModelWires(
            node, robot, frames, qos, transforms=transforms, origin=origin, in_map=simulated or moved
        )
        self._poses = (
            node.create_publisher(PoseStamped, MOCAP.name, qos(MOCAP)) if mocap is not None else None
        )
        self._state = node.create_publisher(JointState, ACTUATORS_STATE.name, qos(ACTUATORS_STATE))
        self._truth = node.create_publisher(Odometry, TRUTH.name, qos(TRUTH)) if simulated else None
        self._clock = node.create_publisher(Clock, CLOCK.name, qos(CLOCK)) if clock else None
        if self._period is not None:
            self._period.distinguish(
                odometry=self._sensors.odometry,
                truth=self._truth,
                clock=self._clock,
                counts_truth=truth_in_period,
            )
        self._write_pose = PoseWriter(frames)
        self._write_truth = OdometryWriter(
            None, frame=frames.odom if moved else "map", child_frame=frames.base
        )
        self._write_state = VectorWriter(robot.actuators.names)
        self._neighbours = (
            node.create_publisher(JointState, NEIGHBOURS.name, qos(NEIGHBOURS)) if neighbours else None
        )
        self._node = node
        self._things: dict[str, Publisher] = {}  # each made with its first pose: most robots are alone
        self._relayed = RelayedInputs(node)
        self.estop = PlantEstop(node, guard, self.lock, self._relayed, fleet=fleet)
        self.subscribed = {
            **self.commands.subscribed,
            **dict.fromkeys(plant_estop.wires_of(fleet=fleet), False),
        }

    def destroy(self, node: LifecycleNode) -> None:
        """Destroy every endpoint."""
        self.end_capture()
        self.commands.destroy(node)
        self.estop.destroy(node)
        self._relayed.destroy(node)
        if self._period is not None:
            node.destroy_subscription(self._period.answers)
        for publisher in self._publishers():
            node.destroy_publisher(publisher)

    def _publishers(self) -> list[Publisher]:
        made = (self._poses, self._state, self._truth, self._clock, self._neighbours)
        rest = (publisher for publisher in made if publisher is not None)
        period = [self._period.publisher] if self._period is not None else []
        return [
            *self._sensors.publishers, *self._model.publishers, *rest, *self._things.values(), *period,
        ]  # fmt: skip

    def subscribers(self) -> int:
        """Matched subscriptions of periods, else of the odometry, of the poses, or of the actuators' state."""
        if self._period is not None:
            return int(self._period.publisher.get_subscription_count())
        return int((self._sensors.odometry or self._poses or self._state).get_subscription_count())

    def publish_sample(self, sample: Sample, time_ns: int) -> None:
        """Publish a sample, the odometry first, since the controller waits for it.

        Args:
            sample: From the backend.
            time_ns: Time of measurement, where the sample has none [ns].
        """
        if sample.stamp_ns is not None:
            if 0 <= self._captured_ns - sample.stamp_ns <= BACK_NS:
                self._publish_arrived()
                self._sensors.publish_stamped(sample.readings, time_ns)
                return  # a device that has nothing else that is new; further back, the clock was set
            time_ns = self._captured_ns = sample.stamp_ns
        self.commands.note_sent(time_ns)
        if self._link is None:
            self.publish_measured(sample, time_ns)
        else:
            self._link.readings.send((sample, time_ns), self.commands.now_ns)
            self._publish_arrived()
        self.publish_truth(sample, time_ns)
        now = time.monotonic_ns()
        if self._clock is not None and now - self._clock_ns >= CLOCK_PERIOD_NS:
            self._publish(self._clock, Clock(clock=stamp_of(time_ns)))
            self._clock_ns = now

    def _publish_arrived(self) -> None:
        """Publish what the link has carried by now; in lock step its loop does."""
        for sample, stamp in () if self._lockstep else self.arrived_readings():
            self.publish_measured(sample, stamp)

    def arrived_readings(self) -> list[tuple[Sample, int]]:
        """Samples that the link has carried to the controller by now, with their stamps [ns]."""
        return [] if self._link is None else self._link.readings.arrived(self.commands.now_ns)

    def publish_measured(self, sample: Sample, time_ns: int) -> None:
        """Publish what a controller receives of a sample: readings, and where things are.

        Args:
            sample: From the backend.
            time_ns: Time of measurement [ns].
        """
        self._publish_things(sample, time_ns)
        self._publish_readings(sample, time_ns)

    def _publish_readings(self, sample: Sample, time_ns: int) -> None:
        if self.commands.cuts(ODOMETRY_LINK):
            return
        self._sensors.publish(sample.readings, time_ns)
        if self._mocap is not None and sample.odometry is not None:
            for stamp, state in self._mocap.see(sample.odometry, time_ns):
                self._publish_pose(stamp, state)

    def repeat_sample(self, sample: Sample, time_ns: int, *, whole: bool) -> None:
        """Publish a sample of lock step again.

        Args:
            sample: It was published before.
            time_ns: Time of measurement [ns].
            whole: Every reading, not the odometry alone.
        """
        self._publish_things(sample, time_ns)
        if whole:
            self._sensors.publish(sample.readings, time_ns)
        else:
            self._sensors.publish_odometry(sample.readings, time_ns)

    def _publish_things(self, sample: Sample, time_ns: int) -> None:
        for name, pose in sample.things.items():
            self._publish_thing(name, pose, time_ns)
        if self._neighbours is not None:
            self._publish(self._neighbours, neighbours_message(sample.neighbours, time_ns))

    def _publish_pose(self, stamp: int, state: RigidBodyState) -> None:
        if self._poses is not None:
            self._publish(self._poses, self._write_pose.raw(state, stamp))

    def _publish_thing(self, name: str, pose: np.ndarray, time_ns: int) -> None:
        if name not in self._things:
            wire = thing_wire(name)
            self._things[name] = self._node.create_publisher(PoseStamped, wire.name, self._qos(wire))
        self._publish(self._things[name], self._write_pose.raw(at_rest(*pose).to_rigid(), time_ns))

    def publish_truth(self, sample: Sample, time_ns: int) -> None:
        """Publish the true state, if the backend knows it and it has a subscriber."""
        if self._truth is not None and sample.truth is not None and self._truth.get_subscription_count():
            self._publish(self._truth, self._write_truth.raw(sample.truth, time_ns))

    def publish_applied(self, command: np.ndarray, time_ns: int) -> None:
        """Publish what the actuators do from this time on, if it has a subscriber."""
        if self._state.get_subscription_count():
            self._publish(self._state, self._write_state.raw(command, time_ns))

    def end_capture(self) -> None:
        """Publish no pose any more before the next measurement."""
        if self._mocap is not None:
            self._mocap.close()

    def flush(self) -> None:
        """Wait for a limited time until every subscriber has the last states."""
        flush(self._publishers(), self._flush_s)

    def publish_tick(self, sample: Sample, time_ns: int) -> None:
        """Publish the readings of a physics step within a period; see `PlantPeriod`."""
        assert self._period is not None
        self._period.within = True
        self.commands.note_sent(time_ns)
        self._publish_readings(sample, time_ns)
        self._period.within = False

    def publish_period(self, sample: Sample, time_ns: int) -> None:
        """Publish the sample that ends a period, and then what the period holds."""
        assert self._period is not None
        self.publish_sample(sample, time_ns)
        self._period.close(time_ns)

    def repeat_period(self) -> None:
        """Publish the period once more."""
        assert self._period is not None
        self._period.repeat()

    def begin_period(self) -> None:
        """Let what is published from here on belong to the next period."""
        assert self._period is not None
        self._period.begin()

    def silent_nodes(self, time_ns: int) -> list[str]:
        """Nodes that have not answered the period that ends at a time [ns]; call with `lock` held."""
        assert self._period is not None
        return self._period.silent(time_ns)

    def wait_for_period(self, time_ns: int, timeout_s: float) -> bool:
        """Wait until every node has answered the period that ends at a time [ns], and a command has come.

        Without odometry no command comes: the safe one is taken in its place. Call with `lock` held.
        """
        return self.lock.wait_for(lambda: self._is_answered(time_ns), timeout_s)

    def _is_answered(self, time_ns: int) -> bool:
        assert self._period is not None
        if self._period.silent(time_ns):
            return False
        if self._sensors.odometry is None and not self._period.has_odometry():
            actuators = self._robot.actuators
            self._guard.offer(
                actuators.names, actuators.safe_command.tolist(), time.monotonic_ns(), plant_ns=time_ns
            )
            return True
        return self.commands.answered_ns == time_ns
