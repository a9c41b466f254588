"""What every task promises, with every robot."""

from __future__ import annotations

import json
from dataclasses import asdict, fields, replace
from typing import get_args

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.dynamics.by_kind import dynamics_of
from fulmar_core.dynamics.contact import outline_of
from fulmar_core.robots.topics import GOAL_WIRES
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import normalised, plus, product, turn
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState, position_of, quat_of
from fulmar_core.states.state import POSE, TWIST
from fulmar_core.tasks import ShippedTask, load_task
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from tests.new_robots import robots_of_every_family
from tests.pairs import each_pair
from tests.spaces import at_target

TASKS = {name: load_task(name) for name in config_names("tasks")}
ROBOTS = robots_of_every_family()
RANDOMISED = load_scenario("randomised")
EACH_PAIR, EACH_TASK = each_pair(ROBOTS, TASKS), pytest.mark.parametrize("task", TASKS.values(), ids=TASKS)
COUNT = 50
QUAT = ("qx", "qy", "qz", "qw")


def draw(task, robot, *, training=False, count=COUNT):
    return task.draw(Draws(2, np.arange(count), np.zeros(count)), robot, training=training)


def on_the_way(task, robot):
    """States and goals as they come along in an episode: some way off the start, with some targets done."""
    start, goal = draw(task, robot)
    rng = np.random.default_rng(3)
    state = start.mapped(lambda column: column + rng.normal(size=COUNT))
    if isinstance(state, SpatialState):
        state = replace(state, **dict(zip(QUAT, normalised(state.quat), strict=True)))
    done = rng.integers(0, goal.targets.shape[1], COUNT).astype(float)
    return start, state, replace(goal, done=done)


def cast(value, convert):
    return value.mapped(convert)


def test_every_kind_of_task_has_a_file():
    assert {type(task) for task in TASKS.values()} == set(get_args(ShippedTask))


@EACH_PAIR
@pytest.mark.parametrize("training", [False, True])
def test_what_is_drawn_is_finite_at_rest_and_within_the_geofence(task, robot, training):
    start, goal = draw(task, robot, training=training, count=300)
    for value in (*start.columns(), *goal.arrays()):
        assert value.dtype == np.float64
        assert np.isfinite(value).all()
    assert type(start) is task.state_type
    rigid = TWIST if task.goal_topic == "goal_velocity" else POSE
    numbers = task.state_type.targets_of(np.ones(rigid)).size
    assert goal.targets.shape == (300, goal.targets.shape[1], numbers)
    assert goal.obstacles.shape[0] == 300
    assert goal.obstacles.shape[2] >= 3
    assert goal.done.shape == (300,)
    assert {pose.shape for pose in goal.things.values()} <= {(300, numbers)}
    assert {thing.name for thing in task.things} <= set(goal.things)
    still = zip(start.columns(), start.stopped().columns(), strict=True)
    assert not robot.kind.stays or all(np.array_equal(*pair) for pair in still)
    errors = task.errors(start, goal)
    if errors.position is not None:
        assert errors.position.max() < robot.limits.geofence
    touching = task.collides(start, goal, robot)
    assert touching is None or not touching.any()


@EACH_PAIR
def test_it_sees_as_many_terms_as_it_has_names_and_no_name_twice(task, robot):
    _, state, goal = on_the_way(task, robot)
    terms = task.observe(state, goal)
    assert len(terms) == len(task.observation_names) == len(set(task.observation_names))
    assert all(np.shape(term) == (COUNT,) and np.isfinite(term).all() for term in terms)
    observer = Observer(robot, task)
    seen = observer(state, goal, np.zeros((COUNT, len(robot.actuators.names))))
    assert seen.shape == (COUNT, len(observer.names))
    assert len(set(observer.names)) == len(observer.names)


@EACH_PAIR
def test_at_its_target_itself_everything_is_finite(task, robot):
    _, goal = draw(task, robot)
    state = at_target(task, goal.targets[:, 0])
    goal = goal.among(dict.fromkeys(goal.things, goal.targets[:, 0]))
    assert all(np.isfinite(term).all() for term in task.observe(state, goal))
    assert np.isfinite(task.reward(state, state, goal, goal)).all()


def everything(task, robot, before, after, goal):
    """Every number that a task makes of two states and a goal."""
    errors = task.errors(after, goal)
    ended = task.advance(goal, after, np.asarray(20.0) if after.x.ndim == 0 else after.x * 0.0 + 20.0)
    values = [*task.observe(after, goal), task.reward(before, after, goal, ended)]
    values += [error for field in fields(errors) if (error := getattr(errors, field.name)) is not None]
    values += ended.arrays()
    values += [ended.current]
    for name in ("penalty", "collides"):
        extra = getattr(task, name, lambda *_: None)(after, goal, robot)
        values += [] if extra is None else [extra]
    dynamics = dynamics_of(robot)
    moved, slowed = dynamics.push_things(task.things, goal.things, before, after)
    values += [*moved.values(), slowed.vx, slowed.vy, task.reward(before, slowed, goal, goal.among(moved))]
    return values


