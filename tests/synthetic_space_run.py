"""A recorded run of a spacecraft without ROS: simulation and a plain law, written as the nodes would publish it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import Vector, from_euler, rotation_error, scaled, turn_back
from fulmar_core.states.spatial import SpatialState, quat_of
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal, goals_at
from fulmar_core.worlds.scenario import load_scenario
from tests.synthetic_run import EPOCH_NS, LATENCY_NS, NS, RunMessages

ROBOT = "spacecraft_16"
TICK_S = 0.04
TICKS = 5  # of a control step
MOST_OPEN = 4  # valves at once
SLOW, TURNING = 0.25, 0.5  # natural frequencies of place and attitude [rad/s]
FAR, WIDE = 1.5, 1.0  # where errors saturate [m, rad]


@dataclass(frozen=True)
class SpacePlan:
    """What kind of run to write; start and goal are x, y, z [m], roll, pitch, yaw [deg]."""

    task: str = "go_to_pose_3d"
    thing: str = ""  # in space
    controller: str = "lqr"  # the name that the bag has
    seed: int = 3
    duration_s: float = 60.0
    start: tuple[float, ...] | None = (2.5, 1.5, -1.0, 40.0, 60.0, 120.0)  # None: drawn from the seed
    goal: tuple[float, ...] | None = (0.0, 0.0, 0.5, 0.0, 30.0, 0.0)  # same
    named: bool = True  # whether the bag names its task


class Valves:
    """Valves whose wrench is nearest to what is asked, and what they have not given yet."""

    def __init__(self, robot: Robot) -> None:
        count = len(robot.actuators.names)
        sets = [c for n in range(MOST_OPEN + 1) for c in combinations(range(count), n)]
        self._open = np.array([[float(i in chosen) for i in range(count)] for chosen in sets])
        self._wrenches = np.concatenate(robot.actuators.wrench_in_body(self._open), axis=-1)
        self._size = np.repeat((1.0, robot.body.radius), 3)
        self._owed = np.zeros(6)

    def command(self, wrench: np.ndarray) -> np.ndarray:
        """Valves for a force [N] and a torque [N·m] in the body's frame."""
        wanted = wrench + self._owed
        best = np.argmin(np.sum(((self._wrenches - wanted) / self._size) ** 2, axis=1))
        self._owed = np.clip(wanted - self._wrenches[best], -0.6 * self._size, 0.6 * self._size)
        return self._open[best]


def wrench_to(state: SpatialState, goal: Goal, robot: Robot, *, moving: bool) -> np.ndarray:
    """A critically damped push towards a pose, or towards a velocity, shape (6,)."""
    velocity, rate = np.array(state.velocity_in_body), np.array(state.rate)
    target = goal.current
    if moving:
        push, twist = target[:3] - velocity, target[3:] - rate
    else:
        aside = (target[0] - state.x, target[1] - state.y, target[2] - state.z)
        way = np.array(turn_back(state.quat, _short(aside, FAR)))
        turned = np.array(_short(rotation_error(state.quat, quat_of(target)), WIDE))
        push = SLOW**2 * way - 2.0 * SLOW * velocity
        twist = TURNING**2 * turned - 2.0 * TURNING * rate
    return np.concatenate((robot.body.mass * push, robot.body.inertia_matrix @ twist))


def _short(vector: Vector, most: float) -> Vector:
    return scaled(min(1.0, most / max(float(np.linalg.norm(vector)), 1e-9)), vector)


def _posed(pose: tuple[float, ...]) -> np.ndarray:
    quat = from_euler(*np.deg2rad(np.array(pose[3:])))
    return np.array((*pose[:3], *map(float, quat)))


def write_space_run(folder: Path, plan: SpacePlan = SpacePlan()) -> Path:
    """Write one run into a bag folder and return the folder."""
    robot, task = load_robot(ROBOT), load_task(plan.task, plan.thing)
    simulation = BatchSimulation(
        robot,
        task,
        load_scenario("nominal"),
        worlds=1,
        seed=plan.seed,
        control_hz=1.0 / TICK_S,
        dtype=np.float64,
    )
    if plan.start:
        pose = _posed(plan.start)
        start = SpatialState.at_rest(tuple(pose[:3]), tuple(pose[3:]))
        simulation.truth.write(0, start)
        simulation.measured.write(0, start)
    if plan.goal:
        simulation.goal.write(0, goals_at(_posed(plan.goal)[None])[0])
    bag = RunMessages(folder, robot, _info(plan))
    bag.goal(task.goal_topic, simulation.goal[0], EPOCH_NS)
    if plan.named:
        bag.text("controller/metadata", json.dumps({"controller": plan.controller}))
    valves, command, given = Valves(robot), robot.actuators.safe_command, float(simulation.goal.done[0])
    for tick in range(round(plan.duration_s / TICK_S) + 1):
        time_s = tick * TICK_S
        now_ns = EPOCH_NS + round(time_s * NS)
        goal = simulation.goal[0]
        moving = task.goal_topic == "goal_velocity"
        if moving and float(goal.done) != given:
            given = float(goal.done)
            bag.goal(task.goal_topic, goal, now_ns)
        bag.odometry("ground_truth/odom", simulation.truth[0].to_rigid(), time_s, now_ns)
        bag.odometry("odom", simulation.measured[0].to_rigid(), time_s, now_ns)
        if tick % TICKS == 0:
            command = valves.command(wrench_to(simulation.measured[0], goal, robot, moving=moving))
            bag.command(command, time_s, now_ns + LATENCY_NS + 100_000 * (tick % 7))
        bag.joints("actuators/state", command, time_s, now_ns + 4_000_000)
        simulation.step(command[None, :])
    bag.writer.close()
    return folder


def _info(plan: SpacePlan) -> dict[str, object]:
    named = {"task": plan.task, "controller": plan.controller} if plan.named else {}
    return {
        **named,
        "thing": plan.thing,
        "robot": ROBOT,
        "backend": "mujoco",
        "seed": plan.seed,
        "lockstep": False,
        "rate": 1.0,
        "control_hz": 5.0,
        "scenario": "nominal",
        "fulmar_version": "0.0.0",
        "git_revision": "0123456",
        "command": f"fulmar run {ROBOT}",
    }
