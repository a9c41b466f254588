"""Node that drives a real robot: a device behind the topics of the plant node."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.publisher import Publisher

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Backend
from fulmar_ros.foreign_topics import thrust_sender, valve_sender, velocity_sender
from fulmar_ros.parameters import own_frames
from fulmar_ros.plant_node import DONE, PlantNode
from fulmar_ros.plant_settings import PlantSettings
from fulmar_ros.px4_wires import Px4Wires
from fulmar_ros.runtime import RequestExit, run_node
from hardware_drivers.devices import make_device
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.hardware import Hardware, load_hardware
from hardware_drivers.mavlink_address import place_of
from hardware_drivers.plane_settings import MavlinkPlane
from hardware_drivers.px4_driver import Px4Driver, Px4ThrusterDriver
from hardware_drivers.px4_settings import Px4, Px4Thrusters, Px4Wing
from hardware_drivers.settings import (
    UNARMED,
    MavlinkBoat,
    OwnDriver,
    ThrustTopic,
    ValveTopic,
    VelocityTopic,
)
from hardware_drivers.topic_driver import Listeners, TopicDriver, ValveTopicDriver
from hardware_drivers.valves import to_message
from hardware_drivers.wiring import channel_velocity, channels

Arming = TypeVar("Arming", bound=MavlinkPlane | Px4Thrusters | Px4Wing)


@dataclass(frozen=True)
class DriverSettings(PlantSettings):
    """ROS parameters of a driver node."""

    backend: str = "hardware"
    hardware: str = ""  # a name of configs/hardware, or a path that ends in .yaml
    port: str = ""  # takes the place of the hardware file's port
    connect_s: float = 10.0  # wait so long for the device [s]
    arm: bool = False  # arm an autopilot, as `arm: true` in the hardware file
    unattended: bool = False  # begun by a service: arm nothing, whatever file and parameters say

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lockstep or self.rate != 1.0:
            raise ValueError("a real device runs in real time: lockstep and rate have no meaning here.")
        if not self.hardware:
            raise ValueError("'hardware' names no file: give a name of configs/hardware, or a path.")
        if self.arm and self.unattended:
            raise ValueError("'arm' and 'unattended' exclude one another: a person arms, beside the robot.")

    @property
    def publishes_odometry(self) -> bool:
        """Whether odometry comes from the device, not from motion capture or another node."""
        return super().publishes_odometry and load_hardware(self.hardware).measures_odometry

    def may_arm(self, in_file: bool) -> bool:
        """Whether a device is armed, where its hardware file says `arm: true` or does not."""
        return (in_file or self.arm) and not self.unattended


class DriverNode(PlantNode):
    """The plant node with a device as its backend, and the health of that device."""

    settings: DriverSettings

    def __init__(self, request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Read the parameters, and start unless they say otherwise.

        Raises:
            FulmarError: If a parameter or a configuration file is wrong.
        """
        super().__init__(
            self._make_device, request_exit, simulated=False, settings_class=DriverSettings, cli_args=cli_args
        )

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Connect to the device."""
        outcome = super().on_configure(state)
        device = self._backend
        if outcome == DONE and isinstance(device, DriverBackend):
            self.health.more = device.health
        return outcome

    def _dismantle(self) -> None:
        super()._dismantle()
        self.health.more = dict

    def _motion_capture(self) -> None:
        """None: a real room has its own motion capture."""

    def _make_device(self, robot: Robot, settings: PlantSettings) -> Backend:
        assert isinstance(settings, DriverSettings)
        hardware = load_hardware(settings.hardware)
        if hardware.robot != robot.name:
            raise ConfigError(f"{settings.hardware} is of '{hardware.robot}', the robot is '{robot.name}'.")
        hardware = self._armed(hardware, settings)
        if isinstance(hardware.driver, (Px4Thrusters, Px4Wing)):
            return self._px4(robot, hardware.driver, settings)
        by_topic = self._by_topic(robot, hardware, settings.connect_s)
        return by_topic or make_device(robot, hardware, port=settings.port, patience_s=settings.connect_s)

    def _armed(self, hardware: Hardware, settings: DriverSettings) -> Hardware:
        """The hardware file with the parameter `arm`; logs what arming does before the first command."""
        driver = hardware.driver
        if isinstance(driver, OwnDriver) and driver.arm is not None:
            driver = replace(driver, arm=settings.may_arm(driver.arm))
            will = (
                "this driver may ARM THE DEVICE."
                if driver.arm
                else f"{UNARMED}. This driver sends no command."
            )
            self.get_logger().warning(f"{driver.kind}: {will}")
            return replace(hardware, driver=driver)
        if isinstance(driver, (Px4Thrusters, Px4Wing)):
            return replace(hardware, driver=self._may_arm("PX4", driver, settings))
        if not isinstance(driver, (MavlinkBoat, MavlinkPlane)):
            return hardware
        if isinstance(driver, MavlinkPlane):
            driver = self._may_arm(f"autopilot at {settings.port or driver.port}", driver, settings)
        else:
            driver = replace(driver, arm=settings.may_arm(driver.arm))
        if place_of(settings.port or driver.port).is_open and not driver.signing_key:
            self.get_logger().warning(
                f"autopilot at {settings.port or driver.port}: the first of any host that speaks there counts as the "
                "autopilot. Name an address that only it reaches, or a 'signing_key' (docs/security.md)."
            )
        if isinstance(driver, MavlinkPlane):
            return replace(hardware, driver=driver)
        self.get_logger().warning(
            f"autopilot at {settings.port or driver.port}: this driver will set MANUAL, ARM THE BOAT, and override RC "
            f"channels {driver.steering_channel} (steering) and {driver.throttle_channel} (throttle)."
            if driver.arm
            else f"autopilot at {settings.port or driver.port}: {UNARMED}. This driver sends no command."
        )
        return replace(hardware, driver=driver)

    def _may_arm(self, name: str, driver: Arming, settings: DriverSettings) -> Arming:
        """A driver's settings with the parameter `arm`; logs what it does then."""
        driver = replace(driver, arm=settings.may_arm(driver.arm))
        does = f"this driver {driver.arming}." if driver.arm else f"{UNARMED}. This driver sends no command."
        self.get_logger().warning(f"{name}: {does}")
        return driver

    def _px4(self, robot: Robot, driver: Px4, settings: DriverSettings) -> DriverBackend:
        """The backend of a PX4; `port` takes the place of the MAVLink address of its failsafe."""
        if settings.port:
            driver = replace(driver, failsafe=replace(driver.failsafe, mavlink=settings.port))
        wires = Px4Wires(self, driver.topics)
        made: Px4Driver
        if isinstance(driver, Px4Thrusters):
            made = Px4ThrusterDriver(robot, driver, wires, patience_s=settings.connect_s)
        else:
            from hardware_drivers.px4_wing_driver import Px4WingDriver

            made = Px4WingDriver(robot, driver, wires, patience_s=settings.connect_s)
        return backend_of(robot, made)

    def _by_topic(self, robot: Robot, hardware: Hardware, patience_s: float) -> DriverBackend | None:
        driver = hardware.driver
        if isinstance(driver, VelocityTopic):
            frame = own_frames(self, robot).base
            send_velocity, publisher = velocity_sender(
                self, driver.topic, stamped=driver.stamped, frame=frame
            )
            track = robot.actuators.track  # type: ignore[attr-defined]  # settings refuse any other

            def send_wheels(command: np.ndarray) -> None:
                speed, turn_rate = (float(value) for value in command)
                send_velocity(np.array(channel_velocity(driver.wiring, track, speed, turn_rate)))

            return backend_of(
                robot, TopicDriver(send_wheels, _listeners(driver.topic, publisher), patience_s=patience_s)
            )
        if isinstance(driver, ThrustTopic):
            send_thrust, publisher = thrust_sender(self, driver.topic)

            def send_shares(command: np.ndarray) -> None:
                send_thrust(np.array(channels(driver.wiring, *(float(s) for s in command))))

            return backend_of(
                robot, TopicDriver(send_shares, _listeners(driver.topic, publisher), patience_s=patience_s)
            )
        if isinstance(driver, ValveTopic):
            publish, publisher = valve_sender(self, driver.topic, driver.message)

            def send(valves: np.ndarray, bearing: bool) -> None:
                publish(to_message(valves, bearing=bearing, order=driver.order))

            valves = ValveTopicDriver(
                send,
                _listeners(driver.topic, publisher),
                count=len(robot.actuators.names),
                bearing_on=driver.bearing_on_at_start,
                linger_s=driver.linger_s,
                patience_s=patience_s,
            )
            return backend_of(robot, valves)
        return None


def _listeners(topic: str, publisher: Publisher) -> Listeners:
    return Listeners(topic, publisher.get_subscription_count)


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(DriverNode))


if __name__ == "__main__":
    main()
