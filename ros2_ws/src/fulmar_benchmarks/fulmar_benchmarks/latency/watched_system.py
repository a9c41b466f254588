"""A whole system in real time at a given rate, and what its nodes say and use."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import psutil

from fulmar_bringup.bag_origin import run_info
from fulmar_bringup.completion import completed
from fulmar_bringup.domains import own_domain
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.readiness import CONTROLLER_AND_RECORDER, while_starting
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Supervisor, supervisor
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import RunFailed
from fulmar_core.loop.policy_bundle import NETWORK, read_golden, read_passport, write_bundle
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import SIMULATION_START_NS
from policy_server.controllers import policies_directory

ROBOT, TASK = "floating_platform", "go_to_pose"
STEP_HZ = 50.0  # of the robot's own time: the plant's ticks, and a command for each
NODES = ("plant", "controller", "recorder")
REPORT_S = 1.5  # until a plant has reported what just happened


class WatchedSystem:
    """Recorder, plant and controller at work."""

    def __init__(self, group: ProcessGroup, overseer: Supervisor) -> None:
        """Begin to watch."""
        self._group, self._overseer = group, overseer
        self._processes = {name: psutil.Process(group.process(name).pid) for name in NODES}

    def wait(self, seconds: float) -> None:
        """Let it run.

        Raises:
            RunFailed: A node ended.
        """
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            end = self._group.ended()
            if end is not None:
                raise RunFailed(f"{end.text}: {self._group.last_words(end.name)}")
            time.sleep(min(0.1, max(0.0, until - time.monotonic())))

    def end_commands(self) -> None:
        """Stop the controller, and let the plant say what came of its commands."""
        self._group.stop("controller")
        time.sleep(REPORT_S)

    def cpu_s(self) -> dict[str, float]:
        """Processor time that each node has used so far [s]."""
        times = {name: process.cpu_times() for name, process in self._processes.items()}
        return {name: used.user + used.system for name, used in times.items()}

    def memory_bytes(self) -> dict[str, int]:
        """Memory that each node occupies."""
        return {name: process.memory_info().rss for name, process in self._processes.items()}

    def reports(self) -> tuple[Mapping[str, str], Mapping[str, str]]:
        """Last health figures of plant and controller."""
        return dict(self._overseer.plant.values), dict(self._overseer.controller.values)


def plan_at(hz: float, folder: Path) -> RunPlan:
    """A system that steps and commands so often a second of the wall clock.

    The robot's own time goes `hz / 50` times as fast as ours, so that all rates are steps of the same physics. The
    policy is the shipped one with 50 Hz in its passport: only its computing time counts, not its skill.

    Args:
        hz: Steps and commands a second.
        folder: Where policy and bag come.
    """
    shipped = policies_directory() / f"{ROBOT}_{TASK}"
    bundle = folder / "policy"
    bundle.mkdir(parents=True)
    passport = replace(read_passport(shipped), control_hz=STEP_HZ)
    write_bundle(bundle, (shipped / NETWORK).read_bytes(), read_golden(shipped), passport)
    asked = RunPlan(
        ROBOT,
        TASK,
        "policy",
        "mujoco",
        STEP_HZ,
        policy=str(bundle),
        goal=(0.0, 0.0, 0.0),
        start=(1.0, 0.5, 30.0),
        rate=hz / STEP_HZ,
        record=str(folder / "bag"),
        command="fulmar benchmark latency",
    )
    return replace(checked(completed(asked)), duration_s=0.0, supervised=True)


@contextlib.contextmanager
def watched_system(plan: RunPlan, environment: Mapping[str, str]) -> Iterator[WatchedSystem]:
    """A system that has begun to act, in a ROS domain of its own; ended in order at the end.

    Args:
        plan: From `plan_at`.
        environment: Of its nodes, on top of ours.

    Raises:
        RunFailed: It does not come up.
    """
    with own_domain():
        group = ProcessGroup(environment)
        try:
            record = {"directory": plan.record, "info": run_info(plan)}
            for row in system_rows(plan, record=record).values():
                group.start(row)
            with supervisor(plan) as overseer:
                _begin(plan, overseer, group)
                yield WatchedSystem(group, overseer)
                group.stop("controller")
                group.stop("plant")
        finally:
            group.stop_all()


def _begin(plan: RunPlan, overseer: Supervisor, group: ProcessGroup) -> None:
    alive = while_starting(group, overseer)
    assert plan.mission is not None  # as in `completed`
    overseer.give_goal(
        plan.mission, time_ns=SIMULATION_START_NS, alive=alive, listeners=CONTROLLER_AND_RECORDER
    )
    overseer.start_plant(alive, lambda: group.last_words("plant"))
    overseer.wait_until(lambda: overseer.controller.values.get("mode") == "active", alive)
    assert load_robot(plan.robot).timing.physics_dt == 1.0 / STEP_HZ
