"""Flights of aircraft through nodes beside those of the batch."""

from __future__ import annotations

import os

import pytest

from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.catalogue import choice
from fulmar_benchmarks.falcon import live
from fulmar_benchmarks.falcon.live import ALTITUDE, SHOWN, LiveFlights, requirements
from fulmar_core.config.errors import RunFailed
from tests.ros.cli import fulmar, json_of

BATCH = {ALTITUDE: 0.20}


def by_the_clock(altitude: float | None, p99: float | None) -> dict:
    return {"seed": 1, ALTITUDE: altitude, "batch": {ALTITUDE: 0.30}, "period_error_ms": {"p99": p99}}


@pytest.mark.parametrize(
    ("lockstep", "altitude", "p99", "met"),
    [
        (0.21, 0.31, 0.7, [True, True, True]),
        (0.23, 0.31, 0.7, [False, True, True]),
        (0.21, 0.27, 0.7, [True, False, True]),
        (0.21, 0.31, 3.1, [True, True, False]),
        (None, None, None, [False, False, False]),  # every craft is lost, and no period was reported
    ],
)
def test_each_flight_must_be_as_that_of_the_batch_and_keep_its_period(lockstep, altitude, p99, met):
    rows = requirements(BATCH, {ALTITUDE: lockstep}, [by_the_clock(altitude, p99)])
    assert [row["passed"] for row in rows] == met


def test_the_real_time_flight_is_held_against_its_own_twin_not_against_the_other_flights():
    (_, own, _) = requirements(BATCH, {ALTITUDE: 0.2}, [by_the_clock(0.30, 0.1)])
    assert own["value"] == pytest.approx(0.0)


def test_flights_that_were_flown_are_kept_and_one_that_failed_is_flown_again(tmp_path, monkeypatch):
    monkeypatch.setattr("fulmar_benchmarks.pool.POOL", "")
    monkeypatch.setattr(live, "ROS", "alone")
    monkeypatch.setattr(live, "_flown", lambda *_: dict.fromkeys(SHOWN, 1.0))
    failing = [False]

    def by_the_clock(trial):
        if trial.plan.seed == 2027 and failing[0]:
            raise RunFailed("it fell")
        return {**dict.fromkeys(SHOWN, 1.0), "period_error_ms": {"p99": 0.5}}

    monkeypatch.setattr(live, "_by_the_clock", by_the_clock)
    documents, measured = [], []
    for folder, fails in (("whole", False), ("broken", True), ("broken", False)):
        failing[0] = fails
        asked = choice("flights", controller="lqi", episodes=2, real_time=2, out=tmp_path / folder)
        result = run(LiveFlights(asked), on_done=lambda cell, _, before: measured.append((cell.name, before)))
        documents.append({key: value for key, value in result.document.items() if key != "wall_s"})
    whole, broken, again = documents
    assert whole == again
    assert broken["realtime"][1]["error"] == "RunFailed: it fell"
    assert (whole["passed"], broken["passed"]) == (True, False)
    assert [name for name, before in measured[-4:] if not before] == ["airship_v7_fly_hold_lqi_realtime_2027"]


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.timeout(300)
def test_an_aircraft_flies_through_nodes_as_in_the_batch(ros_domain, tmp_path):
    asked = (
        "benchmark",
        "flights",
        "--controller",
        "lqi",
        "--episodes",
        "1",
        "--real-time",
        "1",
        "--episode-s",
        "12",
    )
    done = fulmar(*asked, "--json", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json_of(done.stdout)
    assert found["passed"]
    assert found["realtime"][0]["watchdog_trips"] == 0


def test_without_a_policy_the_command_says_what_else_flies(tmp_path):
    done = fulmar(
        "benchmark", "flights", "--robot", "a0s", "--episodes", "1", env=dict(os.environ), cwd=tmp_path
    )
    assert done.returncode == 2
    assert "no policy is shipped for 'a0s' and 'fly_hold'" in done.stderr
