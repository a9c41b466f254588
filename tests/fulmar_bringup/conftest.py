"""Plans of runs, with nothing started."""

from __future__ import annotations

import pytest

from fulmar_bringup.completion import completed
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards


@pytest.fixture
def plan(tmp_path):
    """Function that plans a run, with some of what is asked for changed; guards by their names."""

    def make(*, guards=None, **changes):
        asked = {"robot": "floating_platform", "task": "go_to_pose", "controller": "lqr", "backend": "mujoco"}
        asked |= {"record": str(tmp_path / "bag"), "command": "fulmar run", "guards": Guards(**guards or {})}
        return checked(completed(RunPlan(**asked | changes)))

    return make
