"""Pause, steps, speed and disturbances of a plant that runs, as a person asks for them by `fulmar simulation`."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from mcap.reader import make_reader

from fulmar_bringup import robot_operator, simulation_requests
from fulmar_bringup.estop_robots import stop_robots
from fulmar_bringup.robot_operator import Operator
from fulmar_bringup.simulation_requests import (
    ask_for_rate,
    ask_for_steps,
    ask_to_disturb,
    ask_to_pause,
    read_fields,
)
from fulmar_core.config.errors import ConfigError, RunFailed
from fulmar_core.robots.topics import SIMULATION_EVENT
from fulmar_ros.plant_node import PlantNode
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of, start_fulmar
from tests.ros.neighbour import ROBOT, Neighbour, until

OPEN = [1.0] + [0.0] * 7


@pytest.fixture
def person(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Operator:
    for module in (robot_operator, simulation_requests):
        monkeypatch.setattr(module, "FIND_S", 2.0)
    return Operator(neighbour.node)


@pytest.mark.real_time
def test_a_pause_is_no_silence_to_the_watchdog(
    neighbour: Neighbour, plant: PlantNode, person: Operator
) -> None:
    beat = neighbour.node.create_timer(0.02, lambda: neighbour.command(OPEN))
    until(lambda: neighbour.applied[-1].any())
    assert ask_to_pause(person, ROBOT, True).accepted
    beat.cancel()  # a controller answers measurements, and there are none
    until(lambda: neighbour.said["plant"][1].get("paused") == "true")
    time.sleep(1.0)  # longer than the watchdog waits
    assert ask_for_steps(person, ROBOT, 2).accepted
    assert ask_to_pause(person, ROBOT, False).accepted
    beat.reset()
    until(lambda: neighbour.said["plant"][1].get("paused") == "false")
    assert neighbour.said["plant"][1]["watchdog_trips"] == "0"
    beat.cancel()
    until(lambda: neighbour.said["plant"][1]["watchdog_trips"] == "1")  # a silence while it runs still counts


@pytest.mark.real_time
def test_an_e_stop_closes_the_valves_of_a_paused_robot_once_it_goes_on(
    neighbour: Neighbour, plant: PlantNode, person: Operator
) -> None:
    until(lambda: neighbour.command(OPEN) or neighbour.applied[-1].any())
    assert ask_to_pause(person, ROBOT, True).accepted
    assert stop_robots(neighbour.node, ROBOT, find_s=5.0)[0].reached
    until(lambda: neighbour.said["plant"][1].get("estop") == "true")
    assert ask_to_pause(person, ROBOT, False).accepted
    until(lambda: not neighbour.applied[-1].any())
    neighbour.command(OPEN)
    time.sleep(0.2)
    assert not neighbour.applied[-1].any()


@pytest.mark.real_time
def test_what_a_plant_does_not_do_is_refused_in_words(
    neighbour: Neighbour, plant: PlantNode, person: Operator
) -> None:
    assert not ask_for_steps(person, ROBOT, 1).accepted  # it is not paused
    too_fast = ask_for_rate(person, ROBOT, 50.0)
    assert not too_fast.accepted
    assert "0.05 to 10" in too_fast.reason
    misspelt = ask_to_disturb(person, ROBOT, "pusch", {})
    assert not misspelt.accepted
    assert "'push'" in misspelt.reason
    assert ask_to_disturb(person, ROBOT, "dead", {"actuator": neighbour.robot.actuators.names[0]}).accepted
    until(lambda: neighbour.said["plant"][1].get("disturbances") == "dead")
    assert ask_to_disturb(person, ROBOT, "clear", {}).accepted
    until(lambda: neighbour.said["plant"][1].get("disturbances") == "")


@pytest.mark.real_time
def test_a_robot_without_a_simulation_is_not_found(neighbour: Neighbour, person: Operator) -> None:
    with pytest.raises(RunFailed, match="no simulated plant of 'floating_platform' runs"):
        ask_to_pause(person, ROBOT, True)


def test_fields_are_read_as_numbers_vectors_and_names() -> None:
    found = read_fields(["force_n=3,0", "seconds=1", "actuator=valve_1"])
    assert found == {"force_n": [3.0, 0.0], "seconds": 1.0, "actuator": "valve_1"}
    with pytest.raises(ConfigError, match="force_n=3,0"):
        read_fields(["push"])


@pytest.mark.slow
@pytest.mark.timeout(240)
def test_a_bag_of_a_disturbed_run_says_what_was_done_and_its_rerun_acts_the_same(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Everything that a disturbance does reaches the controller through what is measured."""
    run = start_fulmar(
        "run", ROBOT, "--controller", "lqr", "--goal", "2,0,0", "--duration", "25", "--record", "bag",
        env=ros_domain.env, cwd=tmp_path,
    )  # fmt: skip
    asked = [("push", "force_n=1,0", "seconds=1"), ("noise", "position_m=0.02")]
    for words in asked:
        done = fulmar("simulation", "disturb", ROBOT, *words, "--json", env=ros_domain.env, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert json_of(done.stdout)["done"] is True
    run.wait(60.0)
    (file,) = (tmp_path / "bag").glob("*.mcap")
    with file.open("rb") as stream:
        topic = f"/{ROBOT}/{SIMULATION_EVENT.name}"
        texts = [message.data for *_, message in make_reader(stream).iter_messages(topics=[topic])]
    events = [json.loads(text[text.index(b"{") : text.rindex(b"}") + 1]) for text in texts]
    assert [event["what"] for event in events] == ["push", "noise"]
    again = fulmar("bag", "rerun", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    assert again.returncode == 0, again.stdout
    assert json_of(again.stdout)["same"] is True
