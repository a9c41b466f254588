"""A body in space is identified from its motion: mass, three moments of inertia, thrust and centre of mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.calibration import calibrated
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.identification.drives import Drive, drive_of
from fulmar_evaluation.identification.identify import Weight, calibration_of, identify
from fulmar_evaluation.identification.model import Known

TRUE = {
    "thrust": 0.9,
    "mass": 5.7,
    "roll_inertia": 0.18,
    "pitch_inertia": 0.22,
    "yaw_inertia": 0.25,
    "center_of_mass_x": 0.01,
    "center_of_mass_y": -0.015,
    "center_of_mass_z": 0.02,
}
STEP_S, HELD = 0.04, 15


@pytest.fixture(scope="module")
def nominal() -> Robot:
    return load_robot("spacecraft_16")


@pytest.fixture(scope="module")
def drive(nominal) -> Drive:
    """Half a minute of it."""
    return driven(nominal, 30.0)


def driven(nominal, seconds: float) -> Drive:
    """A run under random valves of a body that is not the nominal one, with its sensors' noise."""
    body = replace(
        nominal.body,
        mass=TRUE["mass"],
        inertia=(TRUE["roll_inertia"], TRUE["pitch_inertia"], TRUE["yaw_inertia"]),
        center_of_mass=tuple(TRUE[f"center_of_mass_{axis}"] for axis in "xyz"),
    )
    robot = replace(nominal, body=body, actuators=replace(nominal.actuators, thrust=TRUE["thrust"]))
    task, calm = load_task("go_to_pose_3d"), load_scenario("nominal")
    simulation = BatchSimulation(
        robot, task, calm, worlds=1, seed=4, control_hz=1.0 / STEP_S, dtype=np.float64
    )
    rng, poses, commands = np.random.default_rng(1), [], []
    for step in range(round(seconds / STEP_S)):
        state = simulation.measured[0].to_rigid()
        poses.append((*state.position_in_world, *state.quat_xyzw))
        if step % HELD == 0:
            command = _chosen(rng, robot, state.angular_velocity_in_body)
        commands.append(command)
        simulation.step(command[None])
    time_s = STEP_S * np.arange(len(poses))
    return drive_of("run", time_s, np.array(poses), time_s, np.array(commands))


def _chosen(rng: np.random.Generator, robot: Robot, rate: np.ndarray) -> np.ndarray:
    """Of four random commands the one that turns the body least: at random alone it would tumble ever faster."""
    commands = np.zeros((4, 16))
    for command in commands:
        command[rng.choice(16, size=rng.integers(1, 4), replace=False)] = 1.0
    turned = robot.actuators.wrench_in_body(commands)[1] / robot.body.inertia[:3] * (HELD * STEP_S)
    return commands[np.argmin(np.linalg.norm(rate + turned, axis=1))]


def test_half_a_minute_finds_a_body_roughly(nominal, drive):
    found = identify(nominal, [drive], known=[Known("mass", TRUE["mass"], 0.01)])
    for name, true in TRUE.items():
        estimate = found.fit.estimates[name]
        assert estimate.value == pytest.approx(true, rel=0.1, abs=0.005), name
        assert estimate.low < estimate.value < estimate.high, name


@pytest.mark.slow
def test_a_body_in_space_is_found_within_its_intervals(nominal):
    found = identify(nominal, [driven(nominal, 120.0)], known=[Known("mass", TRUE["mass"], 0.01)])
    assert found.trusted
    for name, true in TRUE.items():
        estimate = found.fit.estimates[name]
        assert estimate.value == pytest.approx(true, rel=0.01, abs=0.001), name
        assert estimate.low - 1e-3 * abs(true) <= true <= estimate.high + 1e-3 * abs(true), name
        assert estimate.high - estimate.low < 0.15 * abs(true) + 0.01, name
    assert len(found.channels) == len(found.fit.noise) == 7
    robot = calibrated(nominal, calibration_of(nominal, found))
    assert robot.body.mass == found.fit.estimates["mass"].value
    assert robot.body.inertia[:2] == tuple(
        found.fit.estimates[name].value for name in ("roll_inertia", "pitch_inertia")
    )
    assert len(robot.body.center_of_mass) == 3


def test_a_sign_of_the_quaternion_says_nothing(nominal, drive):
    flipped = np.where(np.arange(len(drive.pose)) % 7 < 3, -0.5, 0.5)[:, None] * drive.pose[:, 3:]
    pose = np.concatenate((drive.pose[:, :3], flipped), axis=1)
    again = drive_of("run", drive.time_s, pose, drive.switch_s, drive.command)
    np.testing.assert_allclose(again.pose[:, 3:], -drive.pose[:, 3:], err_msg="as the first pose has it")


def test_a_ballast_in_space_is_refused(nominal, drive):
    with pytest.raises(ConfigError, match="--ballast is for robots that move on a floor or on water"):
        identify(nominal, [drive, replace(drive, load=1)], ballasts={1: Weight(1.0)})
