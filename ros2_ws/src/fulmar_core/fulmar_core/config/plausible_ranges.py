"""Plausible ranges of the numbers in configuration files, with the reason for each.

Ranges are wide: a mistake of unit is a factor of 57 (degrees), 100 or 1000, and a new kind of robot must still load.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any

Range = tuple[float, float]


@dataclass(frozen=True)
class Plausible:
    """Which values one key may have; 0 is not looked at where it switches something off."""

    key: str  # dotted path in the file; `*` stands for each entry of a list, a digit for one of them
    unit: str  # one of `UNITS`, or any other that has no likely mistake
    possible: Range  # a value outside is refused
    usual: Range  # a value outside is a warning
    why: str  # what the range comes from
    # The ranges are multiples of this number of the same file, which is in the key's unit.
    scale: Callable[[Any], float] | None = None  # 0: there is nothing to compare with
    distance: bool = False  # the value is a place, and its distance from the origin in the plane counts
    zero: bool = False  # whether 0 is looked at too
    # What follows from the key and from others, in its place, such as a slope of several terms; None for none.
    of: Callable[[Any], float | None] | None = None


# Units that a value may have been written in by mistake, and what one of them is in the unit of the key.
UNITS: dict[str, tuple[tuple[str, float], ...]] = {
    "m": (("mm", 1e-3), ("cm", 1e-2)),
    "kg": (("g", 1e-3),),
    "kg·m²": (("g·m²", 1e-3), ("kg·cm²", 1e-4), ("g·cm²", 1e-7), ("kg·mm²", 1e-6)),
    "N": (("mN", 1e-3), ("kN", 1e3)),
    "N·m": (("mN·m", 1e-3),),
    "rad": (("°", pi / 180.0),),
    "°": (("rad", 180.0 / pi),),
    "rad/s": (("°/s", pi / 180.0), ("rpm", pi / 30.0)),
    "°/s": (("rad/s", 180.0 / pi),),
    "1/rad": (("1/°", 180.0 / pi),),
    "1/°": (("1/rad", pi / 180.0),),
    "m²": (("cm²", 1e-4), ("mm²", 1e-6)),
    "m³": (("l", 1e-3), ("cm³", 1e-6)),
    "W": (("hp", 745.7), ("kW", 1e3)),
    "Pa": (("bar", 1e5), ("MPa", 1e6), ("kPa", 1e3)),
    "kg/s": (("g/s", 1e-3),),
    "J/(kg·K)": (("kJ/(kg·K)", 1e3),),
    "rad/s²": (("°/s²", pi / 180.0),),
    "m/s": (("mm/s", 1e-3), ("cm/s", 1e-2), ("km/h", 1.0 / 3.6)),
    "m/s²": (("mg", 9.81e-3),),
    "s": (("ms", 1e-3), ("µs", 1e-6)),
    "of 1": (("%", 1e-2),),
    "kg/m³": (("g/cm³", 1e3),),
}

MOST_ACCELERATION = 20.0  # of a robot by its own actuators: twice its weight [m/s²]
BODY = "of the body's mass and radius"


def edge_inertia(body: Any, *, upright: bool) -> float:
    """Moment of all mass at the edge of the body's circle or, about level axes, of its side view [kg·m²]."""
    return float(body.mass * (body.radius**2 + (0.0 if upright else 0.25 * body.height**2)))


def _own_inertia(axis: int, robot: Any) -> float:
    """Mass of the body for the first three axes [kg], principal moments for the others [kg·m²]."""
    return float(robot.body.mass if axis < 3 else robot.body.inertia[axis - 3])


def _floating_draught(robot: Any) -> float:
    water = robot.hydrodynamics.hydrostatics
    return float(robot.body.mass / (water.water_density * water.waterplane_area))


def outline_volume(body: Any) -> float:
    """Of the upright cylinder around the body [m³]."""
    return float(pi * body.radius**2 * body.height)


def _noise(sensor: str, part: str, unit: str, most: float, usual: float, why: str) -> tuple[Plausible, ...]:
    """Ranges of a channel's noise, bias and scale error."""
    key = f"sensors.{sensor}.{part}"
    return (
        Plausible(f"{key}.std", unit, (0.0, most), (0.0, usual), why),
        Plausible(f"{key}.bias_std", unit, (0.0, most), (0.0, usual), why),
        Plausible(f"{key}.scale_std", "of 1", (0.0, 1.0), (0.0, 0.2), "an error of scale is a few percent"),
    )


