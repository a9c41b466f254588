"""Helpers that are lost are started again; where another node is lost, the robot ends."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

from fulmar_bringup import node_keeper
from fulmar_bringup.node_keeper import NodeKeeper, RestartTimes, resumed
from fulmar_bringup.node_spec import ENDS, RESTARTS, NodeSpec
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report
from fulmar_bringup.system import Guards, OwnNode
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import RunFailed

PLAN = RunPlan(
    "floating_platform", "go_to_pose", "lqr", "mujoco", 5.0,
    goals="configs/goals/lab_pose.yaml", guards=Guards(estop=True, estimator="mocap_imu"), extras=("markers",),
)  # fmt: skip


class Process:
    """A process that lives, until it is ended."""

    def __init__(self) -> None:
        self.code: int | None = None

    def poll(self) -> int | None:
        return self.code


class Group:
    """Children of which each start is counted."""

    def __init__(self, *rows: NodeSpec) -> None:
        self.specs = {row.name: row for row in rows}
        self.processes = {row.name: Process() for row in rows}
        self.started: list[NodeSpec] = []
        self.stopped: set[str] = set()

    def process(self, name: str) -> Process:
        return self.processes[name]

    def is_stopped(self, name: str) -> bool:
        return name in self.stopped

    def last_words(self, name: str, *, ended: bool = False) -> str:
        return "its last words"

    def start_again(self, spec: NodeSpec) -> None:
        self.started.append(spec)
        self.processes[spec.name] = Process()
        self.stopped.discard(spec.name)


class Overseer:
    """Has the newest report of each node."""

    def __init__(self) -> None:
        self.reports: dict[str, Report] = {}

    def report_of(self, node: str) -> Report:
        return self.reports.get(node, Report())

    def silent_s(self, report: Report) -> float:
        return time.monotonic() - report.received_s if report.received_s else 0.0


@pytest.fixture
def now(monkeypatch):
    """A clock that a test sets forward: `now[0]` [s]."""
    clock = [1000.0]
    monkeypatch.setattr(node_keeper.time, "monotonic", lambda: clock[0])
    return clock


@pytest.fixture
def system():
    """The rows of a whole system, its keeper, and what that reports."""
    group, overseer, said = Group(*system_rows(PLAN, record={"directory": "bag"}).values()), Overseer(), []
    return group, NodeKeeper(group, overseer, lambda *words: said.append(words)), said, overseer


def test_each_row_says_what_its_loss_means():
    losses = {name: row.loss for name, row in system_rows(PLAN, record={"directory": "bag"}).items()}
    assert {name for name, loss in losses.items() if loss == RESTARTS} == {
        "recorder", "estop", "goals", "markers",
    }  # fmt: skip
    assert {name for name, loss in losses.items() if loss == ENDS} == {"plant", "controller", "estimator"}


def test_lock_step_waits_for_nobody_to_come_back():
    rows = system_rows(replace(PLAN, lockstep=True, extras=()), record={"directory": "bag"})
    assert {row.loss for row in rows.values()} == {ENDS}


def test_a_node_of_a_system_file_ends_the_robot_unless_it_says_otherwise():
    assert OwnNode("camera", "mypackage.camera").loss == ENDS
    assert OwnNode("camera", "mypackage.camera", loss=RESTARTS).loss == RESTARTS
    with pytest.raises(ValueError, match="'loss' = 'maybe' must be one of restarts, ends"):
        OwnNode("camera", "mypackage.camera", loss="maybe")


@pytest.mark.parametrize("code", [-9, 0, 1])
@pytest.mark.parametrize("name", ["recorder", "estop", "goals", "markers"])
def test_a_helper_that_ends_however_is_started_again_and_that_is_said(name, code, system, now, capsys):
    group, keeper, said, _ = system
    group.process(name).code = code
    keeper.look()
    keeper.look()
    assert [row.name for row in group.started] == [name]
    assert said[0][0] == name
    assert keeper.restarts[0].warning.endswith("it was started again, and the robot went on")
    assert "it is started again" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["plant", "controller", "estimator"])
def test_any_other_node_that_ends_or_is_stopped_ends_the_robot(name, system, now):
    group, keeper, _, _ = system
    group.stopped = {name}
    keeper.look()
    now[0] += 2.0
    keeper.look()
    now[0] += 2.0
    with pytest.raises(RunFailed, match=rf"{name} was stopped \(SIGSTOP\) for 3 s before the run was over"):
        keeper.look()
    group.stopped = set()
    group.process(name).code = -9
    with pytest.raises(RunFailed, match=f"{name} was killed by SIGKILL before the run was over"):
        keeper.look()


def test_a_helper_that_is_stopped_in_its_tracks_is_replaced_after_seconds_and_not_after_moments(system, now):
    group, keeper, _, _ = system
    group.stopped = {"recorder"}
    for _ in range(8):  # two seconds, as on a machine that is busy
        keeper.look()
        now[0] += 0.25
    group.stopped = set()
    keeper.look()
    assert not group.started
    group.stopped = {"recorder"}
    for _ in range(20):
        keeper.look()
        now[0] += 0.25
    assert [row.name for row in group.started] == ["recorder"]


def test_a_helper_that_reports_no_more_hangs_and_one_that_never_did_does_not(system, now):
    group, keeper, said, overseer = system
    overseer.reports["estop"] = Report(received_s=now[0])
    for _ in range(9):
        now[0] += 1.0
        keeper.look()
    assert not group.started
    now[0] += 2.0
    keeper.look()
    now[0] += 1.0
    keeper.look()
    assert said == [("estop", "estop has not reported for 10 s and hangs")]
    for _ in range(30):  # it may take its time to report again
        now[0] += 1.0
        keeper.look()
    assert len(said) == 1


def test_a_node_is_started_again_ever_later_and_then_no_more():
    times, now = RestartTimes(waits_s=(0.0, 1.0, 2.0), within_s=60.0), 100.0
    for wait in (0.0, 1.0, 2.0):
        assert times.due(now) == now + wait
        times.note(now + wait)
        now += 5.0
    assert times.due(now) is None
    assert times.due(170.0) is not None


def dies_again_and_again(name, group, keeper, now) -> None:
    for _ in range(300):
        group.process(name).code = -9
        keeper.look()
        now[0] += 0.1


def test_a_recorder_that_does_not_last_is_left_out(system, now):
    group, keeper, said, _ = system
    dies_again_and_again("recorder", group, keeper, now)
    assert [node for node, _ in said] == ["recorder"] * 5
    assert keeper.restarts[5].warning.endswith("it did not last, and the robot goes on without it")


def test_an_e_stop_that_does_not_last_ends_the_robot(system, now):
    group, keeper, said, _ = system
    with pytest.raises(RunFailed, match=r"estop was killed by SIGKILL; it was started 5 times within"):
        dies_again_and_again("estop", group, keeper, now)
    assert [node for node, _ in said] == ["estop"] * 5


def test_a_recorder_goes_on_in_its_bag():
    row = system_rows(PLAN, record={"directory": "bag"})["recorder"]
    assert resumed(row, {}).parameters == {**row.parameters, "resume": True}


def test_goals_go_on_where_the_node_before_was():
    row = system_rows(PLAN, record={"directory": "bag"})["goals"]
    place = '{"reached": 2, "time_ns": 7}'
    assert resumed(row, {"place": place}).parameters == {**row.parameters, "place": place}
    assert resumed(row, {}) == row  # it had not begun
