"""The checks of `fulmar doctor` in their order, for a robot, for simulation, or for both."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from fulmar_cli.diagnosis.check_result import Finding
from fulmar_cli.diagnosis.devices import check_permissions, devices_of, diagnose_hardware
from fulmar_cli.diagnosis.installation import (
    check_configuration,
    check_envelopes,
    check_extra,
    check_policies,
    check_python,
    check_renderer,
    check_tf,
)
from fulmar_cli.diagnosis.machine import (
    check_clock,
    check_disk_space,
    check_disk_speed,
    check_governor,
    check_real_time,
    check_timing,
)
from fulmar_cli.diagnosis.network import (
    check_discovery,
    check_multicast,
    check_profile,
    check_receive_buffer,
    check_round_trip,
    check_running_robots,
)
from fulmar_cli.diagnosis.sockets import check_sockets
from fulmar_ros.ros_check import domain_problem, ros_fault

PURPOSES = ("hardware", "sim")
EXTRAS_OF_A_ROBOT = ("ros", "policy", "bags")
EXTRAS_OF_A_SIMULATION = ("ros", "sim", "policy", "bags", "view")


def diagnose(purpose: str | None = None, name: str | None = None) -> list[Finding]:
    """Run every check.

    Args:
        purpose: `hardware` leaves out what only a simulation needs and checks hardware files; what a robot cannot do
            without is wrong then. `sim` leaves out what only a robot needs. By default a simulation has to work, and
            what a robot would need is advice.
        name: With `hardware`: one hardware file, instead of all.

    Raises:
        ConfigError: There is no such file, or it has a mistake.
    """
    hardware, here = purpose == "hardware", Path.cwd()
    files = diagnose_hardware(name) if hardware else []  # first: a mistake in its name needs no other check
    environment = dict(os.environ)  # as it was given: the checks of ROS add Fulmar's own settings
    fault = ros_fault(environment)
    extras = EXTRAS_OF_A_ROBOT if hardware else EXTRAS_OF_A_SIMULATION
    checks: list[Callable[[], Finding]] = [
        check_python,
        *(partial(check_extra, extra) for extra in extras if not (fault and extra == "ros")),
        check_tf,
        *(() if hardware else (check_renderer,)),
        check_configuration,
        check_policies,
        check_envelopes,
        *(() if domain_problem(environment) else (partial(check_discovery, environment, hardware=hardware),)),
        partial(check_multicast, environment),
        partial(check_profile, environment),
        check_receive_buffer,
        partial(check_sockets, environment),
        *((check_round_trip, check_running_robots) if fault is None else ()),
        partial(check_timing, hardware=hardware),
        partial(check_disk_space, here),
        partial(check_disk_speed, here),
    ]
    if purpose != "sim":
        permissions = partial(check_permissions, devices_of(), hardware=hardware)
        checks += [check_clock, check_real_time, check_governor, permissions]
    first = [Finding("ROS", "wrong", fault.found, fault.fix)] if fault else []
    return [*first, *(check() for check in checks), *files]
