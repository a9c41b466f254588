"""The envelope guard by rollouts: no controller drives boats or wheels out of their area, or wings into the water."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Inputs
from fulmar_core.dynamics.by_kind import begin_of
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.controller_settings import ENVELOPE, ControllerSettings
from fulmar_core.loop.envelope import check_guard, envelope_of, watches_envelope
from fulmar_core.loop.fallback import ControllerSwitch, Standby
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.envelope.braking import IDENTIFIED
from fulmar_core.safety.envelope.guard import LATCHES_AT
from fulmar_core.safety.envelope.lean.guard import RolloutGuard
from fulmar_core.safety.envelope.lean.hull import HullRollout
from fulmar_core.safety.envelope.lean.samples import COUNT, Samples, draw_samples
from fulmar_core.safety.envelope.lean.track import PlaneBounds
from fulmar_core.safety.envelope.lean.wheels import WheelRollout
from fulmar_core.safety.estop import EstopMonitor
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState, wrapped
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario

BOAT, BASE, CAR = (load_robot(name) for name in ("kingfisher", "turtlebot2", "leatherback"))
WINGS_HZ = 25.0
SIDES = {"kingfisher": 5.0, "turtlebot2": 1.5, "leatherback": 3.0}


class Hostile:
    """Drives away from the origin at full speed, or puts a craft's nose down."""

    name, estimator, observer, readings = "hostile", None, None, ()

    def __init__(self, robot, hz):
        self.control_hz, self._robot = hz, robot

    def reset(self):
        """Nothing to forget."""

    def act(self, inputs):
        state, actuators = inputs.state, self._robot.actuators
        if self._robot.airframe is not None:
            command = np.array(begin_of(self._robot).command(self._robot, state))
            command[:, 0] = actuators.scale[0]
            return command
        off = wrapped(np.arctan2(state.y, state.x) - state.yaw)
        ahead = np.where(np.cos(off) >= 0.0, 1.0, -1.0)
        turn = np.clip(2.0 * np.sin(off) * ahead, -1.0, 1.0)
        if self._robot is BOAT:
            return ahead[:, None] + turn[:, None] * np.sign(actuators.lever_arms)
        return np.stack((ahead, turn), axis=-1) * actuators.scale


def driven(robot, *, guarded, seconds, worlds=2, controller=None, seed=5):
    """How far robots went beyond their area, or into the water, at most, shape (worlds,), and the guard."""
    flies = robot.airframe is not None
    task = load_task("fly_hold" if flies else "go_to_position").fitted(robot)
    controller = controller or Hostile(robot, WINGS_HZ if flies else robot.timing.control_hz)
    hz = controller.control_hz
    simulation = BatchSimulation(
        robot, task, load_scenario("nominal"), worlds=worlds, seed=seed, control_hz=hz
    )
    side = 0.0 if flies else SIDES[robot.name]
    if not flies:
        x, y = np.random.default_rng(seed).uniform(-0.5 * side, 0.5 * side, (2, worlds))
        start = replace(simulation.truth.in_float64(), x=x, y=y)
        simulation.put(start, simulation.goal, simulation.command)
    envelope = RolloutGuard(robot, hz, area=(-side, side) * 2) if guarded else None
    loop = ControlLoop(robot, task, controller, robots=worlds, envelope=envelope)
    loop.begin(goal_in_float64(simulation.goal))
    most = np.full(worlds, -np.inf)
    for step in range(round(seconds * hz)):
        simulation.move(loop.step(simulation.measured, {}, round(1e9 * step / hz)).command)
        place = simulation.truth.to_rigid().position_in_world
        deep = -(place[:, 2] + robot.hull_span[0])
        most = np.maximum(most, deep if flies else np.abs(place[:, :2]).max(axis=1) - side)
    return most, envelope


@pytest.mark.parametrize("robot", [BOAT, BASE, CAR], ids=lambda robot: robot.name)
def test_a_controller_that_drives_out_never_leaves_the_area_and_would_have_without_the_guard(robot):
    most, envelope = driven(robot, guarded=True, seconds=10.0)
    assert (most < 0.0).all(), most
    assert (envelope.trips > 0).all() and "it could not stop before" in envelope.events[0].cause
    free, _ = driven(robot, guarded=False, seconds=10.0)
    assert (free > 0.3).all(), free


@pytest.mark.slow
def test_a_controller_that_dives_never_touches_the_water_and_would_have_without_the_guard():
    wings = load_robot("airship_v7")
    most, envelope = driven(wings, guarded=True, seconds=6.0, worlds=8)
    assert (most < 0.0).all(), most
    assert (envelope.trips > 0).all() and "regain level flight" in envelope.events[0].cause
    free, _ = driven(wings, guarded=False, seconds=1.5)
    assert (free > -0.05).all(), free


