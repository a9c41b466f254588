"""Which nodes are well."""

from __future__ import annotations

import pytest

from fulmar_bringup.domain_status import NODES, NodeStatus
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
        "floating_platform", "go_to_pose", "lqr", "mujoco", 50.0, guards=guards, extras=("markers",)
    )
    chain = Guards(estimator="attitude", estimators=("event_rate", "inertia"))
    satellite = RunPlan("cubesat_wheels", "point", "lqr", "mujoco", 10.0, guards=chain)
    rows = {**system_rows(plan, record={}), **system_rows(satellite, record={})}
    assert set(rows) == set(NODES) - {"emulator"}
