"""Many worlds in one batch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.counter_rng import START
from fulmar_core.disturbances.scenario import Actuation, Kick, Push, Scenario, Sensing, Wave, load_scenario
from fulmar_core.observation import Observer
from fulmar_core.paths import config_names
from fulmar_core.planar import COLUMNS, at_rest
from fulmar_core.robot import load_robot
from fulmar_core.sensors.odometer import Channel
from fulmar_core.simulation import ACTUATOR_NOISE, BatchSimulation
from fulmar_core.tasks import load_task

ROBOTS = {name: load_robot(name) for name in config_names("robots")}
PLATFORM, BASE = ROBOTS["floating_platform"], ROBOTS["turtlebot2"]
POSE = load_task("go_to_pose")
STILL = Scenario("nothing happens", sensor_noise=False, body="nominal")
RANDOMISED = load_scenario("randomised")
EACH_ROBOT = pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)


def build(scenario=STILL, robot=PLATFORM, task=POSE, *, worlds=5, seed=3, **kwargs):
    return BatchSimulation(robot, task, scenario, worlds=worlds, seed=seed, **kwargs)


def commands(simulation, steps, seed=1, worlds=None):
    """Commands for every step; a world gets the same ones in a batch of any size."""
    scale = simulation.robot.actuators.scale
    shape = (worlds or simulation.worlds, steps, len(scale))
    drawn = np.random.default_rng(seed).uniform(-1.2, 1.2, shape).transpose(1, 0, 2)
    return drawn * scale


def run(simulation, steps, **kwargs):
    for command in commands(simulation, steps, **kwargs):
        simulation.step(command)
    return simulation


def everything(simulation, index=...):
    """All that can be seen of some worlds."""
    return {
        **{f"true {name}": getattr(simulation.truth, name)[index].copy() for name in COLUMNS},
        **{f"measured {name}": getattr(simulation.measured, name)[index].copy() for name in COLUMNS},
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


def differing(one, other):
    return {name for name in COLUMNS if not np.array_equal(getattr(one, name), getattr(other, name))}


def test_robots_that_are_put_where_others_are_go_on_as_those():
    task, boat = load_task("go_through_positions"), ROBOTS["kingfisher"]
    others = run(build(robot=boat, task=task), 30)
    these = build(robot=boat, task=task, seed=99)
    these.put(others.truth, others.goal, others.command)
    np.testing.assert_allclose(these.observe(), others.observe(), rtol=1e-6, atol=1e-6)
    for command in commands(others, 20, seed=2):
        others.step(command)
        these.step(command)
    for name in COLUMNS:
        np.testing.assert_allclose(
            getattr(these.truth, name), getattr(others.truth, name), rtol=1e-5, atol=1e-5
        )


@EACH_ROBOT
def test_the_first_64_of_4096_worlds_are_64_worlds(robot):
    task = load_task("go_through_positions")
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


@EACH_ROBOT
def test_the_same_seed_gives_the_same_worlds_and_another_seed_others(robot):
    one, two, other = (run(build(RANDOMISED, robot, seed=seed), 10) for seed in (3, 3, 4))
    assert_equal(everything(one), everything(two))
    assert not np.any(one.truth.x == other.truth.x)


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
    assert not np.any(disturbed.truth.x[[1, 4, 8]] == alone.truth.x[[1, 4, 8]])


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
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(kept[0], name), copies[f"true {name}"])
        np.testing.assert_array_equal(getattr(kept[1], name), copies[f"measured {name}"])
    np.testing.assert_array_equal(kept[2], copies["command"])


@pytest.mark.parametrize("steps", [0, 2])
def test_readings_and_commands_that_were_handed_out_outlast_a_reset(steps):
    simulation = run(build(RANDOMISED), steps)
    kept, command = simulation.measured, simulation.command
    copies = everything(simulation)
    simulation.reset([1, 3])
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(kept, name), copies[f"measured {name}"])
    np.testing.assert_array_equal(command, copies["command"])


@EACH_ROBOT
@pytest.mark.parametrize("task", ["go_to_position", "track_velocities"])
def test_a_task_that_begins_anew_again_and_again_stays_finite(robot, task):
    simulation = build(RANDOMISED, robot, load_task(task))
    for step, command in enumerate(commands(simulation, 20)):
        simulation.step(command)
        simulation.reset([step % 5])
        assert np.isfinite(simulation.observe()).all()


ACTS = {
    "push": {"push": Push(0.3, 0.3, least=0.5)},
    "wave": {"wave": Wave(0.5, 0.5)},
    "noise of the actuators": {"actuation": Actuation(noise=0.3)},
    "gain of the actuators": {"actuation": Actuation(gain=(0.5, 0.6))},
    "failures": {"actuation": Actuation(failures=1, failure_chance=1.0)},
    "uncertain body": {"body": "uncertain"},
}


@pytest.mark.parametrize("act", ACTS)
@pytest.mark.parametrize("robot", [PLATFORM, ROBOTS["kingfisher"]], ids=lambda robot: robot.name)
def test_what_disturbs_the_motion_moves_the_truth_and_leaves_the_sensors_perfect(robot, act):
    calm, moved = run(build(STILL, robot), 10), run(build(replace(STILL, **ACTS[act]), robot), 10)
    assert differing(calm.truth, moved.truth) == set(COLUMNS)
    assert not differing(moved.truth, moved.measured)


@pytest.mark.parametrize(
    "sensing",
    [Sensing(noise=2.0), Sensing(delay_s=0.3), Sensing(dropout=1.0)],
    ids=["noise", "delay", "dropout"],
)
def test_what_disturbs_the_sensors_leaves_the_truth_alone(sensing):
    scenario = replace(STILL, sensor_noise=True)
    calm, moved = run(build(scenario), 10), run(build(replace(scenario, sensing=sensing)), 10)
    assert not differing(calm.truth, moved.truth)
    assert differing(calm.measured, moved.measured) == set(COLUMNS)


def test_biases_of_a_robot_s_sensors_are_worn_for_a_whole_episode():
    spec = replace(PLATFORM.sensors.odometry, position=Channel(bias_std=0.1))
    robot = replace(PLATFORM, sensors=replace(PLATFORM.sensors, odometry=spec))
    simulation = build(load_scenario("nominal"), robot, dtype=np.float64)
    first = simulation.measured.x - simulation.truth.x
    run(simulation, 10)
    np.testing.assert_allclose(simulation.measured.x - simulation.truth.x, first, rtol=0, atol=1e-12)
    simulation.reset([0])
    changed = np.abs(simulation.measured.x - simulation.truth.x - first) > 1e-9
    assert changed.tolist() == [True, False, False, False, False]


def test_a_kick_comes_once_in_a_while_and_changes_the_velocity_by_force_times_time_over_mass():
    calm = build(STILL, dtype=np.float64)
    kicked = build(replace(STILL, kick=Kick(force=1.0, every_s=(2.0, 3.0))), dtype=np.float64)
    jumps = []
    for _ in range(25):
        for simulation in (calm, kicked):
            simulation.step(np.zeros((5, 8)))
        jumps.append(np.hypot(kicked.truth.vx - calm.truth.vx, kicked.truth.vy - calm.truth.vy))
    change = np.diff(np.array(jumps), axis=0)
    share = kicked.world.kick * kicked.control_dt / PLATFORM.body.mass
    for world in range(5):  # two kicks in the same direction in five seconds
        hits = change[:, world][change[:, world] > 1e-9]
        np.testing.assert_allclose(hits, share[world], rtol=1e-9)
        assert len(hits) in (1, 2)
    assert not np.array(jumps)[:10].any()  # none in the first two seconds


def test_late_commands_act_after_their_delay_and_not_before():
    late = build(replace(STILL, actuation=Actuation(delay_s=0.15)), dtype=np.float64)
    prompt = build(STILL, dtype=np.float64)
    for simulation in (late, prompt):
        simulation.step(np.eye(8)[[0] * 5])
    delay = late.world.action_delay
    share = 1.0 - np.ceil(delay / 0.02 - 0.5) * 0.02 / 0.2
    np.testing.assert_allclose(late.truth.yaw_rate, prompt.truth.yaw_rate * share, rtol=1e-9)


def test_valves_open_late_whether_the_robot_or_the_scenario_says_so():
    own = replace(PLATFORM.actuators, response=replace(PLATFORM.actuators.response, opening_delay_s=0.06))
    slow_robot = build(robot=replace(PLATFORM, actuators=own))
    slow_scenario = build(replace(STILL, actuation=Actuation(opening_delay_s=(0.06, 0.06))))
    for slow in (slow_robot, slow_scenario):
        prompt = build()
        for simulation in (slow, prompt):
            simulation.step(np.eye(8)[[0] * 5])
        share = 1.0 - 0.06 / slow.control_dt
        np.testing.assert_allclose(slow.truth.yaw_rate, prompt.truth.yaw_rate * share, rtol=1e-5)


def test_a_valve_that_failed_does_nothing_and_the_others_share_the_line():
    broken = build(replace(STILL, actuation=Actuation(failures=8, failure_chance=1.0)))
    broken.step(np.ones((5, 8)))
    assert not broken.truth.vx.any()
    assert np.all(broken.command == 1.0)  # it was commanded to


def test_noise_of_the_actuators_is_new_at_each_step_and_has_a_stream_of_its_own():
    assert ACTUATOR_NOISE != START
    simulation = build(replace(STILL, actuation=Actuation(noise=0.2)), BASE, worlds=2000, dtype=np.float64)
    errors = []
    for _ in range(2):
        simulation.step(np.full((2000, 2), 0.05))  # within one step's slew
        errors.append(simulation._actuation._wanted - 0.05)
    most = 0.2 * BASE.actuators.scale
    assert np.all(np.abs(errors) <= most[:, None])
    assert np.abs(errors).max(axis=(0, 2)) == pytest.approx(most, rel=0.05)
    assert abs(np.corrcoef(errors[0][0], errors[1][0])[0, 1]) < 4.0 / np.sqrt(2000)
    assert abs(np.corrcoef(errors[0][0], errors[0][1])[0, 1]) < 4.0 / np.sqrt(2000)


def test_a_centre_of_mass_beside_the_origin_turns_a_body_that_is_pushed_straight():
    heavy = replace(PLATFORM, uncertainty=replace(PLATFORM.uncertainty, center_of_mass=0.05))
    simulation = build(replace(STILL, body="uncertain"), heavy, dtype=np.float64)
    straight = np.zeros((5, 8))
    straight[:, [2, 7]] = 1.0  # 1 N together, ahead and left, without a moment about the origin
    simulation.step(straight)
    world = simulation.world
    turn = (world.com_y - world.com_x) * np.sqrt(0.5) * 0.2 / world.yaw_inertia
    np.testing.assert_allclose(simulation.truth.yaw_rate, turn, rtol=1e-6)


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
    observer = Observer(robot, POSE)
    seen = observer(simulation.measured, simulation.goal, simulation.command)
    np.testing.assert_array_equal(simulation.observe(), seen)
    assert seen.shape == (5, len(observer.names))
    remembered = [name for name in observer.names if name.startswith("previous_")]
    assert len(remembered) == (len(robot.actuators.names) if robot.actuators.response.remembers else 0)
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
    for name in ("x", "y", "yaw"):
        np.testing.assert_allclose(
            getattr(single.truth, name), getattr(double.truth, name), rtol=0, atol=2e-2
        )


def test_a_snapshot_brings_everything_back():
    simulation = run(build(RANDOMISED, BASE), 4)
    kept = simulation.snapshot()
    one = everything(run(simulation, 6, seed=9))
    simulation.reset([0, 1])
    simulation.restore(kept)
    assert_equal(everything(run(simulation, 6, seed=9)), one)
