"""A named set of disturbances, as read from `configs/scenarios/<name>.yaml`, and the worlds drawn from it."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from fulmar_core.arrays import array_namespace
from fulmar_core.config import load_config
from fulmar_core.counter_rng import Draws
from fulmar_core.disturbances.world import World
from fulmar_core.dynamics.hydrodynamics import GRAVITY
from fulmar_core.errors import ConfigError
from fulmar_core.holdability import uncontrollable_losses
from fulmar_core.paths import config_path
from fulmar_core.plausibility import check_plausible
from fulmar_core.plausible_ranges import SCENARIO
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array

Range = tuple[float, float]

RENAMED = {"drift_stranded": "drift_uncontrollable"}  # word: old name of a scenario
logger = logging.getLogger(__name__)
logger.addHandler(logging.NullHandler())

BEARING = 4  # stream of random numbers, beside those of `counter_rng` and of the simulation


@dataclass(frozen=True)
class Push:
    """A force and a torque, as shares of what the robot itself can bring up (`performance` of its YAML)."""

    force: float = 0.0  # largest [-]
    torque: float = 0.0  # largest, of either sign [-]
    least: float = 0.0  # smallest, as a share of the largest [-]

    def __post_init__(self) -> None:
        if min(self.force, self.torque) < 0.0 or not 0.0 <= self.least <= 1.0:
            raise ValueError("force and torque must not be negative, and 'least' must lie in [0, 1].")


@dataclass(frozen=True)
class Wave:
    """A push that is sinusoidal in the place: an uneven floor (RANS `cfg/task/disturbances`)."""

    force: float = 0.0  # largest amplitude, share of the robot's own [-]
    torque: float = 0.0  # same [-]
    least: float = 0.0  # smallest, as a share of the largest [-]
    wave_number: Range = (0.25, 3.0)  # [rad/m]

    def __post_init__(self) -> None:
        if min(self.force, self.torque, self.wave_number[0]) < 0.0 or not 0.0 <= self.least <= 1.0:
            raise ValueError(
                "force, torque and wave_number must not be negative, 'least' must lie in [0, 1]."
            )
        if self.wave_number[0] > self.wave_number[1]:
            raise ValueError("'wave_number' must be [low, high] with low <= high.")


@dataclass(frozen=True)
class Kick:
    """A push for one control step, again and again (RoboRAN `domain_randomization`)."""

    force: float = 0.0  # largest, share of the robot's own [-]
    every_s: Range = (4.0, 6.0)  # [s]

    def __post_init__(self) -> None:
        if self.force < 0.0:
            raise ValueError("'force' must not be negative.")
        if not 0.0 < self.every_s[0] <= self.every_s[1]:
            raise ValueError("'every_s' must be [low, high] with low <= high, and greater than 0.")


@dataclass(frozen=True)
class Tether:
    """An air line that hangs from somewhere above: a pendulum's pull, and with it a moment."""

    stiffness: Range = (0.0, 0.0)  # pull per metre aside of the anchor [N/m]
    reach: float = 0.0  # farthest that the anchor is from the world's origin [m]
    lever: float = 0.0  # farthest that the line is fastened from the body's origin [m]

    def __post_init__(self) -> None:
        low, high = self.stiffness
        if min(low, self.reach, self.lever) < 0.0 or low > high:
            raise ValueError(
                "'stiffness' must be [low, high] with 0 <= low <= high; reach and lever must not be negative."
            )


@dataclass(frozen=True)
class Slope:
    """A floor that is not level: weight pulls the same way everywhere."""

    milliradians: Range = (0.0, 0.0)
    direction_deg: float = 0.0  # in which it falls, in the world [deg]

    def __post_init__(self) -> None:
        if not 0.0 <= self.milliradians[0] <= self.milliradians[1] <= 100.0:
            raise ValueError("'milliradians' must be [low, high] with 0 <= low <= high <= 100.")


