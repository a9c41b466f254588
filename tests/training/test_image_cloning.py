"""Learning to see a berth: the law in the graph, what is learned, and the bundle of it; most without a renderer."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.controller import Inputs
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import summary
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from policy_server.policy import Policy
from sim_nodes.sight import CameraSight
from training import image_cloning
from training.export import export
from training.image_cloning import Learner, drawn_views, plan_of, seen_from, train_from_images
from training.image_network import ImageController, ImageNetwork
from training.network import load_network
from training.run_folder import NETWORK_FILE
from training.settings import load_training_settings

ROBOT, TASK = load_robot("cubesat_8"), load_task("dock")
SHIPPED = load_training_settings(ROBOT, TASK)
SMALL = replace(
    SHIPPED,
    worlds=2,
    algorithm=replace(
        SHIPPED.algorithm,
        channels=(4, 4, 4, 4),
        features=8,
        views=64,
        buffer=128,
        flights=2,
        minibatch=16,
        gradient_steps=5,
    ),
)
SHORT = replace(TASK, episode_s=1.0, tolerance=replace(TASK.tolerance, hold_s=0.3))


class Numbers:
    """Stands for a camera: six patches of an image are as far as six numbers of the pose say."""

    def __init__(self, _robot, task, camera):
        self._task, self._size = task, (camera.height, camera.width)

    def __call__(self, state, _things=None):
        count = len(np.asarray(state.x))
        goal = image_cloning.goals_at(np.tile(np.array(self._task.berth), (count, 1)))
        depth = np.full((count, *self._size), 2.0, np.float32)
        for i, number in enumerate(seen_from(state, goal).T):
            depth[:, :, 10 * i : 10 * i + 8] = 0.5 / np.clip(1.0 + 0.5 * number, 0.1, 4.0)[:, None, None]
        return {"camera_depth": depth}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


class Silent:
    def begin(self):
        pass

    end = begin

    def advance(self, *_):
        pass

    evaluated = advance


class KnowsThePose(ImageController):
    """The network's law, with the true pose in the place of a seen one."""

    readings = ()

    def __init__(self, network):
        super().__init__(network, ROBOT, TASK, 10.0)
        self.readings = ()

    def act(self, inputs: Inputs):
        pose = torch.as_tensor(seen_from(inputs.state, inputs.goal))
        shares = self._network.shares(torch.as_tensor(inputs.observation, dtype=torch.float32), pose)
        return shares.clamp(0.0, 1.0).numpy()


def network(settings=SMALL):
    made = ImageNetwork(plan_of(ROBOT, settings.algorithm))
    made.take_allocation(ROBOT)
    return made


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    out = tmp_path_factory.mktemp("seen")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(image_cloning, "CameraSight", Numbers)
        record = train_from_images(ROBOT, SHORT, SMALL, seed=3, out=out, updates=2, watcher=Silent())
    return out, record


def test_the_law_docks_every_time_on_the_true_pose():
    near = replace(TASK, episode_s=16.0, start=replace(TASK.start, behind=(0.2, 0.6), aside=0.2))
    flights = roll_out_in_batch(
        KnowsThePose(network()), ROBOT, near, load_scenario("nominal"), episodes=4, seed=5
    )
    assert summary(flights, near)["success_rate"] == 1.0


def test_nozzles_share_the_wanted_wrench_and_none_pulls():
    made, random = network(), np.random.default_rng(1)
    seen = torch.as_tensor(random.normal(0.0, 0.02, (50, 6)), dtype=torch.float32)
    pose = torch.as_tensor(random.normal(0.0, 0.1, (50, 6)), dtype=torch.float32)
    shares = made.shares(seen, pose).detach().numpy()
    assert shares.min() >= -1e-6
    actuators = ROBOT.actuators
    wrench = shares @ (actuators.full_thrust[:, None] * actuators.wrench_per_newton)
    law = made.plan.law
    way, turn = pose.numpy()[:, :3], pose.numpy()[:, 3:]
    way = way * np.minimum(1.0, law.way / np.linalg.norm(way, axis=1, keepdims=True))
    turn = turn * np.minimum(1.0, law.turn / np.linalg.norm(turn, axis=1, keepdims=True))
    force = law.position * way - law.velocity * seen.numpy()[:, :3]
    torque = law.attitude * turn - law.rate * seen.numpy()[:, 3:]
    for wanted, found, most in ((force, wrench[:, :3], law.force), (torque, wrench[:, 3:], law.torque)):
        cut = np.minimum(1.0, most / np.linalg.norm(wanted, axis=1, keepdims=True))
        np.testing.assert_allclose(found, cut * wanted, atol=2e-5)


def test_views_are_drawn_beyond_every_start_and_past_the_berth():
    state, goal = drawn_views(TASK, 2000, np.random.default_rng(1))
    away = seen_from(state, goal)
    assert away[:, 0].min() < 0.0
    assert away[:, 0].max() > TASK.start.behind[1]
    assert np.median(np.linalg.norm(away[:, :3], axis=1)) < 1.2


