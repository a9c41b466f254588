"""A named set of disturbances, as read from `configs/scenarios/<name>.yaml`, and the worlds drawn from it."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.plausibility import check_plausible
from fulmar_core.config.plausible_ranges import SCENARIO
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.holdability import uncontrollable_losses
from fulmar_core.worlds.link import Link
from fulmar_core.worlds.parts import (
    Actuation,
    Air,
    InertiaChange,
    Kick,
    Push,
    Range,
    Sensing,
    Slope,
    Solar,
    Tether,
    Wave,
)
from fulmar_core.worlds.stuck import draw_changes
from fulmar_core.worlds.world import World

RENAMED = {"drift_stranded": "drift_uncontrollable"}  # word: old name of a scenario
logger = logging.getLogger(__name__)
logger.addHandler(logging.NullHandler())

BEARING = 4  # stream of random numbers, beside those of `counter_rng` and of the simulation


@dataclass(frozen=True)
class Scenario:
    """How far an episode may differ from the nominal robot in a still world."""

    title: str
    sensor_noise: bool  # whether sensors are as the robot's YAML says, or perfect
    # uncertain: over the whole spans of the robot's `uncertainty`; morphology: over those of its `morphology`.
    body: Literal["nominal", "uncertain", "morphology"]
    push: Push = Push()
    wave: Wave = Wave()
    kick: Kick = Kick()
    tether: Tether = Tether()
    slope: Slope = Slope()
    # Mean motion √(μ/r³) of a circular orbit whose gravity gradient turns bodies in space; 0: none [rad/s].
    orbit_rate: float = 0.0
    solar: Solar = Solar()
    air: Air = Air()
    inertia: InertiaChange = InertiaChange()
    actuation: Actuation = Actuation()
    sensing: Sensing = Sensing()
    link: Link = Link()  # between plant and controller, where they are nodes
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


def sensors_in(robot: Robot, scenario: Scenario) -> dict[str, Any]:
    """What a robot's sensors are in a scenario, by name: its own, with an inertial unit that is worse, or dies."""
    specs, sensing = robot.sensors.specs, scenario.sensing
    imu = specs["imu"]
    gyroscope = replace(
        imu.gyroscope,
        std=sensing.gyroscope * imu.gyroscope.std,
        walk=sensing.gyroscope * imu.gyroscope.walk,
    )
    dies_s = imu.dies_s if sensing.gyroscope_dies_s is None else sensing.gyroscope_dies_s
    return {**specs, "imu": replace(imu, gyroscope=gyroscope, dies_s=dies_s)}


def bearing_late_s(scenario: Scenario, *, seed: int, number: int) -> float:
    """Time after the start of an episode, by seed and number, until the air bearing carries the robot [s]."""
    low, high = scenario.bearing_late_s
    if low == high:
        return low
    draws = Draws(seed, np.array([number]), np.array([0]), BEARING)
    return float(draws.uniform(low, high)[0])


def longest_delay(robot: Robot, scenario: Scenario) -> float:
    """Until the latest command of any world acts; only valves open late [s]."""
    return robot.actuators.response.delay_s + scenario.actuation.delay_s + longest_opening(robot, scenario)


def longest_opening(robot: Robot, scenario: Scenario) -> float:
    """By which closed valves of any world open later than others close [s]."""
    drawn_s = scenario.actuation.opening_delay_s[1] if robot.actuators.opens_late else 0.0
    return robot.actuators.response.opening_delay_s + drawn_s


def check_delays(robot: Robot, scenario: Scenario) -> None:
    """Reject a scenario in which valves that open late would begin later than after a control step.

    Raises:
        ConfigError: They would.
    """
    late_s = longest_delay(robot, scenario)
    if longest_opening(robot, scenario) > 0.0 and robot.timing.is_over_within(late_s):
        raise ConfigError(
            f"scenario '{scenario.title}': valves would open up to {late_s:g} s late ('delay_s' and 'opening_delay_s' "
            f"of 'actuation', with the robot's own); at most one control step, {robot.timing.control_s:g} s of "
            f"'{robot.name}', where 'opening_delay_s' is not 0."
        )


def check_no_link(scenario: Scenario, where: str) -> None:
    """Reject a scenario with a link where one is not simulated.

    Args:
        scenario: The scenario.
        where: What runs it, such as `--through mujoco`.

    Raises:
        ConfigError: It has one.
    """
    if scenario.link.acts:
        raise ConfigError(
            f"scenario '{scenario.title}' has a 'link', which {where} does not simulate. Use fulmar run, fulmar up, "
            "or fulmar evaluate --through ros or batch."
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
    delay, noise = draws.uniform(faults.least_delay, 1.0), draws.uniform(faults.least_noise, 1.0)
    bias, scale = draws.normal(1.0, 6), draws.normal(1.0, 6)
    sensor_delay, dropout = draws.uniform(sensing.least_delay, 1.0), draws.uniform(0.0, 1.0)
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
        **draw_changes(robot, faults, draws),
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
