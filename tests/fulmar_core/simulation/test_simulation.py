"""Many worlds in one batch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState, at_rest
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from tests.simulations import BASE, RANDOMISED, ROBOTS, STILL, build, commands, run
from tests.spaces import task_for

EACH_ROBOT = pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)


def everything(simulation, index=...):
    """All that can be seen of some worlds."""
    columns = simulation.robot.state_type.COLUMNS
    return {
        **{f"true {name}": getattr(simulation.truth, name)[index].copy() for name in columns},
        **{f"measured {name}": getattr(simulation.measured, name)[index].copy() for name in columns},
        **{name: getattr(simulation.goal, name)[index].copy() for name in ("targets", "done", "obstacles")},
        "command": simulation.command[index].copy(),
        "observation": simulation.observe()[index].copy(),
    }


def test_a_snapshot_with_other_things_is_refused():
    snapshots = [
        BatchSimulation(load_robot("turtlebot2"), load_task(name), load_scenario("ideal"), worlds=2, seed=1)
        for name in ("push_block", "go_to_position")
    ]
    with pytest.raises(ValueError, match="the snapshot has other things"):
        snapshots[0].restore(snapshots[1].snapshot())


def assert_equal(one, other):
    for name, values in one.items():
        np.testing.assert_array_equal(values, other[name], err_msg=name)


def test_robots_that_are_put_where_others_are_go_on_as_those():
    task, boat = load_task("go_through_positions"), ROBOTS["kingfisher"]
    others = run(build(robot=boat, task=task), 30)
    these = build(robot=boat, task=task, seed=99)
    these.put(others.truth, others.goal, others.command)
    np.testing.assert_allclose(these.observe(), others.observe(), rtol=1e-6, atol=1e-6)
    for command in commands(others, 20, seed=2):
        others.step(command)
        these.step(command)
    for name in PlanarState.COLUMNS:
        np.testing.assert_allclose(
            getattr(these.truth, name), getattr(others.truth, name), rtol=1e-5, atol=1e-5
        )


@EACH_ROBOT
def test_the_first_64_of_4096_worlds_are_64_worlds(robot):
    task = task_for(robot, "go_through_positions")
    few, many = (build(RANDOMISED, robot, task, worlds=n) for n in (64, 4096))
    plan = commands(many, 12)
    for step, command in enumerate(plan):
        few.step(command[:64])
        many.step(command)
        if step == 6:
            few.reset(range(0, 64, 3))
            many.reset(range(0, 4096, 3))
    first = np.arange(64)
    for name, values in everything(few).items():
        other = everything(many, first)[name]
        # Sums over actuators may round otherwise where a batch is wider.
        np.testing.assert_allclose(values, other, rtol=0, atol=2e-5, err_msg=name)


def begun_with(simulation):
    """A number that differs from world to world: the place, or the attitude of a satellite."""
    return simulation.truth.qx if simulation.robot.actuators.turns_only else simulation.truth.x


@EACH_ROBOT
def test_the_same_seed_gives_the_same_worlds_and_another_seed_others(robot):
    one, two, other = (run(build(RANDOMISED, robot, seed=seed), 10) for seed in (3, 3, 4))
    assert_equal(everything(one), everything(two))
    assert not np.any(begun_with(one) == begun_with(other))


@EACH_ROBOT
def test_a_reset_begins_anew_in_the_asked_worlds_and_leaves_the_others_bitwise_as_they_would_have_been(robot):
    disturbed, alone = (run(build(RANDOMISED, robot, worlds=9), 7) for _ in range(2))
    disturbed.reset([1, 4, 8])
    rest = np.array([0, 2, 3, 5, 6, 7])
    assert_equal(everything(disturbed, rest), everything(alone, rest))
    for command in commands(alone, 9, seed=2):
        disturbed.step(command)
        alone.step(command)
    assert_equal(everything(disturbed, rest), everything(alone, rest))
    assert not np.any(begun_with(disturbed)[[1, 4, 8]] == begun_with(alone)[[1, 4, 8]])


def test_after_a_reset_a_world_is_at_rest_with_safe_actuators_and_a_goal_of_its_own():
    simulation = run(build(RANDOMISED, BASE), 5)
    before = everything(simulation, [2])
    simulation.reset([2])
    assert (simulation.truth.vx[2], simulation.truth.vy[2], simulation.truth.yaw_rate[2]) == (0.0, 0.0, 0.0)
    assert not simulation.command[2].any()
    assert np.any(simulation.goal.targets[2] != before["targets"][0])


def test_a_world_begun_anew_goes_as_the_same_world_of_a_batch_that_was_begun_anew_whole():
    some, whole = (run(build(RANDOMISED, BASE), 4) for _ in range(2))
    some.reset([3])
    whole.reset(range(5))
    for command in commands(some, 6, seed=5):
        some.step(command)
        whole.step(command)
    assert_equal(everything(some, [3]), everything(whole, [3]))


def test_a_reset_of_no_world_changes_nothing():
    simulation = run(build(RANDOMISED), 3)
    before = everything(simulation)
    simulation.reset([])
    assert_equal(everything(simulation), before)


def test_each_world_gets_a_new_episode_at_each_reset():
    simulation = build()
    starts = [simulation.truth.x.copy()]
    for _ in range(3):
        simulation.reset(range(5))
        starts.append(simulation.truth.x.copy())
    assert len(np.unique(np.concatenate(starts))) == 20


@pytest.mark.parametrize("scenario", ["nominal", "randomised"])
def test_what_was_handed_out_before_a_step_and_a_reset_stays_as_it_was(scenario):
    simulation = run(build(load_scenario(scenario)), 2)
    kept, copies = (simulation.truth, simulation.measured, simulation.command), everything(simulation)
    run(simulation, 1).reset(range(5))
    for name in PlanarState.COLUMNS:
        np.testing.assert_array_equal(getattr(kept[0], name), copies[f"true {name}"])
        np.testing.assert_array_equal(getattr(kept[1], name), copies[f"measured {name}"])
    np.testing.assert_array_equal(kept[2], copies["command"])


@pytest.mark.parametrize("steps", [0, 2])
def test_readings_and_commands_that_were_handed_out_outlast_a_reset(steps):
    simulation = run(build(RANDOMISED), steps)
    kept, command = simulation.measured, simulation.command
    copies = everything(simulation)
    simulation.reset([1, 3])
    for name in PlanarState.COLUMNS:
        np.testing.assert_array_equal(getattr(kept, name), copies[f"measured {name}"])
    np.testing.assert_array_equal(command, copies["command"])


@EACH_ROBOT
@pytest.mark.parametrize("task", ["go_to_position", "track_velocities"])
def test_a_task_that_begins_anew_again_and_again_stays_finite(robot, task):
    simulation = build(RANDOMISED, robot, task_for(robot, task))
    for step, command in enumerate(commands(simulation, 20)):
        simulation.step(command)
        simulation.reset([step % 5])
        assert np.isfinite(simulation.observe()).all()


@EACH_ROBOT
def test_commands_are_cut_to_what_the_robot_can_follow(robot):
    simulation = build(STILL, robot)
    scale, response = robot.actuators.scale, robot.actuators.response
    simulation.step(np.tile(100.0 * scale, (5, 1)))
    first = simulation.command
    most = np.asarray(response.slew) * simulation.control_dt if response.slew else scale
    asked = robot.actuators.limited(100.0 * scale)
    np.testing.assert_allclose(first, np.tile(np.minimum(asked, most), (5, 1)), rtol=1e-6)
    for _ in range(30):
        simulation.step(np.tile(100.0 * scale, (5, 1)))
    assert np.all(np.abs(simulation.command) <= scale + 1e-6)


def test_a_move_applies_a_command_as_it_is_and_leaves_goals_to_the_loop_that_follows_them():
    course = load_task("go_through_positions")
    simulation = BatchSimulation(BASE, course, STILL, worlds=2, seed=1, dtype=np.float64)
    target = simulation.goal.current
    there = at_rest(target[:, 0], target[:, 1], target[:, 2])
    beyond = 2.0 * np.tile(BASE.actuators.scale, (2, 1))  # more than a learner's command is cut to
    simulation.put(there, simulation.goal, simulation.command)
    simulation.move(beyond)
    np.testing.assert_array_equal(simulation.command, beyond)
    np.testing.assert_array_equal(simulation.goal.done, 0.0)


def test_a_learner_s_step_advances_goals_by_what_is_measured_and_not_by_the_truth():
    course = load_task("go_through_positions")
    simulation = BatchSimulation(BASE, course, STILL, worlds=2, seed=1, dtype=np.float64)
    target, start = simulation.goal.current, simulation.truth
    x = np.array([target[0, 0], start.x[1]])  # one is there, the other is where it began
    y = np.array([target[0, 1], start.y[1]])
    simulation.put(at_rest(x, y, start.yaw), simulation.goal, simulation.command)
    measure = simulation._measure

    def mistaken():
        measure()
        seen = simulation.measured  # the second believes to be there, the first does not
        simulation.measured = replace(
            seen, x=np.array([seen.x[0] + 1.0, target[1, 0]]), y=np.array([seen.y[0], target[1, 1]])
        )

    simulation._measure = mistaken
    simulation.step(np.zeros((2, 2)))
    assert simulation.goal.done.tolist() == [0.0, 1.0]


@EACH_ROBOT
def test_observations_are_those_of_the_observer_and_show_commands_where_actuators_take_time(robot):
    simulation = run(build(RANDOMISED, robot), 3)
    observer = Observer(robot, simulation.task)
    seen = observer(simulation.measured, simulation.goal, simulation.command)
    np.testing.assert_array_equal(simulation.observe(), seen)
    assert seen.shape == (5, len(observer.names))
    remembered = [name for name in observer.names if name.startswith("previous_")]
    assert len(remembered) == (len(robot.actuators.names) if robot.actuators.remembers else 0)
    if remembered:
        share = simulation.command / robot.actuators.scale
        np.testing.assert_allclose(seen[:, -len(remembered) :], share, rtol=0, atol=1e-6)


def test_the_control_rate_sets_how_long_a_step_lasts():
    assert build().control_dt == pytest.approx(0.2)
    fast = build(control_hz=50.0)
    assert (fast.substeps, fast.control_dt) == (1, pytest.approx(0.02))
    with pytest.raises(ValueError, match="must divide"):
        build(control_hz=7.0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@EACH_ROBOT
def test_the_floating_type_is_kept_through_steps_and_resets(robot, dtype):
    simulation = run(build(RANDOMISED, robot, dtype=dtype), 1)
    simulation.reset([0])
    run(simulation, 1)
    assert {values.dtype for values in everything(simulation).values()} == {np.dtype(dtype)}


@EACH_ROBOT
def test_single_precision_follows_double_over_a_whole_episode(robot):
    single, double = (build(STILL, robot, dtype=dtype) for dtype in (np.float32, np.float64))
    for command in commands(single, 300):
        single.step(0.3 * command)
        double.step(0.3 * command)
    # Thousands of additions in float32 on values up to some ten metres: 1e-6 each, in random directions.
    np.testing.assert_allclose(single.truth.pose, double.truth.pose, rtol=0, atol=2e-2)


def test_a_snapshot_brings_everything_back():
    simulation = run(build(RANDOMISED, BASE), 4)
    kept = simulation.snapshot()
    one = everything(run(simulation, 6, seed=9))
    simulation.reset([0, 1])
    simulation.restore(kept)
    assert_equal(everything(run(simulation, 6, seed=9)), one)
