"""The LQR: its model, its gain, and what it does to a platform."""

from __future__ import annotations

from dataclasses import asdict, fields, replace
from functools import partial

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.lqr import Lqr, LqrWeights
from fulmar_core.dynamics.linear_model import linearise_wrench
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.actuators.thrusters import Nozzle
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import episode_metrics, successes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_core.worlds.scenario import load_scenario
from tests.inputs import inputs_at, inputs_of

ROBOT, POSE, POSITION = load_robot("floating_platform"), load_task("go_to_pose"), load_task("go_to_position")
SPEED = load_task("track_velocities")
load_lqr = partial(load_classical, law="lqr")
WEIGHTS = load_config(LqrWeights, config_path("controllers", "floating_platform_lqr"))


def at(x=0.0, y=0.0, yaw=0.0, vx=0.0, vy=0.0, yaw_rate=0.0):
    return PlanarState(*(np.asarray(float(value)) for value in (x, y, yaw, vx, vy, yaw_rate)))


def seen(task, state, *target):
    return inputs_at(ROBOT, task, state, goal_at(target or (0.0, 0.0, 0.0)))


@pytest.mark.parametrize("hz", [50.0, 5.0])
def test_the_linear_model_is_the_textbook_double_integrator(hz):
    model = linearise_wrench(ROBOT, at(), np.zeros(3), 1.0 / hz)
    dt, n = 1.0 / hz, ROBOT.timing.substeps(hz)
    expected_a = np.eye(6)
    expected_a[:3, 3:] = dt * np.eye(3)
    moments = np.array([ROBOT.body.mass, ROBOT.body.mass, ROBOT.body.inertia[2]])
    # Sum of n semi-implicit steps: dt²/2 of the continuous plant, times (n + 1) / n.
    expected_b = np.concatenate((np.diag(dt * dt * (n + 1) / (2 * n) / moments), np.diag(dt / moments)))
    np.testing.assert_allclose(model.a, expected_a, rtol=0, atol=1e-7)
    np.testing.assert_allclose(model.b, expected_b, rtol=0, atol=1e-7)


USED = {"go_to_pose": [0, 1, 2, 3, 4, 5], "go_to_position": [0, 1, 3, 4, 5], "track_velocities": [3, 4, 5]}


@pytest.mark.parametrize("hz", [50.0, 5.0])
@pytest.mark.parametrize("task", [POSE, POSITION, SPEED], ids=lambda task: task.name)
def test_the_closed_loop_without_saturation_is_stable(task, hz):
    used = USED[task.name]
    model = linearise_wrench(ROBOT, at(), np.zeros(3), 1.0 / hz)
    gain = gain_by_probing(load_lqr(ROBOT, task, control_hz=hz), task)
    radius = np.abs(np.linalg.eigvals(model.a[np.ix_(used, used)] - model.b[used] @ gain)).max()
    assert radius < 1.0
    assert np.log(radius) * hz < -0.1  # errors die out within some ten seconds


def gain_by_probing(lqr, task):
    """The gain as the allocation sees it: wanted wrenches for small unit errors."""
    wanted = []

    class Spy:
        def best(self, wrench, alive, dearer):
            wanted.append(wrench)
            return np.zeros((1, 8))

    lqr.allocation = Spy()
    h = 1e-3  # far below every limit
    names = ("x", "y", "yaw", "vx", "vy", "yaw_rate")
    for index in USED[task.name]:
        lqr.reset()
        lqr.act(seen(task, at(**{names[index]: h})))
    return -np.concatenate(wanted).T / h


def test_errors_push_back_towards_the_goal():
    gain = gain_by_probing(load_lqr(ROBOT, POSE), POSE)
    for wrench, error in ((0, 0), (1, 1), (2, 2), (0, 3), (1, 4), (2, 5)):
        assert gain[wrench, error] > 0.0  # w = -K x


def test_errors_beyond_the_limit_count_as_the_limit():
    weights = replace(WEIGHTS, braking=0.0, heading_error_limit_deg=60.0)
    edge, far = (error(at(x=d), weights) for d in (WEIGHTS.position_error_limit, 4.0))
    np.testing.assert_allclose(far, edge, rtol=0, atol=1e-12)
    assert np.rad2deg(error(at(yaw=np.deg2rad(-150)), weights)[2]) == pytest.approx(-60.0, abs=1e-9)


