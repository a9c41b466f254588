"""Figures of aircraft whose controller is killed."""

from __future__ import annotations

import contextlib
import gc
import math
import threading
from dataclasses import replace

import numpy as np
import pytest

from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.catalogue import choice
from fulmar_benchmarks.descent.batch import fly_in_batch
from fulmar_benchmarks.descent.campaign import Descents, requirements, summary
from fulmar_benchmarks.descent.flights import KILLED_S, Descent, DescentLog, Flights
from fulmar_benchmarks.descent.live import fly_in_lockstep
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.robots.actuators.refuge import StopAtOnce
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.states.attitude import from_euler
from fulmar_core.states.spatial import SpatialState
from fulmar_ros.plant_clock import SimulatedTime
from fulmar_ros.plant_loops import UnansweredLoop
from tests.ros.cli import fulmar, json_of

ROBOT = load_robot("airship_v7")
LOWEST = -ROBOT.hull_span[0]
FLIGHTS = Flights("airship_v7", "lqi", 1.0, 64, seed=2026)


def state(height: float, *, bank_deg: float = 0.0, climb: float = -0.3, speed: float = 28.0) -> SpatialState:
    zero = np.asarray(0.0)
    quat = from_euler(np.asarray(math.radians(bank_deg)), zero, zero)
    return SpatialState(
        zero, zero, np.asarray(height), *quat, np.asarray(speed), zero, np.asarray(climb), *(zero,) * 3
    )


def test_the_sink_is_that_of_the_last_tick_in_the_air_and_the_bank_the_largest_before_it():
    log = DescentLog(ROBOT, 7)
    log.add(state(1.0, bank_deg=-4.0), 0.0)
    log.add(state(LOWEST + 0.01, climb=-0.6), 5.0)
    assert not log.down
    log.add(state(LOWEST, bank_deg=60.0, climb=0.0, speed=0.0), 5.01)
    assert log.down
    found = log.descent()
    assert found.bank_deg == pytest.approx(4.0)
    assert (found.number, found.height_m, found.sink_m_s, found.seconds) == (7, 1.0, 0.6, 5.01)
    assert found.good


def test_what_simulators_stop_in_the_air_has_not_touched_down():
    log = DescentLog(ROBOT, 0)
    log.add(state(3.0), 0.0)
    log.add(state(3.0, climb=0.0, speed=0.0), 0.01)
    assert log.down
    assert log.descent().sink_m_s is None
    assert not log.descent().good


GOOD = Descent(0, 1.0, 2.0, 0.4, 8.0)


@pytest.mark.parametrize(
    "bad", [replace(GOOD, bank_deg=10.1), replace(GOOD, sink_m_s=1.01), replace(GOOD, sink_m_s=None)]
)
def test_a_flight_is_good_only_if_it_keeps_bank_and_sink_and_touches_down(bad: Descent):
    assert GOOD.good
    assert not bad.good


def test_of_64_flights_60_must_be_good_and_one_that_could_not_be_flown_is_not():
    rows = [{"height_m": 1.0, "lockstep": summary([GOOD] * 60 + ["flight 60: it broke"] * 4)}]
    assert requirements(rows)[0]["passed"]
    rows = [{"height_m": 1.0, "lockstep": summary([GOOD] * 59 + ["flight 59: it broke"] * 5)}]
    assert not requirements(rows)[0]["passed"]
    assert not requirements([{"height_m": 1.0, "lockstep": summary([])}])[0]["passed"]


def test_each_flight_is_killed_at_a_time_of_its_own_that_its_seed_says():
    times = [FLIGHTS.killed_s(number) for number in range(64)]
    assert len(set(times)) == 64
    assert KILLED_S[0] <= min(times) < max(times) <= KILLED_S[1]
    assert times == [FLIGHTS.killed_s(number) for number in range(64)]
    assert times != [replace(FLIGHTS, seed=1).killed_s(number) for number in range(64)]


def test_flights_begin_at_the_height_that_they_hold():
    heights = replace(FLIGHTS, height=5.0).drawn(np.arange(8)).goal.targets[:, 0, 2]
    np.testing.assert_array_equal(heights, 5.0)


def test_what_cannot_be_flown_is_refused_in_words():
    with pytest.raises(ConfigError, match="'turtlebot2' does not fly"):
        replace(FLIGHTS, robot="turtlebot2").check()
    with pytest.raises(ConfigError, match="touches the ground"):
        replace(FLIGHTS, height=0.3).check()
    with pytest.raises(UnknownNameError, match="Did you mean 'lqr'"):
        replace(FLIGHTS, controller="lqx").check()


