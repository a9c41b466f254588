"""Hardware of a robot, as read from `configs/hardware/*.yaml`, and whether its driver fits the robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.spatial import SpatialState
from hardware_drivers.settings import (
    Driver,
    GpioValves,
    OwnDriver,
    ThrustTopic,
    ValveTopic,
    VelocityTopic,
)
from hardware_drivers.wiring import AS_NAMED

TOPIC_DRIVERS = (ValveTopic, VelocityTopic, ThrustTopic)


@dataclass(frozen=True)
class Hardware:
    """One file of `configs/hardware`."""

    title: str
    robot: str
    driver: Driver

    @property
    def needs(self) -> tuple[str, ...]:
        """Modules that its driver imports, from the extra `hardware`."""
        return self.driver.needs

    @property
    def arms(self) -> bool:
        """Whether the device has to be armed, which the user must allow."""
        return getattr(self.driver, "arm", None) is not None

    @property
    def opens_valves(self) -> bool:
        """Whether its wires open valves, which are audible without any motion."""
        return load_robot(self.robot).actuators.kind == "thrusters"

    @property
    def measures_odometry(self) -> bool:
        """Whether the device measures odometry; if not, motion capture or another node does."""
        return self.driver.measures

    @property
    def has_bearing(self) -> bool:
        """Whether the driver switches an air bearing, without which nothing may move."""
        return self.driver.has_bearing

    @property
    def seen_from_outside(self) -> bool:
        """Whether only motion capture localises the robot."""
        return self.driver.seen_from_outside


def hardware_path(name: str) -> Path:
    """The file that a name of `configs/hardware`, or a path that ends in `.yaml`, means.

    Raises:
        UnknownNameError: If there is no file of that name.
    """
    return Path(name) if name.endswith(".yaml") else config_path("hardware", name)


def load_hardware(name: str) -> Hardware:
    """Read a hardware file and check that it fits its robot; `name` is as in `hardware_path`.

    Raises:
        ConfigError: Unknown name, a mistake in the file, or a driver that does not fit the robot's actuators.
    """
    path = hardware_path(name)
    hardware = load_config(Hardware, path)
    robot = load_robot(hardware.robot)
    actuators = robot.actuators
    if isinstance(hardware.driver, OwnDriver):
        hardware = replace(hardware, driver=_with_order(hardware.driver, actuators))
    elif actuators.kind not in hardware.driver.fits:
        raise ConfigError(
            f"{path}: driver '{hardware.driver.kind}' cannot move '{hardware.robot}', which has {actuators.kind}."
        )
    problem = _count_problem(hardware.driver, actuators) or _bearing_problem(hardware.driver, robot)
    if problem:
        raise ConfigError(f"{path}: {problem}")
    return hardware


def hardware_of(robot: str) -> list[str]:
    """Names of the hardware files of a robot; the first is its own.

    Raises:
        ConfigError: A mistake in one of the files.
    """
    mine = [name for name in config_names("hardware") if load_hardware(name).robot == robot]
    return sorted(
        mine, key=lambda name: (isinstance(load_hardware(name).driver, TOPIC_DRIVERS), name != robot, name)
    )


def _with_order(driver: OwnDriver, actuators: Actuators) -> OwnDriver:
    """The driver of valves with an order, where the file has none."""
    if actuators.kind != "thrusters" or driver.order:
        return driver
    return replace(driver, order=tuple(range(len(actuators.names))))


def _bearing_problem(driver: Driver, robot: Robot) -> str:
    """Why the driver does not fit what carries the robot; empty if it does."""
    if isinstance(driver, GpioValves) and driver.bearing is None and robot.air_bearing:
        return f"'{robot.name}' floats on an air bearing: give 'driver' the line of its valve, 'bearing'."
    in_space = robot.state_type is SpatialState
    if in_space and (isinstance(driver, ValveTopic) or getattr(driver, "bearing", None) is not None):
        return (
            f"'{robot.name}' moves in space, and this driver switches an air bearing. Use driver 'gpio_valves' without "
            "'bearing', or one of your own: docs/own-driver.md."
        )
    return ""


def _count_problem(driver: Driver, actuators: Actuators) -> str:
    count = len(actuators.names)
    order = getattr(driver, "order", None)
    if isinstance(driver, OwnDriver) and actuators.kind != "thrusters":
        return "'order' is for thrusters; wheels and propellers have a 'wiring'." if order else ""
    if isinstance(driver, OwnDriver) and driver.wiring != AS_NAMED:
        return "'wiring' is for wheels and propellers; thrusters have an 'order'."
    if order is not None and len(order) != count:
        return f"'order' has {len(order)} entries, the robot has {count} thrusters."
    if (
        isinstance(driver, (GpioValves, ValveTopic))
        and actuators.kind == "thrusters"
        and not actuators.binary
    ):
        return f"driver '{driver.kind}' only opens and closes, and these valves open by degrees. Use 'pwm_valves'."
    if isinstance(driver, GpioValves) and len(driver.lines) != count:
        return f"'lines' has {len(driver.lines)} entries, the robot has {count} thrusters."
    return ""
