"""A policy with memory and continuous commands."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import BundleError
from fulmar_core.loop.policy_bundle import PASSPORT, read_golden, read_passport
from fulmar_core.tasks.observation import Observer
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


def seeing(shares):
    """Inputs after a command, as shares of full ones."""
    previous = np.asarray(ROLLING.actuators.scale) * np.asarray(shares)
    seen = inputs_seeing(np.zeros(len(Observer(ROLLING, ROLLING_TASK).names)))
    return replace(seen, previous=previous[None], dt=1.0)


def test_a_memory_of_the_last_command_holds_what_was_commanded_instead_of_it(remembering):
    reseal(remembering, remembers_command=True)
    policy = Policy(remembering, ROLLING, ROLLING_TASK)
    scale = np.asarray(ROLLING.actuators.scale)
    policy.act(seeing([0.0, 0.0]))  # it answers with its memory, zeros
    assert policy.act(seeing([0.0, 0.0]))[0] == pytest.approx(0.25 * scale)
    stopped = policy.act(seeing([0.1, 0.25]))[0]  # somebody braked one wheel
    assert stopped == pytest.approx([0.1 * scale[0], 0.5 * scale[1]])


def test_a_memory_without_commands_is_left_alone(remembering):
    policy = Policy(remembering, ROLLING, ROLLING_TASK)
    policy.act(seeing([0.0, 0.0]))
    assert policy.act(seeing([0.9, 0.9]))[0] == pytest.approx(0.25 * np.asarray(ROLLING.actuators.scale))


def test_limits_of_the_robot_leave_the_memory_as_the_network_chose(remembering):
    reseal(remembering, remembers_command=True)
    policy = Policy(remembering, ROLLING, ROLLING_TASK)
    for _ in range(7):  # its memory grows beyond full command
        policy.act(seeing([0.0, 0.0]) if policy._expected is None else after(policy))
    assert policy._memory[0] == pytest.approx([1.75, 1.75])


def after(policy):
    """Inputs after the command that the robot's limits made of the policy's own."""
    return replace(seeing([0.0, 0.0]), previous=policy._expected)


def test_a_passport_without_the_key_remembers_no_command(remembering):
    text = json.loads((remembering / PASSPORT).read_text())
    assert "remembers_command" not in text
    assert not read_passport(remembering).remembers_command
    reseal(remembering, remembers_command=True)
    assert json.loads((remembering / PASSPORT).read_text())["remembers_command"] is True
    assert read_passport(remembering).remembers_command
