"""A robot's file with one wrong number, sign, unit or name is refused with the key, the value and what is allowed."""

from __future__ import annotations

import math

import pytest

from fulmar_core.config.errors import ImplausibleError
from fulmar_core.config.paths import config_names
from fulmar_core.config.plausible_ranges import RELATIONS
from fulmar_core.robots.robot_file import load_robot, load_robot_file
from tests.wrong_robots import altered, assert_names, times

DEGREES, RPM = math.degrees(1.0), 30.0 / math.pi
SIGNS = (
    "CL.alpha", "CL.elevator", "CY.beta", "CY.rudder", "Cl.beta", "Cl.p", "Cl.r", "Cl.aileron", "Cm.alpha",
    "Cm.alphadot", "Cm.q", "Cm.elevator", "Cn.beta", "Cn.r", "Cn.rudder",
)  # fmt: skip
TERMS, SURFACE, ENGINE = "airframe.aerodynamics.terms", "actuators.surfaces", "actuators.motors.0.engine"
WATER = "hydrodynamics.hydrostatics"
# Robot, key, what it is changed to, and words of the message beside the key, the value and what is allowed.
NUMBERS = [
    *(("navion", f"{TERMS}.{key}", times(-1.0), "") for key in SIGNS),
    *(("cessna_182", f"{TERMS}.{key}", times(-1.0), "") for key in SIGNS),
    *(("navion", f"{TERMS}.{key}", times(0.0), "") for key in ("CL.alpha", "Cm.alpha", "Cl.p", "Cm.q", "Cn.beta")),
    *(("airship_v7", f"{TERMS}.{key}", times(-1.0), "") for key in ("Cm.alpha", "Cn.beta", "Cm.elevator")),
    ("airship_v7", f"{TERMS}.Cl.aileron", times(-1.0), "1/°"),
    ("navion", f"{TERMS}.CL.alpha", times(1.0 / DEGREES), "1/° are"),
    ("airship_v7", f"{TERMS}.CL.alpha", times(DEGREES), "1/rad are"),
    ("skywalker_x8", f"{TERMS}.Cm.alpha", times(DEGREES), ""),
    ("cessna_182", f"{TERMS}.CD.1", 3.2, ""),
    ("a0s", "airframe.aerodynamics.alpha_zero", 2.475, "° are"),
    ("a0s", "airframe.aerodynamics.elevator_zero", -0.8948, "° are"),
    ("navion", f"{SURFACE}.0.limit_deg", 0.349, "rad are"),
    ("navion", f"{SURFACE}.2.limit_deg", 0.26, "rad are"),
    ("skywalker_x8", f"{SURFACE}.0.rate_deg", 3.49, "rad/s are"),
    ("navion", "actuators.servo_rate", times(DEGREES), "°/s are"),
    ("airship_v7", "actuators.servo_rate", times(DEGREES), "°/s are"),
    ("airship_v7", "actuators.servo_damping", 70.7, "% are"),
    ("airship_v7", f"{ENGINE}.top_rate", times(RPM), "rpm are"),
    ("airship_v7", f"{ENGINE}.top_rate", times(1.0 / RPM), "One rad/s is 9.549 rpm"),
    ("volantex_ranger", f"{ENGINE}.top_rate", times(1.0 / RPM), "slower than 'jet_speed'"),
    ("airship_v7", f"{ENGINE}.top_rate", times(-1.0), "'rotation' says which way"),
    ("cubesat_wheels", "actuators.top_speed", times(1.0 / RPM), ""),
    ("jetbot", "actuators.max_wheel_speed", times(1.0 / RPM), ""),
    ("a0s", f"{ENGINE}.torque_per_speed2", 7e-5, ""),
    ("navion", f"{ENGINE}.power", 240.0, "hp are"),
    ("navion", f"{ENGINE}.power", 179.0, "kW are"),
    ("navion", f"{ENGINE}.efficiency", 82.0, "% are"),
    ("navion", f"{ENGINE}.thrust", 122_000.0, ""),
    ("skywalker_x8", f"{ENGINE}.jet_speed", 3.7, ""),
    ("a0s", f"{ENGINE}.disc_area", 730.0, ""),
    ("airship_v7", "actuators.motors.0.position", [0.078, 60.0, -0.004], ""),
    ("navion", "airframe.stall_deg", 0.262, "rad are"),
    ("navion", "airframe.speed", 193.1, "km/h are"),
    ("navion", "airframe.chord", 173.7, ""),
    ("navion", "airframe.area", 184.0, ""),
    ("a0s", "airframe.span", 25.6, ""),
    ("navion", "performance.force", times(10.0), ""),
    ("navion", "performance.yaw_rate", times(DEGREES), "°/s are"),
    ("navion", "performance.top_speed", 7.51, ""),
    ("cubesat_wheels", "actuators.spin_inertia", 0.2, ""),
    ("cubesat_wheels", "actuators.spin_inertia", 1.0, ""),
    ("cubesat_wheels", "actuators.spin_inertia", 0.05, ""),
    ("cubesat_wheels", "actuators.top_speed", times(RPM), "rpm are"),
    ("microsat", "actuators.top_speed", times(RPM), "rpm are"),
    ("smallsat", "actuators.top_speed", times(RPM), "rpm are"),
    ("cubesat_wheels", "actuators.torque", 10.0, "mN·m are"),
    ("cubesat_wheels", "actuators.coulomb", 0.02, ""),
    ("cubesat_wheels", "actuators.unloading.torque", 0.5, "mN·m are"),
    ("cubesat_wheels", "performance.yaw_rate", times(DEGREES), "°/s are"),
    ("cubesat_wheels", "body.inertia", [0.26, 0.26, 0.6], ""),
    ("cubesat_wheels", "event_cameras.0.camera.fov_deg", 0.148, "rad are"),
    ("cubesat_wheels", "sensors.imu.gyroscope.limit", 500.0, "°/s are"),
    ("floating_platform", "actuators.thrust", 10.0 * 5.32 * 9.81, ""),
    ("floating_platform", "actuators.nozzles.0.position", [0.5, 0.5, 0.0], ""),
    ("floating_platform", "actuators.nozzles.0.position.2", 0.6, ""),
    ("floating_platform", "actuators.tank.regulated", 8.0, "bar are"),
    ("floating_platform", "actuators.tank.pressure", 300.0, ""),
    ("floating_platform", "actuators.tank.volume", 1.1, "l are"),
    ("floating_platform", "actuators.tank.specific_impulse", 490.0, "not the exhaust's m/s"),
    ("floating_platform", "actuators.tank.temperature", 20.0, "293.15 K"),
    ("floating_platform", "actuators.tank.leak", 0.2, "g/s are"),
    ("floating_platform", "body.mass", 5320.0, "g are"),
    ("floating_platform", "body.mass", 6.5, "which does not hold the body's own"),
    ("floating_platform", "body.height", 45.0, ""),
    ("floating_platform", "performance.yaw_rate", times(DEGREES), "°/s are"),
    ("spacecraft_16", "performance.yaw_rate", times(DEGREES), "°/s are"),
    ("int_ball2", "performance.yaw_rate", times(DEGREES), "°/s are"),
    ("int_ball2", "actuators.fans.0.position", [45.0, 70.0, 55.5], "mm are"),
    ("int_ball2", "body.inertia", [0.014, 0.01434, 132.4], ""),
    ("floating_platform", "timing.control_hz", 0.2, ""),
    ("kingfisher", "hydrodynamics.linear_damping", [0.0, -99.99, 99.99, 13.0, 13.0, 5.83], "sway"),
    ("kingfisher", "hydrodynamics.added_mass.1", 3500.0, ""),
    ("kingfisher", "hydrodynamics.quadratic_damping.0", 17_257.6, ""),
    ("kingfisher", f"{WATER}.waterplane_area", 3300.0, "cm² are"),
    ("kingfisher", f"{WATER}.metacentric_height_roll", 400.0, "mm are"),
    ("kingfisher", "actuators.propellers.0.position", [-0.53, 3.7765, 0.0], ""),
    ("kingfisher", "performance.top_speed", 15.0, ""),
    ("kingfisher", "performance.yaw_rate", times(DEGREES), "°/s are"),
    ("turtlebot2", "actuators.wheel_radius", 0.35, ""),
    ("turtlebot2", "actuators.wheel_radius", 3.5, "cm are"),
    ("turtlebot2", "actuators.track", 2.3, ""),
    ("turtlebot2", "actuators.track", 0.023, ""),
    ("turtlebot2", "actuators.max_wheel_speed", times(RPM), "rpm are"),
    ("jetbot", "actuators.max_wheel_speed", times(RPM), "rpm are"),
    ("turtlebot2", "actuators.max_wheel_speed", times(0.1), ""),
    ("turtlebot2", "actuators.max_yaw_rate", times(DEGREES), "°/s are"),
    ("turtlebot2", "actuators.max_speed", 4.5, ""),
    ("turtlebot2", "actuators.wheel_force", times(10.0), ""),
    ("turtlebot2", "actuators.friction", 90.0, "% are"),
    ("turtlebot2", "actuators.caster_x", 13.5, "m are"),
    ("leatherback", "actuators.max_steering", 45.0, "45° are 0.7854 rad"),
    ("leatherback", "actuators.max_speed", 36.0, ""),
    ("leatherback", "actuators.wheel_force", 160.0, ""),
    ("leatherback", "actuators.wheelbase", 3.2, ""),
    ("leatherback", "performance.torque", 20.0, ""),
    ("leatherback", "body.footprint.0", 50.0, ""),
    ("leatherback", "body.footprint.1", -0.3, ""),
    ("leatherback", "body.footprint_x", 16.0, ""),
    ("turtlebot2", "body.height", 4.2, ""),
    ("turtlebot2", "uncertainty.mass.1", 680.0, ""),
    ("floating_platform", "uncertainty.yaw_inertia.1", 3.2, ""),
    ("kingfisher", "uncertainty.drag.1", 110.0, ""),
    ("kingfisher", "actuators.response.slew.0", 1000.0, ""),
    ("turtlebot2", "limits.speed", 100.0, ""),
    ("floating_platform", "timing.physics_dt", 2e-5, ""),
    ("floating_platform", "performance.speed", 4.5, ""),
    ("floating_platform", "sensors.imu.accelerometer.std", 8.6, ""),
    ("floating_platform", "sensors.imu.gyroscope.std", 1.2, "°/s are"),
    ("spacecraft_16", "actuators.tank.volume", 0.057, ""),
    ("cubesat_wheels", "event_cameras.0.pixels.threshold", 25.0, "Is it in %?"),
    ("cubesat_wheels", "event_cameras.1.camera.faintest", 70.0, ""),
    ("cubesat_wheels", "event_cameras.0.pixels.jitter_s", 100.0, "µs are"),
    ("navion", f"{TERMS}.CD.alpha", 18.9, ""),
    ("navion", f"{TERMS}.CL.1", -0.41, ""),
    ("navion", f"{TERMS}.CL.q", -3.8, ""),
]  # fmt: skip


