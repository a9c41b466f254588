"""LQR and PD of bodies in space, and how they are chosen."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.controllers.by_kind import laws_of
from fulmar_core.controllers.classical import check_pair, gains_of, has_law, load_classical
from fulmar_core.controllers.space_frame import SpaceFrame
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimate
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import successes
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal
from fulmar_core.worlds.scenario import load_scenario
from tests.inputs import inputs_at, some_of

ROBOT = load_robot("spacecraft_16")
TASKS = [load_task(name) for name in config_names("tasks") if load_task(name).kind.endswith("_3d")]
POSE = load_task("go_to_pose_3d")
SPACE_LAWS = laws_of(ROBOT)
LAWS = pytest.mark.parametrize("law", SPACE_LAWS)
UNEVEN = replace(ROBOT, body=replace(ROBOT.body, inertia=(0.20, 0.26, 0.33, 0.02, -0.03, 0.04)))


def state_of(rng, count):
    quat = Rotation.random(count, random_state=rng).as_quat()
    columns = (
        rng.normal(size=(3, count)),
        quat.T,
        0.2 * rng.normal(size=(3, count)),
        0.3 * rng.normal(size=(3, count)),
    )
    return SpatialState(*np.concatenate(columns))


def goal_of(rng, count, targets=1):
    quat = Rotation.random(count * targets, random_state=rng).as_quat().reshape(count, targets, 4)
    poses = np.concatenate((rng.normal(size=(count, targets, 3)), quat), axis=-1)
    return Goal(poses, np.zeros(count), np.zeros((count, 0, 3)))


# The LQR, which stands for `classical`, has its turn at every task in test_classical_laws.py.
@pytest.mark.parametrize("law", [pytest.param("lqr", marks=pytest.mark.slow), "pd"])
@pytest.mark.parametrize("task", TASKS, ids=[task.name for task in TASKS])
def test_a_spacecraft_does_every_task_in_space(law, task):
    controller = load_classical(ROBOT, task, law=law)
    run = roll_out_in_batch(controller, ROBOT, task, load_scenario("nominal"), episodes=8, seed=31)
    assert successes(run, task).mean() >= 0.95


@pytest.mark.parametrize("law", ["lqr", pytest.param("pd", marks=pytest.mark.slow)])
def test_modulation_halves_the_error_at_the_goal(law):
    modulated = load_classical(ROBOT, POSE, law=law)
    gains = replace(modulated.gains, carried_force=0.0, carried_torque=0.0)
    error = []
    for controller in (modulated, SPACE_LAWS[law].law(ROBOT, POSE, gains)):
        run = roll_out_in_batch(controller, ROBOT, POSE, load_scenario("nominal"), episodes=16, seed=31)
        error.append(float(run.position_error[:, -20:].mean()))
    assert error[0] < 0.6 * error[1]


def test_the_pd_wrench_is_that_of_lee_leok_and_mcclamroch():
    law, rng = load_classical(UNEVEN, POSE, law="pd"), np.random.default_rng(5)
    state, goal = state_of(rng, 20), goal_of(rng, 20)
    gains, inertia = law.gains, UNEVEN.body.inertia_matrix
    now = SpaceFrame(POSE).motion(inputs_at(UNEVEN, POSE, state, goal))
    law.limited_turn = lambda error: error
    found = law.wrench(now.way, now)
    for i in range(20):
        turn = Rotation.from_quat(np.array(state.quat)[:, i]).as_matrix()
        wanted = Rotation.from_quat(goal.targets[i, 0, 3:]).as_matrix()
        skew = 0.5 * (wanted.T @ turn - turn.T @ wanted)
        error = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
        rate, velocity = np.array(state.rate)[:, i], np.array(state.velocity)[:, i]
        away = np.array(state.position)[:, i] - goal.targets[i, 0, :3]
        force = -gains.position * turn.T @ away - gains.velocity * turn.T @ velocity
        torque = -gains.attitude * error - gains.rate * rate + np.cross(rate, inertia @ rate)
        np.testing.assert_allclose(found[i], [*force, *torque], atol=1e-12)


@LAWS
def test_the_wrench_does_not_depend_on_where_the_world_has_its_origin_and_axes(law):
    rng = np.random.default_rng(6)
    state, goal = state_of(rng, 12), goal_of(rng, 12)
    other, moved = Rotation.random(random_state=rng), np.array([3.0, -2.0, 5.0])

    def seen(position, quat, velocity, targets):
        turned = SpatialState(
            *(other.apply(position) + moved).T,
            *(other * Rotation.from_quat(quat)).as_quat().T,
            *other.apply(velocity).T,
            *state.rate,
        )
        place = other.apply(targets[:, 0, :3]) + moved
        poses = np.concatenate((place, (other * Rotation.from_quat(targets[:, 0, 3:])).as_quat()), axis=-1)
        return turned, replace(goal, targets=poses[:, None])

    turned = seen(*(np.array(part).T for part in (state.position, state.quat, state.velocity)), goal.targets)
    controller = load_classical(ROBOT, POSE, law=law)
    frame = SpaceFrame(POSE)
    here, there = (frame.motion(inputs_at(ROBOT, POSE, *each)) for each in ((state, goal), turned))
    np.testing.assert_allclose(
        controller.wrench(here.way, here), controller.wrench(there.way, there), atol=1e-9
    )


@LAWS
def test_each_robot_of_a_batch_gets_what_it_would_get_alone(law):
    controller, rng = load_classical(ROBOT, POSE, law=law), np.random.default_rng(8)
    steps = [inputs_at(ROBOT, POSE, state_of(rng, 5), goal_of(rng, 5)) for _ in range(6)]
    many = [controller.act(inputs) for inputs in steps]
    controller.reset()
    for inputs, commands in zip(steps, many, strict=True):
        np.testing.assert_array_equal(controller.act(some_of(inputs, slice(2, 3)))[0], commands[2])


@LAWS
def test_valves_that_are_believed_dead_stay_closed(law):
    controller, rng = load_classical(ROBOT, POSE, law=law), np.random.default_rng(9)
    state, goal = state_of(rng, 64), goal_of(rng, 64)
    alive = np.ones((64, 16))
    free = controller.act(inputs_at(ROBOT, POSE, state, goal))
    assert free[:, [2, 7]].any()
    alive[:, [2, 7]] = 0.0
    controller.reset()
    estimate = ActuatorEstimate(state, np.zeros((64, 6)), alive, alive)
    chosen = controller.act(inputs_at(ROBOT, POSE, state, goal, estimates=estimate))
    assert chosen.any(axis=1).all()
    assert not chosen[:, [2, 7]].any()


@LAWS
def test_a_wanted_wrench_about_the_centre_of_mass_is_allocated_about_the_origin(law):
    off = replace(ROBOT, body=replace(ROBOT.body, center_of_mass=(0.05, -0.03, 0.02)))
    controller, rng = load_classical(off, POSE, law=law), np.random.default_rng(10)
    asked = []

    class Recorder:
        def best(self, wanted, alive=None, dearer=None):
            asked.append(wanted)
            return np.zeros((*wanted.shape[:-1], 16))

    controller._modulation, state, goal = Recorder(), state_of(rng, 3), goal_of(rng, 3)
    inputs = inputs_at(off, POSE, state, goal)
    controller.act(inputs)
    now = SpaceFrame(POSE).motion(inputs)
    about_mass = controller.wrench(controller._way(inputs, now), now)
    arm = np.cross(off.body.com, about_mass[:, :3])
    np.testing.assert_allclose(asked[0] - about_mass, np.hstack((np.zeros((3, 3)), arm)), atol=1e-12)


def test_gains_are_those_of_the_body_without_a_file():
    heavy = replace(ROBOT, name="other", body=replace(ROBOT.body, mass=10.0, inertia=(0.4, 0.4, 0.4)))
    light, slow = gains_of(ROBOT, "pd"), gains_of(heavy, "pd")
    assert slow.velocity > light.velocity
    assert slow.rate > light.rate
    assert gains_of(ROBOT) == gains_of(ROBOT, "lqr") != light
    assert gains_of(heavy, "lqr").velocity > gains_of(ROBOT, "lqr").velocity


def test_a_body_that_cannot_be_turned_about_every_axis_is_refused():
    nozzles = tuple(replace(each, position=(0.0, 0.0, 0.0)) for each in ROBOT.actuators.nozzles)
    lame = replace(ROBOT, name="other", actuators=replace(ROBOT.actuators, nozzles=nozzles))
    with pytest.raises(
        ConfigError, match="do not push in every direction and turn the body about every axis"
    ):
        check_pair(lame, POSE, law="pd")


@LAWS
def test_the_metadata_hash_changes_with_every_gain(law):
    gains, entry = gains_of(ROBOT, law), SPACE_LAWS[law]
    metadata = entry.law(ROBOT, POSE, gains).metadata()
    assert (metadata["law"], metadata["gains"]) == (law, asdict(gains))
    for name, value in asdict(gains).items():
        other = replace(gains, **{name: 1.01 * value + 0.001})
        assert entry.law(ROBOT, POSE, other).metadata()["sha256"] != metadata["sha256"]


def test_gains_that_cannot_be_are_refused():
    for law in SPACE_LAWS:
        gains = gains_of(ROBOT, law)
        for change in ({"position_error_limit": 0.0}, {"carried_force": -1.0}, {"position": -1.0}):
            with pytest.raises(ValueError, match="must"):
                replace(gains, **change)


@pytest.mark.parametrize(
    ("robot", "task", "law", "said"),
    [
        (
            "floating_platform",
            "go_to_pose",
            "pd",
            "'pd' is for bodies that are pushed in space with thrusters or fans, satellites that only turn",
        ),
        (
            "turtlebot2",
            "go_to_pose",
            "pd",
            "'turtlebot2' is one of the robots on wheels with differential_drive. Use",
        ),
        (
            "spacecraft_16",
            "go_to_pose_3d",
            "mpc",
            "'spacecraft_16' is one of the bodies that are pushed in space with thrusters. Use --controller classical",
        ),
        (
            "spacecraft_16",
            "go_to_pose",
            "lqr",
            "'go_to_pose' is for robots that are pushed over a floor or water",
        ),
        (
            "floating_platform",
            "go_to_pose_3d",
            "lqr",
            "'go_to_pose_3d' is for bodies that are pushed in space",
        ),
    ],
)
def test_a_law_or_a_task_of_the_other_space_is_one_line(robot, task, law, said):
    robot, task = load_robot(robot), load_task(task)
    with pytest.raises(ConfigError, match=said) as raised:
        check_pair(robot, task, law=law)
    assert "\n" not in str(raised.value)
    assert has_law(robot, task) == (robot.state_type is task.state_type)
