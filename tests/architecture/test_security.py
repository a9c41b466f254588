"""Modules that run on a robot open no file that can run code; nodes are discovered on their own host only."""

from __future__ import annotations

import ast
import functools
import os
import pickle
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from fulmar_bringup.processes import child_environment
from fulmar_core.config.errors import BundleError, ConfigError
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.loop.policy_bundle import GOLDEN, NETWORK, PASSPORT, read_passport, write_bundle
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import WIRES
from fulmar_core.tasks import load_task
from fulmar_ros.px4_wires import FROM_PX4, TO_PX4
from policy_server.controllers import policies_directory
from policy_server.policy import Policy
from tests.architecture.security_policy import BEGIN, POLICY, with_sensors

ON_THE_ROBOT = (
    "ros2_ws/src/fulmar_core/fulmar_core",
    "ros2_ws/src/fulmar_bags/fulmar_bags",
    "ros2_ws/src/fulmar_ros/fulmar_ros",
    "ros2_ws/src/fulmar_bringup/fulmar_bringup",
    "ros2_ws/src/fulmar_evaluation/fulmar_evaluation",
    "ros2_ws/src/fulmar_cli/fulmar_cli",
    "policy_server",
    "hardware_drivers",
    "sim_nodes",
)
UNPICKLERS = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal"}
UNSAFE_CALLS = {"eval", "exec", "unsafe_load", "full_load", "load_all", "unsafe_load_all"}
NAMED = re.compile(rf"\b({'|'.join([*UNPICKLERS, *UNSAFE_CALLS])})\b|\b(np|yaml)\s*\.\s*load\b")
SHIPPED = policies_directory() / "floating_platform_go_to_pose"


@functools.cache
def sources(repository):
    """Files and their syntax trees."""
    paths = [path for folder in ON_THE_ROBOT for path in sorted((repository / folder).rglob("*.py"))]
    texts = {path: path.read_text(encoding="utf-8") for path in paths}
    # Few files have one of the names at all, and only these have to be parsed.
    return [(path, list(ast.walk(ast.parse(text)))) for path, text in texts.items() if NAMED.search(text)]


def test_no_module_of_the_robot_imports_what_can_unpickle(repository):
    found = []
    for path, nodes in sources(repository):
        for node in nodes:
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            found += [f"{path}: {name}" for name in names if name.split(".")[0] in UNPICKLERS]
    assert found == []


def test_no_module_of_the_robot_evaluates_text_or_reads_unsafe_yaml(repository):
    found = []
    for path, nodes in sources(repository):
        for node in nodes:
            if not isinstance(node, ast.Call):
                continue
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            owner = getattr(getattr(node.func, "value", None), "id", "")
            if (called in UNSAFE_CALLS and owner in ("", "yaml")) or (owner, called) == ("yaml", "load"):
                found.append(f"{path}:{node.lineno}: {called}")
            if (owner, called) == ("np", "load"):
                allowed = {keyword.arg: ast.unparse(keyword.value) for keyword in node.keywords}
                assert allowed.get("allow_pickle") == "False", f"{path}:{node.lineno}"
    assert found == []


