"""Building tf2_msgs: what it refuses, and a real build into an environment that has only ROS."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import venv
from importlib.util import find_spec
from pathlib import Path

import pytest

from fulmar_bringup import message_build
from fulmar_bringup.message_build import SOURCE, TF2_MSGS, install_messages
from fulmar_core.config.errors import ConfigError, FulmarError

REPOSITORY = Path(__file__).parents[2]
INSTALL = "from fulmar_bringup.message_build import install_messages as install"
BUILD = f"{INSTALL}; print(install('tf2_msgs', lambda line: None))"
USE = """
import rclpy
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
from geometry_msgs.msg import TransformStamped
rclpy.init()
node, got = Node("echo"), []
node.create_subscription(TFMessage, "/tf", got.append, 100)
publisher = node.create_publisher(TFMessage, "/tf", 100)
for _ in range(200):
    publisher.publish(TFMessage(transforms=[TransformStamped(child_frame_id="base_link")]))
    rclpy.spin_once(node, timeout_sec=0.1)
    if got:
        break
print(got[0].transforms[0].child_frame_id)
"""


@pytest.fixture
def absent(monkeypatch):
    """An environment without tf2_msgs."""
    monkeypatch.setattr(
        message_build, "find_spec", lambda name: None if name == "tf2_msgs" else find_spec(name)
    )


def report(line):
    raise AssertionError(f"a step began: {line}")


def test_a_package_that_is_there_is_left_alone(fulmar):
    assert install_messages(TF2_MSGS, report) is False
    assert fulmar("install-tf")[:2] == (0, "tf2_msgs is there already\n")


def test_an_environment_without_ros_is_refused(monkeypatch):
    monkeypatch.setattr(message_build, "find_spec", lambda _name: None)
    with pytest.raises(ConfigError, match=r"install 'fulmar\[ros\]'"):
        install_messages(TF2_MSGS, report)


@pytest.mark.usefixtures("absent")
def test_a_machine_without_a_compiler_is_refused_with_the_command_that_installs_one(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    for variable in ("CC", "CXX"):
        monkeypatch.delenv(variable, raising=False)
    with pytest.raises(ConfigError, match=r"no compiler was found \(cc, .*apt install g\+\+"):
        install_messages(TF2_MSGS, report)


@pytest.mark.usefixtures("absent")
def test_a_python_without_headers_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(message_build.sysconfig, "get_path", lambda _name: str(tmp_path))
    with pytest.raises(ConfigError, match=r"no headers .*apt install python3-dev"):
        install_messages(TF2_MSGS, report)


@pytest.mark.usefixtures("absent")
def test_a_step_that_fails_is_named_with_its_first_error(monkeypatch, tmp_path):
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\necho noise\necho 'ERROR: No matching distribution found'\nexit 1\n")
    python.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(python))
    with pytest.raises(FulmarError) as failed:
        install_messages(TF2_MSGS, lambda line: None)
    assert str(failed.value) == (
        "tf2_msgs: could not make an environment:\nERROR: No matching distribution found"
    )


def test_the_generators_fit_the_packages_that_run():
    def pins(lock):
        return dict(re.findall(r"^(\S+?)(?:\[\S+\])?==(\S+)", lock.read_text(), re.MULTILINE))

    run, build = pins(REPOSITORY / "requirements.lock"), pins(SOURCE / "requirements.lock")
    shared = {name for name in run.keys() & build.keys() if name.startswith("ros-jazzy-")}
    assert "ros-jazzy-rclpy" in shared
    assert {name: build[name] for name in shared} == {name: run[name] for name in shared}


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_it_is_built_for_an_environment_that_has_only_ros(ros_domain, tmp_path):
    prefix = tmp_path / "environment"
    venv.create(prefix, with_pip=True)
    python = str(prefix / "bin" / "python")
    lock = str(SOURCE / "requirements.lock")
    pip = [python, "-m", "pip", "install", "--quiet", "--require-hashes", "-r", lock]
    subprocess.run(pip, check=True)
    sources = [REPOSITORY / "ros2_ws" / "src" / name for name in ("fulmar_bringup", "fulmar_core")]
    path = os.pathsep.join(map(str, sources))

    def run(code, **more):
        asked = [python, "-c", code]
        done = subprocess.run(asked, env=ros_domain.env | more, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    before = {each for each in prefix.rglob("*") if each.suffix != ".pyc"}
    assert run(BUILD, PYTHONPATH=path) == "True"
    assert run(USE) == "base_link"
    assert run(BUILD, PYTHONPATH=path) == "False"
    made = {each for each in prefix.rglob("*") if each.suffix != ".pyc"} - before
    foreign = [each for each in made if "tf2_msgs" not in str(Path(each).relative_to(prefix))]
    assert [each for each in foreign if not each.is_dir()] == []
