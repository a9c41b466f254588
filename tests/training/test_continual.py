"""One network that learns task after task: what it is given, what stays, and what a run folder holds."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.continual import STAGE_FILE, learn_tasks
from training.continual_plan import RECORD_FILE, continual_plan
from training.export import export
from training.joint_network import JointNetwork, network_of_task, normalised
from training.joint_worlds import JointInputs, JointWorlds
from training.learners import build_learner, callbacks_of
from training.network import load_network
from training.request import TrainingRequest
from training.run_folder import NETWORK_FILE
from training.settings import Annealing
from training.vec_env import BatchVecEnv

POSITION, VELOCITY = "go_to_position", "track_velocities"
REQUEST = TrainingRequest(
    "floating_platform", POSITION, 3, 1, None, 2, None, None, None, None, 4, None, None, "local", None, False, "fulmar"
)  # fmt: skip


class Silent:
    """A watcher that shows nothing."""

    def __init__(self, task: str) -> None:
        self.task = task

    def begin(self) -> None:
        pass

    def advance(self, share: float, elapsed_s: float, steps: int) -> None:
        pass

    def evaluated(self, elapsed_s: float, success: float) -> None:
        pass

    def end(self) -> None:
        pass


@pytest.fixture
def part_of(robot):
    """Normalised worlds of a task."""

    def make(task, statistics=None):
        worlds = BatchVecEnv(robot, load_task(task), load_scenario("nominal"), worlds=16, seed=3)
        return normalised(worlds, 0.99, statistics)

    return make


def inputs_of(parts):
    inputs = JointInputs()
    for task, part in parts.items():
        inputs = inputs.with_task(task, part.venv.simulation.observer.names)
    return inputs


@pytest.fixture
def parts(part_of):
    return {task: part_of(task) for task in (POSITION, VELOCITY)}


@pytest.fixture
def joint(parts, small_settings):
    """A learner of two tasks after some updates, its inputs and its parts."""
    inputs = inputs_of(parts)
    learner = build_learner(small_settings.algorithm, JointWorlds(parts, inputs), seed=3)
    learner.learn(32 * 16 * 3, callback=callbacks_of(learner))
    return learner, inputs, parts


def rows_of(joint, task):
    """Raw observations of a task, and the same as inputs of the joint network."""
    _, inputs, parts = joint
    raw = np.asarray(parts[task].venv.simulation.observe())
    rows = np.zeros((len(raw), len(inputs.names)), dtype=np.float32)
    rows[:, inputs.columns(task)] = parts[task].normalize_obs(raw)
    rows[:, inputs.label(task)] = 1.0
    return raw, rows


def test_terms_of_one_name_share_a_column_and_each_task_has_a_label(parts):
    inputs = inputs_of(parts)
    shared = {"velocity_x_in_body", "velocity_y_in_body", "yaw_rate"}
    assert len(set(inputs.names)) == len(inputs.names)
    assert shared <= set(np.array(inputs.names)[inputs.columns(POSITION)])
    assert shared <= set(np.array(inputs.names)[inputs.columns(VELOCITY)])
    assert inputs.names[: len(inputs.columns(POSITION)) + 1] == (*inputs.terms[POSITION], POSITION)


def test_worlds_of_a_task_show_its_terms_its_label_and_nothing_else(parts):
    inputs = inputs_of(parts)
    worlds = JointWorlds(parts, inputs)
    for rows in (worlds.reset(), worlds.step(np.zeros((32, 8)))[0]):
        for task, own in ((POSITION, rows[:16]), (VELOCITY, rows[16:])):
            others = np.setdiff1d(np.arange(len(inputs.names)), [*inputs.columns(task), inputs.label(task)])
            assert (own[:, inputs.label(task)] == 1.0).all()
            assert (own[:, others] == 0.0).all()
            assert own[:, inputs.columns(task)].any()


def test_the_last_observation_of_an_episode_has_the_inputs_of_its_task(parts):
    inputs = inputs_of(parts)
    worlds = JointWorlds(parts, inputs)
    worlds.reset()
    for _ in range(200):
        _, _, dones, infos = worlds.step(np.zeros((32, 8)))
        ended = np.flatnonzero(dones[16:])
        if ended.size:
            last = infos[16 + ended[0]]["terminal_observation"]
            assert last.shape == (len(inputs.names),)
            assert last[inputs.label(VELOCITY)] == 1.0
            return
    pytest.fail("no episode ended")


@pytest.mark.parametrize("task", [POSITION, VELOCITY])
def test_the_network_of_a_task_answers_as_the_joint_one_does_with_its_label(joint, task):
    learner, inputs, parts = joint
    raw, rows = rows_of(joint, task)
    command, _ = network_of_task(learner, inputs, task, parts[task])(torch.from_numpy(raw).float())
    expected, _ = learner.predict(rows, deterministic=True)
    assert expected.any()
    assert (command.numpy() == expected).mean() > 0.99  # a logit within rounding of 0 may differ


def test_a_further_task_leaves_the_networks_of_the_earlier_ones_as_they_are(
    joint, part_of, small_settings, tmp_path
):
    learner, inputs, parts = joint
    JointNetwork.of(learner, inputs, parts).save(tmp_path / "joint.pt")
    before = JointNetwork.load(tmp_path / "joint.pt")
    again = {task: part_of(task, before.statistics[task]) for task in parts} | {
        "go_to_pose": part_of("go_to_pose")
    }
    grown = before.inputs.with_task("go_to_pose", again["go_to_pose"].venv.simulation.observer.names)
    other = build_learner(small_settings.algorithm, JointWorlds(again, grown), seed=9)
    before.begin(other)
    for task, part in parts.items():
        raw = torch.from_numpy(np.asarray(part.venv.simulation.observe())).float()
        one, two = (
            network_of_task(which, names, task, worlds[task])(raw)[1]
            for which, names, worlds in ((learner, inputs, parts), (other, grown, again))
        )
        torch.testing.assert_close(one, two, rtol=1e-5, atol=1e-5)


def test_rehearsal_does_not_change_how_learned_tasks_are_seen(part_of, small_settings):
    frozen = part_of(POSITION, torch.stack((torch.full((8,), 0.5), torch.full((8,), 4.0))).double())
    parts = {POSITION: frozen, VELOCITY: part_of(VELOCITY)}
    worlds = JointWorlds(parts, inputs_of(parts))
    worlds.reset()
    for _ in range(5):
        worlds.step(np.ones((32, 8)))
    assert (frozen.obs_rms.mean == 0.5).all()
    assert (parts[VELOCITY].obs_rms.mean != 0.0).any()


@pytest.fixture
def small_plan(small_settings, tmp_path, monkeypatch):
    """Plan of a training that takes a second a stage."""
    monkeypatch.setattr("training.request.load_training_settings", lambda *_: small_settings)

    def make(*further, **changed):
        request = replace(REQUEST, **({"out": tmp_path / "run"} | changed))
        return continual_plan(request, further, None)

    return make


def test_each_learned_task_can_be_exported_after_each_stage(small_plan, tmp_path):
    done = learn_tasks(small_plan(VELOCITY), Silent)
    assert [list(stage["mujoco"]) for stage in done.stages] == [[POSITION], [POSITION, VELOCITY]]
    assert json.loads((done.out / RECORD_FILE).read_text()) == json.loads(json.dumps(done.record))
    for task in (POSITION, VELOCITY):
        export(done.out / task, tmp_path / task)
        assert read_passport(tmp_path / task).task == task


def test_a_broken_off_stage_is_learned_again_and_a_further_task_is_added(small_plan, tmp_path):
    class Interrupting(Silent):
        def advance(self, share: float, elapsed_s: float, steps: int) -> None:
            if self.task == VELOCITY:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        learn_tasks(small_plan(VELOCITY), Interrupting)
    run = tmp_path / "run"
    first = (run / POSITION / NETWORK_FILE).read_bytes()
    resumed = partial(small_plan, robot=None, task=None, updates=None, out=None, resume=run)
    assert [stage["task"] for stage in resumed().stages] == [POSITION]
    assert resumed().tasks == (POSITION, VELOCITY)
    assert (run / POSITION / NETWORK_FILE).read_bytes() == first
    done = learn_tasks(resumed("go_to_pose"), Silent)
    assert [stage["task"] for stage in done.stages] == [POSITION, VELOCITY, "go_to_pose"]
    assert [stage["updates"] for stage in done.stages] == [2, 2, 2]
    assert load_network(run / "go_to_pose" / NETWORK_FILE).plan.inputs == 10
    assert {path.name for path in run.glob("stage_*")} == {STAGE_FILE.format(number) for number in (1, 2, 3)}


def test_one_seed_gives_one_network(small_plan, tmp_path):
    for name in ("one", "two"):
        learn_tasks(small_plan(VELOCITY, out=tmp_path / name), Silent)
    one, two = (load_network(tmp_path / name / POSITION / NETWORK_FILE) for name in ("one", "two"))
    for mine, theirs in zip(one.state_dict().values(), two.state_dict().values(), strict=True):
        assert torch.equal(mine, theirs)


@pytest.mark.parametrize(
    ("further", "changed", "words"),
    [
        (["go_to_position"], {}, "'go_to_position' is learned already"),
        (["go_to_positon"], {}, "go_to_position"),
        (["go_to_pose_3d"], {}, "floating_platform"),
        (["go_to_pose"], {"seeds": 3}, "leave --seeds out"),
        (["go_to_pose"], {"wandb": True}, "leave --wandb out"),
        (["go_to_pose"], {"stop_at_success": 0.9}, "leave --stop-at-success out"),
        (["go_to_pose"], {"settings": "recurrent_ppo"}, "learns by ppo"),
    ],
)
def test_what_cannot_be_learned_task_after_task_is_refused_in_one_line(further, changed, words, tmp_path):
    with pytest.raises(ConfigError, match=words):
        continual_plan(replace(REQUEST, out=tmp_path / "run", **changed), further, None)
    assert not (tmp_path / "run").exists()


def test_settings_of_one_task_alone_are_refused(small_settings, monkeypatch):
    annealed = replace(small_settings, annealing=Annealing(0.1, 0.9, 1.0, 0.0))
    monkeypatch.setattr("training.request.load_training_settings", lambda *_: annealed)
    with pytest.raises(ConfigError, match="the settings have 'annealing', which is for one task alone"):
        continual_plan(REQUEST, [VELOCITY], None)


def test_a_run_of_one_task_is_not_continued(run):
    with pytest.raises(ConfigError, match="was trained at one task: begin anew with --continue-with"):
        continual_plan(replace(REQUEST, robot=None, task=None, resume=run[0]), ["go_to_pose"], None)