@pytest.mark.parametrize("case", NUMBERS, ids=[f"{robot}-{key}" for robot, key, *_ in NUMBERS])
def test_a_wrong_number_is_named_with_its_key_and_what_is_allowed(tmp_path, case):
    robot, key, value, words = case
    path, text = altered(tmp_path, robot, {key: value})
    with pytest.raises(ImplausibleError) as refused:
        load_robot_file(path)
    assert_names(str(refused.value), key, text)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("robot", "key", "value", "named"),
    [
        ("airship_v7", "terms.CD.alpha^2", -0.01, "terms.CD' = -.* from -6.5 to 13°, .* accepted is -0.02 to 1.5"),
        ("airship_v7", "terms.Cm.elevator^3", -3e-3, "terms.Cm' = -2.*, accepted is -8 to 8"),
        ("airship_v7", "terms.CY.beta^3", 2.7e-2, "terms.CY' = -.*, accepted is -2 to 2"),
        ("airship_v7", "unit", "rad", "CL.alpha' = 0.105014 1/rad .* Is it in 1/°"),
        ("navion", "unit", "deg", "CL.alpha' = 4.44 1/° .* Is it in 1/rad"),
        ("sr22", "signs.elevator", 1, "CL.elevator' = -0.0103945 1/° .* see 'signs'"),
        ("airship_v7", "signs.aileron", 1, "Cl.aileron' = -0.0061653. 1/° .* see 'signs'"),
        ("airship_v7", "signs.rudder", 1, "CY.rudder' = -0.0034090. 1/° .* see 'signs'"),
        ("airship_v7", "alpha_range", [-0.04, 0.08], "alpha_range.1' = 0.08 ° .* Is it in rad"),
        ("navion", "tables", {"Cm": {"alpha": [-0.2, 0.3], "value": [-0.4, 0.6]}}, "Cm.alpha' = 1.317 1/rad"),
    ],
)  # fmt: skip
def test_a_unit_a_sign_or_a_table_that_turns_a_derivative_is_named_by_that(
    tmp_path, robot, key, value, named
):
    path, _ = altered(tmp_path, robot, {f"airframe.aerodynamics.{key}": value})
    with pytest.raises(ImplausibleError, match=named):
        load_robot_file(path)


