"""`fulmar service`: its files, its mistakes, and what systemd says of the unit; `tests/ros/test_service.py` runs it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess

import pytest

from fulmar_bringup.service import trial
from fulmar_bringup.service.device_rules import device_groups, device_rules
from fulmar_bringup.service.unit import RT_LIMIT, Service, command_of, system_of_unit, unit_text
from fulmar_cli.installation import service_plan
from fulmar_core.config.errors import BAD_USAGE, DONE, FAILED, ConfigError
from fulmar_core.config.paths import config_names, config_path
from hardware_drivers.hardware import load_hardware
from tests.own_files import own_folder

USER = "games"  # a user of every Debian, for whom systemd has no warning


@pytest.fixture
def untried(monkeypatch):
    """What would be tried before an installation, in the place of trying it, which takes seconds."""
    tried = []
    monkeypatch.setattr(service_plan, "try_once", lambda *about, **_: tried.append(about))
    return tried


@pytest.fixture
def service(fulmar, tmp_path, untried):
    """Function that runs `fulmar service` below a folder; returns exit code, output and messages."""

    def run(*arguments):
        return fulmar("service", *arguments, "--root", str(tmp_path))

    return run


def unit_of(tmp_path, name):
    return tmp_path / f"etc/systemd/system/fulmar-{name}.service"


def test_what_install_writes_is_listed_and_removed_again(service, tmp_path):
    code, printed, _ = service("install", "mujoco_lqr", "--user", USER, "--json")
    assert code == DONE
    written = json.loads(printed)
    assert (written["service"], written["started"]) == ("mujoco_lqr", False)
    link = tmp_path / "etc/systemd/system/multi-user.target.wants/fulmar-mujoco_lqr.service"
    assert set(written["files"]) == {str(unit_of(tmp_path, "mujoco_lqr")), str(link)}
    assert link.resolve() == unit_of(tmp_path, "mujoco_lqr").resolve()
    (state,) = json.loads(service("status", "--json")[1])["services"]
    assert (state["name"], state["system"], state["at_boot"]) == ("mujoco_lqr", "mujoco_lqr", True)
    assert service("remove", "mujoco_lqr")[0] == DONE
    assert not [path for path in tmp_path.rglob("*") if not path.is_dir()]


@pytest.mark.parametrize(
    ("system", "more"),
    [
        ("mujoco_policy", ()),
        ("mujoco_lab", ("--name", "alpha", "--recording", "whole")),
        ("mujoco_classical", ("--backend", "hardware", "--hardware", "turtlebot2")),
        ("mujoco_lab", ("--backend", "hardware")),
    ],
)
def test_systemd_finds_no_mistake_in_a_unit(system, more, service, tmp_path):
    code, _, messages = service("install", system, *more, "--user", USER)
    assert code == DONE, messages
    (unit,) = (tmp_path / "etc/systemd/system").glob("fulmar-*.service")
    assert shutil.which("systemd-analyze"), "apt install systemd: the unit is checked by systemd itself"
    checked = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, check=False)
    said = [line for line in checked.stderr.splitlines() if unit.name in line]
    assert (checked.returncode, said) == (0, [])


def test_a_unit_restarts_with_a_limit_stops_gently_and_is_nothing_of_root(service, tmp_path):
    service("install", "mujoco_lqr", "--user", USER)
    text = unit_of(tmp_path, "mujoco_lqr").read_text()
    for line in (
        f"User={USER}", "Restart=on-failure", "StartLimitBurst=20", "KillSignal=SIGTERM", "NoNewPrivileges=yes",
        "UMask=0077", "StateDirectoryMode=0700",
        f"LimitRTPRIO={RT_LIMIT}", "LimitMEMLOCK=infinity", "WantedBy=multi-user.target", "StandardOutput=journal",
    ):  # fmt: skip
        assert f"\n{line}\n" in text
    assert command_of(text)[1:4] == ("up", "mujoco_lqr", "--service")


def test_a_unit_has_the_ros_settings_of_the_one_who_installs(service, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "42")
    monkeypatch.setenv("HOME_OF_SECRETS", "1")
    service("install", "mujoco_lqr", "--user", USER)
    text = unit_of(tmp_path, "mujoco_lqr").read_text()
    assert "Environment=ROS_DOMAIN_ID=42\n" in text
    assert "SECRETS" not in text


@pytest.mark.parametrize("word", ["/a b/fulmar", 'quo"ted', "100%", "$HOME", "back\\slash", "plain"])
def test_words_of_the_command_survive_systemd_s_quoting(word):
    text = unit_text(Service("a", "a_system", ("/bin/fulmar", word), USER), {})
    assert command_of(text) == ("/bin/fulmar", word)
    assert system_of_unit(text) == "a_system"


def test_what_systemd_would_replace_is_doubled_in_a_unit():
    text = unit_text(
        Service("a", "a_system", ("/bin/fulmar", "100%", "$HOME"), USER), {"FULMAR_CONFIGS": "/50%"}
    )
    assert "ExecStart=/bin/fulmar 100%% $$HOME\n" in text
    assert "Environment=FULMAR_CONFIGS=/50%%\n" in text


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("install", "mujoco_lqrr", "--user", USER), BAD_USAGE, "Did you mean 'mujoco_lqr'"),
        (("install", "mujoco_lqr", "--user", "root"), BAD_USAGE, "does not run as root"),
        (("install", "mujoco_lqr", "--backend", "hardware", "--hardware", "a.yaml"), BAD_USAGE, "a.yaml"),
        (("remove", "mujoco_lqr"), BAD_USAGE, "no service is installed"),
        (("status", "mujoco_lqr"), BAD_USAGE, "no service is installed"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_and_writes_nothing(arguments, code, words, service, tmp_path):
    found, _, messages = service(*arguments)
    assert found == code
    assert words in messages
    assert len(messages.strip().splitlines()) == 1
    assert not [path for path in tmp_path.rglob("*") if not path.is_dir()]


def test_a_user_who_is_not_there_is_one_line(fulmar):
    code, _, messages = fulmar("service", "install", "mujoco_lqr", "--user", "not_there", "--dry-run")
    assert code == BAD_USAGE
    assert "there is no user 'not_there'" in messages


def test_a_foreign_unit_is_left_alone(service, tmp_path):
    path = unit_of(tmp_path, "mujoco_lqr")
    path.parent.mkdir(parents=True)
    path.write_text("[Unit]\n")
    code, _, messages = service("install", "mujoco_lqr", "--user", USER)
    assert code == BAD_USAGE
    assert "not written by `fulmar service install`" in messages
    assert path.read_text() == "[Unit]\n"


def test_foreign_rules_are_left_alone(service, tmp_path):
    service("install", "mujoco_lqr", "--user", USER)
    rules = tmp_path / "etc/udev/rules.d/70-fulmar-mujoco_lqr.rules"
    rules.parent.mkdir(parents=True)
    rules.write_text("# mine\n")
    assert service("remove", "mujoco_lqr")[0] == DONE
    assert rules.read_text() == "# mine\n"


def test_rules_go_with_the_hardware_that_they_were_for(service, tmp_path):
    service("install", "mujoco_lab", "--backend", "hardware", "--user", USER)
    rules = tmp_path / "etc/udev/rules.d/70-fulmar-mujoco_lab.rules"
    assert rules.exists()
    service("install", "mujoco_lab", "--user", USER)
    assert not rules.exists()


def test_paths_of_a_sourced_ros_are_kept_and_those_of_wheels_are_not(service, tmp_path, monkeypatch):
    monkeypatch.setenv("LD_LIBRARY_PATH", "/opt/ros/jazzy/lib")
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    service("install", "mujoco_lqr", "--user", USER)
    assert "LD_LIBRARY_PATH" not in unit_of(tmp_path, "mujoco_lqr").read_text()
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    service("install", "mujoco_lqr", "--user", USER)
    assert "Environment=LD_LIBRARY_PATH=/opt/ros/jazzy/lib\n" in unit_of(tmp_path, "mujoco_lqr").read_text()


def test_a_folder_that_cannot_be_written_is_one_line(service, tmp_path):
    (tmp_path / "etc").write_text("a file")
    code, _, messages = service("install", "mujoco_lqr", "--user", USER)
    assert code == FAILED
    assert len(messages.strip().splitlines()) == 1


def test_nothing_is_written_where_only_the_files_are_asked_for(service, tmp_path):
    code, printed, _ = service("install", "mujoco_lab", "--backend", "hardware", "--user", USER, "--dry-run")
    assert code == DONE
    assert "ExecStart=" in printed
    assert 'KERNEL=="gpiochip0"' in printed
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", config_names("hardware"))
def test_each_device_below_dev_has_a_rule_of_matches_and_assignments(name):
    hardware = load_hardware(name)
    rules = device_rules(hardware)
    assert bool(rules) == str(getattr(hardware.driver, "port", "")).startswith("/dev/")
    assert bool(device_groups(hardware)) == bool(rules)
    for rule in rules:
        for part in rule.split(", "):
            assert re.fullmatch(
                r'(ATTRS\{\w+\}|SUBSYSTEM|KERNEL)=="[^"]+"|(MODE|GROUP)="[^"]+"|SYMLINK\+="\w+"', part
            )


def test_files_are_written_anew_by_a_second_installation(service, tmp_path):
    service("install", "mujoco_lqr", "--user", USER)
    assert service("install", "mujoco_lqr", "--user", USER, "--recording", "whole")[0] == DONE
    assert "--recording whole" in unit_of(tmp_path, "mujoco_lqr").read_text()


STEER = """
import numpy as np

