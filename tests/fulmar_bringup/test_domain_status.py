"""Which nodes are well."""

from __future__ import annotations

import pytest

from fulmar_bringup.domain_status import NodeStatus


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