ROBOT: tuple[Plausible, ...] = (
    Plausible("body.mass", "kg", (0.02, 2e4), (0.2, 2000.0), "palm-sized robots to satellites and cars"),
    Plausible("body.radius", "m", (0.01, 30.0), (0.03, 6.0), "palm-sized robots to small aircraft"),
    Plausible("body.height", "m", (0.005, 30.0), (0.02, 6.0), "same as the radius"),
    Plausible(
        "body.inertia.2", "kg·m²", (0.01, 1.5), (0.05, 1.05), f"{BODY}: solid cylinder 0.5 m r², thin ring 1 m r²",
        scale=lambda robot: edge_inertia(robot.body, upright=True),
    ),
    *(
        Plausible(
            f"body.inertia.{axis}", "kg·m²", (0.001, 1.5), (0.01, 1.05), f"{BODY} and height",
            scale=lambda robot: edge_inertia(robot.body, upright=False),
        )
        for axis in (0, 1)
    ),
    Plausible(
        "uncertainty.center_of_mass", "m", (0.0, 1.0), (0.0, 0.5), "within the radius",
        scale=lambda robot: robot.body.radius,
    ),
    Plausible("timing.physics_dt", "s", (8e-5, 0.5), (1e-4, 0.05), "integrators of rigid bodies"),
    Plausible("timing.control_hz", "Hz", (0.25, 1e4), (0.5, 1000.0), "controllers of mobile robots"),
    Plausible(
        "actuators.thrust", "N", (1e-6, MOST_ACCELERATION), (1e-4, 5.0),
        "of the mass: one nozzle accelerates by 0.0001 to 5 m/s²", scale=lambda robot: robot.body.mass,
    ),
    Plausible(
        "actuators.nozzles.*.position", "m", (0.0, 1.3), (0.0, 1.1), "nozzles sit on the body, within its radius",
        scale=lambda robot: robot.body.radius, distance=True,
    ),
    Plausible(
        "actuators.propellers.*.position", "m", (0.0, 1.5), (0.0, 1.2), "propellers sit on the body, within its radius",
        scale=lambda robot: robot.body.radius, distance=True,
    ),
    *(
        Plausible(
            f"actuators.{part}.*.position.2", "m", (-1.0, 1.0), (-0.6, 0.6), "of the height: on the body",
            scale=lambda robot: robot.body.height,
        )
        for part in ("nozzles", "fans", "propellers")
    ),
    Plausible(
        "actuators.tank.volume", "m³", (1e-4, 0.9), (1e-3, 0.6), "of where its content is as heavy as the robot",
        scale=lambda robot: robot.body.mass * robot.actuators.tank.volume_per_kg,
    ),
    Plausible("actuators.tank.pressure", "Pa", (1.2e5, 1.5e8), (5e5, 7e7), "bottles of 10 to 700 bar"),
    Plausible("actuators.tank.regulated", "Pa", (1e4, 5e7), (1e5, 5e6), "cold jets: 1 to 20 bar"),
    Plausible(
        "actuators.tank.specific_impulse", "s", (5.0, 480.0), (30.0, 350.0),
        "cold jets 40 to 290, monopropellants 230; in seconds, not the exhaust's m/s",
    ),
    Plausible(
        "actuators.tank.gas_constant",  # word: a key of a file
        "J/(kg·K)", (40.0, 4300.0), (60.0, 4200.0), "xenon 63 to hydrogen 4124",
    ),
    Plausible("actuators.tank.temperature", "K", (100.0, 1000.0), (230.0, 400.0), "in kelvin: 20 °C are 293.15 K"),
    Plausible("actuators.tank.leak", "kg/s", (0.0, 0.1), (0.0, 0.01), "air bearings: 0.0001 to 0.001"),
    Plausible(
        "actuators.curve.*", "N", (-MOST_ACCELERATION, MOST_ACCELERATION), (-5.0, 5.0),
        "of the mass: one propeller accelerates by up to 5 m/s²", scale=lambda robot: robot.body.mass,
    ),
    Plausible("actuators.wheel_radius", "m", (0.003, 2.0), (0.01, 0.5), "toy cars to off-road robots"),
    Plausible(
        "actuators.track", "m", (0.15, 2.0), (0.4, 2.0), "of the radius: wheels stand within the outline",
        scale=lambda robot: robot.body.radius,
    ),
    Plausible(
        "actuators.wheelbase", "m", (0.05, 4.0), (0.4, 2.0), "of the radius: wheels stand within the outline",
        scale=lambda robot: robot.body.radius,
    ),
    Plausible("actuators.max_speed", "m/s", (0.005, 100.0), (0.05, 15.0), "wheeled robots"),
    Plausible("actuators.max_yaw_rate", "rad/s", (0.005, 60.0), (0.1, 15.0), "one to two turns a second at most"),
    Plausible("actuators.max_wheel_speed", "rad/s", (0.1, 2000.0), (1.0, 300.0), "geared motors"),
    Plausible("actuators.max_steering", "rad", (0.02, pi / 2), (0.1, 1.2), "below a quarter turn"),
    Plausible(
        "actuators.wheel_force", "N", (0.005, 50.0), (0.1, 15.0), "of the mass: acceleration by the motors",
        scale=lambda robot: robot.body.mass,
    ),
    Plausible("actuators.friction", "of 1", (0.005, 5.0), (0.1, 1.5), "tyres on ice to rubber on concrete"),
    Plausible("actuators.response.slew.*", "1/s", (0.005, 500.0), (0.05, 100.0), "of a full command: propellers, fans"),
    Plausible("actuators.response.delay_s", "s", (0.0, 5.0), (0.0, 1.0), "links and drives answer within a second"),
    Plausible("actuators.response.opening_delay_s", "s", (0.0, 2.0), (0.0, 0.3), "solenoid valves: 0.005 to 0.06 s"),
    Plausible("actuators.response.lag_s", "s", (0.0, 5.0), (0.0, 2.0), "servos, valves, propellers"),
    Plausible("actuators.response.gain.*", "of 1", (0.05, 5.0), (0.5, 1.5), "share of a command that is done"),
    Plausible(
        "hydrodynamics.hydrostatics.water_density", "kg/m³", (500.0, 2000.0), (950.0, 1100.0), "fresh to salt water",
    ),
    Plausible(
        "hydrodynamics.hydrostatics.waterplane_area", "m²", (0.01, 1.3), (0.03, 1.0), "of the circle of the radius",
        scale=lambda robot: pi * robot.body.radius**2,
    ),
    *(
        Plausible(
            f"hydrodynamics.hydrostatics.metacentric_height_{axis}", "m", (0.005, 10.0), (0.05, 3.0),
            "of the radius: flat boats stand stiffly", scale=lambda robot: robot.body.radius,
        )
        for axis in ("roll", "pitch")
    ),
    *(
        Plausible(
            f"hydrodynamics.added_mass.{axis}", "kg" if axis < 3 else "kg·m²", (0.0, 10.0), (0.0, 3.0),
            "of the body's own mass or inertia: surge 0.05 to 0.3, sway and heave up to 2 (Fossen, §6.3)",
            scale=functools.partial(_own_inertia, axis),
        )
        for axis in range(6)
    ),
    *(
        Plausible(
            f"hydrodynamics.{kind}_damping.{axis}", unit.format("m" if axis < 3 else "rad"), (0.0, 200.0), (0.0, 30.0),
            "of the body's mass or inertia: at 1 m/s or 1 rad/s, water slows it down within 0.03 s at the fastest",
            scale=functools.partial(_own_inertia, axis),
        )
        for kind, unit in (("linear", "per {}/s"), ("quadratic", "per ({}/s)²"))
        for axis in range(6)
    ),
    Plausible(
        "hydrodynamics.hydrostatics.draught", "m", (0.2, 5.0), (0.8, 1.25),
        "of mass / (water_density · waterplane_area), where a hull with vertical walls floats", scale=_floating_draught,
    ),
    Plausible(
        "performance.force", "N", (1e-6, 50.0), (1e-4, 15.0), "of the mass: acceleration of up to 15 m/s²",
        scale=lambda robot: robot.body.mass,
    ),
    Plausible(
        "performance.torque", "N·m", (1e-6, 2000.0), (1e-4, 200.0),
        "of the yaw inertia: angular acceleration of up to 200 rad/s²", scale=lambda robot: robot.body.inertia[2],
    ),
    Plausible("performance.top_speed", "m/s", (0.001, 500.0), (0.02, 100.0), "crawling robots to aircraft"),
    Plausible(
        "performance.speed", "m/s", (0.01, 1.2), (0.02, 1.0), "of top_speed",
        scale=lambda robot: robot.performance.top_speed,
    ),
    Plausible(
        "performance.reverse_speed", "m/s", (0.01, 1.2), (0.02, 1.0), "of top_speed",
        scale=lambda robot: robot.performance.top_speed,
    ),
    Plausible(
        "performance.lateral_speed", "m/s", (0.01, 1.2), (0.02, 1.0), "of top_speed",
        scale=lambda robot: robot.performance.top_speed,
    ),
    Plausible("performance.yaw_rate", "rad/s", (1e-4, 40.0), (0.005, 10.0), "satellites to drift cars"),
    Plausible("performance.turning_acceleration", "m/s²", (1e-5, 200.0), (1e-3, 50.0), "satellites to drift cars"),
    Plausible("costs.effort", "of 1", (0.0, 100.0), (0.0, 1.0), "of a reward of about 1 a step"),
    Plausible("costs.change", "of 1", (0.0, 100.0), (0.0, 1.0), "of a reward of about 1 a step"),
    *_noise("odometry", "position", "m", 30.0, 3.0, "motion capture 0.001 m, satellite positioning 3 m"),
    *_noise("odometry", "heading", "rad", 1.0, 0.2, "star tracker 0.0001 rad, poor compass 0.2 rad (11°)"),
    *_noise("odometry", "velocity", "m/s", 4.0, 0.5, "Doppler 0.005 m/s, differences of poor positions 0.5 m/s"),
    *_noise("odometry", "yaw_rate", "rad/s", 2.0, 0.3, "gyroscope 0.001 rad/s, differences of headings 0.3 rad/s"),
    *_noise("imu", "accelerometer", "m/s²", 5.0, 2.0, "MEMS data sheets: 0.001 to 0.1 m/s²"),
    *_noise("imu", "gyroscope", "rad/s", 0.5, 0.2, "MEMS data sheets: 0.0005 to 0.02 rad/s"),
    Plausible("sensors.imu.gyroscope.limit", "rad/s", (0.01, 200.0), (0.3, 80.0), "data sheets: 125 to 4000 °/s"),
    Plausible("sensors.imu.accelerometer.limit", "m/s²", (0.1, 1e4), (9.0, 2500.0), "data sheets: 2 to 200 g"),
    Plausible("sensors.imu.gyroscope.walk", "rad/s/√s", (0.0, 0.05), (0.0, 0.001), "data sheets: 1e-7 to 1e-4"),
    Plausible("event_cameras.*.camera.width", "px", (8.0, 10_000.0), (32.0, 4200.0), "event cameras: 128 to 1280"),
    Plausible("event_cameras.*.camera.height", "px", (8.0, 10_000.0), (32.0, 4200.0), "event cameras: 128 to 1280"),
    Plausible("event_cameras.*.camera.faintest", "mag", (-1.5, 15.0), (2.0, 12.0), "Sirius to what a tracker sees"),
    Plausible("event_cameras.*.camera.psf_px", "px", (0.05, 50.0), (0.3, 5.0), "lenses out of focus a little"),
    Plausible("event_cameras.*.pixels.threshold", "of 1", (0.01, 2.0), (0.05, 0.8), "data sheets: 10 to 50 %"),
    Plausible("event_cameras.*.pixels.threshold_std", "of 1", (0.0, 0.5), (0.0, 0.15), "data sheets: 2 to 4 %"),
    Plausible("event_cameras.*.pixels.noise_hz", "Hz", (0.0, 1000.0), (0.0, 30.0), "of a pixel: 0.01 to 10"),
    Plausible("event_cameras.*.pixels.jitter_s", "s", (0.0, 0.02), (0.0, 0.002), "data sheets: 1e-6 to 1e-3"),
    Plausible("event_cameras.*.pixels.refractory_s", "s", (0.0, 0.1), (0.0, 0.01), "data sheets: 1e-6 to 1e-3"),
    Plausible("event_cameras.*.camera.fov_deg", "°", (0.5, 120.0), (2.0, 100.0), "star trackers to wide lenses"),
    Plausible("sensors.odometry.rate_hz", "Hz", (0.05, 1e5), (0.5, 2000.0), "satellite positioning to motion capture"),
    Plausible("sensors.odometry.delay_s", "s", (0.0, 5.0), (0.0, 0.5), "a control loop with more lag is unstable"),
    Plausible("sensors.imu.rate_hz", "Hz", (0.5, 1e5), (5.0, 10_000.0), "data sheets"),
    Plausible("sensors.imu.delay_s", "s", (0.0, 2.0), (0.0, 0.1), "data sheets"),
    Plausible("limits.geofence", "m", (0.1, 1e6), (0.5, 1e4), "a laboratory to an airfield"),
    Plausible("limits.speed", "m/s", (0.005, 1000.0), (0.05, 200.0), "crawling robots to aircraft"),
    Plausible("limits.yaw_rate", "rad/s", (1e-3, 100.0), (0.01, 30.0), "satellites to model cars"),
)  # fmt: skip

