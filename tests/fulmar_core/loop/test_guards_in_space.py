"""The guards of a controller of a spacecraft: geofence as a sphere, area as a box, tumbling, goals from the wire."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_bags.message_reader import goal_of
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.fallback import ControllerSwitch, Standby
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import SimulatedImu
from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.safety.arbiter import Mode
from fulmar_core.safety.geofence import OUT_OF_BOUNDS
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task

CRAFT, TASK = load_robot("spacecraft_16"), load_task("go_to_pose_3d")
BOX = (-2.0, 2.0, -2.0, 2.0, -1.0, 1.0)
STEP_NS = 200_000_000


class OneValve:
    """Opens the first valve."""

    name, estimator, control_hz = "one_valve", None, 5.0
    readings, observer = (), None

    def reset(self):
        """Nothing to forget."""

    def act(self, inputs):
        return np.eye(1, 16).repeat(len(inputs.previous), axis=0)


class Bench:
    """One guarded loop, and odometry in its rhythm."""

    def __init__(self, **settings):
        estop = SimpleNamespace(received=False, reason=lambda now_ns: "")
        switch = ControllerSwitch(Standby(OneValve(), "{}", ""))
        self.guard = GuardedLoop(
            CRAFT, TASK, ControllerSettings(robot=CRAFT.name, lockstep=True, **settings), switch, estop
        )
        self.guard.activate()
        self.now_ns = STEP_NS

    def give(self, *numbers):
        pose = SpatialState.target_at(numbers)
        self.now_ns += 1
        return self.guard.take_goal(pose[None], self.now_ns, self.now_ns)

    def step(self, *place, rate=(0.0, 0.0, 0.0), quat=(0.5, 0.5, 0.5, 0.5)):
        """Receive odometry and do a control step: the decision, and the command."""
        self.now_ns += STEP_NS
        state = RigidBodyState(np.array(place), np.array(quat), np.zeros(3), np.array(rate))
        self.guard.take(Measurement(self.now_ns, "odom", "base_link", state), self.now_ns)
        decision, inputs = self.guard.begin_step(self.guard.newest, self.now_ns)
        if inputs is None:
            return decision, None
        step = self.guard.act(inputs)
        self.guard.watch(inputs, step)
        return decision, step.command[0]


def test_it_acts_with_an_attitude_as_it_likes():
    bench = Bench(area=BOX)
    assert bench.give(1.0, 0.0, 0.9, 0.0, 90.0, 0.0) == ""
    decision, command = bench.step(0.0, 0.0, 0.5)
    assert decision.mode is Mode.ACTIVE
    assert command.tolist() == [1.0] + [0.0] * 15


@pytest.mark.parametrize("rate", [(6.1, 0.0, 0.0), (3.6, 3.6, 3.6)])
def test_tumbling_beyond_the_limit_is_answered_by_the_safe_command_and_its_reason(rate):
    bench = Bench()
    bench.give(1.0, 0.0, 0.0)
    bench.step(0.0, 0.0, 0.0)
    decision, command = bench.step(0.0, 0.0, 0.0, rate=rate)
    assert command is None
    assert (
        decision.reason == f"odom turn rate {np.linalg.norm(rate):.2f} rad/s is beyond the possible 6 rad/s"
    )
    assert bench.step(0.0, 0.0, 0.0)[1] is not None


@pytest.mark.parametrize(
    ("quat", "reason"),
    [
        ((0.5, 0.5, 0.5, 0.6), "odom quaternion has norm 1.054, must be 1"),
        ((0.0, 0.0, 0.0, 0.0), "odom quaternion has norm 0.000, must be 1"),
    ],
)
def test_an_attitude_without_unit_length_is_answered_by_the_safe_command_and_its_reason(quat, reason):
    bench = Bench()
    bench.give(1.0, 0.0, 0.0)
    assert bench.step(0.0, 0.0, 0.0)[1] is not None
    decision, command = bench.step(0.0, 0.0, 0.0, quat=quat)
    assert command is None
    assert decision.reason == reason
    assert bench.step(0.0, 0.0, 0.0)[1] is not None


def test_a_tumble_that_fills_the_gyroscope_s_range_never_passes_the_gate():
    """What a saturated gyroscope reads lies beyond what the gate takes for possible, whatever the true rate."""
    unit = SimulatedImu(CRAFT.sensors.imu, noisy=True)
    unit.reset(0, 0)
    tumble = RigidBodyState(
        np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.array([0.0, -30.0, 0.1])
    )
    reading = unit.measure(Truth(tumble, np.zeros(3)), 0.0).value.angular_velocity
    assert reading[1] == -CRAFT.sensors.imu.gyroscope_range
    bench = Bench()
    bench.give(1.0, 0.0, 0.0)
    decision, command = bench.step(0.0, 0.0, 0.0, rate=tuple(reading))
    assert command is None
    assert decision.reason == "odom turn rate 8.73 rad/s is beyond the possible 6 rad/s"


def test_the_geofence_is_a_sphere():
    bench = Bench()
    bench.give(0.0, 0.0, 7.0)
    assert bench.step(7.0, 0.0, 0.0)[1] is not None
    decision, command = bench.step(7.0, 2.0, 0.0)
    assert command is None
    assert decision.reason == "goal is 10.1 m away, beyond the geofence of 10 m"


def test_a_goal_above_the_box_is_refused_and_a_robot_below_it_moves_no_more():
    bench = Bench(area=BOX)
    assert bench.give(0.0, 0.0, 1.5, 0.0, 0.0, 0.0).startswith(
        f"{OUT_OF_BOUNDS}the goal x = 0 m, y = 0 m, z = 1.5 m"
    )
    assert bench.give(0.0, 0.0, 0.0) == ""
    assert bench.step(0.0, 0.0, -0.9)[1] is not None
    decision, command = bench.step(0.0, 0.0, -1.1)
    assert command is None
    assert "z = -1.10 m, outside its area of" in decision.reason
    assert bench.step(0.0, 0.0, -0.9)[1] is None  # until another goal comes
    bench.give(0.1, 0.0, 0.0)
    assert bench.step(0.0, 0.0, -0.9)[1] is not None


def test_a_rectangle_is_no_area_in_space():
    with pytest.raises(ConfigError, match="where an area has 6 sides"):
        Bench(area=BOX[:4])


def pose_message(x, y, z, w):
    quat = SimpleNamespace(x=x, y=y, z=z, w=w)
    pose = SimpleNamespace(position=SimpleNamespace(x=1.0, y=0.0, z=-1.0), orientation=quat)
    return SimpleNamespace(header=SimpleNamespace(frame_id="odom"), pose=pose)


def test_a_goal_keeps_its_attitude_and_one_without_unit_length_is_refused():
    targets, problem = goal_of(pose_message(0.6, 0.0, 0.0, 0.8))
    assert problem == ""
    assert TASK.goal_of(targets).current.tolist() == [1.0, 0.0, -1.0, 0.6, 0.0, 0.0, 0.8]
    targets, problem = goal_of(pose_message(0.6, 0.0, 0.0, 0.9))
    assert targets is None
    assert problem == "goal quaternion has norm 1.082, must be 1"