def test_the_backup_keeps_the_fourth_trip_until_a_new_goal():
    _, envelope = driven(BASE, guarded=True, seconds=40.0, worlds=1)
    kinds = [event.tripped for event in envelope.events]
    assert kinds == [True, False] * (LATCHES_AT - 1) + [True] and envelope.latched
    envelope.reset()
    assert not envelope.latched and not envelope.holds.any()


def test_two_guards_take_the_same_decisions_to_the_bit():
    (_, one), (_, other) = (driven(BOAT, guarded=True, seconds=9.0) for _ in range(2))
    assert one.events == other.events and one.events


def test_samples_cover_every_range_to_its_ends_and_are_the_same_each_time():
    one, other = draw_samples(BOAT, IDENTIFIED), draw_samples(BOAT, IDENTIFIED)
    assert all(np.array_equal(a, b) for a, b in zip(vars(one).values(), vars(other).values(), strict=True))
    assert len(one.mass) == COUNT
    assert (one.mass.min(), one.mass.max()) == pytest.approx((33.0 / 35.0, 37.0 / 35.0))
    assert (one.gain.min(), one.late_s.max()) == pytest.approx((IDENTIFIED.thrust, IDENTIFIED.delay_s))
    assert np.abs(np.exp(1j * one.bearing).sum()) < 1e-9, "pushes come from everywhere"


def nominal_sample():
    one, zero = np.ones(1), np.zeros(1)
    return Samples(one, one, one, one, zero, zero, zero, zero)


@pytest.mark.parametrize(
    ("robot", "speed", "turns", "command", "rest"),
    [
        (BOAT, 1.2, 0.0, (1.0, 1.0), (-0.7, -0.7)),
        (BOAT, 0.8, 0.4, (0.5, 1.0), (-0.7, -0.7)),
        (BASE, 0.4, 0.5, (0.45, 0.9), (0.0, 0.0)),
        (CAR, 1.0, 0.0, (1.0, 0.1), (0.0, 0.0)),
    ],
)
def test_a_coarse_model_stops_where_the_cores_dynamics_do(robot, speed, turns, command, rest):
    hz = robot.timing.control_hz
    model = (HullRollout if robot is BOAT else WheelRollout)(robot, nominal_sample(), 1.0 / hz)
    zero, now = np.zeros(1), np.array([command])
    state = PlanarState(
        zero, zero, zero + 0.3, *(speed * np.array([[np.cos(0.3)], [np.sin(0.3)]])), zero + turns
    )
    end = model.track(state, now, now).ends[0]
    still = replace(load_scenario("nominal"), sensor_noise=False, body="nominal")
    task = load_task("go_to_position")
    core = BatchSimulation(robot, task, still, worlds=1, seed=0)
    core.put(state, core.goal, now)
    sent, slew = now, np.array(robot.actuators.response.slew or (np.inf,)) / hz
    core.move(now)
    far = 0.0
    for _ in range(round(8.0 * hz)):
        sent = sent + np.clip(np.array([rest]) - sent, -slew, slew)
        core.move(sent)
        u, _ = core.truth.velocity_in_body
        if u[0] <= 0.003:
            break
    found = core.truth.to_rigid().position_in_world[0]
    far = float(np.linalg.norm(found[:2]))
    assert np.linalg.norm(found[:2] - end[:2]) < 0.03 + 0.05 * far, (found, end)


@pytest.mark.slow
def test_the_coarse_model_of_wings_rises_and_sinks_as_the_cores_dynamics_do():
    wings = load_robot("airship_v7")
    guard = RolloutGuard(wings, WINGS_HZ)
    rooms = guard._rooms
    rooms.rollout._samples = nominal_sample()
    made = [rooms.rollout._model(model) for model in rooms.rollout._models]
    from fulmar_core.safety.envelope.lean.wing import _repeated

    rooms.rollout._one, rooms.rollout._many = made, [_repeated(*each, rooms.rollout._each) for each in made]
    still = replace(load_scenario("nominal"), sensor_noise=False, body="nominal")
    core = BatchSimulation(wings, load_task("fly_hold"), still, worlds=1, seed=3, control_hz=WINGS_HZ)
    level = core.command.astype(float)
    dives = level + np.array([[0.1, 0.05, 0.0, 0.0, 0.0]])
    previous, lowest = level, np.inf
    for step in range(44):
        state = SpatialState.from_rigid(core.truth.to_rigid()).in_float64()
        inputs = Inputs(state, None, np.zeros((1, 0)), previous, None, step, 1.0 / WINGS_HZ)
        servos = rooms.backup.see(inputs)
        if step < 3:
            command = dives
        else:
            if step == 3:
                rooms.backup.stop(np.ones(1, dtype=bool), state.to_rigid(), np.zeros((1, 3)))
                found = rooms.rollout.limits(state, servos, rooms.backup.command(inputs, None))
            command = wings.actuators.limited(rooms.backup.command(inputs, None))
        core.move(command)
        previous = command
        if step >= 3:
            lowest = min(lowest, float(core.truth.z[0]) + wings.hull_span[0])
    assert found.lowest[0] == pytest.approx(lowest, abs=0.08)


