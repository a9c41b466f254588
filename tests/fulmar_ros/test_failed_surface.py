"""A plant of an aircraft with a surface that has failed: the loop hands it over to the safe controller."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health.feedback_check import ActuatorFeedback
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.surfaces import SurfacePositions
from fulmar_core.simulation.backend import Sample
from fulmar_core.wires.reading import Reading
from fulmar_ros.plant_clock import SimulatedTime
from fulmar_ros.plant_loops import RealtimeLoop
from tests.fulmar_ros.quiet_wires import quiet_wires

ROBOT = load_robot("airship_v7")


def grounded_by(positions: np.ndarray) -> tuple[list[tuple], ActuatorFeedback]:
    """Why the guard had to hand over and for what, while a constant command is applied and this is measured."""
    reading = Reading(SurfacePositions(ROBOT.actuators.names, positions))
    sample, reasons = Sample({"surfaces": reading}, None), []

    def ignore(*_arguments):
        """There is no subscriber."""

    command = 0.5 * ROBOT.actuators.scale
    guard = SimpleNamespace(
        output=lambda *_, **__: command,
        fail=lambda words, _now_ns, stuck: reasons.append((words, stuck)),
        see_refusal=ignore,
        handed_over=False,
    )
    wires = quiet_wires()
    backend = SimpleNamespace(robot=ROBOT, step=lambda _command: sample)
    feedback = ActuatorFeedback(ROBOT, moves=True)
    RealtimeLoop(backend, wires, guard, SimulatedTime(), rate=50.0, feedback=feedback).run(
        sample, 100, threading.Event()
    )
    return reasons, feedback


def test_a_stuck_surface_grounds_an_aircraft():
    positions = 0.5 * ROBOT.actuators.scale
    positions[0] = -positions[0]
    reasons, feedback = grounded_by(positions)
    words, stuck = reasons[0]
    assert words.startswith("elevator is stuck at -0.17 rad")
    assert stuck == ("elevator", pytest.approx(positions[0]))
    assert [finding.part for finding in feedback.findings] == ["elevator"]


def test_a_lost_propeller_is_named_and_leaves_the_controller_its_craft():
    positions = 0.5 * ROBOT.actuators.scale
    positions[-1] = 0.0
    reasons, feedback = grounded_by(positions)
    assert reasons == []
    assert [finding.part for finding in feedback.findings] == [ROBOT.actuators.names[-1]]


def test_surfaces_that_follow_ground_nobody():
    reasons, feedback = grounded_by(0.5 * ROBOT.actuators.scale)
    assert (reasons, feedback.findings) == ([], ())
