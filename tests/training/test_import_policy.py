"""Policies of RoboRAN as bundles: the same outputs as in their own library, and nothing of a stranger's runs."""

from __future__ import annotations

import math
import os

import numpy as np
import onnx
import pytest
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.seeds import EVALUATION_SEED
from fulmar_core.loop.policy_bundle import read_golden, read_passport
from fulmar_core.loop.rollout import roll_out_in_backends
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import summary
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from policy_server.policy import Policy
from sim_nodes.mujoco_backend import MujocoBackend
from tests.policy_server.observed import inputs_seeing
from tests.training import foreign
from training.import_policy import import_policy

WORLDS = 20
TOLERANCE = 1e-5


def _states(seed=3):
    rng = np.random.default_rng(seed)
    x, y, yaw, vx, vy, turn = rng.uniform(-2.0, 2.0, (6, WORLDS))
    targets = rng.uniform(-3.0, 3.0, (WORLDS, 4, 3))
    goal = Goal(targets, np.zeros(WORLDS), no_obstacles(WORLDS))
    return PlanarState(x, y, yaw, 0.2 * vx, 0.2 * vy, 0.2 * turn), goal


def _polar(x, y, yaw, target):
    bearing = np.arctan2(target[:, 1] - y, target[:, 0] - x) - yaw
    return [np.hypot(target[:, 0] - x, target[:, 1] - y), np.cos(bearing), np.sin(bearing)]


def _roboran(task, state, goal):
    """RoboRAN's terms by angles, as its tasks compute them."""
    c, s = np.cos(state.yaw), np.sin(state.yaw)
    u, v = c * state.vx + s * state.vy, c * state.vy - s * state.vx
    motion = [u, v, state.yaw_rate]
    first, second = goal.targets[:, 0], goal.targets[:, 1]
    place = _polar(state.x, state.y, state.yaw, first)
    turn = first[:, 2] - state.yaw
    if task == "go_to_position":
        return [*place, *motion]
    if task == "go_to_pose":
        return [*place, np.cos(turn), np.sin(turn), *motion]
    if task == "track_velocities":
        return [first[:, 0] - u, 0.0 * u, first[:, 2] - state.yaw_rate, *motion]
    if task == "go_through_positions":
        return [*motion, *place, *_polar(state.x, state.y, state.yaw, second)]
    further = _polar(first[:, 0], first[:, 1], first[:, 2], second)
    change = second[:, 2] - first[:, 2]
    return [*motion, *place, np.cos(turn), np.sin(turn), *further, np.cos(change), np.sin(change)]


def _compare(out, robot_name, task_name, net, learner):
    """Act twice, and compare with the network in PyTorch on RoboRAN's observation."""
    robot, task = load_robot(robot_name), load_task(task_name)
    policy = Policy(out, robot, task)
    last = np.zeros((WORLDS, len(robot.actuators.names)))
    for seed in (3, 4):
        state, goal = _states(seed)
        seen = np.column_stack([*_roboran(task_name, state, goal), last])
        with torch.no_grad():
            raw = net(foreign.normalised(seen, learner)).numpy()
        ours = Observer(robot, task)(state, goal, np.zeros((WORLDS, len(robot.actuators.names))))
        found = policy.act(inputs_seeing(ours))
        if robot.actuators.binary:
            margin = raw[:, 1::2] - raw[:, ::2]
            clear = np.abs(margin) > 1e-4
            assert clear.mean() > 0.9
            assert np.array_equal(found[clear], (margin > 0.0)[clear])
            last = (margin > 0.0).astype(float)
        else:
            share = np.clip(raw, -1.0, 1.0)
            assert np.abs(found / robot.actuators.scale - share).max() < TOLERANCE
            last = share
    return policy


@pytest.mark.parametrize(
    ("task", "terms"),
    [
        ("go_to_position", 6),
        ("go_to_pose", 8),
        ("track_velocities", 6),
        ("go_through_positions", 9),
        ("go_through_poses", 13),
    ],
)
def test_skrl_policy_gives_the_same_commands_as_a_bundle(task, terms, tmp_path):
    net = foreign.network(terms + 2, 2, tanh_output=True)
    path = foreign.save_skrl(tmp_path / "best_agent.pt", net, shared=task == "go_to_pose")
    import_policy(
        path,
        tmp_path / "out",
        robot_name="turtlebot2",
        task_name=task,
        activation="elu",
        output_activation="tanh",
    )
    _compare(tmp_path / "out", "turtlebot2", task, net, "skrl")


def test_rl_games_policy_of_valves_gives_the_same_commands_as_a_bundle(tmp_path):
    net = foreign.network(8 + 8, 16, activation="tanh")
    path = foreign.save_rl_games(tmp_path / "last.pth", net, valves=8)
    passport = import_policy(
        path, tmp_path / "out", robot_name="floating_platform", task_name="go_to_pose", activation="tanh"
    )
    assert (passport.action, passport.memory, passport.control_hz) == ("on_off", 8, 5.0)
    _compare(tmp_path / "out", "floating_platform", "go_to_pose", net, "rl_games")