@dataclass(frozen=True)
class Actuation:
    """What may be wrong with the actuators."""

    noise: float = 0.0  # largest error at each control step, uniform, as a share of full command [-]
    least_noise: float = 0.0  # smallest of these, as a share of the largest [-]
    gain: Range = (1.0, 1.0)  # each actuator's own factor, for a whole episode [-]
    delay_s: float = 0.0  # largest delay of commands; with that of opening at most one control step [s]
    opening_delay_s: Range = (0.0, 0.0)  # by which closed valves open late; closing does not wait [s]
    failures: int = 0  # most actuators that stay closed or still for a whole episode
    failure_chance: float = 0.0  # of each of these [-]
    # Only failures, all at once, after which no pose can be held, where a robot has thrusters that can fail so.
    stranding: bool = False  # word: key of scenario files

    def __post_init__(self) -> None:
        if min(self.noise, self.delay_s, self.failures, self.gain[0], self.failure_chance) < 0.0:
            raise ValueError("noise, delay, gain and failures must not be negative.")
        if self.gain[0] > self.gain[1] or self.failure_chance > 1.0:
            raise ValueError("'gain' must be [low, high] with low <= high, 'failure_chance' at most 1.")
        if not 0.0 <= self.opening_delay_s[0] <= self.opening_delay_s[1]:
            raise ValueError("'opening_delay_s' must be [low, high] with 0 <= low <= high.")
        if (self.failures > 0) != (self.failure_chance > 0.0):
            raise ValueError(
                "'failures' and 'failure_chance' need one another: how many may fail, and how often."
            )
        if self.stranding and not self.failures:  # word: key of scenario files
            needs = "'stranding' needs 'failures'"  # word: key of scenario files
            raise ValueError(f"{needs}, the number of those that are lost together.")
        if not 0.0 <= self.least_noise <= 1.0:
            raise ValueError("'least_noise' must lie in [0, 1].")


@dataclass(frozen=True)
class Sensing:
    """What may be wrong with the odometry, beyond what the robot's YAML says; an inertial unit is as it says."""

    noise: float = 1.0  # factor on the robot's own noise [-]
    bias: float = 1.0  # factor on the robot's own biases and errors of scale [-]
    # Largest delay beyond the robot's own. It counts in whole readings: in training half a control step is none [s].
    delay_s: float = 0.0
    dropout: float = 0.0  # largest chance that a measurement is lost [-]
    # Beside the noise of the robot's own sensors, and where these are perfect too; uniform, anew each time.
    velocity_noise: Range = (0.0, 0.0)  # largest error of each measured velocity, for a whole episode [m/s]
    yaw_rate_noise: Range = (0.0, 0.0)  # same for the turn rate [rad/s]

    def __post_init__(self) -> None:
        if min(self.noise, self.bias, self.delay_s, self.dropout) < 0.0 or self.dropout > 1.0:
            raise ValueError("noise, bias, delay and dropout must not be negative, 'dropout' at most 1.")
        for low, high in (self.velocity_noise, self.yaw_rate_noise):
            if not 0.0 <= low <= high:
                raise ValueError(
                    "velocity_noise and yaw_rate_noise must be [low, high] with 0 <= low <= high."
                )

    @property
    def blurred(self) -> bool:
        """Whether measured velocities err beyond the robot's own sensors."""
        return max(*self.velocity_noise, *self.yaw_rate_noise) > 0.0


@dataclass(frozen=True)
class Scenario:
    """How far an episode may differ from the nominal robot in a still world."""

    title: str
    sensor_noise: bool  # whether sensors are as the robot's YAML says, or perfect
    body: Literal["nominal", "uncertain"]  # uncertain: over the whole spans of the robot's `uncertainty`
    push: Push = Push()
    wave: Wave = Wave()
    kick: Kick = Kick()
    tether: Tether = Tether()
    slope: Slope = Slope()
    # Mean motion √(μ/r³) of a circular orbit whose gravity gradient turns bodies in space; 0: none [rad/s].
    orbit_rate: float = 0.0
    actuation: Actuation = Actuation()
    sensing: Sensing = Sensing()
    # Of robots with an air bearing, in simulated plants and emulated devices; batches know neither.
    bearing_late_s: Range = (0.0, 0.0)  # it carries the robot so long after it opens, drawn from the seed [s]
    held_s: Range = (0.0, 0.0)  # from when to when, on air, a hand holds the robot where it is [s]

    def __post_init__(self) -> None:
        for name in ("bearing_late_s", "held_s"):
            low, high = getattr(self, name)
            if not 0.0 <= low <= high < math.inf:
                raise ValueError(
                    f"'{name}' must be [low, high] with 0 <= low <= high, found [{low}, {high}]."
                )
        if self.orbit_rate < 0.0:
            raise ValueError(f"'orbit_rate' = {self.orbit_rate:g} rad/s must not be negative; 0 is none.")
        its = self.sensing
        if not self.sensor_noise and (its.noise, its.bias, its.delay_s, its.dropout) != (1.0, 1.0, 0.0, 0.0):
            raise ValueError(
                "noise, bias, delay_s and dropout of 'sensing' do nothing where 'sensor_noise' is false. "
                "Set it to true, or leave them out."
            )


