"""What `fulmar service install` writes: checked before anything is."""

from __future__ import annotations

import grp
import os
import pwd
import shutil
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

from fulmar_bringup.completion import completed
from fulmar_bringup.console import warn
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.service.device_rules import device_groups, device_rules
from fulmar_bringup.service.installation import (
    Files,
    systemctl,
    systemd_runs,
    texts_of,
    write_files,
)
from fulmar_bringup.service.own_places import module_path, whole_paths
from fulmar_bringup.service.trial import try_once
from fulmar_bringup.service.unit import Service, known_groups, unit_text, variables_of
from fulmar_bringup.system_plan import system_plan
from fulmar_cli.installation.extras import check_plan
from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.config.own_class import is_own
from fulmar_core.config.written_text import NAME, USER, check_lines, check_written
from fulmar_core.robots.robot_file import load_robot
from hardware_drivers.hardware import load_hardware


@dataclass(frozen=True)
class Wanted:
    """Arguments of `fulmar service install`."""

    system: str
    robot: str | None
    name: str | None
    task: str | None
    controller: str | None
    backend: str | None
    hardware: str | None
    policy: Path | None
    recording: str
    user: str | None


@dataclass(frozen=True)
class PlannedService:
    """A service with its files, which are not written yet."""

    files: Files
    texts: dict[Path, str]  # content of each file
    service: Service
    variables: dict[str, str]  # of its environment

    def write(self) -> tuple[list[Path], bool]:
        """Try the service, write its files, and start it where systemd runs; returns them, and whether it was started.

        Raises:
            ConfigError: It would not start.
        """
        try_once(self.service, self.variables, as_user=self.files.root == Path("/"))
        written = write_files(self.files, self.texts)
        if not systemd_runs(self.files.root):
            return written, False
        if self.files.rules in self.texts and shutil.which("udevadm"):
            for step in (("control", "--reload"), ("trigger",)):
                subprocess.run(["udevadm", *step], check=False)
        systemctl("daemon-reload")
        systemctl("restart", self.files.unit.name)
        return written, True


def plan_service(wanted: Wanted, root: Path, *, dry_run: bool) -> PlannedService:
    """Check a service, and make its texts.

    Args:
        wanted: What is asked for.
        root: Folder that stands for /.
        dry_run: Whether nothing is to be written, which needs no right to.

    Raises:
        ConfigError: A name or a file is wrong, an extra is missing, the user is root or unknown, or a text does not fit
            into a unit or a rule.
    """
    check_written("SYSTEM", wanted.system, NAME)
    check_lines(
        {
            "--robot": wanted.robot, "--name": wanted.name, "--task": wanted.task, "--backend": wanted.backend,
            "--controller": wanted.controller, "--hardware": wanted.hardware, "--recording": wanted.recording,
            "--policy": str(wanted.policy) if wanted.policy else None,
        }.items()
    )  # fmt: skip
    hardware = wanted.hardware
    if hardware is not None and hardware.endswith(".yaml"):
        hardware = str(Path(hardware).absolute())  # the service has another working folder
    plan = system_plan(
        wanted.system, robot=wanted.robot, name=wanted.name, task=wanted.task, controller=wanted.controller,
        backend=wanted.backend,
    )  # fmt: skip
    _check_places(plan)
    policy = wanted.policy.absolute() if wanted.policy else None
    plan = replace(
        plan, record="runs/planned", policy=str(policy or ""), hardware=hardware or "",
        recording_mode=wanted.recording or "", unattended=True,
    )  # fmt: skip
    plan = checked(completed(plan))
    check_plan(plan)
    if root == Path("/") and not dry_run and os.geteuid() != 0:
        raise ConfigError(
            f"only root may write below /etc: sudo {_program()} {' '.join(sys.argv[1:])}   # or --root DIR"
        )
    rules: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    robot = load_robot(plan.robot)
    sensors = [sensor.sensor for sensor in robot.sensors.own.values()]
    chosen = (plan.controller, plan.task, *plan.guards.files, *sensors)
    own = [name for name in chosen if is_own(name)]
    own += [node.module for node in plan.nodes]
    if plan.hardware:
        file = load_hardware(plan.hardware)
        own += [file.driver.kind] if is_own(file.driver.kind) else []
        rules, groups = device_rules(file), device_groups(file)
        if root == Path("/"):
            _warn_of_absence(plan.hardware)
    user = _user(wanted.user, root)
    known = known_groups(groups, (group.gr_name for group in grp.getgrall()))
    for group in set(groups) - set(known):
        warn(
            [
                f"the group '{group}' of the rules does not exist: sudo groupadd --system {group}, then install again"
            ]
        )
    service = Service(
        f"{wanted.system}-{wanted.name}" if wanted.name else wanted.system,
        wanted.system,
        (str(_program()), "up", wanted.system, "--service", *_options(wanted, hardware, policy)),
        user,
        known,
        whole_paths(os.environ) | module_path(own, os.environ),
        lands=not robot.kind.rests,
    )
    files = Files(root, service.name)
    texts = texts_of(files, unit_text(service, os.environ), rules)
    return PlannedService(files, texts, service, variables_of(service, os.environ))


def _options(wanted: Wanted, hardware: str | None, policy: Path | None) -> list[str]:
    given = {
        "robot": wanted.robot, "name": wanted.name, "task": wanted.task, "controller": wanted.controller,
        "backend": wanted.backend, "hardware": hardware, "policy": policy, "recording": wanted.recording,
    }  # fmt: skip
    return [word for key, value in given.items() if value is not None for word in (f"--{key}", str(value))]


def _program() -> Path:
    """The command in use: the script beside this interpreter."""
    beside = Path(sys.executable).with_name("fulmar")
    found = beside if beside.exists() else shutil.which("fulmar")
    if found is None:
        raise ConfigError("the command 'fulmar' was not found beside this Python or on PATH.")
    return Path(found).absolute()


def _check_places(plan: RunPlan) -> None:
    """Refuse a path in a system file that the service, which runs in a folder of its own, does not find."""
    keys = plan.guards.trusted_keys
    if keys is not None and not Path(keys).is_absolute():
        raise ConfigError(
            f"trusted_keys = '{keys}' of the system file is relative, and a service runs in a folder of its own: write "
            f"{Path(keys).absolute()}."
        )


def _user(name: str | None, root: Path) -> str:
    """Who runs the service: never root, whose files and devices a mistake would reach."""
    chosen = name or os.environ.get("SUDO_USER") or pwd.getpwuid(os.geteuid()).pw_name
    check_written("--user" if name else "SUDO_USER", chosen, USER)
    if chosen == "root" or chosen in _names_of_root(root):
        raise ConfigError("a service does not run as root: name who runs it by --user NAME.")
    if root == Path("/"):
        try:
            pwd.getpwnam(chosen)
        except KeyError:
            raise ConfigError(
                f"there is no user '{chosen}' here. Make one: sudo useradd --create-home {chosen}"
            ) from None
    return chosen


def _names_of_root(root: Path) -> set[str]:
    """Every name with the id of root, here or in an image."""
    try:
        lines = (root / "etc/passwd").read_text(errors="replace").splitlines()
    except OSError:  # an image without users yet
        return set()
    entries = [line.split(":") for line in lines]
    return {entry[0] for entry in entries if len(entry) > 2 and entry[2] == "0"}


def _warn_of_absence(hardware: str) -> None:
    try:
        from hardware_drivers.presence import check_presence  # of an extra

        check_presence(load_hardware(hardware).driver)
    except FulmarError as error:
        warn([f"{error} The service is installed all the same, and tries again when it starts."])
