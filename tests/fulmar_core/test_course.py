"""Controllers that look beyond what is observed are told the course, and others are not bothered."""

from __future__ import annotations

import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.course import tell_course
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episodes
from fulmar_core.goal import goal_at
from fulmar_core.robot import load_robot
from fulmar_core.rollout import batches
from fulmar_core.tasks import load_task

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
