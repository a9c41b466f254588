"""Which poses in space thrusters and fans can hold against a push, with failures and an offset centre of mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.tasks import load_task
from fulmar_core.worlds.holdability import LEAST_MARGIN
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.spatial_holdability import can_hold_in_space, hold_margin_in_space

SPACECRAFT, BALL = load_robot("spacecraft_16"), load_robot("int_ball2")
POSE = load_task("go_to_pose_3d")
NOTHING = np.zeros(3)
UPRIGHT = np.array([[0.0, 0.0, 0.0, 1.0]])


def margin(robot, *, lost=(), force=NOTHING, torque=NOTHING, com=NOTHING):
    working = np.ones(len(robot.actuators.names))
    working[list(lost)] = 0.0
    return hold_margin_in_space(robot, working, np.asarray(force), np.asarray(torque), np.asarray(com))


def worlds(robot, count=1, scenario="ideal", **changes):
    """Drawn worlds, with some of their numbers changed."""
    drawn = draw_episodes(robot, POSE, load_scenario(scenario), seed=5, numbers=np.arange(count))
    return replace(drawn.world, **{name: np.asarray(value, dtype=float) for name, value in changes.items()})


def test_what_is_left_shrinks_with_the_push_and_ends_at_the_limit():
    """Along z the spacecraft makes 1 N, all of which a push of 1 N takes."""
    found = [margin(SPACECRAFT, force=[0.0, 0.0, size]) for size in (0.0, 0.5, 0.9, 1.1)]
    assert found == sorted(found, reverse=True)
    assert found[0] > found[2] > LEAST_MARGIN > found[3]


def test_a_centre_of_mass_beside_the_middle_leaves_less():
    """A force through it needs a torque about the middle of the fans."""
    push = {"force": [0.1, 0.0, 0.0]}
    assert margin(BALL, **push, com=[0.0, 0.02, 0.0]) < 0.9 * margin(BALL, **push)


@pytest.mark.parametrize("lost", range(16))
def test_the_spacecraft_holds_a_pose_without_any_one_thruster(lost):
    assert margin(SPACECRAFT, lost=[lost]) > LEAST_MARGIN


def test_without_every_thruster_that_pushes_along_z_no_pose_is_held():
    along_z = [i for i, nozzle in enumerate(SPACECRAFT.actuators.nozzles) if nozzle.direction[2] > 0.0]
    assert margin(SPACECRAFT, lost=along_z) < LEAST_MARGIN


@pytest.mark.parametrize("lost", range(8))
def test_int_ball2_needs_each_of_its_fans(lost):
    """Seven that push one way span six axes only if one command of all leaves nothing; here none does."""
    assert margin(BALL) > LEAST_MARGIN
    assert margin(BALL, lost=[lost]) < LEAST_MARGIN


def test_the_attitude_of_the_pose_turns_the_push():
    """0.8 N is more than along x, and less than along z."""
    world = worlds(SPACECRAFT, force=[[0.8], [0.0], [0.0]])
    x_upwards = np.array(
        [[0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5)]]
    )  # the body's z along the world's x, or against it
    assert not can_hold_in_space(SPACECRAFT, world, UPRIGHT)[0]
    assert can_hold_in_space(SPACECRAFT, world, x_upwards)[0]
    assert can_hold_in_space(SPACECRAFT, world)[0]  # some attitude will do


def test_no_attitude_helps_against_a_push_beyond_all_limits():
    assert not can_hold_in_space(SPACECRAFT, worlds(SPACECRAFT, force=[[1.1], [0.0], [0.0]])).any()


def test_every_world_without_disturbance_and_most_of_randomised_ones_are_held():
    episodes = draw_episodes(BALL, POSE, load_scenario("randomised"), seed=5, numbers=np.arange(64))
    able = can_hold_in_space(BALL, episodes.world, np.asarray(episodes.goal.current)[:, 3:7])
    whole = np.asarray(episodes.world.alive).all(axis=0)
    assert can_hold_in_space(BALL, worlds(BALL, 4)).all()
    assert able[whole].all()
    assert not able[~whole].all()
    assert 0 < (~whole).sum() < 16


def test_wheels_hold_nothing_in_space():
    with pytest.raises(ConfigError, match="has no thrusters"):
        can_hold_in_space(load_robot("turtlebot2"), worlds(SPACECRAFT))
