"""Golden vectors at both limits of every action."""

from __future__ import annotations

import numpy as np
import pytest
from onnxruntime import InferenceSession

from fulmar_core.loop.policy_bundle import Golden, read_bundle, read_passport
from fulmar_core.robots.robot_file import load_robot
from policy_server.controllers import policies_directory
from training.golden_limits import reached, with_limits

BUNDLES = sorted(folder for folder in policies_directory().iterdir() if folder.is_dir())
# Aircraft deflect little about trim, and no stretched observation leads their policies to a limit.
TIMID = [folder for folder in BUNDLES if load_robot(read_passport(folder).robot).flies]
# What steers by a seen pose cuts force and torque below what nozzles can do: there is no limit to be at.
SEEING = [folder for folder in BUNDLES if read_passport(folder).image is not None]


@pytest.mark.parametrize(
    "folder",
    [folder for folder in BUNDLES if folder not in (*TIMID, *SEEING)],
    ids=lambda folder: folder.name,
)
def test_a_shipped_bundle_is_checked_at_every_limit(folder):
    bundle = read_bundle(folder)
    passport = bundle.passport
    assert reached(bundle.golden().commands, np.array(passport.command_scale), passport.action).all()


@pytest.mark.parametrize("folder", TIMID, ids=lambda folder: folder.name)
def test_a_shipped_bundle_that_reaches_no_limit_is_checked_as_near_as_stretched_observations_lead(folder):
    bundle = read_bundle(folder)
    found, scale = bundle.golden(), np.array(bundle.passport.command_scale)
    session = InferenceSession(folder / "policy.onnx")

    def answers(seen, memory):
        commands, logits = session.run(None, {"observation": seen})
        return commands, logits, memory

    added = 2 * len(scale)
    first = Golden(*(array[:-added] for array in found.arrays().values()))
    again = with_limits(first, answers, scale, bundle.passport.action)
    assert len(again.commands) == len(found.commands)
    np.testing.assert_allclose(again.commands, found.commands, atol=1e-5)
    assert (np.ptp(found.commands, axis=0) > np.ptp(first.commands, axis=0)).all()


def infer(seen, memory):
    logits = seen @ np.array([[1.0, -0.5]], dtype=np.float32)
    return np.clip(logits, -1.0, 1.0) * np.float32(2.0), logits, memory


def golden(*seen):
    seen, memory = np.array(seen, dtype=np.float32)[:, None], np.zeros((len(seen), 0), np.float32)
    commands, logits, after = infer(seen, memory)
    return Golden(seen, memory, commands, logits, after)


def test_limits_that_no_vector_is_at_come_from_the_least_stretched_observation():
    found = with_limits(golden(0.9, -1.1), infer, np.array([2.0, 2.0]), "continuous")
    np.testing.assert_allclose(found.observations[:, 0], [0.9, -1.1, 2.2, 1.1, -2.2])
    assert reached(found.commands, np.array([2.0, 2.0]), "continuous").all()


def test_vectors_at_every_limit_stay_as_they_are():
    complete = golden(3.0, -3.0)
    assert with_limits(complete, infer, np.array([2.0, 2.0]), "continuous") is complete
