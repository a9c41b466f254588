"""What is applied to actuators against what sensors answer, without a simulator."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health.feedback_check import JointCheck, MotionCheck
from fulmar_core.estimators.actuator_health.modelled_response import ModelledResponse
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.surfaces import SurfacePositions
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.wires.reading import Reading
from tests.states import planar_state

AIRSHIP, BASE, CUBESAT = load_robot("airship_v7"), load_robot("turtlebot2"), load_robot("cubesat_wheels")
DT = 0.01


def fly(positions_of, *, seconds=4.0, seed=0, names=AIRSHIP.actuators.names):
    """Findings with their times of surfaces that are commanded to wave, and stand where a function says."""
    check, model, rng = JointCheck(AIRSHIP), ModelledResponse(AIRSHIP), np.random.default_rng(seed)
    scale, found = AIRSHIP.actuators.scale, {}
    for step in range(round(seconds / DT)):
        time_s = step * DT
        command = scale * (0.3 + 0.25 * np.sin(4.0 * time_s + np.arange(len(scale))))
        sound = model.follow(command, DT)[-1]
        measured = positions_of(time_s, sound.copy()) + 0.0017 * rng.standard_normal(len(scale))
        check.see(command, DT, {"surfaces": Reading(SurfacePositions(names, measured))})
        for finding in check.findings:
            found.setdefault(finding.words, time_s)
    return found


def stuck_at(number, value, from_s=1.0):
    def positions(time_s, sound):
        sound[number] = value if time_s >= from_s else sound[number]
        return sound

    return positions


def test_surfaces_that_follow_are_not_accused():
    assert fly(lambda _, sound: sound) == {}


def test_surfaces_that_give_less_or_come_late_are_not_accused():
    past = []

    def late(_, sound):
        past.append(sound)
        return 0.9 * past[max(0, len(past) - 8)]

    assert fly(late) == {}


@pytest.mark.parametrize("number", range(3))
def test_a_surface_that_is_stuck_is_named_with_its_place_within_a_second(number):
    name, half = AIRSHIP.actuators.names[number], -0.5 * AIRSHIP.actuators.scale[number]
    ((words, time_s),) = fly(stuck_at(number, half)).items()
    assert words.startswith(f"{name} is stuck at ")
    assert float(words.split()[4]) == pytest.approx(half, abs=0.01)
    assert time_s < 2.0


def test_a_motor_that_gives_nothing_is_dead():
    number = AIRSHIP.actuators.positions
    (words,) = fly(stuck_at(number, 0.0))
    assert words == f"{AIRSHIP.actuators.names[number]} does not follow its command: it is dead"


def test_a_surface_that_follows_again_is_accused_no_more():
    check, command = JointCheck(AIRSHIP), 0.4 * AIRSHIP.actuators.scale
    names = AIRSHIP.actuators.names
    for seconds, positions, accused in ((1.0, 0.0 * command, True), (4.0, command, False)):
        for _ in range(round(seconds / DT)):
            check.see(command, DT, {"surfaces": Reading(SurfacePositions(names, positions))})
        assert bool(check.findings) is accused


def spin(dead, *, seconds=6.0, seed=0, torque=1e-3):
    """Names of wheels found whose motors turn but for one of them, from 2 s on."""
    check, rng = JointCheck(CUBESAT), np.random.default_rng(seed)
    wheels, speeds = CUBESAT.actuators, np.zeros(3)
    for step in range(round(seconds / 0.1)):
        command = np.zeros(len(wheels.names))
        command[:3] = torque * np.sin(0.8 * 0.1 * step + np.arange(3))
        works = np.array([name != dead or step < 20 for name in wheels.wheel_names])
        speeds = speeds + 0.1 * (command[:3] * works + wheels.friction_torque(speeds)) / wheels.spin_inertia
        measured = speeds + 0.01 * rng.standard_normal(3)
        check.see(command, 0.1, {"wheels": Reading(WheelSpeeds(wheels.wheel_names, measured))})
    return [finding.part for finding in check.findings]


@pytest.mark.parametrize("dead", ["wheel_x", "wheel_y", "wheel_z"])
def test_a_reaction_wheel_whose_motor_is_dead_is_named(dead):
    assert spin(dead) == [dead]


def test_reaction_wheels_that_follow_are_not_accused():
    assert spin(None, seconds=20.0) == []


def drive(left, right, *, seconds=6.0, seed=0):
    """What is found of a base whose wheels give these shares of what they are commanded, from 2 s on."""
    check, rng, rims = MotionCheck(BASE), np.random.default_rng(seed), np.zeros(2)
    half, dt = 0.5 * BASE.actuators.track, 0.1
    yaw = 0.0
    for step in range(round(seconds / dt)):
        command = np.array([0.3, 0.6 * np.sin(step * dt)])
        shares = np.array([left, right]) if step >= 20 else np.ones(2)
        wanted = shares * (command[0] + np.array([-half, half]) * command[1])
        rims = wanted + np.exp(-dt / BASE.actuators.servo_s) * (rims - wanted)
        speed, rate = rims.mean(), (rims[1] - rims[0]) / (2.0 * half)
        yaw += dt * rate
        speed, rate = speed + 0.01 * rng.standard_normal(), rate + 0.01 * rng.standard_normal()
        motion = planar_state(0.0, 0.0, yaw, vx=speed * np.cos(yaw), vy=speed * np.sin(yaw), yaw_rate=rate)
        check.see(command, dt, motion)
    return check.findings


@pytest.mark.parametrize(("left", "right", "name"), [(0.0, 1.0, "left_wheel"), (1.0, 0.0, "right_wheel")])
def test_the_wheel_of_a_base_that_does_not_drive_is_named(left, right, name):
    assert [finding.part for finding in drive(left, right)] == [name]


@pytest.mark.parametrize("share", [1.0, 0.85, 1.15])
def test_wheels_that_roll_a_little_less_or_more_are_not_accused(share):
    assert drive(share, share) == ()


def test_no_wheel_is_blamed_for_a_base_that_is_held():
    (finding,) = drive(0.0, 0.0)
    assert finding.part == ""
    assert "held, blocked or without power" in finding.words
