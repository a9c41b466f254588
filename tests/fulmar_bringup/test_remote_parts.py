"""A part of a system that runs in another place: its setup, its silence and its restart."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

from fulmar_bringup.completion import completed
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.remote_parts import RemoteController, mismatch
from fulmar_bringup.supervisor import Report
from fulmar_bringup.system_events import SystemEvents
from fulmar_bringup.system_plan import system_plan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError, UnknownNameError

SETUP = {"robot": "floating_platform", "task": "go_to_pose", "control_hz": "50", "rate": "1"}


@pytest.fixture
def plan(tmp_path):
    """Function that plans one part."""

    def planned(only, **changes):
        asked = system_plan("mock_lqr", **changes)
        asked = replace(asked, record=str(tmp_path / "bag"), only=only, extras=("markers",))
        return checked(completed(asked))

    return planned


def test_both_parts_together_have_the_rows_of_the_whole_system_and_share_none(plan):
    whole = replace(plan("plant"), only="")
    parts = [set(system_rows(plan(only), record={})) for only in ("plant", "controller")]
    assert parts == [{"recorder", "plant", "markers"}, {"controller"}]
    assert set(system_rows(whole, record={})) == parts[0] | parts[1]


def test_a_plant_alone_begins_with_the_subscriber_that_its_controller_is(plan):
    alone = system_rows(plan("plant"), record={})["plant"].parameters["wait_for_subscribers"]
    assert (
        alone
        == system_rows(replace(plan("plant"), only=""), record={})["plant"].parameters["wait_for_subscribers"]
    )


def test_parts_that_cannot_start_alone_are_rejected(plan):
    with pytest.raises(UnknownNameError, match="Did you mean 'plant'"):
        plan("plnt")
    with pytest.raises(ConfigError, match="external, and you start it"):
        plan("controller", controller="external")


@pytest.mark.parametrize(("key", "value"), [("task", "go_to_position"), ("control_hz", "10"), ("rate", "4")])
def test_another_task_or_rate_is_a_mismatch_in_one_line(plan, key, value):
    ours = plan("controller")
    assert mismatch(ours, Report(values=SETUP)) == ""
    text = mismatch(ours, Report(values=SETUP | {key: value, "host": "lab", "pid": "7"}))
    assert f"(process 7 on host lab) belongs to another system: {key} {value}, here {SETUP[key]}." in text
    assert "\n" not in text


def test_a_controller_that_is_silent_restarted_or_foreign_is_reported_and_comes_back(plan):
    events, report = [], Report()
    look = SystemEvents(lambda event, **fields: events.append((event, fields.get("node"))))
    plant, remote = Report(values={"mode": "running"}), RemoteController(plan("plant"), report, silent_s=2.0)

    def after(report_age_s=0.0, **values):
        events.clear()
        report.level, report.message, report.values = "ok", "", SETUP | {"mode": "armed"} | values
        report.received_s = time.monotonic() - report_age_s
        remote.look(look)
        look.look(plant, report, 1.0)
        return list(events)

    assert after(started_ns="1", goals_received="3") == [("goal", None)]
    assert after(report_age_s=3.0) == [("fault", "controller")]
    assert report.values == {}
    assert after(started_ns="2", goals_received="0") == [("recovered", "controller")]  # and no goal
    assert after(started_ns="2", task="go_to_position", goals_received="0") == [("fault", "controller")]
