"""An external controller in plans, rows and results, with nothing started."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.control_steps import control_steps_of
from fulmar_bags.run_record import read_run
from fulmar_bringup import readiness
from fulmar_bringup.bag_origin import attachments
from fulmar_bringup.completion import completed
from fulmar_bringup.launched_system import list_nodes
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.readiness import command_input, wait_for_publisher, wait_for_reader
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report
from fulmar_bringup.system import Guards
from fulmar_core.config.errors import ConfigError, RunFailed
from fulmar_core.robots.wire_check import Offer
from fulmar_evaluation.run_summary import summarise, summary_text
from fulmar_ros.recorder_health import COMMANDERS
from tests.fulmar_cli.command_line import complaint
from tests.synthetic_run import Plan, write_run

PLAN = RunPlan("turtlebot2", "go_to_position", "external", "mujoco", 10.0)
OWN = {"robot": "turtlebot2", "task": "go_to_position", "controller": "external"}
KOBUKI = "turtlebot2_kobuki_node"  # a hardware file whose driver publishes Twist
STAMPED = Offer("/steer", "geometry_msgs/msg/TwistStamped", reliable=True, latched=False)


def rows(**choice):
    return {node.name: node for node in list_nodes(**OWN | choice)}


def test_an_external_controller_has_no_row_and_an_adapter_has_one():
    assert set(rows()) == {"recorder", "plant", "markers"}
    assert set(rows(task="track_velocities", goals="circle")) == {"recorder", "plant", "goals", "markers"}
    adapted = rows(adapter=KOBUKI, topic="/raw")
    assert set(adapted) == {"recorder", "plant", "adapter", "markers"}
    assert adapted["adapter"].module == "hardware_drivers.adapter_node"
    assert adapted["adapter"].parameters["hardware"].endswith("configs/hardware/turtlebot2_kobuki_node.yaml")
    assert adapted["adapter"].parameters["topic"] == "/raw"
    assert "topic" not in rows(adapter=KOBUKI)["adapter"].parameters


def test_the_bag_of_an_external_controller_carries_neither_gains_nor_a_passport():
    assert not {"controller.yaml", "passport.json"} & set(json.loads(attachments(PLAN)))


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"adapter": "turtlebot2"}, "driver 'kobuki' takes no topic. Files of 'turtlebot2' whose driver does: "),
        ({"adapter": "kingfisher_action"}, "is the hardware of 'kingfisher', and the robot is 'turtlebot2'"),
        ({"adapter": "turtlebot2_kobuki_nod"}, "Did you mean 'turtlebot2_kobuki_node'"),
        ({"topic": "/raw"}, "--topic is the topic that --adapter takes"),
        ({"adapter": KOBUKI, "topic": "a b"}, "--topic = 'a b' is no name of a topic"),
        ({"controller": "classical", "adapter": KOBUKI}, "Add --controller external"),
        ({"system": "mujoco_lab", "robot": "floating_platform"}, "fallback, max_run_time_s, area: Fulmar's own"),
    ],
)  # fmt: skip
def test_what_has_no_effect_beside_an_external_controller_is_refused(choice, words):
    with pytest.raises(ConfigError) as caught:
        list_nodes(**OWN | choice)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"adapter": KOBUKI, "lockstep": True}, "--adapter carry none. Leave --lockstep out"),
        ({"guards": Guards(max_run_time_s=5.0)}, "max_run_time_s: Fulmar's own controller node"),
        ({"copies": 2}, "--copies is for a controller that Fulmar starts"),
        ({"controller_network": "other"}, "--controller-in is for a controller that Fulmar starts"),
        ({"policy": "bundle"}, "runs no policy bundle"),
    ],
)  # fmt: skip
def test_a_run_refuses_options_of_the_controller_node(choice, words, tmp_path):
    usual = RunPlan(**OWN, backend="mujoco", record=str(tmp_path / "bag"))
    assert checked(completed(usual)).controller == "external"
    with pytest.raises(ConfigError) as caught:
        checked(completed(replace(usual, **choice)))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "topic", "kind", "reliable"),
    [
        ({}, "/turtlebot2/cmd_vel", "geometry_msgs/msg/TwistStamped", False),
        ({"lockstep": True}, "/turtlebot2/cmd_vel", "geometry_msgs/msg/TwistStamped", True),
        ({"remappings": (("cmd_vel", "/raw"),)}, "/raw", "geometry_msgs/msg/TwistStamped", False),
        ({"adapter": KOBUKI}, "/commands/velocity", "geometry_msgs/msg/Twist", False),
        ({"adapter": KOBUKI, "adapter_topic": "raw"}, "/turtlebot2/raw", "geometry_msgs/msg/Twist", False),
        ({"robot": "kingfisher"}, "/kingfisher/actuators/command", "sensor_msgs/msg/JointState", False),
        ({"robot": "kingfisher", "adapter": "kingfisher_action"}, "/action", "std_msgs/msg/Float32MultiArray", False),
    ],
)  # fmt: skip
def test_commands_are_waited_for_where_the_plant_or_its_adapter_takes_them(changes, topic, kind, reliable):
    found = command_input(replace(PLAN, **changes))
    assert (found.topic, found.wire.type, found.reliable) == (topic, kind, reliable)


class Overseer:
    """Shows the publishers of a topic, one look after another; the last stay."""

    def __init__(self, *looks: list[Offer], recorded: str = "1") -> None:
        self._looks = list(looks)
        self.recorder = Report(values={COMMANDERS: recorded})

    def offers(self, topic: str) -> list[Offer]:
        assert topic == "/turtlebot2/cmd_vel"
        return self._looks.pop(0) if len(self._looks) > 1 else self._looks[0]

    def wait_until(self, condition, alive) -> None:
        while not condition():
            alive()


def wait(monkeypatch, *looks: list[Offer], recorded: str = "1", plan: RunPlan = PLAN) -> None:
    times = iter(range(1000))
    monkeypatch.setattr(readiness, "time", SimpleNamespace(monotonic=lambda: float(next(times))))
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    wait_for_publisher(plan, Overseer(*looks, recorded=recorded), lambda: None)


def test_a_run_is_ready_once_a_fitting_publisher_is_there(monkeypatch, capsys):
    wait(monkeypatch, [STAMPED])
    assert not capsys.readouterr().err
    wait(monkeypatch, [], [], [STAMPED])
    assert (
        "a publisher of geometry_msgs/msg/TwistStamped on /turtlebot2/cmd_vel, in ROS domain 7"
        in " ".join(capsys.readouterr().err.split())
    )


@pytest.mark.parametrize(
    ("offer", "recorded", "why"),
    [
        (None, "0", ""),
        (STAMPED, "0", ""),
        (replace(STAMPED, type="geometry_msgs/msg/Twist"), "1", " /steer publishes geometry_msgs/msg/Twist"),
        (replace(STAMPED, reliable=False), "1", " /steer publishes best effort"),
    ],
)  # fmt: skip
def test_without_a_fitting_publisher_a_run_fails_with_one_line(offer, recorded, why, monkeypatch):
    with pytest.raises(RunFailed) as caught:
        wait(monkeypatch, [offer] if offer else [], recorded=recorded, plan=replace(PLAN, lockstep=True))
    text = str(caught.value)
    assert text.startswith(f"no publisher on /turtlebot2/cmd_vel within 20 s.{why}")
    assert "Start your controller, in ROS domain 7" in text


@pytest.mark.parametrize(("mode", "message"), [("inactive", ""), ("waiting", "waiting: 1 of 2 listen")])
def test_a_plant_in_lock_step_that_nothing_answers_fails_its_run_in_one_line(mode, message, monkeypatch):
    times = iter(range(1000))
    monkeypatch.setattr(readiness, "time", SimpleNamespace(monotonic=lambda: float(next(times))))
    overseer = Overseer([STAMPED])
    overseer.plant = Report("ok", message, {"mode": mode})
    wait_for_reader(PLAN, overseer, lambda: None)  # by the clock the plant waits for nothing
    lockstep = replace(PLAN, lockstep=True)
    with pytest.raises(RunFailed) as caught:
        wait_for_reader(lockstep, overseer, lambda: None)
    assert (
        f"the plant did not begin within 20 s ({message}). In lock step your controller subscribes odom"
        in str(caught.value)
    )
    overseer.plant = Report("ok", "running", {"mode": "running"})
    wait_for_reader(lockstep, overseer, lambda: None)


@pytest.fixture(scope="module")
def external(tmp_path_factory) -> Path:
    """A run whose controller reports nothing and stamps no command, otherwise as `reached`."""
    return write_run(
        tmp_path_factory.mktemp("runs") / "external", Plan(controller="external", duration_s=16.0)
    )


def test_commands_without_a_stamp_count_and_have_no_latency(external):
    summary = summarise(read_run(external))
    assert (summary["steps"], summary["success"], summary["watchdog_trips"]) == (81, True, 0)
    assert summary["control_rate_hz"] == pytest.approx(5.0, rel=0.01)
    for figure in ("latency_ms", "inference_ms", "period_error_ms"):
        assert summary[figure] == {"p50": None, "p99": None, "max": None}
    assert "  81 commands; 2 overruns, 0 watchdog trips\n" in summary_text(summary)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_what_is_unknown_of_a_run_is_not_printed(external):
    summary = summarise(replace(read_run(external), health=()))
    assert (summary["watchdog_trips"], summary["overruns"]) == (None, None)
    assert "  81 commands\n" in summary_text(summary)


def test_the_bag_of_an_external_controller_is_described_compared_and_reported(external, reached, fulmar):
    code, out, _ = fulmar("bag", "info", external)
    assert code == 0
    assert "controller: external" in out
    code, out, _ = fulmar("bag", "diff", external, reached, "--topic", "actuators/command", "--json")
    assert (code, json.loads(out)["topics"][0]["counts"]) == (1, [81, 201])
    code, _, _ = fulmar("report", external)
    assert code == 0
    assert (external / "report.html").is_file()


def test_a_rerun_refuses_an_external_controller_and_compares_another(external, reached, fulmar):
    for words in ((), ("--controller", "external")):
        line = complaint(fulmar("bag", "rerun", external, *words))
        assert "an external controller drove" in line
        assert "--controller classical --from odometry" in line
    record = control_steps_of(open_bag(external))
    stamped = control_steps_of(open_bag(reached))
    np.testing.assert_array_equal(record.stamp_ns, stamped.stamp_ns[: len(record)])
    np.testing.assert_array_equal(record.commands, stamped.commands[: len(record)])
    code, out, _ = fulmar(
        "bag", "rerun", external, "--controller", "classical", "--from", "odometry", "--json"
    )
    compared = json.loads(out)
    assert (compared["steps"], compared["asked"], compared["compared"]) == (81, 81, True)
    assert code == 1  # other weights, so other commands


@pytest.mark.parametrize("through", ["batch", "mujoco", "ros"])
def test_an_evaluation_refuses_an_external_controller(through, fulmar):
    words = ("turtlebot2", "go_to_position", "--controller", "external", "--through", through)
    assert "a node of your own, which no evaluation can restart" in complaint(fulmar("evaluate", *words))
