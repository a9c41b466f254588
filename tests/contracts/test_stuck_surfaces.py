"""An aircraft with a surface at half travel is landed where level flight is left to it: beside a rudder."""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.flight_refuge import DESCENDS, LevelDescent
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_trim import find_trim, still_air
from fulmar_core.dynamics.rigid_body import inertia_of
from fulmar_core.estimators.actuator_health.feedback_check import ActuatorFeedback
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.attitude import euler_of, from_euler
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64, stack_goals
from fulmar_core.worlds.parts import Actuation, Stuck
from fulmar_core.worlds.scenario import load_scenario
from policy_server.controllers import Choice, load_controller, usual_hz
from sim_nodes.mock_backend import MockBackend

ROBOT = load_robot("airship_v7")
SPEED = ROBOT.airframe.speed
TASK = load_task("fly_hold").fitted(ROBOT)
HALF = 0.5 * ROBOT.actuators.scale
DT = ROBOT.timing.physics_dt


def sticks(name: str, share: float, from_s: float):
    scenario = load_scenario("surface_stuck")
    return replace(scenario, actuation=Actuation(stuck=Stuck((name,), share, (from_s, from_s))))


@pytest.fixture(scope="module")
def solved():
    """With its gains."""
    return LevelDescent(ROBOT, 1.0 / DT)


@pytest.fixture
def refuge(solved):
    return copy.deepcopy(solved)


def deep_in_a_turn(height: float) -> SpatialState:
    """Level wings that sink and turn away from their path, as a policy leaves them 0.4 s after a rudder stuck."""
    level = find_trim(ROBOT, SPEED, height).state
    quat = from_euler(*np.radians([-4.0, 0.0, 3.0]))
    turned = dict(zip(("qx", "qy", "qz", "qw"), quat, strict=True))
    return replace(
        level, z=np.asarray(height), vz=np.asarray(-1.2), wz=np.asarray(math.radians(15.0)), **turned
    )


@pytest.mark.parametrize("share", [0.5, pytest.param(-0.5, marks=pytest.mark.slow)])
def test_a_craft_that_turns_away_is_caught_beside_its_rudder(refuge, share):
    start = deep_in_a_turn(10.0)
    if share < 0.0:
        mirrored = {name: -getattr(start, name) for name in ("qx", "qz", "wz")}
        start = replace(start, **mirrored)
    episode = replace(draw_episode(ROBOT, TASK, sticks("rudder", share, 0.0), seed=3, number=0), start=start)
    backend = MockBackend(ROBOT, things=TASK.things)
    sample = backend.reset(episode, seed=3)
    refuge.stuck = ("rudder", share * 2.0 * HALF[2])
    last = find_trim(ROBOT, SPEED, 10.0).command
    banks = []
    for step in range(350):
        sample = backend.step(refuge.command(step * DT, last, sample.odometry))
        now = SpatialState.from_rigid(sample.truth)
        banks.append(math.degrees(float(euler_of(now.quat)[0])))
    assert np.abs(banks).max() <= 10.0
    assert refuge.doing == DESCENDS
    assert abs(float(now.wz)) <= math.radians(5.0)
    assert float(now.vz) >= -1.0


def landed(refuge, share: float, controller: str, seed: int, from_s: float):
    """Largest bank [deg] from the fault to touch-down, sink then [m/s], and the height of the hull in the end [m]."""
    episode = draw_episode(ROBOT, TASK, sticks("rudder", share, from_s), seed=seed, number=0)
    episode = replace(episode, start=replace(find_trim(ROBOT, SPEED, 15.0).state, z=np.asarray(15.0)))
    hz = usual_hz(controller, ROBOT, TASK, None)
    loop = ControlLoop(ROBOT, TASK, load_controller(controller, ROBOT, TASK, Choice(hz, "")))
    backend, feedback = MockBackend(ROBOT, things=TASK.things), ActuatorFeedback(ROBOT, moves=True)
    guard = ActuatorGuard(ROBOT.actuators, Watchdog(10**12), control_dt=1.0 / hz, refuge=refuge)
    sample = backend.reset(episode, seed=seed)
    loop.begin(stack_goals([goal_in_float64(episode.goal)]))
    bank = sink = low = 0.0
    for tick in range(round(60.0 / DT)):
        now_ns = round(1e9 * tick * DT)
        if tick % round(1.0 / (hz * DT)) == 0 and not guard.handed_over:
            measured = TASK.state_type.from_rigid(sample.measured)[None]
            command = loop.step(measured, {}, now_ns).command[0]
            guard.offer(ROBOT.actuators.names, command.tolist(), now_ns, stamp_ns=now_ns)
        command = guard.output(now_ns, sample.odometry, plant_ns=now_ns)
        sample = backend.step(command)
        feedback.see(command, DT, sample)
        failed = feedback.grounds
        if failed is not None:
            guard.fail(failed.words, now_ns, (failed.part, failed.value))
        state = SpatialState.from_rigid(sample.truth)
        low = float(state.z) + ROBOT.hull_span[0]
        if low <= 0.02 or float(state.vx) < 1.0:
            break
        if tick * DT >= from_s:
            bank = max(bank, abs(math.degrees(float(euler_of(state.quat)[0]))))
        sink = -float(state.vz)
    return bank, sink, low


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("share", [0.5, -0.5])
@pytest.mark.parametrize("controller", ["policy", "lqi"])
def test_a_craft_whose_rudder_stands_at_half_travel_lands_softly(refuge, controller, share, seed):
    bank, sink, low = landed(refuge, share, controller, seed, 3.0 + 0.7 * seed)
    assert low <= 0.05
    assert bank <= 10.0
    assert sink <= 1.0


def turned_by(number: int, attack_deg: float, slip_deg: float, command: np.ndarray) -> float:
    """Acceleration about the axis that a surface turns the craft about [rad/s²]."""
    dynamics, world = FlightDynamics(ROBOT, turbulent=False), still_air(ROBOT, 1)
    attack, slip = math.radians(attack_deg), math.radians(slip_deg)
    zero, one = np.zeros(1), np.ones(1)
    inside = math.cos(attack) * math.cos(slip), -math.sin(slip), -math.sin(attack) * math.cos(slip)
    state = SpatialState(
        zero, zero, zero + 15.0, zero, zero, zero, one, *(SPEED * part * one for part in inside), *[zero] * 3
    )
    inertia = inertia_of(tuple(world.inertia))
    torque = dynamics.wrench(state, command[:, None], None, world, inertia)[1]
    axis = {0: 1, 1: 0}[number]
    return float(torque[axis][0]) / float(np.asarray(ROBOT.body.inertia)[axis])


@pytest.mark.parametrize("share", [1.0, -1.0])
def test_no_angle_of_attack_below_stall_balances_an_elevator_at_half_travel(share):
    stall = ROBOT.airframe.stall_deg
    turns = [
        turned_by(0, attack, 0.0, np.array([share * HALF[0], 0.0, 0.0, level, level]))
        for attack in np.linspace(-stall, stall, 27)
        for level in (0.0, 1.0)
    ]
    assert min(share * turn for turn in turns) > 4.0


@pytest.mark.parametrize("share", [1.0, -1.0])
def test_no_sideslip_in_which_the_fin_holds_balances_an_aileron_at_half_travel(share):
    turns = [
        turned_by(1, 2.0, slip, np.array([0.0, share * HALF[1], rudder, 0.4, 0.4]))
        for slip in np.linspace(-7.0, 7.0, 15)
        for rudder in (-2.0 * HALF[2], 2.0 * HALF[2])
    ]
    assert min(share * turn for turn in turns) > 2.0
