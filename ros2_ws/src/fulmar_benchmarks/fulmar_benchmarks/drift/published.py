"""What DRIFT reports: M. El-Hariry, thesis chapter 3, Tables 3.5 and 3.6, simulated in MuJoCo.

PT and OT are percent of the time below 5, 2 and 1 cm and degrees, means over 256 trajectories of 250 steps.
"""

from __future__ import annotations

FIGURES = ("PT5", "PT2", "PT1", "OT5", "OT2", "OT1", "ALV", "AAV", "AAS")
DIGITS = {name: 0 if name[1] == "T" else 2 for name in FIGURES}  # as printed there
BETTER = {name: "more" if name[1] == "T" else "less" for name in FIGURES}

# Which of its two controllers stands beside which of ours.
BESIDE = {"policy": "RL"}  # all others are compared with its LQR
_RL = {
    "ideal": (64, 34, 6, 94, 89, 73, 0.08, 0.12, 0.29),
    "velocity_noise_2": (64, 30, 7, 94, 90, 72, 0.08, 0.12, 0.31),
    "velocity_noise_4": (61, 21, 6, 94, 89, 66, 0.09, 0.13, 0.31),
    "torque": (63, 24, 2, 94, 86, 61, 0.08, 0.12, 0.35),
    "force_2": (63, 29, 7, 94, 90, 74, 0.09, 0.12, 0.30),
    "force_4": (52, 19, 5, 94, 89, 72, 0.09, 0.12, 0.31),
    "force_torque": (62, 24, 5, 94, 86, 61, 0.08, 0.12, 0.35),
    "one_lost": (32, 15, 6, 70, 55, 36, 0.10, 0.12, 0.28),
    "two_lost": (15, 6, 2, 45, 31, 20, 0.16, 0.15, 0.25),
}
_LQR = {
    "ideal": (73, 41, 17, 27, 11, 5, 0.07, 0.16, 0.10),
    "velocity_noise_2": (53, 21, 6, 4, 1, 0, 0.09, 0.49, 0.23),
    "velocity_noise_4": (14, 3, 0, 2, 1, 0, 0.15, 0.56, 0.29),
    "torque": (57, 20, 6, 3, 1, 0, 0.07, 0.43, 0.35),
    "force_2": (66, 17, 4, 28, 12, 6, 0.07, 0.15, 0.12),
    "force_4": (23, 0, 0, 30, 13, 6, 0.08, 0.16, 0.15),
    "force_torque": (13, 2, 0, 3, 1, 0, 0.07, 0.44, 0.32),
    "one_lost": (40, 17, 5, 20, 8, 4, 0.10, 0.21, 0.16),
    "two_lost": (12, 4, 1, 11, 4, 2, 0.14, 0.28, 0.22),
}
# Table 3.6: velocity error, mean and standard deviation over the run, simulated [m/s]. Its policy alone was tried.
TRACKING = {"circle": (0.01, 0.01), "infinite": (0.01, 0.01), "square": (0.05, 0.08)}


def published(row: str, controller: str) -> tuple[str, dict[str, float]]:
    """What stands beside one of our controllers in a row of Table 3.5.

    Args:
        row: Name of a condition.
        controller: Name of our controller.

    Returns:
        RL or LQR, and its figures by the names of `FIGURES`.
    """
    kind = BESIDE.get(controller, "LQR")
    return kind, dict(zip(FIGURES, (_RL if kind == "RL" else _LQR)[row], strict=True))
