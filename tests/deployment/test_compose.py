"""docker/compose.yaml: what each service may do, and that Fulmar accepts each of its commands."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path, PurePath
from typing import Any

import pytest
import typer
import yaml

from fulmar_bringup.domain_status import NODES
from fulmar_bringup.service.device_rules import device_groups, device_rules
from fulmar_bringup.system_plan import system_plan
from fulmar_cli.commands.status import TIMEOUT_S
from fulmar_cli.main import app
from hardware_drivers.hardware import load_hardware

# https://github.com/compose-spec/compose-spec/blob/main/05-services.md: those that a service on one host can have.
SERVICE_KEYS = (
    "annotations attach build blkio_config cap_add cap_drop cgroup cgroup_parent command configs container_name "
    "cpu_count cpu_percent cpu_period cpu_quota cpu_shares cpuset cpus depends_on deploy develop device_cgroup_rules "
    "devices dns dns_opt dns_search domainname entrypoint env_file environment expose extends external_links "
    "extra_hosts gpus group_add healthcheck hostname image init ipc isolation labels links logging mac_address "
    "mem_limit mem_reservation mem_swappiness memswap_limit network_mode networks oom_kill_disable oom_score_adj pid "
    "pids_limit platform ports post_start pre_stop privileged profiles pull_policy read_only restart runtime scale "
    "secrets security_opt shm_size stdin_open stop_grace_period stop_signal storage_opt sysctls tmpfs tty ulimits user "
    "userns_mode uts volumes volumes_from working_dir"
)
HEALTH_KEYS = {"test", "interval", "timeout", "retries", "start_period", "start_interval", "disable"}
BUILD_KEYS = {"context", "dockerfile", "target", "args"}
VARIABLE = re.compile(r"\$\{(\w+)(?::-([^}]*))?\}")
SERVICES = ("sim", "robot", "plant", "controller", "train")
STANDING = [name for name in SERVICES if name != "train"]


def with_defaults(node: Any) -> Any:
    """A part of the file in which each variable has its default, as without any in the environment."""
    if isinstance(node, dict):
        return {key: with_defaults(value) for key, value in node.items()}
    if isinstance(node, list):
        return [with_defaults(value) for value in node]
    return VARIABLE.sub(lambda found: found[2] or "", node) if isinstance(node, str) else node


@pytest.fixture(scope="module")
def compose(repository) -> dict[str, Any]:
    """The file, with the defaults of its variables."""
    return with_defaults(yaml.safe_load((repository / "docker/compose.yaml").read_text(encoding="utf-8")))


@pytest.fixture(params=SERVICES)
def service(request, compose) -> dict[str, Any]:
    """Each service."""
    return compose["services"][request.param]


def parsed(words: list[str]) -> dict[str, Any]:
    """Arguments and options of a command line of Fulmar, by the command's own parser.

    Raises:
        click.UsageError: The command does not accept them.
    """
    command = typer.main.get_command(app).commands[words[0]]
    return command.make_context(words[0], list(words[1:])).params


def test_the_services_are_those_that_are_tested(compose):
    assert set(compose["services"]) == set(SERVICES)
    assert {key for key in compose if not key.startswith("x-")} <= {"services", "volumes"}


def test_a_service_has_only_keys_of_the_compose_specification(service):
    assert set(service) <= set(SERVICE_KEYS.split())
    assert set(service.get("healthcheck", {})) <= HEALTH_KEYS
    assert set(service["build"]) <= BUILD_KEYS


def test_a_service_has_no_rights_that_it_does_not_need(service):
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    user, group = service["user"].split(":")
    assert int(user) > 0
    assert int(group) > 0
    assert not {"privileged", "cap_add", "pid"} & set(service)


def test_a_service_writes_only_to_tmp_and_to_the_volume_of_runs(service, compose):
    assert [entry.split(":")[0] for entry in service["tmpfs"]] == ["/tmp"]
    assert service["volumes"] == ["runs:/runs"]
    assert "runs" in compose["volumes"]


@pytest.mark.parametrize("name", STANDING)
def test_a_standing_service_is_restarted_and_its_health_is_checked(name, compose):
    service = compose["services"][name]
    assert service["restart"] == "unless-stopped"
    kind, program, *words = service["healthcheck"]["test"]
    assert (kind, program) == ("CMD", "fulmar")
    asked, runs = parsed(words), parsed(service["command"])
    assert asked["name"] == runs["name"]
    assert asked["node"] == (runs["only"] or "plant")
    assert asked["node"] in NODES
    assert (asked["timeout"] or TIMEOUT_S) < float(service["healthcheck"]["timeout"].removesuffix("s"))


def test_training_ends_by_itself_without_a_network(compose):
    service = compose["services"]["train"]
    assert service["restart"] == "no"
    assert service["network_mode"] == "none"
    assert parsed(service["command"])["task"] == "go_to_pose"


@pytest.mark.parametrize("name", STANDING)
def test_the_command_of_a_standing_service_names_a_system_that_exists(name, compose):
    runs = parsed(compose["services"][name]["command"])
    system = system_plan(runs["system"], robot=runs["robot"], name=runs["name"], backend=runs["backend"])
    assert system.name == runs["name"]


def test_a_command_that_fulmar_does_not_know_is_rejected():
    with pytest.raises(Exception, match="No such option"):
        parsed(["up", "mujoco_lqr", "--onyl", "plant"])


def test_every_standing_service_speaks_on_the_loopback_of_its_host_alone(compose):
    for name in STANDING:
        service = compose["services"][name]
        assert service["network_mode"] == "host"
        assert service["environment"]["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"


def test_plant_and_controller_are_of_one_system_and_robot_with_an_e_stop(compose):
    plant, controller = (parsed(compose["services"][name]["command"]) for name in ("plant", "controller"))
    assert (plant["only"], controller["only"]) == ("plant", "controller")
    for key in ("system", "name", "robot", "task", "rate", "estop"):
        assert plant[key] == controller[key]
    assert plant["estop"]


def test_the_device_of_the_real_robot_has_the_name_of_the_udev_rule_and_lies_where_its_driver_looks(compose):
    service = compose["services"]["robot"]
    hardware = load_hardware(parsed(service["command"])["robot"])
    ((outside, inside),) = [device.split(":") for device in service["devices"]]
    assert f'SYMLINK+="{Path(outside).name}"' in " ".join(device_rules(hardware))
    assert inside == hardware.driver.port
    assert set(service["group_add"]) <= set(device_groups(hardware))
    assert parsed(service["command"])["service"], "nothing may move before a person resets the e-stop"


def test_the_images_are_targets_of_the_dockerfile(service, repository):
    dockerfile = (repository / "docker/Dockerfile").read_text(encoding="utf-8")
    assert re.search(rf"^FROM \S+ AS {service['build']['target']}$", dockerfile, re.MULTILINE)
    assert service["image"] == f"fulmar:{service['build']['target']}"
    for name in service["build"].get("args", {}):
        assert re.search(rf"^ARG {name}=", dockerfile, re.MULTILINE)


def test_podman_compose_fills_in_the_environment(repository):
    done = subprocess.run(
        [Path(sys.executable).with_name("podman-compose"), "--dry-run", "--file", "docker/compose.yaml",
         "--profile", "hardware", "config"],
        cwd=repository,
        env={**os.environ, "NAME": "seven", "ROS_DOMAIN_ID": "42"},
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (service,) = yaml.safe_load(done.stdout)["services"].values()
    assert service["environment"]["ROS_DOMAIN_ID"] == "42"
    assert "seven" in service["command"]
    assert "seven" in service["healthcheck"]["test"]


def test_the_images_are_built_from_all_that_the_wheel_needs(repository):
    project = tomllib.loads((repository / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    needed = ["pyproject.toml", project["project"]["readme"], *project["project"]["license-files"]]
    ignored = (repository / ".dockerignore").read_text(encoding="utf-8").splitlines()
    sent = [line.removeprefix("!") for line in ignored if line.startswith("!")]
    for name in (*needed, *wheel["packages"]):
        assert any(PurePath(name).is_relative_to(entry) for entry in sent), name
