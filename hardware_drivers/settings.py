"""Hardware of a robot, as read from `configs/hardware/*.yaml`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from fulmar_core.actuators.family import Actuators
from fulmar_core.config import Named, load_config
from fulmar_core.errors import ConfigError
from fulmar_core.own_class import check_class_path
from fulmar_core.paths import config_names, config_path
from fulmar_core.robot import Robot, load_robot
from fulmar_core.spatial import SpatialState
from hardware_drivers.valves import VALVE_ORDERS
from hardware_drivers.wiring import AS_NAMED, check_wiring

ValveMessage = Literal["int16", "byte", "uint8"]
ValveOrder = Annotated[tuple[int, ...], Named(VALVE_ORDERS)]  # a list, or the name of one

# A launcher kills a process 5 s after asking it to end, and closing takes longer than the lingering.
LONGEST_LINGER_S = 2.0
UNARMED = "not armed: arm: true or --arm"  # warning of a device that must not be armed


def check_linger(linger_s: float) -> None:
    """Reject negative times, and those that a launcher would not wait for; raises ValueError."""
    if not 0.0 <= linger_s <= LONGEST_LINGER_S:
        raise ValueError(f"linger_s = {linger_s:g} must be from 0 to {LONGEST_LINGER_S:g} s.")


def check_order(order: tuple[int, ...], count: int) -> None:
    """Reject orders that do not name each of `count` thrusters once; raises ValueError."""
    if sorted(order) != list(range(count)):
        raise ValueError(f"'order' must hold each of 0 to {count - 1} once.")


class _Wired:
    """Settings with a wiring of two sides."""

    wiring: tuple[str, ...]

    def __post_init__(self) -> None:
        check_wiring(self.wiring)


@dataclass(frozen=True)
class Bearing:
    """The valve that feeds the air bearing."""

    line: str  # name of its GPIO line, or its number
    on_at_start: bool = True  # when the driver starts; else the service `air_bearing/enable` does it
    linger_s: float = 1.0  # it carries the platform so long after the last valve has closed for good [s]
    idle_off_s: float = (
        0.0  # it is switched off after so long without an open valve, to save air; 0: never [s]
    )

    def __post_init__(self) -> None:
        check_linger(self.linger_s)
        if not self.idle_off_s >= 0.0:
            raise ValueError("idle_off_s must not be negative.")


@dataclass(frozen=True)
class GpioValves:
    """Solenoid valves on lines of a GPIO chip, by libgpiod."""

    kind: Literal["gpio_valves"]
    port: str  # the chip, such as /dev/gpiochip0
    lines: tuple[str, ...]  # names or numbers, in the order of the wiring
    order: ValveOrder  # which thruster, counted from 0, each of these lines opens
    bearing: Bearing | None = None  # None: the robot floats without air
    active_low: bool = True
    min_on_s: float = 0.0  # an opened valve stays open so long, except when all must close [s]

    def __post_init__(self) -> None:
        every = self.every_line
        if len(set(every)) != len(every):
            raise ValueError("each valve and the bearing need a line of their own.")
        check_order(self.order, len(self.lines))
        if not 0.0 <= self.min_on_s <= 0.2:
            raise ValueError("min_on_s must be from 0 to 0.2 s.")

    @property
    def every_line(self) -> tuple[str, ...]:
        """Those of the valves, then that of the bearing, if there is one."""
        return (*self.lines, *([self.bearing.line] if self.bearing else []))


@dataclass(frozen=True)
class ValveTopic:
    """A valve node of another stack: an array of zeros and ones, the bearing first."""

    kind: Literal["valve_topic"]
    topic: str
    order: ValveOrder  # which thruster, counted from 0, each entry after the first opens
    # Int16MultiArray (FPROS, RoboRAN-deploy-to-robot), ByteMultiArray (RANS ros/ros_node.py, and the simulated platform
    # of RoboRAN-deploy-to-robot) or UInt8MultiArray, all of std_msgs.
    message: ValveMessage = "int16"
    bearing_on_at_start: bool = True
    linger_s: float = 1.0  # it carries the platform so long after the last valve has closed for good [s]

    def __post_init__(self) -> None:
        check_linger(self.linger_s)
        check_order(self.order, len(self.order))


@dataclass(frozen=True)
class Kobuki(_Wired):
    """The base of a Turtlebot2, by its serial protocol."""

    kind: Literal["kobuki"]
    port: str  # serial port
    baud: int = 115200
    silent_s: float = 0.3  # a base that reports nothing for so long is gone [s]
    wiring: tuple[str, ...] = AS_NAMED  # wheel that each channel turns, `-left` where backwards


@dataclass(frozen=True)
class VelocityTopic(_Wired):
    """A base behind a node of another stack: `geometry_msgs/Twist`, or TwistStamped."""

    kind: Literal["velocity_topic"]
    topic: str
    stamped: bool
    wiring: tuple[str, ...] = AS_NAMED  # wheel that each channel turns, `-left` where backwards


@dataclass(frozen=True)
class ThrustTopic(_Wired):
    """A boat behind a node of another stack: `std_msgs/Float32MultiArray`, one share of full thrust a propeller."""

    kind: Literal["thrust_topic"]
    topic: str
    wiring: tuple[str, ...] = AS_NAMED  # propeller that each channel turns, `-left` where backwards


@dataclass(frozen=True)
class Geodetic:
    """A place on Earth (WGS 84)."""

    latitude: float  # [deg]
    longitude: float  # [deg]

    def __post_init__(self) -> None:
        if not (abs(self.latitude) < 89.0 and abs(self.longitude) <= 180.0):
            raise ValueError("latitude must be within 89° and longitude within 180°.")


@dataclass(frozen=True)
class Thrust:
    """What a propeller gives at full command; asymmetric on most boats."""

    ahead: float  # [N]
    astern: float  # [N]

    def __post_init__(self) -> None:
        if min(self.ahead, self.astern) <= 0.0:
            raise ValueError("'ahead' and 'astern' must be greater than 0.")


@dataclass(frozen=True)
class KingfisherNmea(_Wired):
    """Kingfisher, Heron or M200, by the NMEA sentences of its front seat."""

    kind: Literal["kingfisher_nmea"]
    port: str  # serial port, or tcp://host:port
    thrust: Thrust
    origin: Geodetic | None = None  # where `odom` begins; None: at the first fix
    baud: int = 115200
    silent_s: float = 1.0  # a boat that reports nothing for so long is gone [s]
    wiring: tuple[str, ...] = AS_NAMED  # propeller that each channel turns, `-left` where backwards


@dataclass(frozen=True)
class MavlinkBoat:
    """A boat with ArduPilot and skid steering, by MAVLink."""

    kind: Literal["mavlink_boat"]
    port: str  # as pymavlink names it: udpin:0.0.0.0:14550, tcp:host:5760, /dev/ttyACM0
    thrust: Thrust
    baud: int = 115200
    steering_channel: int = 1  # RC channels that its mixer takes steering and throttle from
    throttle_channel: int = 3
    trim_us: int = 1500
    span_us: int = 400  # of a full deflection
    silent_s: float = 1.0
    wiring: tuple[str, ...] = AS_NAMED  # propeller that each side of its mixer turns, `-left` where backwards
    arm: bool = False  # whether the driver sets MANUAL, arms and overrides RC; else it only receives

    def __post_init__(self) -> None:
        check_wiring(self.wiring)
        channels = {self.steering_channel, self.throttle_channel}
        if len(channels) != 2 or not channels <= set(range(1, 9)):
            raise ValueError("steering_channel and throttle_channel must be two of 1 to 8.")
        if not 800 <= self.trim_us - self.span_us < self.trim_us + self.span_us <= 2200:
            raise ValueError("trim_us ± span_us must lie within 800 and 2200 µs.")


@dataclass(frozen=True)
class XPlane:
    """An aircraft in X-Plane, by the UDP protocol of the plugin XPlaneConnect."""

    kind: Literal["xplane"]
    port: str = "udp://127.0.0.1:49009"  # of the plugin
    # Where `odom` begins, with x to the east; None: where the aircraft is at the start, with x ahead
    origin: Geodetic | None = None
    elevation: float = 0.0  # of z = 0, the water or the runway, above mean sea level [m]
    rate_hz: float = 250.0  # of questions at most; there is one for each frame of X-Plane
    silent_s: float = 0.5  # an X-Plane that sends nothing new and believable for so long is lost [s]

    def __post_init__(self) -> None:
        if not self.port.startswith("udp://"):
            raise ValueError(
                f"port = '{self.port}' must be udp://host:port; the plugin listens at port 49009."
            )
        if not (1.0 <= self.rate_hz <= 1000.0 and 0.05 <= self.silent_s <= 10.0):
            raise ValueError("rate_hz must be from 1 to 1000 Hz and silent_s from 0.05 to 10 s.")
        if not -500.0 <= self.elevation <= 9000.0:
            raise ValueError("elevation must be from -500 to 9000 m.")


@dataclass(frozen=True)
class OwnDriver:
    """A class of the user's own, by its dotted path; see `hardware_drivers.driver.DeviceDriver`."""

    kind: str  # mypackage.mymodule:MyDriver, found in the current folder, then on PYTHONPATH
    # Serial port, tcp://host:port, udp://host:port or GPIO chip; empty: the class opens what it needs.
    port: str = ""
    baud: int = 115200  # of a serial port
    order: ValveOrder = ()  # of valves: which thruster, counted from 0, each channel opens; empty: 0, 1, 2, ...
    wiring: tuple[str, ...] = AS_NAMED  # wheel or propeller that each channel turns, `-left` where backwards
    # Source of odometry: motion capture, the device itself by `read`, or another node that publishes `odom`.
    odometry: Literal["motion_capture", "device", "other_node"] = "motion_capture"
    air_bearing: bool = False  # the class has `bearing_on` and `set_bearing` of `AirBearing`
    # Whether the device may be armed: without it, or --arm, nothing is written. None: it has nothing to arm.
    arm: bool | None = None
    device_timeout_s: float = 0.0  # after the last command, when the device itself stops; 0: it does not [s]
    options: dict[str, Any] = field(default_factory=dict)  # for the class

    def __post_init__(self) -> None:
        try:
            check_class_path(self.kind)
        except ConfigError as error:
            raise ValueError(str(error)) from error
        check_wiring(self.wiring)
        check_order(self.order, len(self.order))
        if not self.device_timeout_s >= 0.0:
            raise ValueError("device_timeout_s must not be negative.")
        if self.baud <= 0:
            raise ValueError(f"baud = {self.baud} must be greater than 0.")