def error(state, weights=WEIGHTS, push=(0.0, 0.0, 0.0)):
    lqr, inputs = Lqr(ROBOT, POSE, weights), seen(POSE, state)
    return lqr.error_state(inputs, replace(lqr.frame.body_state(inputs), push=np.array([push])))[0]


def test_who_is_pushed_towards_the_goal_goes_there_more_slowly():
    lead = Lqr(ROBOT, POSE, WEIGHTS).lead
    along = at(x=-0.3 / np.sqrt(2), y=-0.3 / np.sqrt(2))  # of a nozzle
    for push in (0.0, 0.4):
        wanted = np.hypot(*error(along, push=(push / np.sqrt(2), push / np.sqrt(2), 0.0))[:2]) / lead
        brakes = WEIGHTS.braking * (1.0 - push) / ROBOT.body.mass
        assert wanted == pytest.approx(min(np.sqrt(2.0 * brakes * 0.3), 0.3 / lead), rel=1e-5)


def test_at_rest_at_the_goal_every_valve_is_closed():
    assert not load_lqr(ROBOT, POSE).act(seen(POSE, at(1.0, 2.0, 0.5), 1.0, 2.0, 0.5)).any()


def test_at_the_wanted_velocity_in_a_turn_it_asks_for_what_bends_the_way():
    wanted = []

    class Spy:
        def best(self, wrench, alive, dearer):
            wanted.append(wrench)
            return np.zeros((1, 8))

    lqr = load_lqr(ROBOT, SPEED)
    lqr.allocation = Spy()
    lqr.act(seen(SPEED, at(vx=0.3, vy=-0.1, yaw_rate=0.4), 0.3, -0.1, 0.4))
    m = ROBOT.body.mass
    np.testing.assert_allclose(wanted[0], [[m * 0.4 * 0.1, m * 0.4 * 0.3, 0.0]], atol=1e-12)


def test_going_to_a_position_ignores_the_heading():
    lqr = load_lqr(ROBOT, POSITION)
    rng = np.random.default_rng(1)
    for x, y, vx in rng.normal(size=(20, 3)):
        state = at(x, y, 0.3, vx=vx)
        answers = []
        for yaw in (0.0, 1.0, -2.0):
            lqr.reset()
            answers.append(lqr.act(seen(POSITION, state, 0.0, 0.0, yaw)).tolist())
        assert answers[0] == answers[1] == answers[2]


@pytest.mark.parametrize(
    ("hz", "episodes", "task"),
    [
        (5.0, 256, POSE),
        (5.0, 256, POSITION),
        pytest.param(50.0, 16, POSE, marks=pytest.mark.slow),
        pytest.param(50.0, 16, POSITION, marks=pytest.mark.slow),
    ],
    ids=lambda value: getattr(value, "name", str(value)),
)
def test_it_brings_every_platform_home_at_either_rate(hz, episodes, task):
    lqr = load_lqr(ROBOT, task, control_hz=hz)
    run = roll_out_in_batch(lqr, ROBOT, task, load_scenario("nominal"), episodes=episodes, seed=5)
    assert successes(run, task).mean() >= 0.99


DRIFT = load_task("drift_go_to_pose")


def drift_figures(scenario, weights=WEIGHTS, episodes=32):
    run = roll_out_in_batch(
        Lqr(ROBOT, DRIFT, weights), ROBOT, DRIFT, load_scenario(scenario), episodes=episodes, seed=3
    )
    return {name: values.mean() for name, values in episode_metrics(run, DRIFT).items()}


def test_it_stays_at_its_pose_against_a_force_that_it_has_to_find_out():
    assert drift_figures("drift_force_2")["PT1_percent"] >= 70.0
    assert drift_figures("drift_force_2", replace(WEIGHTS, observer=None))["PT1_percent"] < 20.0


def test_noise_in_the_measured_velocities_costs_it_little():
    assert drift_figures("drift_velocity_noise_4")["PT2_percent"] >= 60.0


def test_it_does_without_a_valve_that_it_has_to_find_dead():
    assert drift_figures("drift_one_lost", episodes=64)["PT5_percent"] >= 70.0
    blind = replace(WEIGHTS, observer=None)
    assert drift_figures("drift_one_lost", blind, episodes=64)["PT5_percent"] < 65.0


