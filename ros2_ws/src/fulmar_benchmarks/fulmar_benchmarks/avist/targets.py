"""What is evaluated, what RL-AVIST publishes of it, and what is required of us.

AVIST = M. El-Hariry et al., arXiv 2510.22699, and thesis §6.2; SRB = its code, AndrejOrsula/space_robotics_bench at
7528ff8. Neither prints a figure of success, error or coverage: what is published are settings.
"""

from __future__ import annotations

from typing import Any

from fulmar_benchmarks.shape import Check

FOLLOW = "follow_pose_3d"
TASKS = ("go_to_position_3d", "go_to_pose_3d", "track_velocities_3d", FOLLOW)
LAWS = ("lqr", "pd")
CONTROLLERS = (*LAWS, "policy")
INSPECT = "inspect"
THINGS = ("gateway", "iss", "venus_express")
PATHS = ("circle", "spiral", "capsule", "rectangle", "lemniscate", "lissajous", "line")
PARTS = ("tasks", "live", "inspect")
ALL_PARTS = (*PARTS, "learners", "generalists")  # the last two learn for hours, and are asked for by name
LIVE_EPISODES = 64

PUBLISHED_NOTE = (
    "Thesis §6.2 and arXiv 2510.22699 print no number of success, error or coverage: Figures 6.1 to 6.3 are curves and "
    "paths. `published` holds settings, of the code at AndrejOrsula/space_robotics_bench 7528ff8."
)
PUBLISHED: dict[str, Any] = {
    "control_hz": 10.0,
    "physics_dt_s": 0.025,
    "camera": {"width": 64, "height": 64, "field_of_view_deg": 100.4},
    "target_speed_m_s": [0.1, 1.0],
    "seeds": 3,
    "source": "AndrejOrsula/space_robotics_bench at 7528ff8",
}

LEAST_SUCCESS = {
    ("go_to_pose_3d", "lqr"): 0.99,
    ("go_to_pose_3d", "pd"): 0.99,
    ("track_velocities_3d", "policy"): 0.98,
    ("go_to_position_3d", "policy"): 0.98,
    ("go_to_pose_3d", "policy"): 0.95,
    (FOLLOW, "policy"): 0.85,
}
MOST_FROM_BATCH = 0.03  # success through live nodes, beside MuJoCo
MOST_PATH_ERROR_M, MOST_OFF_PATH_M, MOST_POINTING_DEG = 0.01, 0.05, 0.5  # mean, largest; mean; of laws


def of_inspection(found: dict[str, dict[str, dict[str, Any]]]) -> list[Check]:
    """The worst of each law over things and paths; no robot may enter a keep-out volume."""
    checks = []
    for by in CONTROLLERS:
        flown = [each[by] for paths in found.values() for each in paths.values() if by in each]
        if not flown:
            continue
        limits = {
            ("path_error_m", "mean"): MOST_PATH_ERROR_M,
            ("path_error_m", "max"): MOST_OFF_PATH_M,
            ("pointing_error_deg", "mean"): MOST_POINTING_DEG,
        }
        for (key, inner), limit in limits.items() if by in LAWS else ():
            checks.append(Check.most(f"inspect, {by}: {key}, {inner}", _worst(flown, key, inner), limit))
        least = [one["least_distance_m"] for one in flown]
        away = None if None in least else min(least)
        checks.append(Check.least(f"inspect, {by}: least distance from a keep-out volume [m]", away, 0.0))
    return checks


def _worst(flown: list[dict[str, Any]], key: str, inner: str) -> float | None:
    values: list[Any] = [(one[key] or {}).get(inner) for one in flown]
    return None if None in values else max(values)


def of_tasks(found: dict[str, dict[str, Any]]) -> list[Check]:
    """Success, of what was asked for; a cell that could not be evaluated is open."""
    return [
        Check.least(f"{task}, {by}: success", found[task][by]["success_rate"], limit)
        for (task, by), limit in LEAST_SUCCESS.items()
        if by in found.get(task, {})
    ]


def of_live(through: dict[str, Any] | None, beside: dict[str, Any] | None) -> list[Check]:
    """Success through nodes beside the same in MuJoCo."""
    if through is None or beside is None:
        return []
    rates = [one["success_rate"] for one in (through, beside)]
    away = None if None in rates else abs(rates[0] - rates[1])
    return [
        Check.most(f"{FOLLOW}, policy: success through nodes, from that in MuJoCo", away, MOST_FROM_BATCH)
    ]
