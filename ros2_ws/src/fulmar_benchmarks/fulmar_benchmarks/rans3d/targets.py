"""What is evaluated, what RANS publishes of it, and what is required of us.

RANS = elharirymatteo/RANS at 6f2720b, its 3-D tasks; thesis = M. El-Hariry, §3.3. Both print no table of successes or
errors in six degrees of freedom: what is published are the settings and tolerances below.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

ROBOTS = ("spacecraft_16", "int_ball2")
TASKS = (
    "go_to_position_3d",
    "go_to_pose_3d",
    "track_velocities_3d",
    "go_through_positions_3d",
    "go_through_poses_3d",
)
PARTS = ("tasks", "dead", "integrator", "throughput")
CONTROLLERS = ("lqr", "pd", "policy")
NOMINAL, RANDOMISED = "nominal", "randomised"
SCENARIOS = (NOMINAL, RANDOMISED)
DEAD = {"one_dead": 1, "two_dead": 2}  # scenarios, and how many thrusters they take from the spacecraft
DEAD_TASK, DEAD_CONTROLLERS = "go_to_pose_3d", ("lqr", "policy")

# Robots whose episodes differ from those of the tasks: starts up to [m], length [s].
EPISODES = {"int_ball2": (2.0, 60.0)}

RANS_POSITION_M, RANS_ATTITUDE_RAD, RANS_STEPS = 0.01, 0.025, 50  # held so long in a row
_RANS_STARTS = {"start_distance_m": [0.25, 6.0], "kill_distance_m": 8.0}


def _of_rans(file: str, episode_steps: int) -> dict[str, Any]:
    """What the settings of all its tasks share, and where they are: a file in its `omniisaacgymenvs/cfg/task`."""
    return {
        "consecutive_steps": RANS_STEPS,
        "episode_steps": episode_steps,
        "control_hz": 5.0,
        "physics_dt_s": 0.02,
        "source": f"elharirymatteo/RANS at 6f2720b, {file}",
    }


_ROBORAN = {"source": "snt-spacer/RobRAN-Code at 9273fc28, 3-D tasks; its own Int-Ball2 is another body"}
OF_RANS: dict[str, dict[str, Any]] = {
    "go_to_position_3d": {
        "position_tolerance_m": RANS_POSITION_M,
        **_RANS_STARTS,
        **_of_rans("MFP3D_GoToXYZ.yaml", 450),
    },
    "go_to_pose_3d": {
        "position_tolerance_m": RANS_POSITION_M,
        "attitude_tolerance_rad": RANS_ATTITUDE_RAD,
        **_RANS_STARTS,
        **_of_rans("MFP3D_GoToPose.yaml", 450),
    },
    "track_velocities_3d": {
        "velocity_tolerance_m_s": 0.01,
        "rate_tolerance_rad_s": 0.025,
        "most_speed_m_s": 0.75,
        "most_rate_rad_s": 0.75,
        **_of_rans("MFP3D_Track6DoFVelocity.yaml", 250),
    },
}
OF_ROBORAN: dict[str, dict[str, Any]] = {
    "go_to_position_3d": {"position_tolerance_m": 0.01, "consecutive_steps": 100, **_ROBORAN},
    "go_to_pose_3d": {
        "position_tolerance_m": 0.01,
        "attitude_tolerance_deg": 5.0,
        "consecutive_steps": 100,
        **_ROBORAN,
    },
    "track_velocities_3d": {
        "velocity_tolerance_m_s": 0.01,
        "rate_tolerance_rad_s": 0.05,
        "most_speed_m_s": 1.0,
        "most_rate_rad_s": 0.4,
        **_ROBORAN,
    },
    "go_through_positions_3d": {"position_tolerance_m": 0.1, **_ROBORAN},
    "go_through_poses_3d": {"position_tolerance_m": 0.1, "attitude_tolerance_deg": 9.0, **_ROBORAN},
}
PUBLISHED_NOTE = (
    "No source prints numbers of success or error in six degrees of freedom: thesis §3.3 and RANS have none that we "
    "could read. `published` holds settings and tolerances, of RANS for the spacecraft where it has the task, else of "
    "RoboRAN."
)

SHIPPED = {
    "spacecraft_16": ("go_to_position_3d", "go_to_pose_3d", "track_velocities_3d", "go_through_poses_3d"),
    "int_ball2": ("go_to_position_3d", "go_to_pose_3d"),
}  # tasks whose bundles `fulmar policies` makes


def published(robot: str, task: str) -> dict[str, Any]:
    """Settings and tolerances that are published for a pair, with their source."""
    own = OF_RANS.get(task) if robot == "spacecraft_16" else None
    return dict(own or OF_ROBORAN[task])


def how_to_make(robot: str, task: str) -> str:
    """How one gets the bundle of a pair."""
    if task in SHIPPED[robot]:
        return f"`fulmar policies {robot}_{task}` makes it"
    return f"none is meant to be shipped; `fulmar train {robot} {task}` trains one"


@dataclass(frozen=True)
class Requirement:
    """Least success of one controller at one task."""

    robot: str
    task: str
    controller: str
    limit: float
    among_holdable: bool = False  # of the randomised episodes that can be held; False: of the nominal ones


_LEARNED = ("go_to_position_3d", "go_to_pose_3d", "track_velocities_3d")
REQUIRED = (
    Requirement("spacecraft_16", "go_to_pose_3d", "lqr", 0.99),
    Requirement("spacecraft_16", "go_to_pose_3d", "pd", 0.99),
    *(Requirement("spacecraft_16", task, "policy", 0.98) for task in _LEARNED),
    *(Requirement("spacecraft_16", task, "policy", 0.90, among_holdable=True) for task in _LEARNED),
    Requirement("int_ball2", "go_to_pose_3d", "lqr", 0.98),
    Requirement("int_ball2", "go_to_pose_3d", "policy", 0.97),
)
MOST_ENERGY, MOST_MOMENTUM, MOST_FROM_JACOBI = 1e-9, 1e-9, 1e-6  # relative, over `HOUR_S` in float64
HOUR_S = 3600.0
WORLDS = 4096
LEAST_RATIO = {"numpy": 15.0, "compiled": 35.0}  # times MuJoCo's rollout
# Aims, which are printed beside the requirements:
MOST_DUTY = 0.25  # of the valves
LEAST_WITH_DEAD = 0.9  # success with one or two dead thrusters of sixteen
AIMED_RATIO, AIMED_STEPS_PER_S = 30.0, 3e6