Driver = (
    GpioValves
    | ValveTopic
    | Kobuki
    | VelocityTopic
    | KingfisherNmea
    | MavlinkBoat
    | ThrustTopic
    | XPlane
    | OwnDriver
)
NEEDS: dict[type, tuple[str, ...]] = {  # modules of the extra `hardware`
    GpioValves: ("gpiod",),
    Kobuki: ("serial",),
    KingfisherNmea: ("serial",),
    MavlinkBoat: ("pymavlink",),
    XPlane: ("serial",),  # beside serial ports, `ports` has those of UDP
}
TOPIC_DRIVERS = (ValveTopic, VelocityTopic, ThrustTopic)
SEEN_FROM_OUTSIDE = (GpioValves, ValveTopic)  # drivers of robots that only motion capture localises
MEASURES = (Kobuki, KingfisherNmea, MavlinkBoat, XPlane)  # drivers whose device measures odometry
FITS = {
    "thrusters": (GpioValves, ValveTopic),
    "differential_drive": (Kobuki, VelocityTopic),
    "propellers": (KingfisherNmea, MavlinkBoat, ThrustTopic),
    "control_surfaces": (XPlane,),
}


@dataclass(frozen=True)
class Hardware:
    """One file of `configs/hardware`."""

    title: str
    robot: str
    driver: Driver

    @property
    def needs(self) -> tuple[str, ...]:
        """Modules that its driver imports, from the extra `hardware`."""
        return NEEDS.get(type(self.driver), ())

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
        if isinstance(self.driver, OwnDriver):
            return self.driver.odometry == "device"
        return isinstance(self.driver, MEASURES)

    @property
    def has_bearing(self) -> bool:
        """Whether the driver switches an air bearing, without which nothing may move."""
        if isinstance(self.driver, OwnDriver):
            return self.driver.air_bearing
        if isinstance(self.driver, GpioValves):
            return self.driver.bearing is not None
        return isinstance(self.driver, ValveTopic)

    @property
    def seen_from_outside(self) -> bool:
        """Whether only motion capture localises the robot."""
        if isinstance(self.driver, OwnDriver):
            return self.driver.odometry == "motion_capture"
        return isinstance(self.driver, SEEN_FROM_OUTSIDE)


def hardware_path(name: str) -> Path:
    """The file that a name of `configs/hardware`, or a path that ends in `.yaml`, means.

    Raises:
        UnknownNameError: If there is no file of that name.
    """
    return Path(name) if name.endswith(".yaml") else config_path("hardware", name)


def load_hardware(name: str) -> Hardware:
    """Read a hardware file and check that it fits its robot; `name` is as of `hardware_path`.

    Raises:
        ConfigError: Unknown name, a mistake in the file, or a driver that does not fit the robot's actuators.
    """
    path = hardware_path(name)
    hardware = load_config(Hardware, path)
    robot = load_robot(hardware.robot)
    actuators = robot.actuators
    if isinstance(hardware.driver, OwnDriver):
        hardware = replace(hardware, driver=_with_order(hardware.driver, actuators))
    elif not isinstance(hardware.driver, FITS.get(actuators.kind, ())):
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
    if isinstance(driver, GpioValves) and len(driver.lines) != count:
        return f"'lines' has {len(driver.lines)} entries, the robot has {count} thrusters."
    return ""