def bearing_late_s(scenario: Scenario, *, seed: int, number: int) -> float:
    """Time after the start of an episode, by seed and number, until the air bearing carries the robot [s]."""
    low, high = scenario.bearing_late_s
    if low == high:
        return low
    draws = Draws(seed, np.array([number]), np.array([0]), BEARING)
    return float(draws.uniform(low, high)[0])


def longest_delay(robot: Robot, scenario: Scenario) -> float:
    """Until the latest command of any world acts; only valves open late [s]."""
    actuation = scenario.actuation
    opening_s = actuation.opening_delay_s[1] if robot.actuators.opens_late else 0.0
    return robot.actuators.response.latest_s + actuation.delay_s + opening_s


def check_delays(robot: Robot, scenario: Scenario) -> None:
    """Reject a scenario in which commands would be late by more than a control step.

    Raises:
        ConfigError: They would.
    """
    late_s = longest_delay(robot, scenario)
    if robot.timing.is_over_within(late_s):
        raise ConfigError(
            f"scenario '{scenario.title}': commands would be up to {late_s:g} s late ('delay_s' and 'opening_delay_s' "
            f"of 'actuation', with the robot's own); at most one control step, {robot.timing.control_s:g} s of "
            f"'{robot.name}'."
        )


def scenario_path(name: str) -> Path:
    """File of a scenario, by its name or a former one.

    Raises:
        ConfigError: Unknown name.
    """
    return config_path("scenarios", RENAMED.get(name, name))


