"""Wires are matched to nozzles, wheels and propellers from noisy poses of a body that drifts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_bringup.commissioning.match import indistinct, left_over, match_nozzles, match_sides
from fulmar_bringup.commissioning.response import Pulse, Response, Track, responses
from fulmar_core.robots.robot_file import load_robot

PLATFORMS = {name: load_robot(name) for name in ("floating_platform", "floating_platform_roboran")}
LASTS_S, BETWEEN_S, STILL_S, RATE_HZ = 0.12, 0.72, 1.5, 50.0


def floated(robot, order, *, seed, dead=(), inverted=False, inertia=None, push=(0.0, 0.0), lead_s=0.0):
    """Poses of a free body whose valves are pulsed one after another, integrated here step by step."""
    rng, dt = np.random.default_rng(seed), 0.002
    count, wrench = len(order), robot.actuators.wrench_per_newton[:, [0, 1, 5]]
    inertia = inertia or robot.body.inertia[2]
    pulses = [Pulse(STILL_S + i * BETWEEN_S, STILL_S + i * BETWEEN_S + LASTS_S) for i in range(count)]
    state = np.array([*rng.normal(0, 1, 3), *rng.normal(0, 0.01, 3)])
    rows = []
    for tick in range(round((pulses[-1].end_s + 0.6) / dt)):
        now = tick * dt - lead_s
        lines = np.array([float(pulse.begin_s <= now < pulse.end_s) for pulse in pulses])
        lines = 1.0 - lines if inverted else lines
        lines[list(dead)] = 0.0
        valves = np.zeros(count)
        valves[list(order)] = lines
        ahead, left, torque = valves @ wrench / max(1.0, valves.sum())
        c, s = np.cos(state[2]), np.sin(state[2])
        force = np.array([c * ahead - s * left + push[0], s * ahead + c * left + push[1]])
        state[3:5] += dt * force / robot.body.mass
        state[5] += dt * torque / inertia
        state[:3] += dt * state[3:]
        if tick % round(1.0 / RATE_HZ / dt) == 0:
            rows.append([tick * dt, *(state[:3] + rng.normal(0, (0.001, 0.001, 0.002)))])
    time_s, x, y, heading = np.array(rows).T
    return Track(time_s, x, y, heading), pulses


def matched(robot, order, **how):
    track, pulses = floated(robot, order, **how)
    found = responses(track, pulses, "floating")
    return match_nozzles(robot, robot.actuators, found, [LASTS_S] * len(pulses), range(len(order)))


@pytest.mark.parametrize("name", PLATFORMS)
@pytest.mark.parametrize("seed", range(4))
def test_each_wire_gets_its_nozzle_in_whatever_order(name, seed):
    """Also where the yaw inertia is off by the span of the public models, on a slope, and with late poses."""
    robot, order = PLATFORMS[name], np.random.default_rng(seed).permutation(8).tolist()
    inertia = (0.064, 0.2045, 0.317, 0.142)[seed]
    match = matched(robot, order, seed=seed, inertia=inertia, push=(0.04, -0.02), lead_s=0.05 * seed)
    assert list(match.drives) == order
    assert match.dead == () and match.problems == ()
    assert match.strength == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("seed", range(3))
def test_a_cut_wire_is_named_and_its_nozzle_is_what_is_left(seed):
    robot, order = PLATFORMS["floating_platform"], np.random.default_rng(seed).permutation(8).tolist()
    match = matched(robot, order, seed=seed, dead=[seed])
    assert match.dead == (seed,)
    assert match.drives[seed] is None
    assert left_over(match, 8) == order[seed]


def test_two_cut_wires_leave_nothing_to_conclude():
    match = matched(PLATFORMS["floating_platform"], list(range(8)), seed=1, dead=[2, 5])
    assert match.dead == (2, 5)
    assert left_over(match, 8) is None


def test_valves_that_are_open_at_rest_are_reported_as_inverted():
    """Seven nozzles blow and one is taken away: a seventh of the motion, the other way round."""
    match = matched(PLATFORMS["floating_platform"], list(range(8)), seed=3, inverted=True)
    assert any("inverted" in problem for problem in match.problems)


def test_a_body_without_air_answers_on_no_wire():
    match = matched(PLATFORMS["floating_platform"], list(range(8)), seed=3, dead=range(8))
    assert match.dead == tuple(range(8))
    assert match.problems == ("no wire moves the robot",)


def test_a_nozzle_that_the_robot_file_does_not_have_is_reported():
    """The platform is turned by 45° against its file: every push lies between two of the file's nozzles."""
    match = matched(PLATFORMS["floating_platform"], list(range(8)), seed=0)
    assert not match.problems
    track, pulses = floated(PLATFORMS["floating_platform_roboran"], list(range(8)), seed=0)
    found = responses(track, pulses, "floating")
    robot = PLATFORMS["floating_platform"]
    match = match_nozzles(robot, robot.actuators, found, [LASTS_S] * 8, range(8))
    assert any("as none of its nozzles would" in problem for problem in match.problems)


