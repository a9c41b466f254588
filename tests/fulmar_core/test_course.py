"""Controllers that look beyond what is observed are told the course, and others are not bothered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.course import progressed, tell_course
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episodes
from fulmar_core.goal import goal_at
from fulmar_core.metrics import episode_metrics
from fulmar_core.robot import load_robot
from fulmar_core.rollout import batches, roll_out_in_backends
from fulmar_core.tasks import load_task
from sim_nodes.mujoco_backend import MujocoBackend

ROBOT, TASK = load_robot("kingfisher"), load_task("go_through_positions")


class Listener:
    """Drives as the classical law, and keeps what it hears in its order."""

    name, control_hz = "listener", ROBOT.timing.control_hz

    def __init__(self):
        self._law = load_classical(ROBOT, TASK)
        self.observation_names, self.heard = self._law.observation_names, []

    def reset(self):
        self.heard.append("reset")

    def hear_course(self, places):
        self.heard.append(places)

    def act(self, observation):
        self.heard.append("act")
        return self._law.act(observation)


def test_all_places_are_told_and_no_heading():
    listener = Listener()
    tell_course(listener, goal_at((1.0, 2.0, 0.5), (3.0, 4.0, -0.5)))
    np.testing.assert_array_equal(listener.heard[0], [[1.0, 2.0], [3.0, 4.0]])


def test_a_controller_that_does_not_ask_is_told_nothing():
    tell_course(load_classical(ROBOT, TASK), goal_at((1.0, 2.0, 0.5)))


def test_a_batch_tells_every_world_its_own_course_before_each_step():
    listener = Listener()
    (run,) = batches(listener, ROBOT, TASK, load_scenario("nominal"), episodes=3, seed=5, worlds=3)
    drawn = draw_episodes(ROBOT, TASK, load_scenario("nominal"), seed=5, numbers=np.arange(3))
    first, *steps = listener.heard
    assert first == "reset"
    assert len(steps) == 2 * run.x.shape[-1]
    assert steps[1::2] == ["act"] * (len(steps) // 2)
    for told in steps[0::200]:
        np.testing.assert_allclose(told, drawn.goal.targets[..., :2], rtol=1e-6)


class Knowing(Listener):
    """Knows which waypoints come next."""

    def __init__(self, coming):
        super().__init__()
        self._coming = coming

    def coming(self, places):
        return None if self._coming is None else np.asarray(self._coming)


def on_its_way(done, waypoints=5):
    goal = goal_at(*((float(x), 0.0, 0.0) for x in range(waypoints)))
    return replace(goal, done=np.asarray(done, dtype=np.float32))


@pytest.mark.parametrize(
    ("done", "coming", "known"),
    [
        (3, 4, 4),
        (4, 0, 5),  # once around
        (6, 3, 8),
        (3, 3, 3),
        (3, 2, 3),  # it knows less
        (0, 4, 0),
    ],
)
def test_who_knows_to_have_come_further_has_and_nobody_goes_back(done, coming, known):
    after = progressed(Knowing(coming), on_its_way(done))
    assert after.done == known
    assert after.done.dtype == np.float32


def test_who_claims_many_waypoints_at_once_is_not_believed():
    assert progressed(Knowing(0), on_its_way(6, waypoints=9)).done == 6


def test_who_is_on_no_course_or_does_not_look_ahead_changes_nothing():
    goal = on_its_way(2)
    assert progressed(Knowing(None), goal) is goal
    assert progressed(Listener(), goal) is goal
    assert progressed(load_classical(ROBOT, TASK), goal) is goal


def test_each_world_of_a_batch_goes_on_by_itself():
    drawn = draw_episodes(ROBOT, TASK, load_scenario("nominal"), seed=5, numbers=np.arange(3))
    after = progressed(Knowing([0, 1, 2]), drawn.goal)
    np.testing.assert_array_equal(after.done, [0, 1, 2])
    np.testing.assert_array_equal(after.targets, drawn.goal.targets)


class Unread(Knowing):
    """Says to have passed one waypoint after another, wherever it is."""

    def __init__(self):
        super().__init__(0)
        self.steps = 0

    def act(self, observation):
        self.steps += 1
        self._coming = np.full(len(observation), self.steps // 100 % 10)
        return np.zeros((len(observation), 2))


@pytest.mark.parametrize("through", ["batch", "backends"])
def test_in_evaluation_observations_go_on_as_the_controller_knows_and_judges_do_not(through):
    controller, scenario = Unread(), load_scenario("ideal")
    seen = []
    act = controller.act
    controller.act = lambda observation: (seen.append(np.array(observation)), act(observation))[1]
    if through == "batch":
        (run,) = batches(controller, ROBOT, TASK, scenario, episodes=1, seed=5, worlds=1)
    else:
        run = roll_out_in_backends(
            controller,
            lambda: MujocoBackend.of(ROBOT, TASK, scenario),
            TASK,
            scenario,
            episodes=1,
            seed=5,
        )
    assert np.abs(seen[100] - seen[99]).max() > 0.1  # another waypoint
    assert np.abs(seen[98] - seen[97]).max() < 0.05
    assert episode_metrics(run, TASK)["goals_reached"][0] == 0