class Steer:
    def __init__(self, robot, task, settings):
        self.count = len(robot.actuators.names)
    def reset(self):
        pass
    def act(self, inputs):
        return np.zeros((len(inputs.state.x), self.count))
"""
RELAYS = """
from hardware_drivers.driver import DeviceDriver

class RelayBoard(DeviceDriver):
    def __init__(self, robot, settings, *, patience_s):
        pass
    def write(self, command):
        pass
    def close(self):
        pass
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    """The current folder, with a controller and a driver of one's own."""
    folder = tmp_path / "own folder"
    folder.mkdir()
    with own_folder(folder, monkeypatch):
        (folder / "own_steer.py").write_text(STEER)
        (folder / "own_relays.py").write_text(RELAYS)
        (folder / "relays.yaml").write_text(
            "title: t\nrobot: floating_platform\ndriver:\n  kind: own_relays:RelayBoard\n  port: /dev/ttyUSB0\n"
        )
        yield folder


def variables_of(text: str) -> dict[str, str]:
    lines = re.findall(r'^Environment="?(.*?)"?$', text, re.MULTILINE)
    return dict(line.split("=", 1) for line in lines)


def test_a_service_finds_own_classes_in_the_folder_that_it_was_installed_from(service, tmp_path, own):
    chosen = ("--robot", "turtlebot2", "--task", "go_to_position", "--controller", "own_steer:Steer")
    code, _, messages = service("install", "mujoco_classical", *chosen, "--user", USER)
    assert code == DONE, messages
    found = variables_of(unit_of(tmp_path, "mujoco_classical").read_text())
    assert found["PYTHONPATH"].split(":")[0] == str(own)


