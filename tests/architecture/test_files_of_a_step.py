"""How many files a reader goes through who follows one control step, from the measurement to the command."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.fallback import ControllerSwitch, Standby
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.estop import EstopMonitor
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from policy_server.controllers import Choice, load_controller

SOURCES = str(Path(__file__).resolve().parents[2])
LIBRARIES = "site-packages"  # whose environment may lie beside the sources
HZ, STEPS, MOST = 50.0, 60, 26
GOAL = np.array([[2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]])


def files_of_steps(robot_name: str, task_name: str, controller_name: str) -> list[set[str]]:
    """Own files that each step enters, after the first ones."""
    robot, task = load_robot(robot_name), load_task(task_name)
    settings = ControllerSettings(robot=robot_name, task=task_name, controller=controller_name, control_hz=HZ)
    settings = replace(settings, lockstep=True)
    controller = load_controller(controller_name, robot, task, Choice(HZ))
    applied = AppliedHistory(settings.hold_ns(robot))
    switch = ControllerSwitch(Standby(controller, "{}", ""))
    guard = GuardedLoop(robot, task, settings, switch, EstopMonitor(required=False), applied=applied)
    guard.activate()
    guard.take_bearing(True)
    guard.take_goal(GOAL, 1, 1)
    state = PlanarState(*(np.asarray(float(i == 5) * 1e-3) for i in range(6)))
    noise = np.random.default_rng(0)
    found: list[set[str]] = []
    for number in range(STEPS):
        now_ns = round(1e9 * (number + 1) / HZ)
        seen = PlanarState(*(column + 1e-4 * noise.normal() for column in state.columns())).to_rigid()
        measurement, entered = Measurement(now_ns, "odom", "base_link", seen), set[str]()

        def note(frame, event, _argument, entered=entered):
            file = frame.f_code.co_filename
            if event == "call" and file.startswith(SOURCES) and LIBRARIES not in file:
                entered.add(file.removeprefix(SOURCES))

        sys.setprofile(note)
        try:
            guard.take(measurement, now_ns)
            decision, inputs = guard.begin_step(measurement, now_ns)
            assert inputs is not None, decision.reason
            step = guard.act(inputs)
        finally:
            sys.setprofile(None)
        applied.add(now_ns, step.command[0])
        found.append(entered - {__file__.removeprefix(SOURCES)})
    return found[STEPS // 2 :]


def test_a_planar_step_enters_few_files():
    steps = files_of_steps("floating_platform", "go_to_pose", "lqr")
    median = sorted(steps, key=len)[len(steps) // 2]
    assert len(median) <= MOST, "\n".join(sorted(median))
