"""The request of a launcher that another process reads from a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.strict_yaml import load_config
from fulmar_evaluation.faults.fault_environment import FaultEnvironment, plan_of
from fulmar_evaluation.faults.launched import RUN, WrittenPlan, command_of


@pytest.mark.parametrize("robot", ["floating_platform", "spacecraft_16", "cubesat_wheels", "airship_v7"])
def test_a_request_is_the_same_after_it_was_written_and_read(robot: str, tmp_path: Path):
    about = FaultEnvironment(has_area=robot != "cubesat_wheels", fallback=None)
    request = plan_of(robot, tmp_path / "bag", about)
    intercepted = (("plant", "odom", "original/odom"),)
    request = replace(request, intercepted=intercepted, duration_s=12.5)
    file = command_of(RUN, request, tmp_path)[-1]
    read = load_config(WrittenPlan, Path(file)).whole
    assert read == request
    np.testing.assert_array_equal(read.mission.targets, request.mission.targets)
    np.testing.assert_array_equal(read.mission.obstacles, request.mission.obstacles)