SENSOR = """
class Gauge:
    message, topic, fields = "std_msgs/msg/Float64", "gauge", ("data",)
    def __init__(self, settings): pass
    def reset(self, rng): pass
    def measure(self, truth, time_s): return (0.0,)
"""


def test_a_service_finds_the_class_of_a_sensor_of_its_robot(service, tmp_path, own, monkeypatch):
    (own / "own_gauge.py").write_text(SENSOR)
    (own / "own" / "robots").mkdir(parents=True)
    monkeypatch.setenv("FULMAR_CONFIGS", "own")
    robot = config_path("robots", "turtlebot2").read_text().replace("name: turtlebot2", "name: gauged")
    own_sensors = "sensors:\n  own:\n    gauge: {sensor: 'own_gauge:Gauge'}\n"
    (own / "own" / "robots" / "gauged.yaml").write_text(robot.replace("sensors:\n", own_sensors))
    code, _, messages = service("install", "mujoco_classical", "--robot", "gauged", "--user", USER)
    assert code == DONE, messages
    found = variables_of(unit_of(tmp_path, "mujoco_classical").read_text())
    assert found["PYTHONPATH"].split(":")[0] == str(own)


def test_a_service_is_tried_with_its_own_environment_before_it_is_installed(service, own, untried):
    chosen = ("--robot", "turtlebot2", "--task", "go_to_position", "--controller", "own_steer:Steer")
    service("install", "mujoco_classical", *chosen, "--user", USER)
    ((asked, variables),) = untried
    assert asked.command[1:4] == ("up", "mujoco_classical", "--service")
    assert variables["PYTHONPATH"].split(":")[0] == str(own)


# Refuses to start beside files, with a variable of the shell, or without --dry-run.
PROGRAM = """#!/bin/sh
[ -z "$HIDDEN" ] && [ -z "$(ls)" ] && case "$*" in *--dry-run) exit {code};; esac
echo "fulmar: $PWD: $*" >&2
exit 2
"""


