"""Steps a second of systems in lock step, beside bare pairs of nodes; and latency in real time."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_bags.contents import Bag, open_bag
from fulmar_bags.run_record import read_run
from fulmar_benchmarks.shape import ALONE, Benchmark, Cell, Check, Figures, Found, Progress, known
from fulmar_benchmarks.tables import Entry, Row, Shown, Table, number
from fulmar_bringup.completion import completed
from fulmar_bringup.domains import own_domain
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_executor import execute
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ACTION, ACTUATORS_HEALTH, BELIEVED, OBSERVATION, ODOMETRY, command_wire
from fulmar_core.wires.robot_name import namespace_of
from fulmar_evaluation.run_summary import summarise

FLOATING, CHAIN, ATTITUDE = "floating_platform", "mocap_imu_3d", "attitude"
#: Robot, controller and estimator by name.
SYSTEMS = {
    "floating_platform_lqr": (FLOATING, "lqr", None),
    "floating_platform_policy": (FLOATING, "policy", None),
    f"spacecraft_16_lqr_{CHAIN}": ("spacecraft_16", "lqr", CHAIN),
    f"cubesat_wheels_{ATTITUDE}": ("cubesat_wheels", "", ATTITUDE),
    "airship_v7_lqi": ("airship_v7", "lqi", None),
    "airship_v7_policy": ("airship_v7", "policy", None),
}
WAYS = ("messages", "raw")  # how a bare pair converts: by rclpy, or not at all
LAST_WORDS = 6  # commands at the end of a bag that answer nothing
SETTLING = 0.1  # share of the steps that are not counted: first calls, caches
REAL_TIME_HZ = 50.0
SHARE, LATENCY_P99_MS, PERIOD_P99_MS = 0.9, 1.0, 0.05  # aims


@dataclass(frozen=True, kw_only=True)
class PaceCell(Cell):
    """One system in lock step, then its messages between two bare nodes."""

    modules = (f"{__package__}.bare_pair",)
    where: str = ALONE
    way: str = "ros"
    system: str
    steps: int

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Steps a second of the system, with its recorder, and of the bare pairs."""
        robot, controller, estimator = SYSTEMS[self.system]
        with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder:
            guards = Guards(estimator=estimator)
            bag = _recorded(
                RunPlan(robot, "", controller, "mujoco", guards=guards, lockstep=True), folder, self
            )
            messages = Path(folder) / "messages.json"
            sent = messages_of(open_bag(bag), robot)
            messages.write_text(json.dumps(sent))
            bare = {way: _bare(messages, way, self.steps) for way in WAYS}
            pace = steps_per_s(open_bag(bag), robot)
        count = {side: sum(times for *_, times in each) for side, each in sent.items()}
        return {"steps_per_s": pace, "bare_steps_per_s": bare, "messages_a_step": count}


