"""Systems of `configs/systems`: a robot, a task, a controller and a backend."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fulmar_bringup.node_spec import ENDS, LOSSES
from fulmar_core.config.errors import ConfigError, UnknownNameError, did_you_mean
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.recording import Recording
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.controllers.classical import default_gains_note
from fulmar_core.estimators.kinds import default_estimator, estimator_kind
from fulmar_core.loop.controller_settings import GUARDS
from fulmar_core.robots.basilisk_robots import BASILISK, check_basilisk
from fulmar_core.robots.jsbsim_models import JSBSIM, is_jsbsim, jsbsim_model
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import NO_AREA, check_area
from fulmar_core.tasks import Task, load_task
from fulmar_core.wires.origin import check_origin
from fulmar_core.wires.robot_name import check_robot_name
from hardware_drivers.hardware import hardware_of, hardware_path, load_hardware
from policy_server.controllers import FALLBACKS, controller_entry, usual_hz

SIMULATED = ("mujoco", "mock", JSBSIM, BASILISK)
BACKENDS = (*SIMULATED, "hardware")


@dataclass(frozen=True)
class Guards:
    """Safety functions and estimator of a system, beside what every system has."""

    estimator: str | None = (
        None  # file of configs/estimators: odometry comes from poses and inertial readings
    )
    estimators: tuple[str, ...] = ()  # more files of configs/estimators, of what is no odometry
    estop: bool = False  # an e-stop node runs, and nothing moves without it
    fallback: str | None = None  # classical controller that takes over from a policy that is refused
    trusted_keys: str | None = None  # file or folder of public keys: only bundles that one of them has signed
    max_run_time_s: float = 0.0  # 0: none [s]
    area: tuple[float, ...] = NO_AREA  # x_min, x_max, y_min, y_max, in space also z_min, z_max [m]
    guard: str = ""  # `envelope`: a backup law takes over before a robot leaves its bounds

    def __post_init__(self) -> None:
        """Refuse what has no meaning."""
        if self.fallback is not None and self.fallback not in FALLBACKS:
            raise ValueError(
                f"'fallback' = '{self.fallback}' is not known.{did_you_mean(self.fallback, FALLBACKS)}"
            )
        if self.trusted_keys is not None and not self.trusted_keys.strip():
            raise ValueError(
                "'trusted_keys' is empty: name a file or a folder, or leave it out, and any bundle runs."
            )
        if self.max_run_time_s < 0.0:
            raise ValueError(f"'max_run_time_s' = {self.max_run_time_s:g} must not be negative.")
        if self.area != NO_AREA:
            check_area(self.area)
        if self.guard not in GUARDS:
            raise ValueError(f"'guard' = '{self.guard}' is not known.{did_you_mean(self.guard, GUARDS)}")

    @property
    def files(self) -> tuple[str, ...]:
        """Every estimator's file; that of the odometry last, which may take what the others publish."""
        return (*self.estimators, *((self.estimator,) if self.estimator else ()))


NONE = Guards()


@dataclass(frozen=True)
class OwnNode:
    """A node of the system's own: a Python module that is run as a script, in the namespace of the robot."""

    name: str
    module: str  # such as mypackage.camera_node; for the launch file also a package and an executable
    inputs: tuple[str, ...] = ()  # topics without which it is of no use
    outputs: tuple[str, ...] = ()  # topics that it publishes
    parameters: dict[str, Any] = field(default_factory=dict)
    loss: str = ENDS  # restarts: it is started again when it ends; ends: the robot ends

    def __post_init__(self) -> None:
        """Refuse a loss that has no meaning."""
        if self.loss not in LOSSES:
            raise ValueError(f"'loss' = '{self.loss}' must be one of {', '.join(LOSSES)}.")


@dataclass(frozen=True)
class System:
    """One file of `configs/systems`."""

    title: str
    robot: str
    task: str
    controller: str
    backend: str
    control_hz: float  # [Hz]
    name: str = ""  # what the robot is called; empty: as its type
    guards: Guards = NONE
    recorder: Recording = Recording()
    nodes: tuple[OwnNode, ...] = ()  # beside plant, controller, recorder and guards
    camera: bool = False  # a node draws what the camera of a simulated robot sees
    origin: tuple[
        float, ...
    ] = ()  # where `odom` lies in `map`: x, y, deg, or with z, or six; empty: they are one

    def __post_init__(self) -> None:
        """Refuse a rate that nothing could run at, and a name that ROS cannot take."""
        if self.control_hz <= 0.0:
            raise ValueError(f"control_hz = {self.control_hz:g} must be greater than 0.")
        if self.name:
            check_robot_name(self.name)
        if self.origin:
            check_origin(self.origin)


