"""A recorded run without ROS: the core's simulation and classical laws, written as the nodes would publish it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.message_types import type_store
from fulmar_bags.writer import BagWriter
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Controller
from fulmar_core.controllers.lqr import Lqr, LqrWeights
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    BROADCAST_NAMES,
    BROADCAST_VALUES,
    VELOCITY_COMMAND,
    WIRES,
    Wire,
    command_wire,
)
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState, at_rest
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import Goal, goal_at, goal_in_float64
from fulmar_core.worlds.scenario import load_scenario
from policy_server.controllers import EXTERNAL

ROBOT = "floating_platform"
EPOCH_NS = 1_700_000_000_000_000_000
NS = 1_000_000_000
TICK_S = 0.02
WATCHDOG_S = 0.4
UNSTAMPED_S = -1.0  # a time whose stamp is 0
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


IN_BAGS = tuple(
    wire for wire in WIRES if wire not in (BROADCAST_NAMES, BROADCAST_VALUES)
)  # types that bags know


@dataclass(frozen=True)
class Plan:
    """What kind of run to write."""

    robot: str = ROBOT
    controller: str = "lqr"  # external: a node that reports nothing and stamps no command
    task: str = "go_to_pose"
    seed: int = 3
    duration_s: float = 40.0
    control_hz: float = 5.0
    silence_s: tuple[float, float] = (0.0, 0.0)  # the controller says nothing between these times [s]
    start: tuple[float, float, float] | None = (2.5, 1.5, 120.0)  # None: drawn from the seed [m, m, deg]
    goal: tuple[float, float, float] | None = (0.0, 0.0, 0.0)  # same
    weights: LqrWeights | None = BRISK  # None: the law of the robot's family
    gone_after_s: float = float("inf")  # no diagnostics: everything is killed here [s]


DRAWN = {"start": None, "goal": None, "weights": None}


def write_run(folder: Path, plan: Plan = Plan()) -> Path:
    """Write one run into a bag folder and return the folder."""
    robot, task = load_robot(plan.robot), load_task(plan.task)
    controller = _controller(robot, task, plan)
    nominal, hz = load_scenario("nominal"), 1.0 / TICK_S
    simulation = BatchSimulation(
        robot, task, nominal, worlds=1, seed=plan.seed, control_hz=hz, dtype=np.float64
    )
    if plan.start:
        simulation.truth.write(0, _start(plan.start))
        simulation.measured.write(0, _start(plan.start))
    if plan.goal:
        simulation.goal.write(0, _goal(plan.goal, simulation.goal[0]))
    bag = RunMessages(folder, robot, _info(plan))
    bag.goal(task.goal_topic, simulation.goal[0], EPOCH_NS)
    bag.obstacles(simulation.goal[0].obstacles)
    external = plan.controller == EXTERNAL
    if not external:
        bag.text("controller/metadata", json.dumps(controller.metadata()))
    jitter = np.random.default_rng([plan.seed, len(plan.controller)])
    substeps = round(1.0 / (plan.control_hz * TICK_S))
    safe, loop = robot.actuators.safe_command, ControlLoop(robot, task, controller)
    loop.begin(goal_in_float64(simulation.goal))
    command, received_s, closed, trips, steps = safe, -np.inf, False, 0, 0
    given = float(simulation.goal.done[0])
    for tick in range(round(min(plan.duration_s, plan.gone_after_s) / TICK_S) + 1):
        time_s = tick * TICK_S
        now_ns = EPOCH_NS + round(time_s * NS) + int(jitter.integers(0, 200_000))
        if task.goal_topic == "goal_velocity" and simulation.goal.done[0] != given:
            given = float(simulation.goal.done[0])
            bag.goal(task.goal_topic, simulation.goal[0], now_ns)
        bag.odometry("ground_truth/odom", simulation.truth[0].to_rigid(), time_s, now_ns)
        bag.odometry("odom", simulation.measured[0].to_rigid(), time_s, now_ns)
        for name, pose in simulation.things.items():
            bag.thing(name, pose[0], time_s, now_ns)
        if tick % substeps == 0 and not plan.silence_s[0] <= time_s < plan.silence_s[1]:
            loop.goal = loop.goal.among(simulation.things)
            command = loop.step(simulation.measured, {}, round(time_s * NS)).command[0]
            received_s, steps = time_s, steps + 1
            late_ns = LATENCY_NS + int(jitter.gamma(2.0, 300_000))
            bag.command(command, UNSTAMPED_S if external else time_s, now_ns + late_ns)
        was_closed, closed = closed, time_s - received_s > WATCHDOG_S
        trips += closed and not was_closed
        applied = safe if closed else command
        bag.joints("actuators/state", applied, time_s, now_ns + 4_000_000)
        if tick % 25 == 0:
            if not external:
                bag.health("controller/status", "controller", _controller_values(steps), now_ns)
            bag.health("/diagnostics", "plant", _plant_values(tick, trips), now_ns)
        simulation.step(applied[None, :])
    bag.writer.close()
    return folder


def _controller(robot: Robot, task: Task, plan: Plan) -> Controller:
    if plan.weights is None:
        return load_classical(robot, task, control_hz=plan.control_hz)
    return Lqr(robot, task, plan.weights, control_hz=plan.control_hz)


def _start(pose: tuple[float, float, float]) -> PlanarState:
    return at_rest(*np.array([pose[0], pose[1], np.deg2rad(pose[2])]))


def _goal(pose: tuple[float, float, float], drawn: Goal) -> Goal:
    return goal_at((pose[0], pose[1], float(np.deg2rad(pose[2]))), obstacles=drawn.obstacles)


def _controller_values(steps: int) -> dict[str, str]:
    values = {"mode": "active", "reason": "", "steps": str(steps), "control_rate_hz": "5.0002"}
    values |= {"overruns": "1"}
    values |= {"inference_ms_p50": "0.1", "inference_ms_p99": "0.3", "inference_ms_max": "0.9"}
    values |= {"period_error_ms_p50": "0.05", "period_error_ms_p99": "0.4", "period_error_ms_max": "1.2"}
    return values


def _plant_values(ticks: int, trips: int) -> dict[str, str]:
    return {"mode": "running", "ticks": str(ticks), "watchdog_trips": str(trips), "overruns": "2"}


def _info(plan: Plan) -> dict[str, Any]:
    return {
        "robot": plan.robot,
        "task": plan.task,
        "controller": plan.controller,
        "backend": "mujoco",
        "seed": plan.seed,
        "lockstep": False,
        "rate": 1.0,
        "control_hz": plan.control_hz,
        "start": list(plan.start) if plan.start else None,
        "goal": list(plan.goal) if plan.goal else None,
        "scenario": "nominal",
        "fulmar_version": "0.0.0",
        "git_revision": "0123456",
        "command": "fulmar run floating_platform",
    }


class RunMessages:
    """Builds the messages of a run and writes them into a bag, by the names of the wires."""

    def __init__(
        self, folder: Path, robot: Robot, info: dict[str, Any], wires: Sequence[Wire] = IN_BAGS
    ) -> None:
        """Create the bag, with the topics of some wires."""
        self._robot, self._command_wire = robot.name, command_wire(robot)
        self._rigid_targets = robot.state_type.rigid_targets
        self._store, self._names = type_store(), np.array(robot.actuators.names)
        self._types = {wire.name: wire.type for wire in WIRES}
        self.writer = BagWriter(folder, run_info=info)
        for wire in wires:
            self.writer.add_topic(self._topic(wire.name), wire.type, wire.delivery)

    def _topic(self, name: str) -> str:
        return name if name.startswith("/") else f"/{self._robot}/{name}"

    def _new(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def _header(self, time_s: float, frame: str = "odom") -> Any:
        ns = round((time_s + 1.0) * NS)
        stamp = self._new("builtin_interfaces/msg/Time", sec=ns // NS, nanosec=ns % NS)
        return self._new("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

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

    def goal(self, name: str, goal: Goal, log_ns: int) -> None:
        frame = "base_link" if name == "goal_velocity" else "odom"
        twists = name == "goal_velocity"
        target = self._rigid_targets(np.asarray(goal.current), twists=twists)
        header = self._header(0.0, frame)
        if name == "goal_point":
            point = self._vector("Point", target[:3])
            message = self._new("geometry_msgs/msg/PointStamped", header=header, point=point)
        elif name == "goal_velocity":
            twist = self._twist(target[:3], target[3:])
            message = self._new("geometry_msgs/msg/TwistStamped", header=header, twist=twist)
        elif name == "goal_path":
            targets = self._rigid_targets(np.asarray(goal.targets), twists=False)
            poses = [self._posed(each, 0.0) for each in targets]
            message = self._new("nav_msgs/msg/Path", header=header, poses=poses)
        else:
            message = self._posed(target, 0.0)
        self._write(name, message, log_ns)

    def _planar(self, pose: np.ndarray, time_s: float) -> Any:
        return self._posed(PlanarState.rigid_targets(pose, twists=False), time_s)

    def _posed(self, pose: np.ndarray, time_s: float) -> Any:
        body = self._pose(pose[:3], pose[3:])
        return self._new("geometry_msgs/msg/PoseStamped", header=self._header(time_s), pose=body)

    def obstacles(self, discs: np.ndarray) -> None:
        none = self._store.types["visualization_msgs/msg/Marker"]
        fields = {"header": self._header(0.0), "ns": "", "id": 0, "type": 3, "action": 0, "text": ""}
        zero = self._new("builtin_interfaces/msg/Duration", sec=0, nanosec=0)
        colour = self._new("std_msgs/msg/ColorRGBA", r=1.0, g=1.0, b=1.0, a=1.0)
        uv = self._new(
            "sensor_msgs/msg/CompressedImage", header=self._header(0.0), format="", data=np.zeros(0, np.uint8)
        )
        mesh = self._new("visualization_msgs/msg/MeshFile", filename="", data=np.zeros(0, np.uint8))
        fields |= {"lifetime": zero, "frame_locked": False, "points": [], "colors": [], "color": colour}
        fields |= {"texture_resource": "", "texture": uv, "uv_coordinates": [], "mesh_resource": ""}
        fields |= {"mesh_file": mesh, "mesh_use_embedded_materials": False}
        markers = [
            none(
                **fields,
                pose=self._pose(np.array([x, y, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])),
                scale=self._vector("Vector3", np.array([2.0 * radius, 2.0 * radius, 0.5])),
            )
            for x, y, radius, *_ in discs
            if radius > 0.0
        ]
        message = self._new("visualization_msgs/msg/MarkerArray", markers=markers)
        self._write("obstacles", message, EPOCH_NS)

    def thing(self, name: str, pose: np.ndarray, time_s: float, log_ns: int) -> None:
        self._write(f"{name}/pose", self._planar(pose, time_s), log_ns)

    def command(self, command: np.ndarray, time_s: float, log_ns: int) -> None:
        if self._command_wire is not VELOCITY_COMMAND:
            self.joints("actuators/command", command, time_s, log_ns)
            return
        ahead, turn = np.array([command[0], 0.0, 0.0]), np.array([0.0, 0.0, command[1]])
        message = self._new(
            "geometry_msgs/msg/TwistStamped", header=self._header(time_s), twist=self._twist(ahead, turn)
        )
        self._write("cmd_vel", message, log_ns)

    def _twist(self, linear: np.ndarray, angular: np.ndarray) -> Any:
        return self._new(
            "geometry_msgs/msg/Twist",
            linear=self._vector("Vector3", linear),
            angular=self._vector("Vector3", angular),
        )

    def odometry(self, name: str, state: RigidBodyState, time_s: float, log_ns: int) -> None:
        velocity = rotate_inverse(state.quat_xyzw, state.velocity_in_world)
        twist = self._twist(velocity, state.angular_velocity_in_body)
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

    def joints(
        self,
        name: str,
        values: np.ndarray,
        time_s: float,
        log_ns: int,
        field: str = "effort",
        names: Sequence[str] = (),
    ) -> None:
        arrays = dict.fromkeys(("position", "velocity", "effort"), np.zeros(0))
        message = self._new(
            "sensor_msgs/msg/JointState",
            header=self._header(time_s),
            name=list(names or self._names),
            **(arrays | {field: np.asarray(values, dtype=float)}),
        )
        self._write(name, message, log_ns)

    def imu(self, rate: np.ndarray, time_s: float, log_ns: int) -> None:
        zero = np.zeros(9)
        message = self._new(
            "sensor_msgs/msg/Imu",
            header=self._header(time_s, "base_link"),
            orientation=self._vector("Quaternion", np.array([0.0, 0.0, 0.0, 1.0])),
            orientation_covariance=zero,
            angular_velocity=self._vector("Vector3", rate),
            angular_velocity_covariance=zero,
            linear_acceleration=self._vector("Vector3", np.zeros(3)),
            linear_acceleration_covariance=zero,
        )
        self._write("imu/data", message, log_ns)

    def inertia(self, tensor: Sequence[float], std: float, time_s: float, log_ns: int) -> None:
        moments = dict(zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), tensor, strict=True))
        com = self._vector("Vector3", np.zeros(3))
        inertia = self._new("geometry_msgs/msg/Inertia", m=1.0, com=com, **moments)
        message = self._new("geometry_msgs/msg/InertiaStamped", header=self._header(time_s), inertia=inertia)
        self._write("inertia", message, log_ns)
        layout = self._new("std_msgs/msg/MultiArrayLayout", dim=[], data_offset=0)
        spread = (std**2 * np.eye(6)).ravel()
        message = self._new("std_msgs/msg/Float64MultiArray", layout=layout, data=spread)
        self._write("inertia/covariance", message, log_ns)

    def pressure(self, name: str, pascal: float, time_s: float, log_ns: int) -> None:
        message = self._new(
            "sensor_msgs/msg/FluidPressure",
            header=self._header(time_s),
            fluid_pressure=float(pascal),
            variance=0.0,
        )
        self._write(name, message, log_ns)

    def health(self, name: str, part: str, values: dict[str, str], log_ns: int) -> None:
        status = self._new(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=0,
            name=f"{self._robot}: {part}",
            message="running",
            hardware_id="",
            values=[self._new("diagnostic_msgs/msg/KeyValue", key=k, value=v) for k, v in values.items()],
        )
        message = self._new("diagnostic_msgs/msg/DiagnosticArray", header=self._header(0.0), status=[status])
        self._write(name, message, log_ns)