@pytest.mark.parametrize(("factor", "axis"), [(10.0, 2), (1e4, 2), (1e-3, 2)])
def test_a_tensor_that_is_none_of_this_mass_and_radius_is_named_by_an_axis(tmp_path, factor, axis):
    path, _ = altered(tmp_path, "spacecraft_16", {"body.inertia": [factor * 0.2045] * 3})
    with pytest.raises(
        ImplausibleError, match=rf"'body.inertia.{axis}' = {factor * 0.2045:g} kg·m².* accepted is"
    ):
        load_robot_file(path)


@pytest.mark.parametrize("case", [("turtlebot2", "response", {}), ("leatherback", "response.slew", [])])
def test_a_robot_without_what_a_range_is_for_loads(tmp_path, case):
    robot, key, nothing = case
    path, _ = altered(tmp_path, robot, {f"actuators.{key}": nothing})
    assert load_robot_file(path).actuators.response.slew == ()


@pytest.mark.parametrize("name", ["my-bot", "2bot", "Bot", "", "a b", "x" * 65])
def test_a_robot_that_no_node_can_be_called_after_is_refused(tmp_path, name):
    path, _ = altered(tmp_path, "spacecraft_16", {"name": name})
    with pytest.raises(ImplausibleError, match="must begin with a small letter") as refused:
        load_robot_file(path)
    assert f"'{name[:64]}" in str(refused.value)


