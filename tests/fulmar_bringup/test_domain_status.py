"""Which nodes are well."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from fulmar_bringup import domain_status
from fulmar_bringup.domain_status import NODES, NodeStatus, RobotStatus, all_active
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards
from fulmar_bringup.system_rows import system_rows


@pytest.mark.parametrize(
    ("node", "level", "reason", "well", "well_alone"),
    [
        ("plant", "ok", "", True, True),
        ("controller", "warn", "no goal yet", True, True),
        ("plant", "error", "e-stop: pressed. Reset it", True, True),
        ("plant", "error", "no command for 900 ms (limit 200 ms)", False, True),
        ("plant", "error", "the backend hangs", False, False),
        ("controller", "error", "no command for 900 ms", False, False),
        ("controller", "silent", "", False, False),
        ("controller", "absent", "", False, False),
    ],
)
def test_a_node_in_error_silent_or_absent_is_not_well(node, level, reason, well, well_alone):
    status = NodeStatus(node, level, reason=reason)
    assert (status.well(), status.well(alone=True)) == (well, well_alone)


def test_it_knows_the_name_of_every_node_of_a_system():
    guards = Guards(estop=True, estimator="mocap_imu")
    plan = RunPlan(
        "floating_platform",
        "go_to_pose",
        "lqr",
        "mujoco",
        50.0,
        guards=guards,
        extras=("markers", "camera", "actions", "simulation_interfaces", "broadcast"),
    )
    chain = Guards(estimator="attitude", estimators=("event_rate", "inertia"))
    satellite = RunPlan("cubesat_wheels", "point", "lqr", "mujoco", 10.0, guards=chain)
    rows = {**system_rows(plan, record={}), **system_rows(satellite, record={})}
    assert set(rows) == set(NODES) - {"emulator"}


@pytest.mark.parametrize(
    ("node", "mode", "reason", "takes_goals"),
    [
        ("controller", "active", "", True),
        ("controller", "armed", "no goal yet", True),
        ("controller", "armed", "goal is 99.0 m away, beyond the geofence of 8 m", True),
        ("controller", "armed", "no odom yet. Is the plant running?", False),
        ("controller", "armed", "e-stop: pressed. Reset it: fulmar estop --reset", False),
        ("controller", "idle", "not activated", False),
        ("controller", "", "", False),  # no report
        ("plant", "active", "", False),
    ],
)
def test_a_robot_is_active_once_its_controller_takes_goals(node, mode, reason, takes_goals):
    status = NodeStatus(node, "warn", mode, reason)
    assert status.takes_goals == RobotStatus("a", "none", [status]).active == takes_goals


def test_several_robots_are_active_where_each_of_them_is():
    active = RobotStatus("a", "none", [NodeStatus("controller", "ok", "active")])
    waits = RobotStatus("b", "none", [NodeStatus("controller", "warn", "idle")])
    assert all_active([active]) and not all_active([]) and not all_active([active, waits])


def test_nothing_is_said_of_a_controller_that_is_not_discovered_yet_before_the_time_is_over(monkeypatch):
    receive: list[Any] = []
    monkeypatch.setattr(domain_status, "subscribe_every", lambda *given: receive.append(given[-1]))
    graph = [("plant", "/boat")]
    node = SimpleNamespace(
        get_node_names_and_namespaces=lambda: graph, get_service_names_and_types=lambda: []
    )
    look = domain_status._Look(node, None, None)

    def report(name: str) -> None:
        values = [KeyValue(key="mode", value="running")]
        status = DiagnosticStatus(level=DiagnosticStatus.OK, name=f"boat: {name}", values=values)
        receive[0](DiagnosticArray(status=[status]))

    report("plant")
    monkeypatch.setattr(domain_status, "SETTLE_S", -1.0)
    assert not look.complete()
    assert [(one.node, one.level) for one in look.robots()[0].nodes] == [
        ("plant", "ok"),
        ("controller", "absent"),
    ]
    report("controller")
    graph.append(("controller", "/boat"))
    assert look.complete()
