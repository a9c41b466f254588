"""A wiring in the hardware file undoes a wiring of the robot, whatever it is; an emulated robot proves it."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from hardware_drivers.mavlink_driver import override_of
from hardware_drivers.settings import MavlinkBoat, Thrust
from hardware_drivers.wiring import channel_velocity, channels
from sim_nodes.emulators.outputs import BASE_TIMEOUT_S, TopicDevice, ValveNode
from sim_nodes.emulators.wiring import Wiring

BASE, BOAT, PLATFORM = (load_robot(name) for name in ("turtlebot2", "kingfisher", "floating_platform"))
WIRINGS = [
    (first + one, second + other)
    for one, other in (("left", "right"), ("right", "left"))
    for first, second in itertools.product(("", "-"), repeat=2)
]


def wired(robot, wiring=("left", "right"), dead=(), order=()):
    return Wiring(robot, order=order, sides=wiring, dead=dead)


@pytest.mark.parametrize("wiring", WIRINGS)
def test_a_base_and_a_boat_move_as_commanded_behind_any_wiring_that_the_file_names(wiring):
    sent = channel_velocity(wiring, BASE.actuators.track, 0.3, -0.5)
    assert wired(BASE, wiring).applied(np.array(sent)) == pytest.approx([0.3, -0.5])
    assert wired(BOAT, wiring).applied(np.array(channels(wiring, 0.8, -0.3))) == pytest.approx([0.8, -0.3])


def test_a_crossed_base_turns_the_other_way_and_a_cut_wheel_stands():
    assert wired(BASE, ("right", "left")).applied(np.array([0.3, 0.5])) == pytest.approx([0.3, -0.5])
    half = wired(BASE, dead=[0]).applied(np.array([0.2, 0.0]))
    assert half == pytest.approx([0.1, 0.2 / BASE.actuators.track])


def test_an_autopilot_s_mixer_is_sent_crossed_sides():
    boat = MavlinkBoat("mavlink_boat", "", Thrust(1.0, 1.0), wiring=("right", "-left"))
    straight = MavlinkBoat("mavlink_boat", "", Thrust(1.0, 1.0))
    assert override_of(boat, 0.2, 0.6) == override_of(straight, 0.6, -0.2)


def test_a_cut_valve_wire_stays_closed_and_the_others_open():
    order = [2, 0, 1, 3, 4, 5, 6, 7]
    applied = wired(PLATFORM, dead=[0], order=order).applied(np.ones(8))
    assert applied.tolist() == [1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0]


def test_a_valve_node_keeps_its_valves_for_ever_and_needs_air():
    node = ValveNode("/v", [1, 0, 2], inverted=False)
    node.receive([1, 1, 0, 0], 0.0)
    assert node.command(1e6).tolist() == [0.0, 1.0, 0.0]
    node.receive([1, 1, 0], 0.0)  # of another length
    assert node.command(1.0).tolist() == [0.0, 1.0, 0.0]
    node.receive([0, 1, 0, 0], 0.0)
    assert not node.command(0.0).any()
    inverted = ValveNode("/v", [1, 0, 2], inverted=True)
    inverted.receive([1, 1, 0, 0], 0.0)
    assert inverted.command(0.0).tolist() == [1.0, 0.0, 1.0]


def test_a_base_behind_a_topic_stops_by_its_own_timeout():
    base = TopicDevice("/v", 2, timeout_s=BASE_TIMEOUT_S)
    base.receive([0.3, 0.1], 5.0)
    assert base.command(5.5).tolist() == [0.3, 0.1]
    assert not base.command(5.7).any()
