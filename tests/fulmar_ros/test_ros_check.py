"""Settings with which ROS does not work are found before rclpy is loaded, with the command that corrects them."""

from __future__ import annotations

import importlib
import os
import sys

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_ros import ros_check
from fulmar_ros.ros_check import check_log_folder, look_before_loading, ros_fault


@pytest.fixture
def sound(tmp_path):
    """An environment in which ROS works."""
    return {
        **os.environ,
        "ROS_LOG_DIR": str(tmp_path / "logs"),
        "ROS_DOMAIN_ID": "18",
        "RMW_IMPLEMENTATION": "",
    }


def test_a_sound_environment_has_no_fault(sound):
    assert ros_fault(sound) is None
    assert ros_fault(sound | {"RMW_IMPLEMENTATION": ros_check.USUAL}) is None


def test_a_middleware_that_is_not_installed_is_named_with_the_one_that_is(sound):
    fault = ros_fault(sound | {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"})
    assert (
        fault.found
        == "RMW_IMPLEMENTATION=rmw_cyclonedds_cpp is not installed: this ROS has rmw_fastrtps_cpp only"
    )
    assert fault.fix == "unset RMW_IMPLEMENTATION"


@pytest.mark.parametrize("domain", ["abc", "-1", "233", "1.0"])
def test_a_domain_that_dds_does_not_have_is_refused(sound, domain):
    assert (
        f"ROS_DOMAIN_ID = '{domain}' must be a whole number from 0 to 232"
        in ros_fault(sound | {"ROS_DOMAIN_ID": domain}).found
    )


@pytest.mark.parametrize(
    ("variables", "words"),
    [
        ({"ROS_LOG_DIR": "/proc/no"}, "/proc/no, by ROS_LOG_DIR"),
        ({"ROS_LOG_DIR": "", "ROS_HOME": "/proc/no"}, "/proc/no/log, by ROS_HOME"),
        ({"ROS_LOG_DIR": "", "ROS_HOME": "", "HOME": "/proc/no"}, "/proc/no/.ros/log, by HOME"),
        ({"ROS_LOG_DIR": "", "ROS_HOME": "", "HOME": ""}, "HOME is not set"),
    ],
)
def test_logs_that_cannot_be_written_are_named_with_the_variable_that_says_where(sound, variables, words):
    with pytest.raises(ConfigError) as caught:
        check_log_folder(sound | variables)
    assert words in str(caught.value)
    assert "Run: export ROS_LOG_DIR=" in str(caught.value)


def test_an_rclpy_of_another_python_is_named_by_its_folder(sound, tmp_path):
    packages = tmp_path / "lib/python3.99/site-packages"
    (packages / "rclpy").mkdir(parents=True)
    (packages / "rclpy" / "_rclpy_pybind11.cpython-399-x86_64-linux-gnu.so").touch()
    fault = ros_fault(sound | {"PYTHONPATH": f"/nowhere:{packages}"})
    assert f"an rclpy of another Python in {packages}" in fault.found
    assert fault.fix.startswith("env -u PYTHONPATH ")
    (packages / "rclpy" / f"_rclpy_pybind11{ros_check.EXTENSION_SUFFIXES[0]}").touch()
    assert ros_fault(sound | {"PYTHONPATH": str(packages)}) is None


def test_rclpy_is_not_loaded_where_it_would_end_the_process(monkeypatch, tmp_path):
    (tmp_path / "such_an_rclpy.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    monkeypatch.setattr(ros_check, "RCLPY", "such_an_rclpy")
    monkeypatch.setenv("ROS_DOMAIN_ID", "999")
    look_before_loading()
    look_before_loading()  # once is enough
    with pytest.raises(ConfigError, match=r"ROS_DOMAIN_ID = '999' must be .* Run: export ROS_DOMAIN_ID=0"):
        importlib.import_module("such_an_rclpy")
    monkeypatch.setenv("ROS_DOMAIN_ID", "9")
    importlib.import_module("such_an_rclpy")


def test_that_rclpy_is_missing_is_said_elsewhere(monkeypatch):
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    monkeypatch.setattr(ros_check, "RCLPY", "no_such_rclpy")
    monkeypatch.setenv("ROS_DOMAIN_ID", "999")
    look_before_loading()
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("no_such_rclpy")