def test_activation_comes_from_the_agent_yaml_of_the_run(tmp_path):
    (tmp_path / "params").mkdir()
    (tmp_path / "nn").mkdir()
    (tmp_path / "params" / "agent.yaml").write_text(
        "params: {network: {mlp: {units: [16], activation: relu}}}\n"
    )
    net = foreign.network(6 + 2, 2, activation="relu")
    path = foreign.save_rl_games(tmp_path / "nn" / "last.pth", net)
    passport = import_policy(path, tmp_path / "out", robot_name="kingfisher", task_name="go_to_position")
    assert passport.training["activation"] == "relu"
    _compare(tmp_path / "out", "kingfisher", "go_to_position", net, "rl_games")


def test_skrl_agent_yaml_names_both_activations(tmp_path):
    (tmp_path / "checkpoints").mkdir()
    (tmp_path / "params").mkdir()
    (tmp_path / "params" / "agent.yaml").write_text(
        "models: {policy: {network: [{name: net, layers: [16], activations: elu}], output: tanh(ACTIONS)}}\n"
    )
    net = foreign.network(8, 2, tanh_output=True)
    path = foreign.save_skrl(tmp_path / "checkpoints" / "agent_9.pt", net)
    training = import_policy(
        path, tmp_path / "out", robot_name="turtlebot2", task_name="go_to_position"
    ).training
    assert (training["activation"], training["output_activation"]) == ("elu", "tanh")


@pytest.mark.parametrize(
    "save", [pytest.param(foreign.export_onnx, marks=pytest.mark.slow), foreign.write_onnx]
)
def test_onnx_policy_of_one_row_gives_the_same_commands_as_a_bundle(save, tmp_path):
    net = foreign.network(6 + 2, 2)
    path = save(tmp_path / "policy.onnx", net)
    passport = import_policy(path, tmp_path / "out", robot_name="kingfisher", task_name="track_velocities")
    assert passport.training["imported_from"] == "onnx"
    _compare(tmp_path / "out", "kingfisher", "track_velocities", net, "onnx")


def test_passport_names_the_source_and_golden_vectors_cover_the_last_actions(tmp_path):
    net = foreign.network(8, 2)
    path = foreign.save_skrl(tmp_path / "agent.pt", net)
    import_policy(
        path,
        tmp_path / "out",
        robot_name="turtlebot2",
        task_name="go_to_position",
        control_hz=10.0,
        activation="elu",
    )
    training = read_passport(tmp_path / "out").training
    assert training["source"] == "agent.pt"
    assert len(training["source_sha256"]) == 64
    golden = read_golden(tmp_path / "out")
    assert golden.observations[:64].shape == (64, 10)  # our terms, two of them the previous commands
    assert len(golden.observations) == 64 + 4  # both limits of two wheels: an untrained network is near none
    assert np.abs(golden.memories[32:]).max() > 0.0


class Mine:
    """A file of this creates another file when it is unpickled."""

    def __init__(self, path):
        self._path = path

    def __reduce__(self):
        return os.mkdir, (str(self._path),)


@pytest.mark.parametrize("legacy", [True, False])
def test_pickled_code_is_refused_and_does_not_run(legacy, tmp_path):
    path, trace = tmp_path / "agent.pt", tmp_path / "it_ran"
    torch.save({"policy": Mine(trace)}, path, _use_new_zipfile_serialization=not legacy)
    with pytest.raises(
        ConfigError, match=r"holds the Python object '(posix|os)\.mkdir'.*nothing was executed"
    ):
        import_policy(
            path, tmp_path / "out", robot_name="turtlebot2", task_name="go_to_position", activation="elu"
        )
    assert not trace.exists()
    assert not (tmp_path / "out").exists()
    torch.load(path, weights_only=False)  # so that the test could have failed
    assert trace.exists()


