"""`fulmar faults --json`: its document and its exit code, without a system."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from fulmar_core.config.errors import DONE, FAILED
from fulmar_evaluation.faults import suite
from fulmar_evaluation.faults.fault import FaultResult

KEYS = [
    "name",
    "detected_by",
    "reaction",
    "time_to_safe_s",
    "limit_s",
    "data_lost",
    "bag_intact",
    "passed",
    "launcher",
    "launcher_ended",
]


@pytest.mark.parametrize(("passes", "code"), [(True, DONE), (False, FAILED)])
def test_all_of_a_fault_is_reported_for_each_launcher_and_one_that_is_not_survived_is_exit_code_one(
    passes: bool, code: int, fulmar: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def done(_robot: str, fault: Any, launcher: str) -> FaultResult:
        passed = passes or launcher == "run"
        words = "controller was killed by SIGKILL"
        return FaultResult(fault.name, "plant", "stops", 0.4, 0.42, 0, True, passed, launcher, words)

    monkeypatch.setattr(suite, "_result_of", done)
    ended, out, _ = fulmar("faults", "--robot", "floating_platform", "--only", "controller_killed", "--json")
    report = json.loads(out)
    assert ended == code
    assert list(report) == ["robot", "faults", "skipped"]
    assert report["robot"] == "floating_platform"
    assert [found["launcher"] for found in report["faults"]] == ["run", "up"]
    assert [list(found) for found in report["faults"]] == [KEYS, KEYS]
    assert [found["passed"] for found in report["faults"]] == [True, passes]
