"""What a law makes of observations: less noise, pushes and dead valves, in the body's own frame."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.controllers.seen import Reader
from fulmar_core.controllers.situation import Watch, raw_situation
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.health.suspicion import Suspicion
from fulmar_core.robot import load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import load_task

ROBOT, WORLDS = load_robot("floating_platform"), 16


def watched(task, scenario, steps=40):
    """Robots whose pairs of valves open at random, what is watched of them, and the simulation."""
    task = load_task(task)
    simulation = BatchSimulation(ROBOT, task, load_scenario(scenario), worlds=WORLDS, seed=4)
    reader = Reader(ROBOT, task)
    watch = Watch(ROBOT, reader, Suspicion(retry_s=0.0), simulation.control_dt)  # no trials of dead valves
    rng = np.random.default_rng(2)
    for _ in range(steps):
        watch.look(simulation.observe())
        command = (np.argsort(rng.random((WORLDS, 8)), axis=1) < 2).astype(float)
        watch.acts(command)
        simulation.step(command)
    return watch.look(simulation.observe()), raw_situation(reader, simulation.observe()), simulation


def in_body(simulation, x, y):
    c, s = np.cos(simulation.truth.yaw), np.sin(simulation.truth.yaw)
    return c * x + s * y, c * y - s * x


@pytest.mark.parametrize("task", ["drift_go_to_pose", "go_to_position", "track_velocities"])
def test_a_force_is_found_in_the_bodys_frame_whatever_the_task_shows(task):
    now, _, simulation = watched(task, "drift_force_2", steps=80)
    ahead, left = in_body(simulation, simulation.world.force_x, simulation.world.force_y)
    np.testing.assert_allclose(now.push[:, 0], ahead, atol=0.1)
    np.testing.assert_allclose(now.push[:, 1], left, atol=0.1)


def test_velocities_are_known_better_than_they_are_measured():
    now, raw, simulation = watched("drift_go_to_pose", "drift_velocity_noise_4")
    ahead, _ = in_body(simulation, simulation.truth.vx, simulation.truth.vy)
    assert np.std(now.motion[0] - ahead) < 0.6 * np.std(raw.motion[0] - ahead)
    np.testing.assert_allclose(now.goal[0], raw.goal[0], atol=0.01)


def test_dead_valves_are_known():
    now, _, simulation = watched("drift_go_to_pose", "drift_two_lost")
    np.testing.assert_array_equal(now.alive, simulation.world.alive.T)


def test_another_number_of_robots_begins_anew():
    task = load_task("drift_go_to_pose")
    watch = Watch(ROBOT, Reader(ROBOT, task), Suspicion(), 0.2)
    rng = np.random.default_rng(1)
    rows = rng.uniform(-1.0, 1.0, (3, len(task.observation_names)))
    watch.look(rows)
    alone = watch.look(rows[0])
    watch.reset()
    np.testing.assert_array_equal(watch.look(rows[0]).goal, alone.goal)
    assert np.shape(alone.turn) == ()
