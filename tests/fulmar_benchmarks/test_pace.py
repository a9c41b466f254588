"""Pace of lock step: what a bag says of it, and what is said then; the runs are those of `fulmar benchmark pace`."""

import json
from types import SimpleNamespace

import pytest

from fulmar_bags.gathered import Topic
from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.catalogue import choice
from fulmar_benchmarks.pace import systems
from fulmar_benchmarks.pace.systems import SYSTEMS, Pace, messages_of, steps_per_s
from fulmar_core.config.errors import ConfigError, RunFailed
from tests.fulmar_benchmarks.test_shape import without_moment

SPACE, STEPS, PERIOD_NS = "/floating_platform", 100, 2_000_000


def bag(steps=STEPS):
    """What a run in lock step leaves, of so many steps."""

    def topic(name, kind, each=1.0):
        times = [PERIOD_NS * i for i in range(round(each * steps))]
        return Topic(name, kind, data=[b"\0\1\0\0"] * len(times), log_ns=times)

    made = [
        topic(f"{SPACE}/actuators/command", "sensor_msgs/msg/JointState"),
        topic(f"{SPACE}/controller/observation", "sensor_msgs/msg/JointState"),
        topic(f"{SPACE}/imu", "sensor_msgs/msg/Imu", 2.0),
        topic(f"{SPACE}/odom", "nav_msgs/msg/Odometry"),
        topic(f"{SPACE}/plant/status", "diagnostic_msgs/msg/DiagnosticArray", 0.02),
    ]
    return SimpleNamespace(topics={each.name: each for each in made})


def test_the_pace_is_that_of_the_commands_without_the_first_and_the_last_ones():
    assert steps_per_s(bag(), "floating_platform") == pytest.approx(1e9 / PERIOD_NS)


def test_a_run_with_too_few_commands_has_no_pace():
    with pytest.raises(RunFailed, match="5 commands are too few"):
        steps_per_s(bag(5), "floating_platform")


def test_each_side_sends_what_comes_with_a_step_first_what_the_other_waits_for():
    found = messages_of(bag(), "floating_platform")
    named = {
        side: [(name.removeprefix(SPACE), times) for name, *_, times in sent] for side, sent in found.items()
    }
    assert named == {
        "plant": [("/odom", 1), ("/imu", 2)],
        "controller": [("/actuators/command", 1), ("/controller/observation", 1)],
    }
    assert json.loads(json.dumps(found))["plant"][0][2] == "00010000"


@pytest.fixture
def measured(monkeypatch):
    """Figures without any run: names of the cells that were measured."""
    names = []

    def pace(cell, progress, pool=None):
        names.append(cell.name)
        bare = {"messages": 1000.0, "raw": 3000.0}
        return {
            "steps_per_s": 950.0,
            "bare_steps_per_s": bare,
            "messages_a_step": {"plant": 5, "controller": 4},
        }

    def real(cell, progress, pool=None):
        names.append(cell.name)
        return {"latency_ms": {"p50": 0.7, "p99": 1.5}, "period_error_ms": {"p99": 0.03}}

    monkeypatch.setattr(systems.PaceCell, "measure", pace)
    monkeypatch.setattr(systems.RealTimeCell, "measure", real)
    return names


def test_systems_stand_beside_bare_pairs_and_aims(tmp_path, measured):
    asked = choice("pace", systems="floating_platform_lqr,airship_v7_lqi", out=tmp_path, resume=False)
    document = run(Pace(asked)).document
    assert measured == ["floating_platform_lqr", "airship_v7_lqi", "real_time"]
    assert document["systems"]["airship_v7_lqi"]["bare_steps_per_s"]["raw"] == 3000.0
    assert [(check["measured"], check["met"]) for check in document["checks"]] == [
        (0.95, True),
        (1.5, False),
        (0.03, True),
    ]
    assert "p99 1.50 ms" in Pace(asked).tables(document)[1]


def test_without_real_time_there_is_none(tmp_path, measured):
    asked = choice("pace", systems="floating_platform_policy", seconds=0.0, out=tmp_path, resume=False)
    assert run(Pace(asked)).document["real_time"] is None
    assert measured == ["floating_platform_policy"]


def test_a_system_that_is_not_there_is_refused():
    assert len(SYSTEMS) == 6
    with pytest.raises(ConfigError, match="floating_platform_lqr"):
        choice("pace", systems="floating_platform_lqi")


def test_one_that_is_interrupted_goes_on_and_gives_an_equal_document(tmp_path, measured):
    def asked(folder):
        return Pace(choice("pace", systems="floating_platform_lqr", out=tmp_path / folder, resume=True))

    def breaks_off(cells, *, on_done, **_others):
        on_done(cells[0], cells[0].measure(lambda done: None))
        raise KeyboardInterrupt

    whole = without_moment(run(asked("whole")).document)
    with pytest.raises(KeyboardInterrupt):
        run(asked("broken"), using=breaks_off)
    measured.clear()
    assert without_moment(run(asked("broken")).document) == whole
    assert measured == ["real_time"]