def load_system(name: str) -> System:
    """Read `configs/systems/<name>.yaml` and check that everything it names exists.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    system = load_config(System, config_path("systems", name))
    check_names(system.robot, system.task, system.controller, system.backend)
    return system


def modules_of(
    controller: str,
    backend: str,
    *,
    guards: Guards = NONE,
    hardware: str = "",
    emulated: bool = False,
    camera: bool = False,
) -> tuple[str, ...]:
    """Modules of extras that the nodes of a controller, a backend, its guards, hardware file and camera import."""
    simulated = (
        *(("mujoco",) if backend == "mujoco" or emulated or camera else ()),
        *(JSBSIM,) * is_jsbsim(backend),
    )
    driven = load_hardware(hardware).needs if hardware else ()
    estimated = (module for file in guards.files for module in estimator_kind(file).needs)
    return (*controller_entry(controller).needs, *simulated, *driven, *estimated)


def system_of(controller: str, backend: str) -> System | None:
    """The system file for a controller on a backend, or None."""
    name = f"{backend}_{controller}"
    return load_system(name) if name in config_names("systems") else None


def check_names(
    robot: str, task: str | Task, controller: str, backend: str, hardware: str | None = None
) -> None:
    """Refuse unknown names, and controllers and backends that do not exist for a robot and a task.

    Hardware is a file that was asked for; without one the robot has to have its own.

    Raises:
        ConfigError: On the first wrong one.
    """
    the_robot, the_task = load_robot(robot), load_task(task) if isinstance(task, str) else task
    the_task.check(the_robot)
    controller_entry(controller).check(the_robot, the_task)
    if is_jsbsim(backend):
        jsbsim_model(the_robot, backend)
    elif backend == BASILISK:
        check_basilisk(the_robot)
    elif backend not in BACKENDS:
        raise UnknownNameError("backend", backend, BACKENDS)
    if backend == "hardware":
        default_hardware(robot, hardware)


def gains_note(robot: str, controller: str | None) -> str:
    """Note on a control law with default gains; empty for other controllers, or None. Raises as `gains_of`."""
    if controller is None or not controller_entry(controller).is_law:
        return ""
    return default_gains_note(load_robot(robot), controller)


def default_hardware(robot: str, asked: str | None = None) -> str:
    """Path of the hardware file, by a name of `configs/hardware` or a path; by default the robot's own.

    Raises:
        ConfigError: There is none, it has a mistake, or it is of another robot.
    """
    if asked is not None:
        found = load_hardware(asked).robot
        if found != robot:
            raise ConfigError(f"{asked} is the hardware of '{found}', and the robot is '{robot}'.")
        return str(hardware_path(asked).absolute())
    mine = hardware_of(robot)
    if not mine:
        known = ", ".join(sorted({load_hardware(name).robot for name in config_names("hardware")}))
        raise ConfigError(
            f"there is no hardware driver for '{robot}' (there is one for: {known}). "
            "Use --backend mujoco or mock, or write a driver of your own: docs/own-driver.md."
        )
    return str(hardware_path(mine[0]).absolute())


def default_control_hz(
    robot: str, task: str, controller: str, backend: str, policy: Path | None = None
) -> float:
    """Command rate of the matching system file, else the usual one [Hz]."""
    system = system_of(controller, backend)
    if system is not None and (system.robot, system.task) == (robot, task):
        return system.control_hz
    return usual_hz(controller, load_robot(robot), load_task(task), policy)


def default_guards(controller: str, backend: str, hardware: str = "") -> Guards:
    """Guards of the matching system file; where there is none, nothing in simulation, and on hardware an e-stop.

    Where the pose comes from motion capture alone, an estimator makes odometry of it.
    """
    system = system_of(controller, backend)
    if system is not None:
        return system.guards
    if backend != "hardware":
        return NONE
    device = load_hardware(hardware)
    estimator = default_estimator(load_robot(device.robot)) if device.seen_from_outside else None
    return Guards(estop=True, estimator=estimator)
