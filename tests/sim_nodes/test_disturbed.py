"""Simulators of every kind of robot, disturbed while they run."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.disturbances import read_disturbance
from fulmar_core.simulation.disturbed import Disturbed
from fulmar_ros.plant_settings import PlantSettings, first_episode
from sim_nodes.sim_node import make_backend

PLATFORM, BOAT, CRAFT, SATELLITE, AIRCRAFT = (
    ("floating_platform", "go_to_pose", (0.0, 0.0, 0.0)),
    ("kingfisher", "go_to_position", (0.0, 0.0, 0.0)),
    ("cubesat_8", "go_to_pose_3d", (0.0,) * 6),
    ("smallsat", "point", (0.0,) * 6),
    ("navion", "fly_hold", (0.0, 0.0, 100.0, 0.0, 0.0, 0.0)),
)
ALL = (PLATFORM, BOAT, CRAFT, SATELLITE, AIRCRAFT)
every_kind = pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind[0])
both = pytest.mark.parametrize("backend", ["mock", "mujoco"])


def run(kind, backend, *requests, ticks=20, command=None):
    """Samples of a run under disturbances, and the simulator."""
    name, task, start = kind
    robot = load_robot(name)
    settings = PlantSettings(robot=name, task=task, backend=backend, start=start)
    simulator = make_backend(robot, settings)
    assert isinstance(simulator, Disturbed)
    episode = first_episode(robot, settings)
    samples = [simulator.reset(episode, seed=3)]
    for request in requests:
        simulator.disturb(read_disturbance(request, robot))
    steady = robot.actuators.safe_command if episode.command is None else episode.command
    given = np.array(steady, dtype=float)
    if command is not None:
        given[0] = command * robot.actuators.scale[0]
    samples += [simulator.step(given) for _ in range(ticks)]
    return samples, simulator


def places(samples):
    return np.array([[*s.truth.position_in_world, *s.truth.quat_xyzw] for s in samples])


@both
@pytest.mark.parametrize("kind", [PLATFORM, BOAT, CRAFT, AIRCRAFT], ids=lambda kind: kind[0])
def test_a_push_moves_the_robot_along_its_force(kind, backend):
    calm, pushed = (run(kind, backend, *requests)[0] for requests in ((), ({"what": "push"},)))
    moved = places(pushed)[-1] - places(calm)[-1]
    assert moved[0] > 1e-4
    assert abs(moved[1]) < 0.1 * moved[0]


@both
@every_kind
def test_a_dead_actuator_moves_nothing(kind, backend):
    dead = {"what": "dead", "actuator": load_robot(kind[0]).actuators.names[0]}
    still, without = run(kind, backend, command=0.0)[0], run(kind, backend, dead, command=1.0)[0]
    with_it = run(kind, backend, command=1.0)[0]
    np.testing.assert_array_equal(places(without), places(still))
    assert np.abs(places(without)[-1] - places(with_it)[-1]).max() > 1e-6


@both
@every_kind
def test_noise_is_seen_in_the_odometry_and_not_in_the_truth(kind, backend):
    calm = run(kind, backend)[0]
    noisy = run(kind, backend, {"what": "noise", "position_m": 0.5, "heading_deg": 10.0})[0]
    np.testing.assert_array_equal(places(noisy), places(calm))
    errors = [
        np.abs(np.subtract(a.odometry.quat_xyzw, b.odometry.quat_xyzw)).max()
        for a, b in zip(noisy[1:], calm[1:], strict=True)
    ]
    assert max(errors) > 1e-3


@both
@every_kind
def test_a_simulation_without_disturbances_and_one_that_was_cleared_are_the_same_to_the_bit(kind, backend):
    plain, _ = run(kind, backend)
    cleared, _ = run(kind, backend, {"what": "noise"}, {"what": "clear"})
    np.testing.assert_array_equal(places(cleared), places(plain))


@every_kind
def test_the_same_disturbances_at_the_same_steps_give_the_same_run_to_the_bit(kind):
    asked = {"what": "noise", "seconds": 0.05}, {"what": "stuck", "at": 1.0, "seconds": 0.05}
    first, second = (run(kind, "mock", *asked)[0] for _ in range(2))
    np.testing.assert_array_equal(places(first), places(second))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.odometry.quat_xyzw, b.odometry.quat_xyzw)


def test_a_push_ends_after_its_time():
    samples, simulator = run(PLATFORM, "mock", {"what": "push", "seconds": 0.1}, ticks=20)
    speeds = [sample.truth.velocity_in_world[0] for sample in samples]
    assert simulator.names == ()
    assert speeds[5] > speeds[1]
    np.testing.assert_allclose(np.diff(speeds[6:]), 0.0, atol=1e-3)


class Rigid:
    """A simulator that knows of no pushes, as that of JSBSim."""

    def __init__(self, robot):
        self.robot = robot


def test_a_simulator_that_cannot_push_says_so():
    simulator = Disturbed(Rigid(load_robot("navion")))
    with pytest.raises(ConfigError, match=r"cannot push .navion.\. Use --backend mujoco or mock"):
        simulator.disturb(read_disturbance({"what": "push"}, simulator.robot))
    assert simulator.names == ()


@both
def test_wheels_hold_a_robot_against_a_light_push_and_slide_under_a_strong_one(backend):
    kind = ("turtlebot2", "go_to_position", (0.0, 0.0, 0.0))
    light, strong = (
        run(kind, backend, {"what": "push", "force_n": [force, 0.0]}, ticks=50)[0] for force in (5.0, 80.0)
    )
    assert abs(places(light)[-1][0]) < 0.02
    assert places(strong)[-1][0] > 0.1


def test_an_episode_begins_undisturbed():
    _, simulator = run(PLATFORM, "mock", {"what": "dead"}, {"what": "push"}, ticks=1)
    settings = PlantSettings(robot="floating_platform", task="go_to_pose", backend="mock")
    simulator.reset(first_episode(simulator.robot, settings), seed=0)
    assert simulator.names == ()
