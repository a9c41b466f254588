"""What was known of a robot in the course of its bag: health on change, goals, and marks of the time line."""

from __future__ import annotations

import heapq
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any

from fulmar_bags.contents import Bag
from fulmar_bags.decode import NS
from fulmar_bags.message_reader import goal_of
from fulmar_bags.statuses import StatusReport, statuses
from fulmar_bags.wire_reader import WireReader
from fulmar_console.bags.goal_errors import GoalSpan
from fulmar_console.bags.recorded_robot import RecordedRobot
from fulmar_console.bags.robot_time import RobotTime
from fulmar_console.live.health import health_of
from fulmar_console.live.places import placed
from fulmar_console.live.robot_state import RobotState
from fulmar_core.robots.topics import DIAGNOSTICS, ENVELOPE_STATE, SIMULATION_EVENT, STATUS, goal_wires
from fulmar_core.safety.watchdog import NO_COMMAND

LEVELS = ("ok", "warn", "error", "error")
SEVERITY = {"ok": 0, "warn": 1, "error": 2}
VOLATILE = ("age_s", "sim_time_s", "latency_ms")  # of health: the tracks have them, or nothing does
UNREPORTED = {"mode": "recorded", "level": "ok", "words": "the bag has no report of the plant"}
PERSON, CONTROLLER = "person", "controller"
MOST_MARKS = 2000
Diagnostics = list[tuple[int, list[StatusReport]]]  # of all robots of a bag
Step = tuple[int, str, Any]  # time of recording [ns], what came, and its content


@dataclass
class History:
    """What was known of one robot.

    Attributes:
        health: Time and health as the live page has it, on change; targets are numbers of `targets`.
        marks: Time, kind and words of what happened.
        goals: Target that counted from each time on.
        targets: Of goals, each once.
        latencies: Time and 99th percentile of the latency as the plant reports it [ms].
    """

    health: list[tuple[float, dict[str, Any]]] = field(default_factory=list)
    marks: list[tuple[float, str, str]] = field(default_factory=list)
    goals: list[GoalSpan] = field(default_factory=list)
    targets: list[list[list[float]]] = field(default_factory=list)
    latencies: list[tuple[float, float]] = field(default_factory=list)

    @property
    def levels(self) -> list[tuple[float, int]]:
        """Time and level, on change: the worse of plant and controller."""
        found: list[tuple[float, int]] = []
        for t_s, health in self.health:
            said = (health.get("level"), (health.get("controller") or {}).get("level"))
            found.append((t_s, max(SEVERITY.get(str(level), 0) for level in said)))
        return found


def diagnostics_of(bag: Bag) -> Diagnostics:
    """Statuses of all robots of a bag, read once."""
    return list(statuses(bag.of(DIAGNOSTICS)))


def history_of(robot: RecordedRobot, time: RobotTime, diagnostics: Diagnostics) -> History:
    """Go through the messages of a robot as the live page does, on the clock of the recording."""
    return _Replay(robot, time).run(diagnostics)


