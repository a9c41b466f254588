"""Each family's numbers are found again in runs of the core's own batch, which the estimators do not share code with.

What moves here is `BatchSimulation` with its actuators, sensors and control steps; the models only share the dynamics.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.excite import Excite
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.identification.drives import drive_of
from fulmar_evaluation.identification.identify import Weight, calibration_of, identify
from fulmar_evaluation.identification.model import Known
from tests.inputs import inputs_of

PLATFORM, BOAT, BASE = (load_robot(name) for name in ("floating_platform", "kingfisher", "turtlebot2"))


def driven(true, nominal, *, duration_s=60.0, seed=1, load=0, spoil=None):
    """A run of a true robot under excitation by somebody who knows the nominal one."""
    simulation = BatchSimulation(
        true, load_task("go_to_position"), load_scenario("nominal"), worlds=1, seed=seed, dtype=np.float64
    )
    controller = Excite(nominal, load_task("go_to_position"))
    times, poses, commands = [0.0], [simulation.measured], []
    for step in range(round(duration_s / simulation.control_dt)):
        simulation.step(controller.act(inputs_of(simulation)))
        times.append((step + 1) * simulation.control_dt)
        poses.append(simulation.measured)
        commands.append(simulation.command[0])
    xy = np.array([[pose.x[0], pose.y[0]] for pose in poses])
    yaw = np.array([pose.yaw[0] for pose in poses])
    if spoil is not None:
        xy[spoil] += 1.0
    return drive_of(
        "run",
        np.array(times),
        np.column_stack((xy, yaw)),
        np.array(times[:-1]),
        np.array(commands),
        load=load,
    )


def platform(*, thrust=1.15, mass=4.9, inertia=0.16, center=(0.012, -0.007), delay=0.06, opening=0.02):
    actuators, response = PLATFORM.actuators, PLATFORM.actuators.response
    return replace(
        PLATFORM,
        body=replace(PLATFORM.body, mass=mass, inertia=(inertia,) * 3, center_of_mass=center),
        actuators=replace(
            actuators, thrust=thrust, response=replace(response, delay_s=delay, opening_delay_s=opening)
        ),
    )


@pytest.fixture(scope="module")
def bare():
    return driven(platform(), PLATFORM, duration_s=120.0)


@pytest.fixture(scope="module")
def heavy():
    return driven(platform(mass=6.9, inertia=0.21, center=(0.03, 0.02)), PLATFORM, seed=2, load=1)


def check(found, **truth):
    for name, value in truth.items():
        e = found.fit.estimates[name]
        assert e.low <= e.value <= e.high
        width = max(e.high - e.low, 1e-3 * abs(value))
        assert e.low - 0.5 * width <= value <= e.high + 0.5 * width, (name, value, e)


@pytest.fixture(scope="module")
def with_ballast(bare, heavy):
    return identify(PLATFORM, [bare, heavy], ballasts={1: Weight(2.0, 0.002)})


def test_a_ballast_determines_mass_thrust_inertia_centre_and_delays(with_ballast):
    found = with_ballast
    assert found.trusted
    check(
        found,
        mass=4.9,
        thrust=1.15,
        yaw_inertia=0.16,
        center_of_mass_x=0.012,
        center_of_mass_y=-0.007,
        delay=0.06,
        opening_delay=0.02,
        yaw_inertia_with_ballast_1=0.21,
    )
    for name, value in (("mass", 4.9), ("thrust", 1.15), ("yaw_inertia", 0.16)):
        assert found.fit.estimates[name].value == pytest.approx(value, rel=0.03)


def test_a_known_mass_determines_thrust_and_inertia_from_one_run(bare):
    found = identify(PLATFORM, [bare], known=[Known("mass", 4.9, 0.005)])
    assert found.trusted
    check(found, thrust=1.15, yaw_inertia=0.16)
    thrust = found.fit.estimates["thrust"]
    assert (thrust.high - thrust.low) / thrust.value < 0.02


def test_a_known_thrust_determines_the_mass(bare):
    found = identify(PLATFORM, [bare], known=[Known("thrust", 1.15, 0.002)])
    assert found.trusted
    check(found, mass=4.9, yaw_inertia=0.16)


def test_without_either_the_intervals_are_as_wide_as_what_the_robot_s_file_knows_of_its_mass(bare):
    found = identify(PLATFORM, [bare])
    assert not found.trusted
    assert "--known mass" in found.scale and "--ballast" in found.scale
    mass, thrust, inertia = (found.fit.estimates[name] for name in ("mass", "thrust", "yaw_inertia"))
    low, high = PLATFORM.uncertainty.mass
    assert mass.low < low + 0.1 and mass.high > high - 0.1
    assert (thrust.high - thrust.low) / thrust.value > 0.15
    assert thrust.value / mass.value == pytest.approx(1.15 / 4.9, rel=0.01)
    assert thrust.value / inertia.value == pytest.approx(1.15 / 0.16, rel=0.01)


def test_poses_that_are_far_off_do_no_harm():
    spoilt = driven(platform(), PLATFORM, spoil=[40, 41, 133])
    found = identify(PLATFORM, [spoilt], known=[Known("mass", 4.9, 0.005)])
    assert found.fit.estimates["thrust"].value == pytest.approx(1.15, rel=0.02)


def test_the_drag_of_a_boat_is_found_at_the_speeds_it_goes():
    water = replace(
        BOAT.hydrodynamics,
        linear_damping=(3.0, 80.0, 99.99, 13.0, 13.0, 7.0),
        quadratic_damping=(21.0, 120.0, 10.0, 5.0, 5.0, 13.0),
    )
    found = identify(BOAT, [driven(replace(BOAT, hydrodynamics=water), BOAT, duration_s=100.0)])
    at = {name: e.value for name, e in found.fit.estimates.items()}
    for axis, speed, linear, quadratic in (
        ("surge", 1.0, 3.0, 21.0),
        ("sway", 0.1, 80.0, 120.0),
        ("yaw", 0.3, 7.0, 13.0),
    ):
        drag = at[f"{axis}_linear_drag"] * speed + at[f"{axis}_quadratic_drag"] * speed**2
        assert drag == pytest.approx(linear * speed + quadratic * speed**2, rel=0.1), axis
    assert at["mass"] == pytest.approx(BOAT.body.mass, rel=0.03)
    assert at["yaw_inertia"] == pytest.approx(BOAT.body.inertia[2], rel=0.05)


def test_wheel_scale_and_turn_scale_are_found():
    response = replace(BASE.actuators.response, gain=(1.04, 0.96), delay_s=0.04)
    true = replace(BASE, actuators=replace(BASE.actuators, response=response))
    found = identify(BASE, [driven(true, BASE)])
    assert found.fit.estimates["wheel_scale"].value == pytest.approx(1.04, rel=0.005)
    assert found.fit.estimates["turn_scale"].value == pytest.approx(0.96, rel=0.005)
    assert found.fit.estimates["delay"].value == pytest.approx(0.04, abs=0.01)


def test_a_calibration_made_of_them_says_the_same_and_leaves_the_ballast_out(with_ballast):
    found = with_ballast
    calibration = calibration_of(PLATFORM, found, ["a", "b"])
    assert calibration.runs == ("a", "b")
    assert "ballast_1" not in calibration.measured
    assert calibration.mass.value == found.fit.estimates["mass"].value


@pytest.mark.parametrize(
    ("robot", "more", "message"),
    [
        ("leatherback", {}, "there is no model to identify 'leatherback'"),
        ("turtlebot2", {"ballasts": {1: Weight(2.0)}}, "--ballast is for robots with thrusters"),
        (
            "floating_platform",
            {"known": [Known("mas", 5.0, 0.1)]},
            "unknown quantity 'mas'. Did you mean 'mass'",
        ),
    ],
)
def test_what_cannot_be_asked_is_refused_in_words(bare, robot, more, message):
    with pytest.raises(ConfigError, match=message.replace("?", r"\?")):
        identify(load_robot(robot), [bare], **more)


def test_a_robot_that_stood_still_determines_nothing():
    t = np.arange(0.0, 30.0, 0.02)
    rng = np.random.default_rng(0)
    still = drive_of(
        "still", t, np.column_stack((1e-3 * rng.normal(size=(len(t), 2)), 0.0 * t)), t[:1], np.zeros((1, 8))
    )
    with pytest.raises(ConfigError, match="do not distinguish every quantity"):
        identify(PLATFORM, [still], known=[Known("mass", 5.3, 0.01)])