# What must hold between two numbers of a file, whatever a family says of one of them.
RELATIONS: tuple[Plausible, ...] = (
    Plausible(
        "body.mass", "kg", (0.2, 20_000.0), (0.5, 6000.0),
        "of the volume of the body's outline: aircraft 2 kg/m³, metal 8000 kg/m³",
        scale=lambda robot: outline_volume(robot.body),
    ),
    Plausible(
        "body.height", "m", (0.04, 8.0), (0.1, 5.0), "of the radius", scale=lambda robot: robot.body.radius,
    ),
    *(
        Plausible(
            f"body.footprint.{side}", "m", (0.1, 2.05), (0.3, 2.01), "of the radius of the circle around it",
            scale=lambda robot: robot.body.radius,
        )
        for side in (0, 1)
    ),
    Plausible(
        "body.footprint_x", "m", (-1.05, 1.05), (-0.9, 0.9), "of the radius", scale=lambda robot: robot.body.radius,
    ),
    Plausible(
        "limits.speed", "m/s", (0.0, 25.0), (0.0, 8.0), "of performance.top_speed",
        scale=lambda robot: robot.performance.top_speed,
    ),
    Plausible(
        "performance.yaw_rate", "rad/s", (0.002, 1.0), (0.004, 1.0), "of limits.yaw_rate: faster passes no gate",
        scale=lambda robot: robot.limits.yaw_rate,
    ),
    Plausible(
        "performance.top_speed", "m/s", (0.0, 1.0), (0.0, 1.0), "of limits.speed: what is faster passes no gate",
        scale=lambda robot: robot.limits.speed,
    ),
)  # fmt: skip

