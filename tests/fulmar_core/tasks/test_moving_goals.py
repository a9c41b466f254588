"""Targets that move in space: their paths, their sequence, and laws that follow them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.target_motion import TargetMotion
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import turn
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_core.tasks.goal_files import Trajectory, load_goals
from fulmar_core.tasks.goal_sequence import goal_sequence
from fulmar_core.tasks.references.in_space import Helix, TiltedCircle
from tests.fulmar_core.loop.test_guarded_loop import LAB, S
from tests.fulmar_core.loop.test_guarded_loop import Bench as PlanarBench
from tests.fulmar_core.loop.test_guards_in_space import STEP_NS, Bench
from tests.inputs import inputs_at

CRAFT = load_robot("spacecraft_16")
CIRCLE = Trajectory("trajectory", "t", TiltedCircle("tilted_circle", radius=2.0, tilt_deg=90.0), speed=0.1)
HELIX = Trajectory("trajectory", "t", Helix("helix", radius=1.0, pitch=0.5, turns=2.0), speed=0.1)
NOWHERE = SpatialState.resting(SpatialState.target_at((9.0, 0.0, 0.0)))


def axes_of(pose: np.ndarray) -> np.ndarray:
    """Body axes in the world, one a row."""
    quat = tuple(pose[3:])
    return np.array([turn(quat, tuple(axis)) for axis in np.eye(3)])


def test_a_helix_rises_about_its_centre_at_its_speed():
    target = replace(HELIX, path=replace(HELIX.path, centre=(1.0, -2.0, 3.0))).target()
    length = 2.0 * np.hypot(2.0 * np.pi, 0.5)
    assert target.duration_s == pytest.approx(length / 0.1, rel=1e-5)
    begin, end = target.pose(0.0), target.pose(target.duration_s)
    assert begin[:3] == pytest.approx([2.0, -2.0, 2.5])
    assert end[:3] == pytest.approx([2.0, -2.0, 3.5])
    assert target.pose(1e6) == pytest.approx(end)
    ways = np.diff([target.pose(t)[:3] for t in np.arange(0.0, 100.0, 0.5)], axis=0)
    assert np.linalg.norm(ways, axis=1) == pytest.approx(0.05, rel=2e-3)


@pytest.mark.parametrize("file", [HELIX, CIRCLE])
def test_x_points_along_the_path_and_z_up(file):
    target = file.target()
    for time_s in np.linspace(0.5, target.duration_s - 0.5, 40):
        x, _, z = axes_of(target.pose(time_s))
        way = target.pose(time_s + 0.01)[:3] - target.pose(time_s - 0.01)[:3]
        assert x @ way == pytest.approx(np.linalg.norm(way), rel=1e-4)
        assert z @ file.path.up > 0.9
    assert np.linalg.norm(target.pose(1.0)[3:]) == pytest.approx(1.0)


def test_a_circle_that_stands_upright_closes_without_a_jump_of_its_attitude():
    target = replace(CIRCLE, loops=0).target()
    assert target.duration_s == np.inf
    before, after = (target.pose(target.round_s + offset) for offset in (-0.01, 0.01))
    assert after[:3] == pytest.approx(before[:3], abs=0.003)
    assert abs(after[3:] @ before[3:]) == pytest.approx(1.0, abs=1e-5)
    top = target.pose(0.25 * target.round_s)
    assert top[:3] == pytest.approx([0.0, 0.0, 2.0], abs=1e-3)
    assert axes_of(top)[0] == pytest.approx([-1.0, 0.0, 0.0], abs=2e-3)


def test_facing_may_be_fixed_or_any():
    fixed = replace(CIRCLE, facing="fixed", angles_deg=(0.0, 0.0, 90.0))
    assert SpatialState.written(fixed.target().pose(7.0))[3:] == pytest.approx([0.0, 0.0, 90.0])
    free = replace(CIRCLE, facing="any")
    assert goal_sequence(free, CRAFT).topic == "goal_point"
    assert goal_sequence(fixed, CRAFT).topic == goal_sequence(CIRCLE, CRAFT).topic == "goal_pose"
    with pytest.raises(ValueError, match="'angles_deg' needs facing: fixed"):
        replace(CIRCLE, angles_deg=(0.0, 0.0, 90.0))


def test_the_sequence_goes_by_the_clock_and_ends():
    sequence, target = goal_sequence(CIRCLE, CRAFT), CIRCLE.target()
    assert sequence.step(NOWHERE, 3.0).current == pytest.approx(target.pose(3.0))
    assert (sequence.progress, sequence.done) == ("0 of 1 rounds", False)
    assert sequence.step(NOWHERE, 200.0).current == pytest.approx(target.pose(0.0), abs=1e-6)
    assert (sequence.progress, sequence.done) == ("1 of 1 rounds", True)
    sequence = goal_sequence(HELIX, CRAFT)
    sequence.step(NOWHERE, 0.35 * HELIX.target().duration_s)
    assert sequence.progress == "30 % of the path"


def test_the_plane_has_no_such_targets():
    with pytest.raises(
        ConfigError, match="is in space, and robot 'floating_platform' moves in two dimensions"
    ):
        goal_sequence(load_goals("helix"), load_robot("floating_platform"))
    with pytest.raises(ConfigError, match="only positions and poses can be a path"):
        goal_sequence(CIRCLE, CRAFT, as_path=True)


def stacked(moved):
    """Motion and accelerations, shape (2, n, 6)."""
    return np.stack((moved.motion, moved.change))


def test_motion_of_targets_is_their_difference_and_a_jump_is_none():
    motion = TargetMotion(speed=3.0, rate=6.0)
    here = SpatialState.target_at((1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    there = SpatialState.target_at((1.0, 0.02, 0.0, 0.0, 0.0, 3.0))
    far = SpatialState.target_at((5.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert not stacked(motion.update(np.stack((here, here)), 0, 0.2)).any()
    moved = motion.update(np.stack((there, far)), 0, 0.2)
    velocity, rate = moved.motion[:, :3], moved.motion[:, 3:]
    assert velocity == pytest.approx(np.array([[0.0, 0.1, 0.0], [0.0, 0.0, 0.0]]))
    assert rate == pytest.approx(np.array([[0.0, 0.0, np.deg2rad(15.0)], [0.0, 0.0, 0.0]]))
    assert not stacked(motion.update(np.stack((there, far)), 0, 0.2)).any()  # exactly
    motion.reset()
    assert not stacked(motion.update(np.stack((here, here)), 0, 0.2)).any()


def test_a_goal_that_comes_a_step_late_asks_for_no_force():
    """One that comes twice and then leaps: its velocity jumps by itself, and nothing bends like that."""
    motion = TargetMotion(speed=0.4, rate=0.6, acceleration=0.12, turning=0.3)
    found = []
    for step, shown in enumerate((0, 1, 2, 3, 3, 5, 6)):
        target = SpatialState.target_at((0.02 * shown, 0.0, 0.0, 0.0, 0.0, 0.0))[None]
        found.append(motion.update(target, (1 + step) * 200_000_000, 0.2).change)
    assert np.abs(found).max() < 1e-9
    bent = SpatialState.target_at((0.14, 0.004, 0.0, 0.0, 0.0, 0.0))[None]
    assert motion.update(bent, 8 * 200_000_000, 0.2).change[0, 1] == pytest.approx(0.1)


def test_motion_goes_by_the_time_that_has_passed():
    motion = TargetMotion(speed=0.4, rate=0.6)
    begin, step_ns = 3_000_000_000, 200_000_000

    def moved(steps, metres, degrees, *, stamp_ns=None):
        target = SpatialState.target_at((metres, 0.0, 0.0, 0.0, 0.0, degrees))[None]
        moved = motion.update(target, begin + steps * step_ns if stamp_ns is None else stamp_ns, 0.2)
        return moved.motion[0, 0], np.rad2deg(moved.motion[0, 5])

    assert moved(0, 0.0, 0.0) == (0.0, 0.0)
    assert moved(1, 0.02, 1.0) == pytest.approx((0.1, 5.0))
    assert moved(3, 0.06, 3.0) == pytest.approx((0.1, 5.0))  # one step was missed
    assert moved(6, 0.12, 6.0) == pytest.approx((0.1, 5.0))
    assert moved(6, 0.14, 7.0) == pytest.approx((0.1, 5.0))  # no time passed: a step
    assert moved(0, 0.16, 8.0, stamp_ns=0) == pytest.approx((0.1, 5.0))  # without a clock
    assert moved(7, 0.18, 9.0) == pytest.approx((0.1, 5.0))


@pytest.mark.parametrize("law", ["lqr", "pd"])
def test_laws_take_no_velocity_of_a_target_that_is_faster_than_tasks_ask(law):
    robot, task = load_robot("int_ball2"), load_task("go_to_pose_3d")
    resting = SpatialState.resting(SpatialState.target_at((0.0, 0.0, 0.0)))

    def speed_of(shift, steps):
        controller = load_classical(robot, task, law=law)
        seen = []
        controller.wrench = lambda way, now: seen.append(now.velocity[0, 0]) or np.zeros((1, 6))
        for x, stamp_ns in ((0.5, 200_000_000), (0.5 + shift, (1 + steps) * 200_000_000)):
            goal = goal_at(tuple(SpatialState.target_at((x, 0.0, 0.0)).tolist()))
            controller.act(inputs_at(robot, task, resting, goal, stamp_ns=stamp_ns))
        return -seen[-1]

    assert speed_of(0.02, 1) == pytest.approx(robot.performance.speed)
    assert speed_of(0.02, 2) == pytest.approx(0.05)
    assert speed_of(0.04, 1) == 0.0  # a nudge, within the task's tolerance


def test_a_goal_that_moves_a_little_goes_on_and_one_that_moves_more_begins_anew():
    bench = Bench(goals_streamed=True)
    forgotten = []
    bench.guard.switch.current.controller.reset = lambda: forgotten.append(bench.now_ns)
    bench.give(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    bench.step(0.0, 0.0, 0.0)
    begun = len(forgotten)
    bench.give(1.0, 0.02, 0.0, 0.0, 0.0, 2.0)
    assert bench.guard.mission.moved
    bench.step(0.0, 0.0, 0.0)
    assert len(forgotten) == begun
    assert bench.guard.loop.goal.current[0, 1] == 0.02
    for pose in ((1.0, 0.1, 0.0, 0.0, 0.0, 2.0), (1.0, 0.1, 0.0, 0.0, 0.0, 9.0)):
        bench.give(*pose)
        assert not bench.guard.mission.moved
        bench.step(0.0, 0.0, 0.0)
        begun += 1
        assert len(forgotten) == begun
    assert bench.guard.mission.goals_received == 3


def test_a_controller_that_comes_late_to_a_stream_takes_its_past_as_one_goal_and_waits_for_that_of_its_state():
    bench = Bench(goals_streamed=True)
    mission = bench.guard.mission
    for number in range(300):
        assert mission.lacks_something_of(S + 299 * STEP_NS)
        bench.guard.take_goal(
            SpatialState.target_at((0.01 * number, 0.0, 0.0))[None], S + number * STEP_NS, 0
        )
    assert not mission.lacks_something_of(S + 299 * STEP_NS)
    assert mission.goals_received == 1
    assert bench.guard.loop.goal.current[0, 0] == pytest.approx(2.99)


@pytest.mark.parametrize(("after_s", "moved"), [(0.2, True), (2.0, False)])
def test_in_the_plane_a_goal_near_the_one_before_begins_anew_unless_it_is_streamed(after_s, moved):
    bench = PlanarBench()
    bench.give(goal_at((0.5, 0.0, 0.0)), S)
    bench.give(goal_at((0.55, 0.0, 0.0)), S + round(after_s * S))
    assert (bench.guard.mission.moved, bench.guard.mission.goals_received) == (moved, 2 - moved)


def test_a_gate_that_turns_where_it_stands_is_another_goal():
    bench = PlanarBench(task="race_gates")
    bench.give(goal_at((1.0, 0.0, 0.0)), S)
    bench.give(goal_at((1.0, 0.1, np.pi)), S + 1)
    assert (bench.guard.mission.moved, bench.guard.mission.goals_received) == (False, 2)


def test_a_target_that_moves_does_not_release_a_robot_that_left_its_area():
    bench = PlanarBench(area=LAB)
    bench.give(goal_at((-0.9, 0.0, 0.0)), S)
    assert bench.step(0.9)[1] is not None
    assert bench.step(1.1)[1] is None
    for number in range(1, 4):
        bench.give(goal_at((-0.9, 0.001 * number, 0.0)), S + number * STEP_NS)
        assert bench.step(0.9)[1] is None
    bench.give(goal_at((-0.9, 0.0, 0.0)), 9 * S)
    assert bench.step(0.9)[1] is not None


def test_a_repeated_goal_of_an_operator_begins_anew_as_before():
    bench = Bench()
    bench.give(1.0, 0.0, 0.0)
    bench.give(1.0, 0.0, 0.0)
    assert (bench.guard.mission.moved, bench.guard.mission.goals_received) == (False, 2)


def test_the_title_of_the_helix_has_the_width_of_its_path():
    helix = load_goals("helix")
    width = np.ptp(helix.target().points[:, 0])
    assert f"{width:.0f} m wide" in helix.title
