"""Task after task: one policy keeps what each network knows, and what a run folder holds."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from training import distillation
from training.continual import learn_tasks
from training.continual_plan import ALONE_FOLDER, RECORD_FILE, continual_plan
from training.distillation import distil
from training.export import export
from training.joint_policy import JointPolicy
from training.network import DeployedNetwork, NetworkPlan, load_network
from training.progress import DistillationBar
from training.request import TrainingRequest
from training.run_folder import NETWORK_FILE, SETTINGS_FILE, read_run_record
from training.settings import write_training_settings
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
def terms(robot):
    return {task: Observer(robot, load_task(task)).names for task in (POSITION, VELOCITY)}


def drawn_networks(robot, terms, decision="threshold"):
    """Networks of tasks with weights of a seed, whose commands differ from one observation to the next."""
    made, scale = {}, tuple(map(float, robot.actuators.scale))
    for seed, (task, names) in enumerate(terms.items()):
        torch.manual_seed(seed)
        made[task] = DeployedNetwork(NetworkPlan(len(names), (8,), len(scale), "tanh", decision, scale, 10.0))
        made[task].mean.fill_(0.1 * seed)
        made[task].scale.fill_(0.5)
        for value in made[task].layers.state_dict().values():
            value.mul_(3.0)
    return made


@pytest.fixture
def networks(robot, terms):
    return drawn_networks(robot, terms)


def observations(terms, rows=64):
    return np.random.default_rng(3).normal(size=(rows, terms)).astype(np.float32)


def test_terms_of_one_name_share_an_input_and_each_task_has_a_label(terms):
    policy = JointPolicy(terms, (8,), 8)
    shared = {"velocity_x_in_body", "velocity_y_in_body", "yaw_rate"}
    assert shared <= set(terms[POSITION]) & set(terms[VELOCITY])
    assert len(policy.inputs) == len(set(policy.inputs)) == len({*terms[POSITION], *terms[VELOCITY]}) + 2
    one = policy.features(VELOCITY, torch.ones(1, len(terms[VELOCITY])))[0]
    assert {name for name, value in zip(policy.inputs, one, strict=True) if value} == {
        *terms[VELOCITY],
        VELOCITY,
    }


@pytest.mark.parametrize("task", [POSITION, VELOCITY])
def test_the_network_of_a_task_answers_as_the_policy_does_with_its_label(task, terms, networks):
    policy = JointPolicy(terms, (16, 16), 8)
    seen = observations(len(terms[task]))
    command, raw = policy.network_of(task, networks[task])(torch.from_numpy(seen))
    expected = policy(policy.features(task, networks[task].normalised(torch.from_numpy(seen))))
    torch.testing.assert_close(raw, expected, rtol=1e-5, atol=1e-5)
    assert torch.equal(command, (raw > 0.0).float())


def test_tasks_share_all_layers_after_the_first(terms, networks):
    policy = JointPolicy(terms, (16, 16), 8)
    one, two = (policy.network_of(task, network).layers for task, network in networks.items())
    for mine, theirs in zip(list(one)[2:], list(two)[2:], strict=True):
        for name, value in mine.state_dict().items():
            assert torch.equal(value, theirs.state_dict()[name])


@pytest.mark.parametrize(
    ("name", "decision"),
    [
        ("floating_platform", "threshold"),
        pytest.param("kingfisher", "clamp", marks=pytest.mark.slow),
        pytest.param("kingfisher", "squash", marks=pytest.mark.slow),
    ],
)
def test_one_policy_learns_to_answer_as_the_networks_of_two_tasks_do(name, decision, monkeypatch):
    minibatches = 40 if decision == "threshold" else 150  # signs are learned sooner than values
    sizes = {"ROUNDS": 8, "STEPS": 4, "WORLDS": 64, "MINIBATCHES": minibatches, "ROWS": 256}
    for size, value in sizes.items():
        monkeypatch.setattr(distillation, size, value)
    robot, nominal, shares = load_robot(name), load_scenario("nominal"), []
    tasks = {task: load_task(task) for task in (POSITION, VELOCITY)}
    networks = drawn_networks(
        robot, {task: Observer(robot, each).names for task, each in tasks.items()}, decision
    )
    same = partial(
        distil, networks, robot, tasks, dict.fromkeys(networks, nominal),
        hidden=(32, 32), seed=3, advance=shares.append,
    )  # fmt: skip
    kept = same()
    assert shares == [(number + 1) / 8 for number in range(8)]
    for task, network in networks.items():
        worlds = BatchVecEnv(robot, tasks[task], nominal, worlds=64, seed=9)
        seen = torch.from_numpy(worlds.reset())
        close = (kept[task](seen)[0] - network(seen)[0]).abs() < 0.3
        assert close.float().mean() > 0.85, task
    again = same()
    assert all(torch.equal(kept[task].layers[0].weight, again[task].layers[0].weight) for task in networks)


@pytest.fixture
def small_plan(small_settings, tmp_path, monkeypatch):
    """Plan of a training that takes little."""
    for module in ("request", "continual_plan"):
        monkeypatch.setattr(f"training.{module}.load_training_settings", lambda *_: small_settings)
    monkeypatch.setattr(distillation, "ROUNDS", 1)
    monkeypatch.setattr(distillation, "WORLDS", 16)

    def make(*further, **changed):
        return continual_plan(replace(REQUEST, **({"out": tmp_path / "run"} | changed)), further)

    return make


def learn(plan, watcher=Silent):
    return learn_tasks(plan, watcher, lambda share: None)


@pytest.mark.slow
def test_each_learned_task_can_be_exported_after_each_stage(small_plan, tmp_path):
    done = learn(small_plan(VELOCITY))
    assert [list(stage["mujoco"]) for stage in done.stages] == [[POSITION], [POSITION, VELOCITY]]
    assert json.loads((done.out / RECORD_FILE).read_text()) == json.loads(json.dumps(done.record))
    for task in (POSITION, VELOCITY):
        export(done.out / task, tmp_path / task)
        passport = read_passport(tmp_path / task)
        assert (passport.task, passport.training["learned_tasks"]) == (task, [POSITION, VELOCITY])


class Interrupting(Silent):
    """The user ends the training at the second task."""

    def advance(self, share: float, elapsed_s: float, steps: int) -> None:
        if self.task == VELOCITY:
            raise KeyboardInterrupt


@pytest.mark.slow
def test_a_broken_off_stage_is_resumed_and_a_further_task_is_added(small_plan, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        learn(small_plan(VELOCITY), Interrupting)
    run = tmp_path / "run"
    first = (run / POSITION / NETWORK_FILE).read_bytes()
    resumed = partial(small_plan, robot=None, task=None, updates=None, out=None, seed=1, resume=run)
    assert [stage["task"] for stage in resumed().stages] == [POSITION]
    assert resumed().tasks == (POSITION, VELOCITY)
    assert (run / POSITION / NETWORK_FILE).read_bytes() == first
    done = learn(resumed("go_to_pose"))
    assert [stage["task"] for stage in done.stages] == [POSITION, VELOCITY, "go_to_pose"]
    assert [stage["training"]["updates"] for stage in done.stages] == [2, 2, 2]
    assert load_network(run / "go_to_pose" / NETWORK_FILE).plan.inputs == 10


def test_the_plan_of_a_run_is_resumed_with_a_further_task(small_plan, tmp_path):
    begun = small_plan(VELOCITY).with_stage({"task": POSITION})
    resumed = partial(small_plan, robot=None, task=None, updates=None, out=None, seed=1, resume=begun.out)
    plan = resumed("go_to_pose")
    assert plan.tasks == (POSITION, VELOCITY, "go_to_pose")
    assert (plan.stages, plan.updates, plan.seed) == (begun.stages, 2, 3)
    assert resumed(updates=5).updates == 5
    for more in ({"robot": "floating_platform"}, {"seed": 4}):
        with pytest.raises(ConfigError, match="leave ROBOT, TASK, --seed"):
            resumed(**more)
    (begun.out / RECORD_FILE).write_text("{}")
    with pytest.raises(ConfigError, match="is no record of a training task after task"):
        resumed()


@pytest.mark.parametrize(
    ("further", "changed", "words"),
    [
        (["go_to_position"], {}, "'go_to_position' is learned already"),
        (["go_to_positon"], {}, "go_to_position"),
        (["go_to_pose_3d"], {}, "floating_platform"),
        (["go_to_pose"], {"seeds": 3}, "leave --seeds out"),
        (["go_to_pose"], {"wandb": True}, "leave --wandb out"),
        (["go_to_pose"], {"executor": "ray", "address": "host:6379"}, "leave --ray out"),
        (["go_to_pose"], {"settings": "recurrent_ppo"}, "learns by ppo, sac or td3, not by recurrent_ppo"),
        (["drift_go_to_pose"], {}, "which is for one task alone"),
    ],
)
def test_what_cannot_be_learned_task_after_task_is_refused_in_one_line(further, changed, words, tmp_path):
    with pytest.raises(ConfigError, match=words):
        continual_plan(replace(REQUEST, out=tmp_path / "run", **changed), further)
    assert not (tmp_path / "run").exists()


def test_a_training_that_has_begun_keeps_its_settings(small_settings, tmp_path):
    plan = continual_plan(replace(REQUEST, out=tmp_path / "run"), [VELOCITY])
    begun = plan.out / ALONE_FOLDER / POSITION
    begun.mkdir(parents=True)
    write_training_settings(small_settings, begun / SETTINGS_FILE)
    assert plan.settings_of(POSITION) == small_settings
    assert plan.settings_of(VELOCITY) != small_settings


@pytest.mark.slow
def test_a_policy_that_was_not_evaluated_claims_no_success_of_another_network(small_plan, monkeypatch):
    def interrupted(run, episodes):
        raise KeyboardInterrupt

    monkeypatch.setattr("training.continual.evaluate_in_mujoco", interrupted)
    plan = small_plan(VELOCITY)
    with pytest.raises(KeyboardInterrupt):
        learn(plan)
    assert "mujoco" in read_run_record(plan.out / ALONE_FOLDER / POSITION)
    assert "mujoco" not in read_run_record(plan.out / POSITION)


def test_a_distillation_that_is_interrupted_gives_the_terminal_back(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # as on a terminal
    bar = DistillationBar()
    with pytest.raises(KeyboardInterrupt), bar:
        bar(0.5)
        assert bar._bar.live.is_started
        raise KeyboardInterrupt
    assert not bar._bar.live.is_started


def test_settings_that_differ_between_tasks_are_refused(small_settings, monkeypatch):
    others = {POSITION: small_settings, VELOCITY: replace(small_settings, control_hz=10.0)}
    monkeypatch.setattr(
        "training.continual_plan.load_training_settings", lambda robot, task, _: others[task.name]
    )
    with pytest.raises(ConfigError, match="differ in 'control_hz'"):
        continual_plan(REQUEST, [VELOCITY])


def test_a_run_of_one_task_is_not_continued(run):
    with pytest.raises(ConfigError, match="was trained at one task: begin anew with --continue-with"):
        continual_plan(replace(REQUEST, robot=None, task=None, seed=1, resume=run[0]), ["go_to_pose"])