SHARE = "share of what the robot itself can bring up: beyond 1 it cannot hold its place"

SCENARIO: tuple[Plausible, ...] = (
    Plausible("push.force", "of 1", (0.0, 10.0), (0.0, 1.0), SHARE),
    Plausible("push.torque", "of 1", (0.0, 10.0), (0.0, 1.0), SHARE),
    Plausible("wave.force", "of 1", (0.0, 10.0), (0.0, 1.0), SHARE),
    Plausible("wave.torque", "of 1", (0.0, 10.0), (0.0, 1.0), SHARE),
    Plausible("wave.wave_number.*", "rad/m", (0.0, 1000.0), (0.0, 60.0), "waves of 0.1 m and longer"),
    Plausible("kick.force", "of 1", (0.0, 100.0), (0.0, 5.0), "share of the robot's own, for one control step"),
    Plausible("tether.stiffness.*", "N/m", (0.0, 1000.0), (0.0, 10.0), "tension over height of an air line"),
    Plausible("tether.reach", "m", (0.0, 100.0), (0.0, 10.0), "the ceiling of a laboratory"),
    Plausible("tether.lever", "m", (0.0, 10.0), (0.0, 1.0), "an air line is fastened to the body"),
    Plausible("orbit_rate", "rad/s", (0.0, 0.1), (0.0, 0.00125), "circular orbits of the Earth: 84 min and longer"),
    Plausible("actuation.noise", "of 1", (0.0, 1.0), (0.0, 0.3), "share of full command"),
    Plausible("actuation.gain.*", "of 1", (0.0, 3.0), (0.3, 1.5), "share of a command that is done"),
    Plausible("actuation.delay_s", "s", (0.0, 2.0), (0.0, 0.5), "links and drives answer within half a second"),
    Plausible("actuation.opening_delay_s.*", "s", (0.0, 2.0), (0.0, 0.3), "solenoid valves: 0.005 to 0.06 s"),
    Plausible("sensing.noise", "times", (0.0, 100.0), (0.0, 10.0), "factor on the robot's own noise"),
    Plausible("sensing.bias", "times", (0.0, 100.0), (0.0, 10.0), "factor on the robot's own bias"),
    Plausible("sensing.delay_s", "s", (0.0, 5.0), (0.0, 0.5), "a control loop with more lag is unstable"),
    Plausible("link.delay_s", "s", (0.0, 10.0), (0.0, 1.0), "radio to a satellite in geostationary orbit: 0.3 s"),
    Plausible("link.jitter_s", "s", (0.0, 10.0), (0.0, 0.5), "at most the delay itself"),
    Plausible("link.bandwidth", "bit/s", (100.0, 1e11), (4800.0, 1e10), "a slow telemetry radio to a wire"),
    Plausible("sensing.velocity_noise.*", "m/s", (0.0, 5.0), (0.0, 0.5), "differences of poor positions: 0.5 m/s"),
    Plausible("sensing.yaw_rate_noise.*", "rad/s", (0.0, 2.0), (0.0, 0.3), "differences of headings: 0.3 rad/s"),
)  # fmt: skip

