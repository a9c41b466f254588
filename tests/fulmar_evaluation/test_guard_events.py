"""Trips of the envelope guard in a bag: read exactly, compared to the bit, and summed up for a run's result."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.envelope_events import envelope_events
from fulmar_bags.gathered import Topic
from fulmar_bags.message_types import type_store
from fulmar_bags.run_record import read_run
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ENVELOPE_STATE
from fulmar_core.safety.envelope.event import Event, event_of
from fulmar_evaluation.guard_figures import guard_figures, guard_text
from fulmar_evaluation.report.run_report import write_report
from fulmar_evaluation.rerun.rerun_result import compare_trips

BAG = Path(__file__).resolve().parents[1] / "replay" / "bags" / "floating_platform_go_to_pose_policy"
S = 1_000_000_000
TRIP = Event(3 * S, True, "it could not stop", -0.1 / 3.0, 1, (1.0, 0.0), (0.0, 1.0 / 3.0), "x_max")
RETURN = Event(5 * S, False, "", 0.2, 1, (0.0, 0.0), (0.0, 0.0))


def message_of(texts):
    types = type_store().types
    pairs = [types["diagnostic_msgs/msg/KeyValue"](key=key, value=value) for key, value in texts.items()]
    status = types["diagnostic_msgs/msg/DiagnosticStatus"](
        level=1, name="floating_platform: envelope", message="", hardware_id="", values=pairs
    )
    stamp = types["builtin_interfaces/msg/Time"](sec=3, nanosec=0)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    array = types[ENVELOPE_STATE.type](header=header, status=[status])
    return bytes(type_store().serialize_cdr(array, ENVELOPE_STATE.type))


def bag_with(*texts):
    bag = open_bag(BAG)
    name = f"/{bag.robot}/{ENVELOPE_STATE.name}"
    logs = [S * number for number in range(len(texts))]
    data = [message_of(each) for each in texts]
    return replace(
        bag, topics={**bag.topics, name: Topic(name, ENVELOPE_STATE.type, data, logs, logs, [0] * len(logs))}
    )


def test_events_come_back_from_a_bag_to_the_bit_and_what_is_none_is_left_out():
    assert event_of(TRIP.as_texts()) == TRIP
    bag = bag_with(TRIP.as_texts(), {"intervention": "backup"}, RETURN.as_texts())
    assert envelope_events(bag) == (TRIP, RETURN)
    assert envelope_events(open_bag(BAG)) == ()


def test_trips_are_the_same_only_to_the_bit():
    def answers(*events):
        return SimpleNamespace(trips=events)

    assert compare_trips((TRIP, RETURN), answers(TRIP, RETURN)) == {"recorded": 2, "found": 2, "same": True}
    other = replace(TRIP, room=np.nextafter(TRIP.room, 0.0))
    assert compare_trips((TRIP,), answers(other))["same"] is False
    assert compare_trips((TRIP,), answers())["same"] is False
    assert compare_trips((), answers()) is None
    assert compare_trips((TRIP,), SimpleNamespace(trips=None)) is None, "the node's own re-run does not say"


def record_of(guards, *events):
    return SimpleNamespace(
        info={"guards": guards}, envelope=events, commanded=SimpleNamespace(stamp_s=np.array([1.0, 11.0]))
    )


def test_the_result_of_a_run_has_its_trips_and_the_share_of_time_in_the_backup():
    platform = load_robot("floating_platform")
    found = guard_figures(record_of({"guard": "envelope"}, TRIP, RETURN), platform)
    assert found == {
        "trips": [
            {"t_s": 2.0, "cause": "it could not stop", "room": TRIP.room, "side": "x_max", "held_s": 2.0}
        ],
        "backup_share": pytest.approx(0.2),
    }
    assert "took over 1 time, 20.0% of the time; first after 2.0 s" in guard_text(found)[0]
    latched = guard_figures(record_of({"area": [-1.0, 1.0, -1.0, 1.0]}, TRIP), platform)
    assert latched["backup_share"] == pytest.approx(0.8)
    assert guard_figures(record_of({"guard": "envelope"}), platform) == {"trips": [], "backup_share": 0.0}
    assert guard_figures(record_of({}), platform) is None
    assert guard_figures(record_of({"area": [-1.0, 1.0, -1.0, 1.0]}), load_robot("kingfisher")) is None
    assert guard_text(None) == []


def test_a_report_lists_when_why_and_how_long_the_guard_took_over(tmp_path):
    record = read_run(BAG)
    began_ns = int(1e9 * record.commanded.stamp_s[0])
    trip, back = replace(TRIP, stamp_ns=began_ns + S), replace(RETURN, stamp_ns=began_ns + 3 * S)
    info = record.info | {"guards": {"guard": "envelope"}}
    page = write_report([replace(record, info=info, envelope=(trip, back))], tmp_path / "r.html").read_text()
    assert "the envelope guard took over 1 time" in page
    assert "after 1.0 s, for 2.0 s: it could not stop" in page
    calm = write_report([replace(record, info=info)], tmp_path / "calm.html").read_text()
    assert "the envelope guard left its controller alone" in calm
    assert "envelope guard" not in write_report([record], tmp_path / "none.html").read_text()


def test_an_event_of_an_older_bag_has_no_side():
    texts = TRIP.as_texts()
    del texts["side"]
    assert event_of(texts) == replace(TRIP, side="")
