"""Many worlds in one batch."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.robot import load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import load_task

ROBOT, TASK = load_robot("floating_platform"), load_task("go_to_pose")
IDEAL, NOMINAL, UNCERTAIN = (load_scenario(name) for name in ("ideal", "nominal", "uncertain"))
PARTS = ("position_in_world", "quat_xyzw", "velocity_in_world", "angular_velocity_in_body")


def build(scenario=IDEAL, *, worlds=5, seed=3, **kwargs):
    return BatchSimulation(ROBOT, TASK, scenario, worlds=worlds, seed=seed, **kwargs)


def commands(steps, worlds, seed=1):
    return (np.random.default_rng(seed).uniform(size=(steps, worlds, 8)) > 0.6).astype(np.float32)


def test_a_reset_begins_anew_in_the_asked_worlds_alone():
    simulation = build()
    for command in commands(5, 5):
        simulation.step(command)
    before = [getattr(simulation.truth, part).copy() for part in PARTS]
    goal = simulation.goal.position_in_world.copy()
    simulation.reset([1, 3])
    for part, old in zip(PARTS, before, strict=True):
        np.testing.assert_array_equal(getattr(simulation.truth, part)[[0, 2, 4]], old[[0, 2, 4]])
    assert not simulation.truth.velocity_in_world[[1, 3]].any()
    moved = np.any(simulation.goal.position_in_world != goal, axis=1)
    assert moved.tolist() == [False, True, False, True, False]


def test_a_reset_leaves_earlier_states_as_they_were():
    simulation = build()
    simulation.step(commands(1, 5)[0])
    seen = simulation.truth.position_in_world.copy()
    kept = simulation.measured
    simulation.step(commands(1, 5)[0])
    simulation.reset(range(5))
    np.testing.assert_array_equal(kept.position_in_world, seen)


def test_each_world_gets_a_new_episode_at_each_reset():
    simulation = build()
    starts = [simulation.truth.position_in_world.copy()]
    for _ in range(2):
        simulation.reset(range(5))
        starts.append(simulation.truth.position_in_world.copy())
    assert len(np.unique(np.concatenate(starts), axis=0)) == 15


@pytest.mark.parametrize("scenario", ["ideal", "uncertain"])
def test_a_batch_of_n_is_n_single_worlds(scenario):
    # Disturbances of a world hang on its number, so the truth has to agree whatever the noise.
    batch = build(load_scenario(scenario), worlds=4, dtype=np.float64)
    plan = commands(20, 4).astype(float)
    for command in plan:
        batch.step(command)
    for world in range(4):
        alone = build(load_scenario(scenario), worlds=world + 1, dtype=np.float64)
        for command in plan:
            alone.step(command[: world + 1])
        for part in PARTS:  # rounding of sums in another order
            np.testing.assert_allclose(
                getattr(alone.truth, part)[world], getattr(batch.truth, part)[world], rtol=0, atol=1e-12
            )


def test_the_same_seed_gives_the_same_worlds_with_noise_and_disturbances():
    first, second = build(UNCERTAIN), build(UNCERTAIN)
    for command in commands(5, 5):
        first.step(command)
        second.step(command)
    np.testing.assert_array_equal(first.measured.position_in_world, second.measured.position_in_world)


def test_another_seed_gives_other_worlds():
    assert not np.array_equal(build(seed=3).truth.position_in_world, build(seed=4).truth.position_in_world)


def test_the_ideal_world_is_measured_as_it_is_and_the_nominal_one_with_noise():
    ideal, nominal = build(IDEAL), build(NOMINAL)
    np.testing.assert_array_equal(ideal.measured.position_in_world, ideal.truth.position_in_world)
    error = nominal.measured.position_in_world - nominal.truth.position_in_world
    assert 0.0 < np.abs(error).max() < 0.006  # six deviations of 1 mm


def test_uncertain_bodies_answer_one_command_differently_and_nominal_ones_alike():
    spread = []
    for scenario in (IDEAL, UNCERTAIN):
        simulation = build(scenario, worlds=20)
        simulation.step(np.tile([1.0, 0, 0, 0, 0, 0, 0, 0], (20, 1)))
        spread.append(np.std(np.abs(simulation.truth.angular_velocity_in_body[:, 2])))
    assert spread[0] < 1e-6  # float32
    assert spread[1] > 0.01


def test_the_control_rate_sets_how_long_a_step_lasts():
    assert build().control_dt == pytest.approx(0.2)
    fast = build(control_hz=50.0)
    assert (fast.substeps, fast.control_dt) == (1, pytest.approx(0.02))
    with pytest.raises(ValueError, match="must divide"):
        build(control_hz=7.0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_floating_type_is_kept_through_steps_and_resets(dtype):
    simulation = build(UNCERTAIN, dtype=dtype)
    simulation.step(commands(1, 5)[0])
    simulation.reset([0])
    assert {getattr(simulation.truth, part).dtype for part in PARTS} == {np.dtype(dtype)}
    assert {getattr(simulation.measured, part).dtype for part in PARTS} == {np.dtype(dtype)}


def test_float32_follows_float64_over_a_whole_episode():
    single, double = build(dtype=np.float32), build(dtype=np.float64)
    for command in commands(250, 5):
        single.step(command)
        double.step(command)
    # 2,500 additions of float32 on values up to some ten metres: 1e-6 each, in random directions.
    np.testing.assert_allclose(
        single.truth.position_in_world, double.truth.position_in_world, rtol=0, atol=5e-3
    )
