"""What the actuators did between two measurements, and what a bank of filters makes of it."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health.applied import Applied, AppliedHistory
from fulmar_core.estimators.actuator_health.thruster_health import ThrusterHealth
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import PlanarState

MS = 1_000_000
ROBOT = load_robot("floating_platform")
CLOSED, FIRST, SECOND = np.zeros(8), np.eye(8)[0], np.eye(8)[1]


@pytest.fixture
def history():
    history = AppliedHistory(hold_ns=50 * MS)
    for tick, command in enumerate([CLOSED, CLOSED, FIRST, FIRST, FIRST, SECOND]):
        history.add(1000 * MS + 20 * tick * MS, command)
    return history


def test_an_interval_has_the_commands_of_its_time_and_how_long_each_held(history):
    applied = history.between(1030 * MS, 1110 * MS)
    np.testing.assert_array_equal(applied.commands, [CLOSED, FIRST, SECOND])
    np.testing.assert_allclose(applied.seconds, [0.01, 0.06, 0.01])
    assert applied.duration_s == pytest.approx(0.08)


@pytest.mark.parametrize(
    ("begin", "end"), [(990, 1050), (1090, 1160), (1050, 1050)], ids=["too early", "too late", "nothing"]
)
def test_of_an_interval_that_is_not_known_in_full_nothing_is_known(history, begin, end):
    assert history.between(begin * MS, end * MS) is None


def test_states_that_got_lost_on_the_way_leave_nothing_known():
    history = AppliedHistory(hold_ns=50 * MS)
    for stamp in (0, 20, 100, 120):
        history.add(stamp * MS, FIRST)
    assert history.between(20 * MS, 120 * MS) is None
    assert history.between(100 * MS, 140 * MS) is not None


def test_an_older_state_begins_anew_and_old_ones_are_forgotten(history):
    history.add(500 * MS, FIRST)
    assert history.newest_ns == 500 * MS
    assert history.between(1040 * MS, 1060 * MS) is None
    for stamp in range(500, 9000, 20):
        history.add(stamp * MS, FIRST)
    assert history.between(520 * MS, 540 * MS) is None


def glide(commands, *, rate_hz=50.0):
    """A body at rest under commands of one tick each, integrated as the simulators do; the state at the end."""
    dt = 1.0 / rate_hz
    speed, place = np.zeros(2), np.zeros(2)
    for command in commands:
        force = ROBOT.actuators.wrench_in_body(command)[0][:2]
        speed = speed + dt * force / ROBOT.body.mass
        place = place + dt * speed
    return place, speed


def state(place=(0.0, 0.0), speed=(0.0, 0.0)):
    return PlanarState(*(np.float64(value) for value in (*place, 0.0, *speed, 0.0)))


@pytest.mark.parametrize("opened", [range(0, 4), range(6, 10)], ids=["early", "late"])
def test_a_short_opening_moves_the_body_by_when_it_was(opened):
    # Two opposite nozzles side by side give force without torque.
    pair = np.eye(8)[0] + np.eye(8)[5]
    ticks = [pair if tick in opened else CLOSED for tick in range(10)]
    place, speed = glide(ticks)
    parts = [
        (command, count)
        for command, count in ((CLOSED, opened.start), (pair, 4), (CLOSED, 10 - opened.stop))
        if count
    ]
    applied = Applied(np.array([part[0] for part in parts]), 0.02 * np.array([part[1] for part in parts]))
    health = ThrusterHealth(ROBOT)
    health.see(state(), None, 0.2)
    believed = health.see(state(place, speed), applied, 0.2)
    np.testing.assert_allclose(believed.motion[:2], place, atol=1e-6)
    np.testing.assert_allclose(believed.motion[3:5], speed, atol=1e-6)
    np.testing.assert_allclose(believed.push, 0.0, atol=1e-4)


def test_where_it_is_not_known_what_was_applied_nothing_is_learned():
    health = ThrusterHealth(ROBOT)
    health.see(state(), None, 0.2)
    for _ in range(20):  # a body that does not move, whatever its valves may have done
        believed = health.see(state(), None, 0.2)
    assert believed.effectiveness.min() > 0.9
    assert not believed.push.any()
