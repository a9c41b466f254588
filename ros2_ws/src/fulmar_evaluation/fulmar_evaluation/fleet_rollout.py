"""A fleet in its MuJoCo world without ROS: the control loop of each robot, in lock step, in one thread."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from fulmar_bringup.fleet_plan import FleetPlan, formation_of, neighbours_of
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.formation import ShapePlace
from fulmar_core.robots.hull_distance import hull_distance
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.keep_apart import Other
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.metrics import counts_targets
from fulmar_core.states.rotation import yaw_of
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.wires.neighbours import readings_of
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.plant_settings import PlantSettings, first_episode
from policy_server.controllers import Choice, load_controller
from sim_nodes.fleet_world import FleetWorld, Member


@dataclass(frozen=True)
class RobotPath:
    """What became of one robot.

    Attributes:
        poses: True poses after each control step, shape (n, 3): x, y [m], heading [rad].
        arrived: Whether it reached every target, or was within the tolerance for the whole end of the run.
        held: Control steps in which the guard held it back.
    """

    poses: np.ndarray
    arrived: bool
    held: int


@dataclass(frozen=True)
class FleetPaths:
    """What became of a fleet.

    Attributes:
        robots: By name.
        least_m: Least distance between any two hulls at the control steps [m].
    """

    robots: dict[str, RobotPath]
    least_m: float

    @property
    def all_arrived(self) -> bool:
        """Whether every robot did."""
        return all(path.arrived for path in self.robots.values())


def roll_out_fleet(plan: FleetPlan) -> FleetPaths:
    """Run a plan in lock step; every robot has one control rate.

    Raises:
        ConfigError: As in `FleetWorld`.
    """
    drivers = {one.robot_name: _Driver(plan, one) for one in plan.robots}
    world = FleetWorld({name: driver.member for name, driver in drivers.items()}, lockstep=True)
    samples = world.begin_all({name: driver.episode for name, driver in drivers.items()}, seed=plan.seed)
    first = next(iter(drivers.values()))
    for number in range(round(plan.duration_s / first.loop.dt)):
        commands = {name: driver.command(samples[name], number) for name, driver in drivers.items()}
        samples = world.step_all(commands, first.ticks)
        for name, driver in drivers.items():
            driver.poses.append(_pose(samples[name]))
    found = {name: driver.path() for name, driver in drivers.items()}
    return FleetPaths(found, _least(plan, found))


class _Driver:
    """The control loop of one robot of a plan, and what became of the robot."""

    def __init__(self, plan: FleetPlan, one: RunPlan) -> None:
        robot, task = load_robot(one.robot), load_task(one.task)
        self.member = Member(robot, task, load_scenario(one.scenario))
        self._others = [Other.of(text) for text in neighbours_of(plan, one)]
        choice = Choice(one.control_hz, policy=one.policy, seed=one.seed)
        self.loop = ControlLoop(
            robot,
            task,
            load_controller(one.controller, robot, task, choice),
            others=self._others,
            formation=None if not formation_of(plan, one) else ShapePlace.of(formation_of(plan, one)),
        )
        settings = PlantSettings(
            robot=one.robot, task=one.task, scenario=one.scenario, seed=one.seed, start=tuple(one.start)
        )
        self.episode = first_episode(robot, settings)
        assert one.mission is not None  # of a complete plan
        self.loop.reset()
        self.loop.begin(goal_in_float64(one.mission.mapped(lambda part: np.asarray(part)[None])))
        self.ticks, self.poses, self._held = robot.timing.substeps(one.control_hz), list[np.ndarray](), 0

    def command(self, sample: Sample, number: int) -> np.ndarray:
        """The answer to a sample, that of the control step of a number."""
        loop, names = self.loop, [other.name for other in self._others]
        readings = readings_of(sample.neighbours, names) if names else None
        state = self.member.task.state_type.from_rigid(sample.measured).mapped(
            lambda part: np.asarray(part)[None]
        )
        command = loop.step(state, readings or {}, round(1e9 * number * loop.dt)).command[0]
        self._held += int(loop.keep_apart.holds[0]) if loop.keep_apart else 0
        return np.asarray(command)

    def path(self) -> RobotPath:
        """What became of it."""
        goal, task, poses = self.loop.goal, self.member.task, np.array(self.poses)
        assert goal is not None
        targets = np.asarray(goal.targets)[0]
        done = float(goal.done[0]) >= len(targets)
        arrived = done if counts_targets(task) else _stays(poses, targets[0], task, self.loop.dt)
        return RobotPath(poses, arrived, self._held)


def _pose(sample: Sample) -> np.ndarray:
    assert sample.truth is not None
    return np.append(sample.truth.position_in_world[:2], yaw_of(sample.truth.quat_xyzw))


def _stays(path: np.ndarray, target: np.ndarray, task: Task, dt: float) -> bool:
    """Whether the end of a path lies within the task's tolerance of a target."""
    end = path[-max(1, round(task.tolerance.hold_s / dt)) :]
    far = np.linalg.norm(end[:, :2] - target[:2], axis=-1)
    turned = np.abs(np.angle(np.exp(1j * (end[:, 2] - target[2]))))
    heads = task.tolerance.heading_deg == 0.0 or turned.max() <= np.deg2rad(task.tolerance.heading_deg)
    return bool(far.max() <= task.tolerance.position and heads)


def _least(plan: FleetPlan, found: dict[str, RobotPath]) -> float:
    """Least distance between any two hulls [m]."""
    types = {one.robot_name: load_robot(one.robot) for one in plan.robots}
    return min(
        float(hull_distance(types[one], found[one].poses, types[other], found[other].poses).min())
        for one, other in itertools.combinations(found, 2)
    )