@EACH_PAIR
def test_a_batch_is_treated_like_its_members(task, robot):
    before, after, goal = on_the_way(task, robot)
    together = everything(task, robot, before, after, goal)
    for i in (0, 7, COUNT - 1):
        alone = everything(task, robot, before[i], after[i], goal[i])
        for one, many in zip(alone, together, strict=True):
            np.testing.assert_allclose(one, np.asarray(many)[i], rtol=0, atol=1e-12)


@EACH_PAIR
def test_the_floating_type_is_kept(task, robot):
    before, after, goal = (cast(value, np.float32) for value in on_the_way(task, robot))
    values = everything(task, robot, before, after, goal)
    assert {np.asarray(value).dtype for value in values} <= {np.dtype(np.float32), np.dtype(bool)}


@EACH_PAIR
def test_torch_makes_of_it_what_numpy_does(task, robot):
    torch = pytest.importorskip("torch")
    before, after, goal = on_the_way(task, robot)
    ours = everything(task, robot, before, after, goal)
    theirs = everything(task, robot, *(cast(value, torch.as_tensor) for value in (before, after, goal)))
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(other.numpy(), one, rtol=0, atol=1e-9)


@EACH_PAIR
def test_fifty_random_steps_stay_finite_with_worlds_that_begin_anew(task, robot):
    simulation = BatchSimulation(robot, task, RANDOMISED, worlds=20, seed=4, training=True)
    rng = np.random.default_rng(5)
    for step in range(50):
        before, goal = simulation.truth, simulation.goal
        simulation.step(rng.uniform(-1.5, 1.5, simulation.command.shape) * robot.actuators.scale)
        assert np.isfinite(simulation.observe()).all()
        assert np.isfinite(task.reward(before, simulation.truth, goal, simulation.goal)).all()
        if step % 10 == 9:
            simulation.reset(rng.integers(0, 20, 3))


def carried_in_plane(state, goal, *, twists):
    """The same seen in a world that was moved and turned; twists are in the body's frame."""
    turn, dx, dy = 2.0, 3.0, -1.0
    c, s = np.cos(turn), np.sin(turn)

    def place(x, y):
        return c * x - s * y + dx, s * x + c * y + dy

    x, y = place(state.x, state.y)
    vx, vy = c * state.vx - s * state.vy, s * state.vx + c * state.vy
    moved = PlanarState(x, y, state.yaw + turn, vx, vy, state.yaw_rate)
    if twists:
        return moved, goal
    targets = np.stack((*place(goal.targets[..., 0], goal.targets[..., 1]), goal.targets[..., 2] + turn), -1)
    centres = np.stack(place(goal.obstacles[..., 0], goal.obstacles[..., 1]), -1)
    discs = np.concatenate((centres, goal.obstacles[..., 2:]), -1)
    things = {
        name: np.stack((*place(pose[:, 0], pose[:, 1]), pose[:, 2] + turn), -1)
        for name, pose in goal.things.items()
    }
    return moved, Goal(targets, goal.done, discs, things)


def carried_in_space(state, goal, *, twists):
    """The same in space, turned about no axis of the world."""
    turned = tuple(map(np.asarray, (0.1, -0.7, 0.5, 0.5)))

    def place(position):
        return plus(turn(turned, position), (3.0, -1.0, 2.0))

    quat, velocity = product(turned, state.quat), turn(turned, state.velocity)
    moved = SpatialState(*place(state.position), *quat, *velocity, *state.rate)
    if twists:
        return moved, goal
    target = (*place(position_of(goal.targets)), *product(turned, quat_of(goal.targets)))
    return moved, replace(goal, targets=np.stack(target, axis=-1))


@EACH_PAIR
def test_moving_and_turning_the_whole_world_changes_nothing_that_is_seen(task, robot):
    _, state, goal = on_the_way(task, robot)
    if not robot.kind.stays:  # its paths lead along the world's x, and how far does not count
        further = task.observe(replace(state, x=state.x + 3.0), goal)
        assert all(np.array_equal(*pair) for pair in zip(task.observe(state, goal), further, strict=True))
        return
    carry = carried_in_plane if task.state_type is PlanarState else carried_in_space
    moved, elsewhere = carry(state, goal, twists=task.goal_topic == "goal_velocity")
    if task.moves:
        elsewhere = task.begun(elsewhere, moved)
    for here, there in zip(task.observe(state, goal), task.observe(moved, elsewhere), strict=True):
        np.testing.assert_allclose(there, here, rtol=0, atol=1e-9)


@EACH_PAIR
def test_who_is_large_has_room_to_start(task, robot):
    start, goal = draw(task, robot, count=300)
    if goal.obstacles.shape[1]:
        away = np.hypot(goal.obstacles[..., 0] - start.x[:, None], goal.obstacles[..., 1] - start.y[:, None])
        there = goal.obstacles[..., 2] > 0.0
        assert np.all((away - goal.obstacles[..., 2])[there] > outline_of(robot).extent)


@EACH_TASK
def test_its_closing_window_fits_into_its_episode(task):
    assert task.tolerance.hold_s < task.episode_s


@EACH_TASK
def test_its_goal_arrives_on_a_wire(task):
    assert task.goal_topic in GOAL_WIRES


@EACH_TASK
def test_it_can_be_written_into_a_record(task):
    json.dumps(asdict(task), allow_nan=False)
