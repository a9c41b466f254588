"""What thrusters burnt in a recorded run: impulse and mass by what was applied, and what is left by the gauge."""

from __future__ import annotations

import numpy as np

from fulmar_bags.contents import Bag
from fulmar_bags.decode import NS
from fulmar_bags.other_readings import Pressures, pressures_of, series
from fulmar_bags.wire_reader import WireReader
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ACTUATORS_STATE, SENSOR_WIRES


def thrust_share(robot: Robot, measured: Pressures, stamp_s: np.ndarray) -> np.ndarray:
    """Share of the full thrust that the measured pressure of the tank leaves at some times, shape (n,) [-].

    Args:
        robot: Its tank has a regulator.
        measured: Readings of the gauge; 1 everywhere without any.
        stamp_s: Shape (n,) [s].
    """
    tank = robot.actuators.tank
    if tank is None or not len(measured):
        return np.ones(len(stamp_s))
    return np.asarray(tank.share(np.interp(stamp_s, measured.stamp_s, measured.pascal)))


def fuel_of(bag: Bag) -> dict[str, float | None] | None:
    """Impulse [N·s] and mass [kg] of what was burnt, and what is left [kg], [-].

    Returns:
        None where nothing was applied for a time, of robots whose tank is no part of their body, and of those that are
        not known here; `left_kg` and `left_share` are None without a gauge.
    """
    try:
        robot = load_robot(str(bag.reading.named.get("robot") or bag.robot))
    except ConfigError:
        return None
    actuators, reader = robot.actuators, WireReader(bag)
    tank = actuators.tank
    if tank is None or not tank.weighs:
        return None
    applied = reader.vectors(ACTUATORS_STATE)
    if len(applied) < 2 or applied.names != actuators.names:
        return None
    lasted_s = np.diff(applied.stamp_ns) / NS
    lasted_s = np.append(lasted_s, np.median(lasted_s))
    share = thrust_share(robot, pressures_of(reader), applied.stamp_ns / NS)
    impulse = float(np.sum(actuators.total_thrust(applied.values.T) * share * lasted_s))
    gauge = series(reader, SENSOR_WIRES["fuel"], "position")
    newest = dict(zip(gauge.names, gauge.values[-1].tolist(), strict=True)) if len(gauge) else {}
    return {
        "impulse_N_s": impulse,
        "used_kg": impulse / tank.exhaust_speed + tank.leak * float(lasted_s.sum()),
        "left_kg": newest.get("mass"),
        "left_share": newest.get("share"),
    }