def test_errors_of_the_seen_pose_fall_while_it_learns():
    sight = Numbers(ROBOT, TASK, plan_of(ROBOT, SMALL.algorithm).image.camera)
    more = replace(SMALL.algorithm, views=256, buffer=512, gradient_steps=60, learning_rate=5e-3)
    learner = Learner(ROBOT, SHORT, replace(SMALL, algorithm=more), sight, 1)
    losses = [learner.update(number, 0.0) for number in range(3)]
    assert losses[-1] < 0.7 * losses[0]


def test_a_run_leaves_the_best_network_and_its_record(run):
    out, record = run
    assert (record["robot"], record["task"], record["updates"]) == ("cubesat_8", "dock", 2)
    assert record["steps"] == SMALL.worlds * 10
    assert record["best"]["score"] == max(check["score"] for check in record["curve"])
    assert record["settings"]["algorithm"]["kind"] == "clone"
    assert load_network(out / NETWORK_FILE).plan == plan_of(ROBOT, SMALL.algorithm)


def test_one_seed_gives_one_network(run, tmp_path, monkeypatch):
    monkeypatch.setattr(image_cloning, "CameraSight", Numbers)
    train_from_images(ROBOT, SHORT, SMALL, seed=3, out=tmp_path, updates=2, watcher=Silent())
    first, again = (load_network(folder / NETWORK_FILE).state_dict() for folder in (run[0], tmp_path))
    assert all(torch.equal(first[name], again[name]) for name in first)


@pytest.mark.slow
def test_its_bundle_holds_images_and_acts_as_torch_does(run, tmp_path, monkeypatch):
    monkeypatch.setattr("sim_nodes.sight.CameraSight", Numbers)
    passport = export(run[0], tmp_path / "bundle")
    assert passport.image == plan_of(ROBOT, SMALL.algorithm).image
    policy, net = Policy(tmp_path / "bundle", ROBOT, TASK), load_network(run[0] / NETWORK_FILE)
    depth = np.random.default_rng(1).uniform(0.05, 9.0, (20, 240, 320)).astype(np.float32)
    depth[:, 50:60] = np.inf
    seen = np.random.default_rng(2).normal(0.0, 0.1, (20, 6))
    inputs = Inputs(
        TASK.state_type.unknown(), None, seen, np.zeros((20, 8)), None, 0, 0.1, {"camera_depth": depth}
    )
    np.testing.assert_allclose(
        policy.act(inputs), ImageController(net, ROBOT, TASK, 10.0).act(inputs), atol=1e-5
    )


@pytest.mark.parametrize(
    ("robot", "words"),
    [
        (load_robot("spacecraft_16"), "'spacecraft_16' has no camera to learn from"),
        (
            replace(load_robot("spacecraft_16"), sensors=ROBOT.sensors),
            "'spacecraft_16': a policy that sees steers nozzles that open by degrees",
        ),
        (
            replace(
                ROBOT,
                sensors=replace(ROBOT.sensors, camera=replace(ROBOT.sensors.camera, width=321, height=240)),
            ),
            "images of 'cubesat_8': 'every' = 5 must be odd, and divide 321 and 240",
        ),
    ],
)
def test_a_robot_that_cannot_be_steered_so_is_refused(robot, words):
    with pytest.raises(ConfigError, match=words):
        ImageNetwork(plan_of(robot, SMALL.algorithm)).take_allocation(robot)


def test_its_network_is_for_no_other_robot(run, tmp_path):
    with pytest.raises(ConfigError, match="this network is not for 'spacecraft_16'"):
        export(run[0], tmp_path, "spacecraft_16")


def test_a_task_without_a_berth_is_refused(tmp_path):
    with pytest.raises(
        ConfigError, match="tasks with a berth that a camera sees, such as dock, not 'go_to_pose_3d'"
    ):
        train_from_images(
            ROBOT, load_task("go_to_pose_3d"), SMALL, seed=1, out=tmp_path, updates=1, watcher=Silent()
        )


def test_what_the_compiler_of_torch_needs_is_there_before_any_renderer():
    """Imported later it would end the process."""
    assert "torch._dynamo" in sys.modules


@pytest.mark.slow
def test_a_process_that_learns_outlives_its_renderer():
    """Without the import in `training.image_network` an optimiser that is made after a renderer ends it by SIGSEGV."""
    program = (
        "from tests.training.test_image_cloning import *\n"
        "with CameraSight(ROBOT, TASK, plan_of(ROBOT, SMALL.algorithm).image.camera) as sight:\n"
        "    Learner(ROBOT, SHORT, SMALL, sight, 1).update(1, 0.0)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=100, check=False
    )
    assert done.returncode == 0, done.stderr[-500:]


def test_from_the_berth_the_camera_sees_the_port_25_cm_before_it():
    straight = replace(TASK, start=replace(TASK.start, aside=0.0, tilt_deg=0.0))
    state, goal = drawn_views(straight, 1, np.random.default_rng(1))
    away = float(seen_from(state, goal)[0, 0])
    with CameraSight(ROBOT, TASK, plan_of(ROBOT, SMALL.algorithm).image.camera) as sight:
        depth = sight(state)["camera_depth"][0]
    assert depth.shape == (48, 64)
    assert depth[24, 32] == pytest.approx(away + 0.25, abs=1e-4)
    assert np.isinf(depth).any()