def test_it_leaves_valves_as_they_are_until_they_have_had_their_time():
    lqr = load_lqr(ROBOT, POSE, control_hz=50.0)
    simulation = BatchSimulation(ROBOT, POSE, load_scenario("nominal"), worlds=8, seed=1, control_hz=50.0)
    commands = []
    for _ in range(40):
        commands.append(lqr.act(inputs_of(simulation)))
        simulation.step(commands[-1])
    changes = np.any(np.diff(np.array(commands), axis=0) != 0.0, axis=2)
    assert changes.any()
    assert not (changes[1:] & changes[:-1]).any()  # 0.04 s are two control steps


def sha(robot=ROBOT, task=POSE, weights=WEIGHTS, hz=5.0):
    return Lqr(robot, task, weights, control_hz=hz).metadata()["sha256"]


NUMBERS = [field.name for field in fields(LqrWeights) if field.name not in ("speed_around", "observer")]


@pytest.mark.parametrize("name", NUMBERS)
def test_the_metadata_hash_changes_with_every_weight_and_limit(name):
    other = replace(WEIGHTS, **{name: 0.9 * getattr(WEIGHTS, name)})
    assert sha(weights=other) != sha()
    assert Lqr(ROBOT, SPEED, other).metadata()["gains"] == asdict(other)


def test_the_metadata_hash_changes_with_robot_task_and_rate_and_with_nothing_else():
    heavier = replace(ROBOT, body=replace(ROBOT.body, mass=6.0))
    other_thrust = replace(ROBOT, actuators=replace(ROBOT.actuators, thrust=0.9))
    robots = [ROBOT, replace(ROBOT, name="other"), heavier, other_thrust]
    hashes = [*(sha(robot) for robot in robots), sha(task=POSITION), sha(hz=50.0)]
    assert len(set(hashes)) == len(hashes)
    assert sha(replace(ROBOT, title="the same by another title")) == sha()


def test_the_rate_is_the_robots_own_by_default():
    assert load_lqr(ROBOT, POSE).control_hz == ROBOT.timing.control_hz


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"position": -1.0}, "weights must not be negative"),
        ({"force": 0.0}, "force, torque and the error limits"),
        ({"braking": 1.1}, "'braking' must lie in"),
        ({"overshoot": -0.1}, "'overshoot', 'least_open_s' and what is for tracking must not"),
    ],
)
def test_weights_without_a_solution_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        replace(WEIGHTS, **change)


def test_weights_without_a_word_on_obstacles_are_refused_where_some_stand():
    with pytest.raises(ValueError, match="'speed_around' is missing"):
        Lqr(ROBOT, load_task("go_to_position_with_obstacles"), replace(WEIGHTS, speed_around=0.0))


@pytest.mark.parametrize(("count", "shared"), [(16, True), pytest.param(24, False, marks=pytest.mark.slow)])
def test_it_brings_platforms_of_many_nozzles_home(count, shared):
    """Pairs on each of many arms; without a shared line as strong as with one while all arms push."""
    arms = 2.0 * np.pi * np.arange(count // 2) / (count // 2)
    nozzles = tuple(
        Nozzle(f"n{i}_{j}", (0.3 * np.cos(a), 0.3 * np.sin(a), 0.0), (-s * np.sin(a), s * np.cos(a), 0.0))
        for i, a in enumerate(arms)
        for j, s in enumerate((1.0, -1.0))
    )
    thrust = 1.0 if shared else 4.0 / count
    bank = replace(ROBOT.actuators, nozzles=nozzles, shared_pressure=shared, thrust=thrust)
    robot = replace(ROBOT, actuators=bank)
    run = roll_out_in_batch(
        Lqr(robot, POSE, WEIGHTS), robot, POSE, load_scenario("ideal"), episodes=4, seed=5
    )
    assert successes(run, POSE).all()


def test_a_rate_that_the_physics_cannot_keep_is_refused():
    with pytest.raises(ConfigError, match="lqr for 'floating_platform' at 7 Hz: control_hz = 7 must divide"):
        load_lqr(ROBOT, POSE, control_hz=7.0)
