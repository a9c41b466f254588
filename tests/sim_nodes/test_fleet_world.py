"""Robots in one MuJoCo world: alone as in a world of their own, together they touch, and none waits for ever."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.hull_distance import hull_distance
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.fleet_world import FleetWorld, Member
from sim_nodes.mujoco_backend import MujocoBackend

TYPES = {"alpha": "floating_platform", "boat": "kingfisher", "base": "turtlebot2"}
PLACES = {"alpha": (0.0, 0.0), "boat": (8.0, 0.0), "base": (0.0, 8.0)}
STEPS, TICKS = 40, 5


def members(types=TYPES, task="go_to_position"):
    return {
        name: Member(load_robot(robot), load_task(task), load_scenario("ideal"))
        for name, robot in types.items()
    }


def episode_of(member, place, speed=0.0):
    drawn = draw_episode(member.robot, member.task, member.scenario, seed=1, number=0)
    zero = np.zeros(())
    start = replace(
        drawn.start,
        x=np.array(place[0]),
        y=np.array(place[1]),
        yaw=zero,
        vx=np.array(speed),
        vy=zero,
        yaw_rate=zero,
    )
    return replace(drawn, start=start)


def commands_of(robot):
    draws = np.random.default_rng(4)
    count = len(robot.actuators.names)
    return [robot.actuators.limited(draws.uniform(-1.0, 1.0, (1, count)))[0] for _ in range(STEPS)]


def side_by_side(world: FleetWorld, drive: Callable[[str], None]) -> None:
    threads = [threading.Thread(target=drive, args=(name,), daemon=True) for name in world.robots]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30.0)
    assert not any(thread.is_alive() for thread in threads)


def positions(types=TYPES, places=PLACES, speeds=None, ticks=None):
    """True positions of each robot after each step, shape (steps, 3), in lock step."""
    known = members(types)
    world, found = FleetWorld(known, lockstep=True), {}

    def drive(name):
        robot = world.robots[name]
        robot.reset(episode_of(known[name], places[name], (speeds or {}).get(name, 0.0)), seed=1)
        path = []
        for command in (
            commands_of(robot.robot) if speeds is None else [robot.robot.actuators.safe_command] * STEPS
        ):
            sample = robot.step(np.array(command), (ticks or {}).get(name, TICKS))
            path.append(sample.truth.position_in_world)
        robot.make_safe()
        found[name] = np.array(path)

    side_by_side(world, drive)
    return found


def test_a_robot_moves_in_the_world_of_all_as_in_one_of_its_own():
    together = positions()
    for name, member in members().items():
        alone = MujocoBackend.of(member.robot, member.task, member.scenario)
        alone.reset(episode_of(member, PLACES[name]), seed=1)
        path = [alone.step(command, TICKS).truth.position_in_world for command in commands_of(member.robot)]
        np.testing.assert_allclose(together[name], path, atol=2e-3)


def test_lock_step_gives_the_same_bytes_twice_whatever_the_threads_do():
    first, again = positions(), positions()
    assert {name: path.tobytes() for name, path in first.items()} == {
        name: path.tobytes() for name, path in again.items()
    }


def test_robots_of_two_control_rates_share_a_world():
    found = positions(ticks={"alpha": 10})
    assert {len(path) for path in found.values()} == {STEPS}


def test_a_robot_that_runs_into_another_one_pushes_it():
    types = {"alpha": "floating_platform", "beta": "floating_platform"}
    found = positions(types, {"alpha": (0.0, 0.0), "beta": (1.0, 0.0)}, speeds={"alpha": 0.5})
    assert found["beta"][-1, 0] > 1.3
    poses = [np.column_stack((found[name][:, :2], np.zeros(STEPS))) for name in types]
    robot = load_robot("floating_platform")
    assert hull_distance(robot, poses[0], robot, poses[1]).min() > -0.02  # a stiff contact, no passage


def test_a_robot_that_leaves_rests_and_the_others_go_on():
    known = members()
    world, counts = FleetWorld(known, lockstep=True), {}

    def drive(name):
        robot = world.robots[name]
        robot.reset(episode_of(known[name], PLACES[name]), seed=1)
        steps = 3 if name == "alpha" else STEPS
        for command in commands_of(robot.robot)[:steps]:
            robot.step(command, TICKS)
        robot.make_safe()
        counts[name] = steps

    side_by_side(world, drive)
    assert world.ticks == STEPS * TICKS


def test_by_the_clock_a_robot_that_hangs_holds_no_other_up():
    known = members({"alpha": "floating_platform", "beta": "floating_platform"})
    world = FleetWorld(known, lockstep=False)
    places, hangs = {"alpha": (0.0, 0.0), "beta": (3.0, 0.0)}, threading.Event()

    def drive(name):
        robot = world.robots[name]
        robot.reset(episode_of(known[name], places[name]), seed=1)
        if name == "alpha":
            assert hangs.wait(20.0)
            robot.make_safe()
            return
        for command in commands_of(robot.robot):
            robot.step(command)
        hangs.set()

    side_by_side(world, drive)
    assert world.ticks >= STEPS


def late_pair():
    """A world by the clock in which `beta` always comes after the world has gone on without it."""
    known = members({"alpha": "floating_platform", "beta": "floating_platform"})
    world = FleetWorld(known, lockstep=False, rate=20.0)
    places = {"alpha": (0.0, 0.0), "beta": (3.0, 0.0)}
    world.begin_all({name: episode_of(known[name], place, 0.1) for name, place in places.items()}, seed=1)
    return world


def test_by_the_clock_robots_that_never_come_together_tick_the_world_once_a_tick_of_theirs():
    world, rest = late_pair(), np.zeros(8)
    paths = {name: [world.robots[name].sample().truth] for name in world.robots}
    for _ in range(STEPS):
        for name, path in paths.items():
            sample = world.robots[name].step(rest)
            assert sample.more_ticks == 0
            path.append(sample.truth)
    assert world.ticks == STEPS
    for path in paths.values():
        moved = path[-1].position_in_world - path[0].position_in_world
        np.testing.assert_allclose(moved, STEPS * world.tick_s * path[-1].velocity_in_world, atol=1e-6)


def test_by_the_clock_a_robot_that_missed_ticks_has_the_time_of_the_others_again():
    world, rest = late_pair(), np.zeros(8)
    assert world.robots["alpha"].step(rest).more_ticks == 0
    before = world.robots["beta"].step(rest).truth.position_in_world[0]
    for _ in range(5):
        world.robots["alpha"].step(rest)
    late = world.robots["beta"].step(rest)
    assert (world.ticks, late.more_ticks) == (6, 4)
    moved = late.truth.position_in_world[0] - before
    np.testing.assert_allclose(moved, 5 * world.tick_s * late.truth.velocity_in_world[0], atol=1e-6)
    assert world.robots["beta"].step(rest).more_ticks == 0
    assert world.ticks == 7
    world.robots["beta"].make_safe()
    for _ in range(3):
        world.robots["alpha"].step(rest)
    known = members({"beta": "floating_platform"})["beta"]
    assert world.robots["beta"].reset(episode_of(known, (3.0, 0.0)), seed=1).more_ticks == world.ticks - 7


def test_a_robot_knows_where_the_others_are():
    known = members({"alpha": "floating_platform", "beta": "floating_platform"})
    world, seen = FleetWorld(known, lockstep=True), {}
    places, speeds = {"alpha": (0.0, 0.0), "beta": (3.0, 1.0)}, {"alpha": 0.0, "beta": 0.2}

    def drive(name):
        robot = world.robots[name]
        seen[name] = robot.reset(episode_of(known[name], places[name], speeds[name]), seed=1).neighbours
        robot.make_safe()

    side_by_side(world, drive)
    np.testing.assert_allclose(seen["alpha"]["beta"], (3.0, 1.0, 0.2, 0.0, 1.0), atol=1e-6)
    assert set(seen["beta"]) == {"alpha"}


def test_a_robot_knows_whether_another_one_is_driven():
    known = members({"alpha": "floating_platform", "beta": "floating_platform"})
    world = FleetWorld(known, lockstep=True)
    episodes = {name: episode_of(known[name], (x, 0.0)) for name, x in (("alpha", 0.0), ("beta", 3.0))}
    world.begin_all(episodes, seed=1)
    rest = {name: np.zeros(8) for name in known}
    assert world.step_all(rest, 10)["alpha"].neighbours["beta"][4] == 1.0
    world.robots["beta"].is_driven = lambda: False  # its plant applies what is safe
    assert world.step_all(rest, 10)["alpha"].neighbours["beta"][4] == 0.0
    world.robots["beta"].is_driven = lambda: True
    world.robots["beta"].make_safe()  # and goes on no more
    assert world.step_all({"alpha": rest["alpha"]}, 10)["alpha"].neighbours["beta"][4] == 0.0


@pytest.mark.parametrize(
    ("types", "words"),
    [
        ({"a": "floating_platform", "b": "spacecraft_16"}, "moves in space"),
        ({"a": "floating_platform", "b": "navion"}, "moves in space"),
    ],
)
def test_robots_of_two_worlds_are_refused(types, words):
    tasks = {"spacecraft_16": "go_to_pose_3d", "navion": "fly_hold"}
    known = {
        name: Member(load_robot(robot), load_task(tasks.get(robot, "go_to_pose")), load_scenario("ideal"))
        for name, robot in types.items()
    }
    with pytest.raises(ConfigError, match=words):
        FleetWorld(known, lockstep=True)


def test_a_task_with_obstacles_is_refused():
    with pytest.raises(ConfigError, match="brings obstacles"):
        FleetWorld(members(task="go_to_position_with_obstacles"), lockstep=True)
