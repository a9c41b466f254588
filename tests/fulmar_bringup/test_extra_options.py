"""`--simulation-interfaces` and `--broadcast`: what they are refused for, and the processes that they start."""

from __future__ import annotations

import importlib.util

import pytest

from fulmar_bringup.extra_checks import NEEDED
from fulmar_bringup.node_row import Launcher
from fulmar_bringup.node_table import row_of
from fulmar_bringup.run_plan import RunPlan

find_spec = importlib.util.find_spec
PLAN = {"robot": "floating_platform", "task": "go_to_pose", "controller": "lqr", "control_hz": 10.0}


def test_a_device_is_no_simulation(fulmar) -> None:
    for more in ((), ("--emulate",)):
        code, _, error = fulmar(
            "run",
            "floating_platform",
            "--goal",
            "1,0,0",
            "--backend",
            "hardware",
            *more,
            "--simulation-interfaces",
        )
        assert code == 2
        assert (
            "--simulation-interfaces resets, steps and moves simulations, and --backend hardware is none"
            in error
        )


@pytest.mark.parametrize("option", ["simulation-interfaces", "broadcast"])
def test_an_environment_without_the_messages_gets_the_command_that_builds_them(
    fulmar, monkeypatch, option: str
) -> None:
    package, _ = NEEDED[option.replace("-", "_")]
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *more: None if name == package else find_spec(name, *more)
    )
    code, _, error = fulmar("run", "floating_platform", "--task", "go_to_pose", f"--{option}")
    assert code == 2
    assert f"--{option} needs the messages of {package}" in error
    assert "Run: fulmar install-interfaces" in error


@pytest.mark.parametrize(
    ("name", "output"), [("simulation_interfaces", "simulation/state"), ("broadcast", "broadcast/values")]
)
def test_a_row_is_there_where_it_is_asked_for(name: str, output: str) -> None:
    row = row_of(name)
    assert row is not None
    (spec,) = row.specs(RunPlan(backend="mock", extras=(name,), **PLAN), Launcher())
    assert spec.module == f"fulmar_ros.{name}_node"
    assert output in spec.outputs
    assert spec.optional and spec.loss == "restarts"
    assert not list(row.specs(RunPlan(backend="mock", **PLAN), Launcher()))


def test_jsbsim_cannot_put_its_aircraft_elsewhere() -> None:
    row = row_of("simulation_interfaces")
    assert row is not None
    for backend, places in (("jsbsim", False), ("mock", True)):
        plan = RunPlan(backend=backend, extras=("simulation_interfaces",), **PLAN)
        (spec,) = row.specs(plan, Launcher())
        assert spec.parameters.get("places", True) is places


def test_an_option_has_a_hyphen_where_its_node_has_an_underscore(fulmar) -> None:
    code, text, _ = fulmar("run", "--help")
    assert code == 0
    assert "--simulation-interfaces" in text and "--simulation_interfaces" not in text