@dataclass(frozen=True, kw_only=True)
class RealTimeCell(Cell):
    """An LQR in real time."""

    where: str = ALONE
    way: str = "ros"
    seconds: float
    steps: int = 0

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Latency from state to command, and errors of the period [ms]."""
        with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder:
            plan = RunPlan(FLOATING, "", "lqr", "mujoco", REAL_TIME_HZ, duration_s=self.seconds)
            said = summarise(read_run(_recorded(plan, folder, self)))
        return {name: said[name] for name in ("latency_ms", "period_error_ms")}


def _recorded(plan: RunPlan, folder: str, cell: PaceCell | RealTimeCell) -> Path:
    """Run a system once; the bag that it left."""
    bag = Path(folder) / "bag"
    with own_domain():
        asked = completed(replace(plan, record=str(bag), command="fulmar benchmark pace"))
        if cell.steps:
            asked = replace(asked, duration_s=cell.steps / asked.control_hz)
        execution = execute(checked(asked))
    if execution.failure:
        raise RunFailed(f"{cell.name}: {execution.failure}")
    return bag


def steps_per_s(bag: Bag, robot: str) -> float:
    """Pace of a run in lock step, by when its commands were recorded."""
    topic = bag.topics[_absolute(robot, command_wire(load_robot(robot)).name)]
    first, last = round(SETTLING * len(topic)), len(topic) - 1 - LAST_WORDS
    if last <= first:
        raise RunFailed(f"{len(topic)} commands are too few to tell a pace.")
    return float(1e9 * (last - first) / (topic.log_ns[last] - topic.log_ns[first]))


def messages_of(bag: Bag, robot: str) -> dict[str, list[tuple[str, str, str, int]]]:
    """What plant (with estimators) and controller publish in a step, what the other waits for first.

    Returns:
        Of `plant` and `controller`: topic, type, bytes of one message in hexadecimal digits, and how many a step.
    """
    command = _absolute(robot, command_wire(load_robot(robot)).name)
    replies = [
        command,
        *(_absolute(robot, w.name) for w in (OBSERVATION, ACTION, ACTUATORS_HEALTH, BELIEVED)),
    ]
    steps = len(bag.topics[command])
    found: dict[str, list[tuple[str, str, str, int]]] = {"plant": [], "controller": []}
    for name, topic in bag.topics.items():
        times = round(len(topic) / steps)
        if times:
            side = "controller" if name in replies else "plant"
            found[side].append((name, topic.type, bytes(topic.data[-1]).hex(), times))
    first = {command, _absolute(robot, ODOMETRY.name)}
    for each in found.values():
        each.sort(key=lambda message: message[0] not in first)
    return found


def _absolute(robot: str, topic: str) -> str:
    return topic if topic.startswith("/") else f"{namespace_of(robot)}/{topic}"


def _bare(messages: Path, way: str, steps: int) -> float:
    """Steps a second of two processes that publish messages and wait for each other."""
    command = [sys.executable, "-m", f"{__package__}.bare_pair", str(messages), way, str(steps)]
    with own_domain():
        controller = subprocess.Popen([*command, "controller"], env=os.environ, stdin=subprocess.DEVNULL)
        try:
            done = subprocess.run(
                [*command, "plant"], env=os.environ, stdout=subprocess.PIPE, text=True, check=False
            )
        finally:
            controller.kill()
            controller.wait()
    if done.returncode:
        raise RunFailed(f"the bare pair ({way}) ended with {done.returncode}: {done.stdout.strip()}")
    return steps / float(done.stdout)


class Pace(Benchmark):
    """Lock step beside bare pairs, and latency in real time."""

    name = "pace"
    title = "Pace of lock step"

    def cells(self) -> list[PaceCell | RealTimeCell]:
        """Each system, then real time."""
        asked = self.choice
        real = [RealTimeCell(name="real_time", seconds=asked.seconds)] if asked.seconds else []
        return [*(PaceCell(name=system, system=system, steps=asked.steps) for system in asked.systems), *real]

    def document(self, found: Found) -> dict[str, Any]:
        """Figures by system."""
        systems = {each: known(found, each) for each in self.choice.systems}
        real = known(found, "real_time") if self.choice.seconds else None
        return {
            "steps": self.choice.steps,
            "seconds": self.choice.seconds,
            "systems": systems,
            "real_time": real,
        }

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """What is aimed at."""
        lines = []
        for name, row in document["systems"].items():
            if name.startswith(FLOATING):
                share = row["steps_per_s"] / row["bare_steps_per_s"]["messages"]
                lines.append(Check.least(f"{name}, share of a bare pair by rclpy", share, SHARE))
        real = document["real_time"]
        if real is not None:
            of = f"LQR at {REAL_TIME_HZ:g} Hz in real time"
            latency, period = real["latency_ms"]["p99"], real["period_error_ms"]["p99"]
            lines.append(Check.most(f"{of}, state to command, p99 [ms]", latency, LATENCY_P99_MS))
            lines.append(Check.most(f"{of}, error of the period, p99 [ms]", period, PERIOD_P99_MS))
        return lines

    def tables(self, document: Mapping[str, Any]) -> list[Shown]:
        """A row for each system."""
        rows = [
            Row(tuple(map(Entry, (
                name,
                number(row["steps_per_s"], 0),
                *(number(row["bare_steps_per_s"][way], 0) for way in WAYS),
                str(sum(row["messages_a_step"].values())),
            ))))
            for name, row in document["systems"].items()
        ]  # fmt: skip
        heads = ("system", "steps/s", "bare pair, rclpy", "bare pair, raw CDR", "messages a step")
        lines: list[Shown] = (
            [Table(f"lock step, {document['steps']} steps each", heads, rows)] if rows else []
        )
        real = document["real_time"]
        if real is not None:
            p50, p99 = (number(real["latency_ms"][key], 2) for key in ("p50", "p99"))
            error = number(real["period_error_ms"]["p99"], 3)
            said = f"state to command p50 {p50} ms, p99 {p99} ms; error of the period p99 {error} ms"
            lines.append(f"LQR at {REAL_TIME_HZ:g} Hz in real time: {said}")
        return [*lines, *self.check_lines(document)]

    def said(self, cell: Cell, figures: Figures) -> str:
        """Its pace."""
        return f"{figures['steps_per_s']:.0f} steps/s" if "steps_per_s" in figures else "measured"
