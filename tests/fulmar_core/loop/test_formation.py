"""A place in a formation: the goal moves with the leader, and stands still where the leader is lost."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.formation import FormationGoal, ShapePlace
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.keep_apart import Other
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.wires.neighbours import DRIVEN, NEIGHBOURS
from fulmar_core.worlds.scenario import load_scenario
from policy_server.controllers import Choice, load_controller

ROBOT, TASK = load_robot("floating_platform"), load_task("go_to_pose")
STEP_NS = 100_000_000
OWN = np.array([[-1.0, 0.5, 0.0]])


def controller():
    return load_controller("lqr", ROBOT, TASK, Choice(10.0))


def formation():
    return FormationGoal(ShapePlace.of("leader -1 0.5 90"), ["boat", "leader"], controller())


def seen(x=0.0, vx=0.0, *, driven=1.0):
    motions = np.array([[9.0, 9.0, 0.0, 0.0, x, 0.0, vx, 0.0]])
    return {NEIGHBOURS: motions, DRIVEN: np.array([[1.0, driven]])}


def goal_of(*pose):
    return Goal(np.array([[pose]]), np.zeros(1), no_obstacles(1))


def test_the_goal_moves_with_the_leader_and_the_law_aims_ahead_by_its_velocity():
    own = formation()
    place, aim = own.follow(goal_of(0.0, 0.0, 0.0), OWN, seen(2.0, 0.1), STEP_NS)
    np.testing.assert_allclose(place.targets[0, 0], (1.0, 0.5, math.pi / 2.0))
    assert aim.targets[0, 0, 0] == pytest.approx(1.0 + 0.1 * controller().lead)
    assert controller().lead > 0.5 and not own.words


@pytest.mark.parametrize(
    ("readings", "words"),
    [
        (seen(2.0, 0.1, driven=0.0), "nothing drives its leader 'leader'"),
        ({}, "does not know where its leader 'leader' is"),
    ],
)
def test_a_robot_without_its_leader_holds_its_own_place_says_why_and_follows_again(readings, words):
    own, goal = formation(), goal_of(0.0, 0.0, 0.0)
    own.follow(goal, OWN, seen(), STEP_NS)
    for number, drift in enumerate((0.0, 0.2)):
        place, aim = own.follow(goal, OWN + np.array((drift, 0.0, 0.0)), readings, (2 + number) * STEP_NS)
        np.testing.assert_array_equal(place.targets[0], OWN)
        np.testing.assert_array_equal(aim.targets[0], OWN)
        assert words in own.words
    place, _ = own.follow(goal, OWN, seen(3.0), 5 * STEP_NS)
    assert place.targets[0, 0, 0] == 2.0 and not own.words


def test_a_leader_whose_place_does_not_change_though_it_has_a_velocity_counts_as_lost():
    own, goal = formation(), goal_of(0.0, 0.0, 0.0)
    for number in range(1, 13):
        own.follow(goal, OWN, seen(2.0, 0.1), number * STEP_NS)
    assert "is frozen" in own.words
    rests = formation()
    for number in range(1, 13):
        rests.follow(goal, OWN, seen(2.0, 0.0), number * STEP_NS)
    assert not rests.words


@pytest.mark.parametrize("text", ["leader", "leader 1 2", "leader 1 2 x", "leader 1 2 nan", "leader 1 2 3 4"])
def test_a_text_that_is_no_place_is_one_line(text):
    with pytest.raises(ValueError, match="LEADER X Y HEADING"):
        ShapePlace.of(text)


def test_a_leader_that_is_no_neighbour_is_refused():
    with pytest.raises(ValueError, match="'formation' follows 'leader', and 'neighbours' has boat"):
        FormationGoal(ShapePlace.of("leader 0 1 0"), ["boat"], controller())


class Robot:
    """One platform in the core's own dynamics with its control loop."""

    def __init__(self, start, goal, place=None):
        law = controller()
        self.world = BatchSimulation(
            ROBOT,
            TASK,
            load_scenario("nominal"),
            worlds=1,
            seed=0,
            control_hz=law.control_hz,
            dtype=np.float64,
        )
        x, y, yaw = (np.array([part]) for part in start)
        zero = np.zeros(1)
        self.world.put(
            PlanarState(x, y, yaw, zero, zero, zero),
            goal_of(*goal),
            np.array([ROBOT.actuators.safe_command], dtype=float),
        )
        self.loop = ControlLoop(
            ROBOT, TASK, law, others=[Other("other", ROBOT, guarded=True)], formation=place
        )
        self.loop.reset()
        self.loop.begin(goal_of(*goal))

    def motion(self):
        state = self.world.measured
        return np.column_stack((state.x, state.y, state.vx, state.vy))

    def move(self, other, number, *, driven=True):
        readings = {NEIGHBOURS: other, DRIVEN: np.array([[float(driven)]])}
        command = self.loop.step(self.world.measured, readings, (1 + number) * STEP_NS).command
        self.world.move(command)


SPEED = 0.1  # of the goal that the leader follows [m/s]


def follow(duration_s, *, lost_s=math.inf):
    """Way of leader and follower, shape (steps, 2, 2) [m], and the follower's words at the end."""
    leader = Robot((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    follower = Robot((-1.0, 0.8, 0.0), (-1.0, 0.8, 0.0), ShapePlace.of("other -1 0.8 0"))
    way = []
    for number in range(round(10 * duration_s)):
        of_leader, of_follower = leader.motion(), follower.motion()
        leader.loop.begin(goal_of(0.1 * SPEED * number, 0.0, 0.0))
        leader.move(of_follower, number)
        follower.move(of_leader, number, driven=number < 10 * lost_s)
        way.append((leader.motion()[0, :2], follower.motion()[0, :2]))
    return np.array(way), follower.loop.formation.words


def test_a_follower_keeps_its_place_about_a_leader_that_goes_on_at_a_tenth_of_a_metre_a_second():
    way, words = follow(25.0)
    error = np.linalg.norm(way[:, 1] - way[:, 0] - (-1.0, 0.8), axis=-1)
    assert way[-1, 0, 0] > 2.0 and not words
    assert np.sqrt((error**2).mean()) < 0.05
    assert np.sqrt((error[-100:] ** 2).mean()) < 0.03


def test_a_follower_stops_where_its_leader_is_lost():
    way, words = follow(20.0, lost_s=10.0)
    assert way[-1, 0, 0] > 1.5  # the leader went on
    assert np.linalg.norm(way[-1, 1] - way[100, 1]) < 0.2
    assert np.linalg.norm(way[-1, 1] - way[-10, 1]) < 0.02
    assert "nothing drives its leader" in words
