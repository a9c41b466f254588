"""A driver of the user's own class: loading, wiring, and checks of its interface."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from fulmar_core.config.errors import ConfigError, DeviceError, FulmarError, did_you_mean, shortened
from fulmar_core.config.own_class import construct, load_class, one_line
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.table import SENSORS, sensor_kind
from fulmar_core.wires.reading import Reading
from hardware_drivers.driver import MEMBERS, Answering, DeviceDriver
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.feedback import Report
from hardware_drivers.settings import UNARMED, Driver, OwnDriver
from hardware_drivers.wiring import channel_velocity, channels

T = TypeVar("T")
BEARING_MEMBERS = ("bearing_on", "set_bearing")
ROLE = "driver"  # in messages


def check_own_driver(driver: Driver) -> None:
    """Import the class of a user's own driver; nothing for a shipped one.

    Raises:
        ConfigError: The class is not there, lacks a method, or has a bearing that its hardware file does not name.
    """
    if isinstance(driver, OwnDriver):
        _driver_class(driver)


def make_own_driver(robot: Robot, settings: OwnDriver, *, patience_s: float) -> DriverBackend:
    """Build a user's own driver.

    Args:
        robot: The robot.
        settings: What the hardware file says of it.
        patience_s: Wait so long for the device [s].

    Raises:
        ConfigError: As in `check_own_driver`; or the constructor raised.
        DeviceError: The device is not there, says the class.
    """
    cls = _driver_class(settings)
    call = f"{cls.__name__}(robot, settings, patience_s={patience_s:g})"
    driver = construct(cls, call, ROLE, robot, settings, patience_s=patience_s)
    wired = _FloatingDriver if settings.air_bearing else _WiredDriver
    return backend_of(robot, wired(robot, settings, driver))


def _driver_class(settings: OwnDriver) -> type[Any]:
    wanted = (*MEMBERS, *BEARING_MEMBERS) if settings.air_bearing else MEMBERS
    cls = load_class(settings.kind, members=wanted, what=ROLE)
    if not settings.air_bearing and all(hasattr(cls, member) for member in BEARING_MEMBERS):
        raise ConfigError(
            f"{ROLE} '{settings.kind}' switches an air bearing: write air_bearing: true into its hardware file, so "
            "that controllers wait for the air."
        )
    return cls


class _WiredDriver(DeviceDriver):
    """Permutes commands to the order of the wires; turns exceptions of the user's class into one line."""

    def __init__(self, robot: Robot, settings: OwnDriver, driver: Any) -> None:
        self._name, self._module = settings.kind, type(driver).__module__
        self._driver, self._count = driver, len(robot.actuators.names)
        self._specs = robot.sensors.specs
        self._safe, self._unarmed = robot.actuators.safe_command, settings.arm is False
        self._to_wires = _matrix(robot, settings)
        self._from_wires = np.linalg.inv(self._to_wires)
        self._as_named = bool((self._to_wires == np.eye(self._count)).all())

    def begin(self, x: float, y: float, heading: float) -> None:
        self._call("begin", lambda: self._driver.begin(x, y, heading))

    def write(self, command: np.ndarray) -> np.ndarray:
        if self._unarmed:
            return self._safe
        # A copy: the user's class must not change the guard's array.
        sent = command.copy() if self._as_named else self._to_wires @ command
        applied = self._call("write", lambda: self._driver.write(sent))
        if applied is None:
            return command
        values = self._call("write", lambda: np.array(applied, dtype=float))
        if values.shape != (self._count,) or not np.isfinite(values).all():
            found = shortened(str(values.tolist()))
            raise self._wrong(
                "write", f"returned {found}, which must be None or {self._count} finite numbers"
            )
        return values if self._as_named else self._from_wires @ values

    def read(self) -> Report | None:
        report = self._call("read", self._driver.read)
        if report is not None and not isinstance(report, Report):
            raise self._wrong("read", f"returned {type(report).__name__}, which must be a Report or None")
        for name, reading in report.others.items() if report else ():
            if problem := _problem_of(name, reading, self._specs):
                raise self._wrong("read", f"returned a Report whose '{shortened(str(name))}' {problem}")
        return report

    def health(self) -> dict[str, str]:
        unarmed = {"warning": UNARMED} if self._unarmed else {}
        try:
            found = self._call("health", self._driver.health)
            if not isinstance(found, Mapping):
                raise self._wrong("health", f"returned {type(found).__name__}, which must be a mapping")
            return {str(name): str(value) for name, value in found.items()} | unarmed
        except FulmarError as error:
            return {"warning": str(error)}

    def refusal(self) -> str:
        if self._unarmed or not isinstance(self._driver, Answering):
            return ""
        return " ".join(str(self._call("refusal", self._driver.refusal) or "").split())

    def close(self) -> None:
        self._call("close", self._driver.close)

    def _call(self, method: str, call: Callable[[], T]) -> T:
        try:
            return call()
        except FulmarError:
            raise
        except (Exception, SystemExit) as error:
            raise self._wrong(method, f"raised {one_line(error, self._module)}") from error

    def _wrong(self, method: str, what: str) -> DeviceError:
        return DeviceError(f"{ROLE} '{self._name}': {method} {what}.")


class _FloatingDriver(_WiredDriver):
    """With an air bearing, which counts as off where the class raises."""

    @property
    def bearing_on(self) -> bool:
        try:
            return self._call("bearing_on", lambda: bool(self._driver.bearing_on))
        except FulmarError:
            return False

    def set_bearing(self, on: bool) -> str:
        try:
            return str(self._call("set_bearing", lambda: self._driver.set_bearing(on)) or "")
        except FulmarError as error:
            return str(error)


def _problem_of(name: str, reading: Any, specs: Mapping[str, Any]) -> str:
    """Why a reading cannot be published, to go on after the sensor's name; empty where it can."""
    if name not in SENSORS and name not in specs:
        return f"is no sensor.{did_you_mean(str(name), {**SENSORS, **specs})}"
    if name not in specs:
        return f"is no sensor of this robot: add '{name}:' below 'sensors:' in the robot's YAML"
    if not isinstance(reading, Reading):
        return f"is {type(reading).__name__}, which must be a Reading"
    message = sensor_kind(name, specs[name]).message
    assert message is not None  # only the odometry has none, which is a field of the report
    try:
        values = message.write(reading, specs[name])
        if not all(np.isfinite(value).all() for value in values if not isinstance(value, str | list)):
            return "holds a value that is not finite"
    except Exception as error:  # noqa: BLE001 - a value of the user's class may be anything
        return " ".join(f"cannot be published: {type(error).__name__}: {error}".split())
    return ""


def _matrix(robot: Robot, settings: OwnDriver) -> np.ndarray:
    """What a command is multiplied with to give the values of the channels, shape (n, n)."""
    unit = np.eye(len(robot.actuators.names))
    if settings.order:
        return unit[list(settings.order)]
    if robot.actuators.takes_velocity:
        track = robot.actuated_by(DifferentialDrive).track
        return np.array([channel_velocity(settings.wiring, track, *one) for one in unit]).T
    if len(unit) == len(settings.wiring):
        return np.array([channels(settings.wiring, *one) for one in unit]).T
    return unit
