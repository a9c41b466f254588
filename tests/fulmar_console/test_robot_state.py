"""What a page knows of one robot: pose, what its actuators do, why it stands still, who did what."""

from __future__ import annotations

import json
import math

import pytest

from fulmar_console.live.health import health_of
from fulmar_console.live.robot_state import RobotState
from fulmar_core.safety.envelope.event import Event

POSE = (1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0)
INFO = {
    "name": "alpha", "type": "floating_platform", "started_ns": 5, "things": [],
    "goal": {"topic": "goal_pose", "form": "pose", "faces": True},
    "actuators": [{"name": "one", "full": 1.0}, {"name": "two", "full": 2.0}],
}  # fmt: skip
RUNNING = {"mode": "running", "sim_time_s": "3.5", "estop": "false", "commanded_by": "controller"}
ACTIVE = {"mode": "active", "controller": "lqr", "goals_received": "1", "goal_stamp_ns": "7"}


class Clock:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def robot(clock: Clock) -> RobotState:
    made = RobotState(0, "alpha", clock=clock)
    made.see_info(dict(INFO))
    made.see_report("plant", "ok", "running", RUNNING)
    made.see_report("controller", "ok", "active", ACTIVE)
    return made


def test_a_short_pulse_of_a_valve_shows_as_its_average_between_two_frames(robot: RobotState) -> None:
    for values in ([1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [0.0, 0.0]):
        robot.see_applied(("one", "two"), values)
    assert robot.sample().shares == [0.25, 0.125]  # the second of a full command of 2
    assert robot.sample().shares == [0.25, 0.125]  # nothing came since


def test_actuators_count_as_still_once_their_plant_says_nothing(robot: RobotState, clock: Clock) -> None:
    robot.see_applied(("one", "two"), [1.0, 2.0])
    assert robot.sample().shares == [1.0, 1.0]
    clock.now_s += 1.5
    assert robot.sample().shares == [0.0, 0.0]


def test_values_come_in_the_order_of_the_record_whatever_that_of_the_message(robot: RobotState) -> None:
    robot.see_applied(("two", "more", "one"), [2.0, 9.0, 0.5])
    assert robot.sample().shares == [0.5, 1.0]


def test_a_value_that_is_not_finite_is_left_out(robot: RobotState) -> None:
    robot.see_applied(("one", "two"), [math.nan, 0.0])
    robot.see_pose((math.inf, *POSE[1:]), 3)
    assert robot.sample().shares == []
    assert math.isinf(robot.sample().age_s)


def test_a_pose_ages_except_in_a_simulation_that_a_person_has_paused(robot: RobotState, clock: Clock) -> None:
    robot.see_pose(POSE, 1)
    clock.now_s += 2.0
    assert robot.sample().age_s == pytest.approx(2.0)
    robot.see_report("plant", "ok", "paused", {**RUNNING, "paused": "true"})
    assert robot.sample().age_s == 0.0
    clock.now_s += 4.0  # and the plant itself says nothing any more
    assert robot.sample().age_s == pytest.approx(6.0)


def test_a_plant_that_begins_anew_under_the_same_name_forgets_what_was(robot: RobotState) -> None:
    robot.see_pose(POSE, 1)
    robot.see_goal([list(POSE)], 7)
    assert robot.see_info({**INFO, "started_ns": 6})
    assert math.isinf(robot.sample().age_s)
    assert not robot.goals
    assert "goal" not in health_of(robot)
    assert not robot.see_info({**INFO, "started_ns": 6, "operator": "a person"})


def test_the_reason_of_the_plant_comes_before_that_of_the_controller(robot: RobotState) -> None:
    assert health_of(robot)["words"] == "active"
    robot.see_report("controller", "warn", "no goal yet", {**ACTIVE, "mode": "armed"})
    assert health_of(robot)["words"] == "no goal yet"
    robot.see_report("plant", "error", "no command for 512 ms", RUNNING)
    health = health_of(robot)
    assert (health["words"], health["level"]) == ("no command for 512 ms", "error")


def test_a_plant_that_says_nothing_for_three_seconds_is_silent_and_not_stopped(
    robot: RobotState, clock: Clock
) -> None:
    robot.see_report("plant", "error", "e-stop: pressed", {**RUNNING, "estop": "true", "estop_by": "bob"})
    health = health_of(robot)
    assert (health["estop"], health["stopped"], health["estop_by"]) == (True, True, "bob")
    clock.now_s += 3.5
    health = health_of(robot)
    assert (health["level"], health["estop"], health["stopped"]) == ("silent", True, False)
    assert health["words"] == "nothing has come from its plant for 4 s; it was: e-stop: pressed"


def test_a_controller_that_is_gone_is_said(robot: RobotState, clock: Clock) -> None:
    clock.now_s += 4.0
    robot.see_report("plant", "ok", "running", RUNNING)
    assert health_of(robot)["words"] == "its controller is silent"
    assert health_of(robot)["controller"]["level"] == "silent"


def test_the_goal_that_counts_is_shown_with_who_gave_it_and_how_far_it_is(robot: RobotState) -> None:
    half = math.sqrt(0.5)
    robot.see_pose(POSE, 1)
    robot.see_goal([[3.0, 0.0, 0.0, 0.0, 0.0, half, half]], 7)
    values = {**ACTIVE, "goal_by": "page 1", "goal_distance_m": "2.8284", "at_goal": "false"}
    robot.see_report("controller", "ok", "active", values)
    goal = health_of(robot)["goal"]
    assert goal["targets"] == [[3.0, 0.0, 0.0, 0.0, 0.0, half, half]]
    assert (goal["by"], goal["distance_m"], goal["angle_deg"]) == ("page 1", 2.828, 90.0)
    assert health_of(robot)["plots"] == {"error": 2.828, "unit": "m"}
    robot.see_info({**INFO, "goal": {**INFO["goal"], "form": "attitude"}})
    assert health_of(robot)["plots"] == {"error": 90.0, "unit": "deg"}


def test_a_refused_goal_is_shown_with_its_stamp_and_becomes_an_event(robot: RobotState) -> None:
    robot.take_events()
    values = {**ACTIVE, "goal_refused": "beyond the geofence", "goal_refused_stamp_ns": "9"}
    robot.see_report("controller", "warn", "armed", values)
    goal = health_of(robot)["goal"]
    assert (goal["refused"], goal["refused_stamp_ns"], goal["stamp_ns"]) == ("beyond the geofence", "9", "7")
    (event,) = robot.take_events()
    assert (event["kind"], event["words"]) == ("refused", "beyond the geofence")


def test_events_name_the_page_that_gave_the_goal_and_who_pressed_the_e_stop(robot: RobotState) -> None:
    robot.take_events()
    robot.see_giver("page 2", 8)
    robot.see_report("controller", "ok", "active", {**ACTIVE, "goals_received": "2", "goal_stamp_ns": "8"})
    stopped = {**RUNNING, "estop": "true", "estop_by": "page 1"}
    robot.see_report("plant", "error", "e-stop: pressed", stopped)
    robot.see_report("plant", "ok", "running", RUNNING)
    robot.note_command("page 2", "start: the plant runs")
    events = [(event["kind"], event["words"]) for event in robot.take_events()]
    assert events == [
        ("goal", "a new goal, by page 2"),
        ("estop", "e-stop: pressed, by page 1"),
        ("reset", "the e-stop was reset; the controller waits for a new goal"),
        ("command", "page 2: start: the plant runs"),
    ]
    assert health_of(robot)["last_command"]["by"] == "page 2"


def test_a_disturbance_is_an_event_and_nonsense_on_its_wire_is_none(robot: RobotState) -> None:
    robot.take_events()
    robot.see_simulation(
        json.dumps({"stamp_ns": 4_000_000_000, "what": "push", "force": 2.0, "by": "page 1"})
    )
    for text in ("", "[]", "7", '{"stamp_ns": 3}', "[" * 100_000):
        robot.see_simulation(text)
    (event,) = robot.take_events()
    assert (event["kind"], event["words"], event["t_s"]) == ("disturb", "push: force 2.0, by page 1", 4.0)


def test_a_robot_whose_odom_lies_elsewhere_is_drawn_there_and_so_is_its_goal(robot: RobotState) -> None:
    robot.see_info({**INFO, "origin": [10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]})
    robot.see_pose(POSE, 1)
    robot.see_goal([list(POSE)], 7)
    assert robot.sample().pose[:3] == (11.0, 2.0, 0.0)
    assert health_of(robot)["goal"]["targets"][0][:3] == [11.0, 2.0, 0.0]


def test_health_is_json_without_numbers_that_are_none(robot: RobotState) -> None:
    robot.see_report("plant", "ok", "running", {**RUNNING, "latency_ms_p99": "nan", "sim_time_s": "inf"})
    assert "latency_ms" not in json.loads(json.dumps(health_of(robot), allow_nan=False))


def envelope_texts(*, tripped: bool, trip: int, stamp_ns: int = 4_000_000_000) -> dict[str, str]:
    """What the envelope guard publishes."""
    cause = "it could not stop before x_max any more" if tripped else ""
    return Event(stamp_ns, tripped, cause, -0.25, trip, (1.0,), (0.0,), "x_max").as_texts()


def test_a_page_says_that_the_envelope_guard_drives_why_and_how_often(robot: RobotState) -> None:
    assert "envelope" not in health_of(robot)
    robot.see_envelope(envelope_texts(tripped=True, trip=1))
    health = health_of(robot)
    assert health["envelope"] == {
        "holds": True, "trips": 1, "cause": "it could not stop before x_max any more", "room_m": -0.25, "side": "x_max",
    }  # fmt: skip
    for words in (health["words"], health["controller"]["words"]):
        assert words == "the envelope guard drives: it could not stop before x_max any more"
    (event,) = robot.take_events()[-1:]
    assert (event["kind"], event["t_s"]) == ("intervention", 4.0)
    assert event["words"].startswith("the envelope guard takes over, trip 1: it could not stop")
    robot.see_envelope(envelope_texts(tripped=False, trip=1))
    health = health_of(robot)
    assert health["envelope"]["holds"] is False and health["envelope"]["trips"] == 1
    assert "envelope guard" not in health["words"]
    assert "gives back" in robot.take_events()[-1]["words"]


def test_trips_from_before_a_page_came_are_no_event_and_those_of_a_controller_before_do_not_count(
    robot: RobotState,
) -> None:
    robot.take_events()
    robot.see_pose(POSE, 60_000_000_000)
    robot.see_envelope(envelope_texts(tripped=True, trip=1))
    assert health_of(robot)["envelope"]["trips"] == 1 and not robot.take_events()
    robot.see_envelope({"intervention": "backup"})
    assert health_of(robot)["envelope"]["trips"] == 1, "what cannot be read is left out"
    robot.see_report("controller", "ok", "active", ACTIVE | {"started_ns": "9"})
    assert "envelope" not in health_of(robot)
