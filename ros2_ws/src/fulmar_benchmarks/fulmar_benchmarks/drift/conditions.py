"""What the benchmark runs: the nine conditions of thesis Table 3.5, and the three paths of Table 3.6."""

from __future__ import annotations

from dataclasses import dataclass

ROBOT = "floating_platform"
POSE_TASK = "drift_go_to_pose"
PATH_TASK = "drift_track_velocities"
EPISODES = 256  # of each condition: thesis §3.5.7
PATH_EPISODES = 4  # of each path: the thesis has one run, ours begin at several places of it
CONTROLLERS = ("policy", "lqr")


@dataclass(frozen=True)
class Condition:
    """One row of Table 3.5: 250 steps of 0.2 s towards a pose."""

    name: str
    title: str
    scenario: str
    lost: int = 0  # thrusters


@dataclass(frozen=True)
class Path:
    """One row of Table 3.6: a path followed at 0.2 m/s."""

    name: str
    title: str
    goals: str  # name of a file in configs/goals


CONDITIONS = (
    Condition("ideal", "Ideal", "drift_ideal"),
    Condition("velocity_noise_2", "Velocity noise 0.02 m/s", "drift_velocity_noise_2"),
    Condition("velocity_noise_4", "Velocity noise 0.04 m/s", "drift_velocity_noise_4"),
    Condition("torque", "Torque 0.05 N·m", "drift_torque"),
    Condition("force_2", "Force 0.2 N", "drift_force_2"),
    Condition("force_4", "Force 0.4 N", "drift_force_4"),
    Condition("force_torque", "Force 0.2 N, torque 0.05 N·m", "drift_force_torque"),
    Condition("one_lost", "1 thruster lost", "drift_one_lost", lost=1),
    Condition("two_lost", "2 thrusters lost", "drift_two_lost", lost=2),
)
PATHS = (
    Path("circle", "Circle", "drift_circle"),
    Path("infinite", "Infinite", "drift_infinite"),
    Path("square", "Square", "drift_square"),
)
ROWS = tuple(row.name for row in (*CONDITIONS, *PATHS))
PATH_SCENARIO = "drift_ideal"
PATH_EPISODE_S = 100.0  # about two rounds
RUN_UP_S = 5.0  # from rest to 0.2 m/s takes 1.1 to 1.5 s; what comes after this counts as under way
