"""Gas that a robot beside a thing in space keeps for stopping: how much that is, and that nothing else spends it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.loop.control_loop import ControlLoop, readings_for, unknown_inputs
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.fuel_reserve import SHARE, FuelReserve, gauges_of
from fulmar_core.safety.keep_out import LEAVES_M_S, OUT_OF_FUEL, KeepOutGuard
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.structures import load_structure
from tests.fulmar_core.safety.test_keep_out import Malicious, flown

ROBOT, VOLUME = load_robot("cubesat_8"), load_structure("gateway").keep_out
TANK = ROBOT.actuators.tank
BY_PRESSURE = replace(ROBOT, sensors=replace(ROBOT.sensors, fuel=None))


def moving(speed: float, rate: float = 0.0, far: float = 4.0) -> SpatialState:
    """A robot so far from the Gateway's volume [m] that flies along y and turns about z [m/s, rad/s]."""
    x, zero, one = np.array([VOLUME.radius + far]), np.zeros(1), np.ones(1)
    place = x, zero, zero
    return SpatialState(*place, zero, zero, zero, one, zero, speed * one, zero, zero, zero, rate * one)


def made() -> KeepOutGuard:
    return KeepOutGuard(ROBOT, [VOLUME], 0.1)


def reserve() -> FuelReserve:
    found = made().reserve
    assert found is not None
    return found


def inputs_of(state: SpatialState, step: int, mass: float | None, opened: float = 0.0):
    """Inputs of a step with a reading of the gauge [kg], or without one, after a command of all valves alike."""
    loop = ControlLoop(ROBOT, load_task("go_to_pose_3d", "gateway"), Malicious(ROBOT, spins=False))
    readings = {} if mass is None else {"fuel": np.array([[mass, mass / TANK.content]])}
    previous = np.full((1, 8), opened)
    unknown = unknown_inputs(loop, round(1e8 * step))
    return replace(unknown, state=state, readings=readings, previous=previous)


def test_what_stopping_takes_grows_with_momentum_and_spin_as_the_valves_spend() -> None:
    """Eight valves at 45° of which a force straight ahead opens four: √2 N for each newton at the least."""
    kept = reserve()
    rest, slow, fast, spun = (float(kept.needed(moving(*it))[0]) for it in ((0, 0), (1, 0), (2, 0), (0, 1)))
    assert fast - slow == pytest.approx(slow - rest)
    assert (slow - rest) * SHARE / ROBOT.body.mass > np.sqrt(2.0)
    spin = (spun - rest) * SHARE / ROBOT.body.inertia[2]
    assert spin > 1.0 / 0.1, "no valve has a lever of ten centimetres"
    assert 0.0 < rest < 0.05 * TANK.content * TANK.exhaust_speed


def test_gas_below_the_pressure_of_the_regulator_does_not_count_and_errors_of_the_gauge_neither() -> None:
    kept = reserve()
    kept.watch(inputs_of(moving(0.0), 1, TANK.content))
    usable = TANK.exhaust_speed * (TANK.content - TANK.left(TANK.regulated))
    unsure = usable - float(kept.left[0])
    assert 3.0 * 0.0033 * TANK.exhaust_speed < unsure < 0.03 * usable


def test_both_gauges_say_the_same() -> None:
    assert gauges_of(ROBOT) == ("fuel",)
    assert gauges_of(BY_PRESSURE) == ("supply",)
    other = KeepOutGuard(BY_PRESSURE, [VOLUME], 0.1).reserve
    assert other is not None
    inputs = inputs_of(moving(0.0), 1, None)
    other.watch(replace(inputs, readings={"supply": np.array([[0.5 * TANK.pressure]])}))
    kept = reserve()
    kept.watch(inputs_of(moving(0.0), 1, 0.5 * TANK.content))
    assert float(other.left[0]) == pytest.approx(float(kept.left[0]), rel=0.01)


def test_where_the_gauge_falls_silent_what_was_commanded_is_taken_for_spent() -> None:
    kept = reserve()
    kept.watch(inputs_of(moving(0.0), 1, TANK.content))
    before = float(kept.left[0])
    for step in (2, 3, 3):  # a step is counted once, however often guards ask
        kept.watch(inputs_of(moving(0.0), step, None, opened=0.5))
    assert before - float(kept.left[0]) == pytest.approx(2 * 0.1 * 8 * 0.5)


def test_before_the_gauge_has_said_anything_no_gas_is_kept() -> None:
    kept = reserve()
    assert not kept.watch(inputs_of(moving(2.0), 1, None, opened=1.0))[0]
    assert kept.left is None


def test_once_the_gas_left_is_what_stopping_takes_no_controller_pushes_until_a_new_goal() -> None:
    guard, pushes = made(), np.ones((1, 8))
    full, low = TANK.content, 0.1 * TANK.content
    assert guard.guarded(pushes, inputs_of(moving(1.0), 1, full)) is pushes
    stopping = guard.guarded(pushes, inputs_of(moving(1.0), 2, low))
    force, _ = ROBOT.actuators.wrench_in_body(stopping)
    assert force[0, 1] < -0.5 and np.abs(force[0, [0, 2]]).max() < 1e-3, "straight back, far from the thing"
    assert guard.words(moving(1.0), ["gateway"]) == OUT_OF_FUEL
    at_rest = guard.guarded(pushes, inputs_of(moving(0.5 * LEAVES_M_S), 3, full))
    assert not at_rest.any(), "its valves stay closed, whatever the gauge says"
    guard.reset()
    assert guard.guarded(pushes, inputs_of(moving(0.0), 4, low)) is pushes


def test_a_robot_that_drifts_in_is_sent_away_with_the_gas_that_was_kept() -> None:
    guard, pushes = made(), np.ones((1, 8))
    drifts = replace(moving(0.0, far=1.0), vx=np.array([-0.04]))
    force, _ = ROBOT.actuators.wrench_in_body(guard.guarded(pushes, inputs_of(drifts, 1, 0.03)))
    assert force[0, 0] > 0.5


@pytest.mark.slow
def test_an_adversary_spends_the_gas_but_not_what_stopping_takes() -> None:
    least = flown("cubesat_8", "gateway", spins=False, seconds=60.0, worlds=4, first_m=0.6, filled=0.12)
    assert (least > 0.0).all(), least


def test_a_robot_without_a_gauge_keeps_none_and_one_far_from_things_reads_none() -> None:
    robot, beside = load_robot("int_ball2"), load_task("go_to_pose_3d", "gateway")
    gaugeless = replace(BY_PRESSURE, sensors=replace(BY_PRESSURE.sensors, supply=None))
    for each in (robot, gaugeless):
        assert KeepOutGuard(each, [VOLUME], 0.1).reserve is None
    law = Malicious(ROBOT, spins=False)
    assert readings_for(robot, beside, [law]) == ()
    assert readings_for(ROBOT, beside, [law, law]) == ("fuel",)
    assert readings_for(ROBOT, load_task("go_to_pose_3d"), [law]) == ()
