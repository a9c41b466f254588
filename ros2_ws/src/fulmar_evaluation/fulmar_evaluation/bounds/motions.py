"""How fast a robot can go ahead while it turns: corners of its steady speeds and turn rates."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fulmar_core.robots.actuators.ackermann import Ackermann
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.propellers import Propellers
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot import Robot
from fulmar_core.states.gravity import GRAVITY
from fulmar_evaluation.bounds.surge import Surge

# Where curved edges are cut into corners: of the fastest turn, and astern of the fastest on the spot.
_SHARES = (0.2, 0.45, 0.7, 0.87, 1.0)
_SHARES_ASTERN = (0.4, 0.75, 0.95)
_SHORTER_IN_WATER = 0.95  # `Motions.shorter`, where speed is lost in turns
_NO_DRAG = 1e-6  # of 1 kg on wheels [N per (m/s)²]: so little that `Surge` needs no equations without drag


@dataclass(frozen=True)
class Motions:
    """Speeds and turn rates that a robot can hold; turning right is the mirror image of turning left."""

    ahead: float  # top speed straight ahead [m/s]
    astern: float  # top speed straight astern, 0: it cannot [m/s]
    turns: tuple[tuple[float, float], ...]  # speed ahead [m/s] and turn rate > 0 [rad/s] of each corner
    surge: Surge | None = None  # what stopping costs; None: nothing
    shorter: float = 0.98  # factor on all times: what grids, and turns of one radius each, may cost; measured

    def __post_init__(self) -> None:
        """Refuse robots that cannot move or turn."""
        if not (self.ahead > 0.0 and self.astern >= 0.0 and self.turns):
            raise ValueError("'ahead' must be greater than 0, 'astern' not negative, and 'turns' not empty.")
        if any(rate <= 0.0 for _, rate in self.turns):
            raise ValueError("every turn rate must be greater than 0.")

    @property
    def both_ways(self) -> np.ndarray:
        """Speeds and turn rates to the left, then to the right, shape (2 n, 2)."""
        left = np.array(self.turns)
        return np.concatenate((left, left * [1.0, -1.0]))


def in_water(robot: Robot, propellers: Propellers) -> Motions | None:
    """Along the edge of what all propellers can do together, from the largest force to the largest moment and back.

    Surge and yaw drag balance the thrusts; that a turning boat also slides sideways, slower and in a tighter circle, is
    left out. None for a robot that nothing in the water slows down.
    """
    water = robot.hydrodynamics
    if water is None:
        return None
    arms = propellers.lever_arms
    least, most = propellers.curve[0], propellers.curve[-1]
    (du, _, _, _, _, dr), (qu, _, _, _, _, qr) = water.linear_damping, water.quadratic_damping
    if du + qu <= 0.0 or dr + qr <= 0.0 or not arms.any():
        return None

    def speed(force: float) -> float:
        return float(np.sign(force)) * _balance(du, qu, abs(force))

    def turning(rate: float, sign: float) -> tuple[float, float]:
        moment = (dr + qr * rate) * rate
        return speed(_force(arms, least, most, moment, sign)), rate

    fastest = _balance(dr, qr, float(np.sum(np.where(arms > 0.0, most, least) * arms)))
    on_the_spot = _balance(dr, qr, _largest_moment(arms, least, most))
    turns = [turning(share * fastest, 1.0) for share in _SHARES if fastest > 0.0]
    if on_the_spot > 0.0:
        turns += [turning(share * on_the_spot, -1.0) for share in _SHARES_ASTERN]
        turns.append((0.0, on_the_spot))
    if not turns:
        return None
    ahead, astern = most * len(arms), -least * len(arms)
    motions = Motions(speed(ahead), max(-speed(-astern), 0.0), tuple(turns))
    if du != 0.0 or astern <= 0.0:
        return motions
    surge = Surge(robot.body.mass + water.planar_added_mass[0], qu, ahead, astern)
    return replace(motions, surge=surge, shorter=_SHORTER_IN_WATER)


def _balance(linear: float, quadratic: float, push: float) -> float:
    """Speed at which (linear + quadratic speed) speed equals a push, all >= 0."""
    if quadratic == 0.0:
        return push / linear
    return float((np.sqrt(linear**2 + 4.0 * quadratic * push) - linear) / (2.0 * quadratic))


def _force(arms: np.ndarray, least: float, most: float, moment: float, sign: float) -> float:
    """Largest force ahead (sign 1) or astern (-1) of propellers that together turn with a moment."""
    from scipy.optimize import linprog

    found = linprog(-sign * np.ones(len(arms)), A_eq=arms[None], b_eq=[moment], bounds=(least, most))
    return float(np.sum(np.asarray(found.x))) if found.success else 0.0


def _largest_moment(arms: np.ndarray, least: float, most: float) -> float:
    """Largest moment of propellers whose forces cancel."""
    from scipy.optimize import linprog

    found = linprog(-arms, A_eq=np.ones((1, len(arms))), b_eq=[0.0], bounds=(least, most))
    return float(np.sum(arms * np.asarray(found.x))) if found.success else 0.0


def _rolling(robot: Robot, wheels: Rolling) -> Surge:
    """Wheels on a straight, by their slew, or by their motors' force if that is less.

    The lag of their servos changes no speed faster.
    """
    most = min((wheels.pull / robot.body.mass, *wheels.response.slew[:1]))
    return Surge(1.0, _NO_DRAG, most, most)


def on_two_wheels(robot: Robot, drive: DifferentialDrive) -> Motions:
    """Corners of the box of speed and turn rate, cut where a wheel would be too fast."""
    half, rim = 0.5 * drive.track, drive.max_wheel_speed * drive.wheel_radius
    top, turn = min(drive.max_speed, rim), min(drive.max_yaw_rate, rim / half)
    corners = [(min(top, rim - half * turn), turn), (top, min(turn, (rim - top) / half))]
    both = [(sign * v, w) for v, w in corners for sign in (1.0, -1.0)]
    both.append((0.0, turn))
    turns = tuple(dict.fromkeys((v, w) for v, w in both if w > 0.0))
    return Motions(top, top, turns, _rolling(robot, drive))


def on_steered_wheels(robot: Robot, car: Ackermann) -> Motions:
    """The tightest circle, as fast as the tyres hold, and wider ones at higher speeds."""
    tightest, grip = np.tan(car.max_steering) / car.wheelbase, car.friction * GRAVITY
    turns = []
    for speed in np.linspace(min(car.max_speed, np.sqrt(grip / tightest)), car.max_speed, 4):
        rate = float(min(speed * tightest, grip / speed))
        turns += [(float(speed), rate), (-float(speed), rate)]
    return Motions(car.max_speed, car.max_speed, tuple(dict.fromkeys(turns)), _rolling(robot, car))
