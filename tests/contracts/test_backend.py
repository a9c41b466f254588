"""What every simulated backend promises for every robot, whoever integrates the bodies."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from fulmar_bringup.system import SIMULATED
from fulmar_core.dynamics.flight_trim import find_trim, flying_at
from fulmar_core.robots.basilisk_robots import is_for_basilisk
from fulmar_core.robots.sensors.star_tracker import StarTrackerSpec
from fulmar_core.simulation.episode import Episode, draw_episode
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.goal import goal_at
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from tests.basilisk import with_basilisk
from tests.conftest import ALIKE
from tests.new_robots import robots_of_every_family
from tests.spaces import SPACECRAFT, task_for

ROBOTS = robots_of_every_family()
PLATFORM = ROBOTS["floating_platform"]
AT_REST = {
    PlanarState: (1.0, -2.0, 0.5, 0.0, 0.0, 0.0),
    SpatialState: (1.0, -2.0, 0.5, 0.5, -0.1, 0.5, 0.7, *(0.0,) * 6),
}
ALOFT = SpatialState.target_at((1.0, -2.0, 50.0))
ELSEWHERE = {
    PlanarState: (9.0, 9.0, 3.0, 0.0, 0.0, 0.0),
    SpatialState: (9.0, 9.0, 3.0, 1.0, *(0.0,) * 9),
}
PUSHED = {
    PlanarState: {"force_x": 1.0, "torque": 0.1},
    SpatialState: {"force": (1.0, 0.0, 0.0), "torque": (0.0, 0.0, 0.1)},
}


def build_mujoco(robot):
    pytest.importorskip("mujoco")
    from sim_nodes.mujoco_backend import MujocoBackend

    return MujocoBackend(robot)


def build_jsbsim(robot):
    from sim_nodes.jsbsim_backend import JsbsimBackend

    return JsbsimBackend(robot)


OF_ANY_ROBOT = {"mock": MockBackend, "mujoco": build_mujoco}
BUILDERS = {**OF_ANY_ROBOT, "jsbsim": build_jsbsim, "basilisk": with_basilisk}
IS_FOR = {"jsbsim": lambda robot: robot.flies, "basilisk": is_for_basilisk}
PAIRS = [
    pytest.param(
        (kind, name),
        id=f"{kind}-{name}",
        marks=pytest.mark.slow if ALIKE.get(name) in ROBOTS or kind == "basilisk" else (),
    )
    for kind in sorted(BUILDERS)
    for name in sorted(ROBOTS)
    if kind in OF_ANY_ROBOT or IS_FOR[kind](ROBOTS[name])
]


@functools.cache
def aloft(robot):
    """Numbers of level flight: an aircraft cannot stand."""
    return [float(part) for part in flying_at(robot, ALOFT).columns()]


@functools.cache
def world_of(robot, scenario):
    return draw_episode(robot, task_for(robot, "go_to_pose"), load_scenario(scenario), seed=0, number=0).world


def episode_of(robot, scenario="nominal", start=None, **world):
    drawn = world_of(robot, scenario)
    if robot.flies:
        start = start or aloft(robot)
    kind = robot.state_type
    return Episode(
        kind(*(np.asarray(value) for value in start or AT_REST[kind])),
        goal_at(kind.target_at((0.0,) * kind.AXES)),
        replace(drawn, **{name: np.asarray(value) for name, value in world.items()}),
    )


def command_of(robot):
    return robot.actuators.limited(0.6 * robot.actuators.scale)


@pytest.fixture(params=sorted(OF_ANY_ROBOT))
def build(request):
    return OF_ANY_ROBOT[request.param]


@pytest.fixture(params=PAIRS)
def backend(request):
    kind, name = request.param
    backend = BUILDERS[kind](ROBOTS[name])
    yield backend
    backend.close()


@pytest.fixture
def platform(build):
    return build(PLATFORM)


def test_every_simulated_backend_is_under_this_contract():
    assert set(BUILDERS) == set(SIMULATED)


def test_it_speaks_for_its_robot(backend):
    assert backend.robot is ROBOTS[backend.robot.name]


def test_a_reset_begins_at_the_given_state(backend):
    episode = episode_of(backend.robot)
    truth, start = backend.reset(episode, seed=1).truth, episode.start.to_rigid()
    for name in ("position_in_world", "quat_xyzw", "velocity_in_world", "angular_velocity_in_body"):
        # A chassis leans by a thousandth on its casters.
        np.testing.assert_allclose(getattr(truth, name), getattr(start, name), rtol=0, atol=2e-3)


def test_samples_have_no_batch_axis_and_hold_float64(backend):
    backend.reset(episode_of(backend.robot), seed=1)
    sample = backend.step(command_of(backend.robot))
    for state in (sample.odometry, sample.truth):
        shapes = [state.position_in_world.shape, state.quat_xyzw.shape, state.velocity_in_world.shape]
        assert shapes == [(3,), (4,), (3,)]
        assert state.angular_velocity_in_body.shape == (3,)
        assert state.position_in_world.dtype == np.float64


def test_odometry_is_near_the_truth(backend):
    backend.reset(episode_of(backend.robot), seed=1)
    sample = backend.step(command_of(backend.robot), 10)
    spec = backend.robot.sensors.odometry
    error = sample.odometry.position_in_world - sample.truth.position_in_world
    assert np.abs(error).max() <= 6.0 * spec.position.std
    turn = sample.odometry.angular_velocity_in_body - sample.truth.angular_velocity_in_body
    assert np.abs(turn).max() <= 6.0 * spec.yaw_rate.std
    measured, true = (q / np.linalg.norm(q) for q in (sample.odometry.quat_xyzw, sample.truth.quat_xyzw))
    assert 2.0 * np.arccos(min(1.0, abs(measured @ true))) <= 6.0 * np.sqrt(3.0) * spec.heading.std + 1e-7


def test_a_star_tracker_reports_at_its_own_rate_where_the_robot_has_one(build):
    stars = StarTrackerSpec(rate_hz=2.0)
    robot = replace(PLATFORM, sensors=replace(PLATFORM.sensors, star_tracker=stars))
    backend = build(robot)
    samples = [backend.reset(episode_of(robot), seed=1)]
    ticks = round(0.1 / robot.timing.physics_dt)
    samples += [backend.step(command_of(robot), ticks) for _ in range(20)]  # every 0.1 s
    seen = [number for number, sample in enumerate(samples) if "star_tracker" in sample.readings]
    assert seen == [0, 5, 10, 15, 20]
    for sample in (samples[number] for number in seen):
        attitude = sample.readings["star_tracker"].value
        np.testing.assert_allclose(attitude, sample.truth.quat_xyzw, rtol=0, atol=1e-12)
    assert "star_tracker" not in build(PLATFORM).reset(episode_of(PLATFORM), seed=1).readings
    backend.close()


def test_ticks_one_by_one_are_ticks_at_once(backend):
    robot = backend.robot
    ticks = robot.timing.substeps(robot.timing.control_hz)
    episode = episode_of(robot, "randomised")
    backend.reset(episode, seed=1)
    at_once = [backend.step(command_of(robot), ticks).truth for _ in range(4)][-1]
    backend.reset(episode, seed=1)
    one_by_one = [backend.step(command_of(robot)).truth for _ in range(4 * ticks)][-1]
    np.testing.assert_allclose(at_once.position_in_world, one_by_one.position_in_world, rtol=0, atol=1e-9)
    np.testing.assert_allclose(at_once.quat_xyzw, one_by_one.quat_xyzw, rtol=0, atol=1e-9)


def test_the_same_seed_gives_the_same_samples_and_a_reset_forgets_everything(backend):
    robot = backend.robot
    episode = episode_of(robot, "randomised")

    def story():
        samples = [backend.reset(episode, seed=4), *(backend.step(command_of(robot), 3) for _ in range(5))]
        return np.array([sample.odometry.position_in_world for sample in samples])

    first = story()
    kind = robot.state_type
    backend.reset(episode_of(robot, start=ELSEWHERE[kind], **PUSHED[kind]), seed=5)
    backend.step(-command_of(robot), 7)
    np.testing.assert_array_equal(first, story())


def test_a_kept_sample_does_not_change_with_later_steps(backend):
    kept = backend.reset(episode_of(backend.robot), seed=1)
    before = kept.truth.position_in_world.copy(), kept.odometry.position_in_world.copy()
    backend.step(command_of(backend.robot), 50)
    np.testing.assert_array_equal(kept.truth.position_in_world, before[0])
    np.testing.assert_array_equal(kept.odometry.position_in_world, before[1])


def test_it_moves_by_commands(backend):
    robot = backend.robot
    command = command_of(robot)
    if robot.actuators.one_way:  # all of them together push nowhere
        command = (robot.actuators.wrench_per_newton[:, 0] > 0.1) * robot.actuators.scale
    begun = backend.reset(episode_of(robot), seed=1).truth
    ticks = round(2.0 / robot.timing.physics_dt)
    after = backend.step(command, ticks).truth
    if robot.actuators.turns_only:
        assert np.linalg.norm(after.angular_velocity_in_body) > 0.01
        return
    assert np.linalg.norm(after.position_in_world - begun.position_in_world) > 0.1


def test_without_a_command_it_stays_or_glides_on(backend):
    if backend.robot.flies:
        level = find_trim(backend.robot, backend.robot.airframe.speed, 50.0).state
        start = [float(part) for part in level.columns()]
        begun = backend.reset(episode_of(backend.robot, start=start), seed=1).truth
        after = backend.step(backend.robot.actuators.safe_command, 100).truth
        went = after.position_in_world - begun.position_in_world
        assert went[0] > 0.5 * backend.robot.airframe.speed
        assert abs(went[2]) < 8.0
        return
    begun = backend.reset(episode_of(backend.robot), seed=1).truth
    after = backend.step(backend.robot.actuators.safe_command, 100).truth
    kind = backend.robot.state_type
    np.testing.assert_allclose(kind.from_rigid(after).pose, kind.from_rigid(begun).pose, atol=1e-3)


def test_closing_twice_does_no_harm(backend):
    backend.reset(episode_of(backend.robot), seed=1)
    backend.close()
    backend.close()


def test_without_thrust_a_platform_glides_on(platform):
    platform.reset(episode_of(PLATFORM, start=(0.0, 0.0, 0.0, 0.1, -0.2, 0.0)), seed=1)
    truth = platform.step(np.zeros(8), 50).truth  # one second
    np.testing.assert_allclose(truth.position_in_world, [0.1, -0.2, 0.0], rtol=0, atol=1e-9)


def test_it_obeys_the_mass_and_the_wrench_of_its_world(platform):
    heavy = episode_of(PLATFORM, mass=10.0, yaw_inertia=0.25, force_x=0.5, torque=0.05)
    platform.reset(heavy, seed=1)
    truth = platform.step(np.zeros(8), 50).truth
    np.testing.assert_allclose(truth.velocity_in_world, [0.05, 0.0, 0.0], rtol=0, atol=1e-9)
    assert truth.angular_velocity_in_body[2] == pytest.approx(0.2, abs=1e-9)


def test_a_planar_robot_stays_in_its_plane(platform):
    platform.reset(episode_of(PLATFORM, force_x=0.1, torque=0.05), seed=1)
    truth = platform.step(command_of(PLATFORM), 50).truth
    np.testing.assert_allclose([truth.position_in_world[2], truth.velocity_in_world[2]], 0.0, atol=1e-12)
    np.testing.assert_allclose([*truth.quat_xyzw[:2], *truth.angular_velocity_in_body[:2]], 0.0, atol=1e-12)


def test_without_thrust_a_spacecraft_glides_and_turns_on(build):
    start = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.1, -0.2, 0.3, 0.0, 0.5, 0.0)
    backend = build(SPACECRAFT)
    backend.reset(episode_of(SPACECRAFT, start=start), seed=1)
    truth = backend.step(np.zeros(16), 25).truth  # one second
    np.testing.assert_allclose(truth.position_in_world, [0.1, -0.2, 0.3], rtol=0, atol=1e-9)
    np.testing.assert_allclose(truth.angular_velocity_in_body, [0.0, 0.5, 0.0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(truth.quat_xyzw, [0.0, np.sin(0.25), 0.0, np.cos(0.25)], rtol=0, atol=1e-6)


def test_a_spacecraft_obeys_the_mass_the_inertia_and_the_wrench_of_its_world(build):
    inertia = (0.25, 0.25, 0.5, 0.0, 0.0, 0.0)
    backend = build(SPACECRAFT)
    heavy = episode_of(
        SPACECRAFT, start=ELSEWHERE[SpatialState], mass=10.0, inertia=inertia, com=(0.0,) * 3,
        force=(0.0, 0.0, 0.5), torque=(0.0, 0.0, 0.05),
    )  # fmt: skip
    backend.reset(heavy, seed=1)
    truth = backend.step(np.zeros(16), 25).truth
    np.testing.assert_allclose(truth.velocity_in_world, [0.0, 0.0, 0.05], rtol=0, atol=1e-9)
    np.testing.assert_allclose(truth.angular_velocity_in_body, [0.0, 0.0, 0.1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", sorted({*BUILDERS} - {"basilisk"}))
def test_an_aircraft_that_tumbles_faster_than_models_of_the_air_hold_for_loses_its_speed(kind):
    robot = ROBOTS["airship_v7"]
    backend = BUILDERS[kind](robot)
    tumbling = [float(part) for part in flying_at(robot, ALOFT).columns()]
    tumbling[SpatialState.COLUMNS.index("wx")] = 40.0
    backend.reset(episode_of(robot, start=tumbling), seed=1)
    for _ in range(5):
        sample = backend.step(command_of(robot))
    backend.close()
    assert np.abs(sample.truth.velocity_in_world).max() < 2.0