class Bomb:
    """Leaves a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


@pytest.mark.parametrize("place", ["golden as pickle", "array of objects", "network", "passport"])
def test_a_pickle_in_a_bundle_is_rejected_and_never_run(place, tmp_path):
    folder, trap = shutil.copytree(SHIPPED, tmp_path / "bundle"), tmp_path / "trap"
    poison = pickle.dumps(Bomb(trap))
    passport = read_passport(folder)
    if place == "golden as pickle":
        (folder / GOLDEN).write_bytes(poison)
    elif place == "array of objects":
        with np.load(folder / GOLDEN, allow_pickle=False) as arrays:
            values = dict(arrays)
        values["observations"] = np.array([Bomb(trap)], dtype=object)
        with (folder / GOLDEN).open("wb") as file:
            np.savez(file, **values)
    elif place == "network":
        (folder / NETWORK).write_bytes(poison)
    else:
        (folder / PASSPORT).write_bytes(poison)
    if place != "passport":  # whoever plants it sets the hashes right
        import hashlib
        import json
        from dataclasses import asdict, replace

        hashes = {
            "network_sha256": hashlib.sha256((folder / NETWORK).read_bytes()).hexdigest(),
            "golden_sha256": hashlib.sha256((folder / GOLDEN).read_bytes()).hexdigest(),
        }
        (folder / PASSPORT).write_text(json.dumps(asdict(replace(passport, **hashes).sealed())))
    with pytest.raises(BundleError):
        Policy(folder, load_robot("floating_platform"), load_task("go_to_pose"))
    assert not trap.exists()


@pytest.mark.parametrize(
    "text",
    [
        "name: !!python/object/apply:os.mkdir [{trap}]",
        "!!python/object/apply:os.mkdir [{trap}]",
        "name: !!python/name:os.mkdir",
    ],
)
def test_yaml_with_an_object_is_rejected_with_its_line(text, tmp_path):
    trap = tmp_path / "trap"
    (tmp_path / "robot.yaml").write_text(text.format(trap=trap))
    with pytest.raises(ConfigError, match=r"robot\.yaml:1"):
        load_config(Robot, tmp_path / "robot.yaml")
    assert not trap.exists()


def test_child_processes_are_discovered_on_this_host_only_unless_the_environment_differs(monkeypatch):
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    assert child_environment()["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    assert child_environment()["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SUBNET"


def test_a_node_that_is_started_by_hand_is_discovered_on_this_host_only():
    code = (
        "import os; from fulmar_ros.middleware import set_up_middleware; set_up_middleware();"
        "print(os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'])"
    )
    env = {key: value for key, value in os.environ.items() if key != "ROS_AUTOMATIC_DISCOVERY_RANGE"}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "LOCALHOST"


@pytest.fixture
def policy_file(repository):
    return ElementTree.parse(repository / "configs/security/policy.xml").getroot()


def test_the_policy_file_for_enclaves_has_exactly_the_topics_of_the_table(policy_file):
    named = {element.text.strip() for element in policy_file.iter("topic")}
    px4 = {name for names in (*TO_PX4.values(), *FROM_PX4.values()) for name in names}
    own = {wire.name.lstrip("/") for wire in WIRES} | px4
    assert own <= {name.strip("/") for name in named}
    assert {name.strip("/") for name in named} - own <= {"parameter_events", "rosout"}


def test_plant_controller_and_recorder_have_every_sensor_of_the_table():
    written = POLICY.read_text(encoding="utf-8")
    assert written.count(BEGIN) == 3
    assert written == with_sensors(written), "out of date: python -m tests.architecture.security_policy"


def test_only_the_plant_publishes_applied_commands_and_only_operators_stop_or_swap(policy_file):
    publishers: dict[str, set[str]] = {}
    for enclave in policy_file.iter("enclave"):
        for topics in enclave.iter("topics"):
            if topics.get("publish") == "ALLOW":
                for topic in topics.iter("topic"):
                    publishers.setdefault(topic.text.strip(), set()).add(enclave.get("path"))
    assert publishers["actuators/state"] == {"/fulmar/plant"}
    assert publishers["estop"] == {"/fulmar/estop", "/fulmar/operator"}
    assert publishers["controller/swap"] == {"/fulmar/operator"}
    assert publishers["relay"] == {"/fulmar/controller", "/fulmar/markers", "/fulmar/recorder"}
    assert publishers["actuators/command"] == {"/fulmar/controller"}
    assert publishers["teleop/command"] == {"/fulmar/teleop"}


def test_a_rewritten_bundle_loses_its_old_signature(tmp_path):
    from fulmar_core.loop.policy_bundle import SIGNATURE, read_golden

    folder = shutil.copytree(SHIPPED, tmp_path / "bundle")
    (folder / SIGNATURE).write_text("{}")
    write_bundle(folder, (folder / NETWORK).read_bytes(), read_golden(folder), read_passport(folder))
    assert not (folder / SIGNATURE).exists()