def test_the_guard_is_asked_for_by_its_name_and_refused_where_nothing_says_how_a_robot_stops():
    named = ControllerSettings(robot=BOAT.name, guard=ENVELOPE)
    assert isinstance(envelope_of(BOAT, named), RolloutGuard)
    assert envelope_of(BOAT, ControllerSettings(robot=BOAT.name, area=(-1.0, 1.0, -1.0, 1.0))) is None
    assert watches_envelope(BOAT, ENVELOPE, ()) and not watches_envelope(BOAT, "", (-1.0, 1.0, -1.0, 1.0))
    turns = load_robot("cubesat_wheels")
    with pytest.raises(ConfigError, match="'cubesat_wheels' is none of them"):
        check_guard(turns)
    assert not watches_envelope(turns, ENVELOPE, ())


def test_a_robot_without_a_law_that_could_be_the_backup_is_refused(monkeypatch):
    def none(robot, task):
        raise ConfigError(f"no classical law does '{task.name}'.")

    monkeypatch.setattr("fulmar_core.loop.envelope.check_pair", none)
    with pytest.raises(ConfigError, match="guard 'envelope' has no backup for 'kingfisher'"):
        check_guard(BOAT)


@pytest.mark.slow
def test_wings_turn_before_a_side_and_circle_inside_for_good():
    wings = load_robot("airship_v7")
    task = load_task("fly_hold").fitted(wings)
    sim = BatchSimulation(wings, task, load_scenario("nominal"), worlds=2, seed=1, control_hz=WINGS_HZ)
    guard = RolloutGuard(wings, WINGS_HZ, area=(-900.0, 420.0, -900.0, 900.0, 0.0, 50.0))
    law = load_classical(wings, task, control_hz=WINGS_HZ)
    loop = ControlLoop(wings, task, law, robots=2, envelope=guard)
    loop.begin(goal_in_float64(sim.goal))
    for step in range(round(35.0 * WINGS_HZ)):
        sim.move(loop.step(sim.measured, {}, round(1e9 * step / WINGS_HZ)).command)
        assert (np.abs(sim.truth.x + 240.0) < 660.0).all() and (sim.truth.z + wings.hull_span[0] > 0.0).all()
    assert (guard.trips > 0).all() and "x_max" in guard.events[0].cause


def test_an_area_that_is_too_narrow_for_a_turn_is_refused():
    wings = load_robot("airship_v7")
    with pytest.raises(ConfigError, match="holds no level turn of 'airship_v7'"):
        RolloutGuard(wings, WINGS_HZ, area=(-100.0, 100.0, -900.0, 900.0, 0.0, 50.0))


def test_a_boat_beyond_its_geofence_trips_the_guard():
    guard = RolloutGuard(BOAT, 10.0, geofence=4.0)
    zero = np.zeros(1)
    state = PlanarState(zero + 3.0, zero, zero, zero + 1.0, zero, zero)
    command = np.ones((1, 2))
    inputs = Inputs(state, None, np.zeros((1, 0)), command, None, 0, 0.1)
    sent = guard.guarded(command, inputs, None, np.zeros((1, 3)))
    assert guard.holds[0] and "geofence" in guard.events[0].cause and sent.max() < 0.0


def test_the_sample_that_goes_farthest_counts():
    zero, now = np.zeros(1), np.ones((1, 2))
    state = PlanarState(zero, zero, zero, zero + 1.2, zero, zero)
    bounds = PlaneBounds((-6.0, 6.0, -6.0, 6.0), np.inf)

    def room(samples):
        return bounds.distances(HullRollout(BOAT, samples, 0.1).track(state, now, now).places, None)[0].min()

    assert room(draw_samples(BOAT, IDENTIFIED)) < room(nominal_sample()) - 0.3


def test_a_boat_outside_its_area_stops_its_propellers_as_without_the_guard():
    settings = ControllerSettings(
        robot=BOAT.name, task="go_to_position", lockstep=True, guard=ENVELOPE, area=(-3.0, 3.0, -3.0, 3.0)
    )
    switch = ControllerSwitch(Standby(Hostile(BOAT, 10.0), "{}", ""))
    loop = GuardedLoop(BOAT, load_task("go_to_position"), settings, switch, EstopMonitor(required=False))
    loop.activate()
    now_ns = 1_000_000_000
    assert not loop.take_goal(np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]), now_ns, now_ns)
    place = RigidBodyState(
        np.array([3.4, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]), np.array([0.3, 0.0, 0.0]), np.zeros(3)
    )
    loop.take(Measurement(now_ns + 1, "odom", "base_link", place), now_ns + 1)
    decision, inputs = loop.begin_step(loop.newest, now_ns + 1)
    assert inputs is None and "Bring it back by hand" in decision.reason
    assert not loop.loop.previous.any()
