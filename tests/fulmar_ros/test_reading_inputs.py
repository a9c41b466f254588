"""A controller's node subscribes the readings that it names, and refuses in words what no device can report."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from geometry_msgs.msg import InertiaStamped
from sensor_msgs.msg import JointState

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.wires.robot_name import PLAIN
from fulmar_ros import reading_inputs
from fulmar_ros.convert import stamp_of
from fulmar_ros.reading_inputs import ReadingInputs

CUBESAT = load_robot("cubesat_wheels")
SECOND = 1_000_000_000


class Wired:
    """Inputs of a node whose messages a test sends itself."""

    def __init__(self, names, lockstep=False, robot=CUBESAT):
        self.callbacks, self.woken = {}, []
        node = SimpleNamespace(create_subscription=self._subscribe)
        self.inputs = ReadingInputs(
            node, robot, names, lambda: self.woken.append(True), frames=PLAIN, lockstep=lockstep
        )

    def _subscribe(self, _kind, topic, callback, _qos):
        self.callbacks[topic] = callback

    def send(self, topic, message):
        self.callbacks[topic](message)

    def at(self, time_ns=SECOND):
        return self.inputs.newest.at(time_ns)


@pytest.fixture
def wired(monkeypatch):
    def make(*names, **more):
        made = Wired((), **more)
        monkeypatch.setattr(
            reading_inputs,
            "subscribe_every",
            lambda _node, _kind, wire, callback: made.callbacks.update({wire.name: callback}) or [],
        )
        made.__init__(names, **more)
        return made

    return make


def speeds(value, at_ns=SECOND):
    message = JointState(name=list(CUBESAT.actuators.wheel_names), velocity=[value, 0.0, 0.0])
    message.header.stamp = stamp_of(at_ns)
    return message


def inertia(factor):
    message = InertiaStamped()
    message.header.stamp = stamp_of(SECOND)
    its, known = message.inertia, factor * np.diag(CUBESAT.body.inertia_matrix)
    its.ixx, its.iyy, its.izz = known.tolist()
    return message


@pytest.mark.parametrize(
    ("names", "topics"),
    [
        ((), set()),
        (("wheels",), {"wheels/state"}),
        (("wheels", "inertia"), {"wheels/state", "inertia"}),
        (("wheels", "wheels"), {"wheels/state"}),
        (("air_data",), set()),  # a satellite has no air probes
        (("imu", "rate"), {"imu/data", "rate"}),
    ],
)
def test_exactly_what_a_controller_names_is_subscribed(wired, names, topics):
    made = wired(*names)
    assert set(made.callbacks) == topics
    assert set(made.inputs.followed) == topics


@pytest.mark.parametrize("value", [4294967295.0, float("nan"), -600.0])
def test_a_wheel_speed_that_no_wheel_has_is_refused_and_the_one_before_stays(wired, value):
    made = wired("wheels")
    made.send("wheels/state", speeds(100.0))
    made.send("wheels/state", speeds(value))
    np.testing.assert_array_equal(made.at()["wheels"], [[100.0, 0.0, 0.0]])
    assert made.inputs.newest.refused == 1
    assert made.inputs.newest.refusal.startswith("wheel wheel_x reports")
    made.send("wheels/state", speeds(101.0))
    assert made.inputs.newest.refusal == ""
    assert len(made.woken) == 2


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (1e6, "differs from that of the robot's file by a factor of over 5"),
        (-1.0, "that of no body"),
        (float("inf"), "that of no body"),
    ],
)
def test_an_inertia_that_the_robot_cannot_have_is_refused(wired, factor, said):
    made = wired("inertia")
    made.send("inertia", inertia(1.1))
    made.send("inertia", inertia(factor))
    np.testing.assert_allclose(made.at()["inertia"], 1.1 * CUBESAT.body.inertia_matrix)
    assert said in made.inputs.newest.refusal


def test_an_old_reading_is_not_there(wired):
    made = wired("wheels", "inertia")
    made.send("wheels/state", speeds(100.0))
    made.send("inertia", inertia(1.1))
    assert set(made.at(2 * SECOND)) == {"wheels", "inertia"}
    assert set(made.at(2 * SECOND + 1)) == {"inertia"}
    assert set(made.at(11 * SECOND + 1)) == set()


def test_a_step_of_lock_step_waits_for_what_is_measured_at_each_step(wired):
    made = wired("wheels", "inertia", lockstep=True)
    assert made.inputs.lacks_something_of(SECOND)
    made.send("wheels/state", speeds(100.0))
    assert not made.inputs.lacks_something_of(SECOND)
    assert made.inputs.lacks_something_of(SECOND + 1)
    assert not wired("inertia", lockstep=True).inputs.lacks_something_of(SECOND)
    assert not wired("wheels").inputs.lacks_something_of(SECOND)


def test_a_first_step_of_lock_step_waits_for_a_silent_sensor_and_not_for_ever(wired):
    made = wired("wheels", "inertia", lockstep=True)
    assert made.inputs.lacks_the_first(again=False)
    assert [made.inputs.lacks_the_first(again=True) for _ in range(4)] == [True, True, False, False]
    spoken = wired("wheels", lockstep=True)
    spoken.send("wheels/state", speeds(100.0))
    assert not spoken.inputs.lacks_the_first(again=False)
    assert not wired("wheels").inputs.lacks_the_first(again=False)


def test_a_message_that_cannot_be_read_is_refused_and_breaks_nothing(wired):
    made = wired("wheels")
    made.send("wheels/state", JointState(name=["wheel_x"], velocity=[]))
    assert made.inputs.newest.refusal
    assert made.at() == {}


@pytest.mark.parametrize("error", [ValueError, TypeError, KeyError, ZeroDivisionError])
def test_a_reading_whose_reader_stumbles_is_refused_with_the_error(wired, monkeypatch, error):
    def stumble(_message, _frames):
        raise error("of no length")

    monkeypatch.setattr(reading_inputs, "reader_of", lambda _kind: stumble)
    made = wired("wheels")
    made.send("wheels/state", speeds(100.0))
    assert made.inputs.newest.refusal.startswith(f"wheels cannot be read: {error.__name__}: ")
    assert (made.at(), made.inputs.newest.refused) == ({}, 1)


@pytest.mark.parametrize("lockstep", [False, True])
def test_in_lock_step_a_best_effort_publisher_of_a_sensor_is_refused_and_so_reported(wired, lockstep):
    refused = wired("wheels", lockstep=lockstep).inputs.subscribed
    assert {wire.name: strict for wire, strict in refused.items()} == {"wheels/state": lockstep}