def load_scenario(name: str) -> Scenario:
    """Read `configs/scenarios/<name>.yaml`; a name of old works for one release, and warns.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    if name in RENAMED:
        logger.warning("scenario '%s' is called '%s' now; use that name.", name, RENAMED[name])
    path = scenario_path(name)
    scenario = load_config(Scenario, path)
    check_plausible(scenario, SCENARIO, path)
    return scenario


def draw_world(robot: Robot, scenario: Scenario, draws: Draws) -> World:
    """Draw the worlds of some episodes.

    The same numbers are drawn whatever the scenario, so that episodes of one seed differ between scenarios in nothing
    but what these say.

    Args:
        robot: Its body and the spans it is uncertain over.
        scenario: What may differ.
        draws: One row for each episode.

    Returns:
        Worlds of as many episodes as `draws` has.

    Raises:
        ConfigError: The robot cannot have this scenario; see `check_delays`.
    """
    check_delays(robot, scenario)
    count = len(robot.actuators.names)
    uncertain = 1.0 if scenario.body == "uncertain" else 0.0
    spans = robot.uncertainty
    mass = around(robot.body.mass, spans.mass, uncertain, draws)
    izz = around(robot.body.inertia[2], spans.yaw_inertia, uncertain, draws)
    drag = around(1.0, spans.drag, uncertain, draws)
    bearing = draws.uniform(-math.pi, math.pi)
    offset = uncertain * draws.uniform(0.0, spans.center_of_mass)
    xp = array_namespace(mass)
    faults, sensing = scenario.actuation, scenario.sensing
    uncontrollable = faults.stranding  # word: key of scenario files
    together = uncontrollable_losses(robot, faults.failures) if uncontrollable else ()
    force, torque = robot.performance.force, robot.performance.torque
    push, wave, kick = scenario.push, scenario.wave, scenario.kick
    size = force * push.force * draws.uniform(push.least, 1.0)
    direction = draws.uniform(-math.pi, math.pi)
    share = draws.uniform(-1.0, 1.0)
    twist = xp.sign(share) * (push.least + (1.0 - push.least) * xp.abs(share))
    wave_size = draws.uniform(wave.least, 1.0)
    wave_number = draws.uniform(*wave.wave_number)
    phases = draws.uniform(-math.pi, math.pi, 2)
    kick_size, kick_period = draws.uniform(0.0, 1.0), draws.uniform(*kick.every_s)
    kick_direction = draws.uniform(-math.pi, math.pi)
    gain_share, lottery = draws.uniform(0.0, 1.0, count), draws.uniform(0.0, 1.0, count)
    chances = draws.uniform(0.0, 1.0, count)
    delay, noise = draws.uniform(0.0, 1.0), draws.uniform(faults.least_noise, 1.0)
    bias, scale = draws.normal(1.0, 6), draws.normal(1.0, 6)
    sensor_delay, dropout = draws.uniform(0.0, 1.0), draws.uniform(0.0, 1.0)
    tether, slope = scenario.tether, scenario.slope
    stiffness = draws.uniform(*tether.stiffness)
    reach, anchor_bearing = draws.uniform(0.0, tether.reach), draws.uniform(-math.pi, math.pi)
    lever, lever_bearing = draws.uniform(0.0, tether.lever), draws.uniform(-math.pi, math.pi)
    fall = 1e-3 * draws.uniform(*slope.milliradians)
    opening_delay = draws.uniform(*faults.opening_delay_s)
    velocity_noise = draws.uniform(*sensing.velocity_noise)
    yaw_rate_noise = draws.uniform(*sensing.yaw_rate_noise)
    downhill = mass * GRAVITY * xp.sin(fall)
    valves = 1.0 if robot.actuators.opens_late else 0.0
    low, high = faults.gain
    # Sums with 1.0 keep their roundings, here and below: policies have learned from these very draws.
    gain = 1.0 + (low + (high - low) * gain_share - 1.0)
    if robot.actuators.response.gain:
        gain = gain * xp.asarray(robot.actuators.response.gain, dtype=gain.dtype)
    own = 1.0 if scenario.sensor_noise else 0.0  # what the robot's YAML says of its sensors
    zero = xp.zeros_like(mass)
    return World(
        mass=mass,
        yaw_inertia=izz,
        com_x=robot.body.center_of_mass[0] + offset * xp.cos(bearing),
        com_y=robot.body.center_of_mass[1] + offset * xp.sin(bearing),
        drag=drag,
        gain=gain.T,
        alive=survivors(lottery, chances, faults, together),
        action_noise=zero + faults.noise * noise,
        action_delay=faults.delay_s * delay,
        opening_delay=valves * opening_delay,
        force_x=size * xp.cos(direction) + downhill * math.cos(math.radians(slope.direction_deg)),
        force_y=size * xp.sin(direction) + downhill * math.sin(math.radians(slope.direction_deg)),
        torque=torque * push.torque * twist,
        wave_force=force * wave.force * wave_size,
        wave_torque=torque * wave.torque * wave_size,
        wave_number=wave_number,
        wave_phase_x=phases[:, 0],
        wave_phase_y=phases[:, 1],
        tether_stiffness=stiffness,
        tether_x=lever * xp.cos(lever_bearing),
        tether_y=lever * xp.sin(lever_bearing),
        anchor_x=reach * xp.cos(anchor_bearing),
        anchor_y=reach * xp.sin(anchor_bearing),
        kick=force * kick.force * kick_size,
        kick_period=kick_period,
        kick_direction=kick_direction,
        noise=zero + own * (1.0 + (sensing.noise - 1.0)),
        velocity_noise=velocity_noise,
        yaw_rate_noise=yaw_rate_noise,
        sensor_bias=(own * (1.0 + (sensing.bias - 1.0)) * bias).T,
        sensor_scale=(own * (1.0 + (sensing.bias - 1.0)) * scale).T,
        sensor_delay=sensing.delay_s * sensor_delay,
        dropout=sensing.dropout * dropout,
    )


def around(nominal: float, span: Range, uncertain: float, draws: Draws) -> Array:
    """Between the ends of a span where the body is `uncertain` (1), the nominal value where it is not (0)."""
    drawn = draws.uniform(span[0], span[1])
    return nominal + uncertain * (drawn - nominal)


def survivors(
    lottery: Array, chances: Array, faults: Actuation, together: tuple[tuple[int, ...], ...]
) -> Array:
    """1 for actuators that work, 0 for those that failed, shape (n, worlds).

    The actuators with the smallest lots are the candidates, each fails with its own chance; where some are to fail
    `together`, the first lot says which, and they share the first chance.
    """
    xp = array_namespace(lottery)
    chance = faults.failure_chance
    if together:
        table = np.zeros((len(together), lottery.shape[1]), dtype=bool)
        for row, lost in zip(table, together, strict=True):
            row[list(lost)] = True
        which = xp.astype(lottery[:, 0] * len(together), xp.int64)
        fails = xp.asarray(table)[which] & (chances[:, :1] < chance)
    else:
        ranks = xp.argsort(xp.argsort(lottery, axis=1), axis=1)
        fails = (ranks < faults.failures) & (chances < chance)
    return 1.0 - xp.astype(fails, lottery.dtype).T