TASK: tuple[Plausible, ...] = (
    Plausible("episode_s", "s", (0.05, 1e5), (1.0, 3600.0), "seconds to an hour"),
    Plausible("hold_s", "s", (0.01, 1e5), (0.2, 600.0), "time of one target"),
    Plausible("tolerance.position", "m", (1e-5, 20.0), (0.002, 3.0), "motion capture to satellite positioning"),
    Plausible("tolerance.heading_deg", "°", (0.01, 180.0), (0.5, 60.0), "what a robot can hold, to a rough direction"),
    Plausible("tolerance.velocity", "m/s", (1e-5, 20.0), (0.001, 2.0), "a share of what robots drive"),
    Plausible("tolerance.yaw_rate_deg", "°/s", (0.005, 360.0), (0.2, 60.0), "a share of what robots turn"),
    Plausible("tolerance.hold_s", "s", (0.0, 1.0), (0.0, 0.8), "of episode_s", scale=lambda task: task.episode_s),
    Plausible("start.distance.1", "m", (1e-3, 1e5), (0.05, 1000.0), "a laboratory to an airfield"),
    Plausible("start_distance.1", "m", (1e-3, 1e5), (0.05, 1000.0), "a laboratory to an airfield"),
    Plausible("start.goal_area", "m", (1e-3, 1e5), (0.1, 1000.0), "a laboratory to an airfield"),
    Plausible("fine_distance", "m", (1e-4, 50.0), (0.005, 5.0), "a few times the tolerance"),
    Plausible("reach", "m", (1e-4, 50.0), (0.005, 5.0), "at most the tolerance"),
    Plausible("course.area", "m", (0.1, 1e5), (0.5, 1000.0), "a laboratory to an airfield"),
    Plausible("track.size", "m", (0.1, 1e5), (0.5, 1000.0), "a laboratory to an airfield"),
    Plausible("obstacles.radius", "m", (1e-3, 50.0), (0.02, 5.0), "posts to buoys"),
    Plausible("block.radius", "m", (1e-3, 20.0), (0.01, 2.0), "what a robot can push"),
    Plausible("block.mass", "kg", (1e-4, 1e4), (0.005, 100.0), "what a robot can push"),
    Plausible("block.floor_friction", "of 1", (0.0, 5.0), (0.02, 1.5), "steel on ice to rubber on concrete"),
    Plausible("block.grip", "of 1", (0.0, 5.0), (0.0, 1.5), "steel on ice to rubber on concrete"),
)  # fmt: skip
