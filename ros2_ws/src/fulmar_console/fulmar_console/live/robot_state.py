"""What is known of one robot of the domain, from the messages that came. Knows no ROS."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fulmar_bringup.system_events import SystemEvents
from fulmar_console.colors import color_of
from fulmar_console.live.places import AT_ORIGIN, moved
from fulmar_console.source import RobotSample
from fulmar_core.safety.envelope.event import Event, event_of
from fulmar_core.safety.estop import HOLDS

SILENT_S = 1.0  # after which what actuators do is not known [s]
REPORTS_S = 3.0  # after which a node that reports once a second is silent [s]
GOALS_KEPT = 200  # velocities come up to a hundred ahead of their time
EVENTS_KEPT = 1000  # that no page has asked for
MOVES = 1e-6  # share above which an actuator does something
NOT_BEGUN = ("inactive", "waiting")  # modes of a plant that counts its subscribers
KINDS = {  # of events, as the page calls them
    "goal_refused": "refused",
    "target": "reached",
    "swapped": "swap",
    "swap_refused": "refused",
}
SILENT_KEYS = ("stamp_ns", "wall_s", "what", "by", "id")  # of a simulation's event, that are no field of it


@dataclass
class Report:
    """The newest status of one node."""

    level: str = "ok"
    message: str = ""
    values: dict[str, str] = field(default_factory=dict)
    received_s: float = 0.0  # by `clock`; 0: never [s]
    clock: Callable[[], float] = time.monotonic

    @property
    def age_s(self) -> float:
        """Since it came; infinite if it never did [s]."""
        return self.clock() - self.received_s if self.received_s else math.inf

    @property
    def silent(self) -> bool:
        """Whether the node has said nothing for so long that it may be gone."""
        return self.age_s > REPORTS_S


class RobotState:
    """One robot. Written by the ROS side, read by the server; its owner holds a lock around both.

    Attributes:
        index: Of its record.
        name: What it is called.
        info: Its `robot_info`; None until it is known.
        plant, controller: Their newest status.
        nodes: Status of every other node, by name.
        pose: The newest, in its own `odom`.
        applied_s: When it said last what its actuators do, by its clock [s].
        events: What happened since they were taken last.
        last_command: What a page did to it last, and which page.
        envelope: The newest trip or return of its envelope guard; None before any.
        envelope_trips: How many trips there were since its controller began.
    """

    def __init__(
        self,
        index: int,
        name: str,
        info: dict[str, Any] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Begin with nothing known, or with what its plant will say.

        Args:
            index: Of its record.
            name: What it is called.
            info: Its `robot_info`.
            clock: When something comes: the monotonic clock, or that of a recording; never 0 [s].
        """
        self.index, self.name, self.info, self._clock = index, name, info, clock
        self.plant, self.controller = Report(), Report()
        self.nodes: dict[str, Report] = {}
        self.obstacles: list[list[float]] = []
        self.things: dict[str, list[float]] = {}
        self.events: list[dict[str, Any]] = []
        self.origin = _origin_of(info)
        self.last_command: dict[str, Any] = {}
        self.forget()

    def forget(self) -> None:
        """The plant has begun anew under the same name: what was known of the one before is void."""
        self.pose: tuple[float, ...] = AT_ORIGIN
        self.stamp_ns = 0  # of the newest odometry
        self.posed_s = self.applied_s = 0.0
        self._sum: list[float] = []
        self._count = 0
        self._shares: list[float] = []
        self._order: tuple[tuple[str, ...], list[tuple[int, float]]] = ((), [])
        self.moves = False  # whether an actuator did something in the newest message
        self.goals: dict[int, list[list[float]]] = {}
        self.givers: dict[int, str] = {}  # pages whose goals have these stamps
        self.plant, self.controller = Report(), Report()
        self.nodes.clear()
        self.obstacles, self.things = [], {}
        self.envelope: Event | None = None  # the newest of the envelope guard
        self.envelope_trips = 0
        self._watch = SystemEvents(self._see_event)

    @property
    def record(self) -> dict[str, Any]:
        """As pages get it."""
        return {"index": self.index, "name": self.name, "color": color_of(self.index), "info": self.info}

    @property
    def type(self) -> str:
        """What robot it is; its name, until that is known."""
        return str((self.info or {}).get("type", self.name))

    def see_info(self, info: dict[str, Any]) -> bool:
        """Take a `robot_info`; returns whether what it publishes has to be subscribed anew."""
        before = self.info or {}
        began = before.get("started_ns", 0)
        if began and began != info.get("started_ns"):
            self.forget()
        self.info, self._order = info, ((), [])
        self.origin = _origin_of(info)
        return any(before.get(key) != info.get(key) for key in ("started_ns", "type", "goal", "things"))

    def see_pose(self, pose: Sequence[float], stamp_ns: int) -> None:
        """Take a measured pose, in the robot's own `odom`."""
        if not all(map(math.isfinite, pose)):
            return
        self.pose, self.stamp_ns, self.posed_s = tuple(pose), stamp_ns, self._clock()

    def see_applied(self, names: tuple[str, ...], values: Sequence[float]) -> None:
        """Take what actuators do, to be averaged: a short pulse of a valve shows too."""
        if names != self._order[0]:
            self._order = names, self._picked(names)
            self._sum, self._count = [0.0] * len(self._order[1]), 0
        shares = [values[i] / full if i >= 0 else 0.0 for i, full in self._order[1]]
        if not all(map(math.isfinite, shares)):
            return
        self._sum = [total + share for total, share in zip(self._sum, shares, strict=True)]
        self._count += 1
        self.moves = any(abs(share) > MOVES for share in shares)
        self.applied_s = self._clock()

    def _picked(self, names: tuple[str, ...]) -> list[tuple[int, float]]:
        """Where the value of each actuator is (-1: nowhere), and its full command."""
        places = {name: i for i, name in enumerate(names)}
        actuators = (self.info or {}).get("actuators", ())
        return [(places.get(each["name"], -1), each.get("full") or 1.0) for each in actuators]

    def sample(self) -> RobotSample:
        """Where it is now, and what its actuators did on average since it was asked last."""
        now = self._clock()
        if self._count:
            self._shares = [total / self._count for total in self._sum]
            self._sum, self._count = [0.0] * len(self._sum), 0
        elif now - self.applied_s > SILENT_S and not self.rests:
            self._shares = [0.0] * len(self._shares)
        age_s = now - self.posed_s if self.posed_s else math.inf
        if self.posed_s and self.rests:
            age_s = 0.0  # nothing new is to come
        return RobotSample(self.index, age_s, moved(self.origin, self.pose), self._shares)

    @property
    def rests(self) -> bool:
        """Whether its plant lives and publishes nothing: a simulation that a person has paused."""
        return self.plant.values.get("paused") == "true" and not self.plant.silent

    def see_goal(self, targets: list[list[float]], stamp_ns: int) -> None:
        """Take a goal that was published, by whom ever."""
        self.goals[stamp_ns] = targets
        while len(self.goals) > GOALS_KEPT:
            del self.goals[next(iter(self.goals))]

    def see_giver(self, client: str, stamp_ns: int) -> None:
        """Note which page gives the goal of a stamp."""
        self.givers[stamp_ns] = client
        while len(self.givers) > GOALS_KEPT:
            del self.givers[next(iter(self.givers))]

    def see_report(self, node: str, level: str, message: str, values: Mapping[str, str]) -> None:
        """Take the status of a node."""
        report = Report(level, message, dict(values), self._clock(), self._clock)
        if node not in ("plant", "controller"):
            self.nodes[node] = report
            return
        if node == "plant":
            self.plant = report
        else:
            if values.get("started_ns") != self.controller.values.get("started_ns"):
                self._watch.forget_controller()
                self.envelope, self.envelope_trips = None, 0
            self.controller = report
        if self.plant.received_s:
            self._watch.look(self.plant, self.controller, self.time_s)

    def see_simulation(self, text: str) -> None:
        """Take an event of a simulation; one that is no JSON object is left out."""
        try:
            content = json.loads(text)
            what, stamp_ns = str(content["what"]), int(content.get("stamp_ns", 0))
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return
        if self.stamp_ns and stamp_ns < self.stamp_ns - 10**9 * int(REPORTS_S):
            return  # latched: it was before this console came
        fields = ", ".join(f"{key} {value}" for key, value in content.items() if key not in SILENT_KEYS)
        by = f", by {content['by']}" if content.get("by") else ""
        self.add_event("disturb", f"{what}{': ' if fields else ''}{fields}{by}", stamp_ns / 1e9)

    def see_envelope(self, values: Mapping[str, str]) -> None:
        """Take a trip or a return of the envelope guard; what cannot be read is left out."""
        try:
            event = event_of(values)
        except (KeyError, ValueError, TypeError, RecursionError):
            return
        self.envelope, self.envelope_trips = event, self.envelope_trips + int(event.tripped)
        if not self.stamp_ns or event.stamp_ns >= self.stamp_ns - 10**9 * int(REPORTS_S):  # else latched
            self.add_event("intervention", event.words, event.stamp_ns / 1e9)

    @property
    def estopped(self) -> bool:
        """Whether the plant says that an e-stop holds it."""
        said = self.plant.values.get("estop")
        return said == "true" if said is not None else self.plant.message.startswith(HOLDS)

    @property
    def running(self) -> bool:
        """Whether the plant has begun: until then it counts who subscribes to it."""
        return self.plant.values.get("mode", NOT_BEGUN[0]) not in NOT_BEGUN

    @property
    def time_s(self) -> float:
        """The robot's own time [s]."""
        try:
            said = float(self.plant.values["sim_time_s"])
        except (KeyError, ValueError):
            return self.stamp_ns / 1e9
        return said if math.isfinite(said) else self.stamp_ns / 1e9

    def take_events(self) -> list[dict[str, Any]]:
        """What happened since this was asked last."""
        events, self.events = self.events, []
        return events

    def add_event(self, kind: str, words: str, t_s: float | None = None) -> None:
        """Note what happened, for the pages."""
        if len(self.events) < EVENTS_KEPT:
            t_s = self.time_s if t_s is None else t_s
            self.events.append({"robot": self.name, "t_s": round(t_s, 3), "kind": kind, "words": words})

    def note_command(self, client: str, words: str) -> None:
        """Note what a page has done, so that the others see it."""
        self.last_command = {"by": client, "words": words, "t_s": round(self.time_s, 3)}
        self.add_event("command", f"{client}: {words}")

    def _see_event(self, event: str, **fields: Any) -> None:
        t_s = fields.pop("time_s")
        words = fields.pop("reason", None) or ", ".join(f"{key} {value}" for key, value in fields.items())
        by = ""
        if event == "swapped":
            words = fields["controller"]
        elif event == "reached":
            words = f"goal reached after {fields['after_s']:g} s"
        elif event == "target":
            words = f"target {fields['done']} reached"
        elif event == "reset":
            words = "the e-stop was reset; the controller waits for a new goal"
        elif event == "recovered":
            words = f"the {fields['node']} works again"
        elif event == "goal":
            by = self.givers.get(fields["stamp_ns"]) or self.controller.values.get("goal_by", "")
            words = "a new goal"
        elif event == "estop":
            by = self.plant.values.get("estop_by", "")
        self.add_event(KINDS.get(event, event), f"{words}, by {by}" if by else str(words), t_s)


def _origin_of(info: Mapping[str, Any] | None) -> tuple[float, ...]:
    """Where a robot's `odom` lies in `map`."""
    return tuple(map(float, (info or {}).get("origin") or AT_ORIGIN))
