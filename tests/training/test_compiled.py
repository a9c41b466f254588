"""Compiled steps: the worlds move as they do in NumPy, episodes begin in between, and nothing is compiled twice."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.learning_step import observed_step
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.new_robots import new_robot
from tests.spaces import shared_space
from training import kernel
from training.compiled import CompiledStep
from training.kernel import leaves, parts_of
from training.vec_env import BatchVecEnv

RANDOMISED = load_scenario("randomised")
ROBOT, TASK = load_robot("turtlebot2"), load_task("track_velocities")  # quick to compile
WORLDS = 24
ROBOTS = {name: load_robot(name) for name in config_names("robots")}
TASKS = {name: load_task(name) for name in config_names("tasks")}
# To trace one takes a second or several: of the quick tests one on wheels and one with nozzles.
QUICK = {("turtlebot2", "track_velocities"), ("floating_platform", "go_to_pose")}
EACH_PAIR = pytest.mark.parametrize(
    ("robot", "task"),
    [
        pytest.param(
            ROBOTS[robot],
            TASKS[task],
            id=f"{robot}-{task}",
            marks=() if (robot, task) in QUICK else pytest.mark.slow,
        )
        for robot, task in shared_space(ROBOTS, TASKS)
    ],
)


def assert_moves_as_in_numpy(robot, task, steps=60, control_hz=None, scenario=RANDOMISED):
    plain, batch = (
        BatchSimulation(robot, task, scenario, worlds=WORLDS, seed=5, training=True, control_hz=control_hz)
        for _ in range(2)
    )
    compiled, rng = CompiledStep(batch), np.random.default_rng(6)
    for k in range(steps):
        command = rng.uniform(-1.0, 1.0, (WORLDS, len(robot.actuators.names))) * robot.actuators.scale
        command = command.astype(np.float32)
        reward, over, seen = observed_step(plain, command, effort=robot.costs.effort)
        result = compiled(command, effort=robot.costs.effort)
        np.testing.assert_array_equal(result[1], over)
        np.testing.assert_allclose(result[0], reward, atol=2e-4)
        np.testing.assert_allclose(result[2], seen, atol=2e-4)
        assert result[2].dtype == seen.dtype
        if k % 17 == min(9, steps // 2):
            for worlds in (plain, batch):
                worlds.reset([1, 3, 5 + k % 4])
            np.testing.assert_allclose(batch.observe(), plain.observe(), atol=2e-4)
    assert np.ptp(reward) > 0.0
    ours, theirs = (parts_of(worlds.mutable_state()) for worlds in (batch, plain))
    assert ours.keys() == theirs.keys()
    for name in ours:
        for our, their in zip(leaves(ours[name]), leaves(theirs[name]), strict=True):
            np.testing.assert_allclose(our, their, atol=2e-3, err_msg=name)


@pytest.mark.slow
def test_compiled_worlds_move_as_in_numpy():
    assert_moves_as_in_numpy(ROBOT, TASK)


@pytest.fixture
def traced(monkeypatch):
    """Steps are traced as they are for the compiler, and carried out by torch; returns what was traced."""
    graphs = []

    def kept(graph, given):
        graphs.append(graph)
        return graph

    monkeypatch.setattr(kernel, "_compiled", kept)
    return graphs


@EACH_PAIR
def test_one_trace_moves_worlds_of_every_pair_as_in_numpy(robot, task, traced):
    assert_moves_as_in_numpy(robot, task, steps=4)
    assert len(traced) == 1
    (made,) = traced[0].graph.output_node().args
    assert len(set(made)) == len(made)  # nothing is copied, neither what stays nor what two names have
    assert all(node.op != "placeholder" for node in made)


@pytest.mark.slow
def test_a_gravity_gradient_is_traced(traced):
    probe = new_robot("lopsided_probe")
    assert_moves_as_in_numpy(
        probe, load_task("go_to_pose_3d"), steps=12, scenario=replace(RANDOMISED, orbit_rate=0.1)
    )
    assert len(traced) == 1


def test_worlds_at_another_rate_are_traced_at_that_rate(traced):
    assert_moves_as_in_numpy(ROBOT, TASK, steps=3, control_hz=0.5 * ROBOT.timing.control_hz)


def test_commands_that_lie_otherwise_in_memory_have_a_kernel_of_their_own(traced):
    batch = BatchSimulation(ROBOT, TASK, RANDOMISED, worlds=WORLDS, seed=5)
    compiled, command = CompiledStep(batch), np.zeros((WORLDS, 2), dtype=np.float32)
    for asked in (command, np.asfortranarray(command), command):
        compiled(asked, effort=0.1)
    assert len(traced) == 2


def test_a_step_that_changes_the_shape_of_what_moves_is_refused(traced, monkeypatch):
    batch = BatchSimulation(ROBOT, TASK, RANDOMISED, worlds=WORLDS, seed=5)
    monkeypatch.setattr(
        type(batch.task), "advance", lambda task, goal, truth, time_s: replace(goal, done=goal.done[:1])
    )
    with pytest.raises(TypeError, match="a step made"):
        CompiledStep(batch)(batch.command, effort=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "task"),
    [
        ("floating_platform", "go_to_position_with_obstacles"),
        ("modular_freeflyer", "push_block"),
        ("kingfisher", "go_through_positions"),
        ("leatherback", "race_gates"),
    ],
)
def test_compiled_worlds_of_every_family_move_as_in_numpy(robot, task):
    assert_moves_as_in_numpy(load_robot(robot), load_task(task))


@pytest.fixture
def never_traced_again(monkeypatch):
    """Call it, and from then on nobody is given another kernel."""

    def refuse(*_args, **_kwargs):
        raise AssertionError("traced again")

    return lambda: monkeypatch.setattr("training.compiled.kernel_of", refuse)


def learned_in(env, steps):
    """Observations and rewards of some steps under commands that are the same for everybody."""
    rng, seen = np.random.default_rng(7), []
    for _ in range(steps):
        env.step_async(rng.uniform(-1.0, 1.0, (WORLDS, 2)))
        observations, rewards, _, _ = env.step_wait()
        seen += [observations, rewards[:, None]]
    return np.concatenate(seen, axis=1)


@pytest.fixture
def environments():
    return [
        BatchVecEnv(ROBOT, TASK, RANDOMISED, worlds=WORLDS, seed=5, compiled=compiled)
        for compiled in (False, True)
    ]


@pytest.mark.slow
def test_a_learner_sees_the_same_and_pays_what_effort_costs_now(environments, never_traced_again):
    plain, compiled = environments
    for env in environments:
        env.reset()
    np.testing.assert_allclose(learned_in(compiled, 30), learned_in(plain, 30), atol=2e-4)
    never_traced_again()
    for factor in (2.0, 30.0):
        for env in environments:
            env.set_effort(factor)
        dearer = learned_in(compiled, 3)
        np.testing.assert_allclose(dearer, learned_in(plain, 3), atol=2e-3)


@pytest.mark.slow
def test_a_learner_goes_on_from_where_it_was_to_the_last_bit(environments):
    compiled = environments[1]
    compiled.reset()
    learned_in(compiled, 5)
    state = compiled.state()
    went = learned_in(compiled, 20)
    compiled.set_state(state)
    np.testing.assert_array_equal(learned_in(compiled, 20), went)


@pytest.mark.slow
def test_worlds_that_are_built_anew_are_found_compiled(environments):
    from torch._dynamo.utils import counters  # what torch itself counts

    compiled = environments[1]
    compiled.reset()
    first = learned_in(compiled, 2)
    missed = counters["inductor"]["fxgraph_cache_miss"]
    compiled.reset()
    np.testing.assert_array_equal(learned_in(compiled, 2), first)
    assert counters["inductor"]["fxgraph_cache_miss"] == missed


STEP_ONCE = """
import sys
import numpy as np
from fulmar_core.config.errors import ConfigError
from tests.training.test_compiled import RANDOMISED, ROBOT, TASK, BatchSimulation, CompiledStep
batch = BatchSimulation(ROBOT, TASK, RANDOMISED, worlds=7, seed=5)
try:
    CompiledStep(batch)(np.zeros((7, 2), dtype=np.float32), effort=0.1)
except ConfigError as error:
    sys.exit(str(error))
"""


@pytest.mark.slow
def test_a_failing_compiler_is_reported(tmp_path):
    """In a process of its own: torch looks for a compiler once."""
    failing = os.environ | {"CXX": "false", "TORCHINDUCTOR_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", STEP_ONCE], env=failing, capture_output=True, text=True, check=False
    )
    assert "python3-dev" in done.stderr.splitlines()[-1]


@pytest.mark.slow
def test_numbers_that_a_robot_keeps_in_arrays_are_its_own():
    """What torch finds compiled for one robot does not measure with the noise of another."""
    odometry = ROBOT.sensors.odometry
    noisy = replace(odometry, position=replace(odometry.position, std=0.5))
    for robot in (ROBOT, replace(ROBOT, sensors=replace(ROBOT.sensors, odometry=noisy))):
        assert_moves_as_in_numpy(robot, load_task("go_to_position"), steps=3)
