"""The loop of a plant in real time, with a backend and a guard that note what they get."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.robots.actuators.refuge import DOWN
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.simulation.backend import Sample
from fulmar_core.wires.reading import Reading
from fulmar_ros.plant_clock import SimulatedTime, WallTime
from fulmar_ros.plant_loops import RealtimeLoop
from tests.fulmar_ros.quiet_wires import quiet_wires
from tests.states import planar_state

ROBOT, AIRCRAFT = load_robot("floating_platform"), load_robot("airship_v7")


@pytest.mark.parametrize("clock", [SimulatedTime(), WallTime()], ids=["simulated", "wall"])
def test_the_guard_receives_the_newest_measured_state_and_a_steady_time_for_safe_controllers_that_steer(
    clock,
):
    samples = [Sample({"odometry": Reading(planar_state(x, 0.0, 0.0))}, None) for x in (1.0, 2.0, 3.0)]
    received, asked_ns = [], []

    def output(now_ns, state, plant_ns):
        received.append(float(state.position_in_world[0]))
        asked_ns.append((now_ns, plant_ns))
        return ROBOT.actuators.safe_command

    def ignore(*_arguments):
        """There is no subscriber."""

    backend = SimpleNamespace(robot=ROBOT, step=lambda _command: samples[len(received)])
    wires = quiet_wires()
    loop = RealtimeLoop(
        backend,
        wires,
        SimpleNamespace(output=output, see_refusal=ignore, handed_over=False),
        clock,
        rate=50.0,
    )
    loop.run(samples[0], 2, threading.Event())
    assert np.allclose(received, [1.0, 2.0])
    first, second = (plant_ns for _, plant_ns in asked_ns)
    if isinstance(clock, WallTime):  # nothing that sets the clock of the machine reaches the safe controller
        assert all(0 <= plant_ns - now_ns < 1_000_000_000 for now_ns, plant_ns in asked_ns)
    else:
        assert second - first == round(1e9 * ROBOT.timing.physics_dt)


def test_a_refusal_of_the_device_reaches_the_guard_before_the_next_command():
    guard, applied = ActuatorGuard(ROBOT.actuators, Watchdog(10**9)), []
    samples = iter(
        [Sample({}, None, refusal="the autopilot is in mode 4 (HOLD)"), Sample({}, None), Sample({}, None)]
    )

    def step(command):
        applied.append(command)
        return next(samples)

    backend = SimpleNamespace(robot=ROBOT, step=step)
    wires = quiet_wires()
    guard.offer(ROBOT.actuators.names, np.ones(8), time.monotonic_ns())
    RealtimeLoop(backend, wires, guard, SimulatedTime(), rate=50.0).run(
        Sample({}, None), 3, threading.Event()
    )
    assert [bool(command.any()) for command in applied] == [True, False, False]
    assert guard.held == "the autopilot is in mode 4 (HOLD)"


def test_steps_that_a_world_did_without_the_robot_pass_on_its_clock_too():
    seen, clock = [], SimulatedTime()
    samples = iter([Sample({}, None, more_ticks=2), Sample({}, None)])
    backend = SimpleNamespace(robot=ROBOT, step=lambda _command: next(samples))
    guard = ActuatorGuard(ROBOT.actuators, Watchdog(10**9))
    feedback = SimpleNamespace(grounds=None, see=lambda _command, seconds, _sample: seen.append(seconds))
    loop = RealtimeLoop(backend, quiet_wires(), guard, clock, rate=50.0, feedback=feedback)
    begun_ns = clock.now_ns
    loop.run(Sample({}, None), 4, threading.Event())
    dt = ROBOT.timing.physics_dt
    np.testing.assert_allclose(seen, (3.0 * dt, dt))
    assert (loop.ticks, clock.now_ns - begun_ns) == (4, round(4e9 * dt))


def test_an_aircraft_is_brought_down_after_its_last_tick():
    doing = iter(["glides", "glides", "glides", DOWN])
    guard = SimpleNamespace(handed_over=False, doing="", see_refusal=_ignore, fail=_ignore)

    def hand_over(_now_ns):
        guard.handed_over = True

    def output(*_, **__):
        guard.doing = next(doing) if guard.handed_over else ""
        return AIRCRAFT.actuators.safe_command

    guard.hand_over, guard.output = hand_over, output
    backend = SimpleNamespace(robot=AIRCRAFT, step=lambda _command: Sample({}, None))
    wires = quiet_wires()
    loop = RealtimeLoop(backend, wires, guard, SimulatedTime(), rate=50.0)
    loop.run(Sample({}, None), 2, threading.Event(), lands=True)
    assert (loop.ticks, guard.doing) == (2 + 4, DOWN)


def _ignore(*_arguments):
    """There is no subscriber."""
