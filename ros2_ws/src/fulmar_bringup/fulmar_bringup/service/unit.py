"""The unit of a system: a file of systemd that runs `fulmar up SYSTEM --service`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from fulmar_core.config.process import RT_LIMIT
from fulmar_core.config.written_text import LINE, NAME, USER, check_written
from fulmar_core.robots.actuators.refuge import LANDS_S

MARK = "# Written by `fulmar service install`; `fulmar service remove` removes it."
# Of the environment of the one who installs: where nodes find each other, and own files.
PASSED = (
    "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS", "RMW_IMPLEMENTATION",
    "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE",
    "ROS_SECURITY_ENABLE", "ROS_SECURITY_STRATEGY", "ROS_SECURITY_KEYSTORE", "FULMAR_CONFIGS", "FULMAR_CALIBRATION",
)  # fmt: skip
# The same where ROS is sourced, which sets the first; ROS from wheels finds its own places.
OF_SOURCED_ROS = ("ROS_DISTRO", "ROS_VERSION", "AMENT_PREFIX_PATH", "PYTHONPATH", "LD_LIBRARY_PATH")
STATE = "fulmar"  # folder below /var/lib, the working folder; bags lie in its `runs`
# Our values. A device may appear minutes after a boot; after twenty failures the robot stays down until a person looks.
RESTART_S, FAILURES, WITHIN_S = 10, 20, 1800
# Valves close within a second; bags on a slow disk take longer.
STOP_S = 15

UNIT = """\
{mark}
[Unit]
Description=Fulmar system {system}
After=network.target time-sync.target
StartLimitIntervalSec={within}
StartLimitBurst={failures}

[Service]
Type=exec
User={user}
{groups}{environment}# Bags and logs are read by this user alone.
UMask=0077
StateDirectory={state}
StateDirectoryMode=0700
# rclpy writes a log file for each node, which the journal has too: these go with the service.
RuntimeDirectory=fulmar-{name}
RuntimeDirectoryMode=0700
Environment=ROS_LOG_DIR=/run/fulmar-{name}
WorkingDirectory=/var/lib/{state}
ExecStart={command}
# Every node brings its device to the safe state on SIGTERM, also where the process that started it has died.
KillMode=control-group
KillSignal=SIGTERM
TimeoutStopSec={stop}
# After a restart the e-stop is pressed. A mistake in a file (exit code 2) needs a person.
Restart=on-failure
RestartSec={restart}
RestartPreventExitStatus=2
SuccessExitStatus=SIGTERM
LimitRTPRIO={rtprio}
LimitMEMLOCK=infinity
StandardOutput=journal
StandardError=journal
SyslogIdentifier=fulmar-{name}
# /dev, /dev/shm and /tmp stay: devices, semaphores, and the record of used ROS domains.
NoNewPrivileges=yes
ProtectSystem=strict
ReadWritePaths=/tmp /dev/shm
ProtectHome=read-only
ProtectKernelTunables=yes
ProtectKernelModules=yes
RestrictSUIDSGID=yes
LockPersonality=yes

[Install]
WantedBy=multi-user.target
"""


@dataclass(frozen=True)
class Service:
    """What a unit is made of."""

    name: str  # of the unit, without `fulmar-` and `.service`
    system: str
    command: tuple[str, ...]  # program, with its whole path, and arguments
    user: str
    groups: tuple[str, ...] = ()  # beside the user's own
    variables: Mapping[str, str] = field(
        default_factory=dict
    )  # of the environment; they replace what is passed
    lands: bool = False  # whether the robot flies, and is brought to the ground when the service stops


def unit_text(service: Service, environment: Mapping[str, str]) -> str:
    """The unit as a file.

    Args:
        service: What runs.
        environment: Of the one who installs; `PASSED` is taken from it, and paths of ROS where it is sourced.

    Raises:
        ConfigError: A text would mean more than itself in a unit, or is no name; with its field.
    """
    check_written("name", service.name, NAME)
    check_written("system", service.system, NAME)
    check_written("user", service.user, USER)
    for group in service.groups:
        check_written("group", group, NAME)
    for word in service.command:
        check_written("command", word, LINE)
    passed = variables_of(service, environment)
    return UNIT.format(
        mark=MARK,
        system=service.system,
        within=WITHIN_S,
        failures=FAILURES,
        user=service.user,
        groups=f"SupplementaryGroups={' '.join(service.groups)}\n" if service.groups else "",
        environment="".join(f"Environment={_quoted(f'{name}={value}')}\n" for name, value in passed.items()),
        state=STATE,
        command=" ".join(_quoted(word.replace("$", "$$")) for word in service.command),
        stop=STOP_S + (round(LANDS_S) if service.lands else 0),
        restart=RESTART_S,
        rtprio=RT_LIMIT,
        name=service.name,
    )


def variables_of(service: Service, environment: Mapping[str, str]) -> dict[str, str]:
    """The environment of a unit, beside what systemd gives; arguments and errors as in `unit_text`."""
    names = (*PASSED, *OF_SOURCED_ROS) if environment.get(OF_SOURCED_ROS[0]) else PASSED
    passed = {name: environment[name] for name in names if environment.get(name)} | dict(service.variables)
    return {name: check_written(name, value, LINE) for name, value in passed.items()}


def command_of(text: str) -> tuple[str, ...]:
    """The words of ExecStart in the text of a unit; the inverse of `unit_text`."""
    (line,) = re.findall(r"^ExecStart=(.*)$", text, re.MULTILINE)
    words = re.findall(r'"(?:[^"\\]|\\.)*"|\S+', line)
    return tuple(_unquoted(word).replace("$$", "$") for word in words)


def system_of_unit(text: str) -> str:
    """The system that a unit runs, by its text."""
    (system,) = re.findall(r"^Description=Fulmar system (.*)$", text, re.MULTILINE)
    return str(system)


def _quoted(word: str) -> str:
    """A word as systemd reads it (systemd.syntax, "Quoting"): % would be replaced, and $ in commands alone."""
    word = word.replace("%", "%%")
    if re.fullmatch(r"[\w@%+=:,./$-]+", word):
        return word
    return '"' + word.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _unquoted(word: str) -> str:
    if word.startswith('"'):
        word = re.sub(r"\\(.)", r"\1", word[1:-1])
    return word.replace("%%", "%")


def known_groups(wanted: Iterable[str], known: Iterable[str]) -> tuple[str, ...]:
    """Those groups that this computer has: systemd starts no unit with an unknown one."""
    return tuple(dict.fromkeys(name for name in wanted if name in set(known)))
