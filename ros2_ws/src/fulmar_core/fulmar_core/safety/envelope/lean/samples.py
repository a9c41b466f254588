"""Bodies and surroundings that a rollout supposes: drawn once from the declared ranges, the same on every computer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.braking import Beliefs

COUNT = 16  # a rollout with one sample alone loses every second robot, and more than 16 find no more
SEED = 60


@dataclass(frozen=True)
class Samples:
    """What differs between the samples, each of shape (k,)."""

    mass: np.ndarray  # over the nominal one [-]
    inertia: np.ndarray  # same [-]
    drag: np.ndarray  # factor on the damping of the water [-]
    gain: np.ndarray  # of thrust, or of speeds on wheels [-]
    late_s: np.ndarray  # of commands, beyond what the robot's file says [s]
    force: np.ndarray  # from outside, as a share of the robot's own force [-]
    bearing: np.ndarray  # of that force in the world, spread evenly [rad]
    torque: np.ndarray  # from outside, about the vertical, as a share of the robot's own torque [-]


def draw_samples(robot: Robot, beliefs: Beliefs, count: int = COUNT) -> Samples:
    """Draw samples; each range is covered evenly and to its ends, in an order of its own (a Latin hypercube).

    Args:
        robot: Whose `uncertainty` says how far mass, inertia and drag may differ from the file.
        beliefs: Says the same of thrust, delay, and pushes from outside.
        count: k.
    """
    random = np.random.default_rng(SEED)
    even = np.linspace(0.0, 1.0, count)

    def spread(low: float, high: float) -> np.ndarray:
        return low + (high - low) * random.permutation(even)

    spans, body = robot.uncertainty, robot.body
    mass, inertia = np.array(spans.mass) / body.mass, np.array(spans.yaw_inertia) / body.inertia[2]
    return Samples(
        mass=spread(*mass),
        inertia=spread(*inertia),
        drag=spread(*spans.drag),
        gain=spread(beliefs.thrust, 1.0),
        late_s=spread(0.0, beliefs.delay_s),
        force=np.full(count, beliefs.push),
        bearing=2.0 * np.pi * random.permutation(count) / count,
        torque=spread(-beliefs.torque, beliefs.torque),
    )
