"""Every airframe: its controls, its trim, its range of angles, and files that describe no aircraft."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_modes import modes_of
from fulmar_core.dynamics.flight_trim import find_trim, still_air
from fulmar_core.dynamics.rigid_body import inertia_of
from fulmar_core.robots.airframe.airframe import flow_past
from fulmar_core.robots.airframe.atmosphere import air_density
from fulmar_core.robots.airframe.coefficients import NAMES, Coefficients, Curve
from fulmar_core.robots.airframe.ground_effect import (
    GroundEffect,
    induced_drag_ratio,
    lift_ratio,
    near_ground,
)
from fulmar_core.robots.robot_file import load_robot

AIRCRAFT = [name for name in config_names("robots") if load_robot(name).flies]
TABLE = json.loads(Path(__file__).with_name("ground_effect.json").read_text(encoding="utf-8"))


def test_there_are_eight_airframes():
    assert set(AIRCRAFT) == {
        "airship_v7", "a0s", "volantex_ranger", "navion", "navion_falcon", "cessna_182", "skywalker_x8", "sr22"
    }  # fmt: skip


@pytest.mark.parametrize("name", AIRCRAFT)
class TestAirframe:
    def torques(self, name, **changed):
        """Torque about x, y (left) and z (up) in trim, with some actuators moved [N·m]."""
        robot = load_robot(name)
        trim = find_trim(robot, robot.airframe.speed)
        command = trim.command.copy()
        for actuator, by in changed.items():
            command[robot.actuators.names.index(actuator)] += by
        state, world = trim.state.mapped(lambda part: np.asarray(part)[None]), still_air(robot, 1)
        dynamics = FlightDynamics(robot, turbulent=False)
        _, torque = dynamics.wrench(state, command[:, None], None, world, inertia_of(tuple(world.inertia)))
        return np.array([float(part[0]) for part in torque])

    def test_every_surface_moves_its_own_axis_the_documented_way(self, name):
        """A positive elevator lowers the nose, aileron the right wing; a positive rudder turns to the left."""
        axes = {"elevator": 1, "aileron": 0, "rudder": 2}  # about which a positive torque does so
        for surface in load_robot(name).actuators.surfaces:
            moved = self.torques(name, **{surface.name: 0.02}) - self.torques(name)
            assert moved[axes[surface.name]] > 0.0
            assert np.argmax(np.abs(moved)) == axes[surface.name]

    def test_more_throttle_pushes_ahead(self, name):
        robot = load_robot(name)
        motor = robot.actuators.motors[0]
        at = np.array([robot.airframe.speed])
        low, high = (motor.engine.thrust_at(np.array([t]), at, np.array([1.2]))[0] for t in (0.3, 0.5))
        assert 0.0 < low < high <= motor.engine.thrust

    def test_it_trims_at_its_speed_in_free_air_and_near_the_ground(self, name):
        robot = load_robot(name)
        for height in (None, robot.airframe.span):
            trim = find_trim(robot, robot.airframe.speed, height)
            assert abs(np.degrees(trim.alpha)) < robot.airframe.stall_deg
            assert 0.0 < trim.throttle < 1.0
        low, high = (find_trim(robot, robot.airframe.speed, h) for h in (0.4 * robot.airframe.span, None))
        assert low.thrust < high.thrust  # the ground takes induced drag away
        assert low.alpha < high.alpha  # and gives lift

    def test_it_has_the_modes_of_an_aircraft(self, name):
        robot = load_robot(name)
        modes = {mode.name: mode for mode in modes_of(robot, find_trim(robot, robot.airframe.speed))}
        assert set(modes) == {"short period", "phugoid", "roll", "Dutch roll", "spiral"}
        assert modes["short period"].real < 0.0
        assert modes["short period"].frequency > 3.0 * modes["phugoid"].frequency
        assert modes["roll"].real < -1.0


def test_no_trim_is_one_line_that_names_what_is_missing():
    with pytest.raises(
        ConfigError, match=r"'navion' has no trim at 12 m/s and in free air: .* remain, at an angle"
    ):
        find_trim(load_robot("navion"), 12.0)


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ((0.0, None), "speed = 0"),
        ((28.0, -1.0), "height = -1 m must be greater than 0"),
        ((np.nan, 1.0), "speed = nan"),
    ],
)
def test_impossible_conditions_are_refused(numbers, words):
    with pytest.raises(ConfigError, match=words):
        find_trim(load_robot("airship_v7"), *numbers)


def test_what_is_no_aircraft_has_no_trim():
    with pytest.raises(ConfigError, match="'turtlebot2' is no aircraft"):
        find_trim(load_robot("turtlebot2"), 1.0)


class TestCoefficients:
    V7 = load_robot("airship_v7").airframe

    def at(self, alpha_deg, **more):
        flow = {
            "alpha": np.radians(np.asarray(alpha_deg, dtype=float)),
            "beta": np.zeros(np.shape(alpha_deg)),
        }
        return self.V7.aerodynamics.at(flow | {name: np.radians(value) for name, value in more.items()})

    def test_a_polynomial_is_that_of_the_source(self):
        """FALCON-S, Airship_V7_poly.csv at α = 2° and δ_e = −1°, by hand."""
        found = self.at([2.0], elevator=-1.0)
        lift = 0.5346827 + 0.2100278 - 0.01836173 + 4 * 0.0002886375 + 2 * 0.0005990384 - 0.0005015353
        lift += -8 * 0.0001501111 - 4 * 0.00014087 + 2 * 4.736516e-05 + 1.838309e-06
        assert found["CL"][0] == pytest.approx(lift, abs=1e-7)

    def test_beyond_its_range_it_goes_on_in_a_straight_line(self):
        for edge, sign in ((4.5, 1.0), (-2.5, -1.0)):
            angles = edge + sign * np.array([-1e-3, 0.0, 1.0, 2.0, 8.0])
            for name in NAMES:
                value = self.at(angles, elevator=-3.0)[name]
                slope = (value[1] - value[0]) / 1e-3
                np.testing.assert_allclose(np.diff(value[1:]), slope * np.array([1.0, 1.0, 6.0]), atol=2e-4)
        inside = replace(self.V7.aerodynamics, alpha_range=None)
        far = {"alpha": np.radians([10.0]), "beta": np.zeros(1)}
        assert inside.at(far)["Cm"][0] > 0.1 > self.V7.aerodynamics.at(far)["Cm"][0]  # it would pitch up

    def test_a_table_is_linear_between_its_points_and_beyond_them(self):
        curve = Curve(alpha=(-2.0, 0.0, 4.0), value=(-0.1, 0.3, 0.5))
        found = curve.at(np.array([-4.0, -2.0, -1.0, 0.0, 2.0, 4.0, 6.0]))
        np.testing.assert_allclose(found, [-0.5, -0.1, 0.1, 0.3, 0.4, 0.5, 0.6])
        model = Coefficients(unit="deg", terms={"CL": {"elevator": 0.01}}, tables={"CL": curve})
        flow = {"alpha": np.radians([2.0]), "beta": np.zeros(1), "elevator": np.radians([5.0])}
        assert model.at(flow)["CL"][0] == pytest.approx(0.45)

    @pytest.mark.parametrize(
        ("keys", "words"),
        [
            ({"terms": {"CLL": {"1": 0.1}}}, "coefficient 'CLL' is not known"),
            ({"terms": {"CL": {"alhpa": 0.1}}}, "factor 'alhpa' .* Did you mean 'alpha'"),
            ({"terms": {"CL": {"alpha^x": 0.1}}}, "a power must be a whole number"),
            ({"terms": {"Cm": {"alpha alphadot": 0.1}}}, "'alphadot' stands alone"),
            ({"terms": {"Cm": {"alphadot^2": 0.1}}}, "'alphadot' stands alone"),
            ({"terms": {}, "signs": {"flap": -1.0}}, "'signs' takes 1 or -1"),
            ({"terms": {}, "alpha_range": (5.0, -5.0)}, "'alpha_range'"),
        ],
    )
    def test_files_with_mistakes_are_refused(self, keys, words):
        with pytest.raises(ValueError, match=words):
            Coefficients(unit="deg", **keys)


class TestGroundEffect:
    @pytest.mark.parametrize(("height", "lift", "drag"), TABLE["rows"])
    def test_it_is_that_of_a_vortex_lattice_within_its_range(self, height, lift, drag):
        wing = np.array(height), TABLE["aspect_ratio"], TABLE["taper"]
        if height >= 0.25:
            assert float(lift_ratio(*wing)) == pytest.approx(lift, abs=0.02)
        if height >= 0.2:
            assert float(induced_drag_ratio(*wing)) == pytest.approx(drag, abs=0.015)

    def test_drag_falls_by_its_induced_part_alone_unless_asked_otherwise(self):
        wing = {"aspect_ratio": 7.53, "taper": 0.39, "span": 5.0}
        numbers = np.array(0.6), np.array(0.05), np.array(1.0)
        induced = near_ground(*numbers, effect=GroundEffect(), **wing)
        total = near_ground(*numbers, effect=GroundEffect(drag="total"), **wing)
        assert induced[0] == total[0] > 0.6
        assert total[1] < induced[1] < 0.05

    def test_high_up_it_is_free_air(self):
        lift, drag = near_ground(
            np.array(0.6),
            np.array(0.05),
            np.array(500.0),
            effect=GroundEffect(),
            aspect_ratio=7.53,
            taper=0.39,
            span=5.0,
        )
        assert (float(lift), float(drag)) == pytest.approx((0.6, 0.05), rel=1e-3)

    def test_the_height_that_counts_is_that_of_the_wing(self):
        wing = {"aspect_ratio": 7.53, "taper": 0.39, "span": 5.0}
        low = near_ground(
            np.array(0.6), np.array(0.05), np.array(1.5), effect=GroundEffect(wing_height=-0.5), **wing
        )
        assert low == near_ground(np.array(0.6), np.array(0.05), np.array(1.0), effect=GroundEffect(), **wing)


def test_the_air_is_that_of_the_standard_atmosphere():
    """ISO 2533: 1.225, 1.1117, 0.7361 and 0.3639 kg/m³ at 0, 1,000, 5,000 and 11,000 m."""
    np.testing.assert_allclose(
        air_density(np.array([0.0, 1000.0, 5000.0, 11000.0])), [1.225, 1.1117, 0.73612, 0.36392], rtol=2e-4
    )


def test_angles_of_the_flow_follow_from_the_velocity():
    frame = load_robot("airship_v7").airframe
    alpha, beta, speed = 0.1, -0.05, 28.0
    velocity = speed * np.array([np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)])
    air = flow_past(tuple(velocity), (np.array(0.1), np.array(0.2), np.array(0.3)), {}, frame)
    assert (float(air.factors["alpha"]), float(air.factors["beta"])) == pytest.approx((alpha, beta))
    assert float(air.speed) == pytest.approx(speed)
    assert float(air.factors["q"]) == pytest.approx(0.2 * 0.62 / 56.0)