def test_nozzles_of_one_force_and_torque_cannot_be_distinguished():
    robot = PLATFORMS["floating_platform"]
    assert indistinct(robot.actuators) == []
    nozzles = robot.actuators.nozzles
    twin = replace(nozzles[0], name="twin")
    assert indistinct(replace(robot.actuators, nozzles=(*nozzles, twin))) == [("thruster_1", "twin")]


@pytest.mark.parametrize(
    ("ahead", "turn", "side", "sign"),
    [(0.05, -0.1, 0, 1.0), (0.05, 0.1, 1, 1.0), (-0.05, 0.1, 0, -1.0), (-0.05, -0.1, 1, -1.0)],
)
def test_a_side_and_its_sign_follow_from_way_and_turn(ahead, turn, side, sign):
    one = Response(np.array([ahead, 0.0, turn]), np.full(3, 1e-3))
    other = Response(np.array([-ahead, 0.0, turn]), np.full(3, 1e-3))
    match = match_sides([one, other])
    assert (match.drives[0], match.signs[0]) == (side, sign)
    assert not match.problems and not match.dead
    assert match_sides([one, one]).problems == ("two channels drive the same side",)
    weak = replace(one, sigma=np.full(3, 0.05))
    assert match_sides([one, weak]).dead == (1,)


def test_a_base_that_still_settles_is_no_answer_of_a_dead_channel():
    """As a Kobuki with a dead left channel did it on a busy computer."""
    sigma = np.array([1e-4, 1e-4, 1e-4])
    settles, drives = (
        Response(np.array(change), sigma) for change in ((1.1e-3, 0.0, 8.7e-3), (0.028, 0.0, 0.24))
    )
    match = match_sides([settles, drives])
    assert (match.drives, match.dead) == ((None, 1), (0,))


@pytest.mark.parametrize("motion", ["rolling", "coasting"])
def test_a_step_of_wheels_and_of_a_boat_is_found_in_the_body_frame(motion):
    """Late by 0.1 s, at a heading of 90°; the boat drifts before, and its odometry knows velocities."""
    rng, time_s = np.random.default_rng(5), np.arange(0.0, 3.0, 0.05)
    pulse = Pulse(1.0, 1.4)
    ramp = np.clip((time_s - 1.1) / 0.4, 0.0, 1.0)
    done = ramp if motion == "rolling" else np.cumsum(ramp) * 0.05
    drift = 0.0 if motion == "rolling" else 0.03
    noise = rng.normal(0.0, 0.002, (3, len(time_s)))
    rates = np.stack((0.0 * ramp + drift, 0.2 * ramp, -0.1 * ramp), axis=1) + rng.normal(
        0, 0.005, (len(time_s), 3)
    )
    track = Track(
        time_s, drift * time_s + noise[0], 0.2 * done + noise[1], np.pi / 2 - 0.1 * done + noise[2], rates
    )
    (found,) = responses(track, [pulse], motion)
    assert found.change == pytest.approx([0.2, 0.0, -0.1], abs=0.03)
    assert found.clearly[0] > 10.0


def test_too_few_poses_are_refused():
    few = np.arange(5.0)
    with pytest.raises(ValueError, match="5 poses are too few"):
        responses(Track(few, few, few, few), [Pulse(1.0, 2.0)], "floating")
