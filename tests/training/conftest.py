"""One small training run and one small learner, shared by every test here."""

from __future__ import annotations

import shutil
from dataclasses import replace

import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

pytest.importorskip("stable_baselines3")


@pytest.fixture(scope="session")
def robot():
    return load_robot("floating_platform")


@pytest.fixture(scope="session")
def task():
    return load_task("go_to_pose")


@pytest.fixture(scope="session")
def small_settings():
    """The shipped settings, cut to what takes a second."""
    from training.settings import load_training_settings

    settings = load_training_settings(load_robot("floating_platform"), load_task("go_to_pose"))
    ppo = replace(settings.algorithm, steps=16, minibatch=128, epochs=2, hidden=(16, 16))
    return replace(settings, algorithm=ppo, worlds=32, time_limit_s=2.0, evaluate_every_s=1.0)


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """As in a run: threads that wait for each other while others compute take ten times as long."""
    import torch

    torch.set_num_threads(1)


@pytest.fixture(scope="session", autouse=True)
def few_episodes():
    """Check learners on few episodes: what is tested here is not how good they are."""
    from training import evaluator

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluator, "EPISODES", 8)
        yield


@pytest.fixture(scope="session")
def run(robot, task, small_settings, tmp_path_factory):
    """Run folder of a training that was stopped by its time limit, and the record that `train` returned."""
    from training.train import train

    folder = tmp_path_factory.mktemp("run")
    record = train(
        robot, task, small_settings, seed=3, out=folder, command="fulmar train", git_revision="abc"
    )
    return folder, record


@pytest.fixture(scope="session")
def learner(robot, task, small_settings):
    """A PPO after a few updates, with its normaliser."""
    from stable_baselines3.common.vec_env import VecNormalize

    from training.learners import build_learner, callbacks_of
    from training.vec_env import BatchVecEnv

    worlds = BatchVecEnv(robot, task, load_scenario("uncertain"), worlds=32, seed=3)
    env = VecNormalize(worlds, norm_reward=False)
    ppo = build_learner(small_settings.algorithm, env, seed=3)
    ppo.learn(32 * 16 * 4, callback=callbacks_of(ppo))
    return ppo, env


@pytest.fixture(scope="session")
def bundle(run, learner, tmp_path_factory):
    """Bundle of the learner's network, exported from a run folder."""
    from training.deploy import deployed_network
    from training.export import export
    from training.network import save_network

    folder = shutil.copytree(run[0], tmp_path_factory.mktemp("exported") / "run")
    save_network(deployed_network(*learner, [1.0] * 8), folder / "network.pt")
    out = tmp_path_factory.mktemp("bundle")
    return out, export(folder, out)
