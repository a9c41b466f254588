"""A valve that is believed dead is opened again now and then, and is believed again where it works."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.estimators.actuator_health.actuator_estimator import LONGEST_S, OPENINGS_S, ValveTrials
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.parts import Push
from fulmar_core.worlds.scenario import Scenario

ALIVE, DEAD = np.ones(4), np.array([1.0, 0.0, 1.0, 1.0])
DT, RETRY_S = 0.2, 6.0


def trials_of(seconds, alive=DEAD, *, opens=True):
    """When the second valve may be opened, by time."""
    trials, allowed, times = ValveTrials(RETRY_S), np.ones(4), []
    for step in range(round(seconds / DT)):
        allowed = trials.allowed(alive, allowed if opens else np.zeros(4), DT)
        if allowed[1]:
            times.append(step * DT)
    return times


def test_valves_that_live_are_never_held_back():
    assert len(trials_of(20.0, ALIVE)) == 100


def test_a_dead_valve_has_short_trials_further_and_further_apart():
    times = np.array(trials_of(130.0))
    begins = times[np.append(True, np.diff(times) > 1.0)]
    assert abs(begins[0] - RETRY_S) <= 2.0 * DT
    waits = np.diff(begins)
    np.testing.assert_allclose(waits[:4], [12.0, 24.0, 48.0, LONGEST_S][: len(waits[:4])], atol=3.0 * DT)
    assert len(times) <= len(begins) * (round(OPENINGS_S / DT) + 1)


def test_a_trial_lasts_until_the_valve_was_really_opened():
    times = trials_of(20.0, opens=False)
    np.testing.assert_allclose(np.diff(times), DT)
    assert times[-1] > 19.0


def test_a_reset_forgets_trials():
    trials = ValveTrials(RETRY_S)
    for _ in range(29):
        trials.allowed(DEAD, np.zeros(4), DT)
    trials.reset()
    assert not trials.allowed(DEAD, np.zeros(4), DT)[1]


def test_a_valve_that_works_again_is_believed_again_by_the_lqr():
    robot, task = load_robot("floating_platform"), load_task("go_to_pose")
    scenario = Scenario("a slope", sensor_noise=True, body="nominal", push=Push(0.3, 0.2, least=1.0))
    recovered = {}
    for retries in (True, False):
        worlds = 16
        simulation = BatchSimulation(robot, task, scenario, worlds=worlds, seed=5, control_hz=5.0)
        lqr = load_classical(robot, task, control_hz=5.0, law="lqr")
        if not retries:
            lqr.estimator = replace(lqr.estimator, retry_s=0.0)
        loop = ControlLoop(robot, task, lqr, robots=worlds)
        loop.begin(goal_in_float64(simulation.goal))
        loop.reset()
        everywhere = np.arange(worlds)
        sick = everywhere % 8
        lost = np.zeros(worlds, dtype=bool)
        for step in range(300):
            simulation.world.alive[sick, everywhere] = float(step >= 75)
            simulation.move(loop.step(simulation.measured, {}, round(1e9 * step * loop.dt)).command)
            if step == 75:
                lost = loop.estimate.health.effectiveness[everywhere, sick] < 0.1
        assert lost.sum() >= 8
        recovered[retries] = np.mean(loop.estimate.health.effectiveness[everywhere, sick][lost] > 0.9)
    assert recovered[True] > 0.8 > 0.5 > recovered[False]
