"""The guard of what cannot stop: its safe controller steers wherever no command of its controller holds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from tests.fulmar_core.safety.guards import GOOD, MS, NAMES, THRUSTERS

SAFE = [0.0] * 8
OTHER = [0.0, 1.0, *[0.0] * 6]
STEERED = [1.0, *[0.0] * 7]


class Glide:
    longest_s = math.inf
    doing = "glides"

    def __init__(self) -> None:
        self.asked: list[float] = []

    def command(self, since_s, last, state):
        self.asked.append(since_s)
        return np.array(STEERED)


@pytest.fixture
def glide() -> Glide:
    return Glide()


@pytest.fixture(params=[False, True], ids=["by the clock", "in lock step"])
def guard(request, glide) -> ActuatorGuard:
    return ActuatorGuard(THRUSTERS, Watchdog(200 * MS), lockstep=request.param, refuge=glide)


def applied(guard: ActuatorGuard, now: int) -> list[float]:
    """In lock step as after an answer, else as at a tick."""
    ask = guard.answer if guard._lockstep else guard.output
    return ask(now, object(), plant_ns=now).tolist()


def test_a_controller_that_commands_what_is_safe_hands_over_to_the_safe_controller(guard):
    guard.offer(NAMES, GOOD, 0)
    assert applied(guard, 0) == GOOD
    guard.offer(NAMES, SAFE, 10 * MS)
    assert applied(guard, 10 * MS) == STEERED
    assert guard.doing == "glides"


def test_a_command_takes_it_back_at_once(guard):
    guard.offer(NAMES, SAFE, 0)
    assert applied(guard, 0) == STEERED
    guard.offer(NAMES, GOOD, 10 * MS)
    assert applied(guard, 10 * MS) == GOOD
    assert guard.doing == ""


def test_the_safe_controller_begins_anew_each_time_and_goes_by_the_time_of_the_plant(guard, glide):
    for begins in (0, 5000 * MS):
        guard.offer(NAMES, GOOD, begins)
        assert applied(guard, begins) == GOOD
        guard.offer(NAMES, SAFE, begins + 10 * MS)
        for later in (10, 20, 50):
            applied(guard, begins + later * MS)
    assert glide.asked == pytest.approx([0.0, 0.01, 0.04] * 2)


def test_silence_hands_over_to_it_by_the_clock(glide):
    guard = ActuatorGuard(THRUSTERS, Watchdog(200 * MS), refuge=glide)
    guard.offer(NAMES, GOOD, 0)
    assert guard.output(50 * MS, object(), plant_ns=50 * MS).tolist() == GOOD
    assert guard.output(60 * MS, object(), plant_ns=60 * MS).tolist() == STEERED


def test_it_bridges_a_silence_that_is_no_trip_yet_and_gives_back_with_the_next_command(glide):
    guard = ActuatorGuard(THRUSTERS, Watchdog(200 * MS), refuge=glide)
    guard.offer(NAMES, GOOD, 0)
    assert guard.output(60 * MS, object(), plant_ns=60 * MS).tolist() == STEERED
    assert guard.watchdog.trips == 0
    guard.offer(NAMES, GOOD, 70 * MS)
    assert guard.output(70 * MS, object(), plant_ns=70 * MS).tolist() == GOOD


def test_a_slow_controller_is_not_bridged_between_its_own_commands(glide):
    guard = ActuatorGuard(THRUSTERS, Watchdog(200 * MS), refuge=glide, control_dt=0.04)
    guard.offer(NAMES, GOOD, 0)
    assert guard.output(100 * MS, object(), plant_ns=100 * MS).tolist() == GOOD
    assert guard.output(110 * MS, object(), plant_ns=110 * MS).tolist() == STEERED


def test_a_controller_whose_simulation_runs_slowly_is_not_bridged_between_its_own_commands(glide):
    guard = ActuatorGuard(THRUSTERS, Watchdog(2000 * MS), refuge=glide, control_dt=0.01, period_s=0.1)
    guard.offer(NAMES, GOOD, 0)
    assert guard.output(250 * MS, object(), plant_ns=25 * MS).tolist() == GOOD
    assert guard.output(260 * MS, object(), plant_ns=26 * MS).tolist() == STEERED


def test_the_e_stop_hands_over_and_the_newest_command_goes_on_after_it(guard):
    guard.offer(NAMES, GOOD, 0)
    guard.estop.receive(True, 5 * MS)
    assert applied(guard, 10 * MS) == STEERED
    guard.offer(NAMES, OTHER, 20 * MS)
    assert applied(guard, 20 * MS) == STEERED
    guard.estop.release(30 * MS)
    assert applied(guard, 30 * MS) == OTHER


def test_two_publishers_of_commands_hand_over_until_one_is_gone(guard):
    guard.offer(NAMES, GOOD, 0)
    guard.publishers.see(["controller", "intruder"], 5 * MS)
    assert applied(guard, 10 * MS) == STEERED
    guard.offer(NAMES, OTHER, 1000 * MS)
    assert applied(guard, 1000 * MS) == STEERED
    assert applied(guard, 1010 * MS) == OTHER


def test_what_can_stop_does_as_its_controller_says():
    guard = ActuatorGuard(THRUSTERS, Watchdog(200 * MS))
    guard.offer(NAMES, SAFE, 0)
    assert guard.output(0, object(), plant_ns=0).tolist() == SAFE
    assert guard.doing == ""


def test_a_plant_that_is_about_to_end_takes_no_command_and_counts_no_silence(guard):
    """The last of its robot's flight belongs to the safe controller, whoever still commands."""
    guard.offer(NAMES, GOOD, 0)
    guard.hand_over(10 * MS)
    for now in range(10, 2000, 10):
        if now < 1000:
            guard.offer(NAMES, OTHER, now * MS)
        assert applied(guard, now * MS) == STEERED
    assert guard.doing == "glides"
    assert guard.watchdog.trips == 0
    guard.reset()
    assert not guard.handed_over
    guard.offer(NAMES, GOOD, 3000 * MS)
    assert applied(guard, 3000 * MS) == GOOD


def test_a_failed_surface_hands_over_until_the_next_reset(guard):
    guard.offer(NAMES, GOOD, 0)
    guard.fail("elevator is stuck", 5 * MS)
    guard.offer(NAMES, GOOD, 10 * MS)
    assert applied(guard, 10 * MS) == STEERED
    guard.fail("rudder is stuck", 15 * MS)
    assert guard.failed == "elevator is stuck"
    guard.reset()
    guard.offer(NAMES, GOOD, 20 * MS)
    assert applied(guard, 20 * MS) == GOOD


def test_the_safe_controller_knows_what_stands_until_the_next_reset(guard, glide):
    guard.fail("rudder is stuck", 5 * MS, ("rudder", 0.13))
    applied(guard, 10 * MS)
    assert glide.stuck == ("rudder", 0.13)
    guard.reset()
    guard.offer(NAMES, SAFE, 20 * MS)
    applied(guard, 20 * MS)
    assert glide.stuck is None
