"""Reports of a device that measures its own position: refused where they cannot be true, else moved into `odom`."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import numpy as np

from fulmar_core.robots.robot import Limits
from hardware_drivers.believable_motion import unbelievable
from hardware_drivers.feedback import Feedback, Report


class PlacedReports:
    """Passes reports of one thread on; another says where `odom` begins.

    Attributes:
        refused: How many positions could not be true.
    """

    def __init__(
        self, feedback: Feedback, limits: Limits, *, turns_freely: bool = False, flies: bool = False
    ) -> None:
        """Put them into `feedback`.

        Args:
            feedback: Of the device.
            limits: Of the robot.
            turns_freely: As in `unbelievable`.
            flies: Whether heights stay those of the device, of which water and ground are a part; else the robot is
                on the plane of `odom`.
        """
        self._feedback, self._limits = feedback, limits
        self._turns_freely, self._flies = turns_freely, flies
        self._placing = threading.Lock()  # no report is moved by a shift that has just changed
        self._shift = np.zeros(3)  # from where the device's frame begins to where `odom` does [m]
        self._believed: tuple[Report, int] | None = None  # and when, by the steady clock [ns]
        self.refused = 0

    def take(self, report: Report) -> None:
        """Take a report with odometry in the device's frame."""
        steady_ns = time.monotonic_ns()
        assert report.odometry is not None
        with self._placing:
            last = self._believed
            before = None if last is None or last[0].odometry is None else (last[0].odometry, last[1])
            reason = unbelievable(
                report.odometry, steady_ns, before, self._limits, turns_freely=self._turns_freely
            )
            if reason:
                self.refused += 1
                self._feedback.refuse(reason)
                return
            self._believed = report, steady_ns
            self._feedback.put(self._moved(report))

    def begin(self, x: float, y: float) -> None:
        """Take a place in `odom` for where the device is now [m]; there must be a report."""
        with self._placing:
            assert self._believed is not None and self._believed[0].odometry is not None
            report, place = self._believed[0], self._believed[0].odometry.position_in_world
            self._shift = np.array([x, y, place[2] if self._flies else 0.0]) - place
            self._feedback.put(
                self._moved(report)
            )  # so that nobody reads a report of the old frame from here on

    def _moved(self, report: Report) -> Report:
        assert report.odometry is not None
        place = report.odometry.position_in_world + self._shift
        return replace(report, odometry=replace(report.odometry, position_in_world=place))
