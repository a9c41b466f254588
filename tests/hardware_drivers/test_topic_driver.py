"""Devices behind another stack's node: the last messages that it receives, and when."""

from __future__ import annotations

import time

import numpy as np
import pytest

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.robot_file import load_robot
from hardware_drivers.driver_backend import STOPS, DriverBackend, backend_of
from hardware_drivers.settings import LONGEST_LINGER_S, Bearing, ValveTopic
from hardware_drivers.topic_driver import LONELY_S, Listeners, TopicDriver, ValveTopicDriver

ROBOT = load_robot("floating_platform")
THERE = Listeners("/valves", lambda: 1)


class Listener:
    """Keeps what is sent, and when."""

    def __init__(self) -> None:
        self.received: list[tuple[float, np.ndarray, bool]] = []

    def __call__(self, command: np.ndarray, bearing: bool = True) -> None:
        self.received.append((time.monotonic(), command, bearing))


def floating(listener: Listener, *, bearing_on: bool, linger_s: float) -> DriverBackend:
    driver = ValveTopicDriver(
        listener, THERE, count=8, bearing_on=bearing_on, linger_s=linger_s, patience_s=0.0
    )
    return backend_of(ROBOT, driver)


def test_stops_come_one_by_one_and_the_last_has_time_to_arrive():
    """A publisher that keeps one message would send of a burst only the last, and of that one nothing if the process
    ends with it."""
    listener = Listener()
    driver = backend_of(ROBOT, TopicDriver(listener, THERE, patience_s=0.0))
    driver.step(np.ones(8))
    driver.make_safe()
    times = [at for at, _, _ in listener.received[1:]] + [time.monotonic()]
    assert len(times) == STOPS + 1
    assert min(np.diff(times)) >= 0.01
    assert not any(command.any() for _, command, _ in listener.received[1:])


def test_wheels_of_another_node_slow_down_first():
    listener, base = Listener(), load_robot("turtlebot2")
    driver = backend_of(base, TopicDriver(listener, THERE, patience_s=0.0))
    driver.step(np.array([0.3, -0.6]))
    driver.make_safe()
    sent = np.array([command for _, command, _ in listener.received])
    most = np.asarray(base.actuators.response.slew) * 0.02 + 1e-9
    assert (np.abs(np.diff(sent, axis=0)) <= most).all()
    assert not sent[-STOPS:].any()


def test_at_the_end_the_valves_close_first_and_the_platform_is_let_down_later():
    listener = Listener()
    driver = floating(listener, bearing_on=True, linger_s=0.3)
    driver.step(np.ones(8))
    driver.close()
    assert not driver.bearing_on
    carried, down = ([entry for entry in listener.received[1:] if entry[2] is on] for on in (True, False))
    assert not any(command.any() for _, command, _ in (*carried, *down))
    assert len(carried) == len(down) == STOPS
    assert down[0][0] - carried[-1][0] >= 0.3


def test_a_bearing_that_is_off_needs_no_time():
    listener = Listener()
    driver = floating(listener, bearing_on=False, linger_s=1.0)
    began = time.monotonic()
    driver.close()
    assert time.monotonic() - began < 0.5
    assert not any(on for _, _, on in listener.received)


@pytest.mark.parametrize("linger_s", [-0.1, LONGEST_LINGER_S + 0.1, float("nan")])
def test_a_lingering_that_a_launcher_would_not_wait_for_is_refused(linger_s):
    with pytest.raises(ValueError, match="linger_s"):
        Bearing("7", linger_s=linger_s)
    with pytest.raises(ValueError, match="linger_s"):
        ValveTopic("valve_topic", "/x", tuple(range(8)), linger_s=linger_s)


def test_a_topic_without_a_subscriber_is_a_device_that_is_not_there():
    with pytest.raises(DeviceError, match="no node subscribes to /valves"):
        TopicDriver(Listener(), Listeners("/valves", lambda: 0), patience_s=0.1)


def test_a_subscriber_that_has_gone_is_a_refusal_and_one_that_returns_soon_is_none():
    there = [1]
    driver = TopicDriver(Listener(), Listeners("/valves", lambda: there[0]), patience_s=0.0)
    there[0] = 0
    assert driver.refusal() == ""
    time.sleep(LONELY_S + 0.05)
    assert driver.refusal() == "no node subscribes to /valves any more: nobody carries out commands"
    there[0] = 1
    assert driver.refusal() == ""
