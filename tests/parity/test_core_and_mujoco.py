"""The core's dynamics and MuJoCo's: two implementations, one motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.lqr import load_lqr
from fulmar_core.disturbances.scenario import World, load_scenario
from fulmar_core.metrics import episode_metrics, successes
from fulmar_core.robot import load_robot
from fulmar_core.rollout import roll_out_in_backends, roll_out_in_batch
from fulmar_core.state import RigidBodyState, planar_state
from fulmar_core.tasks import load_task
from sim_nodes.mock_backend import MockBackend

pytest.importorskip("mujoco")

from sim_nodes.mujoco_backend import MujocoBackend

PLANAR = load_robot("floating_platform")
FREE = replace(PLANAR, body=replace(PLANAR.body, planar=False, inertia=(0.1, 0.2, 0.3)))
CALM = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
PLANAR_PUSH = ((0.05, -0.03, 0.0), (0.0, 0.0, 0.004))
SPATIAL_PUSH = ((0.05, -0.03, 0.02), (0.003, -0.002, 0.004))
STEPS = 100  # 20 s


def start_of(robot) -> RigidBodyState:
    if robot.body.planar:
        return planar_state(0.3, -0.2, 0.8, vx=0.1, vy=-0.05, yaw_rate=0.2)
    quat = np.array([0.1, -0.3, 0.2, 0.9])
    return RigidBodyState(
        np.array([0.3, -0.2, 0.1]),
        quat / np.linalg.norm(quat),
        np.array([0.1, -0.05, 0.02]),
        np.array([0.2, -0.1, 0.15]),
    )


@pytest.mark.parametrize(
    ("robot", "wrench"),
    [(PLANAR, CALM), (PLANAR, PLANAR_PUSH), (FREE, CALM), (FREE, SPATIAL_PUSH)],
    ids=["planar", "planar pushed", "six degrees", "six degrees pushed"],
)
def test_core_and_mujoco_move_alike_under_the_same_valves(robot, wrench):
    world = World(5.0, robot.body.inertia, *wrench)
    core, mujoco = MockBackend(robot), MujocoBackend(robot, sensor_noise=False)
    rng = np.random.default_rng(6)
    for backend in (core, mujoco):
        backend.reset(start_of(robot), world, seed=0)
    for _ in range(STEPS):
        command = (rng.uniform(size=8) > 0.7).astype(float)
        ours, theirs = core.step(command, 10).truth, mujoco.step(command, 10).truth
    # Same integrator: what remains is rounding, grown over 1,000 physics steps on values of up to some metres.
    tight = {"rtol": 0.0, "atol": 1e-9}
    np.testing.assert_allclose(theirs.position_in_world, ours.position_in_world, **tight)
    np.testing.assert_allclose(theirs.velocity_in_world, ours.velocity_in_world, **tight)
    np.testing.assert_allclose(theirs.angular_velocity_in_body, ours.angular_velocity_in_body, **tight)
    alike = abs(float(np.dot(theirs.quat_xyzw, ours.quat_xyzw)))  # q and -q are one attitude
    assert alike == pytest.approx(1.0, abs=1e-9)
    assert np.linalg.norm(ours.position_in_world - start_of(robot).position_in_world) > 0.1  # it did move


@pytest.mark.parametrize("task", ["go_to_pose", "go_to_position"])
def test_an_lqr_is_judged_alike_in_the_batch_and_in_mujoco(task):
    the_task, scenario = load_task(task), load_scenario("nominal")
    lqr = load_lqr(PLANAR, the_task)
    batch = roll_out_in_batch(lqr, PLANAR, the_task, scenario, episodes=6, seed=11)
    mujoco = roll_out_in_backends(lqr, lambda: MujocoBackend(PLANAR), the_task, scenario, episodes=6, seed=11)
    assert successes(batch, the_task).tolist() == successes(mujoco, the_task).tolist() == [True] * 6
    times = [episode_metrics(run, the_task)["time_to_target_s"] for run in (batch, mujoco)]
    # Other noise, so the last corrections differ; the way there takes some fifteen seconds.
    np.testing.assert_allclose(times[0], times[1], rtol=0, atol=6.0)


def test_without_noise_both_fly_the_same_path():
    task, scenario = load_task("go_to_pose"), load_scenario("ideal")
    lqr = load_lqr(PLANAR, task)
    batch = roll_out_in_batch(lqr, PLANAR, task, scenario, episodes=4, seed=11)
    mujoco = roll_out_in_backends(
        lqr, lambda: MujocoBackend(PLANAR, sensor_noise=False), task, scenario, episodes=4, seed=11
    )
    # The batch is float32: near the goal a valve may once differ, until then it is rounding.
    np.testing.assert_allclose(batch.position_error[:, :20], mujoco.position_error[:, :20], rtol=0, atol=1e-3)


def test_more_episodes_than_simulators_are_run_in_turns(monkeypatch):
    from fulmar_core import rollout

    task, scenario = replace(load_task("go_to_pose"), episode_s=2.0), load_scenario("nominal")
    lqr = load_lqr(PLANAR, task)
    seen = []

    def run(side_by_side):
        monkeypatch.setattr(rollout, "SIDE_BY_SIDE", side_by_side)
        return roll_out_in_backends(
            lqr, lambda: MujocoBackend(PLANAR), task, scenario, episodes=5, seed=3, progress=seen.append
        )

    np.testing.assert_array_equal(run(2).position_error, run(5).position_error)
    assert seen == sorted(seen[:30]) + sorted(seen[30:])
    assert seen[-1] == 50  # 5 episodes of 10 steps
