"""Every pair of robot and task has settings; mistakes in them are reported."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from tests.new_robots import new_robot
from training.settings import (
    Annealing,
    StopAtSuccess,
    load_training_settings,
    write_training_settings,
)

PLATFORM, TURTLEBOT = load_robot("floating_platform"), load_robot("turtlebot2")
TASK = load_task("go_to_pose")


@pytest.mark.parametrize("robot", config_names("robots"))
def test_every_robot_has_settings_for_any_task(robot):
    assert load_training_settings(load_robot(robot), TASK).algorithm.kind == "ppo"


def test_a_robot_learns_as_its_family_does():
    assert load_training_settings(TURTLEBOT, TASK) == load_training_settings(
        TURTLEBOT, TASK, "differential_drive"
    )


def test_a_family_may_learn_as_another_one_does():
    fans = new_robot("fan_disc")
    assert load_training_settings(fans, TASK) == load_training_settings(fans, TASK, "thrusters")


def test_a_file_of_the_pair_s_own_name_replaces_the_family_s(monkeypatch, tmp_path):
    own = replace(load_training_settings(TURTLEBOT, TASK), worlds=1024)
    write_training_settings(own, tmp_path / "turtlebot2_go_to_pose.yaml")
    monkeypatch.setattr("training.settings.config_names", lambda _: ["turtlebot2_go_to_pose"])
    monkeypatch.setattr("training.settings.config_path", lambda family, name: tmp_path / f"{name}.yaml")
    assert load_training_settings(TURTLEBOT, TASK) == own


@pytest.mark.parametrize("name", ["thrusters", "recurrent_ppo", "sac", "td3"])
def test_what_is_written_is_what_is_read(tmp_path, name):
    settings = load_training_settings(TURTLEBOT, TASK, name)
    settings = replace(settings, stop_at_success=StopAtSuccess(0.995))
    write_training_settings(settings, tmp_path / "settings.yaml")
    assert load_training_settings(TURTLEBOT, TASK, str(tmp_path / "settings.yaml")) == settings


@pytest.mark.parametrize("name", ["sac", "td3"])
def test_algorithms_for_continuous_actions_are_refused_for_valves_that_only_open_and_close(name):
    assert load_training_settings(TURTLEBOT, TASK, name).algorithm.kind == name
    with pytest.raises(
        ConfigError, match=f"{name} needs actuators that move by degrees, those of 'floating_pl"
    ):
        load_training_settings(PLATFORM, TASK, name)


def test_unknown_settings_are_refused():
    with pytest.raises(UnknownNameError, match="recurrent_ppo"):
        load_training_settings(PLATFORM, TASK, "recurrent_ppa")


def test_an_unknown_algorithm_names_the_line(tmp_path):
    (tmp_path / "wrong.yaml").write_text("scenario: nominal\nalgorithm:\n  kind: pppo\n")
    with pytest.raises(ConfigError, match=r"wrong\.yaml:3: 'kind' = 'pppo' is not known"):
        load_training_settings(PLATFORM, TASK, str(tmp_path / "wrong.yaml"))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("told: true", "write 'disturbance_inputs'"),  # word: an old key
        ("wrench: true", "write 'action_space: wrench'"),
        ("specialist: {training: x, share: 0.5}", "write 'fallback_policy'"),  # word: an old key
        ("annealing: {begin: 0.1, end: 0.2, updates: 0.5}", "write 'target_kl' in 'annealing'"),
        ("algorithm: {kind: ppo, lessons: 3}", "write 'cloning_updates'"),  # word: an old key
    ],
)
def test_an_old_key_names_its_line_and_the_new_key(tmp_path, old, new):
    (tmp_path / "old.yaml").write_text(f"scenario: nominal\n{old}\n")
    with pytest.raises(ConfigError, match=rf"old\.yaml:2: '\w+' has a new name: {new}\.$"):
        load_training_settings(PLATFORM, TASK, str(tmp_path / "old.yaml"))


@pytest.mark.parametrize(
    ("progress", "effort", "entropy", "target_kl"),
    [
        (0.0, 1.0, 0.0, 1.0),
        (0.2, 1.0, 0.0, 1.0),
        (0.4, 2.0, -0.01, 0.6),
        (0.6, 3.0, -0.02, 0.2),
        (1.0, 3.0, -0.02, 0.2),
    ],
)
def test_annealing_raises_effort_and_lowers_entropy_and_update_size(progress, effort, entropy, target_kl):
    annealing = Annealing(0.2, 0.6, 3.0, -0.02, target_kl=0.2)
    annealed = replace(load_training_settings(PLATFORM, TASK), annealing=annealing)
    assert annealed.target_kl(progress) == pytest.approx(target_kl * annealed.algorithm.target_kl)
    assert annealed.effort(progress) == pytest.approx(effort)
    assert annealed.entropy(progress) == pytest.approx(entropy)


@pytest.mark.parametrize(
    "values",
    [
        (0.6, 0.6, 1.0, 0.0),
        (-0.1, 0.5, 1.0, 0.0),
        (0.1, 1.5, 1.0, 0.0),
        (0.1, 0.5, 0.0, 0.0),
        (0.1, 0.5, 1.0, 0.0, 0.0),
    ],
)
def test_annealing_with_impossible_shares_is_rejected(values):
    with pytest.raises(ValueError, match="must lie in"):
        Annealing(*values)


def test_sac_takes_no_annealing():
    settings = load_training_settings(load_robot("turtlebot2"), TASK, "sac")
    with pytest.raises(ValueError, match="sac weighs entropy by itself"):
        replace(settings, annealing=Annealing(0.2, 0.6, 3.0, 0.0))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"worlds": 100}, "3200 must be a multiple of 'minibatch'"),
        ({"time_limit_s": 0.0}, "'time_limit_s' greater than 0"),
        ({"evaluate_every_s": 0.0}, "'evaluate_every_s' must be greater than 0"),
        ({"checkpoint_every_s": -1.0}, "'checkpoint_every_s' must be greater than 0"),
    ],
)
def test_settings_that_cannot_work_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        replace(load_training_settings(PLATFORM, TASK), **change)


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("thrusters", {"minibatch": 0}, "'minibatch' must be at least 1"),
        ("thrusters", {"steps": 0}, "'steps' must be at least 1"),
        ("thrusters", {"epochs": 0}, "'epochs' must be at least 1"),
        ("thrusters", {"hidden": (64, 0)}, "'hidden' must be at least 1"),
        ("thrusters", {"learning_rate": -1.0}, "'learning_rate' must be greater than 0"),
        ("thrusters", {"learning_rate_range": (0.1, 0.01)}, "0 < low <= high"),
        ("thrusters", {"gamma": 1.5}, r"'gamma' must lie in \(0, 1\]"),
        ("recurrent_ppo", {"memory": 0}, "'memory' must be at least 1"),
        ("recurrent_ppo", {"epochs": 0}, "'epochs' must be at least 1"),
        ("sac", {"tau": 0.0}, r"'tau' must lie in \(0, 1\]"),
        ("td3", {"buffer": 0}, "'buffer' must be at least 1"),
        ("td3", {"first_steps": -1}, "'first_steps' must not be negative"),
    ],
)
def test_hyper_parameters_that_no_learner_can_do_with_are_refused(name, change, words):
    settings = load_training_settings(load_robot("turtlebot2"), TASK, name)
    with pytest.raises(ValueError, match=words):
        replace(settings.algorithm, **change)


@pytest.mark.parametrize("values", [(0.0, 2), (1.1, 2), (0.9, 0)])
def test_a_stop_that_would_come_always_or_never_is_refused(values):
    with pytest.raises(ValueError, match="must lie in"):
        StopAtSuccess(*values)
