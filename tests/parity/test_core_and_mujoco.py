"""The core's dynamics and MuJoCo's: two implementations, one motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.loop.rollout import roll_out_in_backends, roll_out_in_batch
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import Episode, draw_episode
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_core.tasks.observation import slewed
from fulmar_core.worlds.parts import Actuation
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from tests.new_robots import new_robot
from tests.spaces import SPACECRAFT, task_for

mujoco = pytest.importorskip("mujoco")

from sim_nodes.mujoco_backend import MujocoBackend  # noqa: E402

PLATFORM = load_robot("floating_platform")
FLYER = load_robot("modular_freeflyer")
BOAT = load_robot("kingfisher")
FANS = new_robot("fan_disc")
POSE, IDEAL = load_task("go_to_pose"), load_scenario("ideal")
TWO_PI = 2.0 * np.pi
ODOMETRY = {PlanarState: ("x", "vy", "yaw_rate"), SpatialState: SpatialState.COLUMNS}


def world_of(robot, **changes):
    """The nominal body in a still world, but for some numbers."""
    world = draw_episode(robot, POSE, IDEAL, seed=0, number=0).world
    return replace(world, **{name: np.asarray(value) for name, value in changes.items()})


def episode_of(robot, *, moving=False, **changes):
    motion = (0.1, -0.05, 0.2) if moving else (0.0, 0.0, 0.0)
    start = PlanarState(*(np.asarray(value) for value in (0.3, -0.2, 0.8, *motion)))
    return Episode(start, goal_at((0.0, 0.0, 0.0)), world_of(robot, **changes))


def drive(robot, episode, command_at, seconds):
    """Paths of the core and of MuJoCo under the same commands, arrays of (x, y, yaw, ahead, left, turn rate)."""
    backends = MockBackend(robot), MujocoBackend(robot, sensor_noise=False)
    for backend in backends:
        backend.reset(episode, seed=0)
    substeps = robot.timing.substeps(robot.timing.control_hz)
    dt = substeps * robot.timing.physics_dt
    command, paths = robot.actuators.safe_command, ([], [])
    for k in range(round(seconds / dt)):
        wanted = robot.actuators.limited(np.asarray(command_at(k * dt), dtype=float))
        command = slewed(wanted, command, robot, dt)
        for backend, path in zip(backends, paths, strict=True):
            state = PlanarState.from_rigid(backend.step(command, substeps).truth)
            path.append([state.x, state.y, state.yaw, *state.velocity_in_body, state.yaw_rate])
    return tuple(np.array(path) for path in paths)


def turned(ours, theirs):
    """Difference of the last headings [rad]."""
    return abs((theirs[-1, 2] - ours[-1, 2] + np.pi) % TWO_PI - np.pi)


PUSH = {"force_x": 0.05, "force_y": -0.03, "torque": 0.004}
WEAR = {"gain": np.linspace(0.8, 1.0, 8), "alive": np.array([1.0] * 7 + [0.0])}


@pytest.mark.parametrize("robot", [PLATFORM, FLYER, FANS], ids=lambda robot: robot.name)
@pytest.mark.parametrize("changes", [{}, {"mass": 5.0} | PUSH, WEAR], ids=["calm", "pushed", "worn"])
def test_robots_with_thrusters_or_fans_move_alike_to_rounding(robot, changes):
    count = len(robot.actuators.names)
    changes = changes | {name: changes[name][-count:] for name in WEAR if name in changes}
    commands = np.random.default_rng(6).uniform(size=(101, count))
    ours, theirs = drive(
        robot, episode_of(robot, moving=True, **changes), lambda t: commands[round(5 * t)], 20.0
    )
    # Same integrator: what remains is rounding, grown over 1,000 physics steps on values of up to some metres.
    np.testing.assert_allclose(theirs[:, [0, 1, 3, 4, 5]], ours[:, [0, 1, 3, 4, 5]], rtol=0, atol=1e-8)
    assert turned(ours, theirs) < 1e-8
    assert np.hypot(*(ours[-1, :2] - ours[0, :2])) > 0.1  # it did move


def test_a_centre_of_mass_beside_the_origin_bends_the_path_alike():
    def ahead(_t):
        return [1.0, 0, 0, 0, 0, 0, 0, 1.0]

    ours, theirs = drive(PLATFORM, episode_of(PLATFORM, com_x=0.0, com_y=0.02), ahead, 10.0)
    straight, _ = drive(PLATFORM, episode_of(PLATFORM), ahead, 10.0)
    # MuJoCo integrates the motion of the origin, the core that of the centre of mass.
    np.testing.assert_allclose(theirs[:, :2], ours[:, :2], rtol=0, atol=0.01)
    assert np.hypot(*(ours[-1, :2] - straight[-1, :2])) > 0.5


WAYS_TO_SWIM = {
    "ahead": lambda t: (0.7, 0.7),
    "astern": lambda t: (-0.9, -0.9),
    "circle": lambda t: (0.8, 0.3),
    "turn on the spot": lambda t: (-0.9, 0.5),
    "mixed": lambda t: (np.sin(0.4 * t), np.cos(0.7 * t)),
}
HEAVY_WATER = replace(
    BOAT, hydrodynamics=replace(BOAT.hydrodynamics, added_mass=(4.0, 20.0, 25.0, 1.0, 2.0, 3.0))
)


@pytest.mark.parametrize("way", WAYS_TO_SWIM)
@pytest.mark.parametrize("robot", [BOAT, HEAVY_WATER], ids=["as it is", "with added mass"])
def test_the_boat_surges_and_turns_alike_within_half_a_per_cent(robot, way):
    ours, theirs = drive(robot, episode_of(robot), WAYS_TO_SWIM[way], 20.0)
    length = np.hypot(*np.diff(ours[:, :2], axis=0).T).sum()
    np.testing.assert_allclose(theirs[:, :2], ours[:, :2], rtol=0, atol=0.005 * max(length, 1.0))
    np.testing.assert_allclose(
        theirs[:, 3], ours[:, 3], rtol=0, atol=0.005 * max(0.2, np.abs(ours[:, 3]).max())
    )
    np.testing.assert_allclose(
        theirs[:, 5], ours[:, 5], rtol=0, atol=0.005 * max(0.1, np.abs(ours[:, 5]).max())
    )


WAYS_TO_DRIVE = {  # shares of the largest command
    "straight": lambda t: (0.6, 0.0),
    "arc": lambda t: (0.3, 0.3),
    "back": lambda t: (-0.4, 0.4),
    "slalom": lambda t: (0.4, 0.4 * np.sin(1.5 * t)),
    "mixed": lambda t: (0.4 * np.sin(0.8 * t), 0.5 * np.cos(1.3 * t)),
}


@pytest.mark.parametrize("way", WAYS_TO_DRIVE)
@pytest.mark.parametrize("name", ["turtlebot2", "jetbot", "leatherback"])
def test_robots_on_wheels_drive_alike_within_a_few_per_cent_of_the_way(name, way):
    robot = load_robot(name)
    assert isinstance(robot.actuators, Rolling)
    share = 0.4 if name == "leatherback" else 1.0  # at 3.6 m/s it would slide
    scale = robot.actuators.scale * (share, 1.0)
    ours, theirs = drive(robot, episode_of(robot), lambda t: np.array(WAYS_TO_DRIVE[way](t)) * scale, 5.0)
    dt = 1.0 / robot.timing.control_hz
    length, angle = np.abs(ours[:, 3]).sum() * dt, np.abs(ours[:, 5]).sum() * dt
    # Tyres creep a little under load, and servos take a moment that the core's model does not have.
    assert np.hypot(*(theirs[-1, :2] - ours[-1, :2])) < 0.01 + 0.02 * length
    assert np.degrees(turned(ours, theirs)) < 1.0 + 0.015 * np.degrees(angle)


class Swaying:
    """Commands that depend on the episode alone, so that every simulator gets the same ones."""

    name, estimator = "swaying", None
    readings, observer = (), None

    def __init__(self, robot):
        self.robot, self.control_hz = robot, robot.timing.control_hz
        self.k = 0

    def reset(self):
        self.k = 0

    def act(self, inputs):
        self.k += 1
        n = np.arange(len(self.robot.actuators.names))
        episodes = np.arange(len(inputs.previous))[:, None]
        return np.sin(0.5 * self.k / self.control_hz + 1.3 * n + 0.3 * episodes) * self.robot.actuators.scale


EVERY_ROBOT = [
    name
    for name in config_names("robots")
    if name != "floating_platform_roboran"  # the platform with other numbers
]


@pytest.mark.parametrize("name", [name for name in EVERY_ROBOT if not load_robot(name).flies])
def test_failures_noise_delays_and_pushes_are_the_batch_s_own_in_every_backend(name):
    """The mock moves as the batch does, so any difference would be one of actuators, pushes or counters."""
    robot = load_robot(name)
    task = replace(task_for(robot, "go_to_position"), episode_s=12.0)
    given = {"robot": robot, "task": task, "scenario": load_scenario("randomised"), "episodes": 5, "seed": 3}
    batch = roll_out_in_batch(Swaying(robot), **given)
    del given["robot"]
    mock = roll_out_in_backends(Swaying(robot), lambda: MockBackend(robot), **given)
    # The batch is float32: rounding, grown over 12 s of spinning.
    np.testing.assert_allclose(mock.position_error, batch.position_error, rtol=0, atol=2e-3)


@pytest.mark.parametrize(
    ("name", "atol"),
    [
        ("floating_platform", 0.02),
        ("kingfisher", 0.01),
        ("turtlebot2", 0.1),
        ("jetbot", 0.2),
        ("spacecraft_16", 5e-3),
    ],
)
def test_mujoco_moves_under_every_disturbance_as_the_batch_does(name, atol):
    robot = load_robot(name)
    task = replace(task_for(robot, "go_to_position"), episode_s=8.0)
    given = {"task": task, "scenario": load_scenario("randomised"), "episodes": 5, "seed": 3}
    batch = roll_out_in_batch(Swaying(robot), robot, **given)
    ours = roll_out_in_backends(Swaying(robot), lambda: MujocoBackend(robot), **given)
    np.testing.assert_allclose(ours.position_error, batch.position_error, rtol=0, atol=atol)


OF_DRIFT = [name for name in config_names("scenarios") if name.startswith(("drift_", "lab_"))]


class Bursts(Swaying):
    """Two or three valves at a time, others from second to second."""

    def act(self, inputs):
        self.k += 1
        rng = np.random.default_rng(self.k // 5)
        return (rng.uniform(size=(len(inputs.previous), 8)) > 0.7).astype(float)


@pytest.mark.parametrize("scenario", OF_DRIFT)
def test_mujoco_moves_under_each_disturbance_of_drift_as_the_batch_does(scenario):
    task = replace(load_task("drift_go_to_pose"), episode_s=20.0)
    given = {"task": task, "scenario": load_scenario(scenario), "episodes": 4, "seed": 3}
    batch = roll_out_in_batch(Bursts(PLATFORM), PLATFORM, **given)
    ours = roll_out_in_backends(
        Bursts(PLATFORM), lambda: MujocoBackend.of(PLATFORM, task, given["scenario"]), **given
    )
    # The batch is float32: rounding, grown over 20 s of spinning.
    np.testing.assert_allclose(ours.position_error, batch.position_error, rtol=0, atol=5e-3)
    np.testing.assert_allclose(np.sin(ours.heading_error - batch.heading_error), 0.0, atol=5e-3)
    assert np.ptp(batch.position_error, axis=1).min() > 0.1  # they did move


def test_valves_that_open_by_degrees_do_not_suck_in_mujoco_either():
    robot, task = load_robot("modular_freeflyer"), replace(load_task("go_to_position"), episode_s=8.0)
    noisy = replace(load_scenario("ideal"), actuation=Actuation(noise=0.05, least_noise=1.0))
    given = {"task": task, "scenario": noisy, "episodes": 4, "seed": 3}
    batch = roll_out_in_batch(Closed(robot), robot, **given)
    ours = roll_out_in_backends(Closed(robot), lambda: MujocoBackend(robot), **given)
    np.testing.assert_allclose(ours.position_error, batch.position_error, rtol=0, atol=5e-3)
    assert np.ptp(batch.position_error, axis=1).min() > 1e-3  # the noise did move them


class Closed(Swaying):
    """Every valve closed."""

    def act(self, inputs):
        return np.zeros((len(inputs.previous), len(self.robot.actuators.names)))


@pytest.mark.parametrize("robot", [PLATFORM, SPACECRAFT], ids=lambda robot: robot.name)
@pytest.mark.parametrize("scenario", ["nominal", "randomised", "drift_velocity_noise_4", "lab_mocap"])
def test_odometry_errs_in_mujoco_as_in_the_batch_number_by_number(scenario, robot):
    scenario, task, kind = load_scenario(scenario), task_for(robot, "go_to_pose"), robot.state_type
    simulation = BatchSimulation(robot, task, scenario, worlds=3, seed=4, dtype=np.float64)
    backends = [MujocoBackend.of(robot, task, scenario) for _ in range(3)]
    samples = [
        backend.reset(draw_episode(robot, task, scenario, seed=4, number=i), seed=4, number=i)
        for i, backend in enumerate(backends)
    ]
    for _ in range(20):
        for i, sample in enumerate(samples):
            measured = kind.from_rigid(sample.odometry)
            for name in ODOMETRY[kind]:
                expected = getattr(simulation.measured, name)[i]
                assert getattr(measured, name) == pytest.approx(expected, abs=1e-3), name
        closed = np.zeros_like(simulation.command)
        simulation.step(closed)
        samples = [backend.step(closed[0], simulation.substeps) for backend in backends]


class Reflex(Swaying):
    """Commands that depend on what is seen alone."""

    def act(self, inputs):
        return (inputs.observation[:, : len(self.robot.actuators.names)] > 0.0).astype(float)


def test_more_episodes_than_simulators_are_run_in_turns(monkeypatch):
    from fulmar_core.loop import rollout

    task, scenario = replace(POSE, episode_s=2.0), load_scenario("nominal")
    seen = []

    def run(side_by_side):
        monkeypatch.setattr(rollout, "SIDE_BY_SIDE", side_by_side)
        return roll_out_in_backends(
            Reflex(PLATFORM),
            lambda: MujocoBackend(PLATFORM),
            task,
            scenario,
            episodes=5,
            seed=3,
            progress=seen.append,
        )

    np.testing.assert_array_equal(run(2).position_error, run(5).position_error)
    assert seen == sorted(seen[:30]) + sorted(seen[30:])
    assert seen[-1] == 50  # 5 episodes of 10 steps