@pytest.mark.parametrize(
    ("robot", "key", "name", "words"),
    [
        ("spacecraft_16", "nozzles.3", "imu", "actuator 4 has the name 'imu': its frame would be imu_link"),
        (
            "spacecraft_16",
            "nozzles.3",
            "base",
            "actuator 4 has the name 'base': its frame would be base_link",
        ),
        ("spacecraft_16", "nozzles.3", "", "actuator 4 has the name '': it must begin with a letter"),
        ("int_ball2", "fans.0", "fan 1", "actuator 1 has the name 'fan 1'"),
        ("kingfisher", "propellers.1", "a/b", "actuator 2 has the name 'a/b'"),
        ("cubesat_wheels", "wheels.0", "imu", "its frame would be imu_link"),
        ("spacecraft_16", "nozzles.3", "thruster_1", "name of its own"),
        ("cubesat_wheels", "wheels.0", "unload_x", "name of its own"),
    ],
)
def test_a_part_that_no_frame_can_be_called_after_is_refused(tmp_path, robot, key, name, words):
    path, _ = altered(tmp_path, robot, {f"actuators.{key}.name": name})
    with pytest.raises(ImplausibleError) as refused:
        load_robot_file(path)
    assert words in str(refused.value)


@pytest.mark.parametrize("name", [name for name in config_names("robots") if load_robot(name).flies])
def test_a_shipped_aircraft_has_usual_derivatives_and_each_range_a_reason(name):
    robot = load_robot(name)
    rows = robot.actuators.ranges(robot)
    assert {"1/rad", "1/°"} & {row.unit for row in rows}
    for row in (*rows, *RELATIONS):
        assert row.possible[0] <= row.usual[0] < row.usual[1] <= row.possible[1], row.key
        assert row.why
        value = row.of(robot) if row.of else 0.0
        assert value == 0.0 or row.usual[0] <= value <= row.usual[1], row.key
