"""A policy of DreamerV3 from its weights to the bundle that a robot runs; sheeprl itself is in tests/peers."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.seeds import HELD_OUT_SEED
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.policy_bundle import read_golden, read_passport
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario
from policy_server.policy import Policy
from tests.training.dreamer_runs import drawn_network, small_plan, write_run
from training.dreamer_network import CLEAR, DreamerNetwork
from training.export import export
from training.network import NetworkController, load_network
from training.run_folder import NETWORK_FILE

ROBOT, TASK = load_robot("turtlebot2"), load_task("go_to_position")
STEPS = 500


@pytest.fixture(scope="module")
def network():
    return drawn_network(ROBOT, TASK)


@pytest.fixture(scope="module")
def dreamer_run(network, tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("dreamer") / "run", network, ROBOT, TASK)


@pytest.fixture(scope="module")
def dreamer_bundle(dreamer_run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("dreamer") / "bundle"
    export(dreamer_run, folder)
    return folder


def test_the_bundle_says_what_its_memory_holds(dreamer_bundle, network):
    passport = read_passport(dreamer_bundle)
    assert passport.memory == network.plan.memory == 16 + 4 * 4 + 2
    assert passport.remembers_command
    assert sum(path.stat().st_size for path in dreamer_bundle.iterdir()) < 100_000


def test_the_bundle_drives_as_torch_does_for_five_hundred_steps_in_a_closed_loop(dreamer_bundle, network):
    simulation = BatchSimulation(ROBOT, TASK, load_scenario("nominal"), worlds=2, seed=HELD_OUT_SEED)
    served = Policy(dreamer_bundle, ROBOT, TASK)
    beside = NetworkController(network, ROBOT, TASK, served.control_hz)
    loop = ControlLoop(ROBOT, TASK, served, robots=2)
    loop.begin(goal_in_float64(simulation.goal))
    commands, worst, scale = [], 0.0, np.asarray(ROBOT.actuators.scale)
    for number in range(STEPS):
        inputs = loop.inputs(simulation.measured, {}, round(1e9 * number * loop.dt))
        expected, command = beside.act(inputs), served.act(inputs)
        worst = max(worst, float(np.abs((command - expected) / scale).max()))
        commands.append(command)
        simulation.move(loop.take(inputs, command).command)
    assert worst <= 1e-5
    assert np.std(commands) > 0.1, "it does something"


def test_an_episode_begins_with_the_state_that_was_learned(network):
    seen = np.ones((1, network.plan.inputs), np.float32)
    command, _, after = network.infer(seen)
    other = DreamerNetwork(network.plan)
    other.load_state_dict(network.state_dict())
    other.first.zero_()
    started = network.first[None].numpy()
    np.testing.assert_array_equal(other.infer(seen, started)[0], command)
    np.testing.assert_allclose(other.infer(seen, started)[2], after + started, atol=1e-6)
    assert not np.array_equal(other.infer(seen)[0], command)


def test_the_weights_of_a_run_are_loaded_as_they_were_saved(dreamer_run, network):
    again = load_network(dreamer_run / NETWORK_FILE)
    assert isinstance(again, DreamerNetwork)
    seen = np.linspace(-2.0, 2.0, 3 * network.plan.inputs, dtype=np.float32).reshape(3, -1)
    for expected, found in zip(network.infer(seen), again.infer(seen), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_golden_vectors_are_no_near_ties_that_another_processor_may_break_otherwise(dreamer_bundle, network):
    golden = read_golden(dreamer_bundle)
    assert network.clear(golden.observations, golden.memories).all()
    rows = len(golden.observations)
    tied = DreamerNetwork(network.plan)
    tied.load_state_dict(network.state_dict())
    with torch.no_grad():
        tied.posterior[-1].weight[1].copy_(tied.posterior[-1].weight[0])
        tied.posterior[-1].weight[2:4] = 0.0
        tied.posterior[-1].bias[:4] = torch.tensor([9.0, 9.0 - 0.5 * CLEAR, 0.0, 0.0])
    assert 0 <= tied.clear(golden.observations, golden.memories).sum() < rows


def test_a_network_that_has_only_ties_is_not_exported(network, tmp_path):
    tied = DreamerNetwork(network.plan)
    tied.load_state_dict(network.state_dict())
    with torch.no_grad():
        tied.posterior[-1].weight.zero_()
        tied.posterior[-1].bias.zero_()
    run = write_run(tmp_path / "run", tied, ROBOT, TASK)
    with pytest.raises(ConfigError, match=r"so near a tie .* Train for longer"):
        export(run, tmp_path / "bundle")


def test_weights_of_another_shape_are_no_weights_of_this_network(network):
    with pytest.raises((LookupError, RuntimeError)):
        DreamerNetwork(small_plan(ROBOT, TASK)).take({}, {})