@pytest.mark.parametrize(
    ("robot", "task", "activation", "message"),
    [
        ("turtlebot2", "go_to_position", None, "Give --activation, one of elu, relu"),
        ("turtlebot2", "go_to_position", "eluu", "Did you mean 'elu'"),
        ("turtlebot2", "go_to_pose", "elu", "the network takes 8 terms.* has 10"),
        ("floating_platform", "go_to_position", "elu", "gives 2 numbers, 'floating_platform' needs 16"),
        ("turtlebot2", "push_block", "elu", "RoboRAN's observation of 'push_block' is not supported"),
    ],
)
def test_what_does_not_fit_is_refused_with_what_does(robot, task, activation, message, tmp_path):
    path = foreign.save_skrl(tmp_path / "agent.pt", foreign.network(8, 2))
    with pytest.raises(ConfigError, match=message):
        import_policy(path, tmp_path / "out", robot_name=robot, task_name=task, activation=activation)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"weights": torch.zeros(2)}, "is no checkpoint of skrl .* it holds weights"),
        ({"policy": {"lstm.weight_hh_l0": torch.zeros(8, 2)}}, "recurrent or convolutional"),
        (
            {"policy": {"net.0.weight": torch.zeros(8, 8), "net.1.weight": torch.zeros(8)}},
            "normalises a layer",
        ),
        (
            {"policy": {"net.0.weight": torch.zeros(4, 8), "out.weight": torch.zeros(2, 5)}},
            "layer 2 takes 5 numbers",
        ),
        ({"policy": {"net.0.weight": torch.full((2, 8), math.nan)}}, "not finite"),
        ({"policy": {}}, "has no layers"),
        ({"policy": [torch.zeros(2)]}, "'policy' must hold a state dictionary"),
        ({"policy": {1: torch.zeros(2, 8)}}, "'policy' must hold a state dictionary"),
        ({"policy": {"net.weight": torch.zeros(2, 8).to_sparse()}}, "of dense tensors"),
        (
            {"policy": {"net.weight": torch.zeros(2, 8)}, "state_preprocessor": torch.zeros(2)},
            "'state_preprocessor' must",
        ),
        (
            {"policy": {"net.weight": torch.zeros(2, 8)}, "state_preprocessor": {"mean": torch.zeros(8)}},
            "lack 'running_mean'",
        ),
        ({"model": {"a2c_network.actor_mlp.0.weight": torch.zeros(2, 8)}}, "it is no policy"),
    ],
)
def test_checkpoints_that_are_no_feed_forward_policy_are_refused(content, message, tmp_path):
    torch.save(content, tmp_path / "agent.pt")
    with pytest.raises(ConfigError, match=message):
        import_policy(
            tmp_path / "agent.pt",
            tmp_path / "out",
            robot_name="turtlebot2",
            task_name="go_to_position",
            activation="elu",
        )


@pytest.mark.parametrize("name", ["agent.pt", "policy.onnx"])
def test_files_that_are_no_policy_are_refused(name, tmp_path):
    (tmp_path / name).write_bytes(b"no policy at all")
    with pytest.raises(ConfigError, match=r"is no (checkpoint|ONNX model)"):
        import_policy(tmp_path / name, tmp_path / "out", robot_name="turtlebot2", task_name="go_to_position")


def test_onnx_with_weights_in_other_files_is_refused(tmp_path):
    path = tmp_path / "policy.onnx"
    model = onnx.load_model(foreign.write_onnx(path, foreign.network(8, 2), opset=18))
    onnx.save_model(model, path, save_as_external_data=True, location="elsewhere", size_threshold=0)
    with pytest.raises(ConfigError, match="keeps weights in other files"):
        import_policy(path, tmp_path / "out", robot_name="turtlebot2", task_name="go_to_position")


def test_a_bundle_is_not_overwritten(tmp_path):
    (tmp_path / "passport.json").write_text("{}")
    with pytest.raises(ConfigError, match="holds a bundle already"):
        import_policy(tmp_path / "agent.pt", tmp_path, robot_name="turtlebot2", task_name="go_to_position")


def test_imported_policy_drives_the_base_to_its_goals_in_mujoco(tmp_path):
    """A hand-made network of RoboRAN's terms: ahead where it faces the goal, and turning to it."""
    net = torch.nn.Sequential(torch.nn.Linear(8, 3), torch.nn.ReLU(), torch.nn.Linear(3, 2))
    ahead, left, right = torch.zeros(3, 8)
    ahead[0], ahead[1] = 2.0, 5.0  # distance and cosine of the bearing
    left[2], right[2] = 2.0, -2.0  # sine of the bearing
    with torch.no_grad():
        net[0].weight.copy_(torch.stack((ahead, left, right)))
        net[0].bias.copy_(torch.tensor([-5.0, 0.0, 0.0]))
        net[2].weight.copy_(torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, -1.0]]))
        net[2].bias.zero_()
    torch.save({"policy": net.state_dict(), "state_preprocessor": {}}, tmp_path / "agent.pt")
    import_policy(
        tmp_path / "agent.pt",
        tmp_path / "out",
        robot_name="turtlebot2",
        task_name="go_to_position",
        activation="relu",
    )
    robot, task = load_robot("turtlebot2"), load_task("go_to_position")
    policy = Policy(tmp_path / "out", robot, task)
    world = load_scenario("nominal")
    trajectories = roll_out_in_backends(
        policy, lambda: MujocoBackend.of(robot, task, world), task, world, episodes=2, seed=EVALUATION_SEED
    )
    assert summary(trajectories, task)["success_rate"] == 1.0
