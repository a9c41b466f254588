"""A policy with memory and continuous commands."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import BundleError
from fulmar_core.loop.policy_bundle import (
    read_golden,
)
from policy_server.policy import Policy
from tests.policy_server.bundles import (
    ROLLING,
    ROLLING_TASK,
    reseal,
)
from tests.policy_server.observed import inputs_seeing


def test_a_continuous_policy_commands_in_the_units_of_the_actuators(remembering):
    golden = read_golden(remembering)
    policy = Policy(remembering, ROLLING, ROLLING_TASK)
    for _ in range(6):
        command = policy.act(inputs_seeing(golden.observations))
    np.testing.assert_allclose(command, np.tile(ROLLING.actuators.scale, (4, 1)), rtol=1e-6)


def test_memory_is_carried_from_one_command_to_the_next_and_forgotten_on_reset(remembering):
    policy = Policy(remembering, ROLLING, ROLLING_TASK)
    seen, speed = inputs_seeing(np.zeros(len(policy.passport.observation_names))), ROLLING.actuators.scale[0]
    carried = [float(policy.act(seen)[0, 0]) for _ in range(3)]
    policy.reset()
    assert [*carried, float(policy.act(seen)[0, 0])] == pytest.approx([0.0, 0.25 * speed, 0.5 * speed, 0.0])


def test_every_row_of_a_batch_has_a_memory_of_its_own(remembering):
    policy = Policy(remembering, ROLLING, ROLLING_TASK)
    seen = np.zeros((3, len(policy.passport.observation_names)))
    policy.act(inputs_seeing(seen))
    assert policy.act(inputs_seeing(seen)).shape == (3, 2)
    assert (policy.act(inputs_seeing(seen[:2])) == 0.0).all()  # another batch is another story


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"memory": 3}, "'memory' has shape ['worlds', 2], the passport needs (any number, 3)"),
        ({"memory": 0}, "takes observation, memory; it must take 'observation' alone"),
        ({"action": "on_off"}, "gives on_off commands, 'turtlebot2' takes continuous"),
    ],
)
def test_a_memory_or_a_kind_of_command_that_the_passport_does_not_state_is_refused(
    remembering, change, words
):
    reseal(remembering, **change)
    with pytest.raises(BundleError, match=re.escape(words)):
        Policy(remembering, ROLLING, ROLLING_TASK)


@pytest.mark.parametrize("name", ["memories", "next_memories", "commands"])
def test_golden_vectors_of_a_network_with_memory_are_compared_too(remembering, name):
    golden = read_golden(remembering)
    reseal(remembering, golden=replace(golden, **{name: getattr(golden, name) + np.float32(0.01)}))
    with pytest.raises(BundleError, match="golden vectors"):
        Policy(remembering, ROLLING, ROLLING_TASK)
