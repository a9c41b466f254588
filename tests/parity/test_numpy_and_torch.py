"""The same worlds in NumPy and in torch, on the processor and, where there is one, on a graphics card."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.new_robots import new_robot
from tests.pairs import covering
from tests.spaces import robot_for

torch = pytest.importorskip("torch")

ROBOTS, TASKS = config_names("robots"), config_names("tasks")
RANDOMISED = load_scenario("randomised")
WORLDS, STEPS = 32, 30
# Rounding of some thousand operations on numbers of up to ten; a thruster robot that nobody steers spins fast.
CLOSE = {"float64": 1e-11, "float32": 2e-4}
CASES = list(itertools.product(ROBOTS, CLOSE))


def trajectory(robot, task, library, dtype, device=None):
    """States and observations of some worlds under commands that are the same everywhere, with resets in between."""
    kind = getattr(library, dtype)
    simulation = BatchSimulation(
        robot, task, RANDOMISED, worlds=WORLDS, seed=5, xp=library, device=device, dtype=kind
    )
    rng = np.random.default_rng(6)
    seen = []
    for k in range(STEPS):
        command = (
            rng.uniform(-1.0, 1.0, (WORLDS, len(robot.actuators.names))) * robot.actuators.scale
        ).astype(dtype)
        simulation.step(command if library is np else torch.as_tensor(command, device=device))
        if k % 17 == 9:
            simulation.reset([1, 3, 5 + k % 4])
        for values in (*simulation.truth.columns(), simulation.observe()):
            if library is not np:
                assert values.dtype == kind
                values = values.cpu().numpy()
            seen.append(np.reshape(values, (WORLDS, -1)))
    return np.concatenate(seen, axis=1)


def assert_alike(robot, task, dtype, device):
    ours = trajectory(robot, task, np, dtype)
    theirs = trajectory(robot, task, torch, dtype, device)
    assert np.isfinite(ours).all()
    close = CLOSE[dtype]
    if task.sees_obstacles:  # beside a disc its tangent turns with the root of the distance, as does rounding
        close = max(close, float(np.sqrt(np.finfo(dtype).eps)))
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=close)


def busiest(robot):
    """The task of the robot's space that computes most."""
    in_plane = robot.state_type is PlanarState
    return load_task("go_to_position_with_obstacles" if in_plane else "go_through_poses_3d")


@pytest.mark.parametrize(
    ("name", "dtype"),
    [
        pytest.param(
            *case,
            marks=() if case in covering(CASES) else pytest.mark.slow,
        )
        for case in CASES
    ],
)
def test_torch_moves_every_robot_as_numpy_does(name, dtype):
    robot = load_robot(name)
    assert_alike(robot, busiest(robot), dtype, "cpu")


@pytest.mark.parametrize("dtype", CLOSE)
def test_torch_moves_fans_as_numpy_does(dtype):
    assert_alike(new_robot("fan_disc"), load_task("go_to_position_with_obstacles"), dtype, "cpu")


@pytest.mark.parametrize("name", TASKS)
def test_torch_plays_every_task_as_numpy_does(name):
    task = load_task(name)
    assert_alike(robot_for(task, load_robot("leatherback")), task, "float64", "cpu")


ON_A_CARD = pytest.mark.skipif(
    not torch.cuda.is_available(),
    reason="needs an NVIDIA card; the same comparison runs above on the processor",
)


@ON_A_CARD
@pytest.mark.parametrize("dtype", CLOSE)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_graphics_card_moves_every_robot_as_numpy_does(name, dtype):
    robot = load_robot(name)
    assert_alike(robot, busiest(robot), dtype, "cuda")


@ON_A_CARD
@pytest.mark.parametrize("name", TASKS)
def test_a_graphics_card_plays_every_task_as_numpy_does(name):
    task = load_task(name)
    assert_alike(robot_for(task, load_robot("leatherback")), task, "float64", "cuda")
