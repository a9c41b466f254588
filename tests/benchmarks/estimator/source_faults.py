"""Faults of sources, and how long they go unnoticed; and how often sound sources are suspected.

    python -m tests.benchmarks.estimator.source_faults spacecraft_16 --seeds 5
    python -m tests.benchmarks.estimator.source_faults turtlebot2 --odometry --minutes 30

Without `--minutes` every fault is done to a robot on its way, once for each seed; with it, sound sources are watched
for so long, of a robot on its way and of one that stands. Exit code 1 if a sound source is suspected.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.estimators.kinds import default_estimator, make_estimator
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.rotation import from_yaw, multiply
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.benchmarks.estimator.loop import (
    Change,
    EstimatedState,
    Follower,
    GatedOdometry,
    Outcome,
    SourceFault,
    SteeredRobot,
)

AT_S = (3.0, 5.0, 8.0, 22.0, 24.0)  # when a source fails, by seed: on the way to a goal
AFTER_S = 15.0  # how long what follows is watched [s]
Make = Callable[
    [np.random.Generator, bool], SourceFault
]  # with noise of its own; whether the robot moves in space


def _kept(value: Callable[[np.ndarray], np.ndarray]) -> Change:
    """The first value for ever, each time with what `value` adds."""
    first: list[np.ndarray] = []

    def change(_since_s: float, pose: np.ndarray) -> np.ndarray:
        first.append(pose)
        return value(first[0].copy())

    return change


def _shaken(rng: np.random.Generator, space: bool) -> Callable[[np.ndarray], np.ndarray]:
    """Adds noise to a pose, in the plane to x, y and yaw."""
    axes, turns = (
        (np.ones(3), np.ones(3)) if space else (np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    )

    def shaken(pose: np.ndarray) -> np.ndarray:
        pose[:3] += 0.001 * axes * rng.standard_normal(3)
        quat = multiply(pose[3:], np.array([*(0.001 * turns * rng.standard_normal(3)), 1.0]))
        pose[3:] = quat / np.linalg.norm(quat)
        return pose

    return shaken


def _creeps(speed: float) -> Change:
    return lambda since_s, pose: np.concatenate(([pose[0] + speed * since_s], pose[1:]))


def _turns(rate: float) -> Change:
    return lambda since_s, pose: np.concatenate(
        (pose[:3], multiply(from_yaw(np.asarray(rate * since_s)), pose[3:]))
    )


def _inertial(rng: np.random.Generator, force_std: float, rate_std: float) -> Change:
    """The first inertial reading for ever, with noise."""
    first: list[ImuSample] = []

    def change(_since_s: float, sample: ImuSample) -> ImuSample:
        first.append(sample)
        return ImuSample(
            first[0].specific_force + force_std * rng.standard_normal(3),
            first[0].angular_velocity + rate_std * rng.standard_normal(3),
        )

    return change


def _ramp(force: float, rate: float) -> Change:
    """Biases that grow: of the accelerometer [m/s³], of the gyroscope [rad/s²]."""
    return lambda since_s, sample: ImuSample(
        sample.specific_force + np.array([force * since_s, 0.0, 0.0]),
        sample.angular_velocity + np.array([0.0, 0.0, rate * since_s]),
    )


def _odometry(pose: Change) -> Change:
    """Odometry whose pose alone fails."""

    def change(since_s: float, state: RigidBodyState) -> RigidBodyState:
        changed = pose(since_s, np.concatenate((state.position_in_world, state.quat_xyzw)))
        return replace(state, position_in_world=changed[:3], quat_xyzw=changed[3:])

    return change


def _twist_stands() -> Change:
    first: list[RigidBodyState] = []

    def change(_since_s: float, state: RigidBodyState) -> RigidBodyState:
        first.append(state)
        return replace(
            state,
            velocity_in_world=first[0].velocity_in_world,
            angular_velocity_in_body=first[0].angular_velocity_in_body,
        )

    return change


ESTIMATED: Mapping[str, Make] = {
    "pose repeats": lambda rng, space: SourceFault(pose=_kept(lambda pose: pose)),
    "pose stands with noise": lambda rng, space: SourceFault(pose=_kept(_shaken(rng, space))),
    "pose creeps 0.1 m/s": lambda rng, space: SourceFault(pose=_creeps(0.1)),
    "pose creeps 0.2 m/s": lambda rng, space: SourceFault(pose=_creeps(0.2)),
    "heading drifts 0.05 rad/s": lambda rng, space: SourceFault(pose=_turns(0.05)),
    "inertial unit repeats": lambda rng, space: SourceFault(imu=_inertial(rng, 0.0, 0.0)),
    "inertial unit stands with noise": lambda rng, space: SourceFault(imu=_inertial(rng, 0.0086, 0.0012)),
    "accelerometer ramps 0.2 m/s³": lambda rng, space: SourceFault(imu=_ramp(0.2, 0.0)),
    "gyroscope ramps 0.1 rad/s²": lambda rng, space: SourceFault(imu=_ramp(0.0, 0.1)),
}
ODOMETRY: Mapping[str, Make] = {
    "odometry repeats": lambda rng, space: SourceFault(odometry=_odometry(_kept(lambda pose: pose))),
    "pose stands with noise": lambda rng, space: SourceFault(odometry=_odometry(_kept(_shaken(rng, space)))),
    "position creeps 0.1 m/s": lambda rng, space: SourceFault(odometry=_odometry(_creeps(0.1))),
    "position creeps 0.5 m/s": lambda rng, space: SourceFault(odometry=_odometry(_creeps(0.5))),
    "position creeps 3 m/s": lambda rng, space: SourceFault(odometry=_odometry(_creeps(3.0))),
    "twist stands": lambda rng, space: SourceFault(odometry=_twist_stands()),
}


def run(
    name: str,
    *,
    scenario: str,
    seed: int,
    seconds: float,
    odometry: bool,
    moves: bool,
    make: Make | None = None,
) -> Outcome:
    """One robot with its classical law; a fault of `make` comes on its way."""
    robot = load_robot(name)
    space = robot.state_type is SpatialState
    task = load_task(_task_of(robot))
    follower: Follower = (
        GatedOdometry(ControllerSettings().input_gate(robot))
        if odometry
        else EstimatedState(
            make_estimator(default_estimator(robot), robot),
            every=max(1, round(0.04 / robot.timing.physics_dt)),
        )
    )
    controller = load_classical(robot, task, control_hz=robot.timing.control_hz)
    steered = SteeredRobot(robot, task, load_scenario(scenario), follower, controller, seed=seed)
    if make is None:
        return steered.run(seconds, moves=moves)
    at_s = AT_S[seed % len(AT_S)]
    return steered.run(at_s + seconds, fault=make(np.random.default_rng(seed), space), fault_s=at_s)


def _task_of(robot: Robot) -> str:
    if robot.airframe is not None:
        return "fly_hold"
    if robot.state_type is SpatialState:
        return "go_to_pose_3d"
    return "go_to_position" if robot.actuators.kind == "ackermann" else "go_to_pose"


def main() -> None:
    """Print a line for each run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("robot")
    parser.add_argument("--scenario", default="nominal")
    parser.add_argument("--odometry", action="store_true", help="the gate of odometry, not the estimator")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=0.0)
    parser.add_argument("--fault", default="", help="only faults whose name has this")
    its = parser.parse_args()
    suspected = False
    for seed in range(its.seeds):
        if its.minutes:
            for moves in (True, False):
                found = run(
                    its.robot,
                    scenario=its.scenario,
                    seed=seed,
                    seconds=60.0 * its.minutes,
                    odometry=its.odometry,
                    moves=moves,
                )
                suspected |= bool(found.warnings)
                sys.stdout.write(
                    f"{its.robot} seed {seed} {'moves' if moves else 'stands'}: {_line(found)}\n"
                )
            continue
        for what, make in (ODOMETRY if its.odometry else ESTIMATED).items():
            if its.fault in what:
                found = run(
                    its.robot,
                    scenario=its.scenario,
                    seed=seed,
                    seconds=AFTER_S,
                    odometry=its.odometry,
                    moves=True,
                    make=make,
                )
                sys.stdout.write(f"{its.robot} seed {seed} {what}: {_line(found)}\n")
    sys.exit(suspected)


def _line(found: Outcome) -> str:
    said = (
        "; ".join(f"'{words[:40]}' at {when:.2f} s" for words, when in found.warnings.items())
        or "nothing said"
    )
    return (
        f"{found.speed:.2f} m/s, then at most {found.most_speed:.2f} m/s; "
        f"last command at {found.last_command_s:.1f} s, {found.blind_s:.1f} s without a state, "
        f"{found.error:.3f} m off; {said}"
    )


if __name__ == "__main__":
    main()
