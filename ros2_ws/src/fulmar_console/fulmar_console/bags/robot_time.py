"""When things happened on a robot's own clock: seconds from the begin of a recording on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_bags.decode import NS

LONGEST_STEP_NS = 3600 * NS  # between two stamps; more is a clock that was set anew


@dataclass(frozen=True)
class RobotTime:
    """Maps stamps and times of recording onto the time line of a page.

    Attributes:
        t_s: Of each odometry, from `begin_s` on, not falling, shape (n,) [s].
        log_ns: When each was recorded, not falling, shape (n,) [ns].
        stamp_ns: Its stamp, shape (n,) [ns].
    """

    t_s: np.ndarray
    log_ns: np.ndarray
    stamp_ns: np.ndarray

    def at_log(self, log_ns: np.ndarray | float) -> np.ndarray:
        """Time of what was recorded then, as that of the odometry around it; no sooner than the first [s]."""
        return np.interp(log_ns, self.log_ns, self.t_s)

    def at_stamp(self, stamp_ns: np.ndarray, log_ns: np.ndarray) -> np.ndarray:
        """Time of what is stamped on the robot's clock; of what is stamped by another, when it was recorded [s]."""
        stamps = self.stamp_ns
        if (np.diff(stamps) < 0).any() or not len(stamps):  # the clock began anew: stamps say too little
            return self.at_log(log_ns)
        slack = 2 * NS
        its = (stamp_ns >= stamps[0] - slack) & (stamp_ns <= stamps[-1] + slack)
        return np.where(its, np.interp(stamp_ns, stamps, self.t_s), self.at_log(log_ns))


def robot_time(stamp_ns: np.ndarray, log_ns: np.ndarray, begin_s: float) -> RobotTime:
    """The time line of one robot, which begins at `begin_s` [s].

    A stamp that falls, as after a restart of a simulation, goes on by the time of recording.

    Args:
        stamp_ns: Of its odometry, shape (n,), n > 0 [ns].
        log_ns: When each was recorded, shape (n,) [ns].
        begin_s: Of the first one on the page [s].
    """
    steps, recorded = np.diff(stamp_ns), np.diff(log_ns)
    wrong = (steps < 0) | (steps > LONGEST_STEP_NS)
    steps = np.where(wrong, np.maximum(recorded, 0), steps)
    t_s = begin_s + np.concatenate(([0], np.cumsum(steps))) / NS
    return RobotTime(t_s, np.maximum.accumulate(log_ns), stamp_ns)
