"""The envelope guard: no controller drives a floating robot out of its area, and one that did is brought back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.controller_settings import ENVELOPE, ControllerSettings
from fulmar_core.loop.envelope import envelope_of
from fulmar_core.loop.fallback import ControllerSwitch, Standby
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.envelope.braking import Beliefs
from fulmar_core.safety.envelope.guard import FIRST_TICKS, LATCHES_AT, EnvelopeGuard
from fulmar_core.safety.estop import EstopMonitor
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import from_yaw, rotate_inverse
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.parts import Actuation
from fulmar_core.worlds.scenario import Scenario, load_scenario

PLATFORM, SPACECRAFT = load_robot("floating_platform"), load_robot("spacecraft_16")
S, STEP_NS = 1_000_000_000, 200_000_000
SIDE = 2.5


class Hostile:
    """Drives away from the origin, or turns the body, with all that one valve has."""

    name, estimator, observer, readings = "hostile", None, None, ()

    def __init__(self, robot, *, spins=False):
        self.control_hz, self._actuators, self._spins = robot.timing.control_hz, robot.actuators, spins

    def reset(self):
        """Nothing to forget."""

    def act(self, inputs):
        rigid = inputs.state.to_rigid()
        each = self._actuators.wrench_per_newton
        if self._spins:
            along = np.broadcast_to(each[:, 5], (len(inputs.previous), len(each)))
        else:
            along = rotate_inverse(rigid.quat_xyzw, rigid.position_in_world + 1e-3) @ each[:, :3].T
        return np.eye(len(each))[along.argmax(axis=1)]


def task_of(robot):
    return load_task("go_to_pose" + robot.state_type.SUFFIX)


def flown(robot, *, guarded, spins=False, seconds=40.0, worlds=6):
    """How far robots went beyond their area at most, and how fast they turned at the end, each shape (worlds,)."""
    task, controller = task_of(robot), Hostile(robot, spins=spins)
    simulation = BatchSimulation(robot, task, load_scenario("nominal"), worlds=worlds, seed=5)
    axes = robot.state_type.AXES
    places = np.random.default_rng(5).uniform(-1.5, 1.5, (axes, worlds))
    start = replace(simulation.truth.in_float64(), **dict(zip("xyz", places, strict=False)))
    simulation.put(start, simulation.goal, simulation.command)
    area = (-SIDE, SIDE) * axes
    envelope = EnvelopeGuard(robot, controller.control_hz, area=area) if guarded else None
    loop = ControlLoop(robot, task, controller, robots=worlds, envelope=envelope)
    loop.begin(goal_in_float64(simulation.goal))
    most, rates = np.full(worlds, -np.inf), np.zeros(worlds)
    for step in range(round(seconds * controller.control_hz)):
        done = loop.step(simulation.measured, simulation.readings, round(1e9 * step * loop.dt))
        simulation.move(done.command)
        rigid = simulation.truth.to_rigid()
        most = np.maximum(most, np.abs(rigid.position_in_world).max(axis=1) - SIDE)
        rates = np.maximum(rates, np.linalg.norm(rigid.angular_velocity_in_body, axis=1))
    return most, rates, envelope


@pytest.mark.parametrize("robot", [PLATFORM, SPACECRAFT], ids=lambda robot: robot.name)
def test_a_controller_that_drives_out_never_leaves_the_area_and_would_have_without_the_guard(robot):
    most, _, envelope = flown(robot, guarded=True, seconds=25.0)
    assert (most < 0.0).all(), most
    assert (envelope.trips > 0).all()
    free, _, _ = flown(robot, guarded=False, seconds=15.0, worlds=2)
    assert (free > 0.3).all(), free


@pytest.mark.parametrize("robot", [PLATFORM, SPACECRAFT], ids=lambda robot: robot.name)
def test_a_controller_that_spins_the_body_is_stopped_at_the_bound_of_the_turn_rate(robot):
    _, rates, envelope = flown(robot, guarded=True, spins=True, seconds=12.0, worlds=2)
    assert (rates < envelope.braking.turn_rate + 0.2).all(), rates
    assert "turn rate" in envelope.events[0].cause


def test_the_backup_gives_back_after_5_10_and_20_steps_with_room_and_keeps_the_fourth_trip():
    _, _, envelope = flown(PLATFORM, guarded=True, seconds=120.0, worlds=1)
    kinds = [event.tripped for event in envelope.events]
    assert kinds == [True, False, True, False, True, False, True]
    assert envelope.latched and envelope.trips[0] == LATCHES_AT
    held = np.diff([event.stamp_ns for event in envelope.events])[::2] / STEP_NS
    assert (held >= FIRST_TICKS * 2 ** np.arange(3)).all()
    trip = envelope.events[0]
    assert trip.room < 0.0 and trip.refused != trip.sent and "it could not stop before" in trip.cause
    envelope.reset()
    assert not envelope.latched and not envelope.holds.any()


def test_two_guards_take_the_same_decisions_to_the_bit():
    _, _, one = flown(PLATFORM, guarded=True, seconds=30.0, worlds=2)
    _, _, other = flown(PLATFORM, guarded=True, seconds=30.0, worlds=2)
    assert one.events == other.events and one.events


def test_the_guard_is_refused_for_robots_that_only_turn():
    satellite = load_robot("cubesat_wheels")
    with pytest.raises(ConfigError, match="guard 'envelope' is for robots that float"):
        envelope_of(satellite, ControllerSettings(robot=satellite.name, guard=ENVELOPE))
    assert envelope_of(PLATFORM, ControllerSettings(guard=ENVELOPE)).watches
    assert not envelope_of(PLATFORM, ControllerSettings()).watches
    with pytest.raises(ValueError, match="guard = 'envelop' must be"):
        ControllerSettings(guard="envelop")


def noticed(robot, *, gain=1.0, delay_s=0.0, notices=True):
    """The guard of 4 robots after 15 s of a drive with so much of their thrust, and commands so late [s]."""
    actuation = Actuation(gain=(gain, gain), delay_s=delay_s, least_delay=1.0)
    scenario = Scenario("altered", sensor_noise=True, body="nominal", actuation=actuation)
    task, controller = task_of(robot), load_classical(robot, task_of(robot))
    simulation = BatchSimulation(robot, task, scenario, worlds=4, seed=5)
    area = (-20.0, 20.0) * robot.state_type.AXES
    envelope = EnvelopeGuard(robot, controller.control_hz, area=area, notices=notices)
    loop = ControlLoop(robot, task, controller, robots=4, envelope=envelope)
    loop.begin(goal_in_float64(simulation.goal))
    for step in range(75):
        simulation.move(loop.step(simulation.measured, {}, round(1e9 * step * loop.dt)).command)
    return envelope


def test_a_body_that_answers_its_commands_as_believed_is_left_to_its_controller():
    assert not noticed(PLATFORM, gain=0.9, delay_s=0.06).holds.any()


@pytest.mark.parametrize(
    ("altered", "words"), [({"gain": 0.55}, "gains less speed"), ({"delay_s": 0.16}, "act later than")]
)
def test_a_body_with_weak_thrust_or_late_commands_is_stopped_for_good_with_the_reason(altered, words):
    envelope = noticed(PLATFORM, **altered)
    assert envelope.holds.all() and words in envelope.events[0].cause
    assert len(envelope.events) == 1, "it never gives back"
    assert not noticed(PLATFORM, **altered, notices=False).holds.any(), "an area alone does not ask for it"


class Drive:
    """A guarded loop on the platform, with odometry in its rhythm."""

    def __init__(self, controller=None, **settings):
        switch = ControllerSwitch(Standby(controller or Hostile(PLATFORM), "{}", ""))
        chosen = ControllerSettings(lockstep=True, air_bearing=False, **settings)
        self.guard = GuardedLoop(PLATFORM, task_of(PLATFORM), chosen, switch, EstopMonitor(required=False))
        self.guard.take_bearing(True)
        self.guard.activate()
        self.now_ns = S

    def give(self, x, y):
        self.now_ns += 1
        return self.guard.take_goal(np.array([[x, y, 0.0, 0.0, 0.0, 0.0, 1.0]]), self.now_ns, self.now_ns)

    def step(self, x, y, vx, vy):
        """Receive odometry and do a control step: the decision and the command."""
        self.now_ns += STEP_NS
        state = RigidBodyState(
            np.array([x, y, 0.0]), from_yaw(np.array(0.0)), np.array([vx, vy, 0.0]), np.zeros(3)
        )
        self.guard.take(Measurement(self.now_ns, "odom", "base_link", state), self.now_ns)
        decision, inputs = self.guard.begin_step(self.guard.newest, self.now_ns)
        if inputs is not None:
            self.guard.act(inputs)
        return decision, self.guard.loop.previous[0]


def push_of(command):
    return PLATFORM.actuators.wrench_in_body(np.asarray(command)[None])[0][0]


def test_a_platform_that_left_its_area_is_braked_and_brought_back_instead_of_drifting_on():
    drive = Drive(area=(-1.0, 1.0, -1.0, 1.0))
    drive.give(0.0, 0.0)
    decision, command = drive.step(1.2, 0.0, 0.4, 0.0)
    assert (
        not decision.may_act and "outside its area" in decision.reason and "brings it back" in decision.reason
    )
    assert push_of(command)[0] < -0.3
    decision, command = drive.step(1.3, 0.0, 0.0, 0.0)
    assert not decision.may_act and push_of(command)[0] < -0.3, "from rest it comes back"


def test_a_platform_beyond_its_geofence_is_braked():
    drive = Drive()
    drive.give(0.0, 0.0)
    drive.step(7.5, 0.0, 0.4, 0.0)
    pushes = []
    for step in range(8):
        decision, command = drive.step(8.2 + 0.08 * step, 0.0, 0.4, 0.0)
        pushes.append(push_of(command)[0])
    assert "beyond the geofence" in decision.reason and min(pushes) < -0.3 and max(pushes) < 0.1


@pytest.mark.parametrize("given", [True, False])
def test_without_a_goal_nothing_moves_a_platform_that_is_outside_its_area(given):
    drive = Drive(area=(-1.0, 1.0, -1.0, 1.0))
    if given:
        drive.give(0.0, 0.0)
    _, command = drive.step(1.2, 0.0, 0.2, 0.0)
    assert command.any() == given


def test_nothing_brakes_while_the_air_bearing_is_off():
    drive = Drive(area=(-1.0, 1.0, -1.0, 1.0))
    drive.give(0.0, 0.0)
    drive.guard.take_bearing(False)
    _, command = drive.step(1.2, 0.0, 0.2, 0.0)
    assert not command.any()


def test_a_new_goal_lets_the_controller_act_again_after_the_fourth_trip():
    drive = Drive(area=(-1.0, 1.0, -1.0, 1.0))
    drive.give(0.0, 0.0)
    drive.step(0.9, 0.0, 0.4, 0.0)
    assert drive.guard.loop.envelope.holds[0]
    drive.give(0.1, 0.1)
    assert not drive.guard.loop.envelope.holds[0]
    drive.step(0.0, 0.0, 0.0, 0.0)
    kinds = [event.tripped for event in drive.guard.loop.envelope.events]
    assert kinds == [True, False], "the end of the hold is an event, too"


def room_of(envelope, **motion):
    names = ("x", "y", "yaw", "vx", "vy", "yaw_rate")
    state = PlanarState(*(np.array([motion.get(name, 0.0)]) for name in names))
    rigid = state.to_rigid()
    return float(envelope._sums.room(rigid, rigid.quat_xyzw, np.zeros((1, 8)), None).metres[0])


def test_a_body_that_turns_or_is_late_has_less_room():
    area = (-1.0, 1.0, -1.0, 1.0)
    usual = EnvelopeGuard(PLATFORM, 5.0, area=area)
    steady = room_of(usual, vx=0.2)
    assert room_of(usual, vx=0.2, yaw_rate=2.0) < steady - 0.1
    late = EnvelopeGuard(PLATFORM, 5.0, area=area, beliefs=Beliefs(delay_s=0.5))
    assert room_of(late, vx=0.2) < steady - 0.08


def test_a_platform_at_rest_near_a_side_is_left_to_its_controller():
    envelope = EnvelopeGuard(PLATFORM, 5.0, area=(-1.0, 1.0, -1.0, 1.0))
    rest = PlanarState(*(np.array([value]) for value in (0.9, 0.0, 0.0, 0.0, 0.0, 0.0)))
    rigid = rest.to_rigid()
    room = envelope._sums.room(rigid, rigid.quat_xyzw, np.zeros((1, 8)), None)
    assert 0.05 < room.metres[0] < 0.1 and room.names[room.side[0]] == "x_max"
