"""A body that blows its gas out gets lighter by what its impulse costs, and moves as one whose mass falls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from fulmar_core.robots.actuators.tank import GRAVITY
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend

CUBESAT, PLATFORM = load_robot("cubesat_8"), load_robot("floating_platform")
TANK, IDEAL = CUBESAT.actuators.tank, load_scenario("ideal")
BACKENDS = pytest.mark.parametrize("backend", [MockBackend, MujocoBackend])
CONTROL_S = CUBESAT.timing.control_s
SECONDS = 20.0


def light(robot, steps=1):
    """The robot with nozzles so poor that they take fourteen times as much gas, simulated in finer steps."""
    actuators = replace(robot.actuators, tank=replace(TANK, specific_impulse=5.0))
    timing = replace(robot.timing, physics_dt=robot.timing.physics_dt / steps)
    return replace(robot, actuators=actuators, timing=timing)


def openings(robot, steps):
    """Valves that change every half second, shape (steps, n)."""
    rng = np.random.default_rng(0)
    return np.repeat(rng.uniform(size=(steps // 5, len(robot.actuators.names))), 5, axis=0)


def flight(backend, robot, task="go_to_pose_3d", seconds=SECONDS):
    """The first true state, the last one, the commands and the mass lost [kg]."""
    simulator = backend(robot)
    episode = draw_episode(robot, load_task(task), IDEAL, seed=3, number=1)
    first = simulator.reset(episode, seed=0).truth
    ticks = robot.timing.substeps(robot.timing.control_hz)
    commands = robot.actuators.limited(openings(robot, round(seconds * robot.timing.control_hz)))
    for command in commands:
        last = simulator.step(command, ticks).truth
    return first, last, commands, float(simulator._world.actuation.lost[0])


def integrated(robot, first, commands):
    """Position, velocity and turn rate by another integrator, of the equations of a body whose mass falls."""
    wrenches, inertia, mass = robot.actuators.wrench_per_newton, robot.body.inertia_matrix, robot.body.mass
    tank = robot.actuators.tank
    state = np.concatenate(
        [
            first.position_in_world,
            first.velocity_in_world,
            first.quat_xyzw,
            first.angular_velocity_in_body,
            [0.0],
        ]
    )
    for command in commands:
        force, torque = np.split(robot.actuators.thrust * command @ wrenches, 2)
        flow = robot.actuators.thrust * command.sum() / (tank.specific_impulse * GRAVITY)

        def slopes(_time, now, force=force, torque=torque, flow=flow):
            velocity, quat, rate, lost = now[3:6], now[6:10], now[10:13], now[13]
            share = 1.0 - lost / mass
            moved = Rotation.from_quat(quat).apply(force) / (share * mass)
            turned = np.linalg.solve(share * inertia, torque - np.cross(rate, share * inertia @ rate))
            x, y, z, w = quat
            p, q, r = rate
            spun = 0.5 * np.array(
                [
                    w * p + y * r - z * q,
                    w * q + z * p - x * r,
                    w * r + x * q - y * p,
                    -x * p - y * q - z * r,
                ]
            )
            return np.concatenate([velocity, moved, spun, turned, [flow]])

        state = solve_ivp(slopes, (0.0, CONTROL_S), state, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    return state


@BACKENDS
def test_the_mass_lost_is_the_impulse_by_the_specific_impulse(backend):
    _, _, commands, lost = flight(backend, CUBESAT)
    impulse = CUBESAT.actuators.thrust * commands.sum() * CONTROL_S
    assert lost * TANK.specific_impulse * GRAVITY == pytest.approx(impulse, rel=1e-9)
    assert lost > 0.1


def errors(backend, steps, seconds):
    """How far velocity [m/s] and turn rate [rad/s] are from those of another integrator, and both results."""
    robot = light(CUBESAT, steps)
    first, last, commands, lost = flight(backend, robot, seconds=seconds)
    state = integrated(robot, first, commands)
    assert lost == pytest.approx(state[13], rel=1e-9)
    assert lost > 0.004 * seconds * robot.body.mass
    apart = [last.velocity_in_world - state[3:6], last.angular_velocity_in_body - state[10:13]]
    return *(float(np.abs(each).max()) for each in apart), last, state


@BACKENDS
def test_a_body_whose_mass_falls_moves_as_another_integrator_says(backend):
    """A twentieth of the body leaves."""
    velocity, rate, _, _ = errors(backend, 1, 10.0)
    assert max(velocity, rate) < 1e-6


@BACKENDS
def test_its_energy_and_momentum_come_to_those_of_another_integrator_in_finer_steps(backend):
    """What is left at the robot's own step is of second order, in a force that turns within the step."""
    coarse, _, _, _ = errors(backend, 1, 4.0)
    fine, rate, last, state = errors(backend, 8, 4.0)
    assert fine < coarse / 40.0
    assert max(fine, rate) < 1e-6
    mass = CUBESAT.body.mass - state[13]
    inertia = mass / CUBESAT.body.mass * CUBESAT.body.inertia_matrix
    ours, theirs = (
        (velocity, mass * velocity, spin, inertia @ spin)
        for velocity, spin in (
            (last.velocity_in_world, last.angular_velocity_in_body),
            (state[3:6], state[10:13]),
        )
    )
    energies = [0.5 * (one[0] @ one[1] + one[2] @ one[3]) for one in (ours, theirs)]
    assert energies[0] == pytest.approx(energies[1], rel=1e-6)
    for part in (1, 3):  # momentum [kg·m/s] and angular momentum [N·m·s]
        gap = np.linalg.norm(ours[part] - theirs[part])
        assert gap < 1e-6 * np.linalg.norm(theirs[part])


