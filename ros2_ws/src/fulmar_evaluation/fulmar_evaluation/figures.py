"""Figures of an evaluation: title, unit and meaning of each, in the one place where they are defined."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One figure of `metrics.episode_metrics`."""

    title: str  # a few words
    unit: str
    meaning: str  # a sentence
    better: str = ""  # "less", "more", or nothing to say


FIGURES = {
    "final_position_error_m": Figure(
        "final distance", "m", "Distance from the goal at the last step.", "less",
    ),
    "final_heading_error_deg": Figure(
        "final heading error", "°", "Size of the heading error at the last step.", "less",
    ),
    "final_attitude_error_deg": Figure(
        "final attitude error", "°", "Angle of the rotation to the goal's attitude at the last step.", "less",
    ),
    "time_to_target_s": Figure(
        "time to target", "s",
        "Time from which the episode stays inside every tolerance until its end; an episode that does not has "
        "none.", "less",
    ),
    "first_inside_s": Figure(
        "first inside", "s",
        "Time at which every tolerance is met for the first time, also if it is left again.", "less",
    ),
    "inside_percent": Figure("time inside", "%", "Share of the time inside every tolerance.", "more"),
    "goals_reached": Figure(
        "goals reached", "",
        "Waypoints passed within the tolerance, in their order, by the true state at the ends of control steps.",
        "more",
    ),
    "time_to_first_goal_s": Figure(
        "time to first goal", "s", "Time at which the first waypoint is reached.", "less",
    ),
    "goals_bound": Figure(
        "goals bound", "",
        "The most waypoints that physics allows in this very episode, by the bound that fits the robot, which is "
        "named beside it.",
    ),
    "share_of_bound": Figure(
        "share of the bound", "-",
        "Goals reached over the bound of the same episode; requirements apply to its mean.", "more",
    ),
    "goals_at_top_speed": Figure(
        "bound at top speed", "",
        "The most waypoints if nothing but the top speed held the robot: no turning, no slew.",
    ),
    "share_at_top_speed": Figure(
        "share of that bound", "-", "Goals reached over the bound at top speed of the same episode.", "more",
    ),
    "velocity_error_m_s": Figure(
        "velocity error", "m/s",
        "Length of wanted minus true velocity in the body's frame, mean over the whole episode, changes of the "
        "target included.", "less",
    ),
    "yaw_rate_error_deg_s": Figure(
        "turn-rate error", "°/s", "Size of wanted minus true turn rate, mean over the whole episode.", "less",
    ),
    "rate_error_deg_s": Figure(
        "turn-rate error", "°/s", "Length of wanted minus true turn rate in space, mean over the whole episode.",
        "less",
    ),
    "settling_time_s": Figure(
        "settling time", "s",
        "From the coming of a target until both errors stay inside the tolerance to the end of its time, mean "
        "over the targets; one that is never held counts with all of its time.", "less",
    ),
    "targets_held_percent": Figure(
        "targets held", "%", "Share of targets inside the tolerance for the whole end of their time.", "more",
    ),
    "PT5_percent": Figure("within 5 cm", "%", "Share of the time nearer to the goal than 5 cm.", "more"),
    "PT2_percent": Figure("within 2 cm", "%", "Share of the time nearer to the goal than 2 cm.", "more"),
    "PT1_percent": Figure("within 1 cm", "%", "Share of the time nearer to the goal than 1 cm.", "more"),
    "OT5_percent": Figure("within 5°", "%", "Share of the time with a heading error below 5°.", "more"),
    "OT2_percent": Figure("within 2°", "%", "Share of the time with a heading error below 2°.", "more"),
    "OT1_percent": Figure("within 1°", "%", "Share of the time with a heading error below 1°.", "more"),
    "path_error_m": Figure(
        "path error", "m", "Mean distance from a target that moves; its `max` is over all episodes.", "less",
    ),
    "path_error_most_m": Figure(
        "largest path error", "m", "Largest distance from a target that moves.", "less",
    ),
    "pointing_error_deg": Figure(
        "pointing error", "°", "Mean angle between the camera's axis and the way to the middle of the thing.", "less",
    ),
    "least_distance_m": Figure(
        "least distance", "m",
        "Least distance of the body's origin from the keep-out volume, negative within it; `min` is over all episodes.",
        "more",
    ),
    "coverage": Figure(
        "coverage", "-",
        "Share of the thing's whole outer surface that the camera has seen at 60° or less from its normal, with "
        "nothing in between; of the first 64 episodes.", "more",
    ),
    "coverage_possible": Figure(
        "coverage possible", "-", "The same, could the camera have looked everywhere from where it was.",
    ),
    "ALV_m_s": Figure("mean speed", "m/s", "Mean speed over the episode."),
    "AAV_rad_s": Figure("mean turn rate", "rad/s", "Mean size of the turn rate over the episode."),
    "AAS": Figure("actuators in use", "-", "Mean share of actuators with a command other than zero.", "less"),
    "effort": Figure("effort", "-", "Mean share of full command, over time and actuators.", "less"),
    "impulse_N_s": Figure(
        "impulse", "N·s",
        "Thrust of all nozzles, added up over the episode, of a robot whose fuel is a part of its mass.", "less",
    ),
    "fuel_used_kg": Figure(
        "fuel used", "kg", "What that takes from the tank, by the specific impulse of the nozzles.", "less",
    ),
    "control_variation": Figure(
        "control variation", "-",
        "Sum over the actuators of the change of their shares of full command from one step to the next, mean "
        "over time (the code of RoboRAN sums it).", "less",
    ),
    "control_deviation": Figure(
        "control deviation", "-",
        "Standard deviation over time of the share of full command, mean over the actuators (the words of the "
        "thesis); at most 0.5 for a valve.", "less",
    ),
    "collided": Figure("collided", "-", "Share of episodes that hit an obstacle (aircraft: water, ground).", "less"),
    "left_the_geofence": Figure(
        "left the geofence", "-", "Share of episodes that were beyond the geofence at any step.", "less",
    ),
    "thesis_success": Figure(
        "success by the thesis' words", "-",
        "Share of episodes inside the tolerances at the last step; for velocities, whose mean errors are; for "
        "waypoints, with at least one reached.", "more",
    ),
}  # fmt: skip


SUCCESS = (
    "Share of episodes that stayed inside every tolerance of the task for the whole closing window (4 s unless its "
    "file says otherwise), or, where waypoints are counted, reached as many as the task requires; and that touched "
    "nothing."
)


def meanings(width: int = 78) -> str:
    """Every figure with its meaning, for a terminal that wide."""
    indent = 2 + max(map(len, FIGURES))
    return "\n".join(
        textwrap.fill(meaning, width, initial_indent=f"{name:<{indent}}", subsequent_indent=" " * indent)
        for name, meaning in [
            ("success_rate", SUCCESS),
            *((name, figure.meaning) for name, figure in FIGURES.items()),
        ]
    )
