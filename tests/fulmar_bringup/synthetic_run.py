"""A recorded run without ROS: the core's simulation and LQR, written as the nodes would publish it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.controllers.lqr import Lqr, LqrWeights
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.robot import load_robot
from fulmar_core.rotation import rotate_inverse
from fulmar_core.simulation import BatchSimulation
from fulmar_core.state import planar_pose, planar_state
from fulmar_core.tasks import load_task
from fulmar_core.topics import WIRES
from fulmar_ros.bag_types import type_store
from fulmar_ros.bag_writer import BagWriter

ROBOT = "floating_platform"
EPOCH_NS = 1_700_000_000_000_000_000
NS = 1_000_000_000
TICK_S = 0.02
WATCHDOG_S = 0.4
LATENCY_NS = 1_500_000


def _weights(velocity: float, error_limit: float) -> LqrWeights:
    return LqrWeights(
        position=4.0,
        heading=2.0,
        velocity=velocity,
        yaw_rate=0.5,
        force=0.5,
        torque=1.0,
        open_valve=0.0005,
        position_error_limit=error_limit,
        heading_error_limit_deg=60.0,
    )


BRISK, CALM = _weights(4.0, 1.0), _weights(12.0, 1.0)


@dataclass(frozen=True)
class Plan:
    """What kind of run to write."""

    controller: str = "lqr"
    task: str = "go_to_pose"
    seed: int = 3
    duration_s: float = 40.0
    control_hz: float = 5.0
    silence_s: tuple[float, float] = (0.0, 0.0)  # the controller says nothing between these times [s]
    start: tuple[float, float, float] = (2.5, 1.5, 120.0)  # [m, m, deg]
    goal: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [m, m, deg]
    weights: LqrWeights = BRISK
    gone_after_s: float = float("inf")  # no diagnostics: everything is killed here [s]


def write_run(folder: Path, plan: Plan = Plan()) -> Path:
    """Write one run into a bag folder and return the folder."""
    robot, task = load_robot(ROBOT), load_task(plan.task)
    controller = Lqr(robot, task, plan.weights, control_hz=plan.control_hz)
    nominal, hz = load_scenario("nominal"), 1.0 / TICK_S
    simulation = BatchSimulation(
        robot, task, nominal, worlds=1, seed=plan.seed, control_hz=hz, dtype=np.float64
    )
    simulation.truth.write(0, _planar(planar_state, plan.start))
    simulation.goal.write(0, _planar(planar_pose, plan.goal))
    simulation._measure()
    bag = _Messages(folder, plan, robot.actuators.names)
    bag.goal(task.goal_topic, plan.goal)
    bag.text("controller/metadata", json.dumps(controller.metadata()))
    jitter = np.random.default_rng([plan.seed, len(plan.controller)])
    substeps = round(1.0 / (plan.control_hz * TICK_S))
    command, heard_s, closed, trips, steps = np.zeros(8), -np.inf, False, 0, 0
    for tick in range(round(min(plan.duration_s, plan.gone_after_s) / TICK_S) + 1):
        time_s = tick * TICK_S
        now_ns = EPOCH_NS + round(time_s * NS) + int(jitter.integers(0, 200_000))
        bag.odometry("ground_truth/odom", simulation.truth, time_s, now_ns)
        bag.odometry("odom", simulation.measured, time_s, now_ns)
        if tick % substeps == 0 and not plan.silence_s[0] <= time_s < plan.silence_s[1]:
            command = controller.act(np.asarray(task.observe(simulation.measured, simulation.goal)))[0]
            heard_s, steps = time_s, steps + 1
            late_ns = LATENCY_NS + int(jitter.gamma(2.0, 300_000))
            bag.joints("actuators/command", command, time_s, now_ns + late_ns)
        was_closed, closed = closed, time_s - heard_s > WATCHDOG_S
        trips += closed and not was_closed
        applied = np.zeros(8) if closed else command
        bag.joints("actuators/state", applied, time_s, now_ns + 4_000_000)
        if tick % 25 == 0:
            bag.health("controller/status", "controller", _controller_values(steps), now_ns)
            bag.health("/diagnostics", "plant", _plant_values(tick, trips), now_ns)
        simulation.step(applied[None, :])
    bag.writer.close()
    return folder


def _planar(make: Any, pose: tuple[float, float, float]) -> Any:
    return make(pose[0], pose[1], np.deg2rad(pose[2]))


def _controller_values(steps: int) -> dict[str, str]:
    values = {"mode": "active", "reason": "", "steps": str(steps), "control_rate_hz": "5.0002"}
    values |= {"overruns": "1"}
    values |= {"inference_ms_p50": "0.1", "inference_ms_p99": "0.3", "inference_ms_max": "0.9"}
    values |= {"period_error_ms_p50": "0.05", "period_error_ms_p99": "0.4", "period_error_ms_max": "1.2"}
    return values


def _plant_values(ticks: int, trips: int) -> dict[str, str]:
    return {"mode": "running", "ticks": str(ticks), "watchdog_trips": str(trips), "overruns": "2"}


class _Messages:
    """Builds and writes messages by the names of the wires."""

    def __init__(self, folder: Path, plan: Plan, names: tuple[str, ...]) -> None:
        info = {
            "robot": ROBOT,
            "task": plan.task,
            "controller": plan.controller,
            "backend": "mujoco",
            "seed": plan.seed,
            "lockstep": False,
            "rate": 1.0,
            "control_hz": plan.control_hz,
            "start": list(plan.start),
            "goal": list(plan.goal),
            "scenario": "nominal",
            "fulmar_version": "0.0.0",
            "git_revision": "0123456",
            "command": "fulmar run floating_platform",
        }
        self._store, self._names = type_store(), np.array(names)
        self._types = {wire.name: wire.type for wire in WIRES}
        self.writer = BagWriter(folder, run_info=info)
        for wire in WIRES:
            self.writer.add_topic(self._topic(wire.name), wire.type, wire.delivery)

    @staticmethod
    def _topic(name: str) -> str:
        return name if name.startswith("/") else f"/{ROBOT}/{name}"

    def _new(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def _header(self, time_s: float) -> Any:
        ns = round((time_s + 1.0) * NS)
        stamp = self._new("builtin_interfaces/msg/Time", sec=ns // NS, nanosec=ns % NS)
        return self._new("std_msgs/msg/Header", stamp=stamp, frame_id="odom")

    def _write(self, name: str, message: Any, log_ns: int) -> None:
        data = self._store.serialize_cdr(message, self._types[name])
        self.writer.write(self._topic(name), bytes(data), log_ns=log_ns)

    def _vector(self, kind: str, values: np.ndarray) -> Any:
        names = "xyzw"[: len(values)]
        return self._new(f"geometry_msgs/msg/{kind}", **dict(zip(names, map(float, values), strict=True)))

    def _pose(self, position: np.ndarray, quat: np.ndarray) -> Any:
        return self._new(
            "geometry_msgs/msg/Pose",
            position=self._vector("Point", position),
            orientation=self._vector("Quaternion", quat),
        )

    def text(self, name: str, text: str) -> None:
        self._write(name, self._new("std_msgs/msg/String", data=text), EPOCH_NS)

    def goal(self, name: str, goal: tuple[float, float, float]) -> None:
        pose = _planar(planar_pose, goal)
        header = self._header(0.0)
        if name == "goal_point":
            point = self._vector("Point", pose.position_in_world)
            message = self._new("geometry_msgs/msg/PointStamped", header=header, point=point)
        else:
            body = self._pose(pose.position_in_world, pose.quat_xyzw)
            message = self._new("geometry_msgs/msg/PoseStamped", header=header, pose=body)
        self._write(name, message, EPOCH_NS)

    def odometry(self, name: str, states: Any, time_s: float, log_ns: int) -> None:
        state = states[0]
        velocity = rotate_inverse(state.quat_xyzw, state.velocity_in_world)
        twist = self._new(
            "geometry_msgs/msg/Twist",
            linear=self._vector("Vector3", velocity),
            angular=self._vector("Vector3", state.angular_velocity_in_body),
        )
        pose = self._pose(state.position_in_world, state.quat_xyzw)
        unknown = np.zeros(36)
        message = self._new(
            "nav_msgs/msg/Odometry",
            header=self._header(time_s),
            child_frame_id="base_link",
            pose=self._new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=unknown),
            twist=self._new("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=unknown),
        )
        self._write(name, message, log_ns)

    def joints(self, name: str, effort: np.ndarray, time_s: float, log_ns: int) -> None:
        none = np.zeros(0)
        message = self._new(
            "sensor_msgs/msg/JointState",
            header=self._header(time_s),
            name=list(self._names),
            position=none,
            velocity=none,
            effort=np.asarray(effort, dtype=float),
        )
        self._write(name, message, log_ns)

    def health(self, name: str, part: str, values: dict[str, str], log_ns: int) -> None:
        status = self._new(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=0,
            name=f"{ROBOT}: {part}",
            message="running",
            hardware_id="",
            values=[self._new("diagnostic_msgs/msg/KeyValue", key=k, value=v) for k, v in values.items()],
        )
        message = self._new("diagnostic_msgs/msg/DiagnosticArray", header=self._header(0.0), status=[status])
        self._write(name, message, log_ns)