class _Replay:
    """One pass through the messages of a robot."""

    def __init__(self, robot: RecordedRobot, time: RobotTime) -> None:
        self._robot, self._time, self._history = robot, time, History()
        self._now_s = 1.0  # of the recording; 0 stands for never
        self._state = RobotState(0, robot.name, robot.info, clock=lambda: self._now_s)
        self._said = ""
        self._numbers: dict[str, int] = {}  # of targets, by their text
        self._newest: list[list[float]] | None = None
        self._plant: Mapping[str, str] = {}
        self._fell_back = ""
        self._unsaid: list[float] = []  # goals before any controller reported

    def run(self, diagnostics: Diagnostics) -> History:
        reader = self._robot.reader
        for log_ns, kind, content in heapq.merge(*self._streams(reader, diagnostics), key=itemgetter(0)):
            self._now_s = log_ns / NS
            t_s = float(self._time.at_log(log_ns))
            getattr(self, f"_see_{kind}")(content, t_s)
            for event in self._state.take_events():
                self._mark(t_s, event["kind"], event["words"])
            self._note(t_s)
        for fault in self._robot.bag.faults:
            self._mark(float(self._time.at_log(fault.time_ns)), "fault", fault.reason)
        if not any(kind == "goal" for _, kind, _ in self._history.marks):
            for t_s in self._unsaid:
                self._mark(t_s, "goal", "goal")
        self._history.marks.sort(key=itemgetter(0))
        return self._history

    def _streams(self, reader: WireReader, diagnostics: Diagnostics) -> Iterator[Iterable[Step]]:
        name = self._robot.name
        yield (
            (log_ns, "report", report)
            for log_ns, reports in diagnostics
            for report in reports
            if report.name.startswith(f"{name}: ") and report.name != f"{name}: {CONTROLLER}"
        )
        own = statuses(reader.bag.of(STATUS))
        yield ((log_ns, "report", report) for log_ns, reports in own for report in reports[:1])
        guard = statuses(reader.bag.of(ENVELOPE_STATE))
        yield ((log_ns, "envelope", report) for log_ns, reports in guard for report in reports[:1])
        topic = (self._robot.info or {}).get("goal", {}).get("topic")
        wires = goal_wires(topic) if topic else ()
        goals = (
            reader.goals(None)
            if not wires
            else sorted(
                (each for wire in wires for each in reader.received(wire, goal_of)),
                key=lambda each: each.log_ns,
            )
        )
        yield ((each.log_ns, "goal", each) for each in goals)
        yield ((each.log_ns, "obstacles", each.value) for each in reader.obstacles())
        yield ((each.log_ns, "disturbance", each.value) for each in reader.received(SIMULATION_EVENT))

    def _see_report(self, report: StatusReport, t_s: float) -> None:
        node = report.name.rpartition(": ")[2]
        level = LEVELS[min(report.level, len(LEVELS) - 1)]
        if node == "plant":
            self._look_at_interventions(report.values, t_s)
        elif node == CONTROLLER:
            fell_back = report.values.get("fell_back", "")
            if fell_back and fell_back not in ("False", "false", self._fell_back):
                self._mark(t_s, "intervention", f"the fallback took over: {fell_back}")
            self._fell_back = fell_back
        self._state.see_report(node, level, report.message, report.values)

    def _see_envelope(self, report: StatusReport, t_s: float) -> None:
        self._state.see_envelope(report.values)

    def _look_at_interventions(self, values: Mapping[str, str], t_s: float) -> None:
        """Who else than the controller has the actuators, and what the watchdog did."""
        before, self._plant = self._plant, values
        by, was = values.get("commanded_by", CONTROLLER), before.get("commanded_by", CONTROLLER)
        if by != was and by == PERSON:
            self._mark(t_s, "intervention", "a person drives")
        elif by != was and by != CONTROLLER:
            self._mark(t_s, "intervention", f"the {values.get('safe_controller') or by} has the actuators")
        elif by != was and values.get("mode") == "running":
            self._mark(t_s, "intervention", "the controller has the actuators again")
        trips = _whole(values.get("watchdog_trips")) - _whole(before.get("watchdog_trips"))
        if before and trips > 0:
            self._mark(t_s, "intervention", f"the watchdog tripped: {NO_COMMAND} too long")

    def _see_goal(self, goal: Any, t_s: float) -> None:
        self._state.see_goal(goal.value.tolist(), goal.stamp_ns)
        self._newest = [list(placed(self._state.origin, target)) for target in goal.value.tolist()]
        if not self._state.controller.received_s:  # no controller says which goal counts: the newest does
            self._span(t_s, self._newest, 0, None)
            self._unsaid.append(t_s)

    def _see_obstacles(self, discs: Any, t_s: float) -> None:
        self._state.obstacles = discs[:, :3].tolist()

    def _see_disturbance(self, text: str, t_s: float) -> None:
        try:
            event = json.loads(text)
            what = str(event["what"])
        except (ValueError, KeyError, TypeError):
            return
        hidden = ("what", "stamp_ns", "wall_s", "by", "id")
        more = ", ".join(f"{key} {value}" for key, value in event.items() if key not in hidden)
        self._mark(t_s, "disturb", " ".join(part for part in (what.replace("_", " "), more) if part))

    def _note(self, t_s: float) -> None:
        """Keep health where it has changed."""
        said = health_of(self._state)
        if said.get("latency_ms") is not None:
            self._history.latencies.append((t_s, said["latency_ms"]))
        health = {key: value for key, value in said.items() if key not in VOLATILE}
        if not self._state.plant.received_s:
            health |= UNREPORTED
        goal = dict(health.get("goal") or {})
        distance = goal.pop("distance_m", None)
        targets = goal.get("targets") or ([] if self._state.controller.received_s else self._newest)
        if targets:
            self._span(t_s, targets, goal.get("done", 0), distance)
            goal["targets"] = self._number(targets)
            goal.setdefault("done", 0)
        if goal:
            health["goal"] = goal
        if health.get("controller"):
            health["controller"] = {
                key: value for key, value in health["controller"].items() if key not in VOLATILE
            }
        health["nodes"] = {
            name: {key: value for key, value in node.items() if key not in VOLATILE}
            for name, node in health.get("nodes", {}).items()
        }
        text = json.dumps(health, sort_keys=True)
        if text != self._said:
            self._said = text
            self._history.health.append((t_s, health))

    def _span(self, t_s: float, targets: list[list[float]], done: int, distance: float | None) -> None:
        span = GoalSpan(t_s, tuple(targets[done % len(targets)]), distance)
        last = self._history.goals[-1] if self._history.goals else None
        if last is None or (last.target, last.distance_m) != (span.target, span.distance_m):
            self._history.goals.append(span)

    def _number(self, targets: list[list[float]]) -> int:
        text = json.dumps(targets)
        number = self._numbers.setdefault(text, len(self._history.targets))
        if number == len(self._history.targets):
            self._history.targets.append([[round(value, 5) for value in target] for target in targets])
        return number

    def _mark(self, t_s: float, kind: str, words: str) -> None:
        if len(self._history.marks) < MOST_MARKS:
            self._history.marks.append((round(t_s, 3), kind, words))


def _whole(text: str | None) -> int:
    return int(text) if text and text.isdecimal() else 0
