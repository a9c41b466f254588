"""Plans of runs, with nothing started."""

from __future__ import annotations

import pytest

from fulmar_bringup.planning import plan_run


@pytest.fixture
def plan(tmp_path):
    """Function that plans a run, with some of its request changed."""

    def make(**changes):
        request = {
            "robot": "floating_platform",
            "task": "go_to_pose",
            "controller": "lqr",
            "backend": "mujoco",
            "policy": None,
            "goal": None,
            "start": None,
            "duration_s": None,
            "lockstep": False,
            "rate": 1.0,
            "control_hz": None,
            "scenario": "nominal",
            "seed": 0,
            "record": tmp_path / "bag",
            "command": "fulmar run",
        }
        return plan_run(**request | changes)

    return make
