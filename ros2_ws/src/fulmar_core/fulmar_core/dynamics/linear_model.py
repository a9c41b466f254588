"""Linear models of a robot about any state, by central differences through the core's own dynamics.

In the plane x is the state itself. In space it is a departure of twelve numbers: position [m], rotation vector [rad],
velocity [m/s] and turn rate [rad/s], three each and in the body's frame (Solà, arXiv 1711.02508, §4: errors of the
attitude are local). Departures before a step are from the trim, those after it from where the step takes the trim.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.by_kind import actuation_of, dynamics_of
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import (
    Vector,
    exponential,
    minus,
    plus,
    product,
    rotation_error,
    turn,
    turn_back,
)
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import State
from fulmar_core.worlds.scenario import Scenario

DELTA = 1e-4  # of states and inputs, in their own units and in shares of full command
DEPARTURES = 12  # numbers of a departure in space


@dataclass(frozen=True)
class LinearModel:
    """x⁺ = A x + B u for small departures x of the state and u of the input."""

    a: np.ndarray  # (n, n), n = 6 in the plane, in the order of `PlanarState`, 12 in space
    b: np.ndarray  # (n, m)


def linearise(
    robot: Robot,
    state: State,
    command: np.ndarray,
    dt: float,
    worlds: Callable[[Robot, int], Any] | None = None,
) -> LinearModel:
    """Model of one control step, with commands as inputs, for every family.

    Commands count as applied: delay, slew and lag are of actuators that remember, and x has no room for what they do.
    Servos of wheels belong to the dynamics. On/off valves count as if they opened by degrees.

    Args:
        robot: A robot with its nominal body, in a still world.
        state: Where to linearise, shapes ().
        command: Held there, within the limits, shape (n,).
        dt: Time of one control step, a multiple of the physics step [s].
        worlds: So many worlds of the robot; `nominal_worlds` by default.

    Returns:
        A and B, the latter per unit of command.
    """
    actuators, command = robot.actuators, np.asarray(command, dtype=float)
    low, high = command - DELTA * actuators.scale, command + DELTA * actuators.scale
    if not actuators.binary:  # at an end of its range an actuator goes one way only
        low, high = np.maximum(low, actuators.lowest), np.minimum(high, actuators.scale)
    dynamics = dynamics_of(robot)
    steps = Steps(robot.timing.substeps(1.0 / dt), off_centre=any(robot.body.center_of_mass))

    def moved(states: Any, commands: np.ndarray) -> Any:
        count = commands.shape[1]
        world, still = (worlds or nominal_worlds)(robot, count), (np.zeros(count),) * 3
        actuation = actuation_of(robot, commands)
        actuation.begin(commands, world, None)
        return dynamics.move(states, actuation, world, still, steps)

    chart = CHARTS[type(state)](state, lambda trim: moved(trim, command[:, None]))
    each = np.tile(command[:, None], 2 * len(chart.trim))
    a = slopes(lambda x: chart.numbers(moved(chart.state(x), each)), chart.trim - DELTA, chart.trim + DELTA)
    held = chart.state(np.tile(chart.trim[:, None], 2 * len(command)))
    b = slopes(lambda commands: chart.numbers(moved(held, commands)), low, high, around=command)
    return LinearModel(a, b)


def linearise_wrench(robot: Robot, state: State, wrench: np.ndarray, dt: float) -> LinearModel:
    """Model of one control step with a wrench on the body as input, of robots that forces push.

    Args:
        robot: A robot with its nominal body, in a still world.
        state: Of the centre of mass, where to linearise, shapes ().
        wrench: Held there, about the centre of mass and in the body's frame: [F_x, F_y, M_z], shape (3,), or in space
            force and torque, shape (6,) [N, N·m].
        dt: Time of one control step, a multiple of the physics step [s].

    Returns:
        A and B.

    Raises:
        ConfigError: The robot rolls on wheels, which take no wrench.
    """
    dynamics = dynamics_of(robot)

    def moved(now: Any, inputs: np.ndarray) -> Any:
        world = nominal_worlds(robot, inputs.shape[1])
        for _ in range(robot.timing.substeps(1.0 / dt)):
            now = dynamics.under_wrench(now, inputs, world)
        return now

    wrench = np.asarray(wrench, dtype=float)
    chart = CHARTS[type(state)](state, lambda trim: moved(trim, wrench[:, None]))
    count, trim = len(chart.trim), np.concatenate((chart.trim, wrench))
    both = slopes(
        lambda x: chart.numbers(moved(chart.state(x[:count]), x[count:])), trim - DELTA, trim + DELTA
    )
    return LinearModel(both[:, :count], both[:, count:])


@dataclass(frozen=True)
class _Chart:
    """States near a trim as vectors."""

    trim: np.ndarray  # shape (n,)
    state: Callable[[np.ndarray], Any]  # from vectors (n, k) to states before a step, shapes (k,)
    numbers: Callable[[Any], np.ndarray]  # from states after it to vectors


def _in_plane(state: PlanarState, moved: Callable[[PlanarState], PlanarState]) -> _Chart:
    return _Chart(_columns(state), lambda x: PlanarState(*x), _columns)


def _in_space(state: SpatialState, moved: Callable[[SpatialState], SpatialState]) -> _Chart:
    before = state.in_float64().mapped(lambda column: column.reshape(1))
    after = moved(before)
    return _Chart(np.zeros(DEPARTURES), lambda x: _departed(before, x), lambda s: _departure(after, s))


# The vectors of a state; `moved` does the step with nothing but the trim, for states of shapes (1,).
CHARTS: dict[type[State], Callable[[Any, Callable[[Any], Any]], _Chart]] = {
    PlanarState: _in_plane,
    SpatialState: _in_space,
}


def _departed(trim: SpatialState, x: np.ndarray) -> SpatialState:
    """The states that depart from a trim by x, shape (12, k)."""
    place, rotation, velocity, rate = (_vector(x[i : i + 3]) for i in (0, 3, 6, 9))
    return SpatialState(
        *plus(trim.position, turn(trim.quat, place)),
        *product(trim.quat, exponential(rotation)),
        *plus(trim.velocity, turn(trim.quat, velocity)),
        *plus(trim.rate, rate),
    )


def _departure(trim: SpatialState, states: SpatialState) -> np.ndarray:
    """By what states depart from a trim, shape (12, k)."""
    return np.stack(
        (
            *turn_back(trim.quat, minus(states.position, trim.position)),
            *rotation_error(trim.quat, states.quat),
            *turn_back(trim.quat, minus(states.velocity, trim.velocity)),
            *minus(states.rate, trim.rate),
        )
    )


def _vector(rows: np.ndarray) -> Vector:
    return rows[0], rows[1], rows[2]


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


def nominal_worlds(robot: Robot, count: int) -> Any:
    """Worlds of the robot's dynamics without any disturbance."""
    return dynamics_of(robot, calm()).draw_world(calm(), Draws(0, np.zeros(count), np.zeros(count)))


def calm() -> Scenario:
    """A scenario in which nothing disturbs a nominal body, and sensors are perfect."""
    return Scenario("calm", sensor_noise=False, body="nominal")
