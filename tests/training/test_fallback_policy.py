"""Two networks as one: a fallback policy takes over where dead valves leave no pose to hold."""

from __future__ import annotations

import signal
from dataclasses import fields, replace

import numpy as np
import onnxruntime
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.disturbance_inputs import disturbance_terms
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.holdability import uncontrollable_losses
from fulmar_core.worlds.scenario import load_scenario
from policy_server.policy import Policy
from training import fallback_policy, jobs
from training.export import export
from training.fallback_policy import fallback_settings
from training.jobs import Job, learn
from training.network import load_network
from training.policies import ShippedPolicy, recipe
from training.progress import progress_file
from training.run_folder import FALLBACK_FOLDER, NETWORK_FILE, read_run_record, read_start
from training.settings import FallbackPlan, OnPolicy, RecurrentPpo, load_training_settings

ROBOT, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")
NAMES = Observer(ROBOT, TASK).names + disturbance_terms(ROBOT)
UNCONTROLLABLE, MORE, ABLE = (0, 5), (0, 5, 6), (0, 1)


@pytest.fixture(scope="module")
def settings():
    """Those of the policy that ships, and of its fallback, cut to what takes a moment."""
    found = load_training_settings(ROBOT, TASK)
    assert found.fallback_policy is not None
    return cut(found)


def cut(settings):
    ppo = replace(settings.algorithm, steps=16, minibatch=128, epochs=1, hidden=(16,), cloning_updates=1)
    return replace(settings, algorithm=ppo, worlds=32, evaluate_every_s=1e6)


def cut_short(monkeypatch):
    load = fallback_policy.load_training_settings
    monkeypatch.setattr(fallback_policy, "load_training_settings", lambda *given: cut(load(*given)))


@pytest.fixture
def quick(monkeypatch):
    cut_short(monkeypatch)


def job_in(folder, settings, **limits):
    return Job("both", ROBOT.name, TASK.name, 1, settings, folder, **limits)


def learned(folder, settings, **limits):
    folder.mkdir(parents=True, exist_ok=True)
    return learn(job_in(folder, settings, **limits), progress_file(folder / "progress.json"))


@pytest.fixture(scope="module")
def run(tmp_path_factory, settings):
    """A run that tests only read."""
    folder = tmp_path_factory.mktemp("fallback_policy") / "run"
    with pytest.MonkeyPatch.context() as monkeypatch:
        cut_short(monkeypatch)
        learned(folder, settings, updates=6)
    return folder


@pytest.fixture(scope="module")
def bundle(run):
    """Its bundle, with the passport."""
    return run.parent / "bundle", export(run, run.parent / "bundle")


def seen(*lost):
    """Observations of robots that know what they have lost."""
    rows = np.random.default_rng(3).normal(size=(len(lost), len(NAMES))).astype(np.float32)
    rows[:, -8:] = 1.0
    for row, valves in zip(rows, lost, strict=True):
        row[[-8 + valve for valve in valves]] = 0.0
    return rows


def test_the_fallback_policy_acts_where_the_robot_is_uncontrollable_and_nowhere_else(run):
    both, alone = load_network(run / NETWORK_FILE), load_network(run / FALLBACK_FOLDER / NETWORK_FILE)
    general = load_network(run / NETWORK_FILE)
    general.fallback = None
    rows = seen(UNCONTROLLABLE, MORE, ABLE, (3,), ())
    raw, special, ordinary = (network.infer(rows)[1] for network in (both, alone, general))
    np.testing.assert_array_equal(raw[:2], special[:2])
    np.testing.assert_array_equal(raw[2:], ordinary[2:])
    assert (np.abs(special - ordinary).max(axis=1) > 1e-4).all()  # else this would show nothing


def test_it_takes_over_at_every_uncontrollable_set_of_dead_valves(run):
    losses = load_network(run / NETWORK_FILE).losses.numpy()
    assert {tuple(np.flatnonzero(row)) for row in losses} == set(uncontrollable_losses(ROBOT, 2))


def test_the_exported_bundle_hands_over_as_the_network_does(run, bundle):
    folder, passport = bundle
    assert passport.training["fallback_policy"]["updates"] == 2
    rows = seen(UNCONTROLLABLE, MORE, ABLE)
    session = onnxruntime.InferenceSession(folder / "policy.onnx")
    logits = session.run(["logits"], {"observation": rows})[0]
    np.testing.assert_allclose(logits, load_network(run / NETWORK_FILE).infer(rows)[1], atol=1e-4)


