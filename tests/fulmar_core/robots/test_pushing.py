"""A block that is pushed, and the task of pushing it."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.dynamics.by_kind import dynamics_of
from fulmar_core.dynamics.contact import SIDEWAYS, outline_of, push
from fulmar_core.dynamics.things import Thing
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.simulation.trajectories import TargetCounter
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at, offset_to
from fulmar_core.worlds.scenario import load_scenario

TASK = load_task("push_block")
BLOCK = TASK.block
ROBOTS = {name: load_robot(name) for name in config_names("robots")}
MOVED = {name: robot for name, robot in ROBOTS.items() if not robot.flies}
EACH_ROBOT = pytest.mark.parametrize("robot", MOVED.values(), ids=MOVED)
BASE, BOAT, PLATFORM = ROBOTS["turtlebot2"], ROBOTS["kingfisher"], ROBOTS["floating_platform"]


def body(x=0.0, y=0.0, yaw=0.0, vx=0.0, vy=0.0, yaw_rate=0.0):
    return PlanarState(*(np.array([float(value)]) for value in (x, y, yaw, vx, vy, yaw_rate)))


def pushed(before, after, at, *, robot=BASE, block=BLOCK):
    x, y, state = push(before, after, np.array([float(at[0])]), np.array([float(at[1])]), block, robot)
    return np.array([x[0], y[0]]), state


def drive(robot, path, at, block=BLOCK):
    """Push along poses."""
    place = np.array(at, dtype=float)
    for a, b in itertools.pairwise(path):
        place, _ = pushed(body(*a), body(*b), place, robot=robot, block=block)
    return place


def straight(steps, length, yaw=0.0, side=0.0):
    way = np.linspace(0.0, length, steps)
    c, s = np.cos(yaw), np.sin(yaw)
    return [(c * x - s * side, s * x + c * side, yaw) for x in way]


def test_what_is_not_touched_stays():
    place, state = pushed(body(0.0), body(0.1), (1.0, 0.0))
    assert place.tolist() == [1.0, 0.0]
    assert state.vx.tolist() == [0.0]


@EACH_ROBOT
def test_a_block_straight_ahead_ends_up_at_the_robot_s_front(robot):
    place = drive(robot, straight(31, 1.5), (outline_of(robot).extent + 0.3, 0.0))
    outline = outline_of(robot)
    front = outline.ahead + outline.half_length + outline.rounding
    assert place == pytest.approx([1.5 + front + BLOCK.radius, 0.0], abs=1e-6)


@EACH_ROBOT
def test_robot_and_block_never_overlap_after_a_step(robot):
    rng, place = np.random.default_rng(2), np.array([outline_of(robot).extent + 0.2, 0.05])
    pose = np.zeros(3)
    for _ in range(200):
        after = pose + [0.04, 0.0, 0.0] @ np.eye(3) + rng.normal(size=3) * [0.01, 0.01, 0.05]
        place, _ = pushed(body(*pose), body(*after), place, robot=robot)
        c, s = np.cos(after[2]), np.sin(after[2])
        dx, dy = place - after[:2]
        gap = float(outline_of(robot).gap(np.asarray(c * dx + s * dy), np.asarray(c * dy - s * dx)))
        assert gap > BLOCK.radius - 0.005
        pose = after


def test_a_push_off_centre_drives_the_block_aside():
    place = drive(BASE, straight(21, 0.5), (0.4, 0.1))
    assert place[1] > 0.15
    assert drive(BASE, straight(21, 0.5), (0.4, -0.1))[1] == pytest.approx(-place[1], abs=1e-9)


def test_a_rough_contact_drags_a_block_along_and_a_smooth_one_slips():
    # A robot that slides past and presses a little: most of its way is along the contact.
    rough, smooth = (slid_past(grip) for grip in (10.0, 0.0))
    assert smooth == pytest.approx([0.0, 1e-5], abs=1e-6)
    # Where the contact holds, the middle of a disc moves 4/13 of what the contact does: the rest is turning.
    assert rough == pytest.approx([SIDEWAYS * 1e-4, 1e-5], abs=1e-6)


def test_a_contact_that_slips_drags_by_its_friction():
    assert slid_past(0.5) == pytest.approx([0.5 * 1e-5, 1e-5], abs=1e-6)


def slid_past(grip):
    """Way of a block at the left side of a robot that goes 0.1 mm ahead and a tenth of that to the left."""
    reach = BASE.body.radius + BLOCK.radius
    place, _ = pushed(body(), body(1e-4, 1e-5), (0.0, reach), block=replace(BLOCK, grip=grip))
    return place - [0.0, reach]


def test_a_robot_that_turns_on_the_spot_carries_a_touching_block_around():
    reach = BASE.body.radius + BLOCK.radius
    place, _ = pushed(body(), body(yaw=0.2), (reach - 1e-3, 0.0))
    assert place[1] > 0.0
    mirrored, _ = pushed(body(), body(yaw=-0.2), (reach - 1e-3, 0.0))
    assert mirrored[1] == pytest.approx(-place[1], abs=1e-9)


def test_pushing_is_the_same_wherever_and_whichever_way_the_world_is_turned():
    before, after, at = np.array([0.0, 0.0, 0.1]), np.array([0.08, 0.01, 0.15]), np.array([0.32, 0.06])
    first, _ = pushed(body(*before), body(*after), at, robot=BOAT)
    c, s = np.cos(2.0), np.sin(2.0)
    turn = np.array([[c, -s], [s, c]])

    def moved(pose):
        return (*(turn @ pose[:2] + [3.0, -1.0]), pose[2] + 2.0)

    second, _ = pushed(body(*moved(before)), body(*moved(after)), turn @ at + [3.0, -1.0], robot=BOAT)
    np.testing.assert_allclose(second, turn @ first + [3.0, -1.0], rtol=0, atol=1e-9)


def test_a_floating_robot_pays_the_floor_s_work_from_its_speed_and_wheels_hold_theirs():
    reach = PLATFORM.body.radius + BLOCK.radius
    place, state = pushed(body(vx=0.3), body(0.06, vx=0.3), (reach, 0.0), robot=PLATFORM)
    way = place[0] - reach
    work = BLOCK.floor_friction * BLOCK.mass * 9.81 * way
    energy = 0.5 * PLATFORM.body.mass * (0.3**2 - state.vx[0] ** 2)
    assert energy == pytest.approx(work, rel=1e-9)
    poses = {"block": np.array([[BASE.body.radius + 0.15, 0.0, 0.0]])}
    _, base = dynamics_of(BASE).push_things((Thing("block", BLOCK),), poses, body(vx=0.3), body(0.06, vx=0.3))
    assert base.vx.tolist() == [0.3]


def test_a_slow_robot_is_stopped_and_never_thrown_back():
    reach = PLATFORM.body.radius + BLOCK.radius
    _, state = pushed(body(vx=0.01), body(0.002, vx=0.01), (reach - 0.05, 0.0), robot=PLATFORM)
    assert state.vx.tolist() == [0.0]


def test_the_batch_moves_its_blocks_and_a_reset_puts_them_back():
    simulation = BatchSimulation(BASE, TASK, load_scenario("ideal"), worlds=3, seed=1, dtype=np.float64)
    simulation.goal.things["block"][1, :2] += 100.0  # out of reach
    x, y = simulation.truth.x.copy(), simulation.truth.y.copy()
    yaw = np.arctan2(simulation.goal.things["block"][:, 1] - y, simulation.goal.things["block"][:, 0] - x)
    simulation.truth.yaw[:] = yaw
    before = simulation.goal.things["block"].copy()
    for _ in range(80):
        simulation.step(np.tile([0.45, 0.0], (3, 1)))
    moved = np.linalg.norm(simulation.goal.things["block"] - before, axis=1)
    assert moved[0] > 0.5
    assert moved[1] == 0.0
    assert moved[2] > 0.5
    kept = simulation.goal.things["block"].copy()
    simulation.reset([0])
    np.testing.assert_array_equal(simulation.goal.things["block"][1:], kept[1:])
    assert np.linalg.norm(
        simulation.goal.things["block"][0, :2] - simulation.goal.targets[0, 0, :2]
    ) == pytest.approx(1.0)


@EACH_ROBOT
@pytest.mark.parametrize("training", [False, True])
def test_nothing_touches_at_the_start_and_distances_are_as_the_task_says(robot, training):
    n = 500
    start, goal = TASK.draw(Draws(4, np.arange(n), np.zeros(n)), robot, training=training)
    dx, dy = offset_to(start, goal.things["block"])
    c, s = np.cos(start.yaw), np.sin(start.yaw)
    assert np.all(outline_of(robot).gap(c * dx + s * dy, c * dy - s * dx) > BLOCK.radius)
    low, high = TASK.training_block_distance if training else TASK.block_distance
    distance = TASK.errors(start, goal).position
    assert low - 1e-9 <= distance.min()
    assert distance.max() <= high + 1e-9
    if robot is BASE:
        away = np.hypot(dx, dy)
        assert TASK.start_distance[0] <= away.min()
        assert away.max() <= TASK.start_distance[1]


def test_names_state_what_is_in_the_columns():
    goal = goal_at((3.0, 1.0, 0.0)).among({"block": np.array([2.0, 1.0, 0.0])})
    state = PlanarState(*(np.asarray(v) for v in (2.0, 0.0, np.pi / 2, 0.0, 0.3, 0.1)))
    seen = {name: float(v) for name, v in zip(TASK.observation_names, TASK.observe(state, goal), strict=True)}
    assert seen == pytest.approx(
        {
            "block_direction_x_in_body": 1.0,
            "block_direction_y_in_body": 0.0,
            "block_distance": 1.0,
            "place_direction_x_in_body": np.sqrt(0.5),
            "place_direction_y_in_body": -np.sqrt(0.5),
            "block_to_place_distance": 1.0,
            "velocity_x_in_body": 0.3,
            "velocity_y_in_body": 0.0,
            "yaw_rate": 0.1,
            "fine_block_to_place_x_in_body": 0.0,
            "fine_block_to_place_y_in_body": -1.0,
            "behind_block": 0.0,
            "beside_block": -1.0,
        },
        abs=1e-12,
    )


def at(block, place=(0.0, 0.0)):
    return goal_at((*place, 0.0)).among({"block": np.array([*block, 0.0])})


def test_pushing_the_block_home_pays_and_pushing_it_away_costs():
    robot = body(2.0)
    home, nearer, there, away = (
        float(TASK.reward(robot, robot, at((1.0, 0.0)), at((x, 0.0)))[0]) for x in (0.05, 0.9, 1.0, 1.1)
    )
    assert home > nearer > there > away


def test_going_behind_the_block_pays_more_than_going_in_front_of_it():
    goal, start = at((1.0, 0.0)), body(1.0, 1.0)
    behind, ahead = (float(TASK.reward(start, body(x, 1.0), goal, goal)[0]) for x in (1.2, 0.8))
    assert behind > ahead


@pytest.mark.parametrize(
    ("x", "y", "behind", "beside"), [(2.0, 0.0, 1.0, 0.0), (0.0, 0.0, -1.0, 0.0), (1.0, 1.0, 0.0, -1.0)]
)
def test_a_robot_sees_whether_it_stands_behind_the_block_or_beside_it(x, y, behind, beside):
    seen = dict(zip(TASK.observation_names, TASK.observe(body(x, y, yaw=0.6), at((1.0, 0.0))), strict=True))
    assert (seen["behind_block"][0], seen["beside_block"][0]) == pytest.approx((behind, beside), abs=1e-12)


def test_a_target_counter_takes_the_pose_of_the_block():
    counter = TargetCounter(TASK, at((1.0, 0.0)), 0.1)
    moved = counter.update(body(), {"block": np.array([0.05, 0.0, 0.0])})
    assert float(TASK.errors(body(), moved).position) == pytest.approx(0.05)
    assert counter.update(body()).things["block"].tolist() == [0.05, 0.0, 0.0]


def test_blocks_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="must be greater than 0"):
        replace(BLOCK, mass=0.0)
    with pytest.raises(ValueError, match="distances must be"):
        replace(TASK, block_distance=(2.0, 1.0))
