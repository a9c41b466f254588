"""A recorded run whose tank ran empty: summary, failure, report and `bag info` name it, and count the fuel."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.figures import describe
from fulmar_bags.run_record import read_run
from fulmar_bringup.run_executor import Execution
from fulmar_core.estimators.actuator_health.supply_check import EMPTY, TANK_EMPTY, SupplyCheck
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.parts import Actuation, Supply
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.report.run_report import write_report
from fulmar_evaluation.run_outcome import evaluate_execution
from fulmar_evaluation.run_summary import summarise, summary_text
from sim_nodes.mock_backend import MockBackend
from tests.synthetic_run import EPOCH_NS, NS, RunMessages

ROBOT, TASK = load_robot("cubesat_8"), load_task("go_to_pose_3d")
SECONDS, OPENING = 25.0, 0.5
INFO = {
    "task": TASK.name, "controller": "pd", "robot": ROBOT.name, "backend": "mock", "seed": 1, "lockstep": True,
    "rate": 1.0, "control_hz": 10.0, "scenario": "tank_empty", "fulmar_version": "0.0.0",
}  # fmt: skip


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Four valves that are half open, with a hundredth of the pressure, until the plant says that nothing is left."""
    folder = tmp_path_factory.mktemp("empty") / "bag"
    scenario = replace(load_scenario("ideal"), actuation=Actuation(supply=Supply(tank=0.01)))
    episode = draw_episode(ROBOT, TASK, scenario, seed=1, number=0)
    backend, check = MockBackend(ROBOT), SupplyCheck(ROBOT)
    sample = backend.reset(episode, seed=1)
    written = RunMessages(folder, ROBOT, INFO)
    written.goal(TASK.goal_topic, episode.goal, EPOCH_NS)
    for step in range(round(SECONDS * ROBOT.timing.control_hz)):
        time_s = step * ROBOT.timing.control_s
        now_ns = EPOCH_NS + round(time_s * NS)
        command = np.zeros(8) if check.empty else OPENING * np.array([1.0, 1.0, 1.0, 1.0, 0, 0, 0, 0])
        written.odometry("ground_truth/odom", sample.truth, time_s, now_ns)
        written.odometry("odom", sample.truth, time_s, now_ns)
        written.joints("actuators/state", command, time_s, now_ns + 4_000_000)
        if "fuel" in sample.readings:
            fuel = sample.readings["fuel"].value
            written.pressure("supply/pressure", sample.readings["supply"].value, time_s, now_ns)
            written.joints("supply/fuel", fuel.values, time_s, now_ns, "position", fuel.names)
        said = {TANK_EMPTY: check.empty.words} if check.empty else {}
        written.health("/diagnostics", "plant", {"mode": "running", **said}, now_ns)
        sample = backend.step(command, ROBOT.timing.substeps(ROBOT.timing.control_hz))
        check.see(ROBOT.timing.control_s, sample.readings, sample.odometry)
    written.writer.close()
    return folder


def test_the_summary_names_the_empty_tank_and_counts_the_fuel(bag):
    record = read_run(bag)
    summary = summarise(record)
    assert summary["tank_empty"].startswith(f"{EMPTY}; it drifts on with ")
    assert summary["warnings"][0] == summary["tank_empty"]
    lasted_s = 0.1 * np.count_nonzero(record.applied.effort[:-1].any(axis=1))
    assert 5.0 < lasted_s < SECONDS - 5.0
    tank = ROBOT.actuators.tank
    assert summary["fuel_used_kg"] == pytest.approx(summary["impulse_N_s"] / tank.exhaust_speed)
    assert 0.0 < summary["fuel_left_share"] < 0.003
    # What is gone from the tank, though thrust has fallen with the pressure.
    gone = (0.01 - summary["fuel_left_share"]) * tank.content
    assert summary["fuel_used_kg"] == pytest.approx(gone, rel=0.03)
    assert "g of fuel used" in summary_text(summary)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_the_run_has_failed_and_says_why(bag):
    plan = SimpleNamespace(record=str(bag), recording=SimpleNamespace(mode="all"), controller="pd")
    outcome = evaluate_execution(plan, Execution("", 0))
    assert outcome.failure.startswith(EMPTY)
    assert outcome.summary["failure"] == outcome.failure
    assert outcome.exit_code == 1
    crashed = evaluate_execution(plan, Execution("the controller died", 0))
    assert crashed.failure == "the controller died"


@pytest.mark.slow
def test_the_report_names_it_and_has_rows_of_fuel(bag, tmp_path):
    page = write_report([read_run(bag)], tmp_path / "report.html").read_text()
    for words in (EMPTY, "Fuel used", "Impulse", "Fuel left"):
        assert words in page


def test_bag_info_counts_impulse_and_fuel(bag, fulmar):
    found, summary = describe(open_bag(bag))["fuel"], summarise(read_run(bag))
    assert found["impulse_N_s"] == pytest.approx(summary["impulse_N_s"], rel=0.02)
    assert found["left_share"] == summary["fuel_left_share"]
    assert found["left_kg"] == pytest.approx(found["left_share"] * ROBOT.actuators.tank.content)
    _, out, _ = fulmar("bag", "info", str(bag))
    used = f"fuel: {1e3 * found['used_kg']:.1f} g used, impulse {found['impulse_N_s']:.1f} N·s, 0 % of the tank left"
    assert used in out
