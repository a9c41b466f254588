"""One robot of a bag at even times: pose, what its actuators did, error, latency and level, as float32 for the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_bags.decode import NS, Odometries, Vectors
from fulmar_console.bags.robot_time import RobotTime

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
SILENT_S = 1.0  # after which what actuators do is not known [s]
HELD_S = 0.5  # between two poses; over longer gaps the older one stays [s]


@dataclass(frozen=True)
class Track:
    """Columns of one robot at even times, shape (n, fields), float32."""

    fields: tuple[str, ...]
    values: np.ndarray


def even_times(time: RobotTime, hz: float) -> np.ndarray:
    """Whole multiples of the period from the first to the last odometry, shape (n,) [s]."""
    first, last = np.floor(hz * time.t_s[0]), np.ceil(hz * time.t_s[-1])
    return np.arange(first, last + 1) / hz


def poses_at(times: np.ndarray, t_s: np.ndarray, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses at some times, shape (n, 7), and how old the newest measurement is then, shape (n,) [s].

    Between two measurements that follow each other, the pose lies on the straight way between them.
    """
    older = np.clip(np.searchsorted(t_s, times, side="right") - 1, 0, len(t_s) - 1)
    newer = np.minimum(older + 1, len(t_s) - 1)
    gap = t_s[newer] - t_s[older]
    age = np.clip(times - t_s[older], 0.0, None)
    share = np.where((gap > 0.0) & (gap < HELD_S), age / np.where(gap > 0.0, gap, 1.0), 0.0).clip(0.0, 1.0)
    first, second = pose[older], pose[newer].copy()
    second[:, 3:] *= np.where(np.sum(first[:, 3:] * second[:, 3:], axis=1) < 0.0, -1.0, 1.0)[:, None]
    found = first + share[:, None] * (second - first)
    norm = np.linalg.norm(found[:, 3:], axis=1, keepdims=True)
    found[:, 3:] = np.where(
        norm > 1e-6, found[:, 3:] / np.where(norm > 1e-6, norm, 1.0), (0.0, 0.0, 0.0, 1.0)
    )
    return found, age


def shares_at(
    times: np.ndarray, applied: Vectors, time: RobotTime, actuators: Sequence[Mapping[str, Any]]
) -> np.ndarray:
    """Shares of full command, each on average since the time before, shape (n, m): a short pulse of a valve shows.

    Args:
        times: Even, shape (n,) [s].
        applied: What was applied, by name.
        time: Of the robot.
        actuators: As in `robot_info`.
    """
    found = np.zeros((len(times), len(actuators)))
    columns = [
        applied.names.index(each["name"]) if each["name"] in applied.names else -1 for each in actuators
    ]
    if not len(applied) or max(columns, default=-1) < 0:
        return found
    t_s = np.maximum.accumulate(time.at_stamp(applied.stamp_ns, applied.log_ns))
    full = np.array([float(each.get("full") or 1.0) for each in actuators])
    values = np.where(np.array(columns) >= 0, np.nan_to_num(applied.values[:, columns]), 0.0) / full
    lasts = np.minimum(np.append(np.diff(t_s), SILENT_S), SILENT_S)  # each holds until the next one
    done = np.vstack((np.zeros((1, len(full))), np.cumsum(values * lasts[:, None], axis=0)))
    edges = np.concatenate(([times[0] - (times[1] - times[0] if len(times) > 1 else 1.0)], times))
    newest = np.searchsorted(t_s, edges, side="right") - 1
    since = np.clip(edges - t_s[newest.clip(0)], 0.0, lasts[newest.clip(0)])
    total = done[newest.clip(0)] + values[newest.clip(0)] * since[:, None]
    total[newest < 0] = 0.0
    return np.diff(total, axis=0) / np.diff(edges)[:, None]


def latencies_at(times: np.ndarray, odometry: Odometries, commands: Vectors, time: RobotTime) -> np.ndarray:
    """From the sending of the odometry to the sending of the command that answers it, the newest, shape (n,) [ms].

    NaN before the first, and once none has come for a while.
    """
    found = np.full(len(times), np.nan)
    if not len(commands):
        return found
    order = np.argsort(odometry.stamp_ns, kind="stable")
    place = np.searchsorted(odometry.stamp_ns[order], commands.stamp_ns).clip(0, len(order) - 1)
    answered = order[place]
    known = odometry.stamp_ns[answered] == commands.stamp_ns
    if not known.any():
        return found
    late_ms = (commands.publish_ns[known] - odometry.publish_ns[answered[known]]) / 1e6
    t_s = np.maximum.accumulate(time.t_s[answered[known]])
    newest = np.searchsorted(t_s, times + 1e-6, side="right") - 1
    fresh = (newest >= 0) & (times - t_s[newest.clip(0)] < SILENT_S)
    found[fresh] = late_ms[newest[fresh]]
    return found


def levels_at(times: np.ndarray, changes: Sequence[tuple[float, int]]) -> np.ndarray:
    """Level of health at some times, shape (n,): 0 ok, 1 warn, 2 error; 0 before the first change."""
    begins = np.array([t_s for t_s, _ in changes])
    levels = np.array([0, *(level for _, level in changes)])
    return levels[np.searchsorted(begins, times, side="right")] if len(begins) else np.zeros(len(times))


def held_at(times: np.ndarray, changes: Sequence[tuple[float, float]]) -> np.ndarray:
    """The newest value at some times, shape (n,); NaN before the first."""
    begins = np.array([t_s for t_s, _ in changes])
    values = np.array([np.nan, *(value for _, value in changes)])
    return (
        values[np.searchsorted(begins, times, side="right")] if len(begins) else np.full(len(times), np.nan)
    )


def things_at(times: np.ndarray, things: Mapping[str, tuple[Any, ...]], time: RobotTime) -> Track:
    """Poses of the things of a task that a bag has, seven columns each."""
    fields, columns = list[str](), list[np.ndarray]()
    for name, poses in things.items():
        if not poses:
            continue
        stamps, logs = (np.array([getattr(each, key) for each in poses]) for key in ("stamp_ns", "log_ns"))
        t_s = np.maximum.accumulate(time.at_stamp(stamps, logs))
        columns.append(poses_at(times, t_s, np.array([each.value for each in poses]))[0])
        fields += [f"{name}:{part}" for part in POSE]
    values = np.concatenate(columns, axis=1) if columns else np.zeros((len(times), 0))
    return Track(tuple(fields), values)


def rate_of(seconds: float, robots: int, most: int = 1_500_000, hz: float = 25.0) -> float:
    """Samples a second: 25, fewer where a bag is so long that a page would have to hold too much [Hz]."""
    return min(hz, max(0.1, most / max(1, robots) / max(seconds, 1.0 / NS) / 20.0))
