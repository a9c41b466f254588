"""Linear models of a robot about any state, by central differences through the core's own dynamics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fulmar_core.actuators.rolling import Rolling
from fulmar_core.counter_rng import Draws
from fulmar_core.disturbances.scenario import Scenario, draw_world
from fulmar_core.disturbances.world import World
from fulmar_core.dynamics.free_body import free_body_step
from fulmar_core.errors import ConfigError
from fulmar_core.motion import actuation_of, move
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot

DELTA = 1e-4  # of states and inputs, in their own units and in shares of full command
STATES = len(PlanarState.COLUMNS)


@dataclass(frozen=True)
class LinearModel:
    """x⁺ = A x + B u for small departures x of the state and u of the input; states as in `PlanarState`."""

    a: np.ndarray  # (6, 6)
    b: np.ndarray  # (6, m)


def linearise(robot: Robot, state: PlanarState, command: np.ndarray, dt: float) -> LinearModel:
    """Model of one control step, with commands as inputs, for every family.

    Commands count as applied: delay, slew and lag are of actuators that remember, and x has no room for what they do.
    Servos of wheels belong to the dynamics. On/off valves count as if they opened by degrees.

    Args:
        robot: A robot with its nominal body, in a still world.
        state: Where to linearise, shapes ().
        command: Held there, within the limits, shape (n,).
        dt: Time of one control step, a multiple of the physics step [s].

    Returns:
        A (6, 6) and B (6, n), the latter per unit of command.
    """
    actuators, command = robot.actuators, np.asarray(command, dtype=float)
    low, high = command - DELTA * actuators.scale, command + DELTA * actuators.scale
    if not actuators.binary:  # at an end of its range an actuator goes one way only
        low, high = np.maximum(low, actuators.lowest), np.minimum(high, actuators.scale)
    off_centre = any(robot.body.center_of_mass)

    def moved(states: np.ndarray, commands: np.ndarray) -> np.ndarray:
        world = nominal_worlds(robot, states.shape[1])
        actuation = actuation_of(robot, commands)
        actuation.begin(commands, world, None)
        still = (np.zeros(states.shape[1]),) * 3
        after = move(
            robot,
            PlanarState(*states),
            actuation,
            world,
            still,
            substeps=robot.timing.substeps(1.0 / dt),
            latest_s=0.0,
            off_centre=off_centre,
        )
        return _columns(after)

    trim = _columns(state)
    each = np.tile(command[:, None], 2 * STATES)
    a = slopes(lambda states: moved(states, each), trim - DELTA, trim + DELTA)
    held = np.tile(trim[:, None], 2 * len(command))
    b = slopes(lambda commands: moved(held, commands), low, high, around=command)
    return LinearModel(a, b)


def linearise_wrench(robot: Robot, state: PlanarState, wrench: np.ndarray, dt: float) -> LinearModel:
    """Model of one control step with a wrench on the body as input, of robots that forces push.

    Args:
        robot: A robot with its nominal body, in a still world.
        state: Of the centre of mass, where to linearise, shapes ().
        wrench: Held there, about the centre of mass and in the body's frame, [F_x, F_y, M_z], shape (3,) [N, N, N·m].
        dt: Time of one control step, a multiple of the physics step [s].

    Returns:
        A (6, 6) and B (6, 3).

    Raises:
        ConfigError: The robot rolls on wheels, which take no wrench.
    """
    if isinstance(robot.actuators, Rolling):
        raise ConfigError(
            f"'{robot.name}' rolls on wheels, which take commands and no wrench. Use `linearise`, whose inputs are "
            "commands."
        )
    trim = np.concatenate((_columns(state), wrench))

    def moved(inputs: np.ndarray) -> np.ndarray:
        count = inputs.shape[1]
        world, still = nominal_worlds(robot, count), (np.zeros(count),) * 3
        now, push = PlanarState(*inputs[:STATES]), (inputs[6], inputs[7], inputs[8])
        for _ in range(robot.timing.substeps(1.0 / dt)):
            now = free_body_step(now, push, still, world, robot.hydrodynamics, robot.timing.physics_dt)
        return _columns(now)

    both = slopes(moved, trim - DELTA, trim + DELTA)
    return LinearModel(both[:, :STATES], both[:, STATES:])


def slopes(
    function: Callable[[np.ndarray], np.ndarray],
    low: np.ndarray,
    high: np.ndarray,
    *,
    around: np.ndarray | None = None,
    spans: np.ndarray | None = None,
) -> np.ndarray:
    """Change of a function per change of each input alone, shape (m, n).

    Args:
        function: From inputs (n, k) to results (m, k).
        low: Smallest value of each input, shape (n,).
        high: Largest, shape (n,).
        around: What the others stay at, shape (n,); halfway by default.
        spans: What counts as the change of each input, shape (n,); from low to high by default.
    """
    count = len(low)
    middle = 0.5 * (low + high) if around is None else around
    inputs = np.tile(middle[:, None], 2 * count)
    diagonal = np.arange(count)
    inputs[diagonal, diagonal], inputs[diagonal, count + diagonal] = high, low
    results = function(inputs)
    spans = high - low if spans is None else spans
    return np.asarray((results[:, :count] - results[:, count:]) / spans)


def _columns(state: PlanarState) -> np.ndarray:
    """Shape (6, ...)."""
    return np.stack([np.asarray(getattr(state, name), dtype=float) for name in PlanarState.COLUMNS])


def nominal_worlds(robot: Robot, count: int) -> World:
    """Worlds without any disturbance."""
    calm = Scenario("calm", sensor_noise=False, body="nominal")
    return draw_world(robot, calm, Draws(0, np.zeros(count), np.zeros(count)))
