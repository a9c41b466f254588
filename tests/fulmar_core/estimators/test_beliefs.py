"""What an operator is warned of: dead valves, a push that is too strong, a robot that is held."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health.beliefs import BeliefReader, Beliefs, joined
from fulmar_core.estimators.actuator_health.thruster_health import Health
from fulmar_core.robots.robot_file import load_robot

ROBOT = load_robot("floating_platform")
READER = BeliefReader(ROBOT)


def health(*, effectiveness=None, push=(0.0, 0.0, 0.0), yaw=0.0, held=False):
    shares = np.full(8, 0.99) if effectiveness is None else np.array(effectiveness)
    motion = np.array([0.0, 0.0, yaw, 0.0, 0.0, 0.0])
    return Health(shares, np.round(shares), motion, np.array(push), np.array(held))


def test_of_a_healthy_robot_nothing_is_said():
    assert READER.read(health(push=(0.3, -0.2, 0.05))).words == ()


def test_a_dead_valve_is_named_with_its_effectiveness():
    believed = READER.read(health(effectiveness=[1.0, 1.0, 0.05, 1.0, 1.0, 0.49, 1.0, 0.51]))
    assert believed.dead == ("thruster_3", "thruster_6")
    assert believed.words[0] == "valve thruster_3 believed dead (effectiveness 0.05)"


@pytest.mark.parametrize("yaw", [0.0, 0.8, 2.0])
def test_a_push_is_compared_with_what_the_valves_can_hold_in_its_direction(yaw):
    # Along the nozzles 1 N, between two of them 0.71 N.
    for force_n, angle, beyond in ((0.95, np.pi / 4, False), (1.05, np.pi / 4, True), (0.75, 0.0, True)):
        direction = yaw + angle
        push = (force_n * np.cos(direction), force_n * np.sin(direction), 0.0)
        words = READER.read(health(push=push, yaw=yaw)).words
        assert any("beyond what the valves can hold" in word for word in words) == beyond


def test_a_torque_beyond_the_robots_own_is_said():
    assert READER.read(health(push=(0.0, 0.0, -0.4))).words == (
        "a push of -0.40 N·m is believed, beyond the 0.31 N·m of the valves",
    )


def test_a_robot_that_is_held_is_said():
    assert "held" in READER.read(health(held=True)).words[0]


ESTIMATED = Beliefs(
    ("thruster_6", "thruster_8"),
    (
        "valve thruster_6 believed dead (effectiveness 0.12)",
        "valve thruster_8 believed dead (effectiveness 0.34)",
        "a push of 1.20 N is believed, beyond what the valves can hold",
    ),
)


def test_dead_valves_that_only_the_estimator_believes_in_are_not_named():
    assert joined(ESTIMATED, Beliefs(), suspects=()).dead == ()


def test_dead_valves_that_the_monitor_suspects_too_are_named_with_their_effectiveness():
    believed = joined(ESTIMATED, Beliefs(), suspects=("thruster_8",))
    assert believed.dead == ("thruster_8",)
    assert believed.words == ESTIMATED.words[1:]
    assert believed.warnings == ("valve thruster_8 believed dead",)


def test_a_valve_that_is_stuck_open_explains_what_the_estimator_believes():
    words = ("valve thruster_3 is stuck open",)
    monitored = Beliefs((), words, ("thruster_3",), words)
    assert joined(ESTIMATED, monitored, suspects=()) == monitored


def test_a_small_push_is_not_looked_at_closer_and_never_one_that_counts(monkeypatch):
    rng, closer = np.random.default_rng(2), BeliefReader(ROBOT)
    monkeypatch.setattr(closer._reach, "at_least", -np.inf)  # what is never small
    for _ in range(300):
        seen = health(push=rng.normal(0.0, 0.4, 3) * (1.0, 1.0, 0.4), yaw=rng.uniform(-3.0, 3.0))
        assert READER.read(seen) == closer.read(seen)