@pytest.mark.parametrize("code", [DONE, FAILED])
def test_a_service_that_would_not_start_is_not_installed_and_says_why(service, tmp_path, monkeypatch, code):
    monkeypatch.setattr(service_plan, "try_once", trial.try_once)
    program = tmp_path / "fulmar"
    program.write_text(PROGRAM.format(code=code))
    program.chmod(0o755)
    monkeypatch.setattr(service_plan, "_program", lambda: program)
    monkeypatch.setenv("HIDDEN", "of this shell")
    ended, printed, messages = service("install", "mujoco_lqr", "--user", USER)
    assert unit_of(tmp_path, "mujoco_lqr").exists() == (code == DONE)
    if code != DONE:
        assert (ended, printed) == (BAD_USAGE, "")
        assert "the service would not start, and nothing was written: as '" in messages
        assert messages.endswith(f"it says: exit code {code}\n")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root becomes another user")
def test_a_service_is_tried_as_its_user_in_a_folder_of_that_user():
    says = 'touch there && echo "fulmar: $(id -un) in $PWD, $HOME, $GIVEN" >&2; exit 3'
    asked = Service("x", "mock_lqr", ("/bin/sh", "-c", says), USER)
    with pytest.raises(ConfigError, match=rf"as '{USER}', .* it says: {USER} in \S+, /\S+, this$"):
        trial.try_once(asked, {"GIVEN": "this"}, as_user=True)


def test_a_dry_run_of_a_system_finds_what_a_start_would_miss_and_starts_nothing(fulmar, own):
    code, printed, messages = fulmar("up", "mujoco_lqr", "--service", "--dry-run")
    assert (code, printed) == (DONE, ""), messages
    assert "robot floating_platform; task go_to_pose" in messages
    assert "controller lqr at " in messages
    chosen = ("--robot", "turtlebot2", "--task", "go_to_position", "--controller", "own_missing:Steer")
    code, _, messages = fulmar("up", "mujoco_classical", "--dry-run", *chosen)
    assert code == BAD_USAGE
    assert "there is no module 'own_missing'" in messages
    assert not (own / "runs").exists()


@pytest.mark.parametrize("name", ["random", "yaml"])
def test_a_module_that_a_service_would_run_in_the_place_of_another_is_refused(service, tmp_path, own, name):
    (own / f"{name}.py").write_text("raise SystemExit('run')\n")
    chosen = ("--robot", "turtlebot2", "--task", "go_to_position", "--controller", "own_steer:Steer")
    code, _, messages = service("install", "mujoco_classical", *chosen, "--user", USER)
    assert code == BAD_USAGE
    assert f"{own / name}: a service would run it in the place of the module '{name}'" in messages
    assert not (tmp_path / "etc").exists()


def test_a_service_finds_the_class_of_its_driver(service, tmp_path, own):
    chosen = ("--backend", "hardware", "--hardware", "relays.yaml")
    code, _, messages = service("install", "mujoco_lqr", *chosen, "--user", USER)
    assert code == DONE, messages
    text = unit_of(tmp_path, "mujoco_lqr").read_text()
    assert variables_of(text)["PYTHONPATH"].split(":")[0] == str(own)
    assert str(own / "relays.yaml") in command_of(text)


def test_without_own_classes_a_service_gets_no_path_of_modules(service, tmp_path, own):
    service("install", "mujoco_lqr", "--user", USER)
    assert "PYTHONPATH" not in variables_of(unit_of(tmp_path, "mujoco_lqr").read_text())


def test_paths_of_the_environment_are_whole_and_a_dollar_stays_one(service, tmp_path, own, monkeypatch):
    for name in ("own$x", "second"):
        (own / name / "robots").mkdir(parents=True)
    monkeypatch.setenv("FULMAR_CONFIGS", "own$x:second")
    code, _, messages = service("install", "mujoco_lqr", "--user", USER)
    assert code == DONE, messages
    found = variables_of(unit_of(tmp_path, "mujoco_lqr").read_text())
    assert found["FULMAR_CONFIGS"] == f"{own}/own$x:{own}/second"


def test_a_variable_with_a_line_break_is_refused_by_its_name(service, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_STATIC_PEERS", "10.0.0.1\nUser=root")
    code, _, messages = service("install", "mujoco_lqr", "--user", USER)
    assert code == BAD_USAGE
    assert "ROS_STATIC_PEERS = '10.0.0.1\\nUser=root' must be one line" in messages
    assert not [path for path in tmp_path.rglob("*") if not path.is_dir()]
