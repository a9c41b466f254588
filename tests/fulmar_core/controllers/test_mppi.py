"""MPPI of aircraft: what it holds, that a seed repeats a flight, and which settings are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_benchmarks.falcon.cells import SCENARIOS, falcon_cell, fly
from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_lqi import FlightLqr
from fulmar_core.controllers.flight_mppi import FlightMppi, mppi_settings
from fulmar_core.controllers.flight_reference import Aim
from fulmar_core.controllers.flight_rollouts import FlightCost, FlightRollouts, loss_angles
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import from_euler
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64

ROBOT = load_robot("airship_v7")
TASK = load_task("fly_a").fitted(ROBOT)
SETTINGS = replace(mppi_settings(ROBOT), observer=None)
FEW = replace(SETTINGS, rollouts=8, horizon_s=0.4)


def flown(settings, *, seconds, seeds=(0,)):
    """Flights along (a) with exact state, one for each seed."""
    law = FlightMppi(ROBOT, TASK, settings)
    law.seeds = seeds
    task = replace(TASK, episode_s=seconds)
    return roll_out_in_batch(law, ROBOT, task, SCENARIOS["exact"], episodes=len(seeds), seed=1)


def inputs_of_trim(law):
    """What one craft sees in level flight at the beginning of (a)."""
    start, goal = TASK.draw(Draws(1, np.arange(1), np.zeros(1)), ROBOT, training=False)
    goal = goal_in_float64(TASK.begun(goal, start))
    command = find_trim(ROBOT, ROBOT.airframe.speed, float(start.z[0])).command
    return Inputs(start, goal, np.zeros((1, 0)), command[None], None, 0, 0.01)


@pytest.mark.slow  # less than a second shows nothing: a craft that is commanded nothing stays as near
def test_it_stays_within_three_centimetres_over_the_water():
    run = flown(SETTINGS, seconds=1.0)
    assert not run.touching.any()
    assert np.max(run.position_error) <= 0.03


@pytest.mark.slow
def test_without_the_law_it_flies_by_its_plans_alone():
    open_loop = replace(SETTINGS, feedback=0.0, noise=(0.05, 0.05, 0.05, 0.1, 0.1), temperature=3.0)
    run = flown(open_loop, seconds=1.0)
    assert not run.touching.any()
    assert np.max(run.position_error) <= 0.15


def test_a_seed_repeats_a_flight_and_another_seed_does_not():
    first, again, other = (flown(FEW, seconds=0.1, seeds=(seed,)) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.shares, again.shares)
    assert np.abs(np.asarray(first.shares) - np.asarray(other.shares)).max() > 1e-3


def test_craft_side_by_side_fly_as_each_would_alone_with_its_seed():
    both = flown(FEW, seconds=0.1, seeds=(3, 4))
    for row, seed in enumerate((3, 4)):
        alone = flown(FEW, seconds=0.1, seeds=(seed,))
        np.testing.assert_allclose(both.shares[row], alone.shares[0], atol=1e-6)


def test_the_seed_of_a_run_is_that_of_the_noise_and_part_of_the_identity():
    laws = [load_classical(ROBOT, TASK, law="mppi", seed=seed) for seed in (0, 5)]
    assert [law.seeds for law in laws] == [(0,), (5,)]
    assert laws[0].metadata()["sha256"] != laws[1].metadata()["sha256"]


def test_a_flight_into_the_water_costs_more_than_any_other():
    weights = replace(SETTINGS.law, observer=None)
    rollouts = FlightRollouts(ROBOT, FlightLqr(ROBOT, TASK, weights), FlightCost(), step_s=0.04, share=0.0)
    trim = find_trim(ROBOT, 28.0, 1.0)
    state = trim.state.mapped(lambda part: np.asarray(part)[None])
    servos = np.concatenate((trim.command, np.zeros(3)))[None]
    aim = Aim(np.array([[0.0, 1.0]]), np.zeros((1, 2)), np.zeros((1, 2)))
    corrections = np.zeros((25, 1, 2, 5))
    corrections[:, 0, 1, 0] = 0.3  # nose down
    level, diving = rollouts.fly(state, servos, [aim] * 26, corrections)[0]
    assert level < 10.0
    assert diving > 1e7


@pytest.mark.parametrize(
    ("alpha_deg", "cost", "lost"),
    [
        (4.0, FlightCost(), False),
        (5.0, FlightCost(), True),
        (-2.0, FlightCost(), False),
        (-3.0, FlightCost(), True),
        (5.0, FlightCost(alpha_deg=6.0), False),
        (-7.0, FlightCost(alpha_deg=6.0), True),
    ],
)
def test_a_flight_outside_the_angles_that_the_coefficients_are_for_is_lost(alpha_deg, cost, lost):
    """For airship_v7 from -2.5° to 4.5°; a setting takes their place, either way."""
    law = FlightLqr(ROBOT, TASK, replace(SETTINGS.law, observer=None))
    rollouts = FlightRollouts(ROBOT, law, cost, step_s=0.001, share=0.0)
    nose = from_euler(np.zeros(1), np.radians([-alpha_deg]), np.zeros(1))
    at, zero = np.full(1, 50.0), np.zeros(1)
    state = SpatialState(zero, zero, at, *nose, np.full(1, 28.0), zero, zero, zero, zero, zero)
    aim = Aim(np.array([[0.0, 50.0]]), np.zeros((1, 2)), np.zeros((1, 2)))
    servos = np.concatenate((find_trim(ROBOT, 28.0, 50.0).command, np.zeros(3)))[None]
    found = rollouts.fly(state, servos, [aim] * 2, np.zeros((1, 1, 1, 5)))[0, 0]
    assert (found > 1e5) == lost


@pytest.mark.parametrize(
    ("robot", "angles"), [("airship_v7", (-2.5, 4.5)), ("sr22", (-6.0, 9.75)), ("a0s", (-9.75, 9.75))]
)
def test_flights_stay_within_most_of_the_stall_angle_too(robot, angles):
    assert loss_angles(load_robot(robot)) == angles


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"step_s": 0.05}, "step_s = 0.05 must be greater than 0, and at most 0.04 s"),
        ({"plan_hz": 10.0}, "plan_hz = 10 must be at least 20"),
        ({"rollouts": 7}, "rollouts = 7 must be an even number"),
        ({"knot_s": 3.0}, "step_s <= knot_s <= horizon_s"),
        ({"temperature": 0.0}, "temperature and every noise must be greater than 0"),
        ({"noise": (0.1, 0.0)}, "temperature and every noise must be greater than 0"),
        ({"feedback": 2.0}, r"feedback = 2 must lie in \[0, 1\]"),
        ({"seed": -1}, "seed = -1 must not be negative"),
        ({"cost": {"height": -1.0}}, "costs must not be negative"),
    ],
)
def test_settings_that_make_no_sense_are_refused(changed, said):
    with pytest.raises(ValueError, match=said):
        if "cost" in changed:
            changed = {"cost": FlightCost(**changed["cost"])}
        replace(SETTINGS, **changed)


def test_noise_has_one_number_for_each_command():
    with pytest.raises(ValueError, match="'noise' needs 5 numbers: elevator, aileron, rudder, throttle_left"):
        FlightMppi(ROBOT, TASK, replace(SETTINGS, noise=(0.1, 0.1)))


def test_it_is_for_aircraft():
    boat = load_robot("kingfisher")
    with pytest.raises(ConfigError, match=r"'mppi' is for aircraft with control_surfaces"):
        load_classical(boat, load_task("go_to_position"), law="mppi")


@pytest.mark.slow
@pytest.mark.timeout(600)  # five flights of a minute, of 25 plans a second
@pytest.mark.parametrize("task", ["a", "d", "e"])
def test_five_seeds_stay_within_three_centimetres_rms_for_a_minute(task):
    found = fly(falcon_cell("airship_v7", task, "mppi", "exact", 5, 3))[0]
    assert found["survival"] == 1.0
    assert found["rmse_per_axis_worst_m"] <= 0.03


class Cheap:
    """Flights that cost what one command of the first knot says, and nothing else."""

    def __init__(self, weight: float) -> None:
        self._weight = weight

    def fly(self, state, servos, aims, corrections):
        return self._weight * corrections[0, :, :, 0]


@pytest.mark.parametrize("weight", [-50.0, 50.0])
def test_a_plan_moves_towards_the_noise_that_costs_less(weight):
    law = FlightMppi(ROBOT, TASK, replace(SETTINGS, rollouts=512, temperature=0.5))
    law.reset()
    flown_before = inputs_of_trim(law)
    law.act(flown_before)
    law._rollouts = Cheap(weight)
    plan = law._improved(np.zeros_like(law._plan), flown_before.state, law._law._servos.now, flown_before)
    assert np.sign(plan[0, 0, 0]) == -np.sign(weight)
    others = np.abs(plan[0, 1:, 1:])
    assert others.max() < np.abs(plan[0, 0, 0])


def test_a_plan_stays_where_all_flights_cost_the_same():
    """Noise comes in pairs of opposite sign; a single flight without its partner would move the plan."""
    law = FlightMppi(ROBOT, TASK, FEW)
    inputs = inputs_of_trim(law)
    law.act(inputs)
    law._rollouts = Cheap(0.0)
    plan = law._improved(np.zeros_like(law._plan), inputs.state, law._law._servos.now, inputs)
    assert np.abs(plan).max() < 1e-12


def test_noise_that_leads_away_from_the_law_costs_what_it_takes():
    """Of flights that cost the same, those against the plan so far count more (Williams et al., eq. 38)."""
    law = FlightMppi(ROBOT, TASK, replace(SETTINGS, rollouts=2048))
    law.reset()
    inputs = inputs_of_trim(law)
    law.act(inputs)
    law._rollouts = Cheap(0.0)
    plan = np.zeros_like(law._plan)
    plan[0, 0, 0] = law._sigma[0]
    again = law._improved(plan, inputs.state, law._law._servos.now, inputs)
    # The mean of a Gaussian whose density is weighted by exp(-plan noise / sigma^2) lies at -plan.
    assert again[0, 0, 0] == pytest.approx(0.0, abs=0.15 * law._sigma[0])
    assert np.abs(again[0, 1:]).max() < 0.15 * law._sigma.max()