@pytest.mark.parametrize(
    ("robot", "task"), [(CUBESAT, "go_to_pose_3d"), (PLATFORM, "go_to_pose")], ids=["space", "plane"]
)
def test_batch_and_mujoco_lose_mass_alike_in_plane_and_space(robot, task):
    tank = replace(robot.actuators.tank, specific_impulse=5.0, weighs=True, leak=0.0)
    robot = replace(robot, actuators=replace(robot.actuators, tank=tank))
    (_, core, commands, lost), (_, mujoco, _, _) = (
        flight(backend, robot, task, 5.0) for backend in (MockBackend, MujocoBackend)
    )
    batch = BatchSimulation(robot, load_task(task), IDEAL, worlds=2, seed=3, dtype=np.float64)
    for command in commands:
        batch.move(np.tile(command, (2, 1)))
    alone = batch.truth[1].to_rigid()
    assert float(batch._actuation.lost[1]) == pytest.approx(lost, rel=1e-12)
    for field in ("position_in_world", "velocity_in_world", "angular_velocity_in_body"):
        np.testing.assert_allclose(getattr(alone, field), getattr(core, field), rtol=0, atol=1e-9)
        np.testing.assert_allclose(getattr(mujoco, field)[:2], getattr(core, field)[:2], rtol=0, atol=2e-4)
    assert lost > 0.002 * robot.body.mass


def test_the_next_episode_begins_with_a_full_tank():
    batch = BatchSimulation(CUBESAT, load_task("go_to_pose_3d"), IDEAL, worlds=2, seed=3)
    for _ in range(10):
        batch.move(np.ones((2, 8)))
    batch.reset([0])
    lost = batch._actuation.lost
    assert lost[0] == 0.0
    assert lost[1] == pytest.approx(8.0 / (70.0 * GRAVITY), rel=1e-3)


def test_a_body_that_weighs_less_than_its_gas_is_refused():
    with pytest.raises(ValueError, match=r"'tank' holds 1 kg, and the whole body has 'mass' = 0\.9 kg"):
        replace(CUBESAT, body=replace(CUBESAT.body, mass=0.9))
