"""Services and requests of a simulated plant: pause, single steps, rate, disturbances, another state."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rclpy.lifecycle import LifecycleNode
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from fulmar_core.config.errors import ConfigError, FulmarError, UnknownNameError
from fulmar_core.robots.topics import (
    SIMULATION_DISTURB,
    SIMULATION_EVENT,
    SIMULATION_PAUSE,
    SIMULATION_RATE,
    SIMULATION_RESULT,
    SIMULATION_STATE,
    SIMULATION_STEP,
)
from fulmar_core.simulation.disturbances import CUT_LINK, fields_of, read_disturbance
from fulmar_core.simulation.disturbed import Disturbed
from fulmar_core.simulation.episode import Episode
from fulmar_core.simulation.state_requests import (
    PAUSE,
    PLACE,
    REQUESTS,
    RESET,
    RESUME,
    STEP,
    read_state,
    read_steps,
    state_fields,
)
from fulmar_ros.operator_subscription import destroy_all, subscribe_every
from fulmar_ros.pace import Pace
from fulmar_ros.plant_clock import SimulatedTime, WallTime
from fulmar_ros.qos import publisher_qos

SLOWEST, FASTEST = 0.05, 10.0  # simulated seconds a wall-clock second
LONGEST = 10_000  # characters of a request
WORDS = 400  # characters of an answer
REMEMBERED = 100  # answers, for requests that are repeated until they are answered
Answer = dict[str, Any]  # what a request is answered beside whether it was done


class SimulationWires:
    """Takes requests while the plant runs, and says in bags what was done."""

    def __init__(
        self,
        node: LifecycleNode,
        backend: Disturbed,
        pace: Pace,
        set_rate: Callable[[float], str],
        clock: SimulatedTime | WallTime,
        *,
        lockstep: bool,
        first: Callable[[], tuple[Episode, int]],
    ) -> None:
        """Take requests.

        Args:
            node: The plant.
            backend: What it simulates with.
            pace: Of its loop.
            set_rate: Changes the rate of the loop; returns why not.
            clock: Of the plant.
            lockstep: Whether the plant waits for each command.
            first: The episode that the plant began with, and its seed.
        """
        self._node, self._backend, self._pace, self._set_rate, self._clock = (
            node,
            backend,
            pace,
            set_rate,
            clock,
        )
        self._lockstep, self._first = lockstep, first
        self._rate = 0.0  # that was asked for while it runs; 0: none
        self._answered: dict[tuple[str, str], tuple[bool, str, Answer]] = {}  # by who asks, and the id
        self._results = node.create_publisher(
            String, SIMULATION_RESULT.name, publisher_qos(SIMULATION_RESULT)
        )
        self._events = node.create_publisher(String, SIMULATION_EVENT.name, publisher_qos(SIMULATION_EVENT))
        self._services = [
            node.create_service(SetBool, SIMULATION_PAUSE, self._on_pause),
            node.create_service(Trigger, SIMULATION_STEP, self._on_step),
        ]
        self._requests = [
            subscribe_every(
                node, String, SIMULATION_RATE, lambda message: self._take(message, self._change_rate)
            ),
            subscribe_every(
                node, String, SIMULATION_DISTURB, lambda message: self._take(message, self._disturb)
            ),
            subscribe_every(
                node, String, SIMULATION_STATE, lambda message: self._take(message, self._change_state)
            ),
        ]

    def begin_anew(self) -> None:
        """The plant starts once more, at the rate of its parameters."""
        self._rate = 0.0

    def values(self) -> dict[str, str]:
        """For the plant's diagnostics."""
        return {
            "paused": str(self._pace.paused).lower(),
            "disturbances": ", ".join(self._backend.names),
            "simulation_rate": f"{self._rate:g}" if self._rate else "",
        }

    def destroy(self) -> None:
        """Take no more."""
        destroy_all(self._node, self._requests)
        for service in self._services:
            self._node.destroy_service(service)
        for publisher in (self._results, self._events):
            self._node.destroy_publisher(publisher)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if request.data != self._pace.paused:
            self._pace.pause(request.data)
            self._say({"what": "pause" if request.data else "resume"})
        response.success, response.message = True, "paused" if request.data else "goes on"
        return response

    def _on_step(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self._pace.step()
        response.message = "one control step" if response.success else "pause it first: simulation/pause"
        if response.success:
            self._say({"what": "step"})
        return response

    def _take(self, message: String, do: Callable[[dict[str, Any]], Answer]) -> None:
        """Carry out a request and answer; one that is repeated is answered again, and not done again."""
        request, problem = _read(message.data)
        name = str(request.get("id", ""))
        key = str(request.get("by", "")), name
        if name and key in self._answered:
            self._answer(name, *self._answered[key])
            return
        answer: Answer = {}
        if not problem:
            try:
                answer = do(request)
            except FulmarError as error:
                problem = plain(str(error))
        if problem:
            self._node.get_logger().warning(f"request refused: {problem}")
        while len(self._answered) >= REMEMBERED:
            del self._answered[next(iter(self._answered))]
        self._answered[key] = not problem, problem, answer
        self._answer(name, not problem, problem, answer)

    def _answer(self, name: str, accepted: bool, reason: str, answer: Answer) -> None:
        text = json.dumps({"id": name, "accepted": accepted, "reason": reason, **answer})
        self._results.publish(String(data=text))

    def _disturb(self, request: dict[str, Any]) -> Answer:
        disturbance = read_disturbance(request, self._backend.robot)
        if disturbance.what == CUT_LINK and self._lockstep:
            raise ConfigError(
                "in lock step nothing is lost: the plant waits for each command. Run in real time."
            )
        self._backend.disturb(disturbance)
        fields = fields_of(request, self._backend.robot)
        self._say({"what": disturbance.what, "by": str(request.get("by", "")), **fields})
        return {}

    def _change_state(self, request: dict[str, Any]) -> Answer:
        """Pause, go on, take steps, put the robot elsewhere, or let its first episode begin anew."""
        what, by = request.get("what"), str(request.get("by", ""))
        if what in (PAUSE, RESUME):
            if (what == PAUSE) != self._pace.paused:
                self._pace.pause(what == PAUSE)
                self._say({"what": what, "by": by})
            return {"stamp_ns": self._clock.now_ns}
        if what == STEP:
            steps, stamp_ns = read_steps(request), self._clock.now_ns
            if not self._pace.step(steps):
                raise ConfigError("pause it first.")
            self._say({"what": STEP, "steps": steps, "by": by})
            return {"stamp_ns": stamp_ns}
        if what not in (RESET, PLACE):
            raise UnknownNameError("request for a state", str(what), REQUESTS)
        if what == RESET:
            episode, seed = self._first()
            state = episode.start.mapped(np.asarray).to_rigid()
            self._backend.begin_anew(episode, seed=seed)
        else:
            state = read_state(request, self._backend.robot)
            self._backend.place(state)
        fields = state_fields(state)
        return {"stamp_ns": self._say({"what": what, "by": by, **fields}), **fields}

    def _change_rate(self, request: dict[str, Any]) -> Answer:
        rate = request.get("rate")
        if not isinstance(rate, int | float) or isinstance(rate, bool) or not SLOWEST <= rate <= FASTEST:
            raise ConfigError(f"'rate' is {rate!r}, must be a number from {SLOWEST:g} to {FASTEST:g}.")
        problem = self._set_rate(float(rate))
        if problem:
            raise ConfigError(problem)
        self._rate = float(rate)
        self._say({"what": "rate", "rate": float(rate), "by": str(request.get("by", ""))})
        return {}

    def _say(self, event: dict[str, Any]) -> int:
        """Tell bags and pages what is done from now on; returns the plant's time [ns]."""
        now_ns = self._clock.now_ns
        stamped = {"stamp_ns": now_ns, "wall_s": round(time.time(), 3), **event}
        self._events.publish(String(data=json.dumps(stamped)))
        return now_ns


def plain(text: str) -> str:
    """A text that logs and messages can carry: printable, on one line, not too long."""
    line = "".join(letter if letter.isprintable() else "?" for letter in text)
    return line if len(line) <= WORDS else f"{line[:WORDS]}..."


def _read(text: str) -> tuple[dict[str, Any], str]:
    """A request, or an empty one and what is wrong with it."""
    try:
        request = json.loads(text) if len(text) <= LONGEST else None
    except (ValueError, RecursionError):
        request = None
    if not isinstance(request, dict):
        return {}, f"a request is a JSON object of at most {LONGEST} characters."
    return request, ""
