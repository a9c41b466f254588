"""Readings that no device of a robot gives are refused in words before an estimator or a controller takes them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_bags.event_packets import FIELDS, POINT, events_of_cloud
from fulmar_core.dynamics.sky.events import events_of
from fulmar_core.estimators.kinds import make_estimator
from fulmar_core.estimators.readings import reading_problem
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.air_data import AirData
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.robots.sensors.surfaces import SurfacePositions
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.wires.reading import Reading

CUBESAT, AIRSHIP = load_robot("cubesat_wheels"), load_robot("airship_v7")
WHEELS, ACTUATORS = CUBESAT.actuators.wheel_names, AIRSHIP.actuators.names
TOP = CUBESAT.actuators.top_speed
SECOND = 1_000_000_000
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


def wheels(*speeds, names=WHEELS):
    return WheelSpeeds(tuple(names), np.array(speeds))


def surfaces(first):
    return SurfacePositions(ACTUATORS, np.array([first] + [0.0] * (len(ACTUATORS) - 1)))


def air(airspeed):
    return AirData(("airspeed", "alpha", "beta", "height"), np.array([airspeed, 0.0, 0.0, 3.0]))


def imu(force, rate):
    return ImuSample(np.full(3, force), np.full(3, rate))


@pytest.mark.parametrize(
    ("name", "value", "robot", "said"),
    [
        ("wheels", wheels(0.0, -TOP, TOP), CUBESAT, ""),
        ("wheels", wheels(4294967295.0, 0.0, 0.0), CUBESAT, "wheel wheel_x reports 4.29497e+09, and can report"),
        ("wheels", wheels(np.nan, 0.0, 0.0), CUBESAT, "wheel wheel_x reports a value that is not finite"),
        ("wheels", wheels(0.0, 0.0, names=WHEELS[:2]), CUBESAT, "wheel wheel_z is missing"),
        ("wheels", wheels(0.0, 0.0), CUBESAT, "3 names have 2 values"),
        ("wheels", wheels(0.0, 1.0, 2.0, 3.0, names=(*WHEELS, "wheel_x")), CUBESAT, "wheel_x comes more than once"),
        ("surfaces", surfaces(0.1), AIRSHIP, ""),
        ("surfaces", surfaces(57.3), AIRSHIP, "reports 57.3, and can report"),
        ("air_data", air(12.0), AIRSHIP, ""),
        ("air_data", air(65535.0), AIRSHIP, "probe airspeed reports 65535"),
        ("imu", imu(9.81, 0.1), CUBESAT, ""),
        ("imu", imu(1e5, 0.1), CUBESAT, "accelerometer reports 100000"),
        ("imu", imu(9.81, 4e4), CUBESAT, "gyroscope reports 40000"),
        ("star_tracker", LEVEL, CUBESAT, ""),
        ("star_tracker", np.zeros(4), CUBESAT, "gives no attitude"),
        ("star_tracker", 2.0 * LEVEL, CUBESAT, "norm 2, must be 1"),
        ("mocap", np.concatenate((np.zeros(3), LEVEL)), AIRSHIP, ""),
        ("mocap", np.concatenate((np.full(3, 1e300), LEVEL)), AIRSHIP, "place of the pose reports 1e+300"),
        ("mocap", np.zeros(7), AIRSHIP, "gives no attitude"),
        ("rate", np.zeros(3), CUBESAT, ""),
        ("rate", np.full(3, 9.0), CUBESAT, "turn rate reports 9"),
    ],
)  # fmt: skip
def test_a_reading_beyond_what_its_device_can_say_is_refused(name, value, robot, said):
    problem = reading_problem(name, Reading(value, SECOND), robot)
    assert said in problem
    assert bool(problem) is bool(said)


def packet(p, *, begin_ns=SECOND, x=5):
    count = len(p)
    t = np.linspace(begin_ns, begin_ns + 40_000_000, count).astype(np.uint64)
    return events_of(np.full(count, x), np.zeros(count), t, np.array(p), 0, 0)


@pytest.mark.parametrize(
    ("events", "said"),
    [
        (packet([0, 1, 1]), None),
        (packet([0, 1, 255]), "polarities up to 255, must be 1 for brighter, 0 or -1 for darker"),
        (packet([0, 1, 1], x=2000), "are of a camera of another size than 1024 × 1024 pixels"),
        (packet([0, 1, 1], begin_ns=0), None),
        (packet([0, 1, 1], begin_ns=100 * SECOND), "of another clock"),
    ],
)
def test_a_packet_of_events_that_its_camera_cannot_send_is_refused(events, said):
    estimator = make_estimator("event_rate", CUBESAT)
    problem = estimator.take("events", Reading(events, SECOND + 50_000_000))
    assert said is problem if said is None else said in problem


def test_events_of_another_clock_than_their_stamps_cost_no_time():
    """Windows of 0.2 s from the start of the epoch to a wall clock's time would be counted for years."""
    estimator = make_estimator("event_rate", CUBESAT)
    assert "another clock" in estimator.take("events", Reading(packet([0, 1]), 1_700_000_000 * SECOND))


def test_cameras_of_two_clocks_are_not_fused_until_one_of_them_falls_silent():
    estimator = make_estimator("event_rate", CUBESAT)

    def take(name, begin_ns):
        return estimator.take(name, Reading(packet([0, 1], begin_ns=begin_ns), begin_ns + 50_000_000))

    later = 3600 * SECOND
    for k in range(20):
        begin_ns = SECOND + k * 50_000_000
        assert take("events", begin_ns) is None
        assert "their clocks differ" in take("events_2", later + begin_ns)
    said = [take("events_2", later + 3 * SECOND + k * 50_000_000) for k in range(150)]
    assert said[-1] is None


def test_a_message_of_events_says_darker_by_0_or_by_minus_1():
    points = np.zeros(3, dtype=POINT)
    points["p"] = np.array([0, 1, -1]).astype(np.uint8)
    fields = [SimpleNamespace(name=n, offset=o, datatype=d, count=c) for n, o, d, c in FIELDS]
    message = SimpleNamespace(
        fields=fields, width=3, height=1, point_step=POINT.itemsize, is_bigendian=False, data=points.tobytes()
    )
    events, problem = events_of_cloud(message)
    assert not problem
    assert events.p.tolist() == [0, 1, 0]
