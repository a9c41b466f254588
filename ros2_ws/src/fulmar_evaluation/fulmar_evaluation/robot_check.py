"""Check of a robot's file: what its actuators can do to its body, and what looks like a mistake."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import ConfigError, ImplausibleError
from fulmar_core.config.own_class import check_class_path, is_own
from fulmar_core.config.plausibility import logger as plausibility
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot, load_robot_file
from fulmar_evaluation.by_kind import CHECKS, Findings
from policy_server.controllers import controller_entry

UNKNOWN = dict.fromkeys(("actuators", "wrench", "zero_wrench_holdable", "controllable", "least_time"))


@dataclass(frozen=True)
class RobotCheck:
    """Result of one check.

    Attributes:
        name: Of the robot, or of the file that is refused.
        robot: None where the file has values that no robot has.
        findings: What its kind shows; None with the robot.
        problems: One line each; a robot without any has passed.
        warnings: Unusual values, one line each.
    """

    name: str
    robot: Robot | None = None
    findings: Findings | None = None
    problems: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether there is no problem."""
        return not self.problems

    def as_json(self) -> dict[str, Any]:
        """Keys as in `fulmar check robot --json`; what is not known is null."""
        return {
            "robot": self.name,
            **UNKNOWN,
            "trim": [],
            "tried": [],
            **(self.findings.as_json() if self.findings is not None else {}),
            "passed": self.passed,
            "problems": list(self.problems),
            "warnings": list(self.warnings),
        }


def check_robot(
    name: str, *, speed: float | None = None, altitude: float | None = None, height: float | None = None
) -> RobotCheck:
    """Check a robot by its name, or a robot's file.

    Args:
        name: Of a robot, or a path that ends in .yaml or .yml.
        speed: Of an aircraft; as the rest as in `check_aircraft` [m/s].
        altitude: Same; None: 0 [m].
        height: Same [m].

    Raises:
        ConfigError: There is none of that name, or the file cannot be read.
    """
    path = Path(name)
    with _warnings() as warnings:
        try:
            robot = load_robot_file(path) if path.suffix in (".yaml", ".yml") else load_robot(name)
        except ImplausibleError as error:
            return RobotCheck(path.stem, problems=(str(error),), warnings=tuple(warnings))
        if path.suffix and robot.name != path.stem:
            plausibility.warning(
                f"{path}: 'name' is '{robot.name}', the file's own name is '{path.stem}'. Runs refuse it until they "
                "are equal."
            )
        findings = CHECKS[robot.kind.name](robot, speed=speed, altitude=altitude, height=height)
        problems = (*findings.problems(), *_controller_problems(robot))
    return RobotCheck(robot.name, robot, findings, problems, tuple(warnings))


def _controller_problems(robot: Robot) -> list[str]:
    """That there is no controller of the name that the file gives as the usual one."""
    name = robot.usual_controller
    try:
        if is_own(name):
            check_class_path(name)
        elif name:
            controller_entry(name)
    except ConfigError as error:
        return [f"'usual_controller': {error}"]
    return []


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Warnings about unusual values that come up meanwhile."""
    lines: list[str] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            lines.append(record.getMessage())

    handler = Collector(logging.WARNING)
    plausibility.addHandler(handler)
    try:
        yield lines
    finally:
        plausibility.removeHandler(handler)
