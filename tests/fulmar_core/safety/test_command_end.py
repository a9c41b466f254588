"""Why commands end, for a device that goes on by itself."""

from __future__ import annotations

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.command_end import CommandEnd
from fulmar_core.safety.watchdog import Watchdog

MS = 1_000_000
ROBOT = load_robot("floating_platform")
OPEN = [1.0] + [0.0] * 7


def guard_of() -> ActuatorGuard:
    return ActuatorGuard(ROBOT.actuators, Watchdog(200 * MS))


def command(guard: ActuatorGuard, now_ns: int) -> None:
    assert guard.offer(ROBOT.actuators.names, OPEN, now_ns, stamp_ns=now_ns)


def test_before_the_first_command_it_is_waited_for_and_then_obeyed():
    guard = guard_of()
    assert guard.end(10 * MS) is CommandEnd.WAITING
    command(guard, 20 * MS)
    assert guard.end(30 * MS) is CommandEnd.NONE


def test_a_silence_longer_than_the_watchdog_is_one():
    guard = guard_of()
    command(guard, 0)
    assert guard.end(150 * MS) is CommandEnd.NONE
    assert guard.end(250 * MS) is CommandEnd.SILENT
    command(guard, 260 * MS)
    assert guard.end(270 * MS) is CommandEnd.NONE


def test_a_device_that_refuses_stops_it_until_a_person_gives_back_and_a_command_is_waited_for():
    guard = guard_of()
    command(guard, 0)
    guard.see_refusal("it is in other hands")
    assert guard.end(10 * MS) is CommandEnd.STOPPED
    assert guard.end(900 * MS) is CommandEnd.STOPPED
    guard.see_refusal("")
    assert guard.give_back(910 * MS) == ""
    assert guard.end(920 * MS) is CommandEnd.WAITING
