"""What a request may ask for, and what is loaded in the place of the controller that runs: without nodes."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError, FulmarError, UnknownNameError
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.fallback import ControllerSwitch, Standby, warm_up
from fulmar_core.loop.swap_request import SwapRequest
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_ros.controller_loading import ControllerLoader
from policy_server.controller_node import make_controller
from policy_server.controllers import shipped_policy

SETTINGS = ControllerSettings(controller="lqr", control_hz=0.0)


def loader(robot: str = "floating_platform", task: str = "go_to_pose", **changes: object) -> ControllerLoader:
    settings = replace(SETTINGS, robot=robot, task=task, **changes)
    return ControllerLoader(make_controller, load_robot(robot), load_task(task), settings)


def load(name: str, made: ControllerLoader | None = None, fallback: Standby | None = None) -> Standby:
    switch = ControllerSwitch(Standby(None, "", ""), fallback)  # type: ignore[arg-type]
    request = (
        SwapRequest("", 1, bundle=name)
        if "/" in name and ":" not in name
        else SwapRequest("", 1, controller=name)
    )
    return (made or loader()).load(request, switch, ())


@pytest.mark.parametrize("name", ["lqr", "mpc", "classical", "policy"])
def test_laws_and_the_shipped_policy_are_loaded_by_their_names(name):
    assert load(name).controller.name == name


def test_a_law_runs_on_in_the_place_of_a_policy_and_a_policy_in_the_place_of_a_law():
    folder = str(shipped_policy("floating_platform", "go_to_pose"))
    assert load(folder).controller.name == "policy"
    assert load("lqr", loader(controller="policy")).controller.name == "lqr"


def test_a_misspelt_name_is_refused_with_the_nearest_one():
    with pytest.raises(UnknownNameError, match="Did you mean 'teleoperation'"):
        load("teleoperatoin")


def test_a_law_for_other_robots_is_refused_with_what_there_is():
    with pytest.raises(UnknownNameError, match="unknown controller 'mppi'"):
        load("mppi")


def test_no_class_is_imported_that_only_a_request_names(tmp_path, monkeypatch):
    (tmp_path / "evil_module.py").write_text("class Evil: ...\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(FulmarError):
        load("evil_module:Evil")
    assert "evil_module" not in sys.modules


def test_the_fallback_is_the_one_that_stands_by_and_without_one_there_is_none_to_ask_for():
    robot, task = load_robot("floating_platform"), load_task("go_to_pose")
    made = loader(controller="policy", fallback="lqr")
    standby = warm_up(make_controller(robot, task, SETTINGS), robot, task, said={"fallback": True})
    assert load("fallback", made, standby) is standby
    with pytest.raises(UnknownNameError, match="unknown controller 'fallback'"):
        load("fallback")
    with pytest.raises(ConfigError, match="no fallback is set"):
        load("fallback", made)


def test_teleoperation_commands_what_moves_nothing():
    controller = load("teleoperation").controller
    inputs = type("Inputs", (), {"previous": np.ones((2, 8))})()
    assert not controller.act(inputs).any()
    assert controller.metadata()["sha256"]


def test_in_lock_step_no_person_takes_over():
    with pytest.raises(UnknownNameError, match="unknown controller 'teleoperation'"):
        load("teleoperation", loader(lockstep=True))


def test_a_robot_that_no_person_can_drive_is_not_left_to_one():
    with pytest.raises(UnknownNameError, match="unknown controller 'teleoperation'"):
        load("teleoperation", loader("microsat", "point"))


def test_a_law_that_takes_readings_which_the_node_does_not_receive_is_refused():
    with pytest.raises(FulmarError, match="'adaptive' takes inertia, which this node does not receive"):
        load("adaptive", loader("microsat", "point"))


def test_a_policy_at_another_rate_is_refused():
    with pytest.raises(FulmarError, match="Hz"):
        load("policy", loader(control_hz=50.0))
