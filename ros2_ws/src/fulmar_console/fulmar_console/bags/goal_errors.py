"""How far a robot was from its goal at each time, as far as goal and pose alone say it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

POSE = 7
TURNS = ("attitude",)  # forms of goals whose error is an angle


@dataclass(frozen=True)
class GoalSpan:
    """A target that counts from a time on: a pose, or a twist of six numbers; `done` targets came before it."""

    t_s: float
    target: Sequence[float] | None  # None: there is no goal
    distance_m: float | None = None  # as the controller reports it


def goal_errors(
    t_s: np.ndarray, pose: np.ndarray, twist: np.ndarray, spans: Sequence[GoalSpan], *, form: str, moves: bool
) -> np.ndarray:
    """The error at each time: distance [m], angle [deg] of attitudes, speed [m/s] of velocities; NaN without a goal.

    Args:
        t_s: Times, rising, shape (n,) [s].
        pose: Measured, shape (n, 7).
        twist: Measured, in the body's frame, shape (n, 6).
        spans: In their order.
        form: Of goals, as in `robot_info`.
        moves: Whether the goal moves along a path of its own: then only the controller knows where it is.
    """
    errors = np.full(len(t_s), np.nan)
    begins = np.array([span.t_s for span in spans])
    if not len(begins):
        return errors
    if moves:
        known = [(span.t_s, span.distance_m) for span in spans if span.distance_m is not None]
        if not known:
            return errors
        at, distances = np.array(known).T
        found = np.interp(t_s, at, distances)
        return np.where(t_s >= at[0], found, np.nan)
    newest = np.searchsorted(begins, t_s, side="right") - 1
    for number, span in enumerate(spans):
        here = newest == number
        if span.target is not None and here.any():
            errors[here] = _error(pose[here], twist[here], np.asarray(span.target, dtype=float), form)
    return errors


def _error(pose: np.ndarray, twist: np.ndarray, target: np.ndarray, form: str) -> np.ndarray:
    if len(target) != POSE:
        return np.asarray(np.linalg.norm(twist[:, :3] - target[:3], axis=1))
    if form in TURNS:
        dot = np.abs(np.sum(pose[:, 3:] * target[3:], axis=1)).clip(0.0, 1.0)
        return np.asarray(np.rad2deg(2.0 * np.arccos(dot)))
    axes = 3 if form.endswith("3") or form in ("path", "flight") else 2
    return np.asarray(np.linalg.norm(pose[:, :axes] - target[:axes], axis=1))


def error_label(form: str) -> str:
    """What the error of a form of goals is, with its unit."""
    if form.startswith("velocity"):
        return "velocity error [m/s]"
    return "attitude error [°]" if form in TURNS else "distance to goal [m]"
