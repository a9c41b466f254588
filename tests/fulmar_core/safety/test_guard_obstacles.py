"""The envelope guard stops a floating platform before obstacles, and its backup keeps clear of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.controller_settings import ENVELOPE, ControllerSettings
from fulmar_core.loop.envelope import envelope_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.envelope.blocks import CLEAR_M, Blocks
from fulmar_core.safety.envelope.guard import EnvelopeGuard
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario

PLATFORM = load_robot("floating_platform")
TASK = load_task("go_to_position_with_obstacles")
RADIUS = PLATFORM.body.radius
WORLDS = 6


class Rammer:
    """Drives towards the first obstacle with all that one valve has."""

    name, estimator, observer, readings = "rammer", None, None, ()
    control_hz = PLATFORM.timing.control_hz

    def reset(self):
        """Nothing to forget."""

    def act(self, inputs):
        rigid = inputs.state.to_rigid()
        way = np.zeros_like(rigid.position_in_world)
        way[:, :2] = inputs.goal.obstacles[:, 0, :2] - rigid.position_in_world[:, :2]
        each = PLATFORM.actuators.wrench_per_newton
        along = rotate_inverse(rigid.quat_xyzw, way) @ each[:, :3].T
        return np.eye(len(each))[along.argmax(axis=1)]


def nearest(*, guarded, seconds=20.0, sees=True):
    """Least gap to any obstacle of each world under the rammer, and the guard, shapes (worlds,) [m]."""
    simulation = BatchSimulation(PLATFORM, TASK, load_scenario("nominal"), worlds=WORLDS, seed=3)
    envelope = None
    if guarded:
        envelope = EnvelopeGuard(PLATFORM, Rammer.control_hz, sees_obstacles=sees)
    loop = ControlLoop(PLATFORM, TASK, Rammer(), robots=WORLDS, envelope=envelope)
    goal = goal_in_float64(simulation.goal)
    loop.begin(goal)
    discs, least = np.asarray(goal.obstacles)[..., :3], np.full(WORLDS, np.inf)
    for step in range(round(seconds * Rammer.control_hz)):
        # Bodies go through what stands in the way here: only the gap counts.
        done = loop.step(simulation.measured, {}, round(1e9 * step * loop.dt))
        simulation.move(done.command)
        place = simulation.truth.to_rigid().position_in_world[:, None, :2]
        gap = np.linalg.norm(place - discs[..., :2], axis=-1) - discs[..., 2] - RADIUS
        least = np.minimum(least, np.where(discs[..., 2] > 0.0, gap, np.inf).min(axis=1))
    return least, envelope


def test_a_controller_that_rams_obstacles_is_stopped_before_them_and_would_not_be_without_the_guard():
    least, envelope = nearest(guarded=True)
    assert (least > 0.0).all(), least
    assert (envelope.trips > 0).all() and "before obstacle " in envelope.events[0].cause
    free, _ = nearest(guarded=False)
    assert (free < 0.0).all()


def test_an_area_alone_leaves_obstacles_to_the_controller():
    def found(**settings):
        return envelope_of(PLATFORM, ControllerSettings(**settings))._blocks

    assert found(guard=ENVELOPE) is not None
    assert found(area=(-2.0, 2.0, -2.0, 2.0)) is None


def test_points_to_stop_at_are_moved_out_of_discs_and_ways_through_discs_are_known():
    blocks, disc = Blocks(PLATFORM), np.array([[[1.0, 0.0, 0.2], [9.0, 9.0, 0.0]]])
    place = blocks.clear(np.array([[0.9, 0.0, 0.0]]), disc)
    assert place[0] == pytest.approx([1.0 - (0.2 + RADIUS + CLEAR_M), 0.0, 0.0])
    here, beyond, aside = (np.array([[x, y, 0.0]]) for x, y in ((0.0, 0.0), (2.0, 0.0), (0.0, 2.0)))
    assert blocks.crosses(here, beyond, disc)[0] and not blocks.crosses(here, aside, disc)[0]
    gap, share = blocks.gaps(here, np.array([[0.5, 0.0, 0.0]]), disc)
    assert gap[0, 0] == pytest.approx(0.5 - 0.2 - RADIUS) and share[0, 0] == 1.0
    assert np.isinf(gap[0, 1]) and share[0, 1] == 0.0, "a disc without a radius is none"


def test_a_backup_that_would_fly_into_a_keep_out_volume_is_braked_before_it_as_a_controller_is():
    robot, task = load_robot("spacecraft_16"), load_task("go_to_pose_3d", "gateway")
    each, volume = robot.actuators.wrench_per_newton[:, :3], task.keep_outs[0]

    def inwards(command, inputs, *rest):
        rigid = inputs.state.to_rigid()
        along = rotate_inverse(rigid.quat_xyzw, -rigid.position_in_world) @ each.T
        return np.eye(len(each))[along.argmax(axis=1)]

    envelope = SimpleNamespace(
        watches=True, guarded=inwards, backup=SimpleNamespace(law=SimpleNamespace(estimator=None))
    )
    controller = SimpleNamespace(
        control_hz=5.0, reset=lambda: None, act=lambda inputs: np.zeros((1, 16)), estimator=None,
        observer=None, readings=(), name="rests",
    )  # fmt: skip
    simulation = BatchSimulation(robot, task, load_scenario("nominal"), worlds=1, seed=1)
    loop = ControlLoop(robot, task, controller, envelope=envelope)
    loop.begin(goal_in_float64(simulation.goal))
    least = np.inf
    for step in range(300):
        simulation.move(loop.step(simulation.measured, {}, round(1e9 * step * loop.dt)).command)
        least = min(least, float(volume.distance(simulation.truth.to_rigid().position_in_world)[0]))
    assert 0.0 < least < 0.6
