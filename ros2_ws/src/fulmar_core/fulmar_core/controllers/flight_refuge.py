"""Safe controller of aircraft: a wing cannot stop, so it flies on with level wings, holds its height, then descends."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_lqi import FlightLqi, FlightWeights, flight_lqi_weights
from fulmar_core.controllers.flight_stuck import REPLACED, StuckLqi, can_replace
from fulmar_core.robots.actuators.refuge import DOWN, Refuge
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import euler_of, from_euler, product
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.follow_reference import NOW
from fulmar_core.tasks.goal import goals_at

HOLD_S = 5.0  # for which the height is held: a controller that comes back within it finds the craft where it was [s]
SINK = 0.4  # of the descent [m/s]
LEAD_M = (
    0.2  # so far below the craft the height that it is to have may lie, where ground effect carries it [m]
)
ATTITUDE = 150.0  # weight of attitudes, per rad²
EASE_S = 2.0  # in which the sink rate grows: a step of it makes the craft dive before it descends [s]
DOWN_M, SURE_S = (
    0.05,
    0.3,
)  # nearer to the ground than this, over so long a time, its lowest point is down [m], [s]
HOLDS, DESCENDS = "holds its height", "descends with level wings"  # what it does before it is `DOWN`
MOST_SINK = 1.5  # of a craft with a stuck surface, which goes on sinking as it did [m/s]
BLIND = "measures no state and idles its motors"


class LevelDescent:
    """See `Refuge`. Without a measured state surfaces are neutral and throttles idle: nothing else is safe then."""

    longest_s = math.inf
    doing = HOLDS
    stuck: tuple[str, float] | None = None

    def __init__(self, robot: Robot, hz: float) -> None:
        """Solve for its gains.

        Args:
            robot: An aircraft.
            hz: How often `command` is called [Hz].

        Raises:
            ConfigError: It has no trim at its speed.
        """
        self._robot = robot
        task = load_task("fly_hold").fitted(robot)
        weights = descent_weights(robot)
        self._law = self._usual = FlightLqi(robot, task, weights, control_hz=hz)
        self._beside = StuckLqi(robot, task, weights, self._usual) if can_replace(robot) else None
        self._since_s = self._descends_s = math.inf

    def command(self, since_s: float, last: np.ndarray, state: RigidBodyState | None) -> np.ndarray:
        """See `Refuge.command`; a time that is not after that of the call before begins anew."""
        if state is None:
            self.doing = BLIND
            return self._robot.actuators.safe_command
        now = SpatialState.from_rigid(state)[None].in_float64()
        if since_s <= self._since_s:
            self._law = self._usual
            self._height, self._heading = float(now.z[0]), float(euler_of(now.quat)[2][0])
            self._law.reset()
            self._sent, self._since_s = np.asarray(last, dtype=float), since_s
            self._falls, self._fell, self.doing = 0.0, 0.0, HOLDS
            self._descends_s = HOLD_S
            # No craft is down by its first measurement alone, and one that is shows it within `SURE_S`.
            self._low = max(self._lowest(now), 2.0 * DOWN_M)
        self._bear(since_s, now)
        passed, self._since_s = since_s - self._since_s, since_s
        if self._is_down(now, passed):
            self.doing = DOWN
            return self._robot.actuators.safe_command
        if since_s <= self._descends_s:
            self.doing = HOLDS
        else:
            self.doing = DESCENDS
            self._falls = self._fell + (SINK - self._fell) * min(1.0, (since_s - self._descends_s) / EASE_S)
            self._height = max(self._height - self._falls * passed, float(now.z[0]) - LEAD_M)
        self._sent = self._answer(self._along(now))
        return self._sent

    def _bear(self, since_s: float, now: SpatialState) -> None:
        """Fly beside a rudder that stands, along the way of that moment: no controller comes back to hold for."""
        if (
            self.stuck is None
            or self.stuck[0] != REPLACED
            or self._beside is None
            or self._law is self._beside
        ):
            return
        self._law, self._beside.value = self._beside, self.stuck[1]
        self._law.reset()
        self._sent = self._sent.copy()
        self._sent[self._beside.number] = self.stuck[1]
        self._height, self._heading = float(now.z[0]), math.atan2(float(now.vy[0]), float(now.vx[0]))
        self._fell = min(max(-float(now.vz[0]), 0.0), MOST_SINK)
        self._descends_s = since_s

    def _lowest(self, state: SpatialState) -> float:
        """Height of the lowest point of the hull in level flight [m]."""
        return float(state.z[0]) + self._robot.hull_span[0]

    def _is_down(self, state: SpatialState, passed: float) -> bool:
        """Whether the craft lies on the ground, from where it does not come back by itself."""
        self._low += min(1.0, passed / SURE_S) * (self._lowest(state) - self._low)
        return self.doing == DOWN or self._low <= DOWN_M

    def _along(self, state: SpatialState) -> SpatialState:
        """The state in a world whose x axis is the heading at the beginning."""
        c, s = math.cos(self._heading), math.sin(self._heading)
        zero = np.zeros(1)
        back = from_euler(zero, zero, zero - self._heading)

        def turned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return c * x + s * y, c * y - s * x

        return SpatialState(
            *turned(state.x, state.y),
            state.z,
            *product(back, state.quat),
            *turned(state.vx, state.vy),
            state.vz,
            *state.rate,
        )

    def _answer(self, state: SpatialState) -> np.ndarray:
        target = np.zeros((1, 7))
        target[0, 1], target[0, 2], target[0, 6] = state.y[0], self._height, 1.0
        goal = goals_at(target)
        now = np.array([[0.0, 0.0, state.y[0], self._height, 0.0, 0.0, -self._falls]])
        dt = 1.0 / self._law.control_hz
        empty = np.zeros((1, 0))
        inputs = Inputs(state, replace(goal, things={NOW: now}), empty, self._sent[None], None, 0, dt)
        return np.asarray(self._robot.actuators.limited(self._law.command(inputs))[0])


def descent_weights(robot: Robot) -> FlightWeights:
    """Weights of the descent: level wings before the way, and an integral against what ground effect carries.

    It steers by the state as it is measured, without a filter that could be as lost as the controller.
    """
    return replace(
        flight_lqi_weights(robot),
        side=1e-3,
        side_integral=1e-6,
        attitude=ATTITUDE,
        error_limit=1.5 * LEAD_M,
        observer=None,
    )


def refuge_of(robot: Robot, hz: float) -> Refuge:
    """Safe controller of a robot, asked so often [Hz]: that of its actuators, or, of an aircraft, one that flies."""
    return robot.actuators.refuge if robot.kind.rests else LevelDescent(robot, hz)
