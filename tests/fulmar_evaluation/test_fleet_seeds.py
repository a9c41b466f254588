"""Seeds of a fleet: each result is a file, interrupted evaluations go on, and nothing that failed is left out."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation import fleet_seeds
from fulmar_evaluation.fleet_outcome import FleetOutcome
from fulmar_evaluation.fleet_seeds import Choice, SeedResult, evaluate_seeds, line_of, summed_up

CHOICE = Choice("swap_places")
NAMES = ("alpha", "beta", "gamma", "delta")


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Seeds that were run; odd ones fail for delta, and hulls touch on seed 3."""
    seeds: list[int] = []

    def outcome(plan: Any) -> FleetOutcome:
        seeds.append(plan.seed)
        Path(plan.record).mkdir(parents=True)
        odd = plan.seed % 2 == 1
        robots = {name: {"success": not (odd and name == "delta"), "failure": None} for name in NAMES}
        near = -0.01 if plan.seed == 3 else 0.2
        failure = "'alpha' and 'beta' came within -0.010 m" if plan.seed == 3 else ""
        return FleetOutcome({"robots": robots, "least_distance_m": near}, failure)

    monkeypatch.setattr(fleet_seeds, "run_fleet_and_evaluate", outcome)
    monkeypatch.setattr(fleet_seeds, "crossed_robots", lambda _records, lockstep: ())
    return seeds


def test_each_seed_is_summed_up_and_bags_of_failures_stay(run: list[int], tmp_path: Path) -> None:
    said: list[str] = []
    found = evaluate_seeds(CHOICE, range(4), tmp_path, lambda each: said.append(line_of(each)))
    sums = summed_up(CHOICE, found)
    assert (sums["count"], sums["all_arrived"], sums["touched"], sums["failed"]) == (4, 2, 1, 1)
    assert sums["least_distance_m"] == -0.01
    assert said[0] == "seed 0: 4 of 4 arrived, least distance 0.200 m"
    assert said[3].startswith("seed 3: 3 of 4 arrived, least distance -0.010 m; hulls touched; 'alpha' and")
    assert sorted(path.name for path in tmp_path.iterdir() if path.is_dir()) == ["seed_001", "seed_003"]


def test_an_evaluation_that_was_interrupted_runs_the_rest_alone(run: list[int], tmp_path: Path) -> None:
    first = evaluate_seeds(CHOICE, range(2), tmp_path, lambda _: None)
    (tmp_path / "seed_002").mkdir()  # a bag of a seed that was cut off
    both = evaluate_seeds(CHOICE, range(3), tmp_path, lambda _: None)
    assert run == [0, 1, 2]
    assert both[:2] == first


def test_a_seed_during_which_a_person_stops_the_evaluation_has_no_result(
    run: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robots = {name: {"success": False, "failure": "stopped"} for name in NAMES}
    stopped = FleetOutcome({"robots": robots, "least_distance_m": 0.2}, "stopped by the user")
    monkeypatch.setattr(fleet_seeds, "run_fleet_and_evaluate", lambda _plan: stopped)
    with pytest.raises(KeyboardInterrupt):
        evaluate_seeds(CHOICE, [0], tmp_path, lambda _: None)
    assert not (tmp_path / "seed_000.json").exists()


def test_results_of_another_fleet_or_way_to_run_do_not_count(run: list[int], tmp_path: Path) -> None:
    evaluate_seeds(CHOICE, [0], tmp_path, lambda _: None)
    for other in (
        replace(CHOICE, lockstep=False),
        replace(CHOICE, keep_apart=False),
        replace(CHOICE, duration_s=9.0),
        Choice("fleet"),
    ):
        with pytest.raises(ConfigError, match="Give another folder: --results DIR"):
            evaluate_seeds(other, [0], tmp_path, lambda _: None)
    (tmp_path / "seed_000.json").write_text(json.dumps({"about": {}}))
    with pytest.raises(ConfigError, match="is no result of a seed"):
        evaluate_seeds(CHOICE, [0], tmp_path, lambda _: None)


def test_commands_that_crossed_and_runs_without_a_bag_are_named() -> None:
    words = line_of(SeedResult(5, 4, 0, None, ("beta",), "the nodes did not get ready"))
    assert words == (
        "seed 5: 0 of 4 arrived, least distance not recorded; commands of another robot reached beta; "
        "the nodes did not get ready"
    )


def record_of(
    applied: list[list[float]],
    commanded: list[list[float]],
    late_s: float = 0.03,
    robot: str = "floating_platform",
) -> Any:
    """A robot's record: commands every 0.1 s, and what its plant applied so much later."""
    count = len(load_robot(robot).actuators.names)
    effort = [np.zeros((len(rows), count)) for rows in (applied, commanded)]
    for table, rows in zip(effort, (applied, commanded), strict=True):
        table[:, : len(rows[0])] = rows
    stamp_s = 0.1 * np.arange(len(applied))
    wires = [
        SimpleNamespace(stamp_s=stamp_s[: len(table)], publish_s=stamp_s[: len(table)] + later, effort=table)
        for table, later in zip(effort, (late_s, 0.0), strict=True)
    ]
    return SimpleNamespace(info={"robot": robot}, applied=wires[0], commanded=wires[1])


@pytest.mark.parametrize("lockstep", [True, False])
def test_a_plant_that_applies_the_command_of_another_controller_is_named(lockstep: bool) -> None:
    own, other = [[1.0], [0.5], [0.0]], [[1.0], [0.4], [0.0]]
    records = {"alpha": record_of(own, own), "beta": record_of(own, other)}
    assert fleet_seeds.crossed_robots(records, lockstep=lockstep) == ("beta",)


def test_by_the_clock_a_plant_may_apply_an_earlier_command_or_rest_and_no_command_to_come() -> None:
    commanded = [[0.2], [0.4], [0.6], [0.8]]
    records = {
        "holds": record_of([[0.2], [0.2], [0.4], [0.8]], commanded),
        "rests": record_of([[0.2], [0.0], [0.0], [0.0]], commanded),
        "foresees": record_of([[0.4], [0.4], [0.6], [0.8]], commanded),
        "of_long_ago": record_of([[0.2]] * 4, commanded, late_s=1.2),
    }
    assert fleet_seeds.crossed_robots(records, lockstep=False) == ("foresees", "of_long_ago")


def test_a_boat_whose_propellers_go_from_rest_to_a_command_step_by_step_is_not_named() -> None:
    commanded = [[-0.4, -0.4]] * 4
    records = {
        "slews": record_of(
            [[-0.1, -0.1], [-0.2, -0.2], [-0.3, -0.3], [-0.4, -0.4]], commanded, robot="kingfisher"
        ),
        "beyond": record_of([[-0.1, -0.1], [-0.5, -0.4]], commanded, robot="kingfisher"),
        "backwards": record_of([[0.1, -0.1]], commanded, robot="kingfisher"),
        "valves": record_of([[0.1], [0.2]], [[0.4], [0.4]]),
    }
    assert fleet_seeds.crossed_robots(records, lockstep=False) == ("beyond", "backwards", "valves")
