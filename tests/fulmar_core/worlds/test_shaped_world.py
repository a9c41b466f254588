"""Bodies that differ from world to world: each moves as a robot of its own would, and others as they always have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.by_kind import dynamics_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.tasks import load_task
from fulmar_core.worlds.by_kind import without_effect
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.shaped_world import BRANCH, can_be_flown, draw_bodies, own_bodies, robot_with

ROBOT, TASK = load_robot("cubesat_8"), load_task("go_to_pose_3d")
ANY, NOMINAL = load_scenario("morphologies"), load_scenario("nominal")
STEPS = 20


def draws(count):
    return Draws(3, np.arange(count), np.zeros(count, dtype=int), WORLD)


def batch(scenario, worlds, *, first=0, robot=ROBOT, dtype=np.float64):
    return BatchSimulation(robot, TASK, scenario, worlds=worlds, seed=3, first=first, dtype=dtype)


def commands(worlds):
    return np.random.default_rng(5).uniform(0.0, 1.0, (STEPS, worlds, 8))


def test_bodies_lie_within_the_spans_and_can_be_flown():
    bodies, spans = draw_bodies(ROBOT, draws(256)), ROBOT.morphology
    own = own_bodies(ROBOT, 256)
    assert spans.mass[0] <= bodies.mass.min() < 12.0
    assert 35.0 < bodies.mass.max() <= spans.mass[1]
    thrust = bodies.thrust / own.thrust
    assert (thrust.min(), thrust.max()) == (pytest.approx(0.7, abs=0.05), pytest.approx(1.3, abs=0.05))
    angle = np.degrees(np.arccos(np.clip(np.sum(bodies.directions * own.directions, axis=-1), -1.0, 1.0)))
    assert 6.0 < angle.max() <= spans.directions_deg + 1e-9
    places = np.linalg.norm(bodies.positions, axis=-1) / np.linalg.norm(own.positions, axis=-1)
    assert (places.min(), places.max()) == (pytest.approx(0.8, abs=0.05), pytest.approx(2.0, abs=0.05))
    assert can_be_flown(bodies).all()


def test_worlds_of_different_bodies_move_to_the_bit_as_each_does_alone():
    given, many = commands(6), batch(ANY, 6, dtype=np.float32)
    alone = [batch(ANY, 1, first=number, dtype=np.float32) for number in range(6)]
    for command in given:
        many.step(command)
        for number, one in enumerate(alone):
            one.step(command[number : number + 1])
    for mine, theirs in zip(
        many.truth.columns(), zip(*(one.truth.columns() for one in alone), strict=True), strict=True
    ):
        np.testing.assert_array_equal(mine, np.concatenate(theirs))


def test_a_body_moves_as_a_robot_whose_file_says_the_same():
    bodies, given = draw_bodies(ROBOT, draws(3).branch(BRANCH)), commands(3)
    many = batch(ANY, 3)
    for command in given:
        many.step(command)
    for number in range(3):
        robot = robot_with(ROBOT, bodies, number)
        one = batch(NOMINAL, 1, first=number, robot=robot)
        for command in given:
            one.step(command[number : number + 1])
        for mine, its in zip(many.truth.columns(), one.truth.columns(), strict=True):
            np.testing.assert_allclose(mine[number], its[0], rtol=1e-9, atol=1e-11)


def test_mujoco_moves_a_body_as_the_core_does():
    pytest.importorskip("mujoco")
    from sim_nodes.mujoco_backend import MujocoBackend

    still = replace(ANY, sensor_noise=False)
    core, given = batch(still, 2), commands(2)
    for command in given:
        core.step(command)
    drawn = draw_episodes(core.robot, core.task, still, seed=3, numbers=np.arange(2))
    for number in range(2):
        backend = MujocoBackend.of(core.robot, core.task, still)
        backend.reset(drawn[number], seed=3, number=number)
        for command in given:
            sample = backend.step(command[number], core.substeps)
        place = np.array([core.truth.x[number], core.truth.y[number], core.truth.z[number]])
        np.testing.assert_allclose(sample.truth.position_in_world, place, atol=2e-4)
        quat = np.array([part[number] for part in core.truth.quat])
        assert abs(abs(quat @ sample.truth.quat_xyzw) - 1.0) < 1e-5


def test_what_else_is_drawn_stays_the_same_to_the_bit():
    kinds = dynamics_of(ROBOT)
    plain, shaped = (kinds.draw_world(scenario, draws(4)) for scenario in (NOMINAL, ANY))
    assert plain.effects is None
    assert shaped.effects.shape == (8, 6, 4)
    same = set(plain.names()) - {"mass", "inertia"}
    for name in same:
        np.testing.assert_array_equal(getattr(plain, name), getattr(shaped, name), err_msg=name)


def test_episodes_have_bodies_of_their_own_and_a_seed_gives_the_same_again():
    one, again = batch(ANY, 4), batch(ANY, 4)
    np.testing.assert_array_equal(one.world.effect, again.world.effect)
    before = one.world.effect.copy()
    one.reset([1])
    assert (one.world.effect[:, [0, 2, 3]] == before[:, [0, 2, 3]]).all()
    assert (one.world.effect[:, 1] != before[:, 1]).any()


def test_a_robot_without_spans_is_refused_in_one_line():
    other = load_robot("spacecraft_16")
    with pytest.raises(
        ConfigError, match=r"the file of 'spacecraft_16' has no 'morphology'.*take another scenario"
    ):
        batch(ANY, 1, robot=other)
    assert without_effect(other, ANY) == ("morphology",)
    assert without_effect(ROBOT, ANY) == ()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": (8.0, 4.0)}, "'mass' must be"),
        ({"thrust": (0.0, 1.0)}, "'thrust' must be"),
        ({"directions_deg": 50.0}, "'directions_deg' = 50 must lie in"),
    ],
)
def test_spans_that_make_no_sense_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(ROBOT.morphology, **change)


def test_on_off_valves_have_no_spans():
    with pytest.raises(ValueError, match="'morphology' is for thrusters with 'continuous: true'"):
        replace(load_robot("spacecraft_16"), morphology=ROBOT.morphology)