class Wires:
    """There is no subscriber."""

    lock = threading.Condition()

    def publish_applied(self, command: np.ndarray, time_ns: int) -> None:
        """Nothing."""


class Counting:
    """A backend that keeps what it is given."""

    def __init__(self) -> None:
        self.robot, self.given = load_robot("floating_platform"), list[np.ndarray]()

    def step(self, command, ticks=1, *, begins=None):
        from fulmar_core.simulation.backend import Sample

        self.given.append(np.array(command))
        return Sample({}, None)


def test_without_a_controller_the_watchdog_acts_at_the_tick_at_which_it_would_by_the_clock():
    backend, clock = Counting(), SimulatedTime()
    actuators, dt = backend.robot.actuators, backend.robot.timing.physics_dt
    guard = ActuatorGuard(
        actuators, Watchdog(200_000_000), refuge=StopAtOnce(actuators.safe_command), lockstep=True
    )
    loop = UnansweredLoop(backend, Wires(), guard, clock)
    import time

    guard.offer(
        actuators.names, [1.0] * len(actuators.names), time.monotonic_ns() - 70_000_000
    )  # SIGKILL takes time
    sample = backend.step(actuators.safe_command)
    backend.given.clear()
    began_ns = clock.now_ns
    loop.run(sample, 20, threading.Event(), lambda _sample, _command: None)
    moving = [bool(command.any()) for command in backend.given]
    assert moving.index(False) == round(0.2 / dt) + 1  # the first tick beyond the limit
    assert not any(moving[moving.index(False) :])
    assert clock.now_ns - began_ns == round(20e9 * dt)


def test_flights_that_were_flown_are_kept_and_a_benchmark_that_was_broken_off_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr("fulmar_benchmarks.pool.POOL", "")  # all in this process
    monkeypatch.setattr(
        "fulmar_benchmarks.descent.live.fly_in_lockstep", lambda _, number: replace(GOOD, number=number)
    )
    monkeypatch.setattr("fulmar_benchmarks.descent.batch.fly_in_batch", lambda _: [GOOD, GOOD])
    given = {"heights": "1", "flights": 2, "through": "batch,lockstep", "jobs": 1}
    documents, kept = [], []
    for folder in ("whole", "broken", "broken"):
        descents = Descents(choice("descent", **given, out=tmp_path / folder))
        result = run(descents, on_done=lambda cell, figures, before: kept.append(before))
        documents.append({key: value for key, value in result.document.items() if key != "wall_s"})
        (tmp_path / folder / "outcomes" / "airship_v7_lqi_1_m_lockstep_1.npz").unlink()
    assert documents[0] == documents[1] == documents[2]
    assert kept[-3:] == [True, True, False]
    assert [check["met"] for check in documents[0]["checks"]] == [True, True]


@pytest.mark.slow
@pytest.mark.parametrize("height", [1.0, 5.0])
def test_killed_aircraft_come_down_level_and_softly_in_the_batch(height: float):
    found = summary(fly_in_batch(replace(FLIGHTS, height=height, count=16)))
    assert found["good"] == 16, found


@pytest.mark.slow
def test_a_flight_takes_no_plant_of_an_earlier_one_in_its_process_for_another_run(ros_domain, monkeypatch):
    """Three in one domain; memory settles as outside of tests."""
    monkeypatch.setattr("fulmar_ros.runtime.gc", gc)
    monkeypatch.setattr("fulmar_benchmarks.descent.live.own_domain", contextlib.nullcontext)
    assert all(fly_in_lockstep(FLIGHTS, number).good for number in range(3))


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.timeout(300)
def test_killed_aircraft_come_down_level_and_softly_through_ros(ros_domain, tmp_path):
    asked = (
        "benchmark",
        "descent",
        "--heights",
        "1",
        "--flights",
        "2",
        "--real-time",
        "1",
        "--jobs",
        "1",
        "--json",
    )
    done = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (row,) = json_of(done.stdout)["heights"]
    assert [row[way]["good"] for way in ("batch", "lockstep", "realtime")] == [2, 2, 1]
    apart = [
        a["sink_m_s"] - b["sink_m_s"]
        for a, b in zip(row["batch"]["each"], row["lockstep"]["each"], strict=True)
    ]
    assert np.abs(apart).max() < 0.3  # another integrator, the same flight
