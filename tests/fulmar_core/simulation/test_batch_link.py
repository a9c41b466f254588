"""A link in the batch: when commands act, what is lost, and that nothing else changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.worlds.link import Link
from fulmar_core.worlds.scenario import load_scenario

IDEAL = load_scenario("ideal")
WORLDS = 16


def simulation(
    link: Link, robot: str = "floating_platform", task: str = "go_to_pose", **more
) -> BatchSimulation:
    scenario = replace(IDEAL, link=link)
    options = {"worlds": WORLDS, "seed": 4, "xp": np, "dtype": np.float64, **more}
    return BatchSimulation(load_robot(robot), load_task(task), scenario, **options)


def speeds(link: Link, steps: int = 20) -> np.ndarray:
    """Speed of each world after each step with one valve open, shape (steps, worlds)."""
    batch, found = simulation(link), []
    command = np.zeros((WORLDS, 8))
    command[:, 0] = 1.0
    for _ in range(steps):
        batch.move(command)
        found.append(np.hypot(*batch.truth.columns()[3:5]) + np.abs(batch.truth.columns()[5]))
    return np.array(found)


def test_commands_act_after_both_ways() -> None:
    direct, late = speeds(Link()), speeds(Link(delay_s=0.1))
    assert direct[0].min() > 0.0 == late[0].max()
    np.testing.assert_allclose(late[1:], direct[:-1], rtol=0.05)  # one control step of 0.2 s


def test_a_short_delay_costs_a_part_of_a_step() -> None:
    direct, late = speeds(Link(), steps=1), speeds(Link(delay_s=0.05), steps=1)
    np.testing.assert_allclose(late, 0.5 * direct, rtol=0.02)


def test_each_world_loses_messages_of_its_own_and_a_seed_gives_the_same_again() -> None:
    lossy = speeds(Link(loss=0.4))
    assert np.array_equal(lossy, speeds(Link(loss=0.4)))
    assert len(np.unique(lossy[-1].round(9))) > WORLDS // 2
    assert lossy[-1].mean() < speeds(Link())[-1].mean()


def test_a_silence_as_long_as_the_watchdogs_time_makes_the_robot_safe() -> None:
    batch = simulation(Link(loss=0.9))
    command = np.ones((WORLDS, 8))
    applied = []
    for _ in range(200):
        batch.move(command)
        applied.append(batch._actuation.applied[0].copy())
    share = np.mean(applied)  # one in a hundred commands comes, and holds for one step more: 0.4 s in all
    assert 0.005 < share < 0.04


def test_worlds_that_begin_anew_begin_with_an_empty_link() -> None:
    batch = simulation(Link(loss=0.9))
    for _ in range(5):
        batch.move(np.ones((WORLDS, 8)))
    batch.reset([0, 3])
    assert batch._link is not None
    assert not batch._link._received[[0, 3]].any()
    assert batch._link._silent_s[[0, 3]].tolist() == [0.0, 0.0]


def test_a_snapshot_goes_on_as_the_batch_did() -> None:
    batch = simulation(Link(delay_s=0.08, jitter_s=0.02, loss=0.3))
    command = np.ones((WORLDS, 8))
    for _ in range(5):
        batch.move(command)
    snapshot = batch.snapshot()
    ways = []
    for _ in range(2):
        for _ in range(10):
            batch.move(command)
        ways.append(np.array(batch.truth.columns()))
        batch.restore(snapshot)
    assert np.array_equal(*ways)


@pytest.mark.parametrize(
    ("robot", "task"),
    [("kingfisher", "go_to_pose"), ("spacecraft_16", "go_to_pose_3d"), ("turtlebot2", "go_to_pose")],
)
def test_every_family_moves_over_a_radio_and_stays_finite(robot: str, task: str) -> None:
    batch = simulation(load_scenario("radio").link, robot, task)
    command = np.tile(load_robot(robot).actuators.scale, (WORLDS, 1))
    for _ in range(20):
        batch.step(command)
    assert all(np.isfinite(column).all() for column in batch.truth.columns())


def test_torch_has_the_same_link() -> None:
    torch = pytest.importorskip("torch")
    link = load_scenario("radio").link
    batches = simulation(link), simulation(link, xp=torch, dtype=torch.float64)
    for _ in range(10):
        for batch, ones in zip(batches, (np.ones, torch.ones), strict=True):
            batch.move(ones((WORLDS, 8)))
    for one, other in zip(*(batch.truth.columns() for batch in batches), strict=True):
        np.testing.assert_allclose(np.asarray(one), np.asarray(other), atol=1e-9)
