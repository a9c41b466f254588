"""What this project asks of its shipped policies, and whether a measurement meets it."""

from __future__ import annotations

from dataclasses import dataclass

WAY_GAP = 0.02  # most between batch and MuJoCo, in the judged figure
LONGEST_TRAINING_S = 300.0  # on two cores
SHORTEST_TRAINING_S = {("floating_platform", "go_to_pose"): 60.0}  # start-up included

# Least value of the judged figure, in batch and in MuJoCo alike.
LEAST = {
    "go_to_position": {"floating_platform": 0.99, "kingfisher": 0.95, "turtlebot2": 0.99},
    "go_to_pose": {"floating_platform": 0.99, "kingfisher": 0.90, "turtlebot2": 0.97},
    "track_velocities": {"floating_platform": 0.97, "kingfisher": 0.85, "turtlebot2": 0.95},
    "go_through_positions": {"floating_platform": 0.75, "kingfisher": 0.80, "turtlebot2": 0.90},
    "go_to_position_with_obstacles": {"floating_platform": 0.95, "kingfisher": 0.90, "turtlebot2": 0.95},
}


@dataclass(frozen=True)
class Verdict:
    """One requirement and what was measured."""

    name: str
    measured: float | None  # None: not measured
    limit: float
    met: bool | None  # None: not measured


def judged_figure(task: str) -> str:
    """Which figure is judged: the mean share of the bound where waypoints are counted, else success."""
    return "share_of_bound" if task == "go_through_positions" else "success_rate"


def verdicts(
    robot: str, task: str, judged: dict[str, float], *, same: bool | None, training_s: float | None
) -> list[Verdict]:
    """Compare a pair with what is asked of it.

    Args:
        robot: Name of the robot.
        task: Name of the task.
        judged: The judged figure by way: batch, mujoco, ros.
        same: Whether figures were the same with 64 worlds as with all; None: not looked at.
        training_s: Wall-clock that the policy was trained for; None for what was not trained [s].

    Returns:
        One verdict a requirement; none for pairs that nothing is asked of.
    """
    least = LEAST.get(task, {}).get(robot)
    if least is None:
        return []
    found = [
        Verdict(way, value, least, None if value is None else value >= least)
        for way, value in ((way, judged.get(way)) for way in ("batch", "mujoco"))
    ]
    gap = abs(judged["batch"] - judged["mujoco"]) if {"batch", "mujoco"} <= set(judged) else None
    found.append(Verdict("batch_minus_mujoco", gap, WAY_GAP, None if gap is None else gap <= WAY_GAP))
    found.append(Verdict("same_at_64_worlds", None if same is None else float(same), 1.0, same))
    if training_s is not None:
        limit = SHORTEST_TRAINING_S.get((robot, task), LONGEST_TRAINING_S)
        found.append(Verdict("training_s", training_s, limit, training_s < limit))
    return found