def test_golden_vectors_cover_the_fallback_policy(bundle):
    folder, _ = bundle
    Policy(folder, ROBOT, TASK)  # checks them
    dead = np.load(folder / "golden.npz")["observations"][:, -8:] < 0.5
    reported = {tuple(np.flatnonzero(row)) for row in dead}
    assert reported > set(uncontrollable_losses(ROBOT, 2))
    assert () in reported


def test_both_share_the_updates_of_the_run(run):
    record = read_run_record(run)
    assert (record["fallback_policy"]["updates"], record["updates"]) == (2, 4)
    assert read_run_record(run / FALLBACK_FOLDER)["settings"]["scenario"] == "drift_uncontrollable"


def test_both_share_its_time(tmp_path, settings, quick, monkeypatch):
    given = []

    def note(job, *_):
        given.append(job.time_limit_s)
        raise KeyboardInterrupt

    monkeypatch.setattr(jobs, "_train", note)
    with pytest.raises(KeyboardInterrupt):
        learned(tmp_path, settings, time_limit_s=100.0)
    assert given == [pytest.approx(100.0 * settings.fallback_policy.share)]


class Impatient:
    """Presses Ctrl-C after the first update of one part of a run."""

    def __init__(self, part):
        self.parts_left = part

    def begin(self):
        self.parts_left -= 1

    def advance(self, share, elapsed_s, steps):
        if not self.parts_left:
            signal.raise_signal(signal.SIGINT)

    def evaluated(self, elapsed_s, success): ...

    def end(self): ...


@pytest.mark.slow
@pytest.mark.parametrize("part", [1, 2], ids=["the fallback", "the other"])
def test_a_run_that_was_broken_off_ends_with_the_very_networks_of_one_that_was_not(
    tmp_path, settings, quick, run, part
):
    broken = tmp_path / "broken"
    broken.mkdir()
    with pytest.raises(KeyboardInterrupt):
        learn(job_in(broken, settings, updates=6), Impatient(part))
    assert (broken / FALLBACK_FOLDER / NETWORK_FILE).is_file()
    assert (broken / NETWORK_FILE).is_file() == (part == 2)
    assert read_start(broken)["updates"] == 6
    learned(broken, settings, updates=read_start(broken)["updates"])
    record = read_run_record(broken)
    assert (record["fallback_policy"]["updates"], record["updates"]) == (2, 4)
    for row in seen(UNCONTROLLABLE, ABLE):
        raw, whole = (load_network(each / NETWORK_FILE).infer(row[None])[1] for each in (broken, run))
        np.testing.assert_array_equal(raw, whole)


def test_another_fallback_policy_makes_another_policy(settings, quick, monkeypatch):
    policy = ShippedPolicy(ROBOT.name, TASK.name, seed=1, updates=6, success=0.9)
    first = recipe(policy, settings)
    load = fallback_policy.load_training_settings
    monkeypatch.setattr(
        fallback_policy, "load_training_settings", lambda *given: replace(load(*given), worlds=64)
    )
    assert recipe(policy, settings) != first


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"scenario": "drift_two_lost"}, "'stranding: true'"),  # word: YAML key of scenarios
        ({"disturbance_inputs": False}, "'disturbance_inputs'"),
        ({"fallback_policy": FallbackPlan("drift_uncontrollable", 0.5)}, "and no fallback"),
    ],
)
def test_fallback_policies_that_could_not_take_over_are_rejected(settings, monkeypatch, change, said):
    load = fallback_policy.load_training_settings
    monkeypatch.setattr(
        fallback_policy, "load_training_settings", lambda *given: replace(load(*given), **change)
    )
    with pytest.raises(ConfigError, match=said):
        fallback_settings(settings, ROBOT, TASK)


def test_a_fallback_policy_needs_disturbance_inputs(settings):
    with pytest.raises(ValueError, match="needs 'disturbance_inputs'"):
        replace(settings, disturbance_inputs=False)


def test_a_network_with_memory_cannot_hand_over(settings):
    shared = {field.name: getattr(settings.algorithm, field.name) for field in fields(OnPolicy)}
    with pytest.raises(ValueError, match="network without memory"):
        replace(settings, algorithm=RecurrentPpo(**shared, memory=8))


def test_both_are_measured_alike():
    """The network that hands over would else be reported of a loss by an estimate that the other has never met."""
    main = load_training_settings(ROBOT, TASK)
    own = fallback_settings(main, ROBOT, TASK)
    assert load_scenario(own.scenario).sensing == load_scenario(main.scenario).sensing


@pytest.mark.parametrize("share", [0.0, 1.0, -0.2])
def test_both_need_a_part_of_the_run(share):
    with pytest.raises(ValueError, match="between 0 and 1"):
        FallbackPlan("any", share)
