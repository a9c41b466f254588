"""Settings of each driver, as read from `driver` of a hardware file."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.own_class import check_class_path
from fulmar_core.config.strict_yaml import Named
from hardware_drivers.driver_facts import DriverFacts, OwnWatchdog
from hardware_drivers.mavlink_address import place_of
from hardware_drivers.plane_settings import MavlinkPlane
from hardware_drivers.px4_settings import Px4Thrusters, Px4Wing
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


class _Wired(DriverFacts):
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
class Supply:
    """The valve that shuts off what feeds the thrusters, and nothing else: a stuck valve blows no more behind it."""

    line: str  # name of its GPIO line, or its number
    rest_s: float = 1.0  # it is shut once no valve was to be open for so long [s]

    def __post_init__(self) -> None:
        if not 0.0 <= self.rest_s < math.inf:
            raise ValueError(f"rest_s = {self.rest_s:g} must be a finite number of seconds, at least 0.")


@dataclass(frozen=True)
class GpioValves(DriverFacts):
    """Solenoid valves on lines of a GPIO chip, by libgpiod."""

    kind: Literal["gpio_valves"]
    port: str  # the chip, such as /dev/gpiochip0
    lines: tuple[str, ...]  # names or numbers, in the order of the wiring
    order: ValveOrder  # which thruster, counted from 0, each of these lines opens
    bearing: Bearing | None = None  # None: the robot floats without air
    active_low: bool = True
    min_on_s: float = 0.0  # an opened valve stays open so long, except when all must close [s]
    supply: Supply | None = None  # None: nothing shuts it off but a hand

    fits = ("thrusters",)
    emulator = "valves"
    needs = ("gpiod",)
    seen_from_outside = True
    moves_on = "VALVES"  # the chip's pins keep them as they are

    def __post_init__(self) -> None:
        every = self.every_line
        if len(set(every)) != len(every):
            raise ValueError("each valve, the bearing and the supply need a line of their own.")
        check_order(self.order, len(self.lines))
        if not 0.0 <= self.min_on_s <= 0.2:
            raise ValueError("min_on_s must be from 0 to 0.2 s.")

    @property
    def made_by(self) -> str:
        """See `DriverFacts`."""
        name = "ValveDriver" if self.bearing is None else "ThrusterDriver"
        return f"hardware_drivers.thruster_driver:{name}"

    @property
    def has_bearing(self) -> bool:
        """See `DriverFacts`."""
        return self.bearing is not None

    @property
    def every_line(self) -> tuple[str, ...]:
        """Those of the valves, then those of the bearing and of the supply, if there are any."""
        others = [part.line for part in (self.bearing, self.supply) if part]
        return (*self.lines, *others)


@dataclass(frozen=True)
class PwmValves(DriverFacts):
    """Valves that open by degrees, on channels of a PWM chip of Linux, active high."""

    kind: Literal["pwm_valves"]
    port: str  # folder of the chip, such as /sys/class/pwm/pwmchip0
    channels: tuple[int, ...]  # in the order of the wiring
    order: ValveOrder  # which thruster, counted from 0, each of these channels opens
    frequency_hz: float = 100.0  # of the pulses: well above what the valve follows

    fits = ("thrusters",)
    emulator = "pwm_valves"
    seen_from_outside = True
    made_by = "hardware_drivers.pwm_driver:PwmValveDriver"
    moves_on = "VALVES"  # the chip's channels go on as they are

    def __post_init__(self) -> None:
        if len(set(self.channels)) != len(self.channels) or min(self.channels, default=-1) < 0:
            raise ValueError("each valve needs a channel of its own, 0 or more.")
        check_order(self.order, len(self.channels))
        if not 1.0 <= self.frequency_hz <= 1e5:
            raise ValueError("frequency_hz must be from 1 to 100000 Hz.")


@dataclass(frozen=True)
class ValveTopic(DriverFacts):
    """A valve node of another stack: an array of zeros and ones, the bearing first."""

    kind: Literal["valve_topic"]
    topic: str
    order: ValveOrder  # which thruster, counted from 0, each entry after the first opens
    # Int16MultiArray (FPROS, RoboRAN-deploy-to-robot), ByteMultiArray (RANS ros/ros_node.py, and the simulated platform
    # of RoboRAN-deploy-to-robot) or UInt8MultiArray, all of std_msgs.
    message: ValveMessage = "int16"
    bearing_on_at_start: bool = True
    linger_s: float = 1.0  # it carries the platform so long after the last valve has closed for good [s]

    fits = ("thrusters",)
    emulator = "valve_topic"
    seen_from_outside = True
    has_bearing = True
    moves_on = "VALVES"  # the lab's node keeps them as they are

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

    fits = ("differential_drive",)
    emulator = "kobuki"
    made_by = "hardware_drivers.kobuki_driver:KobukiDriver"
    needs = ("serial",)
    measures = True
    stopped_by = OwnWatchdog("the firmware of the base, without base control", 0.6)


@dataclass(frozen=True)
class VelocityTopic(_Wired):
    """A base behind a node of another stack: `geometry_msgs/Twist`, or TwistStamped."""

    kind: Literal["velocity_topic"]
    topic: str
    stamped: bool
    wiring: tuple[str, ...] = AS_NAMED  # wheel that each channel turns, `-left` where backwards

    fits = ("differential_drive",)
    emulator = "velocity_topic"
    stopped_by = OwnWatchdog("kobuki_node, without a velocity; another node may have no timeout", 0.6)


@dataclass(frozen=True)
class ThrustTopic(_Wired):
    """A boat behind a node of another stack: `std_msgs/Float32MultiArray`, one share of full thrust a propeller."""

    kind: Literal["thrust_topic"]
    topic: str
    wiring: tuple[str, ...] = AS_NAMED  # propeller that each channel turns, `-left` where backwards

    fits = ("propellers",)
    emulator = "thrust_topic"
    moves_on = "PROPELLERS"  # RoboRAN's bridge to /action is not public


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

    fits = ("propellers",)
    emulator = "kingfisher"
    made_by = "hardware_drivers.kingfisher_driver:KingfisherDriver"
    needs = ("serial",)
    measures = True
    stopped_by = OwnWatchdog("the front seat of the boat, without $PYDIR", 0.5)


@dataclass(frozen=True)
class MavlinkBoat(DriverFacts):
    """A boat with ArduPilot and skid steering, by MAVLink."""

    kind: Literal["mavlink_boat"]
    port: str  # udpin:host:port (listens there), udpout:host:port, tcp:host:port, /dev/ttyACM0
    thrust: Thrust
    baud: int = 115200
    steering_channel: int = 1  # RC channels that its mixer takes steering and throttle from
    throttle_channel: int = 3
    trim_us: int = 1500
    span_us: int = 400  # of a full deflection
    silent_s: float = 1.0
    wiring: tuple[str, ...] = AS_NAMED  # propeller that each side of its mixer turns, `-left` where backwards
    arm: bool = False  # whether the driver sets MANUAL, arms and overrides RC; else it only receives
    signing_key: str = ""  # file with the key of MAVLink 2's signatures; empty: nothing is signed

    fits = ("propellers",)
    emulator = "ardupilot"
    made_by = "hardware_drivers.mavlink_driver:MavlinkDriver"
    needs = ("pymavlink",)
    measures = True
    stopped_by = OwnWatchdog("ArduPilot, without heartbeats: FS_GCS_ENABLE 1, FS_TIMEOUT", 1.5)

    def __post_init__(self) -> None:
        check_wiring(self.wiring)
        place_of(self.port)
        if self.signing_key and not self.signing_key.startswith(("/", "~/")):
            raise ValueError(f"signing_key = '{self.signing_key}' must be a whole path, from / or ~/.")
        channels = {self.steering_channel, self.throttle_channel}
        if len(channels) != 2 or not channels <= set(range(1, 9)):
            raise ValueError("steering_channel and throttle_channel must be two of 1 to 8.")
        if not 800 <= self.trim_us - self.span_us < self.trim_us + self.span_us <= 2200:
            raise ValueError("trim_us ± span_us must lie within 800 and 2200 µs.")


@dataclass(frozen=True)
class XPlane(DriverFacts):
    """An aircraft in X-Plane, by the UDP protocol of the plugin XPlaneConnect."""

    kind: Literal["xplane"]
    port: str = "udp://127.0.0.1:49009"  # of the plugin
    # Where `odom` begins, with x to the east; None: where the aircraft is at the start, with x ahead
    origin: Geodetic | None = None
    elevation: float = 0.0  # of z = 0, the water or the runway, above mean sea level [m]
    rate_hz: float = 250.0  # of questions at most; there is one for each frame of X-Plane
    silent_s: float = 0.5  # an X-Plane that sends nothing new and believable for so long is lost [s]

    fits = ("control_surfaces",)
    emulator = "xplane"
    made_by = "hardware_drivers.xplane_driver:XPlaneDriver"
    needs = ("serial",)  # beside serial ports, `ports` has those of UDP
    measures = True
    moves_on = "AIRCRAFT"
    instead = "X-Plane flies on with the last commands; its key P pauses it"

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
class OwnDriver(DriverFacts):
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

    @property
    def measures(self) -> bool:
        """See `DriverFacts`."""
        return self.odometry == "device"

    @property
    def seen_from_outside(self) -> bool:
        """See `DriverFacts`."""
        return self.odometry == "motion_capture"

    @property
    def has_bearing(self) -> bool:
        """See `DriverFacts`."""
        return self.air_bearing

    @property
    def stopped_by(self) -> OwnWatchdog | None:
        """See `DriverFacts`."""
        within_s = self.device_timeout_s
        return OwnWatchdog("the device, says its hardware file", within_s) if within_s else None


Driver = (
    GpioValves
    | PwmValves
    | ValveTopic
    | Kobuki
    | VelocityTopic
    | KingfisherNmea
    | MavlinkBoat
    | ThrustTopic
    | MavlinkPlane
    | Px4Thrusters
    | Px4Wing
    | XPlane
    | OwnDriver
)
