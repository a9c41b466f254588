"""What a person asks of a simulated robot that runs: pause, steps, speed, disturbances."""

from __future__ import annotations

import json
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fulmar_bringup.robot_operator import FIND_S, Operator
from fulmar_core.config.errors import ConfigError, RunFailed
from fulmar_core.robots.topics import (
    SIMULATION_DISTURB,
    SIMULATION_PAUSE,
    SIMULATION_RATE,
    SIMULATION_RESULT,
    SIMULATION_STEP,
    Wire,
)

ANSWER_S = 3.0  # for the plant to answer [s]
PLANT = "simulated plant"


@dataclass(frozen=True)
class SimulationAnswer:
    """Of a simulated plant: whether it was done, or why not."""

    accepted: bool
    reason: str


def ask_to_pause(operator: Operator, robot: str, paused: bool) -> SimulationAnswer:
    """Let simulated time stand still, or go on.

    Raises:
        RunFailed: The robot does not run here, is no simulation, or does not answer.
    """
    return SimulationAnswer(*operator.ask(_service(operator, robot, SIMULATION_PAUSE), on=paused))


def ask_for_steps(operator: Operator, robot: str, steps: int) -> SimulationAnswer:
    """Simulate some control steps of a paused robot, one after the other, until one is refused.

    Raises:
        RunFailed: As in `ask_to_pause`.
    """
    service = _service(operator, robot, SIMULATION_STEP)
    answer = SimulationAnswer(True, "no step")
    for _ in range(steps):
        answer = SimulationAnswer(*operator.ask(service))
        if not answer.accepted:
            break
    return answer


def ask_for_rate(operator: Operator, robot: str, rate: float) -> SimulationAnswer:
    """Change how many simulated seconds pass in one of the wall clock's.

    Raises:
        RunFailed: As in `ask_to_pause`.
    """
    return _ask(operator, robot, SIMULATION_RATE, {"rate": rate})


def ask_to_disturb(operator: Operator, robot: str, what: str, fields: Mapping[str, Any]) -> SimulationAnswer:
    """Disturb it; fields as in `fulmar_core.simulation.disturbances`, which the plant checks.

    Raises:
        RunFailed: As in `ask_to_pause`.
    """
    return _ask(operator, robot, SIMULATION_DISTURB, {"what": what, **fields})


def read_fields(words: list[str]) -> dict[str, Any]:
    """Fields of a disturbance from words such as `force_n=3,0` or `actuator=valve_1`.

    Raises:
        ConfigError: For a word that is no field.
    """
    fields: dict[str, Any] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals or not name or not text:
            raise ConfigError(f"'{word}' must be a field and its value, such as force_n=3,0 or seconds=1.")
        fields[name] = _value(text)
    return fields


def _value(text: str) -> Any:
    """A number, several with commas between them, or a name."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        return text
    return numbers if len(numbers) > 1 else numbers[0]


def _service(operator: Operator, robot: str, name: str) -> str:
    found = operator.robots_with(name, robot, wait_s=FIND_S)
    if not found:
        raise RunFailed(f"no {PLANT} of '{robot}' runs in this ROS domain. {operator.running_robots_text()}")
    return f"{found[0]}/{name}"


def _ask(operator: Operator, robot: str, wire: Wire, content: Mapping[str, Any]) -> SimulationAnswer:
    name = uuid.uuid4().hex

    def read(text: str) -> SimulationAnswer | None:
        found = json.loads(text)
        return SimulationAnswer(found["accepted"], found["reason"]) if found["id"] == name else None

    text = json.dumps({"id": name, **content})
    wires = (wire, SIMULATION_RESULT)
    return operator.ask_on_wire(robot, wires, text, read, PLANT, find_s=FIND_S, answer_s=ANSWER_S)
